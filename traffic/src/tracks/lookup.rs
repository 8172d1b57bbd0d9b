//! Places on tracks: points at an arc length, and projections of points onto tracks.

use glam::{Vec2, Vec3};

use super::Tracks;

/// Step of a projection below which it has converged, metres.
const NEAR_M: f32 = 1e-3;

/// The position of a point relative to a track (Frenet coordinates).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// Arc length; below 0 or beyond the track's length for points before or after it.
    pub(crate) arc_m: f32,
    /// Lateral offset, positive to the left.
    pub(crate) left_m: f32,
    /// Driving direction there, unit length.
    pub(crate) tangent: Vec2,
}

impl Tracks {
    /// Returns the sample at or before `arc_m`, and the fraction of the way to the next, 0 to 1.
    fn sample_at(&self, lane: u32, arc_m: f32) -> (usize, f32) {
        let first = self.first[lane as usize] as usize;
        let last = self.first[lane as usize + 1] as usize - 1;
        let at = (arc_m / self.step_m[lane as usize]).clamp(0.0, (last - first) as f32);
        let index = (at as usize).min(last - first - 1);
        (first + index, at - index as f32)
    }

    /// Returns centre, unit driving direction and curvature (positive to the left) at `arc_m`;
    /// extrapolated straight before the start and after the end.
    pub(crate) fn at(&self, lane: u32, arc_m: f32) -> (Vec3, Vec2, f32) {
        let (i, part) = self.sample_at(lane, arc_m);
        let tangent =
            self.samples[i].tangent.lerp(self.samples[i + 1].tangent, part).normalize_or(Vec2::X);
        let mut point = self.samples[i].point.lerp(self.samples[i + 1].point, part);
        let beyond = arc_m - arc_m.clamp(0.0, self.length(lane));
        point += (tangent * beyond).extend(0.0);
        let curvature = self.samples[i].curvature
            + (self.samples[i + 1].curvature - self.samples[i].curvature) * part;
        (point, tangent, curvature)
    }

    /// Returns the highest speed at `arc_m` that allows every curve ahead on this lane.
    pub(crate) fn curve_speed_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (i, part) = self.sample_at(lane, arc_m);
        self.samples[i].curve_speed
            + (self.samples[i + 1].curve_speed - self.samples[i].curve_speed) * part
    }

    /// Returns the highest speed anywhere on `lane` that its curves allow.
    pub(crate) fn top_curve_speed(&self, lane: u32) -> f32 {
        self.top_curve_speed[lane as usize]
    }

    /// Returns half the lane's width at `arc_m`.
    pub(crate) fn half_width_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (i, part) = self.sample_at(lane, arc_m);
        self.samples[i].half_width
            + (self.samples[i + 1].half_width - self.samples[i].half_width) * part
    }

    /// Projects `point` onto the track, starting near `hint_m`.
    ///
    /// Newton's method on the arc length: two steps suffice from a hint within a few metres, and one
    /// on a straight track.
    pub(crate) fn project(&self, lane: u32, point: Vec2, hint_m: f32) -> Projection {
        let length = self.length(lane);
        let mut arc_m = hint_m.clamp(0.0, length);
        let (mut centre, mut tangent, mut curvature) = self.flat_at(lane, arc_m);
        let mut offset = point - centre;
        for _ in 0..3 {
            let left = tangent.perp_dot(offset);
            let stretch = (1.0 - curvature * left).clamp(0.4, 2.5);
            let step_m = (arc_m + tangent.dot(offset) / stretch).clamp(0.0, length) - arc_m;
            if step_m.abs() < NEAR_M {
                break;
            }
            arc_m += step_m;
            (centre, tangent, curvature) = self.flat_at(lane, arc_m);
            offset = point - centre;
        }
        let beyond = tangent.dot(offset);
        let beyond = if arc_m <= 0.0 {
            beyond.min(0.0)
        } else if arc_m >= length {
            beyond.max(0.0)
        } else {
            0.0
        };
        Projection { arc_m: arc_m + beyond, left_m: tangent.perp_dot(offset), tangent }
    }

    /// Returns the position of `point` relative to the straight continuation of a track at the sample
    /// nearest to `hint_m`, with the distance along it from there.
    #[inline]
    pub(crate) fn beside_hint(&self, lane: u32, point: Vec2, hint_m: f32) -> Projection {
        let (count, step_m) = self.samples(lane);
        let index = ((hint_m / step_m + 0.5) as usize).min(count - 1);
        let at = self.first[lane as usize] as usize + index;
        let (offset, tangent) =
            (point - self.samples[at].point.truncate(), self.samples[at].tangent);
        Projection { arc_m: tangent.dot(offset), left_m: tangent.perp_dot(offset), tangent }
    }

    /// Returns the driving direction at the begin of a track.
    pub(crate) fn first_tangent(&self, lane: u32) -> Vec2 {
        self.samples[self.first[lane as usize] as usize].tangent
    }

    /// Returns the driving direction at the end of a track.
    pub(crate) fn last_tangent(&self, lane: u32) -> Vec2 {
        self.samples[self.first[lane as usize + 1] as usize - 1].tangent
    }

    /// Returns what [`Tracks::at`] returns, without the height.
    #[inline]
    fn flat_at(&self, lane: u32, arc_m: f32) -> (Vec2, Vec2, f32) {
        let (i, part) = self.sample_at(lane, arc_m);
        let tangent =
            self.samples[i].tangent.lerp(self.samples[i + 1].tangent, part).normalize_or(Vec2::X);
        let point =
            self.samples[i].point.truncate().lerp(self.samples[i + 1].point.truncate(), part);
        let beyond = arc_m - arc_m.clamp(0.0, self.length(lane));
        let curvature = self.samples[i].curvature
            + (self.samples[i + 1].curvature - self.samples[i].curvature) * part;
        (point + tangent * beyond, tangent, curvature)
    }

    /// Returns the arc length and the squared distance of the sample of `lane` nearest to `point`.
    pub(crate) fn nearest_sample(&self, lane: u32, point: Vec2) -> (f32, f32) {
        let (count, step) = self.samples(lane);
        let mut best = (0.0, f32::INFINITY);
        for index in 0..count {
            let distance = self.sample_point(lane, index).truncate().distance_squared(point);
            if distance < best.1 {
                best = (index as f32 * step, distance);
            }
        }
        best
    }

    /// Returns the track nearest to a point at any distance, and the arc length there.
    pub(crate) fn nearest(&self, point: Vec2) -> Option<(u32, f32)> {
        let mut best: Option<(f32, u32, f32)> = None;
        for lane in (0..self.count() as u32).filter(|&lane| self.has(lane)) {
            let (arc_m, distance) = self.nearest_sample(lane, point);
            if best.is_none_or(|(least, ..)| distance < least) {
                best = Some((distance, lane, arc_m));
            }
        }
        best.map(|(_, lane, arc_m)| (lane, arc_m))
    }
}
