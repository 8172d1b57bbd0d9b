//! Falling drops and spray in front of a surface. Twin of rain.wgsl.
//!
//! A drop that covers a pixel during a part of the exposure leaves a streak with an opacity of that part: its diameter / its way (K. Garg and S. Nayar, *Vision and Rain*, IJCV 75, 2007). It refracts
//! light from nearly a half space, so that its radiance is that of the surroundings.

use glam::Vec3;

use super::grain::hash;
use super::sky::{ambient, splat};
use crate::light::Light;
use crate::rain::{DIAMETERS_M, DROPS_PER_CELL, FLATNESS, LAYERS_M, Puff, Rainfall};
use crate::rays::Camera;
use crate::simd::{Float, V3, Word};

/// Returns the radiance along rays with what drops and spray before `t` add and hide.
#[inline(always)]
pub(crate) fn in_rain<F: Float>(
    light: &Light,
    camera: &Camera,
    color: V3<F>,
    origin: V3<F>,
    direction: V3<F>,
    t: F,
) -> V3<F> {
    let Some(rain) = &camera.rain else { return color };
    let mut color = color;
    let t = t.min(F::splat(1e4));
    for puff in &rain.puffs[..rain.count as usize] {
        let depth = optical_depth(puff, origin, direction, t);
        // Truncated series of the exponential function.
        let (half, fifth, one) = (F::splat(0.5), F::splat(0.2), F::splat(1.0));
        let growth = depth.mul_add(depth.mul_add(depth.mul_add(fifth, half), one), one);
        let mist = ambient(light, F::splat(0.4)) + splat::<F>(light.sun_color) * F::splat(0.06);
        color = color.lerp(mist, one - one / growth);
    }
    if rain.chances[3] > 0.0 {
        let opacity = streaks(rain, camera.pixel, direction, t);
        color = color.lerp(ambient(light, F::splat(0.5)), opacity);
    }
    color
}

/// Returns the optical depth of a puff before `t`. With k² = 1 + the square of the distance of the ray from the
/// middle and x along the ray from the point nearest to it, both in half axes, the integral of
/// (k² + x²)^(−7/2) is (u − 2u³/3 + u⁵/5) / k⁶ with u = x / √(k² + x²).
#[inline(always)]
fn optical_depth<F: Float>(puff: &Puff, origin: V3<F>, direction: V3<F>, t: F) -> F {
    let from = in_half_axes(puff, origin - V3::splat(Vec3::from(puff.center)));
    let along = in_half_axes(puff, direction);
    let squared = along.dot(along);
    let length = squared.sqrt();
    let near = from.dot(along) / length;
    let apart = (from.dot(from) - near * near).max(F::splat(0.0)) + F::splat(1.0);
    let end = t.mul_add(length, near);
    let sum = primitive(end, apart) - primitive(near, apart);
    let stretch = direction.dot(direction).sqrt();
    sum * (F::splat(puff.density_per_m) * stretch) / (length * apart * apart * apart)
}

#[inline(always)]
fn primitive<F: Float>(x: F, apart: F) -> F {
    let u = x / x.mul_add(x, apart).sqrt();
    let square = u * u;
    u * square.mul_add(square.mul_add(F::splat(0.2), F::splat(-2.0 / 3.0)), F::splat(1.0))
}

/// Returns a vector along the axes of a puff, in their units.
#[inline(always)]
fn in_half_axes<F: Float>(puff: &Puff, v: V3<F>) -> V3<F> {
    let ([x, y], long, wide) = (puff.along, puff.per_length, puff.per_width);
    V3 {
        x: v.x.mul_add(F::splat(x * long), v.y * F::splat(y * long)),
        y: v.y.mul_add(F::splat(x * wide), v.x * F::splat(-y * wide)),
        z: v.z * F::splat(wide / FLATNESS),
    }
}

/// Returns the opacity of the streaks in front of what lies at `t`. Each layer is a plane with a grid of cells
/// perpendicular to the dominant axis of the ray, and each streak lies within its cell.
#[inline(always)]
fn streaks<F: Float>(rain: &Rainfall, pixel: f32, direction: V3<F>, t: F) -> F {
    let (zero, one, half) = (F::splat(0.0), F::splat(1.0), F::splat(0.5));
    let V3 { x, y, z } = direction;
    let by_x = x.abs().ge(y.abs()) & x.abs().ge(z.abs());
    let by_y = y.abs().ge(z.abs()) & !by_x;
    let axis = x.or(by_x, y.or(by_y, z));
    let flip = one.or(axis.ge(zero), F::splat(-1.0));
    let per_axis = flip / axis;
    let across = y.or(by_x, x) * per_axis;
    let upward = y.or(!by_x & !by_y, z) * per_axis;
    // The way of a drop in the plane, in cells.
    let [sx, sy, sz] = rain.streak;
    let (sx, sy, sz) = (F::splat(sx), F::splat(sy), F::splat(sz));
    let ahead = sx.or(by_x, sy.or(by_y, sz)) * flip;
    let cells = F::splat(rain.per_cell);
    let way_x = (sy.or(by_x, sx) - across * ahead) * cells;
    let way_y = (sy.or(!by_x & !by_y, sz) - upward * ahead) * cells;
    let way_squared = way_x.mul_add(way_x, way_y * way_y).max(F::splat(1e-6));
    let way = way_squared.sqrt();
    let (reach_x, reach_y) = (way_x.abs().min(one), way_y.abs().min(one));
    let reached = t * axis.abs();

    let mut opacity = zero;
    for (layer, (distance, chance)) in (0..).zip(LAYERS_M.into_iter().zip(rain.chances)) {
        let scale = F::splat(distance * rain.per_cell);
        let (at_x, at_y) = (across * scale, upward * scale);
        let (left, low) = (at_x.floor(), at_y.floor());
        let (at_x, at_y) = (at_x - left, at_y - low);
        let (left, low) = (left.to_int(), low.to_int());
        let seen = F::splat(distance).lt(reached);
        let side = F::splat(pixel * distance);
        for drop in 0..DROPS_PER_CELL {
            let seed = rain.seed ^ (layer * DROPS_PER_CELL + drop).wrapping_mul(0x9e37_79b9);
            let place = hash::<F>(left, low, F::Word::splat(seed));
            let other = hash::<F>(low, left, F::Word::splat(seed ^ 0x5bd1_e995));
            let mask = F::Word::splat(0xffff);
            let unit = F::splat(1.0 / 65_536.0);
            let from_left = (place & mask).to_float() * unit;
            let from_low = place.shr::<16>().to_float() * unit;
            let size = (other & mask).to_float() * unit;
            let exists = (other.shr::<16>().to_float() * unit).lt(F::splat(chance)) & seen;
            let x = at_x - (one - reach_x).mul_add(from_left, reach_x * half);
            let y = at_y - (one - reach_y).mul_add(from_low, reach_y * half);
            let short = size.mul_add(F::splat(1.0 - rain.shortest), F::splat(rain.shortest));
            let along = x.mul_add(way_x, y * way_y) / (way_squared * short);
            let off = x.mul_add(way_y, y * -way_x).abs() / (way * cells);
            let [thin, thick] = DIAMETERS_M;
            let diameter = (size * size).mul_add(F::splat(thick - thin), F::splat(thin));
            let covered = (((diameter + side) * half - off) / side).max(zero);
            let covered = covered.min((diameter / side).min(one));
            let end = ((half - along.abs()) * F::splat(3.0)).clamp01();
            let part = diameter / (way * short / cells + diameter);
            opacity = opacity + (covered * end * part).or(exists, zero);
        }
    }
    opacity.min(one)
}

#[cfg(test)]
mod tests {
    use protocol::{EffectsSpec, Weather};

    use super::*;
    use crate::simd::{Isa, Kernel, LANES};

    fn rainfall(velocity: Vec3, seed: u32) -> Rainfall {
        let weather = Weather { precipitation: 60.0, wind_intensity: 0.0, ..Weather::default() };
        let effects = EffectsSpec::default();
        Rainfall::new(&weather, &effects, seed, Vec3::ZERO, velocity, &[], || false)
    }

    #[inline(always)]
    fn side_by_side<F: Float>(vectors: [Vec3; LANES]) -> V3<F> {
        V3 {
            x: F::from_array(vectors.map(|vector| vector.x)),
            y: F::from_array(vectors.map(|vector| vector.y)),
            z: F::from_array(vectors.map(|vector| vector.z)),
        }
    }

    /// Opacities in sixteen directions.
    struct Opacities<'a>(&'a Rainfall, [Vec3; LANES], f32);

    impl Kernel for Opacities<'_> {
        type Output = [f32; LANES];

        #[inline(always)]
        fn run<F: Float>(self) -> [f32; LANES] {
            let Opacities(rain, directions, t) = self;
            streaks(rain, 0.001, side_by_side(directions), F::splat(t)).to_array()
        }
    }

    /// Returns opacities over a field of view of 0.2 by 0.2 round `ahead`, in steps of `step`.
    fn field(rain: &Rainfall, ahead: Vec3, step: f32, t: f32) -> Vec<Vec<f32>> {
        let count = (0.2 / step) as usize / LANES * LANES;
        let right = Vec3::new(-ahead.y, ahead.x, 0.0).normalize_or_zero();
        let isa = Isa::detect();
        (0..count)
            .map(|row| {
                let at = |column: usize| {
                    ahead + right * (column as f32 * step) + Vec3::Z * (row as f32 * step)
                };
                let chunks = (0..count).step_by(LANES);
                let chunk = |first| std::array::from_fn(|lane| at(first + lane));
                chunks.flat_map(|first| isa.run(Opacities(rain, chunk(first), t))).collect()
            })
            .collect()
    }

    fn mean(rows: &[Vec<f32>]) -> f32 {
        let all = rows.iter().flatten();
        all.clone().sum::<f32>() / all.count() as f32
    }

    #[test]
    fn streaks_cover_the_share_that_the_drops_of_the_rain_cover() {
        let rain = rainfall(Vec3::ZERO, 1);
        let way = Vec3::from(rain.streak).length();
        // The mean of D · D / (way + D) · way over the diameters, larger drops having longer ways, and 2/3 for the
        // faint ends.
        let [thin, thick] = DIAMETERS_M;
        let steps = (0..1000).map(|step| (step as f32 + 0.5) / 1000.0);
        assert!(rain.shortest < 0.5, "{}", rain.shortest);
        let of_drop = |size: f32| {
            let diameter = thin + size * size * (thick - thin);
            let way = way * (rain.shortest + size * (1.0 - rain.shortest));
            diameter * diameter / (way + diameter) * way
        };
        let by_drop = steps.map(of_drop).sum::<f32>() / 1000.0 * (2.0 / 3.0);
        let cells = rain.per_cell * rain.per_cell;
        let wanted = rain.chances.iter().sum::<f32>() * DROPS_PER_CELL as f32 * cells * by_drop;
        let seeds = 1..9;
        let seen = seeds
            .clone()
            .map(|seed| mean(&field(&rainfall(Vec3::ZERO, seed), Vec3::X, 0.000_5, 1e4)));
        let seen = seen.sum::<f32>() / seeds.count() as f32;
        assert!((seen / wanted - 1.0).abs() < 0.1, "{seen} {wanted}");
        // Nothing is nearer than the first layer.
        assert_eq!(mean(&field(&rain, Vec3::X, 0.001, 0.79)), 0.0);
    }

    #[test]
    fn streaks_point_where_drops_move_relative_to_the_camera() {
        let roughness = |velocity: Vec3, ahead: Vec3| {
            let rows = field(&rainfall(velocity, 5), ahead, 0.000_5, 1e4);
            let (mut across, mut upwards) = (0.0, 0.0);
            for (row, above) in rows.iter().zip(&rows[4..]) {
                for (at, right) in row[4..].iter().enumerate() {
                    across += (right - row[at]).abs();
                    upwards += (above[at] - row[at]).abs();
                }
            }
            (across, upwards)
        };
        let (across, upwards) = roughness(Vec3::ZERO, Vec3::X);
        assert!(across > 2.0 * upwards, "{across} {upwards}");
        // Drops pass a fast car to its side.
        let (across, upwards) = roughness(Vec3::X * 40.0, Vec3::new(0.2, 1.0, 0.0));
        assert!(upwards > 2.0 * across, "{across} {upwards}");
    }

    /// Optical depths of a puff along sixteen rays.
    struct Depths<'a>(&'a Puff, [[Vec3; 2]; LANES], f32);

    impl Kernel for Depths<'_> {
        type Output = [f32; LANES];

        #[inline(always)]
        fn run<F: Float>(self) -> [f32; LANES] {
            let Depths(puff, rays, t) = self;
            let origin = side_by_side(rays.map(|ray| ray[0]));
            let direction = side_by_side(rays.map(|ray| ray[1]));
            optical_depth(puff, origin, direction, F::splat(t)).to_array()
        }
    }

    #[test]
    fn the_optical_depth_is_the_integral_of_the_density() {
        let puff = Puff {
            center: [8.0, 1.0, 0.7],
            density_per_m: 0.9,
            along: [0.6, 0.8],
            per_length: 0.4,
            per_width: 1.1,
        };
        let rays = std::array::from_fn(|ray| {
            let turn = ray as f32 * 0.02 - 0.1;
            [Vec3::new(0.3 * ray as f32, 0.0, 1.0), Vec3::new(1.0, turn, -0.03) * 1.7]
        });
        for t in [1.0, 4.0, 60.0] {
            let depths = Isa::detect().run(Depths(&puff, rays, t));
            for ([origin, direction], depth) in rays.into_iter().zip(depths) {
                const STEPS: u32 = 20_000;
                let step = t / STEPS as f32;
                let sum: f64 = (0..STEPS)
                    .map(|number| {
                        let at = origin + direction * (step * (number as f32 + 0.5));
                        let to = at - Vec3::from(puff.center);
                        let [x, y] = puff.along;
                        let own = Vec3::new(
                            (to.x * x + to.y * y) * puff.per_length,
                            (to.y * x - to.x * y) * puff.per_width,
                            to.z * puff.per_width / FLATNESS,
                        );
                        f64::from(puff.density_per_m * (1.0 + own.length_squared()).powf(-3.5))
                    })
                    .sum();
                let wanted = sum as f32 * step * direction.length();
                assert!((depth - wanted).abs() < 1e-3 * wanted + 1e-5, "{t}: {depth} {wanted}");
            }
        }
    }
}
