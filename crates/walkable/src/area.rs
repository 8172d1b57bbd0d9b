//! The kinds of walkable ground.

/// A kind of walkable ground. The value is the Detour area in CARLA's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Area {
    /// A sidewalk.
    Sidewalk = 1,
    /// A crosswalk.
    Crosswalk = 2,
    /// A quiet street, where those cross that need no crosswalk.
    Road = 3,
}

impl Area {
    /// Returns the polygon flag by which CARLA's clients filter.
    pub fn flag(self) -> u16 {
        1 << self as u16
    }
}
