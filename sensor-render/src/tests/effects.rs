//! Effects of cameras have the size that their formulas give, on both tracers.

use std::sync::Arc;

use glam::Vec3;
use protocol::{
    EffectsSpec, LensSpec, Pose, SensorSpec, Shape, Weather, exposure, lens_model, output, quality,
    shape,
};

use super::lens::{lenses, tracers};
use super::{MeasuredBundle, actor, camera, cpu, scene, world_with};
use crate::tone_curve::{CURVE, CURVE_FIRST_BITS, CURVE_STEP_BITS, table};
use crate::{Overlay, Scene, Tracer, World};

const SIZE: [u32; 2] = [160, 120];

/// Effects that leave the image as it is: they only switch the film on.
fn neutral() -> EffectsSpec {
    EffectsSpec { temperature_k: 6500.0, ..EffectsSpec::default() }
}

fn spec(effects: EffectsSpec) -> SensorSpec {
    SensorSpec { effects, outputs: output::COLOR, ..camera(SIZE[0], SIZE[1]) }
}

fn image(tracer: &mut Tracer, scene: &Scene, world: &World, spec: SensorSpec) -> Vec<[u8; 4]> {
    MeasuredBundle::measure(tracer, scene, world, &[spec]).plane(0, output::COLOR).to_vec()
}

/// Returns the exposed radiance that a value of a pixel stands for: the inverse of the tone curve.
pub(super) fn exposed(value: u8) -> f32 {
    let table = table(&EffectsSpec::default());
    let value = f32::from(value);
    let above = table.iter().position(|entry| *entry > value).unwrap_or(CURVE - 1).max(1);
    let [low, high] = [above - 1, above]
        .map(|entry| f32::from_bits(CURVE_FIRST_BITS + ((entry as u32) << CURVE_STEP_BITS)));
    let share = (value - table[above - 1]) / (table[above] - table[above - 1]).max(1e-6);
    low + (high - low) * share.clamp(0.0, 1.0)
}

/// Asserts that the exposed radiances of two images have a ratio, where both are neither dark, where the curve is
/// steep, nor white.
#[track_caller]
fn assert_ratio(images: [&[[u8; 4]]; 2], ratio: impl Fn(usize) -> f32, least: usize) {
    let mut seen = 0;
    for (at, (a, b)) in images[0].iter().zip(images[1]).enumerate() {
        for channel in 0..3 {
            let (a, b) = (a[channel], b[channel]);
            if (56..235).contains(&a) && (56..235).contains(&b) {
                // Half a step of each value.
                let [low, high] = [a - 1, a + 1].map(exposed);
                let [less, more] = [b - 1, b + 1].map(exposed);
                // And a per mille, since `exposed` takes the curve between two entries of its table as straight.
                let (ratio, possible) = (ratio(at), low / more * 0.999..=high / less * 1.001);
                assert!(possible.contains(&ratio), "{at}: {ratio} is not in {possible:?}");
                seen += 1;
            }
        }
    }
    assert!(seen >= least, "{seen}");
}

#[test]
fn effects_that_change_nothing_show_what_a_camera_without_effects_shows() {
    let scene = scene();
    let world = world_with(&scene, &[actor(1, Pose::level(Vec3::new(9., 2., 0.), 0.3))]);
    for mut tracer in tracers() {
        let [with, without] = [neutral(), EffectsSpec::default()]
            .map(|effects| image(&mut tracer, &scene, &world, spec(effects)));
        let differs =
            |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1);
        assert_eq!(with.iter().zip(&without).filter(|pair| differs(*pair)).count(), 0);
        assert!(with.iter().any(|color| color[0] > 100));
    }
}

#[test]
fn one_stop_is_a_factor_of_two_of_radiance() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    for mut tracer in tracers() {
        let mut shown = |effects: EffectsSpec| image(&mut tracer, &scene, &world, spec(effects));
        let manual = |shutter_secs: f32, iso: f32, f_number: f32| EffectsSpec {
            exposure: exposure::MANUAL,
            iso,
            shutter_secs,
            f_number,
            ..EffectsSpec::default()
        };
        let sunny = shown(manual(0.008, 100.0, 16.0));
        // In sunshine, this is the exposure by the weather: 0.62 and 25 000 / 1.2 / 2^14.966.
        let by_weather = shown(neutral());
        assert_ratio([&sunny, &by_weather], |_| 0.651 / 0.62, 2000);
        let darker = shown(manual(0.004, 100.0, 16.0));
        assert_ratio([&sunny, &darker], |_| 2.0, 2000);
        assert_eq!(darker, shown(manual(0.004, 200.0, 16.0 * 2f32.sqrt())));
        let compensated = EffectsSpec { compensation_ev: -1.0, ..manual(0.008, 100.0, 16.0) };
        assert_eq!(darker, shown(compensated));
        let less = EffectsSpec { compensation_ev: -1.0, ..neutral() };
        assert_ratio([&by_weather, &shown(less)], |_| 2.0, 2000);
    }
}

#[test]
fn automatic_exposure_shows_any_weather_in_the_same_brightness() {
    let scene = scene();
    // The mean of the logarithms of the luminances, without the darkest and the brightest tenth.
    let mean = |image: &[[u8; 4]]| {
        let luminance = |color: &[u8; 4]| {
            let [red, green, blue] = [0, 1, 2].map(|channel| exposed(color[channel]));
            (red * 0.2126 + green * 0.7152 + blue * 0.0722).log2()
        };
        let mut all: Vec<f32> = image.iter().map(luminance).collect();
        all.sort_by(f32::total_cmp);
        let middle = &all[all.len() / 10..all.len() * 9 / 10];
        (middle.iter().sum::<f32>() / middle.len() as f32).exp2()
    };
    for mut tracer in tracers() {
        let mut of = |effects: EffectsSpec| {
            [0.9f32, 0.12, -0.02].map(|sun_altitude_rad| {
                let mut world = world_with(&scene, &[]);
                let weather = Weather { sun_altitude_rad, ..Weather::default() };
                world.place(&scene, world.stamp(), 50_000_000, &weather, &[], |_| [0; 3]);
                mean(&image(&mut tracer, &scene, &world, spec(effects)))
            })
        };
        let automatic = EffectsSpec { exposure: exposure::AUTOMATIC, ..EffectsSpec::default() };
        for shown in of(automatic) {
            // 0.125 / 1.2: what a light meter makes of an even surface.
            assert!((shown / 0.104 - 1.0).abs() < 0.1, "{shown}");
        }
        let [noon, _, twilight] = of(neutral());
        assert!(twilight < 0.6 * noon, "{noon} {twilight}");
        // Beyond its limits it is a fixed exposure.
        let [_, dusk, twilight] = of(EffectsSpec { ev_limits: [15.0, 15.0], ..automatic });
        assert!(twilight < 0.8 * dusk, "{dusk} {twilight}");
    }
}

#[test]
fn vignetting_is_the_fourth_power_of_the_cosine() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    for mut tracer in tracers() {
        for share in [1.0, 0.5] {
            let [with, without] = [EffectsSpec { vignette: share, ..neutral() }, neutral()]
                .map(|effects| image(&mut tracer, &scene, &world, spec(effects)));
            // 160 pixels over 90 degrees.
            let cosine_4 = |at: usize| {
                let [x, y] = [at % 160, at / 160].map(|pixel| pixel as f32 + 0.5);
                let square = ((x - 80.0).powi(2) + (y - 60.0).powi(2)) / 80.0f32.powi(2);
                1.0 + share * ((1.0 + square).powi(-2) - 1.0)
            };
            assert_ratio([&with, &without], cosine_4, 2000);
        }
    }
}

#[test]
fn noise_has_the_variance_of_its_electrons_and_depends_on_seed_and_time() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let (white, read) = (400.0, 5.0);
    let noisy = EffectsSpec { white_electrons: white, read_electrons: read, ..neutral() };
    for mut tracer in tracers() {
        let clean = image(&mut tracer, &scene, &world, spec(neutral()));
        let shown = image(&mut tracer, &scene, &world, spec(noisy));
        assert_eq!(shown, image(&mut tracer, &scene, &world, spec(noisy)));
        let other_seed = SensorSpec { seed: 3, ..spec(noisy) };
        assert_ne!(shown, image(&mut tracer, &scene, &world, other_seed));
        let mut later = world_with(&scene, &[]);
        let stamp = protocol::Stamp { sim_time_nanos: 100_000_000, ..later.stamp() };
        later.place(&scene, stamp, 50_000_000, &Weather::default(), &[], |_| [0; 3]);
        assert_ne!(shown, image(&mut tracer, &scene, &later, spec(noisy)));
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for (a, b) in shown.iter().zip(&clean) {
            let value = exposed(b[1]);
            if (60..160).contains(&b[1]) {
                let deviation = (value / white + (read / white).powi(2)).sqrt();
                let off = (exposed(a[1]) - value) / deviation;
                (sum, squares, count) = (sum + off, squares + off * off, count + 1.0f32);
            }
        }
        assert!(count > 2000.0, "{count}");
        let (mean, variance) = (sum / count, squares / count);
        assert!(mean.abs() < 0.05 && (variance - 1.0).abs() < 0.08, "{mean} {variance}");
    }
}

#[test]
fn bloom_spreads_light_into_dark_places_and_keeps_even_ones() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let bloom = EffectsSpec { bloom: 0.5, bloom_radius: 0.02, ..neutral() };
    for mut tracer in tracers() {
        let [with, without] =
            [bloom, neutral()].map(|effects| image(&mut tracer, &scene, &world, spec(effects)));
        let total = |image: &[[u8; 4]]| image.iter().map(|color| exposed(color[0])).sum::<f32>();
        let (a, b) = (total(&with), total(&without));
        assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
        // The edge between the wall and the brighter sky.
        let edge = (0..SIZE[1] as usize - 1)
            .map(|y| y * SIZE[0] as usize + 80)
            .find(|at| without[*at][2].abs_diff(without[at + SIZE[0] as usize][2]) > 40)
            .unwrap();
        let step = |image: &[[u8; 4]]| {
            u32::from(image[edge][2].abs_diff(image[edge + SIZE[0] as usize][2]))
        };
        assert!(step(&with) * 4 < step(&without) * 3, "{} {}", step(&with), step(&without));
    }
}

#[test]
fn chromatic_aberration_moves_red_outwards_and_blue_inwards() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let size = SIZE[0] as usize;
    for mut tracer in tracers() {
        // The filmic curve does not mute, which mixes channels.
        let plain =
            EffectsSpec { slope: 0.88, toe: 0.55, shoulder: 0.26, white_clip: 0.04, ..neutral() };
        let shifted = EffectsSpec { chromatic_aberration: 0.05, ..plain };
        let [with, without] =
            [shifted, plain].map(|effects| image(&mut tracer, &scene, &world, spec(effects)));
        // Twenty pixels above the principal point, red comes from 19 pixels above it, and blue from 21.
        for x in (8..size - 8).step_by(9) {
            for y in [9, 39, 89] {
                let at = y * size + x;
                assert_eq!(with[at][1], without[at][1]);
                for (channel, scale) in [(0, 1.0 / 1.05), (2, 1.05)] {
                    let from = [x as f32 - 79.5, y as f32 - 59.5].map(|side| side * scale);
                    let place = [from[0] + 79.5, from[1] + 59.5].map(|side| side as usize);
                    let around = [0, 1, size, size + 1].map(|next| {
                        without[(place[1] * size + place[0] + next).min(without.len() - 1)][channel]
                    });
                    let (low, high) = (around.iter().min().unwrap(), around.iter().max().unwrap());
                    let shown = with[at][channel];
                    assert!((low - low.min(&1)..=high.saturating_add(1)).contains(&shown));
                }
            }
        }
        assert_ne!(with, without);
    }
}

#[test]
fn debug_shapes_are_drawn_over_a_developed_image() {
    let red = u32::from_le_bytes([255, 0, 0, 255]);
    let scene = scene();
    let mut world = world_with(&scene, &[]);
    let points = [[4.0, 1.5, 1.6], [25.0, 0.0, 1.0]].map(|begin_m| Shape {
        begin_m,
        color: red,
        pixels: 5.0,
        ..Shape::new(shape::POINT)
    });
    world.set_overlay(Arc::new(Overlay::new(&points)));
    let dark = EffectsSpec { compensation_ev: -2.0, bloom: 0.2, ..EffectsSpec::default() };
    for mut tracer in tracers() {
        for quality in [quality::LOW, quality::STANDARD] {
            let count = |image: &[[u8; 4]]| {
                image.iter().filter(|color| u32::from_le_bytes(**color) == red).count()
            };
            let [with, without] = [dark, EffectsSpec::default()].map(|effects| {
                let spec = SensorSpec { quality, ..spec(effects) };
                count(&image(&mut tracer, &scene, &world, spec))
            });
            // The second point lies behind the wall.
            assert!(without > 10 && with == without, "{with} {without}");
        }
    }
}

/// Effects of each kind, and all together.
fn all_effects() -> Vec<EffectsSpec> {
    let automatic = EffectsSpec { exposure: exposure::AUTOMATIC, ..EffectsSpec::default() };
    let optics = EffectsSpec {
        vignette: 0.8,
        bloom: 0.15,
        bloom_radius: 0.015,
        chromatic_aberration: 0.004,
        ..automatic
    };
    let film = EffectsSpec { white_electrons: 3000.0, read_electrons: 8.0, ..optics };
    let curve = EffectsSpec {
        slope: 0.88,
        toe: 0.55,
        shoulder: 0.26,
        white_clip: 0.04,
        gamma: 2.0,
        temperature_k: 4800.0,
        tint: 0.2,
        ..film
    };
    vec![automatic, optics, film, curve]
}

#[test]
fn both_tracers_develop_the_same_image() {
    let Some(mut gpu) = crate::gpu::tests::gpu() else { return };
    let scene = scene();
    let actors: Vec<_> = (0..20)
        .map(|i| {
            let angle = i as f32 * 0.7;
            actor(i + 1, Pose::level(Vec3::new(9. * angle.cos(), 9. * angle.sin(), 0.), angle))
        })
        .collect();
    let world = world_with(&scene, &actors);
    let fisheye = LensSpec { model: lens_model::FISHEYE, ..lenses(SIZE)[2] };
    for effects in all_effects() {
        for (quality, lens) in [
            (quality::LOW, LensSpec::default()),
            (quality::STANDARD, LensSpec::default()),
            (quality::STANDARD, fisheye),
        ] {
            // Two cameras with films, and one without between them.
            let front = SensorSpec { quality, lens, ..spec(effects) };
            let plain = camera(43, 29);
            let rear = SensorSpec { effects, seed: 9, ..camera(61, 47) };
            let sensors = [("a", front), ("b", plain), ("c", rear)]
                .map(|(name, spec)| SensorSpec { name: protocol::Name::new(name), ..spec });
            let by_cpu = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &sensors);
            let by_gpu = MeasuredBundle::measure(&mut gpu, &scene, &world, &sensors);
            for sensor in 0..3 {
                let images =
                    [&by_cpu, &by_gpu].map(|bundle| bundle.plane::<[u8; 4]>(sensor, output::COLOR));
                let differs = |(a, b): &(&[u8; 4], &[u8; 4])| {
                    a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2)
                };
                let count = images[0].iter().zip(images[1]).filter(differs).count();
                let allowed = images[0].len().div_ceil(1000);
                assert!(count <= allowed, "{effects:?} {quality} {sensor}: {count} of {allowed}");
            }
        }
    }
}

#[test]
fn any_number_of_threads_develops_the_same_bytes() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    for effects in all_effects() {
        let spec = SensorSpec { quality: quality::STANDARD, ..spec(effects) };
        let [one, three] = [1, 3].map(|threads| image(&mut cpu(threads), &scene, &world, spec));
        assert!(one == three);
    }
}
