//! Traffic: vehicles and walkers on autopilot, and traffic lights.

use std::{collections::BTreeMap, sync::Arc};

use client_lib::{ActorId, Command, LightPhase, RouteStep, TrafficParam, glam::Vec3};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::core::Core;

#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Traffic {
    pub(crate) core: Arc<Core>,
}

/// A place that a route passes (metres), or the name of a turn.
#[derive(FromPyObject)]
enum Step {
    Turn(String),
    Place([f32; 3]),
}

impl Traffic {
    fn param(&self, py: Python<'_>, actor_id: Option<u32>, param: TrafficParam) -> PyResult<()> {
        let actor_id = actor_id.map_or(ActorId::NONE, ActorId);
        let command = Command::set_traffic_param(actor_id, param);
        self.core.request(py, "traffic", command).map(drop)
    }
}

/// A parameter of the traffic by its name in Python.
fn named(name: &str, value: f32) -> PyResult<TrafficParam> {
    Ok(match name {
        "speed_reduction" => TrafficParam::SpeedReduction(value),
        "speed_mps" => TrafficParam::SpeedMps(value),
        "gap_m" => TrafficParam::GapM(value),
        "offset_left_m" => TrafficParam::OffsetLeftM(value),
        "changes_lanes" => TrafficParam::ChangesLanes(value != 0.0),
        "keep_right" => TrafficParam::KeepRight(value),
        "change_left" => TrafficParam::ChangeLeft(value),
        "change_right" => TrafficParam::ChangeRight(value),
        "ignore_lights" => TrafficParam::IgnoreLights(value),
        "ignore_signs" => TrafficParam::IgnoreSigns(value),
        "ignore_vehicles" => TrafficParam::IgnoreVehicles(value),
        "ignore_walkers" => TrafficParam::IgnoreWalkers(value),
        "driver_spread" => TrafficParam::DriverSpread(value),
        "automatic_lights" => TrafficParam::AutomaticLights(value != 0.0),
        "cross_factor" => TrafficParam::CrossFactor(value),
        "hybrid_physics" => TrafficParam::HybridPhysics(value != 0.0),
        "hybrid_radius_m" => TrafficParam::HybridRadiusM(value),
        "walks_with" => TrafficParam::WalksWith(ActorId(value as u32)),
        other => {
            return Err(PyValueError::new_err(format!(
                "unknown traffic parameter {other:?}; use speed_reduction, speed_mps, gap_m, \
                 offset_left_m, changes_lanes, keep_right, change_left, change_right, \
                 ignore_lights, ignore_signs, ignore_vehicles, ignore_walkers, driver_spread, \
                 automatic_lights, cross_factor, hybrid_physics, hybrid_radius_m or walks_with"
            )));
        }
    })
}

#[pymethods]
impl Traffic {
    #[pyo3(signature = (actor_id, on=true))]
    fn set_autopilot(&self, py: Python<'_>, actor_id: u32, on: bool) -> PyResult<()> {
        let command = Command::set_autopilot(ActorId(actor_id), on);
        self.core.request(py, "set_autopilot", command).map(drop)
    }

    /// Sets parameters of one vehicle or walker on autopilot, or of all that were told nothing themselves.
    #[pyo3(signature = (actor_id=None, **params))]
    fn set(
        &self,
        py: Python<'_>,
        actor_id: Option<u32>,
        params: Option<BTreeMap<String, Option<f32>>>,
    ) -> PyResult<()> {
        let params = params.unwrap_or_default().into_iter();
        let given = params.filter_map(|(name, value)| Some(named(&name, value?)));
        // All are checked before the first is sent.
        let given = given.collect::<PyResult<Vec<_>>>()?;
        given.into_iter().try_for_each(|param| self.param(py, actor_id, param))
    }

    fn change_lane(&self, py: Python<'_>, actor_id: u32, side: &str) -> PyResult<()> {
        let param = match side {
            "left" => TrafficParam::ChangeLeftNow,
            "right" => TrafficParam::ChangeRightNow,
            other => {
                return Err(PyValueError::new_err(format!("side is {other:?}; use left or right")));
            }
        };
        self.param(py, Some(actor_id), param)
    }

    #[pyo3(signature = (actor_id, other, on=true))]
    fn ignore_actor(&self, py: Python<'_>, actor_id: u32, other: u32, on: bool) -> PyResult<()> {
        self.param(py, Some(actor_id), TrafficParam::IgnoreActor(ActorId(other), on))
    }

    fn set_seed(&self, py: Python<'_>, seed: u32) -> PyResult<()> {
        self.param(py, None, TrafficParam::Seed(seed))
    }

    fn set_walker_seed(&self, py: Python<'_>, seed: u32) -> PyResult<()> {
        self.param(py, None, TrafficParam::WalkerSeed(seed))
    }

    fn set_route(&self, py: Python<'_>, actor_id: u32, steps: Vec<Step>) -> PyResult<()> {
        let step = |step: Step| {
            Ok(match step {
                Step::Place(position_m) => RouteStep::Place(Vec3::from_array(position_m)),
                Step::Turn(turn) => match turn.as_str() {
                    "left" => RouteStep::Left,
                    "right" => RouteStep::Right,
                    "straight" => RouteStep::Straight,
                    "lane_left" => RouteStep::LaneLeft,
                    "lane_right" => RouteStep::LaneRight,
                    other => {
                        return Err(PyValueError::new_err(format!(
                            "unknown step {other:?}; use a position in metres, left, right, \
                             straight, lane_left or lane_right"
                        )));
                    }
                },
            })
        };
        let steps = steps.into_iter().map(step).collect::<PyResult<Vec<_>>>()?;
        self.core.with(py, |client| client.set_route(ActorId(actor_id), &steps))
    }

    fn hold_light(&self, py: Python<'_>, actor_id: u32, phase: &str) -> PyResult<()> {
        let phase = match phase {
            "red" => LightPhase::Red,
            "yellow" => LightPhase::Yellow,
            "green" => LightPhase::Green,
            "off" => LightPhase::Off,
            other => {
                return Err(PyValueError::new_err(format!(
                    "phase is {other:?}; use red, yellow, green or off"
                )));
            }
        };
        let command = Command::hold_light(ActorId(actor_id), phase);
        self.core.request(py, "hold_light", command).map(drop)
    }

    fn release_light(&self, py: Python<'_>, actor_id: u32) -> PyResult<()> {
        let command = Command::release_light(ActorId(actor_id));
        self.core.request(py, "release_light", command).map(drop)
    }

    fn light_group(&self, py: Python<'_>, actor_id: u32) -> PyResult<Vec<u32>> {
        let group = self.core.with(py, |client| client.light_group(ActorId(actor_id)))?;
        Ok(group.into_iter().map(|light| light.0).collect())
    }
}
