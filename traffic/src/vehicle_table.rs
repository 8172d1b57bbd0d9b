//! State of each planned vehicle beyond the snapshot.

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

macro_rules! columns {
    ($($(#[$doc:meta])* $name:ident: $type:ty = $new:expr,)*) => {
        /// One row for each vehicle on autopilot, ascending by actor id; structure of arrays.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub(crate) struct VehicleTable {
            /// Actor id of the row.
            pub(crate) id: Vec<u32>,
            $($(#[$doc])* pub(crate) $name: Vec<$type>,)*
        }

        impl VehicleTable {
            /// Changes the rows to those of `wanted` (ascending): keeps the state of vehicles that
            /// stay, removes others, and adds new ones with default values.
            pub(crate) fn retain(&mut self, ids: &[u32]) {
                if self.id == ids {
                    return;
                }
                let old = std::mem::take(self);
                for &id in ids {
                    let from = old.id.binary_search(&id).ok();
                    self.id.push(id);
                    $(self.$name.push(match from { Some(row) => old.$name[row], None => $new });)*
                }
            }

            /// Resets the row of a vehicle to default values.
            pub(crate) fn reset(&mut self, row: usize) {
                $(self.$name[row] = $new;)*
            }

            /// Appends all columns to `bytes`.
            pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(bytemuck::cast_slice(&self.id));
                $(bytes.extend_from_slice(bytemuck::cast_slice(&self.$name));)*
            }

            /// Number of bytes that [`VehicleTable::write`] writes for each row.
            pub(crate) const ROW_BYTES: usize = 4 $(+ size_of::<$type>())*;

            /// Reads `count` rows; `bytes` must hold [`VehicleTable::ROW_BYTES`] for each.
            pub(crate) fn read(count: usize, mut bytes: &[u8]) -> VehicleTable {
                VehicleTable { id: take(&mut bytes, count), $($name: take(&mut bytes, count),)* }
            }
        }
    };
}

columns! {
    /// Lanes ahead.
    route: Route = Route::zeroed(),
    /// 1 if the route and the position on it are known, else 0.
    located: u32 = 0,
    /// Arc length of the origin on the current lane.
    arc_m: f32 = 0.0,
    /// Number of random turns drawn.
    turn_draws: u32 = 0,
    /// Lane change: lateral offset from the current lane where it began; 0 without one.
    shift_m: f32 = 0.0,
    /// Lane change: distance driven since it began.
    shift_done_m: f32 = 0.0,
    /// Lane change: distance over which it extends.
    shift_over_m: f32 = 0.0,
    /// Passing a prop: lateral offset from the lane while the vehicle is beside it.
    pass_left_m: f32 = 0.0,
    /// Passing a prop: distance driven since it began.
    pass_done_m: f32 = 0.0,
    /// Passing a prop: distance over which the vehicle moves to the side, and over which it returns;
    /// 0 if it passes none.
    pass_over_m: f32 = 0.0,
    /// Passing a prop: distance from the begin after which the vehicle returns.
    pass_hold_m: f32 = 0.0,
    /// Time at standstill behind a prop.
    prop_wait_s: f32 = 0.0,
    /// Time until the next lane change decision.
    change_cooldown_s: f32 = 0.0,
    /// Number of lane change decisions.
    change_draws: u32 = 0,
    /// Number of the reservation for a junction, in the order of granting; 0 without one.
    reservation: u64 = 0,
    /// First lane of the route, in the numbering of `lanes_passed`, that the reservation does not
    /// cover.
    reservation_end: u32 = 0,
    /// Time waited at the line of the next junction.
    wait_s: f32 = 0.0,
    /// Time that a reservation has been unused.
    reservation_idle_s: f32 = 0.0,
    /// Actor id of the leader that the driver has seen; 0 without one.
    seen_leader: u32 = 0,
    /// Speed of that leader as the driver perceives it.
    seen_mps: f32 = 0.0,
    /// Error of the estimated gap, in standard deviations.
    gap_error: f32 = 0.0,
    /// Number of steps of that error.
    error_draws: u32 = 0,
    /// Time at standstill since the vehicle may drive.
    start_s: f32 = 0.0,
    /// Integral of the acceleration error.
    accel_integral: f32 = 0.0,
    /// Time at standstill though the vehicle should move.
    stuck_s: f32 = 0.0,
    /// 1 during a U-turn, else 0.
    u_turn: u32 = 0,
    /// Remaining time in reverse; negative: remaining time to wait afterwards.
    reverse_s: f32 = 0.0,
    /// Number of reversals since the vehicle last drove on.
    reverse_count: u32 = 0,
    /// Side to which the vehicle evades after a reversal: 1 left, −1 right.
    evasion_side: f32 = 0.0,
}

impl VehicleTable {
    /// Returns whether the vehicle of a row passes a prop.
    pub(crate) fn passes_prop(&self, row: usize) -> bool {
        self.pass_over_m[row] != 0.0
    }

    /// Ends the passing of a prop.
    pub(crate) fn end_pass(&mut self, row: usize) {
        (self.pass_left_m[row], self.pass_done_m[row]) = (0.0, 0.0);
        (self.pass_over_m[row], self.pass_hold_m[row]) = (0.0, 0.0);
    }

    /// Returns whether rows ascend and every route lies on a map of `lanes` lanes.
    pub(crate) fn is_sound(&self, lanes: usize) -> bool {
        let ascending = self.id.windows(2).all(|pair| pair[0] < pair[1]);
        let routes = self.route.iter().zip(&self.located).all(|(route, &located)| {
            route.length as usize <= ROUTE_MAX
                && (located == 0 || route.length > 0)
                && route.lanes().iter().all(|&lane| (lane as usize) < lanes)
        });
        ascending && routes
    }
}

fn take<T: Pod>(bytes: &mut &[u8], count: usize) -> Vec<T> {
    let (column, rest) = bytes.split_at(count * size_of::<T>());
    *bytes = rest;
    column.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}
