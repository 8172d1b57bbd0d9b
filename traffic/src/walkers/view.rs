//! What the planner of walkers reads in a frame.

use super::ground::WalkerGround;
use crate::{
    agents::Agents, leader::Leader, map::Map, obstacles::Obstacle, occupancy::Occupancy,
    params::Params, vehicle_table::VehicleTable,
};

/// What the planner of walkers reads.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) ground: &'a WalkerGround,
    pub(crate) agents: &'a Agents,
    pub(crate) occupancy: &'a Occupancy,
    /// What vehicles would touch if all others stood still.
    pub(crate) obstacles: &'a [Obstacle],
    /// By row of `vehicles`: what each follows.
    pub(crate) leaders: &'a [Leader],
    pub(crate) vehicles: &'a VehicleTable,
    pub(crate) params: &'a Params,
    /// By signal: the state that it shows.
    pub(crate) light_states: &'a [u32],
    /// By signal cycle: its clock.
    pub(crate) clocks: &'a [u64],
    pub(crate) seed: u64,
    pub(crate) delta_s: f32,
}
