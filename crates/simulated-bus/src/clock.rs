//! The simulated clock.

pub use crate::scheduler::now_nanos;
