//! The ground on which walkers walk, and routes over it.
//!
//! ```text
//!  town's ground ──sidewalks, inset──▶ outline ─▶ cells ─▶ surface ─▶ route
//!  map's crosswalks, extended ──────────────┘  (triangles)
//! ```
//!
//! Sidewalks, crosswalks and places to cross quiet streets form one planar triangulation in which
//! each triangle has its neighbours. World space, right-handed with z up, metres; everything follows
//! from the map and the seed of the town.

mod area;
mod cells;
mod cut;
mod funnel;
mod ground;
mod outline;
mod quiet;
mod route;
mod surface;

#[cfg(test)]
mod tests;

pub use area::Area;
pub use cells::{Cell, Cells};
pub use ground::{Crossing, Ground};
pub use route::{Search, Walk};
pub use surface::Surface;
