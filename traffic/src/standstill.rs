//! Standstills: vehicles that have stayed in one place for long, and why.

use std::fmt;

use glam::Vec2;
use protocol::ActorId;

use crate::{
    agents::Agents, constraint::WaitReason, junction::Junctions, leader::Leader, spread::Spread,
    tracks::NONE, vehicle_table::VehicleTable,
};

/// Time in one place after which a standstill is reported: longer than any cycle of lights. Seconds.
const STANDSTILL_S: f32 = 120.0;
/// A vehicle that advances by less, as one that closes up in a queue, stays in one place. Metres.
const IN_PLACE_M: f32 = 5.0;
/// Gap within which a vehicle waits behind its leader. Metres.
const QUEUE_GAP_M: f32 = 12.0;
/// Speed below which the head of a queue stands. Metres per second.
const STANDING_MPS: f32 = 0.5;
/// Most vehicles between a vehicle and the head of its queue.
const QUEUE_MAX: usize = 100;

/// What the vehicle at the head of a queue waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum WaitCause {
    /// A traffic light, or a sign that requires a full stop.
    Signal,
    /// Room to stand beyond a junction.
    ExitBlocked,
    /// Vehicles on conflicting paths of a junction.
    Conflict,
    /// A vehicle that stands in the swept path through a junction.
    SweptPath,
    /// An actor ahead that is no vehicle of this planner: a walker, a prop, the vehicle of a client.
    Actor,
    /// A vehicle on another lane of a merge.
    Merge,
    /// A vehicle that waits, over others, for the first one.
    Cycle,
    /// Nothing: it drives.
    Drives,
    /// Nothing: it stands with a free path.
    Idle,
}

impl fmt::Display for WaitCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            WaitCause::Signal => "a traffic light or stop sign",
            WaitCause::ExitBlocked => "room beyond a junction",
            WaitCause::Conflict => "vehicles on conflicting paths of a junction",
            WaitCause::SweptPath => "a vehicle in its swept path through a junction",
            WaitCause::Actor => "an actor ahead that traffic does not drive",
            WaitCause::Merge => "a vehicle on another lane of a merge",
            WaitCause::Cycle => "a cycle of vehicles, each behind the next",
            WaitCause::Drives => "nothing: it drives",
            WaitCause::Idle => "nothing: its path is free",
        })
    }
}

/// The head of the queue in which a vehicle stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueueHead {
    /// The vehicle at the head; the same vehicle if it stands behind no other.
    pub vehicle: ActorId,
    /// What that one waits for.
    pub cause: WaitCause,
    /// The actor that it waits for, or [`ActorId::NONE`] if none is known.
    pub waits_for: ActorId,
}

/// A vehicle that has stayed in one place for 120 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standstill {
    /// The vehicle.
    pub vehicle: ActorId,
    /// The head of its queue now.
    pub head: QueueHead,
}

/// What the search for the head of a queue reads.
pub(crate) struct View<'a> {
    pub(crate) vehicles: &'a VehicleTable,
    pub(crate) agents: &'a Agents,
    /// By row: the leader.
    pub(crate) leaders: &'a [Leader],
    pub(crate) junctions: &'a Junctions,
}

/// Returns the head of the queue of a located row.
pub(crate) fn head(row: usize, view: &View) -> QueueHead {
    let id =
        |agent: u32| ActorId(view.agents.id.get(agent as usize).map_or(ActorId::NONE.0, |id| *id));
    let mut at = row;
    for _ in 0..QUEUE_MAX {
        let (leader, blocker) = (&view.leaders[at], view.junctions.blocker(at));
        let stands = || view.agents.speed(view.agents.driven[at] as usize).abs() < STANDING_MPS;
        let (cause, waits_for) = match view.junctions.waits[at] {
            WaitReason::Signal => (WaitCause::Signal, NONE),
            WaitReason::ExitBlocked => (WaitCause::ExitBlocked, blocker),
            WaitReason::Conflict => (WaitCause::Conflict, blocker),
            WaitReason::SweptPath => (WaitCause::SweptPath, blocker),
            WaitReason::None | WaitReason::Queue if leader.gap_m < QUEUE_GAP_M => {
                let ahead = view.agents.row[leader.agent as usize];
                if ahead != NONE && view.vehicles[ahead as usize].located == 1 {
                    at = ahead as usize;
                    continue;
                }
                (WaitCause::Actor, leader.agent)
            }
            _ if view.junctions.constraints[at].merge_leader_m < QUEUE_GAP_M => {
                (WaitCause::Merge, blocker)
            }
            _ if stands() => (WaitCause::Idle, NONE),
            _ => (WaitCause::Drives, NONE),
        };
        let vehicle = ActorId(view.vehicles[at].id);
        return QueueHead { vehicle, cause, waits_for: id(waits_for) };
    }
    let vehicle = ActorId(view.vehicles[at].id);
    QueueHead { vehicle, cause: WaitCause::Cycle, waits_for: ActorId::NONE }
}

/// Where a vehicle stays.
#[derive(Clone, Copy)]
struct Stay {
    id: u32,
    place: Vec2,
    stayed_s: f32,
}

/// How long every vehicle has stayed in one place. For the log only: no decision depends on it.
#[derive(Default)]
pub(crate) struct Stays(Vec<Stay>);

impl Stays {
    /// Measures the stays of all rows, and lists the vehicles that have stayed for
    /// [`STANDSTILL_S`] since this frame.
    pub(crate) fn find(
        &mut self,
        view: &View,
        delta_s: f32,
        spread: Spread,
        found: &mut Vec<Standstill>,
    ) {
        self.retain(view);
        spread.update_list(&mut self.0, found, |row, stay, found| {
            let at = view.agents.position[view.agents.driven[row] as usize].truncate();
            if at.distance_squared(stay.place) > IN_PLACE_M * IN_PLACE_M {
                (stay.place, stay.stayed_s) = (at, 0.0);
                return;
            }
            let before_s = stay.stayed_s;
            stay.stayed_s += delta_s;
            let is_due = before_s < STANDSTILL_S && stay.stayed_s >= STANDSTILL_S;
            if is_due && view.vehicles[row].located == 1 {
                found.push(Standstill { vehicle: ActorId(stay.id), head: head(row, view) });
            }
        });
    }

    /// Changes the rows to those of the vehicles.
    fn retain(&mut self, view: &View) {
        let ids = || view.agents.driven.iter().map(|&agent| view.agents.id[agent as usize]);
        if self.0.iter().map(|stay| stay.id).eq(ids()) {
            return;
        }
        let old = std::mem::take(&mut self.0);
        self.0.extend(ids().zip(&view.agents.driven).map(|(id, &agent)| {
            let place = view.agents.position[agent as usize].truncate();
            let row = old.binary_search_by_key(&id, |stay| stay.id);
            row.map_or(Stay { id, place, stayed_s: 0.0 }, |row| old[row])
        }));
    }
}
