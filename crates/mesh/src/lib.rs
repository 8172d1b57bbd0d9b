//! The vocabulary that all geometry of this workspace shares: [`Mesh`], [`Face`], [`Tag`],
//! [`Material`]; and the only hash functions and random number generator, so that equal inputs
//! give equal bits everywhere.
//!
//! Metres, f32, right-handed, z up. The space of a mesh is that of its owner.

mod code;
mod hash;
mod material;
mod mesh;
mod object;
mod random;
mod tag;

pub use hash::{Fnv1a64, WordHash, fnv1a64, fold_word, mix_word};
pub use material::Material;
pub use mesh::{Face, Mesh};
pub use object::{ObjectBits, ObjectId};
pub use random::{GOLDEN_GAMMA, RandomStream, first_of, mix64};
pub use tag::Tag;
