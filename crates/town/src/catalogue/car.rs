//! Car bodies, subdivided from control cages.

use glam::{Vec3, vec3};
use mesh::{Face, Material};

use crate::{
    catalogue::{
        blueprint::Wheel,
        cabin,
        cage::{HalfCar, Part, Skin, Surface},
        details, fittings,
        profile::{Measure, SHELL, Silhouette},
        seals,
    },
    mesh_builder::MeshBuilder,
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
/// The height above which trim is that of pillars, as a fraction of the height.
const PILLARS: f32 = 0.52;
/// How often a control cage is subdivided.
const SUBDIVISIONS: usize = 1;
/// The width of the rounding of a crease, as of pressed sheet metal. Metres.
const CREASE_M: f32 = 0.012;

/// Builds the body with mirrors, inside and occupants and without wheels; the nose lies at
/// `measure.nose_m`. Doors are separate objects after [`SHELL`], in CARLA's order. `number` varies
/// the occupants. Returns the surface of the body.
pub(super) fn body(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    livery: Livery,
    number: usize,
) -> Surface {
    let shell = if shape.doors == 0 { 0 } else { SHELL };
    builder.object(shell);
    let first = builder.mesh.triangles.len();
    let surface = subdivided(builder, shape, measure, livery);
    seals::add(builder, first);
    builder.object(shell);
    linings(builder, shape, measure);
    fittings::mirrors_and_handles(builder, shape, measure, &surface);
    if shape.doors > 0 {
        builder.object(shell);
        cabin::furnish(builder, shape, measure, number);
    }
    builder.object(shell);
    details::fit(builder, shape, measure, &surface);
    surface
}

/// Adds a body made from a control cage.
fn subdivided(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    livery: Livery,
) -> Surface {
    let first = builder.mesh.triangles.len();
    let cage = cage(shape.cage, measure);
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
    if !shape.is_angular {
        polish(builder, first, measure.size_m.z * PILLARS);
    }
    cabin::lining(builder, &Cage { points, ..cage });
    Surface::of(&fine)
}

/// Gives trim above a height, among the triangles from `first` on, the gloss of paint: pillars are polished, cladding
/// below them is not.
fn polish(builder: &mut MeshBuilder, first: usize, height: f32) {
    let mesh = &mut builder.mesh;
    for (corners, face) in mesh.triangles[first..].iter().zip(&mut mesh.faces[first..]) {
        let is_high = corners.iter().all(|at| mesh.positions[*at as usize][2] > height);
        if is_high && face.material == Material::Plastic as u8 {
            face.material = Material::CarPaint as u8;
        }
    }
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

fn arch_radius(wheel: &Wheel) -> f32 {
    wheel.radius_m * 1.14
}
