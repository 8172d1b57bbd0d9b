use mesh::{Face, Material, Tag};

use crate::lane::LaneTypes;

/// What vehicles may at least roll over: its surface goes before all others.
pub(super) const PAVED: LaneTypes = LaneTypes(
    LaneTypes::ANY.0
        & !(LaneTypes::NONE.0 | LaneTypes::SIDEWALK.0 | LaneTypes::MEDIAN.0 | LaneTypes::RAIL.0),
);

/// What vehicles drive on.
pub(super) const ASPHALT: Face =
    Face { tag: Tag::Roads as u8, material: Material::Asphalt as u8, tint: 0, object: 0 };
