//! Fuzz targets: every format that the programs read from outside, as functions over bytes.
//!
//! ```text
//! corpus ──▶ mutation ──▶ Target::run ──▶ accepted, refused, or a failure with its input
//!                             ▲
//! libFuzzer (developers) ─────┘
//! ```

mod allocation;
mod corpus;
mod mutation;
mod running;
mod session;
mod target;
mod targets;

pub use allocation::CountingAllocator;
pub use corpus::{folder, is_soak, seeds};
pub use session::{Session, Summary};
pub use target::{TARGETS, Target, target};
