//! Labels beyond boxes, as plans and metadata name them.

use serde::{Deserialize, Serialize};

/// What is written of objects in the images of cameras, besides their boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct LabelSettings {
    /// The keypoints of walkers.
    pub(crate) keypoints: bool,
    /// The masks that objects would have if nothing occluded them.
    pub(crate) amodal_masks: bool,
}

impl Default for LabelSettings {
    fn default() -> LabelSettings {
        LabelSettings { keypoints: true, amodal_masks: false }
    }
}

impl LabelSettings {
    /// Nothing but boxes: what data sets hold whose metadata has no settings of labels.
    pub(crate) fn boxes_alone() -> LabelSettings {
        LabelSettings { keypoints: false, amodal_masks: false }
    }
}
