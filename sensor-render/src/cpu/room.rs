//! Rooms behind the panes of buildings: a box behind each pane, without geometry (van Dongen 2008,
//! *Interior Mapping*). Twin of room.wgsl.

use glam::Vec3;

use super::grain::{noise, smooth};
use super::pattern::has;
use super::sky::ambient;
use super::surface_materials::SurfaceMaterials;
use super::wear::part;
use crate::light::Light;
use crate::simd::{Float, Mask, V3};
use crate::surface_material::{ROOM_ALBEDO_MAX, pattern};

/// Replaces the emission of panes by the light from the rooms behind them, and puts folds into curtains; `facing`
/// is the flat normal towards the camera.
#[inline(always)]
pub(crate) fn furnish<F: Float>(
    surfaces: &mut SurfaceMaterials<F>,
    light: &Light,
    view: V3<F>,
    facing: V3<F>,
    active: F::Mask,
) {
    let panes = has(surfaces, pattern::ROOM) & active;
    if !panes.any() {
        return;
    }
    let (zero, one, half) = (F::splat(0.0), F::splat(1.0), F::splat(0.5));
    let [left, wide, low, high] = surfaces.wall;
    let (a, z) = (surfaces.along - left, surfaces.height - low);
    let rooms = panes & surfaces.albedo.x.lt(F::splat(ROOM_ALBEDO_MAX));

    let folds =
        noise(surfaces.along * F::splat(13.0), surfaces.height * F::splat(0.4), surfaces.seed);
    let folds = folds.mul_add(F::splat(0.7), F::splat(0.6)).or(panes & !rooms, one);
    surfaces.albedo = surfaces.albedo * folds;
    surfaces.emission = surfaces.emission * folds;
    if !rooms.any() {
        return;
    }

    // The box, seen from its open front.
    let seed = surfaces.seed;
    let (by_wall, by_depth) = (part::<F>(seed, 0x9e37_79b1), part::<F>(seed, 0x85eb_ca6b));
    let (by_hue, by_thing) = (part::<F>(seed, 0xc2b2_ae35), part::<F>(seed, 0x27d4_eb2f));
    let is_tall = F::splat(2.2).lt(high);
    let floor = F::splat(-0.05).or(is_tall, F::splat(-0.85));
    let (head, beside) = (high + F::splat(0.25), by_wall.mul_add(F::splat(1.1), F::splat(0.25)));
    let deep = by_depth.mul_add(F::splat(2.6), F::splat(2.4));
    let right = V3 { x: -facing.y, y: facing.x, z: zero };
    let across = view.dot(right);
    let into = (-view.dot(facing)).max(F::splat(0.02));
    let to_right = zero.lt(across);
    let to_head = zero.lt(view.z);
    let least = F::splat(1e-4);
    let by_side = ((wide + beside).or(to_right, -beside) - a)
        / across.abs().max(least).or(to_right, -across.abs().max(least));
    let by_level = (head.or(to_head, floor) - z)
        / view.z.abs().max(least).or(to_head, -view.z.abs().max(least));
    let by_back = deep / into;
    let t = by_side.min(by_level).min(by_back);
    let (x, y, far) = (across.mul_add(t, a), view.z.mul_add(t, z), into * t);
    let is_back = by_side.ge(by_back) & by_level.ge(by_back);
    let is_level = by_side.ge(by_level) & !is_back;

    let tone = by_hue.mul_add(F::splat(0.5), F::splat(0.65));
    let walls = V3::splat(Vec3::new(0.42, 0.40, 0.36))
        .lerp(V3::splat(Vec3::new(0.48, 0.34, 0.22)), by_thing)
        * tone;
    let ground = V3::splat(Vec3::new(0.17, 0.11, 0.07))
        .lerp(V3::splat(Vec3::new(0.16, 0.16, 0.17)), by_wall);
    let mut albedo = ground.or(is_level & !to_head, walls);
    albedo = V3::splat(Vec3::splat(0.6)).or(is_level & to_head, albedo);
    // A cupboard and a picture at the back.
    let place = by_thing * wide;
    let tall = by_depth.mul_add(F::splat(1.2), F::splat(0.7));
    let cupboard = is_back & (x - place).abs().lt(F::splat(0.55)) & (y - floor).lt(tall);
    let hung = (y - floor - F::splat(1.65)).abs().lt(F::splat(0.3));
    let picture = is_back & (x - place - F::splat(1.0)).abs().lt(F::splat(0.4)) & hung;
    let wood =
        V3::splat(Vec3::new(0.14, 0.07, 0.035)).lerp(V3::splat(Vec3::new(0.3, 0.3, 0.28)), by_wall);
    let canvas =
        V3::splat(Vec3::new(0.1, 0.2, 0.24)).lerp(V3::splat(Vec3::new(0.4, 0.2, 0.08)), by_hue);
    albedo = canvas.or(picture, wood.or(cupboard, albedo));

    // Light through the window, and that of a lamp below the ceiling.
    let day = F::splat(0.27) / (far * far).mul_add(F::splat(0.35), one);
    let (to_x, to_y) = (x - wide * half, y - head + F::splat(0.45));
    let to_z = far - deep * half;
    let lamp = to_x.mul_add(to_x, to_y.mul_add(to_y, to_z * to_z));
    let lamp = F::splat(2.4) / (lamp + F::splat(0.9)) + F::splat(0.5);
    let edge = smooth(zero, F::splat(0.35), deep - far).mul_add(F::splat(0.3), F::splat(0.7));
    // A pane hides its room from an eye beside it.
    let low = one - into;
    let clear = one - low * low * (low * low);
    let arriving = ambient(light, F::splat(0.2)) * day + surfaces.emission * lamp;
    let seen = albedo.times(arriving) * (edge * clear);
    surfaces.emission = seen.or(rooms, surfaces.emission);
}
