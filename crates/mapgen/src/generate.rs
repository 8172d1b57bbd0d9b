//! From a plan to OpenDRIVE text.

use crate::{
    junction,
    layouts::{
        self,
        style::{Blocks, Course, Style},
    },
    plan::{Character, Plan},
    write,
};

/// Returns the OpenDRIVE 1.4 text of the town that `plan` describes.
///
/// Every driving lane is reachable from every other. Junctions have signals with controllers, or
/// yield or stop signs on their minor arms. Streets in built-up areas have sidewalks and
/// crosswalks. Every street has a speed limit.
pub fn generate(plan: &Plan) -> String {
    let style = match plan.character {
        Character::Grid => Style::Grid(Blocks::Mixed),
        Character::OldTown => Style::OldTown,
        Character::Suburb => Style::Suburb,
        Character::Highway if plan.seed.is_multiple_of(3) => {
            Style::Highway(Course::Eight, Blocks::Mixed)
        }
        Character::Highway => Style::Highway(Course::Ring, Blocks::Mixed),
        Character::Roundabouts => Style::Roundabouts,
        Character::Countryside => Style::Countryside,
    };
    write_plan(plan, style)
}

/// Returns the text of a plan, drawn in this style.
pub(crate) fn write_plan(plan: &Plan, style: Style) -> String {
    let (least, most) = plan.character.size_range_m();
    let plan = Plan { size_m: plan.size_m.clamp(least, most), ..plan.clone() };
    let layout = layouts::layout(&plan, style);
    write::write(&plan, &layout, &junction::junctions(&layout))
}
