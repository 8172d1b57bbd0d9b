//! The state of the planner beyond the snapshot, and its byte format.
//!
//! The bytes are canonical: equal states have equal bytes, so that their hash identifies the state.

use bytemuck::{Pod, Zeroable};
use protocol::{Command, RawCommand, Weather, status};

use crate::{
    client_route::ClientRoutes, params::Params, vehicle_table::VehicleTable, walkers::WalkerTable,
};

/// Magic number of the format.
const MAGIC: u64 = u64::from_le_bytes(*b"omnimind");
const VERSION: u32 = 11;

/// Why bytes cannot be restored on this map.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// The bytes are too short, too long, or of another build.
    #[error(
        "planner state of {found} bytes does not fit this build: {why}; save it again with this build"
    )]
    Shape {
        /// Number of bytes.
        found: usize,
        /// What is wrong with them.
        why: &'static str,
    },
    /// The lanes or signal cycles differ from those of the map.
    #[error(
        "planner state of another map: it has {found} {what}, this map has {expected}; load the map that it was saved on"
    )]
    OtherMap {
        /// Lanes or signal cycles.
        what: &'static str,
        /// Number in the saved state.
        found: u32,
        /// Number on this map.
        expected: u32,
    },
}

/// Everything that outlives a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PlannerState {
    /// Number of reservations granted so far.
    pub(crate) reservations: u64,
    /// By signal cycle: nanoseconds since it began.
    pub(crate) clocks: Vec<u64>,
    pub(crate) params: Params,
    pub(crate) vehicles: VehicleTable,
    pub(crate) client_routes: ClientRoutes,
    pub(crate) weather: Weather,
    pub(crate) walkers: WalkerTable,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    magic: u64,
    version: u32,
    client_route_bytes: u32,
    seed: u64,
    reservations: u64,
    lanes: u32,
    clocks: u32,
    params: u32,
    vehicles: u32,
    weather: Weather,
    walkers: u32,
    walker_bytes: u64,
}

impl PlannerState {
    /// Applies one command of the journal, if it was done.
    pub(crate) fn apply(&mut self, command: &RawCommand, outcome: u32) {
        if outcome != status::DONE {
            return;
        }
        match command.decode() {
            Some(Command::TrafficParam(param)) => self.params.set(param),
            Some(Command::SetWeather(weather)) => self.weather = weather,
            Some(Command::RouteCommand(route)) => {
                self.client_routes.apply(&route);
                if route.replace != 0 {
                    self.walkers.drop_way(route.actor_id.0);
                }
            }
            Some(Command::Destroy(actor)) if actor.0 != 0 => {
                self.params.remove_actor(actor);
                self.client_routes.remove(actor.0);
            }
            _ => {}
        }
    }

    /// Appends the bytes of the state.
    pub(crate) fn write(&self, seed: u64, lanes: usize, bytes: &mut Vec<u8>) {
        let mut client_routes = Vec::new();
        self.client_routes.write(&mut client_routes);
        let head = Head {
            magic: MAGIC,
            version: VERSION,
            client_route_bytes: client_routes.len() as u32,
            seed,
            reservations: self.reservations,
            lanes: lanes as u32,
            clocks: self.clocks.len() as u32,
            params: self.params.all().len() as u32,
            vehicles: self.vehicles.len() as u32,
            weather: self.weather,
            walkers: self.walkers.count() as u32,
            walker_bytes: self.walkers.byte_count() as u64,
        };
        bytes.extend_from_slice(bytemuck::bytes_of(&head));
        bytes.extend_from_slice(bytemuck::cast_slice(&self.clocks));
        bytes.extend_from_slice(bytemuck::cast_slice(self.params.all()));
        self.vehicles.write(bytes);
        bytes.extend_from_slice(&client_routes);
        self.walkers.write(bytes);
    }

    /// Reads a state and the seed that it was written with.
    ///
    /// # Errors
    ///
    /// [`RestoreError`] if the bytes do not fit this build or a map of `lanes` lanes and `clocks`
    /// signal cycles.
    pub(crate) fn read(
        bytes: &[u8],
        lanes: usize,
        clocks: usize,
    ) -> Result<(u64, PlannerState), RestoreError> {
        let shape = |why| RestoreError::Shape { found: bytes.len(), why };
        if bytes.len() < size_of::<Head>() {
            return Err(shape("shorter than its header"));
        }
        let (head, body) = bytes.split_at(size_of::<Head>());
        let head: Head = bytemuck::pod_read_unaligned(head);
        if head.magic != MAGIC || head.version != VERSION {
            return Err(shape("unknown magic number or version"));
        }
        let other = |what, found, expected: usize| RestoreError::OtherMap {
            what,
            found,
            expected: expected as u32,
        };
        if head.lanes as usize != lanes {
            return Err(other("lanes", head.lanes, lanes));
        }
        if head.clocks as usize != clocks {
            return Err(other("signal cycles", head.clocks, clocks));
        }
        let (clock_bytes, param_bytes) =
            (8 * clocks, head.params as usize * size_of::<protocol::TrafficParam>());
        let row_bytes = head.vehicles as usize * VehicleTable::ROW_BYTES;
        let walker_bytes = usize::try_from(head.walker_bytes).unwrap_or(usize::MAX);
        let expected = (clock_bytes + param_bytes + row_bytes + head.client_route_bytes as usize)
            .saturating_add(walker_bytes);
        if body.len() != expected {
            return Err(shape("its length contradicts its header"));
        }
        let (clock_part, rest) = body.split_at(clock_bytes);
        let (param_part, rest) = rest.split_at(param_bytes);
        let (row_part, rest) = rest.split_at(row_bytes);
        let (client_route_part, walker_part) = rest.split_at(head.client_route_bytes as usize);
        let state = PlannerState {
            reservations: head.reservations,
            clocks: clock_part.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect(),
            params: Params::from_saved(param_part),
            vehicles: VehicleTable::read(row_part),
            weather: head.weather,
            client_routes: ClientRoutes::read(client_route_part, lanes)
                .ok_or_else(|| shape("a client route is malformed or leaves the map"))?,
            walkers: WalkerTable::read(head.walkers as usize, walker_part)
                .ok_or_else(|| shape("the way of a walker is malformed"))?,
        };
        if !state.vehicles.is_sound(lanes) {
            return Err(shape("a route leaves the map"));
        }
        Ok((head.seed, state))
    }
}
