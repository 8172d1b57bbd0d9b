//! What a planner must know beyond the snapshot, and its bytes.
//!
//! The bytes are canonical: equal memories have equal bytes, so their hash stands for the planner.

use bytemuck::{Pod, Zeroable};
use protocol::{Command, RawCommand, Weather, status};

use crate::{client_route::ClientRoutes, params::Params, vehicle_table::VehicleTable};

/// `omnimind`, and the version of what follows.
const MAGIC: u64 = u64::from_le_bytes(*b"omnimind");
const VERSION: u32 = 4;

/// Why bytes are no planner for this map.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// They are too short, too long, or of another build.
    #[error(
        "a traffic planner of {found} bytes does not fit: {why}; was it saved by another build?"
    )]
    Shape {
        /// How many bytes there are.
        found: usize,
        /// What is wrong with them.
        why: &'static str,
    },
    /// They name lanes or lights that the map does not have.
    #[error(
        "a traffic planner saved on another map: it knows {found} {what}, this map has {wanted}"
    )]
    OtherMap {
        /// Lanes or signal cycles.
        what: &'static str,
        /// How many the planner knows.
        found: u32,
        /// How many there are.
        wanted: u32,
    },
}

/// Everything that outlives a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PlannerState {
    /// How many leaves to pass junctions were given.
    pub(crate) reservations: u64,
    /// By signal cycle: nanoseconds since it began.
    pub(crate) clocks: Vec<u64>,
    pub(crate) params: Params,
    pub(crate) vehicles: VehicleTable,
    pub(crate) client_routes: ClientRoutes,
    pub(crate) weather: Weather,
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
    reserved: u32,
}

impl PlannerState {
    /// Takes over what one line of the journal asks for, if it was granted.
    pub(crate) fn apply(&mut self, command: &RawCommand, outcome: u32) {
        if outcome != status::DONE {
            return;
        }
        match command.decode() {
            Some(Command::TrafficParam(param)) => self.params.set(param),
            Some(Command::SetWeather(weather)) => self.weather = weather,
            Some(Command::RouteCommand(route)) => self.client_routes.apply(&route),
            Some(Command::Destroy(actor)) if actor.0 != 0 => {
                self.params.remove_actor(actor);
                self.client_routes.remove(actor.0);
            }
            _ => {}
        }
    }

    /// Appends the memory's bytes.
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
            vehicles: self.vehicles.id.len() as u32,
            weather: self.weather,
            reserved: 0,
        };
        bytes.extend_from_slice(bytemuck::bytes_of(&head));
        bytes.extend_from_slice(bytemuck::cast_slice(&self.clocks));
        bytes.extend_from_slice(bytemuck::cast_slice(self.params.all()));
        self.vehicles.write(bytes);
        bytes.extend_from_slice(&client_routes);
    }

    /// Reads them back, with the seed that they were written with.
    pub(crate) fn read(
        bytes: &[u8],
        lanes: usize,
        clocks: usize,
    ) -> Result<(u64, PlannerState), RestoreError> {
        let shape = |why| RestoreError::Shape { found: bytes.len(), why };
        if bytes.len() < size_of::<Head>() {
            return Err(shape("shorter than its head"));
        }
        let (head, body) = bytes.split_at(size_of::<Head>());
        let head: Head = bytemuck::pod_read_unaligned(head);
        if head.magic != MAGIC || head.version != VERSION {
            return Err(shape("it begins differently"));
        }
        let other = |what, found, wanted: usize| RestoreError::OtherMap {
            what,
            found,
            wanted: wanted as u32,
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
        let wanted = clock_bytes + param_bytes + row_bytes + head.client_route_bytes as usize;
        if body.len() != wanted {
            return Err(shape("its length contradicts its head"));
        }
        let (clock_part, rest) = body.split_at(clock_bytes);
        let (param_part, rest) = rest.split_at(param_bytes);
        let (row_part, client_route_part) = rest.split_at(row_bytes);
        let state = PlannerState {
            reservations: head.reservations,
            clocks: clock_part.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect(),
            params: Params::from_saved(param_part),
            vehicles: VehicleTable::read(head.vehicles as usize, row_part),
            weather: head.weather,
            client_routes: ClientRoutes::read(client_route_part, lanes)
                .ok_or_else(|| shape("a client_route way leaves it"))?,
        };
        if !state.vehicles.is_sound(lanes) {
            return Err(shape("a route leaves the map"));
        }
        Ok((head.seed, state))
    }
}
