//! The outline of a box in an image: the convex hull of its projected corners, or of its surface where a
//! lens bends its edges.

use glam::{Affine3A, Vec3, Vec3A};

use crate::collect::camera_model::{CameraModel, NEAR_M};

/// A projected box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outline {
    /// Left, top, right, bottom edge within the image, in pixels.
    pub(crate) edges_px: [f32; 4],
    /// Fraction of its area that lies outside the image.
    pub(crate) truncated: f32,
}

/// Returns the outline of a box around the origin, as a camera sees it; `None` outside the image.
pub(crate) fn outline(
    half_extents: Vec3,
    optical_from_box: &Affine3A,
    camera: &CameraModel,
) -> Option<Outline> {
    let points = if camera.is_pinhole() {
        corners(half_extents, optical_from_box, camera)
    } else {
        surface(half_extents, optical_from_box, camera)
    };
    let whole = hull(points);
    let inside = clip(&whole, camera.width as f32, camera.height as f32);
    let (all, seen) = (area(&whole), area(&inside));
    if seen <= 0.0 {
        return None;
    }
    let min = |axis: usize| inside.iter().map(|p| p[axis]).fold(f32::INFINITY, f32::min);
    let max = |axis: usize| inside.iter().map(|p| p[axis]).fold(f32::NEG_INFINITY, f32::max);
    let truncated = (1.0 - seen / all).clamp(0.0, 1.0);
    Some(Outline { edges_px: [min(0), min(1), max(0), max(1)], truncated })
}

/// Returns the pixels of the corners of a box, and of its edges where they cross the near plane of a
/// pinhole.
fn corners(half_extents: Vec3, optical_from_box: &Affine3A, camera: &CameraModel) -> Vec<[f32; 2]> {
    let sign = |corner: usize, bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let corners: [Vec3A; 8] = std::array::from_fn(|i| {
        let corner = Vec3A::new(sign(i, 0), sign(i, 1), sign(i, 2)) * Vec3A::from(half_extents);
        optical_from_box.transform_point3a(corner)
    });
    let mut points = Vec::with_capacity(20);
    for (index, here) in corners.iter().enumerate() {
        points.extend(camera.project(*here));
        // Each edge once, where it crosses the near plane.
        for other in [1, 2, 4].map(|bit| index | bit).into_iter().filter(|o| *o != index) {
            let there = corners[other];
            if (here.z >= NEAR_M) != (there.z >= NEAR_M) {
                let share = (NEAR_M - here.z) / (there.z - here.z);
                let cut = here.lerp(there, share);
                points.extend(camera.project(Vec3A::new(cut.x, cut.y, cut.z.max(NEAR_M))));
            }
        }
    }
    points
}

/// Returns the pixels of points all over the faces of a box, whose edges a lens bends, and of where the
/// lines between them leave what the lens shows.
fn surface(half_extents: Vec3, optical_from_box: &Affine3A, camera: &CameraModel) -> Vec<[f32; 2]> {
    const STEPS: usize = 8;
    let along = |step: usize| step as f32 * (2.0 / STEPS as f32) - 1.0;
    let mut points = Vec::with_capacity(6 * (STEPS + 1) * (STEPS + 1));
    for face in 0..6 {
        let (axis, side) = (face % 3, if face < 3 { -1.0 } else { 1.0 });
        let place = |i: usize, j: usize| {
            let mut point = [0.0; 3];
            (point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]) =
                (side, along(i), along(j));
            optical_from_box.transform_point3a(Vec3A::from_array(point) * Vec3A::from(half_extents))
        };
        for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j))) {
            let here = place(i, j);
            let shown = camera.project(here);
            points.extend(shown);
            for (i, j) in [(i + 1, j), (i, j + 1)] {
                if i > STEPS || j > STEPS {
                    continue;
                }
                let there = place(i, j);
                if shown.is_some() == camera.project(there).is_some() {
                    continue;
                }
                let (mut inside, mut outside) =
                    if shown.is_some() { (here, there) } else { (there, here) };
                for _ in 0..12 {
                    let middle = (inside + outside) * 0.5;
                    if camera.project(middle).is_some() {
                        inside = middle;
                    } else {
                        outside = middle;
                    }
                }
                points.extend(camera.project(inside));
            }
        }
    }
    points
}

/// Returns the convex hull, counter-clockwise with y up (Andrew's monotone chain).
fn hull(mut points: Vec<[f32; 2]>) -> Vec<[f32; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turn = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let chain = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        let mut chain: Vec<[f32; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && turn(a, b, point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut around = chain(&mut points.iter().copied());
    around.extend(chain(&mut points.iter().rev().copied()));
    around
}

/// Clips a convex polygon to the image (Sutherland and Hodgman).
fn clip(polygon: &[[f32; 2]], width: f32, height: f32) -> Vec<[f32; 2]> {
    let mut kept = polygon.to_vec();
    for (axis, limit, sign) in [(0, 0.0, 1.0), (0, width, -1.0), (1, 0.0, 1.0), (1, height, -1.0)] {
        let depth = |p: [f32; 2]| (p[axis] - limit) * sign;
        let mut next = Vec::with_capacity(kept.len() + 1);
        for (index, here) in kept.iter().enumerate() {
            let there = kept[(index + 1) % kept.len()];
            let (a, b) = (depth(*here), depth(there));
            if a >= 0.0 {
                next.push(*here);
            }
            if (a >= 0.0) != (b >= 0.0) {
                let share = a / (a - b);
                let mut cut = [0, 1].map(|i| here[i] + (there[i] - here[i]) * share);
                cut[axis] = limit;
                next.push(cut);
            }
        }
        kept = next;
    }
    kept
}

fn area(polygon: &[[f32; 2]]) -> f32 {
    let next = polygon.iter().cycle().skip(1);
    let twice: f32 = polygon.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
    twice * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::collect::camera_model::tests::{fisheye, pinhole};

    fn at(x: f32, y: f32, z: f32) -> Option<Outline> {
        let place = Affine3A::from_translation(Vec3::new(x, y, z));
        outline(Vec3::new(1.0, 0.5, 1.0), &place, &pinhole())
    }

    fn close(a: [f32; 4], b: [f32; 4]) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3), "{a:?} is not {b:?}");
    }

    #[test]
    fn the_near_face_bounds_a_box_ahead() {
        let seen = at(0.0, 0.0, 5.0).unwrap();
        close(seen.edges_px, [75.0, 37.5, 125.0, 62.5]);
        assert_eq!(seen.truncated, 0.0);
    }

    #[test]
    fn half_of_a_box_at_the_edge_is_truncated() {
        // Its centre plane is the image's right edge; the near and the far half differ.
        let seen = at(5.0, 0.0, 5.0).unwrap();
        assert!((seen.truncated - 0.5).abs() < 0.2, "{seen:?}");
        assert_eq!(seen.edges_px[2], 200.0);
    }

    #[test]
    fn a_box_behind_or_beside_is_not_in_the_image() {
        assert_eq!(at(0.0, 0.0, -5.0), None);
        assert_eq!(at(50.0, 0.0, 5.0), None);
    }

    #[test]
    fn a_box_around_the_camera_fills_the_image() {
        let seen = at(0.0, 0.0, 0.0).unwrap();
        close(seen.edges_px, [0.0, 0.0, 200.0, 100.0]);
        assert!(seen.truncated > 0.9);
    }

    #[test]
    fn a_box_that_reaches_behind_the_camera_is_clipped_not_mirrored() {
        let seen = at(2.0, 0.0, 0.5).unwrap();
        let [left, _, right, _] = seen.edges_px;
        assert!(left > 100.0 && right == 200.0, "it is on the right: {seen:?}");
    }

    #[test]
    fn a_fisheye_outlines_a_box_beside_and_behind_it() {
        // 60 pixels a radian: its near face, 3 m to the right, reaches from 82° to beyond 90°.
        let place = Affine3A::from_translation(Vec3::new(4.0, 0.0, -0.3));
        let seen = outline(Vec3::new(1.0, 0.5, 0.7), &place, &fisheye()).unwrap();
        let [left, _, right, _] = seen.edges_px;
        // The corners of that face, 0.5 m above and below.
        let from_axis = 3.0_f32.hypot(0.5);
        let corner = from_axis.atan2(0.4) * 3.0 / from_axis;
        assert!((left - (100.0 + 60.0 * corner)).abs() < 0.01, "{seen:?}");
        // The circle of 95 degrees.
        assert!((right - (100.0 + 60.0 * 1.658)).abs() < 0.3, "{seen:?}");
        assert_eq!(
            outline(Vec3::ONE, &Affine3A::from_translation(Vec3::NEG_Z * 9.0), &fisheye()),
            None
        );
    }
}
