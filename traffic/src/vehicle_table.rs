//! What the planner knows of each vehicle that it drives, beyond the snapshot.

use bytemuck::{Pod, Zeroable};

/// How many lanes a route holds, the current one included.
pub(crate) const ROUTE_MAX: usize = 32;

/// Lanes ahead of a vehicle, the current one first.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Route {
    lanes: [u32; ROUTE_MAX],
    length: u32,
    /// How many lanes were left behind: names the lanes of the route for ever.
    pub(crate) lanes_passed: u32,
}

impl Route {
    /// A route that begins on `lane`.
    pub(crate) fn from_lane(lane: u32, lanes_passed: u32) -> Route {
        let mut route = Route { lanes: [0; ROUTE_MAX], length: 1, lanes_passed };
        route.lanes[0] = lane;
        route
    }

    /// The lanes, the current one first.
    pub(crate) fn lanes(&self) -> &[u32] {
        &self.lanes[..self.length as usize]
    }

    /// The current lane.
    pub(crate) fn lane(&self) -> u32 {
        self.lanes[0]
    }

    /// Whether there is no room for more.
    pub(crate) fn is_full(&self) -> bool {
        self.length as usize == ROUTE_MAX
    }

    /// Appends a lane.
    pub(crate) fn push(&mut self, lane: u32) {
        self.lanes[self.length as usize] = lane;
        self.length += 1;
    }

    /// Leaves the current lane behind.
    pub(crate) fn pop(&mut self) {
        let length = self.length as usize;
        self.lanes.copy_within(1..length, 0);
        self.lanes[length - 1] = 0;
        self.length -= 1;
        self.lanes_passed = self.lanes_passed.wrapping_add(1);
    }

    /// Forgets what lies beyond the first `length` lanes.
    pub(crate) fn truncate(&mut self, length: usize) {
        self.lanes[length..].fill(0);
        self.length = self.length.min(length as u32);
    }
}

macro_rules! columns {
    ($($(#[$doc:meta])* $name:ident: $type:ty = $new:expr,)*) => {
        /// One row per vehicle with autopilot, ascending by actor id; structure of arrays.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub(crate) struct VehicleTable {
            /// Whose row.
            pub(crate) id: Vec<u32>,
            $($(#[$doc])* pub(crate) $name: Vec<$type>,)*
        }

        impl VehicleTable {
            /// Makes the rows be those of `wanted` (ascending): keeps who stays, drops who left,
            /// and starts newcomers from nothing.
            pub(crate) fn keep(&mut self, wanted: &[u32]) {
                if self.id == wanted {
                    return;
                }
                let old = std::mem::take(self);
                for &id in wanted {
                    let from = old.id.binary_search(&id).ok();
                    self.id.push(id);
                    $(self.$name.push(match from { Some(row) => old.$name[row], None => $new });)*
                }
            }

            /// Starts the row of a vehicle from nothing.
            pub(crate) fn reset(&mut self, row: usize) {
                $(self.$name[row] = $new;)*
            }

            /// Appends all columns to `bytes`.
            pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(bytemuck::cast_slice(&self.id));
                $(bytes.extend_from_slice(bytemuck::cast_slice(&self.$name));)*
            }

            /// Bytes that [`Rows::write`] writes per row.
            pub(crate) const ROW_BYTES: usize = 4 $(+ size_of::<$type>())*;

            /// Reads `count` rows back; `bytes` must hold [`Rows::ROW_BYTES`] for each.
            pub(crate) fn read(count: usize, mut bytes: &[u8]) -> VehicleTable {
                VehicleTable { id: take(&mut bytes, count), $($name: take(&mut bytes, count),)* }
            }
        }
    };
}

columns! {
    /// Lanes ahead.
    route: Route = Route::zeroed(),
    /// 1: the route and the place on it are known.
    located: u32 = 0,
    /// Where the origin is on the current lane.
    arc_m: f32 = 0.0,
    /// How many turns were drawn.
    turn_draws: u32 = 0,
    /// Lane change: how far left of the current lane it began; 0 without one.
    shift_m: f32 = 0.0,
    /// Lane change: how far driven since.
    shift_done_m: f32 = 0.0,
    /// Lane change: over which way it is spread.
    shift_over_m: f32 = 0.0,
    /// Until another lane change is thought of.
    change_cooldown_s: f32 = 0.0,
    /// How often it thought of changing.
    change_draws: u32 = 0,
    /// Place in the order of those who may pass a junction; 0: may not.
    reservation: u64 = 0,
    /// First lane of the route, counted for ever, that the leave to pass does not cover.
    reservation_end: u32 = 0,
    /// How long it has waited at the line of the next junction.
    wait_s: f32 = 0.0,
    /// How long a leave to pass has gone unused.
    reservation_idle_s: f32 = 0.0,
    /// Sum of the error of acceleration.
    accel_integral: f32 = 0.0,
    /// How long it stands though it should move.
    stuck_s: f32 = 0.0,
    /// 1: it turns round to drive the other way.
    u_turn: u32 = 0,
    /// For how long it still backs out; below 0: for how long it then lets others go first.
    reverse_s: f32 = 0.0,
    /// How often it backed out since it last drove on.
    reverse_count: u32 = 0,
}

impl VehicleTable {
    /// Whether rows ascend and every route lies on a map of `lanes` lanes.
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
