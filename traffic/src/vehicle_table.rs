//! State of each planned vehicle beyond the snapshot.

use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

/// Largest number of lanes of a route, the current one included.
pub(crate) const ROUTE_MAX: usize = 32;

/// Lanes ahead of a vehicle, the current one first.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Route {
    lanes: [u32; ROUTE_MAX],
    length: u32,
    /// Number of lanes left behind since the start: identifies the lanes of the route.
    pub(crate) lanes_passed: u32,
}

impl Route {
    /// Creates a route that begins on `lane`.
    pub(crate) fn from_lane(lane: u32, lanes_passed: u32) -> Route {
        let mut route = Route { lanes: [0; ROUTE_MAX], length: 1, lanes_passed };
        route.lanes[0] = lane;
        route
    }

    /// Returns the lanes, the current one first.
    pub(crate) fn lanes(&self) -> &[u32] {
        &self.lanes[..self.length as usize]
    }

    /// Returns the current lane.
    pub(crate) fn lane(&self) -> u32 {
        self.lanes[0]
    }

    /// Returns the last lane.
    pub(crate) fn last(&self) -> u32 {
        self.lanes[(self.length as usize).clamp(1, ROUTE_MAX) - 1]
    }

    /// Returns whether the route holds [`ROUTE_MAX`] lanes.
    pub(crate) fn is_full(&self) -> bool {
        self.length as usize == ROUTE_MAX
    }

    /// Appends a lane.
    pub(crate) fn push(&mut self, lane: u32) {
        self.lanes[self.length as usize] = lane;
        self.length += 1;
    }

    /// Removes the current lane.
    pub(crate) fn pop(&mut self) {
        let length = self.length as usize;
        self.lanes.copy_within(1..length, 0);
        self.lanes[length - 1] = 0;
        self.length -= 1;
        self.lanes_passed = self.lanes_passed.wrapping_add(1);
    }

    /// Removes the lanes after the first `length`.
    pub(crate) fn truncate(&mut self, length: usize) {
        self.lanes[length..].fill(0);
        self.length = self.length.min(length as u32);
    }
}

/// State of one vehicle on autopilot.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Vehicle {
    /// Number of the reservation for a junction, in the order of granting; 0 without one.
    pub(crate) reservation: u64,
    /// Actor id.
    pub(crate) id: u32,
    /// 1 if the route and the position on it are known, else 0.
    pub(crate) located: u32,
    /// Arc length of the origin on the current lane.
    pub(crate) arc_m: f32,
    /// Number of random turns drawn.
    pub(crate) turn_draws: u32,
    /// Lane change: lateral offset from the current lane where it began; 0 without one.
    pub(crate) shift_m: f32,
    /// Lane change: distance driven since it began.
    pub(crate) shift_done_m: f32,
    /// Lane change: distance over which it extends.
    pub(crate) shift_over_m: f32,
    /// Passing a prop: lateral offset from the lane while the vehicle is beside it.
    pub(crate) pass_left_m: f32,
    /// Passing a prop: distance driven since it began.
    pub(crate) pass_done_m: f32,
    /// Passing a prop: distance over which the vehicle moves to the side, and over which it returns;
    /// 0 if it passes none.
    pub(crate) pass_over_m: f32,
    /// Passing a prop: distance from the begin after which the vehicle returns.
    pub(crate) pass_hold_m: f32,
    /// Time at standstill behind a prop.
    pub(crate) prop_wait_s: f32,
    /// Time until the next lane change decision.
    pub(crate) change_cooldown_s: f32,
    /// Number of lane change decisions.
    pub(crate) change_draws: u32,
    /// First lane of the route, in the numbering of `lanes_passed`, that the reservation does not
    /// cover.
    pub(crate) reservation_end: u32,
    /// Time waited at the line of the next junction.
    pub(crate) wait_s: f32,
    /// Time that a reservation has been unused.
    pub(crate) reservation_idle_s: f32,
    /// Actor id of the leader that the driver has seen; 0 without one.
    pub(crate) seen_leader: u32,
    /// Speed of that leader as the driver perceives it.
    pub(crate) seen_mps: f32,
    /// Error of the estimated gap, in standard deviations.
    pub(crate) gap_error: f32,
    /// Number of steps of that error.
    pub(crate) error_draws: u32,
    /// Time at standstill since the vehicle may drive.
    pub(crate) start_s: f32,
    /// Integral of the acceleration error.
    pub(crate) accel_integral: f32,
    /// Time at standstill though the vehicle should move.
    pub(crate) stuck_s: f32,
    /// 1 during a U-turn, else 0.
    pub(crate) u_turn: u32,
    /// Remaining time in reverse; negative: remaining time to wait afterwards.
    pub(crate) reverse_s: f32,
    /// Number of reversals since the vehicle last drove on.
    pub(crate) reverse_count: u32,
    /// Side to which the vehicle evades after a reversal: 1 left, −1 right.
    pub(crate) evasion_side: f32,
    /// Lanes ahead.
    pub(crate) route: Route,
}

impl Vehicle {
    /// Creates the state of a vehicle that has not been located.
    pub(crate) fn new(id: u32) -> Vehicle {
        Vehicle { id, ..Vehicle::zeroed() }
    }

    /// Resets the state to that of a vehicle that has not been located.
    pub(crate) fn reset(&mut self) {
        *self = Vehicle::new(self.id);
    }

    /// Returns whether the vehicle passes a prop.
    pub(crate) fn passes_prop(&self) -> bool {
        self.pass_over_m != 0.0
    }

    /// Ends the passing of a prop.
    pub(crate) fn end_pass(&mut self) {
        (self.pass_left_m, self.pass_done_m) = (0.0, 0.0);
        (self.pass_over_m, self.pass_hold_m) = (0.0, 0.0);
    }
}

/// One row for each vehicle on autopilot, ascending by actor id.
///
/// A row holds everything of a vehicle, so that threads can change different rows at the same time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct VehicleTable(Vec<Vehicle>);

impl Deref for VehicleTable {
    type Target = [Vehicle];

    fn deref(&self) -> &[Vehicle] {
        &self.0
    }
}

impl DerefMut for VehicleTable {
    fn deref_mut(&mut self) -> &mut [Vehicle] {
        &mut self.0
    }
}

impl VehicleTable {
    /// Number of bytes that [`VehicleTable::write`] writes for each row.
    pub(crate) const ROW_BYTES: usize = size_of::<Vehicle>();

    /// Changes the rows to those of `ids` (ascending): keeps the state of vehicles that stay,
    /// removes others, and adds new ones with default values.
    pub(crate) fn retain(&mut self, ids: &[u32]) {
        if self.iter().map(|vehicle| vehicle.id).eq(ids.iter().copied()) {
            return;
        }
        let old = std::mem::take(&mut self.0);
        self.0.extend(ids.iter().map(|&id| {
            let row = old.binary_search_by_key(&id, |vehicle| vehicle.id);
            row.map_or_else(|_| Vehicle::new(id), |row| old[row])
        }));
    }

    /// Appends all rows to `bytes`.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(bytemuck::cast_slice(&self.0));
    }

    /// Reads rows from what [`VehicleTable::write`] wrote: a multiple of [`VehicleTable::ROW_BYTES`].
    pub(crate) fn read(bytes: &[u8]) -> VehicleTable {
        VehicleTable(
            bytes.chunks_exact(VehicleTable::ROW_BYTES).map(bytemuck::pod_read_unaligned).collect(),
        )
    }

    /// Returns whether rows ascend and every route lies on a map of `lanes` lanes.
    pub(crate) fn is_sound(&self, lanes: usize) -> bool {
        let ascending = self.windows(2).all(|pair| pair[0].id < pair[1].id);
        let routes = self.iter().all(|vehicle| {
            let route = &vehicle.route;
            route.length as usize <= ROUTE_MAX
                && (vehicle.located == 0 || route.length > 0)
                && route.lanes().iter().all(|&lane| (lane as usize) < lanes)
        });
        ascending && routes
    }
}
