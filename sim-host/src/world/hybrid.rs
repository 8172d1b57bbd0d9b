//! Hybrid physics: vehicles far from all observers are dormant.

use glam::Vec3;
use protocol::{ActorId, StandingState, flag, kind};

use super::{World, hybrid_radius::radius_m};

/// The role name of vehicles around which physics is full, as in CARLA.
const HERO: &str = "hero";
/// A vehicle becomes dormant at this multiple of the radius at which it ceases to be.
const ENTER: f32 = 1.1;

impl World {
    /// Makes vehicles dormant that traffic drives farther than a radius from every hero, every actor
    /// with sensors and every vehicle that a client drives, and wakes the others.
    pub(crate) fn update_dormant(&mut self, standing: &StandingState) {
        let radius_m = radius_m(standing);
        if radius_m.is_none() && !self.has_dormant {
            return;
        }
        // Actors with a body are a part of the actors with a state, in the same order.
        let mut states = self.actors.states().iter().zip(self.actors.roles());
        let mut observers: Vec<Vec3> = Vec::new();
        let mut driven: Vec<(ActorId, Vec3, [bool; 2])> = Vec::new();
        for (id, place, [is_dormant, is_carrier, is_driven]) in self.physics.observers() {
            let Some((state, role)) = states.find(|(state, _)| state.actor_id == id) else { break };
            let is_vehicle = state.kind == kind::VEHICLE;
            let has_autopilot = is_vehicle && state.has(flag::AUTOPILOT);
            let is_hero = is_vehicle && role.as_str() == HERO;
            if is_hero || is_carrier || is_driven && !has_autopilot {
                observers.push(place);
            }
            let may_be = has_autopilot && !is_hero && !is_carrier && !state.has(flag::KINEMATIC);
            if is_dormant || may_be && radius_m.is_some() {
                driven.push((id, place, [is_dormant, may_be]));
            }
        }
        self.has_dormant = false;
        for (id, place, [is_dormant, may_be]) in driven {
            let near_m =
                radius_m.filter(|_| may_be).map(|m| if is_dormant { m } else { m * ENTER });
            let is_far = near_m.is_some_and(|near_m| {
                observers.iter().all(|other| other.distance_squared(place) > near_m * near_m)
            });
            // The actor exists.
            let _ = self.physics.set_dormant(id, is_far);
            self.has_dormant |= is_far;
        }
    }

    /// Notes that a sensor bundle was mounted on an actor: physics around it is full.
    pub fn mark_carrier(&mut self, id: ActorId) {
        self.physics.mark_carrier(id);
    }
}
