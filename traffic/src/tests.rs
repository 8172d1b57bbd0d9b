//! The whole mind at the wheel of simple vehicles.

mod course;
mod towns;
