//! The outline of a box in an image: the convex hull of its projected corners.

use glam::{Affine3A, Vec3, Vec3A};

use crate::collect::{sensors::Pinhole, silhouette::NEAR_M};

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
    camera: &Pinhole,
) -> Option<Outline> {
    let sign = |corner: usize, bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let corners: [Vec3A; 8] = std::array::from_fn(|i| {
        let corner = Vec3A::new(sign(i, 0), sign(i, 1), sign(i, 2)) * Vec3A::from(half_extents);
        optical_from_box.transform_point3a(corner)
    });
    let mut points = Vec::with_capacity(20);
    for (index, here) in corners.iter().enumerate() {
        if here.z >= NEAR_M {
            points.push(camera.project(*here));
        }
        // Each edge once, where it crosses the near plane.
        for other in [1, 2, 4].map(|bit| index | bit).into_iter().filter(|o| *o != index) {
            let there = corners[other];
            if (here.z >= NEAR_M) != (there.z >= NEAR_M) {
                let share = (NEAR_M - here.z) / (there.z - here.z);
                points.push(camera.project(here.lerp(there, share)));
            }
        }
    }
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

    const CAMERA: Pinhole = Pinhole { width: 200, height: 100, focal_px: 100.0 };

    fn at(x: f32, y: f32, z: f32) -> Option<Outline> {
        let place = Affine3A::from_translation(Vec3::new(x, y, z));
        outline(Vec3::new(1.0, 0.5, 1.0), &place, &CAMERA)
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
}
