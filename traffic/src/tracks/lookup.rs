//! Places on tracks: points at an arc length, and projections of points onto tracks.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use super::{LineHead, Sample, Summary, Tracks};

/// Step of a projection below which it has converged, metres.
const NEAR_M: f32 = 1e-3;
/// Bound on the error of an interpolated height: far above the spacing of numbers at the height of any
/// town. Metres.
const ROUNDING_M: f32 = 0.01;

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

/// A point of a track in the ground plane.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FlatPlace {
    pub(crate) centre: Vec2,
    /// Driving direction, unit length.
    pub(crate) tangent: Vec2,
    /// Positive to the left.
    pub(crate) curvature: f32,
}

/// The last projection of a point, which is not computed again while the point stays.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Memo {
    lane: u32,
    point: Vec2,
    hint_m: f32,
    result: Option<Projection>,
}

impl Memo {
    /// Returns what [`Tracks::project`] returns.
    pub(crate) fn project(
        &mut self,
        tracks: &Tracks,
        lane: u32,
        point: Vec2,
        hint_m: f32,
    ) -> Projection {
        match self.result {
            Some(result) if self.lane == lane && self.point == point && self.hint_m == hint_m => {
                result
            }
            _ => {
                let result = tracks.project(lane, point, hint_m);
                *self = Memo { lane, point, hint_m, result: Some(result) };
                result
            }
        }
    }
}

impl Tracks {
    /// Returns the samples of a lane that has a track.
    #[inline(always)]
    fn line(&self, lane: u32) -> Line<'_> {
        let LineHead { first, count, step_m, length_m } = self.lines[lane as usize];
        Line { samples: &self.samples[first as usize..][..count as usize], step_m, length_m }
    }

    /// Returns centre, unit driving direction and curvature (positive to the left) at `arc_m`;
    /// extrapolated straight before the start and after the end.
    pub(crate) fn at(&self, lane: u32, arc_m: f32) -> (Vec3, Vec2, f32) {
        let line = self.line(lane);
        let (from, to, part) = line.at(arc_m);
        let tangent = from.tangent.lerp(to.tangent, part).normalize_or(Vec2::X);
        let mut point = from.point.lerp(to.point, part);
        let beyond = arc_m - arc_m.clamp(0.0, line.length_m);
        point += (tangent * beyond).extend(0.0);
        (point, tangent, from.curvature + (to.curvature - from.curvature) * part)
    }

    /// Returns the curvature of [`Tracks::at`].
    pub(crate) fn curvature_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (from, to, part) = self.line(lane).at(arc_m);
        from.curvature + (to.curvature - from.curvature) * part
    }

    /// Returns the height of the point of [`Tracks::at`].
    pub(crate) fn height_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (from, to, part) = self.line(lane).at(arc_m);
        from.point.lerp(to.point, part).z
    }

    /// Returns whether all of a track lies within `within_m` of a height, with a margin for rounding.
    pub(crate) fn is_level_with(&self, lane: u32, height_m: f32, within_m: f32) -> bool {
        let Summary { low_m, high_m, .. } = self.summaries[lane as usize];
        let within_m = within_m - ROUNDING_M;
        height_m - low_m < within_m && high_m - height_m < within_m
    }

    /// Returns the highest speed at `arc_m` that allows every curve ahead on this lane.
    pub(crate) fn curve_speed_at(&self, lane: u32, arc_m: f32) -> f32 {
        if arc_m <= 0.0 {
            return self.summaries[lane as usize].curve_speed;
        }
        let (from, to, part) = self.line(lane).at(arc_m);
        from.curve_speed + (to.curve_speed - from.curve_speed) * part
    }

    /// Returns the highest speed anywhere on `lane` that its curves allow.
    pub(crate) fn top_curve_speed(&self, lane: u32) -> f32 {
        self.top_curve_speed[lane as usize]
    }

    /// Returns half the lane's width at `arc_m`.
    pub(crate) fn half_width_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (from, to, part) = self.line(lane).at(arc_m);
        from.half_width + (to.half_width - from.half_width) * part
    }

    /// Projects `point` onto the track, starting near `hint_m`.
    ///
    /// Newton's method on the arc length: two steps suffice from a hint within a few metres, and one
    /// on a straight track.
    pub(crate) fn project(&self, lane: u32, point: Vec2, hint_m: f32) -> Projection {
        let line = self.line(lane);
        let arc_m = hint_m.clamp(0.0, line.length_m);
        line.project_from(point, arc_m, line.flat_at(arc_m))
    }

    /// As [`Tracks::project`], from `start`: the point of the track at `arc_m`, which is within it.
    #[inline]
    pub(crate) fn project_from(
        &self,
        lane: u32,
        point: Vec2,
        arc_m: f32,
        start: FlatPlace,
    ) -> Projection {
        self.line(lane).project_from(point, arc_m, start)
    }

    /// Returns the index of the sample nearest to `arc_m`.
    pub(crate) fn index_near(&self, lane: u32, arc_m: f32) -> usize {
        let (count, step_m) = self.samples(lane);
        ((arc_m / step_m + 0.5) as usize).min(count - 1)
    }

    /// Returns the point of a track at an arc length within it.
    pub(crate) fn flat_at(&self, lane: u32, arc_m: f32) -> FlatPlace {
        self.line(lane).flat_at(arc_m.clamp(0.0, self.length(lane)))
    }

    /// Returns the driving direction at the begin of a track.
    pub(crate) fn first_tangent(&self, lane: u32) -> Vec2 {
        self.summaries[lane as usize].tangents[0]
    }

    /// Returns the driving direction at the end of a track.
    pub(crate) fn last_tangent(&self, lane: u32) -> Vec2 {
        self.summaries[lane as usize].tangents[1]
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

/// The samples of one lane.
struct Line<'a> {
    samples: &'a [Sample],
    step_m: f32,
    length_m: f32,
}

impl<'a> Line<'a> {
    /// Returns the samples before and after `arc_m`, and the part of the way between them, 0 to 1.
    #[inline(always)]
    fn at(&self, arc_m: f32) -> (&'a Sample, &'a Sample, f32) {
        let last = self.samples.len() - 1;
        let at = (arc_m / self.step_m).clamp(0.0, last as f32);
        let index = (at as usize).min(last - 1);
        (&self.samples[index], &self.samples[index + 1], at - index as f32)
    }

    /// Returns what [`Tracks::at`] returns within the track, without the height.
    #[inline(always)]
    fn flat_at(&self, arc_m: f32) -> FlatPlace {
        let (from, to, part) = self.at(arc_m);
        let tangent = from.tangent.lerp(to.tangent, part).normalize_or(Vec2::X);
        let centre = from.point.truncate().lerp(to.point.truncate(), part);
        let curvature = from.curvature + (to.curvature - from.curvature) * part;
        FlatPlace { centre, tangent, curvature }
    }

    /// See [`Tracks::project_from`].
    #[inline(always)]
    fn project_from(&self, point: Vec2, mut arc_m: f32, start: FlatPlace) -> Projection {
        let length = self.length_m;
        let FlatPlace { mut centre, mut tangent, mut curvature } = start;
        let mut offset = point - centre;
        for _ in 0..3 {
            let left = tangent.perp_dot(offset);
            let stretch = (1.0 - curvature * left).clamp(0.4, 2.5);
            let step_m = (arc_m + tangent.dot(offset) / stretch).clamp(0.0, length) - arc_m;
            if step_m.abs() < NEAR_M {
                break;
            }
            arc_m += step_m;
            FlatPlace { centre, tangent, curvature } = self.flat_at(arc_m);
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::maps;

    #[test]
    fn what_is_known_of_a_track_agrees_with_its_samples() {
        let tracks = Tracks::new(&maps::town());
        let (mut level, mut apart) = (0, 0);
        for lane in (0..tracks.count() as u32).filter(|&lane| tracks.has(lane)) {
            let (samples, length_m) = (tracks.samples_of(lane), tracks.length(lane));
            assert_eq!(tracks.first_tangent(lane), samples[0].tangent);
            assert_eq!(tracks.last_tangent(lane), samples[samples.len() - 1].tangent);
            assert_eq!(tracks.curve_speed_at(lane, 0.0), samples[0].curve_speed);
            assert_eq!(tracks.curve_speed_at(lane, -3.0), samples[0].curve_speed);
            for part in [0.0, 0.1, 0.37, 0.5, 0.81, 1.0] {
                let height_m = tracks.height_at(lane, part * length_m);
                for off_m in [-4.0, -2.9, 0.0, 1.5, 3.1] {
                    let is_level = tracks.is_level_with(lane, height_m + off_m, 3.0);
                    assert!(!is_level || f32::abs(off_m) < 3.0, "lane {lane} {height_m} {off_m}");
                    *(if is_level { &mut level } else { &mut apart }) += 1;
                }
            }
        }
        assert!(level > 100 && apart > 100, "{level} {apart}");
    }
}
