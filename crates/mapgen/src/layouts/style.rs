//! What distinguishes the layouts of one character.

/// What exactly is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    Grid(Blocks),
    OldTown,
    Suburb,
    Roundabouts,
    Highway(Course, Blocks),
    Countryside,
}

/// How broad the streets are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blocks {
    /// Avenues through the middle, streets between.
    Mixed,
    /// Avenues everywhere.
    Broad,
    /// Streets only, and no two of them cross: every junction has three arms.
    Tees,
}

/// How the motorway runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Course {
    /// Once round the town.
    Ring,
    /// Round the town and round a loop beside it, over itself.
    Eight,
}
