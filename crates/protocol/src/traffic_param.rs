//! Parameters of vehicles and walkers on autopilot.

use bytemuck::{Pod, Zeroable};

use crate::ActorId;

/// Parameters of [`crate::Command::TrafficParam`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TrafficParam {
    /// The vehicle or walker; [`ActorId::NONE`]: every one.
    pub actor_id: ActorId,
    /// One of [`param`].
    pub param: u32,
    /// The value, in the unit of the parameter.
    pub value: f32,
}

/// Radius of hybrid physics unless [`param::HYBRID_RADIUS_M`] sets another, as in CARLA. Metres.
pub const HYBRID_RADIUS_M: f32 = 50.0;

/// Values of [`TrafficParam::param`].
pub mod param {
    /// Reduction of the speed limit as a fraction: 0.3 is 30 % slower, −0.2 is 20 % faster.
    pub const SPEED_REDUCTION: u32 = 1;
    /// Gap to the leading vehicle at standstill, metres.
    pub const GAP_M: u32 = 2;
    /// Fraction of red lights that are ignored.
    pub const IGNORE_LIGHTS: u32 = 3;
    /// Desired speed in metres per second, independent of the limit but reduced in curves. The later
    /// of this and [`SPEED_REDUCTION`] holds. Of a walker: the highest speed at which it walks; the
    /// value for every vehicle does not concern walkers.
    pub const SPEED_MPS: u32 = 4;
    /// Lateral offset from the centre of the lane, metres, positive to the left.
    pub const OFFSET_LEFT_M: u32 = 5;
    /// 1: changes lanes where that is an advantage (the default); 0: never does.
    pub const CHANGES_LANES: u32 = 6;
    /// Changes lanes once, as soon as there is a neighbouring lane, even if it is occupied: 1 to the
    /// left, −1 to the right.
    pub const CHANGE_NOW: u32 = 7;
    /// Probability of a change to the right, if that is safe, at each lane decision, about every
    /// 0.6 s.
    pub const KEEP_RIGHT: u32 = 8;
    /// Probability of a change to the left, with the same rule.
    pub const CHANGE_LEFT: u32 = 9;
    /// Probability of a change to the right, with the same rule; added to [`KEEP_RIGHT`].
    pub const CHANGE_RIGHT: u32 = 10;
    /// Fraction of stop and yield signs that are ignored.
    pub const IGNORE_SIGNS: u32 = 11;
    /// Fraction of other vehicles that are ignored, drawn once for each.
    pub const IGNORE_VEHICLES: u32 = 12;
    /// Fraction of walkers that are ignored, drawn once for each.
    pub const IGNORE_WALKERS: u32 = 13;
    /// For every vehicle: the random streams of traffic restart from this integer, 0 to 2^24, and the
    /// seed of the world.
    pub const SEED: u32 = 14;
    /// 1: traffic switches the vehicle lights: indicators, brake lights, and low beam, position and
    /// fog lights by the weather.
    pub const LAMPS: u32 = 15;
    /// For every vehicle: by how much drivers differ. 0: not at all; 1, the default: as in the field.
    pub const DRIVER_SPREAD: u32 = 16;
    /// Fraction of walkers that cross quiet streets away from crosswalks, drawn once for each.
    pub const CROSS_FACTOR: u32 = 17;
    /// For every walker: the random streams of walkers restart from this integer, 0 to 2^24, and the
    /// seed of the world.
    pub const WALKER_SEED: u32 = 18;
    /// Of a walker: the id of the walker with which it goes, 0 for none.
    pub const WALKS_WITH: u32 = 19;
    /// For every vehicle: 1 switches hybrid physics on, 0, the default, off. Vehicles on autopilot that
    /// are farther than [`HYBRID_RADIUS_M`] from every vehicle with the role name `hero`, every actor
    /// with sensors and every vehicle that a client drives are moved by a kinematic model.
    pub const HYBRID_PHYSICS: u32 = 20;
    /// For every vehicle: the radius of hybrid physics, metres; [`crate::HYBRID_RADIUS_M`] by default.
    pub const HYBRID_RADIUS_M: u32 = 21;
    /// Plus the id of an actor: 1 ignores that actor, 0 does not, whatever the fractions say.
    pub const IGNORE_ACTOR: u32 = 1 << 31;

    /// The parameter that this one replaces.
    pub const fn displaces(param: u32) -> Option<u32> {
        match param {
            SPEED_MPS => Some(SPEED_REDUCTION),
            SPEED_REDUCTION => Some(SPEED_MPS),
            _ => None,
        }
    }

    /// Whether the parameter is reset when its action is done.
    pub const fn is_once(param: u32) -> bool {
        param == CHANGE_NOW
    }

    /// Whether a parameter of `owner` ends when the actor `gone` is destroyed.
    pub fn ends_with(owner: super::ActorId, param: u32, gone: super::ActorId) -> bool {
        owner == gone || param == IGNORE_ACTOR.saturating_add(gone.0)
    }
}
