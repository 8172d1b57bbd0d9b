//! To come.

pub mod physics;
