//! The kinds of walkable ground.

/// A kind of walkable ground. The value is the Detour area in CARLA's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(crate) enum Area {
    Sidewalk = 1,
    Crosswalk = 2,
}

impl Area {
    /// Returns the polygon flag by which CARLA's clients filter.
    pub(super) fn flag(self) -> u16 {
        1 << self as u16
    }
}
