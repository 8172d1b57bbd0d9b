//! State of the junction stage, shared by its parts.

use crate::{
    agents::Agents,
    constraint::{JunctionConstraint, WaitReason},
    map::Map,
    obstacles::Obstacle,
    occupancy::Occupancy,
    vehicle_table::VehicleTable,
};

/// Braking that a light turning yellow may ask for.
pub(super) const YELLOW_BRAKE_MPS2: f32 = 3.0;
/// Braking on which plans are made.
pub(super) const BRAKE_MPS2: f32 = 2.0;
/// Left free behind the one in front, beyond a junction.
pub(super) const STANDING_GAP_M: f32 = 2.5;
/// Stand so far before a line.
pub(super) const LINE_GAP_M: f32 = 0.5;

/// The next way through a junction for which a vehicle has no leave yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Request {
    pub(super) row: usize,
    /// Lanes of the route: first, and one past the last.
    pub(super) from: usize,
    pub(super) to: usize,
    /// From the front bumper to the line and to the first lane.
    pub(super) line_m: f32,
    pub(super) entry_m: f32,
    /// Lower goes first.
    pub(super) rank: i32,
    /// 1 for who comes from the right of another of the same rank and time, and so on.
    pub(super) from_right: u32,
    pub(super) red: bool,
}

/// Scratch of the stage; results by row.
#[derive(Default)]
pub(crate) struct Junctions {
    pub(crate) constraints: Vec<JunctionConstraint>,
    pub(crate) waits: Vec<WaitReason>,
    /// For whom it waits: an index into the crowd, or [`NONE`].
    pub(crate) blockers: Vec<u32>,
    /// To whom it gives way though it may pass, likewise.
    pub(super) yields_to: Vec<u32>,
    pub(super) requests: Vec<Request>,
    pub(super) holders: Vec<Presence>,
    pub(super) approaching: Vec<Presence>,
    /// By row: from the front bumper to the start of each of the first route lanes.
    starts: Vec<f32>,
    starts_from: Vec<usize>,
}

/// What this stage reads.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) agents: &'a Agents,
    pub(crate) occupancy: &'a Occupancy,
    /// Whom wide vehicles would touch beside their lanes.
    pub(crate) obstacles: &'a [Obstacle],
    /// By signal: what it shows.
    pub(crate) lights: &'a [u32],
    pub(crate) seed: u64,
    pub(crate) delta_s: f32,
    /// By row: share of red lights to ignore.
    pub(crate) ignore_lights: &'a [f32],
    /// By row: share of signs to ignore.
    pub(crate) ignore_signs: &'a [f32],
}

impl Junctions {
    /// Measures the distances from each front bumper to the lanes of its route.
    pub(super) fn measure(&mut self, vehicles: &VehicleTable, view: &View) {
        self.starts.clear();
        self.starts_from.clear();
        for row in 0..vehicles.id.len() {
            self.starts_from.push(self.starts.len());
            if vehicles.located[row] == 0 {
                continue;
            }
            let agent = view.agents.driven[row] as usize;
            let mut start = -vehicles.arc_m[row] - view.agents.body[agent].front_m;
            for &lane in vehicles.route[row].lanes() {
                self.starts.push(start);
                start += view.map.tracks.length(lane);
            }
            self.starts.push(start);
        }
        self.starts_from.push(self.starts.len());
    }

    /// From the front bumper of `row` to the start of lane `k` of its route.
    pub(crate) fn start(&self, row: usize, k: usize) -> f32 {
        self.starts[self.starts_from[row] + k]
    }

    /// The same for every lane that its route had when junctions were looked at; none for who came
    /// onto the road since.
    pub(crate) fn starts(&self, row: usize) -> &[f32] {
        let (from, to) = (self.starts_from[row], self.starts_from[row + 1]);
        self.starts[from..to].split_last().map_or(&[], |(_, starts)| starts)
    }
}

/// Someone's presence on a lane of a junction, now or soon.
#[derive(Clone, Copy)]
pub(super) struct Presence {
    pub(super) lane: u32,
    /// Index into the crowd.
    pub(super) agent: u32,
    /// From its front bumper to the lane's start.
    pub(super) start_m: f32,
    pub(super) rank: i32,
    /// It cannot come faster: no lane on its way there allows it.
    pub(super) top_mps: f32,
}

/// The lanes of a request, with their places in the route.
pub(super) fn request_lanes<'a>(
    lanes: &'a [u32],
    request: &Request,
) -> impl Iterator<Item = (usize, &'a u32)> {
    lanes.iter().enumerate().take(request.to).skip(request.from)
}

/// How many lanes of the route the leave covers.
pub(super) fn reserved_lanes(vehicles: &VehicleTable, row: usize) -> usize {
    if vehicles.reservation[row] == 0 {
        return 0;
    }
    vehicles.reservation_end[row].wrapping_sub(vehicles.route[row].lanes_passed) as usize
}

/// The entries of one lane in a list sorted by lane.
pub(super) fn present(list: &[Presence], lane: u32) -> &[Presence] {
    let begin = list.partition_point(|p| p.lane < lane);
    let end = begin + list[begin..].partition_point(|p| p.lane == lane);
    &list[begin..end]
}
