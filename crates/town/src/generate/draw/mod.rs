//! The styles.

mod countryside;
pub(super) mod grid;
pub(super) mod highway;
mod old_town;
mod roundabouts;
mod suburb;

use super::Plan;
use super::graph::Layout;
use grid::Blocks;
use highway::Course;

/// What exactly is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    Grid(Blocks),
    OldTown,
    Suburb,
    Roundabouts,
    Highway(Course, Blocks),
    Countryside,
}

/// Draws it.
pub(super) fn draw(plan: &Plan, style: Style) -> Layout {
    match style {
        Style::Grid(blocks) => grid::layout(plan, blocks),
        Style::OldTown => old_town::layout(plan),
        Style::Suburb => suburb::layout(plan),
        Style::Roundabouts => roundabouts::layout(plan),
        Style::Highway(course, blocks) => highway::layout(plan, course, blocks),
        Style::Countryside => countryside::layout(plan),
    }
}
