//! Paint on the ground that belongs to objects: their markings, and the stripes of crosswalks.

use glam::{DVec2, DVec3};
use mesh::{Face, Material, Mesh, Tag};

use super::{
    bodies::{outlines, path, rectangle},
    polygon::{area, slice, triangles},
};
use crate::{
    mark::MarkColor,
    network::Network,
    object::{ObjectMarking, RoadObject},
};

/// Length of the pieces in which paint follows the ground, metres.
const PIECE_M: f64 = 1.0;
/// Width of a crosswalk's stripes and of the gaps between them, metres.
const STRIPE_M: f64 = 0.5;
/// Most triangles of paint; a broken file may ask for any number.
const TRIANGLES_MAX: usize = 2_000_000;
/// Longest marking, metres.
const LONGEST_M: f64 = 2000.0;
/// Shorter periods are drawn as a continuous line, metres.
const PERIOD_MIN_M: f64 = 0.1;

pub(super) fn paint(network: &Network) -> Mesh {
    let mut mesh = Mesh::default();
    for object in network.objects() {
        if object.is_crosswalk() && object.markings.is_empty() {
            crosswalk(object, &mut mesh);
        }
        for marking in &object.markings {
            for path in paths(object, marking) {
                lines(&path, marking, &mut mesh);
            }
        }
        frames(object, &mut mesh);
        if mesh.triangles.len() > TRIANGLES_MAX {
            break;
        }
    }
    mesh
}

/// Returns the paths of a marking.
fn paths(object: &RoadObject, marking: &ObjectMarking) -> Vec<Vec<DVec3>> {
    if !marking.corners.is_empty() {
        let numbers = 0..object.shapes.len();
        let outlines = numbers.flat_map(|number| {
            let ids = &object.corner_ids[number];
            outlines(object, number)
                .into_iter()
                .map(move |corners| path(&corners, ids, &marking.corners, false))
        });
        return outlines.filter(|path| path.len() > 1).collect();
    }
    // A side of the object's rectangle, beginning at its front or at its left.
    let sides = |corners: Vec<DVec3>| -> Option<Vec<DVec3>> {
        let [a, b, c, d] = corners[..] else { return None };
        match marking.side.as_str() {
            "left" => Some(vec![d, c]),
            "right" => Some(vec![a, b]),
            "front" => Some(vec![c, b]),
            "rear" => Some(vec![d, a]),
            _ => None,
        }
    };
    let boxes = object.places.iter().filter_map(|place| {
        let (length, width) = (place.length_m, place.width_m);
        (length > 0.0 && width > 0.0).then(|| rectangle(place, length, width))
    });
    boxes.filter_map(sides).collect()
}

/// Paints a marking along its path.
fn lines(path: &[DVec3], marking: &ObjectMarking, mesh: &mut Mesh) {
    let length: f64 = path.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let from = marking.start_offset_m.max(0.0);
    let to = length - marking.stop_offset_m.max(0.0);
    if to <= from || length > LONGEST_M {
        return;
    }
    let face = face(marking.color);
    let period = marking.length_m + marking.space_m;
    let is_broken = marking.length_m > 0.0 && marking.space_m > 0.0 && period > PERIOD_MIN_M;
    let dashes = if is_broken { ((to - from) / period).ceil() as usize } else { 1 };
    let up = DVec3::Z * marking.z_offset_m.clamp(0.0, 1.0);
    for dash in 0..dashes {
        let begin = if is_broken { from + period * dash as f64 } else { from };
        let end = if is_broken { (begin + marking.length_m).min(to) } else { to };
        let mut before = 0.0;
        for pair in path.windows(2) {
            let side = pair[0].distance(pair[1]);
            let share = |at: f64| ((at - before) / side).clamp(0.0, 1.0);
            let shares = [share(begin), share(end)];
            before += side;
            if side > 1e-6 && shares[1] > shares[0] {
                let [a, b] = shares.map(|share| pair[0].lerp(pair[1], share) + up);
                line(a, b, marking.width_m, face, mesh);
            }
        }
    }
}

/// Adds a straight line of this width about its middle.
fn line(from: DVec3, to: DVec3, width_m: f64, face: Face, mesh: &mut Mesh) {
    let left = ((to - from).truncate().normalize_or_zero().perp() * (0.5 * width_m)).extend(0.0);
    let pieces = (from.distance(to) / PIECE_M).ceil().clamp(1.0, LONGEST_M) as usize;
    let row = |piece: usize, mesh: &mut Mesh| {
        let middle = from.lerp(to, piece as f64 / pieces as f64);
        [left, -left].map(|side| mesh.vertex((middle + side).as_vec3().to_array()))
    };
    let mut before = row(0, mesh);
    for piece in 1..=pieces {
        let next = row(piece, mesh);
        mesh.triangle([before[0], before[1], next[1]], face);
        mesh.triangle([before[0], next[1], next[0]], face);
        before = next;
    }
}

/// Adds borders of paint.
fn frames(object: &RoadObject, mesh: &mut Mesh) {
    for border in object.borders.iter().filter(|border| border.kind == "paint") {
        for (number, shape) in object.shapes.iter().enumerate() {
            if shape.id.unwrap_or(number as u32) != border.outline {
                continue;
            }
            let ids = &object.corner_ids[number];
            for corners in outlines(object, number) {
                let path = path(&corners, ids, &border.corners, border.is_complete);
                for pair in path.windows(2).filter(|pair| pair[0].distance(pair[1]) < LONGEST_M) {
                    line(pair[0], pair[1], border.width_m, face(MarkColor::White), mesh);
                }
            }
        }
    }
}

/// Adds stripes along the road, side by side over the crosswalk's length.
fn crosswalk(object: &RoadObject, mesh: &mut Mesh) {
    for corners in &object.outlines {
        let usable = (3..=super::polygon::CORNERS_MAX).contains(&corners.len());
        let size = corners.iter().map(|corner| corner.distance(corners[0])).fold(0.0, f64::max);
        if !usable || size > 200.0 {
            continue;
        }
        let mut round = corners.clone();
        if area(&round) < 0.0 {
            round.reverse();
        }
        let sides = round.iter().zip(round.iter().cycle().skip(1));
        let long = sides.map(|(a, b)| (*b - *a).truncate());
        let Some(long) = long.max_by(|a, b| a.length().total_cmp(&b.length())) else { continue };
        // Pedestrians walk along the longest side; stripes are perpendicular to it.
        let walk = long.normalize_or_zero();
        let reach = |axis: DVec2| {
            round
                .iter()
                .map(|corner| axis.dot(corner.truncate()))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                    (low.min(at), high.max(at))
                })
        };
        let (begin, end) = reach(walk);
        let (low, high) = reach(walk.perp());
        // The first and the last gap have the same width.
        let stripes = ((end - begin - STRIPE_M) / (2.0 * STRIPE_M)).round().max(1.0);
        let period = (end - begin) / (stripes + 0.5);
        let pieces = ((high - low) / PIECE_M).ceil().clamp(1.0, 200.0);
        for stripe in 0..stripes as usize {
            let from = begin + period * (stripe as f64 + 0.5);
            let stripe = slice(&round, walk, from, from + 0.5 * period);
            for piece in 0..pieces as usize {
                let at = |piece: f64| low + (high - low) * piece / pieces;
                let mut part =
                    slice(&stripe, walk.perp(), at(piece as f64), at(piece as f64 + 1.0));
                // A cut through a corner finds it twice.
                part.dedup_by(|a, b| a.distance(*b) < 1e-4);
                if part.len() < 3 || area(&part) < 1e-4 {
                    continue;
                }
                let placed: Vec<u32> =
                    part.iter().map(|corner| mesh.vertex(corner.as_vec3().to_array())).collect();
                for corners in triangles(&part) {
                    mesh.triangle(corners.map(|at| placed[at]), face(MarkColor::White));
                }
            }
        }
    }
}

fn face(color: MarkColor) -> Face {
    let (material, tint) = match color {
        MarkColor::Yellow => (Material::PaintYellow, 0),
        MarkColor::Orange => (Material::PaintYellow, Face::tint([230, 120, 20])),
        MarkColor::Blue => (Material::PaintWhite, Face::tint([30, 80, 190])),
        MarkColor::Green => (Material::PaintWhite, Face::tint([30, 130, 60])),
        MarkColor::Red => (Material::PaintWhite, Face::tint([190, 40, 35])),
        MarkColor::Violet => (Material::PaintWhite, Face::tint([120, 50, 150])),
        MarkColor::Black => (Material::PaintWhite, Face::tint([30, 30, 30])),
        MarkColor::White | MarkColor::Other => (Material::PaintWhite, 0),
    };
    Face { tint, ..Face::new(Tag::RoadLine, material, 0) }
}
