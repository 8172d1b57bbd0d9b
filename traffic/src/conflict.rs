//! Conflict areas between the tracks of a conflict zone: a junction, or a narrow curve.
//!
//! Two tracks *conflict* where a vehicle on one leaves no room for a vehicle on the other, which
//! depends on the size of both. Tracks that share their entry do not conflict: car following
//! handles them. Tracks that share their exit *merge*: the second vehicle follows the first. All
//! others *cross*: the second waits until the first has left.

use std::borrow::Cow;

use bake::Parts;
use bytemuck::{Pod, Zeroable, cast_slice};
use glam::{Vec2, Vec3};

use crate::{
    swept_path::{self, BUS_M, Station},
    tracks::{NONE, Tracks},
};

/// Clearance between two vehicles that pass each other, and between two buses.
const CLEARANCE_M: f32 = 0.3;
const BUSES_CLEARANCE_M: f32 = 0.15;
/// Off-tracking below this counts as driving straight.
const SWING_M: f32 = 0.2;
/// Vehicles on tracks farther apart than this cannot touch.
const REACH_M: f32 = 8.0;
/// Tracks with a larger height difference pass over each other.
const STOREY_M: f32 = 3.0;
/// Largest distance before a junction in which crossing paths can sweep over waiting vehicles.
const SWEEP_M: f32 = 14.0;
/// Half the width of a waiting vehicle, and its clearance.
const WAITING_M: f32 = 1.3;
/// Largest lateral distance of a waiting vehicle beside a straight track.
const BESIDE_M: f32 = 2.3;

/// Stretches of two tracks, by arc length, such that a vehicle on one obstructs a vehicle on the
/// other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretches {
    /// Begin and end on this track.
    pub(crate) own: (f32, f32),
    /// Begin and end on the other track.
    pub(crate) other: (f32, f32),
}

/// A conflict with another track, seen from this track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conflict {
    /// The other track.
    pub(crate) other: u32,
    /// Whether both leave by the same lane.
    pub(crate) merge: bool,
    /// Conflict area of two cars, if there is one.
    cars: Option<Stretches>,
    /// Conflict areas of a bus on this track and a car on the other, and of a car on this track and
    /// a bus on the other.
    mixed: [Option<Stretches>; 2],
    /// Conflict area of two buses.
    wide: Stretches,
    /// Part of `wide` that lies inside the junction on both tracks.
    core: Option<Stretches>,
}

impl Conflict {
    /// Returns the conflict area of two vehicles; `None` if they can pass each other. `wide` says
    /// of the vehicle on this track and of the one on the other whether they are wide.
    pub(crate) fn between(&self, wide: (bool, bool)) -> Option<Stretches> {
        match wide {
            (false, false) => self.cars,
            (true, false) => self.mixed[0],
            (false, true) => self.mixed[1],
            (true, true) => Some(self.wide),
        }
    }

    /// Returns the arc length on this track at which a vehicle with its front at `front_m`, which
    /// needs `brake_m` to stop, stops before the other: where the stretch begins. Beyond that it stops
    /// as soon as it can, and at the latest where the part of the stretch inside the junction begins:
    /// where the other one swings out, every metre less helps. `None` if it is inside.
    pub(crate) fn stop_at(&self, wide: (bool, bool), front_m: f32, brake_m: f32) -> Option<f32> {
        let begin_m = self.between(wide)?.own.0;
        if begin_m > front_m {
            return Some(begin_m);
        }
        let core = if wide == (false, false) { None } else { self.core };
        let core_m = core.map(|core| core.own.0).filter(|&core_m| core_m > front_m)?;
        Some(core_m.min(front_m + brake_m))
    }

    fn reversed(&self, other: u32) -> Conflict {
        let turn = |s: Stretches| Stretches { own: s.other, other: s.own };
        Conflict {
            other,
            merge: self.merge,
            cars: self.cars.map(turn),
            mixed: [self.mixed[1].map(turn), self.mixed[0].map(turn)],
            wide: turn(self.wide),
            core: self.core.map(turn),
        }
    }
}

/// The conflicts of all zones, by lane.
pub(crate) struct Conflicts {
    first: Vec<u32>,
    list: Vec<Conflict>,
    /// For each lane of a junction: the distance before it at which vehicles wait, so that no other
    /// path sweeps over them.
    pub(crate) setback_m: Vec<f32>,
}

impl Conflicts {
    /// Compares the tracks of every zone pairwise.
    pub(crate) fn new(tracks: &Tracks) -> Conflicts {
        let lanes = tracks.count();
        let members = zone_members(tracks);
        let mut found: Vec<(u32, Conflict)> = Vec::new();
        let mut setback_m = vec![0.0; lanes];
        for lanes in &members {
            let ends: Vec<Ends> = lanes.iter().map(|&lane| Ends::of(tracks, lane)).collect();
            let paths: Vec<Path> = lanes.iter().map(|&lane| Path::of(tracks, lane)).collect();
            for a in 0..lanes.len() {
                for b in a + 1..lanes.len() {
                    if shares(&ends[a].entries, &ends[b].entries) || !paths[a].is_near(&paths[b]) {
                        continue;
                    }
                    let merge = shares(&ends[a].exits, &ends[b].exits);
                    let [cars, bus_a, bus_b, wide, core] = overlap(&paths[a], &paths[b], merge);
                    let Some(wide) = wide else { continue };
                    let mixed = [bus_a, bus_b];
                    let conflict = Conflict { other: lanes[b], merge, cars, mixed, wide, core };
                    found.push((lanes[a], conflict));
                    found.push((lanes[b], conflict.reversed(lanes[a])));
                }
            }
            for (a, &lane) in lanes.iter().enumerate() {
                for &entry in tracks.previous(lane).iter().filter(|&&l| !tracks.in_zone(l)) {
                    for (b, other) in paths.iter().enumerate() {
                        if a != b && !ends[b].entries.contains(&entry) {
                            let swept = swept(tracks, entry, &other.stations);
                            setback_m[lane as usize] = f32::max(setback_m[lane as usize], swept);
                        }
                    }
                }
            }
        }
        found.sort_unstable_by_key(|(lane, conflict)| (*lane, conflict.other));
        let mut first = vec![0u32; lanes + 1];
        for (lane, _) in &found {
            first[*lane as usize + 1] += 1;
        }
        for lane in 0..lanes {
            first[lane + 1] += first[lane];
        }
        let list = found.into_iter().map(|(_, conflict)| conflict).collect();
        Conflicts { first, list, setback_m }
    }

    /// Returns the conflicts as bytes, in the order in which [`Conflicts::take`] reads them.
    pub(crate) fn parts(&self) -> Vec<Cow<'_, [u8]>> {
        let rows: Vec<Row> = self.list.iter().map(Row::of).collect();
        vec![
            cast_slice(&self.first).into(),
            cast_slice(&rows).to_vec().into(),
            cast_slice(&self.setback_m).into(),
        ]
    }

    /// Reads what [`Conflicts::parts`] gave; `None` if a part is missing or damaged.
    pub(crate) fn take(parts: &mut Parts) -> Option<Conflicts> {
        let first = parts.take()?;
        let list = parts.take::<Row>()?.iter().map(Row::conflict).collect();
        Some(Conflicts { first, list, setback_m: parts.take()? })
    }

    /// Returns the conflicts of `lane`, ascending by the other lane.
    pub(crate) fn of(&self, lane: u32) -> &[Conflict] {
        let lane = lane as usize;
        &self.list[self.first[lane] as usize..self.first[lane + 1] as usize]
    }
}

/// A [`Conflict`] as bytes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Row {
    other: u32,
    /// Bit 0: `merge`; the next ones: which of `stretches` exist.
    bits: u32,
    /// `wide`, `cars`, `mixed` and `core`: begin and end on this track, then on the other.
    stretches: [[f32; 4]; 5],
}

impl Row {
    fn of(conflict: &Conflict) -> Row {
        let Conflict { other, merge, cars, mixed, wide, core } = *conflict;
        let mut row = Row { other, bits: u32::from(merge), stretches: [[0.0; 4]; 5] };
        for (index, one) in [Some(wide), cars, mixed[0], mixed[1], core].into_iter().enumerate() {
            if let Some(Stretches { own, other }) = one {
                row.bits |= 2 << index;
                row.stretches[index] = [own.0, own.1, other.0, other.1];
            }
        }
        row
    }

    fn conflict(&self) -> Conflict {
        let stretches = |index: usize| {
            let [a, b, c, d] = self.stretches[index];
            Stretches { own: (a, b), other: (c, d) }
        };
        let found = |index: usize| (self.bits & 2 << index != 0).then(|| stretches(index));
        Conflict {
            other: self.other,
            merge: self.bits & 1 != 0,
            cars: found(1),
            mixed: [found(2), found(3)],
            wide: stretches(0),
            core: found(4),
        }
    }
}

/// Returns the tracks of each conflict zone, ascending.
fn zone_members(tracks: &Tracks) -> Vec<Vec<u32>> {
    let mut members: Vec<Vec<u32>> = Vec::new();
    for lane in 0..tracks.count() as u32 {
        let zone = tracks.zone[lane as usize];
        if zone != NONE && tracks.has(lane) {
            if members.len() <= zone as usize {
                members.resize(zone as usize + 1, Vec::new());
            }
            members[zone as usize].push(lane);
        }
    }
    members
}

/// The lanes outside the junction from which a lane is reached, and which it reaches.
struct Ends {
    entries: Vec<u32>,
    exits: Vec<u32>,
}

impl Ends {
    fn of(tracks: &Tracks, lane: u32) -> Ends {
        Ends {
            entries: outside(tracks, lane, Tracks::previous),
            exits: outside(tracks, lane, Tracks::next),
        }
    }
}

/// Returns the lanes outside the junction that are reached by `step` through lanes of it.
fn outside<'a>(tracks: &'a Tracks, lane: u32, step: fn(&'a Tracks, u32) -> &'a [u32]) -> Vec<u32> {
    let zone = tracks.zone[lane as usize];
    let (mut seen, mut found, mut open) = (vec![lane], Vec::new(), vec![lane]);
    while let Some(at) = open.pop() {
        for &to in step(tracks, at) {
            if tracks.zone[to as usize] != zone {
                found.push(to);
            } else if !seen.contains(&to) {
                seen.push(to);
                open.push(to);
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

fn shares(a: &[u32], b: &[u32]) -> bool {
    a.iter().any(|lane| b.contains(lane))
}

/// A track of a junction with its swept path.
struct Path {
    length_m: f32,
    stations: Vec<Station>,
    bounds: (Vec2, Vec2),
}

impl Path {
    fn of(tracks: &Tracks, lane: u32) -> Path {
        let stations = swept_path::stations(tracks, lane);
        let mut bounds = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for station in &stations {
            let point = station.point.truncate();
            bounds = (bounds.0.min(point), bounds.1.max(point));
        }
        Path { length_m: tracks.length(lane), stations, bounds }
    }

    /// Returns whether a station lies in the junction.
    fn holds(&self, station: &Station) -> bool {
        (0.0..=self.length_m).contains(&station.arc_m)
    }

    fn is_near(&self, other: &Path) -> bool {
        let (a, b) = (self.bounds, other.bounds);
        (a.0 - REACH_M).cmple(b.1).all() && (b.0 - REACH_M).cmple(a.1).all()
    }
}

/// Returns the stretches of two tracks on which vehicles touch: two cars, a bus on `a` and a car, a
/// bus on `b` and a car, two buses, and two buses inside the junction. The stretches of buses begin
/// before a track or end after it where a bus on the other track swings out of the junction.
fn overlap(a: &Path, b: &Path, merge: bool) -> [Option<Stretches>; 5] {
    let none = (f32::INFINITY, f32::NEG_INFINITY);
    let mut found = [(none, none); 5];
    for at_a in &a.stations {
        let a_inside = a.holds(at_a);
        for at_b in &b.stations {
            let to = at_b.point - at_a.point;
            let flat = to.truncate();
            let square = flat.length_squared();
            if square > REACH_M * REACH_M || to.z.abs() > STOREY_M {
                continue;
            }
            let inside = [a_inside, b.holds(at_b)];
            // After a merge car following applies; before the junction each vehicle waits at its
            // own line.
            let outside = inside == [false; 2];
            if outside && (merge || (at_a.arc_m < 0.0 && at_b.arc_m < 0.0)) {
                continue;
            }
            let within = inside == [true; 2];
            let reach_a = [at_a.car, at_a.bus].map(|reach| reach.towards(at_a.tangent, flat));
            let reach_b = [at_b.car, at_b.bus].map(|reach| reach.towards(at_b.tangent, -flat));
            for (kind, (bus_a, bus_b)) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().enumerate() {
                let clearance_m = if kind == 3 { BUSES_CLEARANCE_M } else { CLEARANCE_M };
                let reach = reach_a[bus_a] + reach_b[bus_b] + clearance_m;
                let swings = |bus: usize, reach: f32| bus == 1 && reach > BUS_M + SWING_M;
                let swings = swings(bus_a, reach_a[1]) || swings(bus_b, reach_b[1]);
                if square >= reach * reach || !(within || swings) {
                    continue;
                }
                let kinds = if kind == 3 && within { 3..5 } else { kind..kind + 1 };
                for (on_a, on_b) in &mut found[kinds] {
                    *on_a = (on_a.0.min(at_a.arc_m), on_a.1.max(at_a.arc_m));
                    *on_b = (on_b.0.min(at_b.arc_m), on_b.1.max(at_b.arc_m));
                }
            }
        }
    }
    found.map(|(own, other)| (own.0 <= own.1).then_some(Stretches { own, other }))
}

/// Returns the distance before the end of `entry`, which may be longer than it, at which a bus on the other
/// path is still too near.
fn swept(tracks: &Tracks, entry: u32, path: &[Station]) -> f32 {
    let touches = |point: Vec3, station: &Station| {
        let to = point - station.point;
        let reach = station.bus.towards(station.tangent, to.truncate());
        let apart = if reach > BUS_M + SWING_M { reach + WAITING_M } else { BESIDE_M };
        to.truncate().length_squared() < apart * apart && to.z.abs() < STOREY_M
    };
    let (step_m, length_m) = (tracks.samples(entry).1, tracks.length(entry));
    (0..=(SWEEP_M / step_m) as usize)
        .rev()
        .map(|steps| steps as f32 * step_m)
        .find(|&before_m| {
            let (point, _) = swept_path::place(tracks, entry, length_m - before_m);
            path.iter().any(|station| station.arc_m >= 0.0 && touches(point, station))
        })
        .map_or(0.0, |before_m| before_m + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{swept_path::Reach, tests::maps};

    /// Returns the number of lanes of zones, and whether in them conflict: two cars, a bus and a
    /// car, two buses.
    fn zones(network: &road::Network) -> (usize, [bool; 3]) {
        let tracks = Tracks::new(network);
        let conflicts = Conflicts::new(&tracks);
        let lanes: Vec<u32> =
            (0..tracks.count() as u32).filter(|&lane| tracks.in_zone(lane)).collect();
        let any = |wide: (bool, bool)| {
            let all = lanes.iter().flat_map(|&lane| conflicts.of(lane));
            all.into_iter().any(|conflict| conflict.between(wide).is_some())
        };
        assert_eq!(any((true, false)), any((false, true)), "seen from both lanes");
        (lanes.len(), [any((false, false)), any((true, false)), any((true, true))])
    }

    #[test]
    fn a_vehicle_that_waits_where_the_other_one_swings_out_stays_there() {
        // Stretches of Greatmoor, where vehicles wait 7.4 m before the junction.
        let conflict = Conflict {
            other: 1,
            merge: false,
            cars: None,
            mixed: [None; 2],
            wide: Stretches { own: (-9.8, 5.9), other: (12.6, 26.1) },
            core: Some(Stretches { own: (0.0, 5.9), other: (12.6, 16.5) }),
        };
        let both = (true, true);
        assert_eq!(conflict.stop_at(both, -12.0, 5.0), Some(-9.8), "where the stretch begins");
        assert_eq!(conflict.stop_at(both, -7.4, 0.0), Some(-7.4), "it stands");
        assert_eq!(conflict.stop_at(both, -7.4, 3.0), Some(-4.4), "it moves");
        assert_eq!(conflict.stop_at(both, -7.4, 9.0), Some(0.0), "before the junction");
        assert_eq!(conflict.stop_at(both, 0.5, 9.0), None, "inside");
        assert_eq!(conflict.stop_at((false, false), -12.0, 0.0), None, "two cars pass each other");
    }

    #[test]
    fn vehicles_wait_clear_of_buses_though_the_lane_before_the_junction_is_short() {
        let tracks = Tracks::new(&maps::two_crossings(22.2));
        let is_short = |lane: &u32| !tracks.in_zone(*lane) && tracks.length(*lane) < 2.5;
        let entry = (0..tracks.count() as u32).find(is_short).expect("the road between both");
        // The path of a bus that ends beside a place 5 m before the junction.
        let (place, tangent) = swept_path::place(&tracks, entry, tracks.length(entry) - 5.0);
        let reach = Reach { left_m: BUS_M, right_m: BUS_M };
        let point = place + tangent.perp().extend(0.0) * 2.0;
        let station = Station { arc_m: 0.0, point, tangent, car: reach, bus: reach };
        let setback_m = swept(&tracks, entry, &[station]);
        assert!((5.0..7.5).contains(&setback_m), "{setback_m} m");
    }

    #[test]
    fn buses_and_oncoming_traffic_take_turns_in_a_narrow_bend() {
        let bend = |radius_m: f64| zones(&maps::two_way_loop(radius_m, 60.0));
        let (lanes, conflicts) = bend(8.0);
        assert_eq!(lanes, 8, "two lanes in each of four bends");
        assert_eq!(conflicts, [false, true, true], "cars pass each other");
        // Wide bends, and those without oncoming traffic, need no order.
        assert_eq!(bend(30.0).0, 0);
        assert_eq!(zones(&maps::loop_road(8.0, 60.0)).0, 0);
    }
    #[test]
    fn a_bus_passes_an_oncoming_car_where_it_cannot_pass_a_bus() {
        let opposite = |network: &road::Network| -> Vec<Conflict> {
            let tracks = Tracks::new(network);
            let conflicts = Conflicts::new(&tracks);
            let heading = |lane: u32| tracks.at(lane, 0.0).1;
            (0..tracks.count() as u32)
                .flat_map(|lane| conflicts.of(lane).iter().map(move |c| (lane, *c)))
                .filter(|(lane, c)| heading(*lane).dot(heading(c.other)) < -0.9)
                .map(|(_, conflict)| conflict)
                .collect()
        };
        let narrow = opposite(&maps::narrow_crossing());
        assert_eq!(narrow.len(), 4, "two pairs of lanes, seen from each of them");
        for conflict in narrow {
            assert!(conflict.between((true, true)).is_some());
            assert_eq!(conflict.between((true, false)), None);
            assert_eq!(conflict.between((false, true)), None);
        }
        assert_eq!(opposite(&maps::crossing()), [], "two buses pass each other");
    }
}
