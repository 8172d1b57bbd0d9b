//! The cache of baked maps: the only crate with files and mapped memory for maps.
//!
//! [`Cache::network`] and [`Cache::town`] answer from a file where a matching one exists, and
//! otherwise build what is asked for from the OpenDRIVE text. [`Cache::find`] and [`Cache::keep`]
//! serve items that other crates bake, such as the renderer's scenes and the ground of physics.
//!
//! A cache only saves time. A damaged, foreign or unreadable file is a miss; where nothing can be
//! written, nothing is kept. The key of a file covers the map's text, the seed, the detail, and the
//! sources of all code that decides the bytes.

mod cache;
mod checksum;
mod file;
mod maps;
mod memory;
mod town_bytes;
mod values;

#[cfg(test)]
mod tests;

pub use cache::{Cache, Key};
pub use file::Parts;
pub use maps::{LoadedTown, MapError, TownSource};
pub use town_bytes::{TOWN_VERSION, TownError, town_from_bytes, town_to_bytes};
pub use values::Values;
