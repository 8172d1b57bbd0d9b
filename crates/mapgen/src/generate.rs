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

/// The OpenDRIVE 1.4 text of a town after this plan.
///
/// Every driving lane reaches every other; junctions carry signals with controllers, or yield or
/// stop signs at their minor arms; where people live there are sidewalks and crosswalks; every
/// street has a speed limit.
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
    written(plan, style)
}

/// The text of a plan in this style.
pub(crate) fn written(plan: &Plan, style: Style) -> String {
    let (least, most) = plan.character.sizes_m();
    let plan = Plan { size_m: plan.size_m.clamp(least, most), ..plan.clone() };
    let layout = layouts::layout(&plan, style);
    write::document(&plan, &layout, &junction::junctions(&layout))
}
