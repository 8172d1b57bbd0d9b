//! What may happen in a scene at a time of its plan.

use serde::{Deserialize, Serialize};

use crate::collect::sky::WeatherEntry;

/// Something that happens in a scene.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Event {
    /// Simulated time after the first frame that is kept.
    pub(crate) at_secs: f64,
    /// The weather changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) weather: Option<WeatherEntry>,
    /// A pedestrian crosses the road ahead of the ego.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) crossing: Option<Crossing>,
}

/// A pedestrian who crosses the road, from right to left.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Crossing {
    /// Distance ahead of the ego.
    pub(crate) ahead_m: f32,
    pub(crate) speed_mps: f32,
}
