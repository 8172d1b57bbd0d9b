//! Fixtures that scenarios and examples share.

pub mod closed_loop;
mod red_lights;

/// The Rust blocks of the README and of `docs/`, compiled as doctests.
#[cfg(doctest)]
pub mod docs {
    include!(concat!(env!("OUT_DIR"), "/docs.rs"));
}
