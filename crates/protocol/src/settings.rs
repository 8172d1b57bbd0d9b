//! How the world advances.

use bytemuck::{Pod, Zeroable};

/// Parameters of [`crate::Command::SetSettings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Settings {
    /// Simulated time of one tick, 0.1 ms to 10 s.
    pub delta_nanos: u64,
    /// Largest physics substep, 0.1 ms to 100 ms.
    pub substep_max_nanos: u64,
    /// 1: synchronous: the world advances when the ticking client requests it; 0: asynchronous: on its own clock.
    pub synchronous: u32,
    /// Frames by which rendering may trail the world: 0 is strict, at most [`crate::PIPELINE_MAX`].
    pub pipeline: u32,
    /// Asynchronous mode: simulated seconds per real second, in thousandths; 0: without pacing.
    pub real_time_permille: u32,
    /// 1: no sensor is rendered.
    pub no_rendering: u32,
}

impl Default for Settings {
    /// Asynchronous, 50 ms at real-time pace, substeps of 10 ms.
    fn default() -> Self {
        Settings {
            delta_nanos: 50_000_000,
            substep_max_nanos: 10_000_000,
            synchronous: 0,
            pipeline: 0,
            real_time_permille: 1000,
            no_rendering: 0,
        }
    }
}
