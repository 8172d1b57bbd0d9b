//! Objects on sidewalks: street lights, rows of trees, benches, bins, hydrants, bus stops.

use glam::{Vec3, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        density::{Density, FAST_MPS},
        frontage::{Frontage, STEP_M, Station},
        green::plant,
        plan::Plan,
        prop::place_prop,
        raster::{ground, square},
        scene::{ObjectProperties, Place, Scene},
    },
    plants::Species,
    static_world::{Detail, Lamp, Layer},
};

/// The distance from the kerb to the middle of objects behind it. Metres.
const BEHIND_KERB_M: f32 = 0.7;
/// The width of a sidewalk from which on trees are planted. Metres.
const TREE_WALK_M: f32 = 2.8;

/// How a street is lit.
struct Lighting {
    /// The distance between the lights on one side. Metres.
    spacing_m: f32,
    /// The distance of the first one from the beginning of the side; infinite on a side without lights. Metres.
    first_m: f32,
    /// The height of the lights. Metres.
    height_m: f32,
}

/// The distance of the first light from the beginning of a road. Metres.
const FIRST_M: f32 = 9.0;
/// The width of a carriageway up to which the lights of one side illuminate it. Metres.
const NARROW_M: f32 = 9.5;

impl Lighting {
    /// The lights at a station; `side` is even on one side of a street and odd on the other.
    ///
    /// Those of a residential street stand on one side, 5 to 8 m high and 25 to 35 m apart. The illuminance of a road
    /// of 7 m has then an overall uniformity, its least value over its mean, of 0.44; EN 13201-2 demands 0.40 of the
    /// luminance of classes M1 to M4, and 0.35 of M5. Those of wide streets alternate.
    fn at(plan: &Plan, station: &Station, side: usize) -> Lighting {
        let first = side.is_multiple_of(2);
        let (spacing_m, height_m) = match station.limit_mps < FAST_MPS {
            true if carriageway_m(plan, station) < NARROW_M => {
                let first_m = if first { FIRST_M } else { f32::INFINITY };
                return Lighting { spacing_m: 30.0, first_m, height_m: 6.5 };
            }
            true => (40.0, 7.0),
            false => (45.0, 10.5),
        };
        let first_m = if first { FIRST_M } else { FIRST_M + spacing_m * 0.5 };
        Lighting { spacing_m, first_m, height_m }
    }
}

/// The distance from one kerb to the other. Metres.
fn carriageway_m(plan: &Plan, station: &Station) -> f32 {
    let across = |step: u32| {
        let at = station.edge - station.out * (station.walk_m + 0.5 * step as f32);
        plan.raster.at(at) & ground::CARRIAGEWAY != 0
    };
    // Cells of the raster at the near kerb may count as sidewalk.
    (3..40).find(|step| !across(*step)).unwrap_or(40) as f32 * 0.5
}

/// Furnishes every sidewalk.
pub(super) fn furnish(
    plan: &mut Plan,
    scene: &mut Scene,
    frontages: &[Frontage],
    density: &Density,
) {
    for (number, frontage) in frontages.iter().enumerate() {
        let mut random = RandomStream::named(plan.seed, 0x57e + number as u64 * 16);
        let species =
            *random.pick(&[Species::Plane, Species::Plane, Species::Plane, Species::Poplar]);
        let planted = random.chance(0.7);
        let mut last_lamp = None;
        let mut next_tree = 6.0;
        for (step, station) in frontage.iter().enumerate() {
            let along = step as f32 * STEP_M;
            let lighting = Lighting::at(plan, station, number);
            let next = last_lamp.map_or(0.0, |at: f32| at + lighting.spacing_m);
            if along >= next.max(lighting.first_m) {
                if lamp(plan, scene, station, lighting.height_m) {
                    last_lamp = Some(along);
                }
            } else if along >= next_tree && planted && station.walk_m > TREE_WALK_M {
                next_tree = along + random.between(8.0, 11.0);
                let at = station.edge - station.out * (station.walk_m - BEHIND_KERB_M - 0.5);
                let scale = if species == Species::Plane { 1.0 } else { 0.75 };
                let scale = scale * random.between(0.92, 1.1);
                plant(plan, scene, species, at, scale, &mut random);
            } else if station.walk_m > 1.8 && random.chance(0.05 * density.at(station.edge)) {
                prop(plan, scene, station, &mut random);
            }
        }
    }
}

/// Adds a street light behind the kerb with its arm over the road; false if the place is occupied.
fn lamp(plan: &mut Plan, scene: &mut Scene, station: &Station, tall: f32) -> bool {
    let behind = if station.walk_m > 1.2 { BEHIND_KERB_M - station.walk_m } else { 1.0 };
    let at = station.edge + station.out * behind;
    let taken = ground::BESIDE;
    if !plan.raster.is_free(&square(at, 0.15), taken) {
        return false;
    }
    plan.raster.stamp(&square(at, 0.6), ground::FURNITURE);
    let place = Place { foot: plan.foot(at), yaw_rad: (-station.out).to_angle() };
    let properties =
        ObjectProperties { tag: Tag::Pole, layer: Layer::StreetLights, color: [90, 92, 94] };
    let reach = 1.9;
    let (object, _) = scene.add(properties, place, |builder| {
        builder.material(Material::Metal);
        let (sides, arm_sides) = if plan.detail == Detail::Low { (4, 3) } else { (8, 6) };
        builder.cone(Vec3::Z * -0.5, Vec3::Z * 1.2, [0.13, 0.11], sides);
        builder.cone(Vec3::Z * 1.2, Vec3::Z * (tall - 0.3), [0.075, 0.05], sides);
        builder.rod(Vec3::Z * (tall - 0.35), vec3(reach * 0.7, 0.0, tall), 0.04, arm_sides);
        builder.block(vec3(reach * 0.6, -0.13, tall - 0.02), vec3(reach + 0.35, 0.13, tall + 0.10));
        builder.material(Material::LampWhite);
        builder
            .block(vec3(reach * 0.68, -0.10, tall - 0.06), vec3(reach + 0.28, 0.10, tall - 0.01));
    });
    scene.solid_post(&place, 0.13, tall);
    scene.lamp(Lamp { position: place.point(vec3(reach, 0.0, tall - 0.1)), object });
    true
}

/// Adds a bench, a bin, a hydrant, a bus stop or a similar prop of the catalogue.
fn prop(plan: &mut Plan, scene: &mut Scene, station: &Station, random: &mut RandomStream) {
    const IDS: [&str; 17] = [
        "static.prop.bin",
        "static.prop.bench01",
        "static.prop.hydrant",
        "static.prop.bin",
        "static.prop.mailbox",
        "static.prop.bench02",
        "static.prop.busstop",
        "static.prop.plantpot01",
        "static.prop.plantpot05",
        "static.prop.maptable",
        "static.prop.advertisement",
        "static.prop.atm",
        "static.prop.kiosk_01",
        "static.prop.vendingmachine",
        "static.prop.glasscontainer",
        "static.prop.trashcan03",
        "static.prop.streetfountain",
    ];
    let id: &str = random.pick::<&str>(&IDS);
    let Some((_, thing)) = crate::catalogue::blueprint(id) else { return };
    let deep = thing.half_extents_m.x;
    if deep * 2.0 + 1.2 > station.walk_m {
        return;
    }
    // Along the building side of the sidewalk, facing the road.
    let at = station.edge - station.out * (deep + 0.15);
    let taken = ground::BESIDE;
    place_prop(plan, scene, id, (at, (-station.out).to_angle()), taken);
}
