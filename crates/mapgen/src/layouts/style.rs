//! What distinguishes the layouts of one character.

/// A layout style.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    Grid(Blocks),
    OldTown,
    Suburb,
    Roundabouts,
    Highway(Course, Blocks),
    Countryside,
}

/// The streets of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blocks {
    /// Avenues through the middle, streets elsewhere.
    Mixed,
    /// Only avenues.
    Broad,
    /// Only streets, and no two of them cross: every junction has three arms.
    Tees,
}

/// The course of the motorway.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Course {
    /// A ring round the town.
    Ring,
    /// A figure of eight: round the town and round a second loop, crossing itself.
    Eight,
}
