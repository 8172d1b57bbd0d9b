//! The one integration test binary: real processes, whole scenarios.

mod kit;

mod alone;
mod carla;
mod crash;
mod exact;
mod leave;
mod map;
mod maps;
mod modes;
mod parity;
mod refuse;
mod same;
mod tidy;
mod two;
