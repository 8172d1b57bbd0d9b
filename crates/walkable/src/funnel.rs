//! The shortest way through a row of portals (the funnel algorithm of Lee and Preparata, 1984).

use glam::Vec2;

/// How much of a portal's width a walker uses on either side of its preferred line.
const BAND: f32 = 0.2;
/// Distance from the ends of a portal. Metres.
const MARGIN_M: f32 = 0.15;

/// A line between two triangles, seen on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Portal {
    pub(crate) right: Vec2,
    pub(crate) left: Vec2,
}

impl Portal {
    /// Returns the part of a portal around a preferred place on it: 0 at the right, 1 at the left.
    pub(crate) fn band(right: Vec2, left: Vec2, side: f32) -> Portal {
        let margin = (MARGIN_M / right.distance(left).max(1e-3)).min(0.5);
        let at = |share: f32| right.lerp(left, share.clamp(margin, 1.0 - margin));
        Portal { right: at(side - BAND), left: at(side + BAND) }
    }
}

/// Returns the corners of the shortest way from a point through all portals to another point, which
/// is the last corner.
pub(crate) fn shortest(from: Vec2, to: Vec2, portals: &[Portal]) -> Vec<Vec2> {
    let end = Portal { right: to, left: to };
    let portal = |index: usize| portals.get(index).copied().unwrap_or(end);
    let mut way = Vec::new();
    let (mut apex, mut right, mut left) = (from, from, from);
    let (mut right_at, mut left_at) = (0, 0);
    let mut index = 0;
    while index <= portals.len() {
        let next = portal(index);
        // Positive to the left.
        let turn = |to: Vec2, by: Vec2| (to - apex).perp_dot(by - apex);
        if turn(right, next.right) >= 0.0 {
            if apex == right || turn(left, next.right) <= 0.0 {
                (right, right_at) = (next.right, index);
            } else {
                way.push(left);
                (apex, right) = (left, left);
                index = left_at + 1;
                (right_at, left_at) = (left_at, left_at);
                continue;
            }
        }
        if turn(left, next.left) <= 0.0 {
            if apex == left || turn(right, next.left) >= 0.0 {
                (left, left_at) = (next.left, index);
            } else {
                way.push(right);
                (apex, left) = (right, right);
                index = right_at + 1;
                (right_at, left_at) = (right_at, right_at);
                continue;
            }
        }
        index += 1;
    }
    way.push(to);
    way.dedup();
    way
}
