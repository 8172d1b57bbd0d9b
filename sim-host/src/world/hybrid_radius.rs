//! The radius of hybrid physics.

use protocol::{ActorId, HYBRID_RADIUS_M, StandingState, param};

/// Returns the radius of hybrid physics, or `None` if it is off.
pub(super) fn radius_m(standing: &StandingState) -> Option<f32> {
    let value = |param| standing.traffic_param(ActorId::NONE, param);
    let is_on = value(param::HYBRID_PHYSICS).is_some_and(|on| on != 0.0);
    is_on.then(|| value(param::HYBRID_RADIUS_M).unwrap_or(HYBRID_RADIUS_M).max(0.0))
}
