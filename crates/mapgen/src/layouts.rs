//! The layouts of streets: one module for each style.

mod countryside;
mod grid;
mod highway;
mod old_town;
mod roundabouts;
pub(crate) mod style;
mod suburb;

use crate::{layout::Layout, layouts::style::Style, plan::Plan};

/// Draws the layout of a plan in this style.
pub(crate) fn layout(plan: &Plan, style: Style) -> Layout {
    match style {
        Style::Grid(blocks) => grid::layout(plan, blocks),
        Style::OldTown => old_town::layout(plan),
        Style::Suburb => suburb::layout(plan),
        Style::Roundabouts => roundabouts::layout(plan),
        Style::Highway(course, blocks) => highway::layout(plan, course, blocks),
        Style::Countryside => countryside::layout(plan),
    }
}
