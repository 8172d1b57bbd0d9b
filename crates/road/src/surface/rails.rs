//! Guard rails, walls and fences along roads.

use std::ops::Range;

use glam::DVec3;
use mesh::{Face, Material, Tag};

use super::sweep::{BOX, Sweep, structure_ranges};
use crate::object::{ObjectPlace, RoadObject};

/// How a kind of object is built.
#[derive(Clone, Copy)]
struct Make {
    tag: Tag,
    material: Material,
    height_m: f64,
    width_m: f64,
    /// Height of the body where it hangs on posts, metres.
    beam_m: Option<f64>,
}

const GUARD_RAIL: Make = Make {
    tag: Tag::GuardRail,
    material: Material::Metal,
    height_m: 0.75,
    width_m: 0.08,
    beam_m: Some(0.31),
};
const RAILING: Make = Make {
    tag: Tag::GuardRail,
    material: Material::Metal,
    height_m: 1.0,
    width_m: 0.06,
    beam_m: Some(0.5),
};
const BARRIER: Make = Make {
    tag: Tag::Wall,
    material: Material::Concrete,
    height_m: 0.8,
    width_m: 0.4,
    beam_m: None,
};
const WALL: Make = Make {
    tag: Tag::Wall,
    material: Material::Concrete,
    height_m: 2.0,
    width_m: 0.25,
    beam_m: None,
};
const FENCE: Make =
    Make { tag: Tag::Fence, material: Material::Metal, height_m: 1.2, width_m: 0.05, beam_m: None };

/// Half the width of a post, metres.
const POST_HALF_M: f64 = 0.05;
/// How deep bodies reach into the ground, metres.
const FOOT_M: f64 = 0.2;

/// Adds an object that continues along its road.
pub(super) fn object(object: &RoadObject, sweep: &mut Sweep) {
    let Some(make) = make(object) else { return };
    for run in &object.runs {
        if !sweep.admits(run.len()) {
            return;
        }
        structure_ranges(run.len()).for_each(|part| body(object.road, run, part, make, sweep));
    }
}

fn make(object: &RoadObject) -> Option<Make> {
    let says = |word: &str| {
        let texts = [&object.kind, &object.subtype, &object.name];
        texts.iter().any(|text| text.to_ascii_lowercase().contains(word))
    };
    let make = match object.kind.as_str() {
        "barrier" | "guardRail" | "railing" if says("guard") => GUARD_RAIL,
        "railing" => RAILING,
        "barrier" if says("railing") => RAILING,
        "barrier" if says("fence") => FENCE,
        "barrier" if says("wall") => WALL,
        "barrier" => BARRIER,
        "wall" | "soundBarrier" | "noiseProtections" => WALL,
        "fence" => FENCE,
        _ => return None,
    };
    Some(make)
}

fn body(road: u32, run: &[ObjectPlace], part: Range<usize>, make: Make, sweep: &mut Sweep) {
    let face = Face::new(make.tag, make.material, 0);
    let or = |said: f64, usual: f64| if said > 0.0 { said.min(20.0) } else { usual };
    let aside = |at: usize| {
        let (before, after) = (at.saturating_sub(1), (at + 1).min(run.len() - 1));
        let along = (run[after].position - run[before].position).truncate().normalize_or_zero();
        along.perp().extend(0.0)
    };
    let row = |at: usize| {
        let place = &run[at];
        let half = aside(at) * (0.5 * or(place.width_m, make.width_m));
        let height = or(place.height_m, make.height_m);
        let foot = make.beam_m.map_or(-FOOT_M, |beam| (height - beam).max(0.0));
        let [top, foot] = [height, foot].map(|up| place.position + DVec3::Z * up);
        [top + half, top - half, foot - half, foot + half]
    };
    let rows: Vec<[DVec3; 4]> = part.clone().map(row).collect();
    let low = |row: &[DVec3; 4]| {
        let height = or(run[0].height_m, make.height_m);
        row[0].midpoint(row[1]) - DVec3::Z * height
    };
    sweep.begin(make.tag, false);
    let free = sweep.body(&BOX, &rows, road, face, low);
    // The space below a beam collides too.
    let height = or(run[0].height_m, make.height_m);
    sweep.solid(&rows, &free, make.beam_m.map_or(0.0, |beam| (height - beam).max(0.0)));
    if make.beam_m.is_some() {
        let last = part.end == run.len();
        for place in &run[part.start..part.end - usize::from(!last)] {
            let foot = place.position - DVec3::Z * FOOT_M;
            let height = or(place.height_m, make.height_m) + FOOT_M - 0.05;
            sweep.post(foot, POST_HALF_M, height, face);
        }
    }
}
