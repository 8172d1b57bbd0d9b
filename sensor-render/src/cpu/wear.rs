//! Age of surfaces: stains, cracks and repairs of roads, worn markings, dirty pavements and kerbs, dry grass,
//! weathered walls, bark. Twin of wear.wgsl.

use glam::Vec3;

use super::grain::{hash, noise, share, smooth};
use super::pattern::{cover, has};
use super::surface_materials::SurfaceMaterials;
use crate::simd::{Float, Mask, V3, Word};
use crate::surface_material::{BARK, WORN_PAINT, pattern};

/// Applies the age of surfaces for pixels that are `pixel` metres wide.
#[inline(always)]
pub(crate) fn apply<F: Float>(surfaces: &mut SurfaceMaterials<F>, pixel: F) {
    let road = has(surfaces, pattern::ROAD);
    if road.any() {
        wear_road(surfaces, road, pixel);
    }
    let paint = has(surfaces, pattern::MARKING);
    if paint.any() {
        wear_marking(surfaces, paint, pixel);
    }
    let grass = has(surfaces, pattern::GRASS);
    if grass.any() {
        dry_grass(surfaces, grass, pixel);
    }
    let walked = has(surfaces, pattern::SLABS | pattern::KERB);
    if walked.any() {
        soil(surfaces, walked, pixel);
    }
    let wall = has(surfaces, pattern::WALL);
    if wall.any() {
        weather_wall(surfaces, wall, pixel);
    }
    let bark = has(surfaces, pattern::BARK);
    if bark.any() {
        furrow_bark(surfaces, bark, pixel);
    }
}

/// Noise on the surface with `per_m` lattice cells per metre.
#[inline(always)]
fn noise_of<F: Float>(x: F, y: F, per_m: f32, seed: u32) -> F {
    noise(x * F::splat(per_m), y * F::splat(per_m), F::Word::splat(seed))
}

/// Returns grain whose spots are `finest_m` metres wide and, where a pixel is wider, as wide as a pixel: from −0.5
/// to 0.5, and weaker the wider the spots are, as a mean over many of the finest ones is.
#[inline(always)]
fn speckle<F: Float>(x: F, y: F, pixel: F, finest_m: f32) -> F {
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let wide = (pixel * F::splat(1.0 / finest_m)).max(one);
    // The power of two below, whose bits are the exponent.
    let octave = wide.bits() & F::Word::splat(0xff80_0000);
    let low = octave.as_float();
    let per_m = F::splat(1.0 / finest_m) / low;
    let seed = octave.shr::<23>();
    let fine = noise(x * per_m, y * per_m, seed);
    let per_m = per_m * half;
    let coarse = noise(x * per_m, y * per_m, seed + F::Word::splat(1));
    (fine.lerp(coarse, wide / low - one) - half) / wide.sqrt()
}

/// Returns the coverage of a pixel by a line `width` metres wide whose middle is `apart` metres away.
#[inline(always)]
fn line<F: Float>(apart: F, width: f32, pixel: F) -> F {
    cover(F::splat(width * 0.5) - apart, pixel) * (F::splat(width) / pixel).clamp01()
}

/// Returns another number from 0 to 1 of a hash.
#[inline(always)]
pub(super) fn part<F: Float>(word: F::Word, times: u32) -> F {
    share(word * F::Word::splat(times))
}

#[inline(always)]
fn wear_road<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let (x, y) = (surfaces.along, surfaces.up);
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let stain =
        noise_of(x, y, 0.23, 21).mul_add(F::splat(0.6), noise_of(x, y, 0.9, 22) * F::splat(0.4));
    let mut wave = (stain - half).mul_add(F::splat(0.36), one);
    // Aggregate, across the lattices of the others.
    let (u, v) = (x * F::splat(0.8) + y * F::splat(0.6), y * F::splat(0.8) - x * F::splat(0.6));
    wave = wave * speckle(u, v, pixel, 0.006).mul_add(F::splat(1.1), one);
    let near = mask & pixel.lt(F::splat(0.12));
    if near.any() {
        // Cracks are the middle level of warped noise, where the road is old.
        let age = smooth(F::splat(0.5), F::splat(0.62), noise_of(x, y, 0.07, 26));
        let to_x = (noise_of(x, y, 1.7, 23) - half) * F::splat(0.9);
        let to_y = (noise_of(x, y, 1.7, 24) - half) * F::splat(0.9);
        let crack = noise_of(x + to_x, y + to_y, 0.45, 25) - half;
        // Where the noise passes its middle it changes by about 0.6 per metre.
        let crack = line(crack.abs() * F::splat(1.0 / 0.6), 0.02, pixel) * age;
        wave = wave * crack.or(near, F::splat(0.0)).mul_add(F::splat(-0.5), one);
    }
    surfaces.albedo = surfaces.albedo * wave.or(mask, one);
    let lane = mask & has(surfaces, pattern::LANE);
    if lane.any() {
        drive(surfaces, lane);
    }

    // Cells with a repaired rectangle or an iron cover.
    let cell = [9.0f32, 7.0];
    let (u, v) = (x * F::splat(1.0 / cell[0]), y * F::splat(1.0 / cell[1]));
    let (column, row) = (u.floor(), v.floor());
    let word = hash::<F>(column.to_int(), row.to_int(), F::Word::splat(29));
    let kind = part::<F>(word, 0x9e37_79b1);
    let patched = mask & kind.lt(F::splat(0.2));
    let covered = mask & F::splat(0.9).lt(kind);
    if !(patched | covered).any() {
        return;
    }
    let (across, along) = (part::<F>(word, 0x85eb_ca6b), part::<F>(word, 0xc2b2_ae35));
    let right = (u - column - across.mul_add(F::splat(0.3), F::splat(0.35))) * F::splat(cell[0]);
    let ahead = (v - row - along.mul_add(F::splat(0.3), F::splat(0.35))) * F::splat(cell[1]);
    let size = part::<F>(word, 0x27d4_eb2f);
    let half_x = size.mul_add(F::splat(1.3), F::splat(0.5));
    let half_y = across.mul_add(F::splat(0.6), F::splat(0.35));
    let inside = (half_x - right.abs()).min(half_y - ahead.abs());
    let tone = along.mul_add(F::splat(0.5), F::splat(-0.32));
    let patch = (cover(inside, pixel) * tone).mul_add(one, one);
    let seam = line(inside.abs(), 0.05, pixel).mul_add(F::splat(-0.35), one);
    surfaces.albedo = surfaces.albedo * (patch * seam).or(patched, one);

    let radius = right.mul_add(right, ahead * ahead).sqrt();
    let rim = line((radius - F::splat(0.33)).abs(), 0.03, pixel);
    let ribs = (right * F::splat(12.5) - (right * F::splat(12.5)).floor() - half).abs()
        + (ahead * F::splat(12.5) - (ahead * F::splat(12.5)).floor() - half).abs();
    let relief = smooth(F::splat(0.1), F::splat(0.02), pixel);
    let iron = F::splat(0.085) * (ribs - half).mul_add(relief * F::splat(0.7), one);
    let disc = cover(F::splat(0.33) - radius, pixel).or(covered, F::splat(0.0));
    let iron = V3 { x: iron, y: iron * F::splat(0.96), z: iron * F::splat(0.9) };
    surfaces.albedo = surfaces.albedo.lerp(iron, disc);
    surfaces.specular = surfaces.specular.lerp(F::splat(0.12), disc);
    surfaces.roughness = surfaces.roughness.lerp(F::splat(0.4), disc);
    surfaces.albedo = surfaces.albedo * rim.or(covered, F::splat(0.0)).mul_add(F::splat(-0.6), one);
}

/// Brightness of a lane between the tracks over its mean.
const UNTRACKED: f32 = 1.07;

/// Darkens a lane by rubber in the tracks of wheels and by oil between them; dust and dirt lie at its edges.
#[inline(always)]
fn drive<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask) {
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let [across_x, across_y, edge, width] = surfaces.wall;
    let (x, y) = (surfaces.along, surfaces.up);
    let from_edge = x * across_x + y * across_y - edge;
    let off = (from_edge - width * half).abs();
    // Drivers do not keep to one line.
    let sway = (noise_of(x, y, 0.06, 35) - half) * F::splat(0.5);
    let track = smooth(F::splat(0.40), F::splat(0.08), (off + sway - F::splat(0.82)).abs());
    let oil = smooth(F::splat(0.52), F::splat(0.0), off);
    let drips =
        noise_of(x, y, 0.35, 36).mul_add(F::splat(0.6), noise_of(x, y, 2.6, 37) * F::splat(0.4));
    let drips = smooth(F::splat(0.3), F::splat(0.75), drips);
    let oil = oil * drips.mul_add(F::splat(0.65), F::splat(0.35));
    let side = smooth(F::splat(0.75), F::splat(0.05), width * half - off);
    let clumps = noise_of(x, y, 0.8, 38);
    let dirt = smooth(F::splat(0.52), F::splat(0.8), clumps);
    let mut dark = track.mul_add(F::splat(0.26), oil * F::splat(0.42));
    let waits = surfaces.pattern.shr::<{ pattern::OIL_SHIFT }>() & F::Word::splat(3);
    if (!waits.eq(F::Word::splat(0)) & mask).any() {
        let waits = waits.to_float() * F::splat(1.0 / 3.0);
        let spots = smooth(F::splat(0.5), F::splat(0.72), noise_of(y, x, 1.9, 44));
        let pool = smooth(F::splat(0.9), F::splat(0.1), off) * waits;
        dark = (pool * spots.mul_add(F::splat(0.7), F::splat(0.3))).mul_add(F::splat(0.4), dark);
        // Tyres that lock leave marks, some of them on one side only.
        let ahead = y * across_x - x * across_y;
        let beside = (from_edge - width * half) * F::splat(0.9);
        let locked = noise(ahead * F::splat(0.13), edge + beside, F::Word::splat(57));
        let narrow = smooth(F::splat(0.13), F::splat(0.06), (off + sway - F::splat(0.8)).abs());
        let skid = narrow * smooth(F::splat(0.52), F::splat(0.62), locked);
        dark = (skid * waits.min(half)).mul_add(F::splat(0.7), dark);
    }
    dark = (side * dirt).mul_add(F::splat(0.3), dark);
    // Where no wheels roll, the binder is worn less and bleached.
    let bleached = (side * (one - dirt) * clumps).mul_add(F::splat(0.4), F::splat(UNTRACKED));
    let wave = (one - dark).max(F::splat(0.2)) * bleached;
    surfaces.albedo = surfaces.albedo * wave.or(mask, one);
    let polished = surfaces.roughness - track * F::splat(0.08);
    surfaces.roughness = polished.or(mask, surfaces.roughness);
}

/// Lets the road show through a marking.
#[inline(always)]
fn wear_marking<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let (x, y) = (surfaces.along, surfaces.up);
    let spots =
        noise_of(x, y, 2.1, 27).mul_add(F::splat(0.5), noise_of(x, y, 14.0, 28) * F::splat(0.5));
    let bare = smooth(F::splat(0.52), F::splat(0.78), spots) * F::splat(0.65);
    // The mean where a pixel is larger than the spots.
    let blurred = smooth(F::splat(0.05), F::splat(0.2), pixel);
    let bare = bare.lerp(F::splat(0.12), blurred).or(mask, F::splat(0.0));
    surfaces.albedo = surfaces.albedo.lerp(V3::splat(Vec3::splat(WORN_PAINT)), bare);
}

/// Soils pavements and kerbs by stains, and kerbs by dirt along their feet.
#[inline(always)]
fn soil<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let (x, y) = (surfaces.along, surfaces.up);
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let (u, v) = (x * F::splat(0.8) + y * F::splat(0.6), y * F::splat(0.8) - x * F::splat(0.6));
    let wide = noise_of(u, v, 0.37, 42);
    let spots = noise_of(u, v, 2.3, 43);
    let stains = smooth(F::splat(0.55), F::splat(0.9), spots) * wide;
    let dark = stains.mul_add(F::splat(0.36), (half - wide) * F::splat(0.34));
    let kerb = has(surfaces, pattern::KERB);
    let [_, _, low, _] = surfaces.wall;
    let foot = smooth(F::splat(0.10), F::splat(0.0), surfaces.height - low);
    let foot = (foot * spots.mul_add(F::splat(0.6), F::splat(0.25))).or(kerb, F::splat(0.0));
    let grain = speckle(u, v, pixel, 0.005) * F::splat(0.5);
    let wave = (one - dark) * (one - foot) * (one + grain);
    surfaces.albedo = surfaces.albedo * wave.or(mask, one);
}

/// Makes grass dry and yellow in places, and dark where it is dense.
#[inline(always)]
fn dry_grass<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let (x, y) = (surfaces.along, surfaces.up);
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let wide =
        noise_of(x, y, 0.045, 31).mul_add(F::splat(0.6), noise_of(x, y, 0.31, 32) * F::splat(0.4));
    let dry = smooth(F::splat(0.42), F::splat(0.78), wide) * F::splat(0.75);
    let tone = Vec3::new(1.9, 1.35, 1.25);
    // Across the lattices of the others, so that no rows show.
    let (u, v) = (x * F::splat(0.8) + y * F::splat(0.6), y * F::splat(0.8) - x * F::splat(0.6));
    let tufts = noise_of(u, v, 1.9, 33);
    // Blades and their shadows are longer than wide, and bend from tuft to tuft.
    let bent = tufts.mul_add(F::splat(0.35), u);
    let blades = speckle(bent, v * F::splat(0.45), pixel, 0.012);
    let shade = (tufts - half).mul_add(F::splat(0.5), blades.mul_add(F::splat(1.9), one));
    let clover = smooth(F::splat(0.56), F::splat(0.74), tufts) * (one - dry);
    let lush = V3::splat(Vec3::ONE).lerp(V3::splat(Vec3::new(0.72, 0.92, 0.8)), clover);
    let tint = lush.lerp(V3::splat(tone), dry) * shade.max(F::splat(0.12));
    surfaces.albedo = surfaces.albedo.times(tint).or(mask, surfaces.albedo);
}

/// What soot and algae leave of the light of a wall, by colour: they are dark and a little green.
const GRIME: Vec3 = Vec3::new(0.32, 0.32, 0.27);

/// Height of a base course in a darker paint. Metres.
const BASE_M: f32 = 0.6;

/// Soils walls by streaks of rain water below their top, by splashes above their foot, and by places of old plaster;
/// walls without bricks have repaired places and cracks, too. Heights are metres; strengths are by eye.
#[inline(always)]
fn weather_wall<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let (x, y) = (surfaces.along, surfaces.height);
    let [_, _, low, high] = surfaces.wall;
    let above = y - low;
    let below = high - above;
    // Some buildings were painted lately.
    let age = part::<F>(surfaces.seed, 0x9e37_79b1).mul_add(F::splat(0.8), F::splat(0.5));
    let fine = noise(x * F::splat(2.9), y * F::splat(0.11), F::Word::splat(34));
    let wide = noise(x * F::splat(0.55), y * F::splat(0.06), F::Word::splat(45));
    let runs = smooth(F::splat(0.4), F::splat(0.74), fine.lerp(wide, F::splat(0.35)));
    let near_top = smooth(F::splat(5.0), F::splat(0.2), below);
    let streaks = runs * near_top.mul_add(F::splat(0.36), F::splat(0.2));
    let spots = noise_of(x, y, 2.9, 47);
    let reach = noise_of(x, y, 0.6, 46).mul_add(F::splat(1.7), F::splat(0.5));
    let splashes =
        smooth(reach, F::splat(0.0), above) * spots.mul_add(F::splat(0.45), F::splat(0.4));
    let grime = (one - (one - streaks * age) * (one - splashes * age)).clamp01();
    let tone = V3::splat(Vec3::ONE).lerp(V3::splat(GRIME), grime);
    let places = noise_of(x, y, 0.21, 40).mul_add(
        F::splat(0.5),
        noise_of(x, y, 1.3, 41).mul_add(F::splat(0.3), spots * F::splat(0.2)),
    );
    let mut wave = ((places - half) * age).mul_add(F::splat(0.44), one);
    // Half of the buildings have a darker base course.
    let has_base = half.lt(part::<F>(surfaces.seed, 0x85eb_ca6b));
    let base = cover(F::splat(BASE_M) - above, pixel).or(has_base, F::splat(0.0));
    wave = wave * base.mul_add(F::splat(-0.24), one);
    let plain = mask & !has(surfaces, pattern::BRICKS);
    if plain.any() {
        // Storeys were rendered one after the other.
        let storey = (above * F::splat(1.0 / 3.1) - F::splat(0.26)).floor();
        let lift = share::<F>(hash::<F>(storey.to_int(), F::Word::splat(0), surfaces.seed)) - half;
        let lift = lift.mul_add(F::splat(0.1), plaster(surfaces, age, pixel));
        wave = wave * lift.or(plain, one);
    }
    surfaces.albedo = surfaces.albedo.times(tone * wave).or(mask, surfaces.albedo);
}

/// Returns the brightness of plaster by its repairs, rectangles in one of ten cells, and by its cracks.
#[inline(always)]
fn plaster<F: Float>(surfaces: &SurfaceMaterials<F>, age: F, pixel: F) -> F {
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let (x, y) = (surfaces.along, surfaces.height);
    let cell = [4.1f32, 2.9];
    let (u, v) = (x * F::splat(1.0 / cell[0]), y * F::splat(1.0 / cell[1]));
    let (column, row) = (u.floor(), v.floor());
    let word = hash::<F>(column.to_int(), row.to_int(), surfaces.seed);
    let (across, upward) = (part::<F>(word, 0x85eb_ca6b), part::<F>(word, 0xc2b2_ae35));
    let right = (u - column - across.mul_add(F::splat(0.4), F::splat(0.3))) * F::splat(cell[0]);
    let over = (v - row - upward.mul_add(F::splat(0.4), F::splat(0.3))) * F::splat(cell[1]);
    let size = part::<F>(word, 0x27d4_eb2f);
    // Trowels leave uneven edges.
    let uneven = (noise_of(x, y, 3.7, 48) - half) * F::splat(0.22);
    let inside = (size.mul_add(F::splat(0.7), F::splat(0.35)) - right.abs())
        .min(across.mul_add(F::splat(0.4), F::splat(0.3)) - over.abs());
    let is_repaired = part::<F>(word, 0x9e37_79b1).lt(F::splat(0.1));
    let repair = cover(inside + uneven, pixel).or(is_repaired, F::splat(0.0));
    let wave = (repair * upward.mul_add(F::splat(0.26), F::splat(-0.15))).mul_add(one, one);
    let near = pixel.lt(F::splat(0.03));
    if !near.any() {
        return wave;
    }
    let old = smooth(F::splat(0.5), F::splat(0.66), noise_of(x, y, 0.13, 49)) * age;
    let to_x = (noise_of(x, y, 1.9, 50) - half) * F::splat(0.7);
    let to_y = (noise_of(x, y, 1.9, 51) - half) * F::splat(0.7);
    let crack = noise_of(x + to_x, y + to_y, 0.5, 52) - half;
    // Where the noise passes its middle it changes by about 0.7 per metre.
    let crack = line(crack.abs() * F::splat(1.0 / 0.7), 0.007, pixel) * old;
    wave * crack.or(near, F::splat(0.0)).mul_add(F::splat(-0.5), one)
}

/// Ridges of bark, and the fibres on them, per metre around a trunk and along it: ridges of limes and oaks of 0.3 m to
/// 0.6 m are about 3 cm wide.
const RIDGES_PER_M: [f32; 2] = [34.0, 3.0];
const FIBRES_PER_M: [f32; 2] = [85.0, 9.0];
/// What a furrow leaves of the light of its ridges, and the mean coverage of bark by furrows, of 400 000 points.
const FURROW: f32 = 0.55;
const FURROWS: f32 = 0.208;
/// Albedo of algae on bark, a dull green.
const ALGAE: Vec3 = Vec3::new(0.105, 0.12, 0.07);

/// Noise on bark with so many lattice cells per metre around the trunk and along it.
#[inline(always)]
fn strands<F: Float>(x: F, y: F, [around, upward]: [f32; 2], seed: u32) -> F {
    noise(x * F::splat(around), y * F::splat(upward / BARK), F::Word::splat(seed))
}

/// Returns the share of details that a pixel resolves, of which a metre has so many.
#[inline(always)]
fn resolved<F: Float>(per_m: f32, pixel: F) -> F {
    (F::splat(1.5) - pixel * F::splat(per_m)).clamp01()
}

/// Draws furrows between the ridges of bark, which run up the trunk, and algae in places. The mean albedo stays.
#[inline(always)]
fn furrow_bark<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let (x, y) = (surfaces.along, surfaces.up);
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let seen = resolved(RIDGES_PER_M[0], pixel);
    let mut furrow = F::splat(FURROWS);
    let mut wave = one;
    if (mask & F::splat(0.0).lt(seen)).any() {
        // Ridges part and meet again.
        let aside = (noise_of(x, y, 5.0, 54) - half) * F::splat(0.05);
        let ridge = strands(x + aside, y, RIDGES_PER_M, 55);
        let deep = smooth(F::splat(0.13), F::splat(0.0), (ridge - half).abs());
        furrow = furrow.lerp(deep, seen);
        let fibre = strands(x + aside, y, FIBRES_PER_M, 56) - half;
        wave = (fibre * resolved(FIBRES_PER_M[0], pixel)).mul_add(F::splat(0.8), one);
    }
    let lost = furrow.mul_add(F::splat(FURROW - 1.0), one);
    wave = wave * lost * F::splat(1.0 / (1.0 - (1.0 - FURROW) * FURROWS));
    let algae = smooth(F::splat(0.48), F::splat(0.8), noise_of(x, y, 1.6, 53)) * F::splat(0.45);
    let bark = (surfaces.albedo * wave).lerp(V3::splat(ALGAE), algae);
    surfaces.albedo = bark.or(mask, surfaces.albedo);
}
