//! Polygons in the plane: cutting and triangulation.

use glam::{DVec2, DVec3};

/// Most corners of a polygon; a broken file may have any number.
pub(super) const CORNERS_MAX: usize = 400;

/// Returns twice the area, positive for counter-clockwise corners.
pub(super) fn area(corners: &[DVec3]) -> f64 {
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    pairs.map(|(a, b)| a.truncate().perp_dot(b.truncate())).sum()
}

/// Returns the triangles of a polygon with counter-clockwise corners, by ear clipping.
pub(super) fn triangles(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut found = Vec::new();
    let at = |index: usize| corners[index].truncate();
    while left.len() > 3 {
        let count = left.len();
        let ear = (0..count).find(|here| {
            let [a, b, c] = [0, 1, 2].map(|on| left[(here + on) % count]);
            let is_ear = (at(b) - at(a)).perp_dot(at(c) - at(a)) > 0.0;
            is_ear
                && !left.iter().any(|&other| {
                    ![a, b, c].contains(&other) && inside(at(other), [at(a), at(b), at(c)])
                })
        });
        // A polygon that crosses itself runs out of ears.
        let here = ear.unwrap_or(0);
        found.push([0, 1, 2].map(|on| left[(here + on) % count]));
        left.remove((here + 1) % count);
    }
    if let [a, b, c] = left[..] {
        found.push([a, b, c]);
    }
    found
}

fn inside(point: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    let side = |from: DVec2, to: DVec2| (to - from).perp_dot(point - from);
    side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0
}

/// Returns the part of a polygon where `from <= axis . point <= to`.
pub(super) fn slice(corners: &[DVec3], axis: DVec2, from: f64, to: f64) -> Vec<DVec3> {
    let above = half(corners, |point| axis.dot(point.truncate()) - from);
    half(&above, |point| to - axis.dot(point.truncate()))
}

/// Returns the part of a polygon where `depth` is not negative.
fn half(corners: &[DVec3], depth: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (at, &to) in corners.iter().enumerate() {
        let from = corners[(at + corners.len() - 1) % corners.len()];
        let (before, after) = (depth(from), depth(to));
        if (before < 0.0) != (after < 0.0) {
            kept.push(from.lerp(to, before / (before - after)));
        }
        if after >= 0.0 {
            kept.push(to);
        }
    }
    kept
}
