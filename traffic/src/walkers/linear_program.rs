//! The velocity nearest to a preferred one under half-plane constraints: the linear programs of
//! optimal reciprocal collision avoidance (van den Berg, Guy, Lin, Manocha, *Reciprocal n-body
//! collision avoidance*, 2011, section 5).

use glam::Vec2;

/// Directions whose cross product is smaller than this are parallel.
const PARALLEL: f32 = 1e-5;

/// A half-plane of velocities: everything to the left of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfPlane {
    pub(super) point: Vec2,
    /// Unit vector along the line.
    pub(super) direction: Vec2,
}

impl HalfPlane {
    /// Returns how far a velocity lies outside.
    fn excess(&self, velocity: Vec2) -> f32 {
        self.direction.perp_dot(self.point - velocity)
    }
}

/// Returns the velocity that satisfies all half-planes and is nearest to `wanted`, at most `limit`
/// long. If there is none, the one that violates them least.
pub(super) fn nearest(planes: &[HalfPlane], limit: f32, wanted: Vec2) -> Vec2 {
    let start = wanted.clamp_length_max(limit);
    match solve(planes, limit, wanted, start, false) {
        Ok(velocity) => velocity,
        Err((failed, velocity)) => least_violation(planes, failed, limit, velocity),
    }
}

/// Adds the half-planes one by one. `Err`: the first that cannot be satisfied, and the velocity
/// before it.
fn solve(
    planes: &[HalfPlane],
    limit: f32,
    wanted: Vec2,
    start: Vec2,
    is_direction: bool,
) -> Result<Vec2, (usize, Vec2)> {
    let mut velocity = start;
    for at in 0..planes.len() {
        if planes[at].excess(velocity) > 0.0 {
            match on_line(planes, at, limit, wanted, is_direction) {
                Some(better) => velocity = better,
                None => return Err((at, velocity)),
            }
        }
    }
    Ok(velocity)
}

/// Returns the best velocity on the border of one half-plane that satisfies the earlier ones.
fn on_line(
    planes: &[HalfPlane],
    at: usize,
    limit: f32,
    wanted: Vec2,
    is_direction: bool,
) -> Option<Vec2> {
    let HalfPlane { point, direction } = planes[at];
    let middle = point.dot(direction);
    let discriminant = middle * middle + limit * limit - point.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let (mut low, mut high) = (-middle - root, -middle + root);
    for other in &planes[..at] {
        let denominator = direction.perp_dot(other.direction);
        let numerator = other.direction.perp_dot(point - other.point);
        if denominator.abs() <= PARALLEL {
            if numerator < 0.0 {
                return None;
            }
            continue;
        }
        let along = numerator / denominator;
        if denominator >= 0.0 {
            high = high.min(along);
        } else {
            low = low.max(along);
        }
        if low > high {
            return None;
        }
    }
    let along = if is_direction {
        if wanted.dot(direction) > 0.0 { high } else { low }
    } else {
        (wanted - point).dot(direction).clamp(low, high)
    };
    Some(point + direction * along)
}

/// Returns the velocity whose largest violation is least.
fn least_violation(planes: &[HalfPlane], first: usize, limit: f32, start: Vec2) -> Vec2 {
    let mut velocity = start;
    let mut largest = 0.0;
    for at in first..planes.len() {
        if planes[at].excess(velocity) <= largest {
            continue;
        }
        let between = |other: &HalfPlane| {
            let turn = planes[at].direction.perp_dot(other.direction);
            let point = if turn.abs() <= PARALLEL {
                if planes[at].direction.dot(other.direction) > 0.0 {
                    return None;
                }
                (planes[at].point + other.point) * 0.5
            } else {
                let way = planes[at].point - other.point;
                planes[at].point + planes[at].direction * (other.direction.perp_dot(way) / turn)
            };
            let direction = (other.direction - planes[at].direction).normalize_or_zero();
            Some(HalfPlane { point, direction })
        };
        let projected: Vec<HalfPlane> = planes[..at].iter().filter_map(between).collect();
        let inwards = planes[at].direction.perp();
        let before = velocity;
        velocity = match solve(&projected, limit, inwards, inwards * limit, true) {
            Ok(better) => better,
            // Rounding only: the velocity before is feasible.
            Err(_) => before,
        };
        largest = planes[at].excess(velocity);
    }
    velocity
}

#[cfg(test)]
mod tests {
    use glam::vec2;

    use super::*;

    fn plane(point: Vec2, direction: Vec2) -> HalfPlane {
        HalfPlane { point, direction }
    }

    #[test]
    fn the_wanted_velocity_is_kept_where_nothing_forbids_it() {
        let left = plane(vec2(1.5, 0.0), vec2(0.0, 1.0));
        assert_eq!(nearest(&[left], 2.0, vec2(1.0, 0.2)), vec2(1.0, 0.2));
        assert_eq!(nearest(&[], 1.0, vec2(3.0, 0.0)), vec2(1.0, 0.0));
    }

    #[test]
    fn the_nearest_allowed_velocity_lies_on_the_border() {
        // Everything with x below 0.5.
        let left = plane(vec2(0.5, 0.0), vec2(0.0, 1.0));
        assert!(nearest(&[left], 2.0, vec2(1.0, 0.3)).distance(vec2(0.5, 0.3)) < 1e-6);
        // And y above 0.6.
        let above = plane(vec2(0.0, 0.6), vec2(1.0, 0.0));
        assert!(nearest(&[left, above], 2.0, vec2(1.0, 0.3)).distance(vec2(0.5, 0.6)) < 1e-6);
    }

    #[test]
    fn contradictions_are_violated_equally() {
        let planes =
            [plane(vec2(-0.5, 0.0), vec2(0.0, 1.0)), plane(vec2(0.5, 0.0), vec2(0.0, -1.0))];
        let velocity = nearest(&planes, 2.0, vec2(1.0, 0.0));
        assert!(velocity.x.abs() < 1e-5, "{velocity}");
    }
}
