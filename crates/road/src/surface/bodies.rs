//! Objects with an outline or a size of their own: extruded to their height.

use glam::{DVec2, DVec3};
use mesh::{Face, Material, Mesh, Tag};

use super::{
    polygon::{CORNERS_MAX, area, triangles},
    sweep::{BOX, Sweep},
};
use crate::{
    object::{Corner, ObjectPlace, OutlineShape, RoadObject},
    structure::Solid,
};

/// Lower bodies do not collide, metres.
const SOLID_FROM_M: f64 = 0.25;
/// How deep bodies reach into the ground, and how thick bodies are that are only a line, metres.
const FOOT_M: f64 = 0.2;
const LINE_M: f64 = 0.15;
/// Height of flat areas above the ground, metres.
const PATCH_M: f64 = 0.01;
/// Height of kerbs around an object, metres.
const KERB_M: f64 = 0.1;

/// Adds the bodies that an object's outlines, borders and size describe.
pub(super) fn object(object: &RoadObject, sweep: &mut Sweep) {
    if object.is_crosswalk() {
        return;
    }
    let is_space = object.kind == "parkingSpace";
    for (number, shape) in object.shapes.iter().enumerate() {
        for corners in outlines(object, number) {
            if !sweep.admits(corners.len()) {
                return;
            }
            if !is_space {
                outlined(object, shape, &corners, sweep);
            }
            for border in &object.borders {
                let meant =
                    shape.id.map_or(border.outline == number as u32, |id| id == border.outline);
                if meant && border.kind != "paint" {
                    let ids = &object.corner_ids[number];
                    let path = path(&corners, ids, &border.corners, border.is_complete);
                    kerb(object.road, &path, border.width_m, sweep);
                }
            }
        }
    }
    let sized = matches!(object.kind.as_str(), "building" | "obstacle" | "barrier");
    if sized && object.shapes.is_empty() && object.runs.is_empty() {
        for place in &object.places {
            let [x, y, z] = [place.length_m, place.width_m, place.height_m];
            if x.min(y).min(z) > 0.0 && x.max(y).max(z) < 500.0 && sweep.admits(4) {
                let corners = rectangle(place, x, y);
                // A building that the file places on lanes is not meant to stand there.
                if !sweep.is_paved(object.road, place.position) {
                    let heights_m = vec![z; 4];
                    let shape =
                        OutlineShape { id: None, fill: String::new(), is_closed: true, heights_m };
                    outlined(object, &shape, &corners, sweep);
                }
            }
        }
    }
}

/// Returns the corners of one of an object's outlines, once for each repetition.
pub(super) fn outlines(object: &RoadObject, number: usize) -> Vec<Vec<DVec3>> {
    let own = &object.outlines[number];
    let corners = &object.corners[number][..own.len()];
    let local = |corner: &Corner| match *corner {
        Corner::Local { u, v, z } => Some(DVec3::new(u, v, z)),
        Corner::Road { .. } => None,
    };
    let locals: Option<Vec<DVec3>> = corners.iter().map(local).collect();
    let outlines = match locals {
        Some(locals) if object.repeats.iter().any(|repeat| repeat.distance_m > 0.0) => object
            .places
            .iter()
            .map(|place| locals.iter().map(|corner| at(place, *corner)).collect())
            .collect(),
        _ => vec![own.clone()],
    };
    let usable = |corners: &Vec<DVec3>| corners.len() <= CORNERS_MAX;
    outlines.into_iter().filter(usable).collect()
}

/// Transforms a point from an object's own space to world space.
pub(super) fn at(place: &ObjectPlace, local: DVec3) -> DVec3 {
    let turned = DVec2::from_angle(place.heading_rad).rotate(local.truncate());
    place.position + turned.extend(local.z)
}

/// Returns the corners of an object's bounding rectangle on the ground.
pub(super) fn rectangle(place: &ObjectPlace, length_m: f64, width_m: f64) -> Vec<DVec3> {
    let (x, y) = (0.5 * length_m, 0.5 * width_m);
    [(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| at(place, DVec3::new(x, y, 0.0))).to_vec()
}

/// Returns the path along the listed corners of an outline, or around all of it.
pub(super) fn path(corners: &[DVec3], ids: &[u32], named: &[u32], all: bool) -> Vec<DVec3> {
    if all || named.is_empty() {
        return corners.iter().chain(corners.first()).copied().collect();
    }
    let corner = |name: &u32| ids.iter().position(|id| id == name).and_then(|at| corners.get(at));
    named.iter().filter_map(corner).copied().collect()
}

fn outlined(object: &RoadObject, shape: &OutlineShape, corners: &[DVec3], sweep: &mut Sweep) {
    let tallest = shape.heights_m.iter().copied().fold(0.0, f64::max);
    let height = |corner: usize| {
        let own = shape.heights_m.get(corner).copied().unwrap_or(0.0);
        // An object may give one height for all its corners.
        if tallest > 0.0 { own } else { object.height_m.clamp(0.0, 500.0) }
    };
    let highest = (0..corners.len()).map(height).fold(0.0, f64::max);
    let (tag, material) = looks(object, shape, highest);
    let face = Face::new(tag, material, 0);
    if !shape.is_closed {
        if highest > 0.0 && corners.len() > 1 {
            line(object.road, corners, height, face, sweep);
        }
        return;
    }
    if corners.len() < 3 || area(corners).abs() < 0.01 {
        return;
    }
    let mut order: Vec<usize> = (0..corners.len()).collect();
    if area(corners) < 0.0 {
        order.reverse();
    }
    let round: Vec<DVec3> = order.iter().map(|corner| corners[*corner]).collect();
    let faces = triangles(&round);
    let mut mesh = Mesh::default();
    let put = |mesh: &mut Mesh, up: &dyn Fn(usize) -> f64| -> Vec<u32> {
        let point = |at: usize| (round[at] + DVec3::Z * up(order[at])).as_vec3().to_array();
        (0..round.len()).map(|at| mesh.vertex(point(at))).collect()
    };
    if highest <= 0.0 {
        // Without height and filling it only marks an area.
        if !shape.fill.is_empty() {
            let top = put(&mut mesh, &|_| PATCH_M);
            faces.iter().for_each(|face3| mesh.triangle(face3.map(|at| top[at]), face));
            sweep.begin(tag, true);
            sweep.add(&mesh);
        }
        return;
    }
    let top = put(&mut mesh, &height);
    let foot = put(&mut mesh, &|_| -FOOT_M);
    for corners in &faces {
        let [a, b, c] = *corners;
        mesh.triangle([top[a], top[b], top[c]], face);
        mesh.triangle([foot[c], foot[b], foot[a]], face);
    }
    for from in 0..round.len() {
        let to = (from + 1) % round.len();
        mesh.triangle([foot[from], foot[to], top[to]], face);
        mesh.triangle([foot[from], top[to], top[from]], face);
    }
    sweep.begin(tag, false);
    sweep.add(&mesh);
    if highest >= SOLID_FROM_M {
        let tops: Vec<f64> = order.iter().map(|corner| height(*corner)).collect();
        solids(&round, &tops).into_iter().for_each(|solid| sweep.add_box(solid));
    }
}

/// Returns one box if the outline is almost a box, otherwise a wall of boxes around it.
fn solids(round: &[DVec3], tops: &[f64]) -> Vec<Solid> {
    let sides = || (0..round.len()).map(|from| (from, (from + 1) % round.len()));
    let low = round.iter().map(|corner| corner.z).fold(f64::INFINITY, f64::min) - FOOT_M;
    let long = sides().max_by(|a, b| {
        let length = |(from, to): (usize, usize)| round[from].distance(round[to]);
        length(*a).total_cmp(&length(*b))
    });
    let Some((from, to)) = long else { return Vec::new() };
    let along = (round[to] - round[from]).truncate().normalize_or_zero();
    let own = |corner: &DVec3| {
        let at = corner.truncate();
        DVec2::new(along.dot(at), along.perp_dot(at))
    };
    let (least, most) =
        round.iter().map(own).fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(least, most), at| {
            (least.min(at), most.max(at))
        });
    let size = most - least;
    let high = round.iter().zip(tops).map(|(corner, top)| corner.z + top);
    let high = high.fold(f64::NEG_INFINITY, f64::max);
    let body = |middle: DVec2, half: DVec2, high: f64, along: DVec2| Solid {
        center: middle.extend(0.5 * (low + high)),
        half_extents_m: half.extend(0.5 * (high - low)),
        yaw_rad: along.to_angle(),
    };
    if 0.5 * area(round) > 0.9 * size.x * size.y {
        let middle = least.midpoint(most);
        return vec![body(along.rotate(middle), 0.5 * size, high, along)];
    }
    sides()
        .filter(|(from, to)| round[*from].distance(round[*to]) > 0.05)
        .map(|(from, to)| {
            let way = (round[to] - round[from]).truncate();
            let along = way.normalize_or_zero();
            let high = (round[from].z + tops[from]).max(round[to].z + tops[to]);
            let inwards = along.perp() * (0.5 * LINE_M);
            let middle = round[from].midpoint(round[to]).truncate() + inwards;
            body(middle, DVec2::new(0.5 * way.length(), 0.5 * LINE_M), high, along)
        })
        .collect()
}

/// Adds a thin wall from corner to corner.
fn line(
    road: u32,
    corners: &[DVec3],
    height: impl Fn(usize) -> f64,
    face: Face,
    sweep: &mut Sweep,
) {
    let rows = sections(corners, LINE_M, |corner| (-FOOT_M, height(corner)));
    sweep.begin(Tag::from_code(face.tag).unwrap_or(Tag::Static), false);
    let foot = |row: &[DVec3; 4]| row[2].midpoint(row[3]) + DVec3::Z * FOOT_M;
    let free = sweep.body(&BOX, &rows, road, face, foot);
    let highest = (0..corners.len()).map(height).fold(0.0, f64::max);
    if highest >= SOLID_FROM_M {
        sweep.solid(&rows, &free, 0.0);
    }
}

fn kerb(road: u32, path: &[DVec3], width_m: f64, sweep: &mut Sweep) {
    if path.len() < 2 || width_m < 0.01 {
        return;
    }
    let rows = sections(path, width_m, |_| (-FOOT_M, KERB_M));
    sweep.begin(Tag::SideWalks, true);
    let face = Face::new(Tag::SideWalks, Material::Kerb, 0);
    sweep.body(&BOX, &rows, road, face, |row| row[2].midpoint(row[3]) + DVec3::Z * FOOT_M);
}

/// Returns cross-sections at the corners of a path, between these heights.
fn sections(
    corners: &[DVec3],
    width_m: f64,
    heights: impl Fn(usize) -> (f64, f64),
) -> Vec<[DVec3; 4]> {
    let last = corners.len() - 1;
    let way = |from: usize, to: usize| (corners[to] - corners[from]).truncate().normalize_or_zero();
    let row = |at: usize| {
        let (before, after) = (way(at.saturating_sub(1), at), way(at, (at + 1).min(last)));
        let (before, after) =
            (if at == 0 { after } else { before }, if at == last { before } else { after });
        let middle = (before + after).normalize_or(after);
        // As wide as the adjacent sides, at corners that are not too sharp.
        let half = 0.5 * width_m / middle.dot(after).max(0.5);
        let left = (middle.perp() * half).extend(0.0);
        let (low, high) = heights(at);
        let [low, high] = [low, high].map(|up| corners[at] + DVec3::Z * up);
        [high + left, high - left, low - left, low + left]
    };
    (0..corners.len()).map(row).collect()
}

/// Returns tag and material of an object's body.
fn looks(object: &RoadObject, shape: &OutlineShape, height: f64) -> (Tag, Material) {
    let filled = match shape.fill.as_str() {
        "grass" => Some(Material::Grass),
        "concrete" => Some(Material::Concrete),
        "cobble" | "pavement" => Some(Material::Paving),
        "asphalt" => Some(Material::Asphalt),
        "gravel" | "soil" => Some(Material::Soil),
        "paint" => Some(Material::PaintWhite),
        _ => None,
    };
    let (tag, usual) = match object.kind.as_str() {
        "building" => (Tag::Building, Material::FacadePlaster),
        "barrier" | "wall" | "soundBarrier" | "noiseProtections" => (Tag::Wall, Material::Concrete),
        "fence" => (Tag::Fence, Material::Metal),
        "railing" | "guardRail" => (Tag::GuardRail, Material::Metal),
        "vegetation" | "tree" => (Tag::Vegetation, Material::Leaves),
        "trafficIsland" => (Tag::SideWalks, Material::Paving),
        "pole" | "streetLamp" | "gantry" => (Tag::Pole, Material::Metal),
        "roadMark" => (Tag::RoadLine, Material::PaintWhite),
        "patch" | "roadSurface" => (Tag::Roads, Material::Asphalt),
        _ if height > 0.0 => (Tag::Static, Material::Concrete),
        _ => (Tag::Ground, Material::Concrete),
    };
    (tag, filled.unwrap_or(usual))
}
