//! The course of the ego vehicle: points along the lanes of its route.

use glam::{Vec2, Vec3};
use mesh::RandomStream;
use road::{LaneIndex, LanePoint, LaneType, Network};

/// Distance between two points. Metres.
const SPACING_M: f32 = 1.0;
/// Points behind and ahead of the last known one among which a vehicle is looked for.
const BEHIND: usize = 5;
const AHEAD: usize = 25;

/// A point at the centre of a lane.
#[derive(Clone, Copy, Debug)]
struct CoursePoint {
    position: Vec3,
    /// The direction of travel, of unit length.
    tangent: Vec2,
    half_width_m: f32,
    limit_mps: f32,
}

/// A route as a chain of points, each a metre from the next.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    points: Vec<CoursePoint>,
}

/// Where a vehicle is on its course.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OnCourse {
    /// The index of the nearest point.
    nearest: usize,
    /// Distance from the beginning along the course. Metres.
    pub(crate) along_m: f32,
    /// Distance to the left of the course. Metres.
    pub(crate) left_m: f32,
    /// Half the width of the lane there. Metres.
    pub(crate) half_width_m: f32,
    /// The speed limit there. Metres per second.
    pub(crate) limit_mps: f32,
    /// The direction of the course, of unit length.
    pub(crate) tangent: Vec2,
}

/// The limit of a lane without one. Metres per second.
const LIMIT_MPS: f64 = 13.9;

impl Course {
    /// Follows the lanes from `start` for `length_m`, with random turns; `None` if a lane ends before.
    pub(crate) fn new(
        network: &Network,
        start: LanePoint,
        length_m: f32,
        random: &mut RandomStream,
    ) -> Option<Course> {
        let count = (length_m / SPACING_M).ceil() as usize + 1;
        let mut points = Vec::with_capacity(count);
        let mut at = start;
        while points.len() < count {
            let lane = network.lane(at.lane);
            if at.along_m > lane.length_m {
                let next: Vec<LaneIndex> = lane
                    .successors
                    .iter()
                    .copied()
                    .filter(|&next| network.lane(next).kind == LaneType::Driving)
                    .collect();
                if next.is_empty() {
                    return None;
                }
                at = LanePoint { lane: *random.choose(&next), along_m: at.along_m - lane.length_m };
                continue;
            }
            let place = network.place(at);
            points.push(CoursePoint {
                position: place.position.as_vec3(),
                tangent: Vec2::from_angle(place.heading_rad as f32),
                half_width_m: 0.5 * network.width(at) as f32,
                limit_mps: network.speed_limit(at).unwrap_or(LIMIT_MPS) as f32,
            });
            at.along_m += f64::from(SPACING_M);
        }
        Some(Course { points })
    }

    /// Returns the length. Metres.
    pub(crate) fn length_m(&self) -> f32 {
        (self.points.len() - 1) as f32 * SPACING_M
    }

    /// Returns where a vehicle at `position` is that was last seen at `last`.
    pub(crate) fn locate(&self, position: Vec3, last: &OnCourse) -> OnCourse {
        let first = last.nearest.saturating_sub(BEHIND);
        let end = (last.nearest + AHEAD).min(self.points.len());
        let distance = |index: &usize| self.points[*index].position.distance_squared(position);
        let nearest =
            (first..end).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(last.nearest);
        let point = &self.points[nearest];
        let offset = (position - point.position).truncate();
        OnCourse {
            nearest,
            along_m: nearest as f32 * SPACING_M + offset.dot(point.tangent),
            left_m: point.tangent.perp_dot(offset),
            half_width_m: point.half_width_m,
            limit_mps: point.limit_mps,
            tangent: point.tangent,
        }
    }

    /// Returns the point `ahead_m` metres after a place, or the last one beyond the end, `left_m`
    /// metres to the left of it.
    pub(crate) fn beside(&self, of: &OnCourse, ahead_m: f32, left_m: f32) -> Vec3 {
        let index = ((of.along_m + ahead_m) / SPACING_M).max(0.0).round() as usize;
        let point = &self.points[index.min(self.points.len() - 1)];
        point.position + (left_m * point.tangent.perp()).extend(0.0)
    }

    /// Calls `stretch` with the ends and half the width of each stretch that begins within `reach_m`
    /// of a place along the course, behind and ahead.
    pub(crate) fn stretches(
        &self,
        of: &OnCourse,
        reach_m: f32,
        mut stretch: impl FnMut(Vec2, Vec2, f32),
    ) {
        let index = |along_m: f32| (along_m / SPACING_M).max(0.0) as usize;
        let end = (index(of.along_m + reach_m) + 2).min(self.points.len());
        let first = index(of.along_m - reach_m).min(end);
        for pair in self.points[first..end].windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|point| point.position.truncate());
            stretch(from, to, pair[0].half_width_m);
        }
    }

    /// Returns the first point.
    pub(crate) fn start(&self) -> Vec3 {
        self.points[0].position
    }
}
