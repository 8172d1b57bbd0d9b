//! Checks of the keypoints and amodal masks of one frame.

use client_lib::{KEYPOINT_COUNT, KEYPOINTS};
use glam::Vec3A;

use crate::collect::{
    camera_model::CameraModel,
    decode,
    format::{View, ViewKeypoints},
    label_settings::LabelSettings,
    rle::Rle,
};

/// How far a keypoint may lie from the pixel that its position is projected to. Pixels.
const KEYPOINT_TOLERANCE_PX: f32 = 0.05;

/// The image of a camera that labels are compared with.
pub(crate) struct LabelledImage<'a> {
    pub(crate) image: &'a decode::Image,
    /// The ids of its pixels.
    pub(crate) ids: &'a [u32],
    pub(crate) camera: &'a CameraModel,
    pub(crate) labels: LabelSettings,
}

impl LabelledImage<'_> {
    /// Returns what is wrong with the amodal mask of an object.
    pub(crate) fn mask_fault(&self, id: u32, view: &View) -> Option<String> {
        match (&view.amodal_mask, self.labels.amodal_masks) {
            (None, false) => None,
            (None, true) => Some("it has no mask".to_owned()),
            (Some(_), false) => Some("it has a mask, for which the settings do not ask".to_owned()),
            (Some(mask), true) => self.compare_mask(id, view, mask).err(),
        }
    }

    fn compare_mask(&self, id: u32, view: &View, mask: &Rle) -> Result<(), String> {
        let [width, height] = [self.image.width, self.image.height];
        if mask.size.map(|size| size as usize) != [height, width] {
            let [tall, wide] = mask.size;
            return Err(format!("its mask is {wide} x {tall}, the image {width} x {height}"));
        }
        let runs = mask.runs()?;
        let mut spans = Vec::with_capacity(runs.len() / 2);
        let mut begin = 0;
        for pair in runs.chunks_exact(2) {
            spans.push(begin + pair[0]..begin + pair[0] + pair[1]);
            begin += pair[0] + pair[1];
        }
        let area: u32 = spans.iter().map(|span| span.end - span.start).sum();
        if area != view.unoccluded_px {
            let stated = view.unoccluded_px;
            return Err(format!("unoccluded_px is {stated}, but the mask has {area} pixels"));
        }
        let [left, top, right, bottom] = view.visible_box_px.map(|edge| edge as usize);
        if right > width || bottom > height {
            return Err("visible_box_px leaves the image".to_owned());
        }
        let mut spans = spans.iter().peekable();
        for (x, y) in (left..right).flat_map(|x| (top..bottom).map(move |y| (x, y))) {
            if self.ids[y * width + x] != id {
                continue;
            }
            let pixel = (x * height + y) as u32;
            while spans.next_if(|span| span.end <= pixel).is_some() {}
            if spans.peek().is_none_or(|span| pixel < span.start) {
                return Err(format!("pixel {x}, {y} shows it, but lies outside of the mask"));
            }
        }
        Ok(())
    }

    /// Returns what is wrong with the keypoints of an actor.
    pub(crate) fn keypoints_fault(&self, id: u32, has: bool, view: &View) -> Option<String> {
        match (&view.keypoints, has) {
            (None, false) => None,
            (None, true) => Some("it has no keypoints".to_owned()),
            (Some(_), false) => Some("it has keypoints in the image and none in space".to_owned()),
            (Some(found), true) => {
                (0..KEYPOINT_COUNT).find_map(|index| self.keypoint_fault(id, found, index))
            }
        }
    }

    fn keypoint_fault(&self, id: u32, found: &ViewKeypoints, index: usize) -> Option<String> {
        let name = KEYPOINTS[index];
        let ([u, v], seen) = (found.px[index], found.visibility[index]);
        let projected = self
            .camera
            .projection
            .optical_pixel(Vec3A::from_array(found.in_optical_m[index]).as_dvec3());
        let (width, height) = (self.image.width, self.image.height);
        let is_inside =
            |u: f32, v: f32| (0.0..width as f32).contains(&u) && (0.0..height as f32).contains(&v);
        match (seen, projected.map(|px| px.as_vec2().to_array())) {
            (0, _) if [u, v] != [0.0; 2] => {
                Some(format!("{name} is outside of the image, but at {u}, {v}"))
            }
            (0, Some([x, y]))
                if is_inside(x - KEYPOINT_TOLERANCE_PX, y - KEYPOINT_TOLERANCE_PX)
                    && is_inside(x + KEYPOINT_TOLERANCE_PX, y + KEYPOINT_TOLERANCE_PX) =>
            {
                Some(format!("{name} is in the image at {x}, {y}, but is said to be outside"))
            }
            (0, _) => None,
            (1 | 2, Some([x, y]))
                if is_inside(u, v) && (x - u).hypot(y - v) <= KEYPOINT_TOLERANCE_PX =>
            {
                let near = |at: f32, size: usize| {
                    (at as usize).saturating_sub(1)..(at as usize + 2).min(size)
                };
                let shows = |row: usize| self.ids[row * width..][near(u, width)].contains(&id);
                (seen == 2 && !near(v, height).any(shows)).then(|| {
                    format!(
                        "{name} is said to be visible at {u}, {v}, where the image shows others"
                    )
                })
            }
            (1 | 2, projected) => {
                Some(format!("{name} is at {u}, {v}, but is projected to {projected:?}"))
            }
            (other, _) => Some(format!("{name} has the visibility {other}; use 0, 1 or 2")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::{camera_model::tests::pinhole, format::Transform};

    fn view(mask: Option<Rle>, keypoints: Option<ViewKeypoints>) -> View {
        View {
            optical_from_box: Transform {
                position_m: [0.0; 3],
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            },
            visible_box_px: [10, 20, 12, 22],
            projected_box_px: [10.0, 20.0, 12.0, 22.0],
            visible_px: 4,
            unoccluded_px: 6,
            occluded_fraction: 1.0 / 3.0,
            truncated_fraction: 0.0,
            keypoints,
            amodal_mask: mask,
        }
    }

    /// An image of 200 × 100 pixels in which columns 10 and 11 of rows 20 and 21 show the actor 7.
    fn with<T>(labels: LabelSettings, check: impl FnOnce(&LabelledImage) -> T) -> T {
        let image = decode::Image { width: 200, height: 100, bytes: Vec::new() };
        let mut ids = vec![0; 20_000];
        for row in [20, 21] {
            ids[row * 200 + 10..row * 200 + 12].fill(7);
        }
        check(&LabelledImage { image: &image, ids: &ids, camera: &pinhole(), labels })
    }

    #[test]
    fn a_mask_must_hold_the_visible_pixels_and_have_the_stated_area() {
        let asked = LabelSettings { keypoints: false, amodal_masks: true };
        let fault = |runs: &[u32]| {
            let mask = Rle::new([200, 100], runs);
            with(asked, |image| image.mask_fault(7, &view(Some(mask), None)))
        };
        // Rows 20 to 22 of both columns.
        assert_eq!(fault(&[1020, 3, 97, 3, 20_000 - 1123]), None);
        let said = fault(&[1020, 2, 98, 2, 20_000 - 1122]).unwrap();
        assert!(said.contains("unoccluded_px is 6, but the mask has 4 pixels"), "{said}");
        let said = fault(&[1021, 3, 97, 3, 20_000 - 1124]).unwrap();
        assert!(said.contains("pixel 10, 20 shows it"), "{said}");
        let said = fault(&[1020, 6, 20_000 - 1026]).unwrap();
        assert!(said.contains("pixel 11, 20 shows it"), "{said}");
        let said = fault(&[1020, 6]).unwrap();
        assert!(said.contains("have 1026 pixels"), "{said}");
        let turned = Rle::new([100, 200], &[1020, 6, 20_000 - 1026]);
        let said = with(asked, |image| image.mask_fault(7, &view(Some(turned), None))).unwrap();
        assert!(said.contains("its mask is 100 x 200"), "{said}");
        let said = with(asked, |image| image.mask_fault(7, &view(None, None))).unwrap();
        assert_eq!(said, "it has no mask");
    }

    #[test]
    fn keypoints_must_lie_where_they_are_projected_to_and_show_their_walker() {
        let labels = LabelSettings::default();
        let first = |in_optical_m: [f32; 3], px: [f32; 2], seen: u8| {
            // The others are behind the camera.
            let mut found = ViewKeypoints {
                in_optical_m: [[0.0, 0.0, -1.0]; KEYPOINT_COUNT],
                px: [[0.0; 2]; KEYPOINT_COUNT],
                visibility: [0; KEYPOINT_COUNT],
            };
            (found.in_optical_m[0], found.px[0], found.visibility[0]) = (in_optical_m, px, seen);
            with(labels, |image| image.keypoints_fault(7, true, &view(None, Some(found))))
        };
        // 100 px a radian, principal point (100, 50): (11, 21) at 1 m.
        let at = [-0.89, -0.29, 1.0];
        assert_eq!(first(at, [11.0, 21.0], 2), None);
        assert_eq!(first(at, [11.0, 21.0], 1), None);
        for (found, said) in [
            (first(at, [11.5, 21.0], 2), "nose is at 11.5, 21, but is projected to"),
            (first(at, [0.0, 0.0], 0), "nose is in the image at"),
            (first(at, [11.0, 21.0], 0), "nose is outside of the image, but at 11, 21"),
            (first(at, [11.0, 21.0], 3), "nose has the visibility 3"),
            (first([-0.5, -0.29, 1.0], [50.0, 21.0], 2), "where the image shows others"),
        ] {
            let found = found.unwrap();
            assert!(found.contains(said), "{found}");
        }
        let none = with(labels, |image| image.keypoints_fault(7, true, &view(None, None)));
        assert_eq!(none.as_deref(), Some("it has no keypoints"));
    }
}
