//! What a radar makes of its rays.

use client_lib::{Radar, RadarReceiver};

/// A radar and its receiver, if it has one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RadarModel {
    pub(crate) radar: Radar,
    pub(crate) receiver: Option<RadarReceiver>,
}
