//! Parked cars: on parking lanes and spaces of the map, on drives and in front of halls.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Quat, Vec2, Vec3, vec2, vec3};
use mesh::{Material, RandomStream};
use road::{LaneIndex, LanePoint, LaneType, LaneTypes};

use crate::{
    catalogue::{self, Blueprint, Kind},
    furnish::{
        building::Style,
        lots::Garden,
        plan::Plan,
        raster::{ground, rectangle},
        scene::{Place, Scene},
    },
};

/// The fraction of places that are occupied.
const TAKEN: f32 = 0.55;
/// The distance from either end of a parking lane. Metres.
const CLEAR_ENDS_M: f64 = 6.0;
/// The length of one place along the kerb. Metres.
const PLACE_M: f64 = 6.2;
/// The width of one place in a row of bays. Metres.
const BAY_M: f32 = 2.7;
/// The number of models of a town's parked cars: each has a mesh without occupants of its own. With more,
/// the default map takes more than the 128 MiB of triangles that software Vulkan binds.
const MODELS: usize = 14;
/// The height of slabs and paint above the ground. Metres.
const SLAB_M: f32 = 0.04;

/// Parks cars at all places.
pub(super) fn park(plan: &mut Plan, scene: &mut Scene, gardens: &[Garden]) {
    let fleet = Fleet::new(plan.seed);
    lanes(plan, scene, &fleet);
    spaces(plan, scene, &fleet);
    for (number, garden) in gardens.iter().enumerate() {
        let mut random = RandomStream::named(plan.seed, 0xca5 + number as u64 * 16);
        match garden.style {
            Style::Villa if garden.front_m > 3.0 => drive(plan, scene, &fleet, garden, &mut random),
            Style::Hall => forecourt(plan, scene, &fleet, garden, &mut random),
            _ => {}
        }
    }
}

/// The vehicles that are parked.
struct Fleet(Vec<(u32, &'static Blueprint)>);

impl Fleet {
    fn new(seed: u64) -> Fleet {
        let own = |(_, one): &(u32, &Blueprint)| {
            one.kind == Kind::Vehicle
                && matches!(one.base_type, "car" | "van")
                && one.special_type != "emergency"
        };
        let mut all: Vec<_> = (0..).zip(catalogue::catalogue()).filter(own).collect();
        let mut random = RandomStream::named(seed, 0xf1ee7);
        while all.len() > MODELS {
            all.swap_remove(random.below(all.len()));
        }
        Fleet(all)
    }

    /// A vehicle that fits; the limits are half of length and width. Metres.
    fn pick(&self, half: Vec2, random: &mut RandomStream) -> Option<(u32, &'static Blueprint)> {
        let fits =
            |one: &&(u32, &'static Blueprint)| one.1.half_extents_m.truncate().cmple(half).all();
        let fitting: Vec<_> = self.0.iter().filter(fits).collect();
        (!fitting.is_empty()).then(|| **random.pick(&fitting))
    }
}

fn lanes(plan: &mut Plan, scene: &mut Scene, fleet: &Fleet) {
    let network = plan.network;
    let parking = network.lanes().iter().filter(|lane| {
        lane.kind == LaneType::Parking && lane.junction.is_none() && lane.length_m > PLACE_M
    });
    for lane in parking {
        let mut random = RandomStream::named(plan.seed, 0x9a5 + u64::from(lane.index.0) * 16);
        let mut along_m = CLEAR_ENDS_M;
        while along_m + CLEAR_ENDS_M < lane.length_m {
            let width = network.width(LanePoint { lane: lane.index, along_m });
            // Wide lanes are for perpendicular parking.
            let across = width > 4.2;
            let half = if across {
                vec2(width as f32 * 0.5, BAY_M * 0.5 - 0.2)
            } else {
                vec2(PLACE_M as f32 * 0.5 - 0.4, width as f32 * 0.5 - 0.05)
            };
            let at = network.place_at(lane.index, along_m, 0.0);
            let heading = at.heading_rad as f32;
            let yaw = heading + if across { FRAC_PI_2 } else { 0.0 };
            if random.chance(TAKEN) && at.curvature_per_m.abs() < BEND_MAX {
                let drives = |side: Option<LaneIndex>| {
                    side.is_some_and(|i| LaneTypes::DRIVABLE.contains(network.lane(i).kind))
                };
                let left = Vec2::from_angle(heading).perp();
                let out = match (drives(lane.left), drives(lane.right)) {
                    (true, false) => -left,
                    (false, true) => left,
                    _ => Vec2::ZERO,
                };
                let out = if across { Vec2::ZERO } else { out };
                let spot = Spot { at: at.position.truncate().as_vec2(), yaw, half, out };
                let taken = ground::BESIDE & !ground::CARRIAGEWAY;
                spot.fill(plan, scene, fleet, taken, &mut random);
            }
            along_m += if across { f64::from(BAY_M) } else { PLACE_M };
        }
    }
}

/// Parks cars on parking spaces that are objects of the map.
fn spaces(plan: &mut Plan, scene: &mut Scene, fleet: &Fleet) {
    let network = plan.network;
    let mut random = RandomStream::named(plan.seed, 0x9a6);
    for object in network.objects().iter().filter(|object| object.kind == "parkingSpace") {
        let size = vec2(object.length_m as f32, object.width_m as f32);
        let drawn = object.outlines.iter().filter(|outline| outline.len() == 4);
        let drawn = drawn.map(|corners| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| corners[corner].truncate().as_vec2());
            let size = vec2(a.distance(b), b.distance(c));
            ((a + b + c + d) * 0.25, (b - a).to_angle(), size)
        });
        let placed = object.places.iter().map(|place| {
            let at = place.position.truncate().as_vec2();
            (at, place.heading_rad as f32, size)
        });
        let all: Vec<_> = drawn.chain(placed).collect();
        for (at, heading_rad, size) in all {
            // The car is parallel to the longer side.
            let turned = size.y > size.x;
            let half = if turned { vec2(size.y, size.x) } else { size } * 0.5;
            let yaw = heading_rad + if turned { FRAC_PI_2 } else { 0.0 };
            let spot = Spot { at, yaw, half, out: Vec2::ZERO };
            if random.chance(TAKEN) {
                spot.fill(plan, scene, fleet, ground::FURNITURE | ground::BUILT, &mut random);
            }
        }
    }
}

/// Adds a drive beside the door, from the street to the house, most with a car on it.
fn drive(
    plan: &mut Plan,
    scene: &mut Scene,
    fleet: &Fleet,
    garden: &Garden,
    random: &mut RandomStream,
) {
    let side = if random.chance(0.5) { 1.0 } else { -1.0 };
    let middle = garden.gate + garden.out.perp() * side * (garden.width_m * 0.5 - 2.0);
    let long = garden.front_m;
    let center = middle + garden.out * (long * 0.5);
    let yaw = garden.out.to_angle();
    if long < 4.6 || !slab(plan, scene, center, vec2(long * 0.5, 1.35), yaw, Material::Paving) {
        return;
    }
    if random.chance(0.6) {
        let yaw = if random.chance(0.5) { yaw } else { yaw + PI };
        let spot = Spot { at: center, yaw, half: vec2(long * 0.5, 1.25), out: Vec2::ZERO };
        spot.fill(plan, scene, fleet, ground::ROAD | ground::BUILT, random);
    }
}

/// Adds a row of bays along the wall of a hall.
fn forecourt(
    plan: &mut Plan,
    scene: &mut Scene,
    fleet: &Fleet,
    garden: &Garden,
    random: &mut RandomStream,
) {
    let (along, yaw) = (garden.out.perp(), garden.out.to_angle());
    let half = vec2(garden.front_m * 0.5, garden.width_m * 0.5 - 3.2);
    let center = garden.gate + garden.out * half.x;
    if half.x < 3.0 || half.y < BAY_M || !slab(plan, scene, center, half, yaw, Material::Asphalt) {
        return;
    }
    let count = (half.y * 2.0 / BAY_M) as u32;
    for bay in 0..count {
        if !random.chance(TAKEN) {
            continue;
        }
        let across = (bay as f32 + 0.5 - count as f32 * 0.5) * BAY_M;
        let at = center + garden.out * (half.x - 3.6) + along * across;
        let yaw = if random.chance(0.7) { yaw } else { yaw + PI };
        let spot = Spot { at, yaw, half: vec2(2.8, BAY_M * 0.5 - 0.15), out: Vec2::ZERO };
        spot.fill(plan, scene, fleet, ground::ROAD | ground::BUILT, random);
    }
}

/// Half of a car park's length and width. Metres.
pub(super) const LOT_M: Vec2 = vec2(11.0, 8.5);

/// Adds a car park: two rows of bays along a lane between them, with painted lines between the
/// bays.
pub(super) fn lot(
    plan: &mut Plan,
    scene: &mut Scene,
    at: Vec2,
    yaw: f32,
    random: &mut RandomStream,
) {
    if !slab(plan, scene, at, LOT_M, yaw, Material::Asphalt) {
        return;
    }
    let fleet = Fleet::new(plan.seed);
    let (along, across) = (Vec2::from_angle(yaw), Vec2::from_angle(yaw).perp());
    let count = (LOT_M.x * 2.0 / BAY_M) as u32;
    for side in [-1.0f32, 1.0] {
        let row = at + across * side * (LOT_M.y - 2.8);
        for line in 0..=count {
            let middle = row + along * (line as f32 - count as f32 * 0.5) * BAY_M;
            let corners = rectangle(middle, vec2(0.06, 2.5), yaw);
            let lift = Vec3::Z * (SLAB_M + 0.01);
            scene.ground(Material::PaintWhite, corners.map(|corner| plan.foot(corner) + lift));
        }
        for bay in 0..count {
            if !random.chance(TAKEN) {
                continue;
            }
            let middle = row + along * (bay as f32 + 0.5 - count as f32 * 0.5) * BAY_M;
            let turn = if random.chance(0.7) { side } else { -side };
            let spot = Spot {
                at: middle,
                yaw: yaw + turn * FRAC_PI_2,
                half: vec2(2.7, BAY_M * 0.5 - 0.15),
                out: Vec2::ZERO,
            };
            spot.fill(plan, scene, &fleet, ground::ROAD | ground::BUILT, random);
        }
    }
}

/// Adds a slab, for example from a street to a wall, if the ground between them is free. `half`:
/// along the bearing and across. Metres.
pub(super) fn slab(
    plan: &mut Plan,
    scene: &mut Scene,
    center: Vec2,
    half: Vec2,
    yaw_rad: f32,
    material: Material,
) -> bool {
    let outline = rectangle(center, half - vec2(1.3, 0.0), yaw_rad);
    if !plan.raster.is_free(&outline, ground::ANY) {
        return false;
    }
    plan.raster.stamp(&outline, ground::FURNITURE);
    let (x, y) = (Vec2::from_angle(yaw_rad), Vec2::from_angle(yaw_rad).perp());
    let cells = (half * 2.0 / 1.5).ceil().max(Vec2::ONE);
    let corner = |(column, row): (u32, u32)| {
        let local = (vec2(column as f32, row as f32) / cells * 2.0 - 1.0) * half;
        plan.foot(center + x * local.x + y * local.y) + Vec3::Z * SLAB_M
    };
    for row in 0..cells.y as u32 {
        for column in 0..cells.x as u32 {
            let next = (column + 1, row + 1);
            let corners = [(column, row), (next.0, row), next, (column, next.1)].map(corner);
            scene.ground(material, corners);
        }
    }
    true
}

/// The distance from a parked car to driving lanes, which buses need in bends. Metres.
const APART_M: f64 = 0.35;
/// The curvature of lanes from which on no cars are parked beside them. 1/m.
const BEND_MAX: f64 = 1.0 / 40.0;

/// A place for one car.
struct Spot {
    at: Vec2,
    yaw: f32,
    /// The size along the car and across. Metres.
    half: Vec2,
    /// The direction to the kerb that cars stand close to; otherwise zero.
    out: Vec2,
}

impl Spot {
    /// Parks a car that fits, if the place has none of the bits in `taken`.
    fn fill(
        &self,
        plan: &mut Plan,
        scene: &mut Scene,
        fleet: &Fleet,
        taken: u8,
        random: &mut RandomStream,
    ) {
        let Some((number, car)) = fleet.pick(self.half, random) else { return };
        let color = car.random_paint(random).unwrap_or(car.default_color);
        let half = car.half_extents_m;
        let forward = Vec2::from_angle(self.yaw);
        let at = self.at + self.out * (self.half.y - half.y);
        // The middle of the vehicle's box stands at the place, not its origin.
        let origin = at - forward * car.center_m.x;
        let outline = rectangle(at, half.truncate(), self.yaw);
        if !plan.raster.is_free(&outline, taken) || !is_beside_the_lanes(plan, &outline) {
            return;
        }
        plan.raster.stamp(&outline, ground::FURNITURE);
        let rotation = lean(plan, origin, forward, half);
        let foot = plan.foot(origin) + Vec3::Z * SLAB_M;
        scene.park(number, car, Place { foot, yaw_rad: self.yaw }, rotation, color);
    }
}

/// Whether a car lies outside all driving lanes.
fn is_beside_the_lanes(plan: &Plan, [a, b, c, d]: &[Vec2; 4]) -> bool {
    [*a, *b, *c, *d, (a + b) * 0.5, (c + d) * 0.5].into_iter().all(|corner| {
        let point = plan.foot(corner).as_dvec3();
        let Some(near) = plan.network.nearest(point, LaneTypes::DRIVABLE) else { return true };
        let lane = plan.network.place(near);
        let offset = lane.rotation().inverse() * (point - lane.position);
        offset.x.abs() > 1.0 || offset.y.abs() > plan.network.width(near) * 0.5 + APART_M
    })
}

/// The rotation of the ground below the wheels.
fn lean(plan: &Plan, origin: Vec2, forward: Vec2, half: Vec3) -> Quat {
    let point = |x: f32, y: f32| {
        let at = origin + forward * (x * half.x * 0.6) + forward.perp() * (y * half.y * 0.8);
        plan.foot(at)
    };
    let ahead = point(1.0, 0.0) - point(-1.0, 0.0);
    let left = point(0.0, 1.0) - point(0.0, -1.0);
    let up = ahead.cross(left).normalize_or(Vec3::Z);
    let x = ahead.normalize_or(vec3(forward.x, forward.y, 0.0));
    Quat::from_mat3(&glam::Mat3::from_cols(x, up.cross(x), up)).normalize()
}
