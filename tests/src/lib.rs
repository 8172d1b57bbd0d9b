//! What scenarios and examples share.

pub mod closed_loop;
