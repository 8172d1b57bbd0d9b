//! Faces that several parts of the surface share.

use mesh::{Face, Material, Tag};

/// The face of what vehicles drive on.
pub(crate) const ASPHALT: Face =
    Face { tag: Tag::Roads as u8, material: Material::Asphalt as u8, tint: 0, object: 0 };
