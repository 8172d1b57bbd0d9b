//! Whether lines and surfaces are continuous where one record ends and the next begins.

use std::collections::BTreeMap;

use super::{report::Report, subject::Subject};
use crate::{
    cubic::Profile,
    lane::{Lane, LaneIndex, LanePoint},
    placement::wrapped,
    road::{Road, Section},
};

/// Smallest gap that is reported, metres.
const GAP_M: f64 = 0.01;
/// Smallest gap that is an error, metres.
const BREACH_M: f64 = 0.1;
/// Smallest change of direction that is reported as a kink.
const KINK_RAD: f64 = 0.01;
/// Widths above this are not reported as negative, metres: sums are rounded.
const NEGATIVE_M: f64 = -1e-3;

impl Subject<'_> {
    /// Validates each road by itself.
    pub(super) fn geometry(&self, report: &mut Report) {
        for (road, index) in self.network.roads.iter().zip(0..) {
            self.reference_line(road, index, report);
            self.elevation(road, index, report);
            for section in 0..road.sections.len() {
                self.section(road, index, section, report);
            }
        }
    }

    fn reference_line(&self, road: &Road, index: usize, report: &mut Report) {
        let positions = &self.positions.roads[index];
        let place =
            |curve: usize| positions.geometries.get(curve).copied().unwrap_or(positions.offset);
        let id = &road.id;
        if let Some(first) = road.curves.first().filter(|first| first.from_m.abs() > GAP_M) {
            let reason = format!("the first geometry of road {id} begins at s {}", first.from_m);
            report.error(place(0), reason);
        }
        for (later, pair) in road.curves.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            let offset = place(later + 1);
            let end_m = before.from_m + before.length_m;
            if (after.from_m - end_m).abs() > GAP_M {
                let reason = format!(
                    "a geometry of road {id} begins at s {}, but the previous one ends at {end_m}",
                    after.from_m
                );
                report.error(offset, reason);
            }
            let (end, start) = (before.at(before.length_m), after.at(0.0));
            let gap = end.position.distance(start.position);
            if gap > GAP_M {
                let reason = format!(
                    "a geometry of road {id} begins {gap:.3} m from where the previous one ends"
                );
                by_size(report, offset, gap, reason);
            }
            let turn = wrapped(start.heading_rad - end.heading_rad).abs();
            if turn > KINK_RAD {
                let reason = format!("road {id} has a kink of {turn:.3} rad at s {}", after.from_m);
                report.warn(offset, reason);
            }
        }
        for (curve, number) in road.curves.iter().zip(0..) {
            let Some(own_m) = curve.own_length() else { continue };
            let off = (own_m - curve.length_m).abs();
            if off > GAP_M.max(1e-3 * curve.length_m) {
                let reason = format!(
                    "a geometry of road {id} is declared {} m long, but its curve is {own_m:.3} m long",
                    curve.length_m
                );
                report.warn(place(number), reason);
            }
        }
        let end = road.curves.last().map_or(0.0, |last| last.from_m + last.length_m);
        let off = (positions.length_m - end).abs();
        // Longer ones are reported where the road is read.
        if off > GAP_M && positions.length_m <= end + crate::records::BEYOND_M {
            let reason = format!(
                "road {id} is {} m long, but its geometry ends at {end}",
                positions.length_m
            );
            by_size(report, positions.offset, off, reason);
        }
    }

    fn elevation(&self, road: &Road, index: usize, report: &mut Report) {
        let positions = &self.positions.roads[index];
        for (s, step, piece) in steps(&road.elevation, road.length_m) {
            if step > GAP_M {
                let offset = positions.elevations.get(piece).copied().unwrap_or(positions.offset);
                let reason =
                    format!("road {} has an elevation step of {step:.3} m at s {s}", road.id);
                by_size(report, offset, step, reason);
            }
        }
        for (s, step, _) in steps(&road.lane_offset, road.length_m) {
            // A section that begins there may have other lanes without moving any.
            let at_section = road.sections.iter().any(|section| (section.start_m - s).abs() < 0.1);
            if step > GAP_M && !at_section {
                let reason =
                    format!("the lane offset of road {} jumps by {step:.3} m at s {s}", road.id);
                by_size(report, positions.offset, step, reason);
            }
        }
    }

    fn section(&self, road: &Road, index: usize, number: usize, report: &mut Report) {
        let section = &road.sections[number];
        let Some(positions) = self.positions.roads[index].sections.get(number) else { return };
        let id = &road.id;
        if number == 0 && section.start_m.abs() > GAP_M {
            let reason =
                format!("the first lane section of road {id} begins at s {}", section.start_m);
            report.error(positions.offset, reason);
        }
        if section.length_m <= 0.0 && road.length_m > 0.0 {
            let reason =
                format!("the lane section of road {id} at s {} has no length", section.start_m);
            report.warn(positions.offset, reason);
        }
        for (lane, next) in section.lanes.iter().zip(section.lanes.iter().skip(1)) {
            let [lane, next] = [lane, next].map(|lane| self.network.lane(*lane).id);
            let step = if lane > 0 && next < 0 { 2 } else { 1 };
            if lane - next != step {
                let reason =
                    format!("lane ids of road {id} are not consecutive: {next} follows {lane}");
                report.error(positions.lane(next), reason);
            }
        }
        for lane in &section.lanes {
            let lane = self.network.lane(*lane);
            self.widths(road, section, lane, positions.lane(lane.id), report);
        }
    }

    fn widths(
        &self,
        road: &Road,
        section: &Section,
        lane: &Lane,
        offset: usize,
        report: &mut Report,
    ) {
        let name = format!("lane {} of road {}", lane.id, road.id);
        if lane.widths.is_empty() && lane.borders.is_empty() {
            return report.warn(offset, format!("{name} has neither width nor border"));
        }
        let first = lane.widths.knots().next().filter(|_| lane.borders.is_empty());
        if let Some(first) = first.filter(|first| *first > GAP_M) {
            report.error(offset, format!("{name} has no width before {first} m"));
        }
        for (from, to) in intervals(&lane.widths, section.length_m) {
            let lowest = lane.widths.lowest(from, to);
            if lowest < NEGATIVE_M {
                let reason = format!(
                    "{name} has a negative width of {lowest:.3} m between {from} and {to} m"
                );
                report.error(offset, reason);
                break;
            }
        }
        for (ds, step, _) in steps(&lane.widths, section.length_m) {
            if step > GAP_M {
                let reason = format!("the width of {name} jumps by {step:.3} m at {ds} m");
                by_size(report, offset, step, reason);
            }
        }
    }

    /// Validates where lanes continue into others.
    pub(super) fn joints(&self, report: &mut Report) {
        // For each pair of sections the lanes that do not fit, by kind of fault.
        let mut wrong: BTreeMap<Joint, (f64, usize, String)> = BTreeMap::new();
        for lane in &self.network.lanes {
            for next in &lane.successors {
                let next = self.network.lane(*next);
                for (fault, size, reason) in self.faults(lane, next) {
                    let key = (lane.road, lane.section, next.road, next.section, fault);
                    let new = (size, 1, reason);
                    wrong
                        .entry(key)
                        .and_modify(|old| {
                            let count = old.1 + 1;
                            if new.0 > old.0 {
                                *old = new.clone();
                            }
                            old.1 = count;
                        })
                        .or_insert(new);
                }
            }
        }
        for ((road, section, _, _, fault), (size, lanes, reason)) in wrong {
            let positions = &self.positions.roads[road as usize];
            let positions = positions.sections.get(section as usize);
            let offset = positions.map_or(0, |section| section.offset);
            let others =
                if lanes > 1 { format!(", and {} more", lanes - 1) } else { String::new() };
            let reason = format!("{reason}{others}");
            match fault {
                Fault::Kink => report.warn(offset, reason),
                _ => by_size(report, offset, size, reason),
            }
        }
    }

    /// Returns the faults where a lane continues into another, and their magnitude.
    fn faults(&self, lane: &Lane, next: &Lane) -> Vec<(Fault, f64, String)> {
        let network = self.network;
        let end = network.lane_pose(lane.index, lane.length_m, 0.0).0;
        let start = network.lane_pose(next.index, 0.0, 0.0).0;
        let width = |lane: LaneIndex, along_m| network.width(LanePoint { lane, along_m });
        let widths = [width(lane.index, lane.length_m), width(next.index, 0.0)];
        let name = |lane: &Lane| {
            format!("lane {} of road {}", lane.id, network.roads[lane.road as usize].id)
        };
        let (from, to) = (name(lane), name(next));
        let mut faults = Vec::new();
        // A lane may widen to one side where it continues; then the centres lie apart.
        let step = (widths[0] - widths[1]).abs();
        let gap = (end.position - start.position).truncate().length();
        if gap > GAP_M + 0.5 * step {
            let reason = format!("{from} ends {gap:.3} m from where {to} begins");
            faults.push((Fault::Gap, gap, reason));
        }
        let rise = (end.position.z - start.position.z).abs();
        if rise > GAP_M {
            let reason = format!("{from} ends {rise:.3} m above or below where {to} begins");
            faults.push((Fault::Step, rise, reason));
        }
        if step > GAP_M {
            let reason = format!(
                "{from} ends {:.3} m wide, and {to} begins {:.3} m wide",
                widths[0], widths[1]
            );
            faults.push((Fault::Width, step, reason));
        }
        let turn = wrapped(end.heading_rad - start.heading_rad).abs();
        if turn > KINK_RAD && widths[0].max(widths[1]) > GAP_M {
            let reason = format!(
                "{from} ends with a heading {turn:.3} rad from that of {to} at its beginning"
            );
            faults.push((Fault::Kink, turn, reason));
        }
        faults
    }
}

/// Road and section, the next road and section, and the kind of fault between them.
type Joint = (u32, u32, u32, u32, Fault);

/// Kinds of faults where lanes meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    Gap,
    Step,
    Width,
    Kink,
}

fn by_size(report: &mut Report, offset: usize, size_m: f64, reason: String) {
    if size_m > BREACH_M {
        report.error(offset, reason);
    } else {
        report.warn(offset, reason);
    }
}

/// Returns where pieces meet within `length_m`: the position, the step, and the index of the piece
/// that begins there.
fn steps(profile: &Profile, length_m: f64) -> Vec<(f64, f64, usize)> {
    let pieces = profile.pieces();
    let mut steps = Vec::new();
    for (later, pair) in pieces.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        // Of two that begin at the same position, only the later one counts.
        if after.from_m > before.from_m && after.from_m < length_m - 1e-6 && after.from_m > 1e-6 {
            let step = (before.at(after.from_m) - after.at(after.from_m)).abs();
            steps.push((after.from_m, step, later + 1));
        }
    }
    steps
}

/// Returns begin and end of each piece within `length_m`.
fn intervals(profile: &Profile, length_m: f64) -> Vec<(f64, f64)> {
    let pieces = profile.pieces();
    let ends = pieces.iter().skip(1).map(|piece| piece.from_m).chain([length_m]);
    let spans = pieces.iter().zip(ends).map(|(piece, end)| (piece.from_m, end.min(length_m)));
    spans.filter(|(from, to)| to > from).collect()
}
