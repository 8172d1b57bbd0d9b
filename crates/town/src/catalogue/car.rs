//! Car bodies: subdivided from control cages, or lofted from the tail to the nose over the tables
//! of a silhouette.
//!
//! Wheel arches of lofted bodies are cut by raising the sill over each wheel.

use glam::{Vec3, vec3};
use mesh::{Face, Material};

use crate::{
    catalogue::{
        blueprint::Wheel,
        cabin,
        cage::{HalfCar, Part, Skin, Surface},
        details, fittings,
        profile::{
            Measure, PILLAR, SEAM, SHELL, Silhouette,
            Skin::{Cover, Pane},
        },
        seals,
    },
    mesh_builder::{FIRST_CAP, LAST_CAP, MeshBuilder},
    subdivision::Cage,
};

/// Colours of parts that do not have the actor's own colour.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Livery {
    /// The colour of everything above the window sill.
    pub(super) upper: Option<[u8; 3]>,
    pub(super) doors: Option<[u8; 3]>,
}

/// The colour of pillars between windows and of other trim: polished black, sRGB.
const TRIM: [u8; 3] = [15, 15, 16];
/// How often a control cage is subdivided.
const SUBDIVISIONS: usize = 1;
/// The width of the rounding of a crease, as of pressed sheet metal. Metres.
const CREASE_M: f32 = 0.012;

/// Builds the body with mirrors, inside and occupants and without wheels; the nose lies at
/// `measure.nose_m`. Doors are separate objects after [`SHELL`], in CARLA's order. `number` varies
/// the occupants. Returns the surface of a body that is made from a control cage.
pub(super) fn body(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    livery: Livery,
    number: usize,
) -> Option<Surface> {
    let shell = if shape.doors == 0 { 0 } else { SHELL };
    builder.object(shell);
    let first = builder.mesh.triangles.len();
    let surface = match shape.cage {
        Some(text) => Some(subdivided(builder, text, measure, livery)),
        None => {
            lofted(builder, shape, measure, livery);
            None
        }
    };
    seals::add(builder, first);
    builder.object(shell);
    linings(builder, shape, measure);
    fittings::mirrors_and_handles(builder, shape, measure, surface.as_ref());
    if shape.doors > 0 {
        builder.object(shell);
        cabin::furnish(builder, shape, measure, number);
    }
    builder.object(shell);
    if let Some(surface) = &surface {
        details::fit(builder, shape, measure, surface);
    }
    surface
}

/// Adds a body made from a control cage.
fn subdivided(builder: &mut MeshBuilder, text: &str, measure: &Measure, livery: Livery) -> Surface {
    let cage = cage(text, measure);
    let smooth = (0..SUBDIVISIONS).fold(cage.clone(), |cage, _| cage.subdivided());
    // Points keep their indices: the coarse faces between points of the finished surface.
    let points = smooth.points[..cage.points.len()].to_vec();
    let fine = smooth.bevelled(CREASE_M);
    builder.material(Material::CarPaint);
    builder.cage(&fine, |usual, skin: Skin| {
        let (object, color) = match skin.part {
            Part::Door(door) => (SHELL + 1 + door, livery.doors),
            Part::Roof => (usual.object, livery.upper),
            Part::Body => (usual.object, None),
        };
        let tint = match skin.material {
            Material::CarPaint => color.map_or(0, Face::tint),
            Material::Plastic => Face::tint(TRIM),
            _ => 0,
        };
        Face { material: skin.material as u8, object, tint, ..usual }
    });
    cabin::lining(builder, &Cage { points, ..cage });
    Surface::of(&fine)
}

/// Returns the control cage of a car of these dimensions.
pub(super) fn cage(text: &str, measure: &Measure) -> Cage<Skin> {
    // A test reads every cage of the catalogue.
    HalfCar::parse(text).expect("a control cage of the catalogue").placed(measure)
}

/// Returns the foremost point of a door, the outer one of several.
pub(super) fn door_front(cage: &Cage<Skin>, door: u32) -> Vec3 {
    let faces = cage.faces.iter().filter(|(_, skin)| skin.part == Part::Door(door));
    let points = faces.flat_map(|(corners, _)| corners.iter().map(|at| cage.points[*at as usize]));
    let ahead =
        |a: &Vec3, b: &Vec3| a.x.total_cmp(&b.x).then_with(|| a.y.abs().total_cmp(&b.y.abs()));
    points.max_by(ahead).unwrap_or(Vec3::ZERO)
}

/// Adds a body lofted over the tables of its silhouette.
fn lofted(builder: &mut MeshBuilder, shape: &Silhouette, measure: &Measure, livery: Livery) {
    let stations = stations(shape, measure);
    // Lamps and plates protrude by `RELIEF`, which completes the full length.
    let rings: Vec<Vec<Vec3>> = stations.iter().map(|x| ring(shape, measure, *x)).collect();
    let doors = shape.door_cuts();
    let shell = if doors.is_empty() { 0 } else { SHELL };
    builder.material(Material::CarPaint);
    builder.loft_with(&rings, |usual, band, side| {
        let with = |material: Material| Face { material: material as u8, ..usual };
        if band == FIRST_CAP || band == LAST_CAP {
            return usual;
        }
        let middle = (stations[band] + stations[band + 1]) * 0.5;
        let row = side.min(RING - 1 - side);
        let upper = Face { tint: livery.upper.map_or(0, Face::tint), ..usual };
        let mut face = match row {
            0 | 1 => with(Material::Plastic),
            // Angular bodies have cladding along their sills and round their wheels.
            2 if shape.is_angular => with(Material::Plastic),
            8 | 9 if shape.is_window(middle) => with(Material::Glass),
            8 | 9 if shape.is_pillar(middle) => with(Material::Plastic),
            11..=13 if shape.skin(middle) == Pane => with(Material::Glass),
            11..=13 if shape.skin(middle) == Cover => with(Material::Plastic),
            8..=13 => upper,
            _ => usual,
        };
        if (2..=9).contains(&row) {
            let is_left = side < RING / 2;
            for (door, (from, to)) in doors.iter().enumerate() {
                if middle > *from && middle < *to {
                    face.object = shell + 1 + 2 * door as u32 + u32::from(!is_left);
                    if row <= 7 {
                        face.tint = livery.doors.map_or(0, Face::tint);
                    }
                }
                let is_seam = (middle > from - SEAM && middle < *from)
                    || (middle > *to && middle < to + SEAM);
                if is_seam && row <= 7 {
                    (face.material, face.tint) = (Material::Plastic as u8, 0);
                }
            }
        }
        face
    });
}

/// Adds the wheel housings, which block the view through the wheel arches.
fn linings(builder: &mut MeshBuilder, shape: &Silhouette, measure: &Measure) {
    builder.tinted(Material::Rubber, [9, 9, 10]);
    for wheel in measure.wheels.iter().filter(|wheel| wheel.position_m.y > 0.0) {
        let (reach, x) = (arch_radius(wheel), wheel.position_m.x);
        let side = wheel.position_m.y - wheel.width_m * 0.5 - 0.02;
        let top = wheel.position_m.z + reach + 0.02;
        let low = vec3(x - reach, -side, shape.clearance_m + 0.02);
        builder.block(low, vec3(x + reach, side, top));
    }
}

/// Returns the cross sections at which the body is cut, tail first.
fn stations(shape: &Silhouette, measure: &Measure) -> Vec<f32> {
    let mut cuts: Vec<f32> = shape.top.iter().map(|point| point.0).collect();
    let doors = shape.door_cuts();
    cuts.extend(doors.iter().flat_map(|(from, to)| [*from, *to, from - SEAM, to + SEAM]));
    cuts.extend([shape.windows.0, shape.windows.1]);
    cuts.extend(shape.pillars.iter().flat_map(|pillar| [pillar - PILLAR, pillar + PILLAR]));
    cuts.extend(shape.plan.iter().map(|point| point.0));
    // Least important cuts last: of two cuts that nearly coincide, the earlier one is kept.
    for wheel in measure.wheels.iter().filter(|wheel| wheel.position_m.y > 0.0) {
        let reach = arch_radius(wheel);
        let hub = measure.nose_m - wheel.position_m.x;
        let angles = (0..=8).map(|k| (std::f32::consts::PI * k as f32 / 8.0).cos() * reach);
        cuts.extend(
            angles.chain([reach + 0.012, -reach - 0.012]).map(|dx| (hub + dx) / measure.size_m.x),
        );
    }
    let mut kept: Vec<f32> = Vec::new();
    let keep = |kept: &mut Vec<f32>, cut: f32, near: f32| {
        let near = near / measure.size_m.x;
        if (0.0..=1.0).contains(&cut) && !kept.iter().any(|other| (other - cut).abs() < near) {
            kept.push(cut);
        }
    };
    cuts.iter().for_each(|cut| keep(&mut kept, *cut, 0.010));
    if !shape.is_angular {
        let steps = ((measure.size_m.x / 0.17) as u32).min(30);
        (1..steps).for_each(|k| keep(&mut kept, k as f32 / steps as f32, 0.095));
    }
    kept.sort_by(|a, b| b.total_cmp(a));
    kept
}

fn arch_radius(wheel: &Wheel) -> f32 {
    wheel.radius_m * 1.14
}

/// The height of the lower edge: the ground clearance, raised over wheels. Metres.
fn sill(shape: &Silhouette, measure: &Measure, x_m: f32, fraction: f32) -> f32 {
    // The lower edge rises a little at nose and tail, as bumpers do.
    let sweep = (0.04 - fraction).max(fraction - 0.95).max(0.0) * 1.2;
    measure
        .wheels
        .iter()
        .filter_map(|wheel| {
            let (reach, dx) = (arch_radius(wheel), x_m - wheel.position_m.x);
            let square = reach * reach - dx * dx;
            (dx.abs() < reach + 0.001).then(|| wheel.position_m.z + square.max(0.0).sqrt())
        })
        .fold(shape.clearance_m + sweep, f32::max)
}

/// Points of a ring: 15 up the left side, 13 down the right side.
const RING: usize = 28;

/// The outline across the car at one station.
fn ring(shape: &Silhouette, measure: &Measure, fraction: f32) -> Vec<Vec3> {
    let (x_m, height) = (measure.at(fraction), measure.size_m.z);
    let top = shape.top(fraction) * height;
    let belt = (shape.belt(fraction) * height).min(top - 0.03);
    let half = shape.plan(fraction) * measure.body_m * 0.5;
    let sill = sill(shape, measure, x_m, fraction).min(belt - 0.06);
    let usual_sill = shape.clearance_m.min(belt - 0.06);
    let waist = (usual_sill + (belt - usual_sill) * 0.55).max(sill + (belt - sill) * 0.30);

    // How much of the cabin rises here: 0 on the bonnet, 1 below the roof.
    let rise = ((top - belt) / (height * 0.30)).clamp(0.0, 1.0);
    let roof = half * (0.86 + (shape.roof - 0.86) * rise);
    let crown = if shape.is_angular { 0.008 } else { 0.020 + 0.012 * rise }.min((top - belt) * 0.4);
    let shoulder = (belt + 0.008).min(top - crown * 2.4);
    let foot = half * 0.93;
    let edge = top - crown * 2.2;
    let glass = |t: f32| {
        (
            foot + (roof - foot) * t + 0.035 * rise * t * (1.0 - t),
            shoulder + 0.012 * (1.0 - t) + (edge - shoulder) * t,
        )
    };
    let left = [
        (0.0, sill),
        (half * 0.80, sill),
        (half * 0.955, sill + 0.02),
        (half * 0.988, sill + (waist - sill) * 0.35),
        (half, waist),
        (half * 0.994, waist + (belt - waist) * 0.5),
        (half * 0.975, belt - 0.008),
        (half * 0.950, shoulder),
        glass(0.0),
        glass(0.5),
        glass(1.0),
        (roof * 0.93, top - crown * 1.15),
        (roof * 0.75, top - crown * 0.6),
        (roof * 0.42, top - crown * 0.18),
        (0.0, top),
    ];
    let right = left[1..14].iter().rev().map(|(y, z)| vec3(x_m, -y, *z));
    left.iter().map(|(y, z)| vec3(x_m, *y, *z)).chain(right).collect()
}
