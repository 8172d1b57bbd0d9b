//! The C interface: the client library as functions and plain structs. `include/omnibus.h`, which
//! cbindgen writes from this source, is what C programs include; `docs/c.md` is its manual.
//!
//! Pointers from C come in as references and boxes, which may be NULL (`Option`); those to texts and
//! arrays are checked in `argument`. What C promises about them is in the head of the header.

pub mod actors;
mod argument;
pub mod bundle;
pub mod client;
pub mod map;
pub mod radar;
mod radar_model;
pub mod status;
pub mod world;

#[cfg(test)]
mod header;
