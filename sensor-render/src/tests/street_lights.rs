//! Street lights shine as commands have set them.

use mesh::{Face, Material, Tag};
use protocol::{StreetLightState, StreetLights, output};

use super::{MeasuredBundle, block, camera, cpu, town, world_with};
use crate::{Scene, Tracer};

/// Returns three lamps in front of the wall, objects 9, 10 and 11 from left to right.
fn scene() -> Scene {
    let mut mesh = town();
    for (object, y) in [(9, 4.0), (10, 0.0), (11, -4.0)] {
        let face = Face::new(Tag::Pole, Material::LampWhite, object);
        block(&mut mesh, [10.0, y - 1.0, 1.0], [10.5, y + 1.0, 2.0], face);
    }
    Scene::new(&mesh, &[]).unwrap()
}

fn set(lighting: &mut StreetLights, number: u32, shine: StreetLightState) {
    let mut bits = [0; 16];
    bits[0] = 1 << number;
    lighting.set(0, &bits, shine);
}

/// Returns the colours at the centres of the three lamps.
fn measured(tracer: &mut Tracer, lighting: &StreetLights, sun_altitude_rad: f32) -> [[u8; 4]; 3] {
    let scene = scene();
    let mut world = world_with(&scene, &[]);
    world.weather.sun_altitude_rad = sun_altitude_rad;
    world.set_street_lights(lighting);
    let bundle = MeasuredBundle::measure(tracer, &scene, &world, &[camera(161, 121)]);
    let colors = bundle.plane::<[u8; 4]>(0, output::COLOR);
    [4.0, 0.0, -4.0].map(|y: f32| colors[56 * 161 + (80.0 - 80.5 * y / 10.0) as usize])
}

const DAY: f32 = 0.85;
const NIGHT: f32 = -0.6;

fn lighting() -> StreetLights {
    let mut lighting = StreetLights::default();
    let red = u32::from_le_bytes([255, 0, 0, 255]);
    set(&mut lighting, 9, StreetLightState { mode: 1, color: red, intensity: 1.0 });
    set(&mut lighting, 11, StreetLightState { mode: 0, ..StreetLightState::OWN });
    lighting
}

#[test]
fn a_street_light_shines_at_night_unless_a_command_has_set_it() {
    let own = StreetLights::default();
    let by_day = measured(&mut cpu(1), &own, DAY);
    let by_night = measured(&mut cpu(1), &own, NIGHT);
    assert!(by_night.iter().all(|[r, g, b, _]| *r > 240 && *g > 220 && *b > 190), "{by_night:?}");
    let lighting = lighting();
    for (sun, plain) in [(DAY, by_day), (NIGHT, by_night)] {
        let [red, same, off] = measured(&mut cpu(1), &lighting, sun);
        assert!(red[0] > 225 && red[0] - red[1] > 120, "{red:?}");
        assert_eq!(same, plain[1]);
        assert!(sun == DAY || off[0] < 100, "{off:?}");
        assert!(sun == NIGHT || off == plain[2], "{off:?}");
    }
    let mut weak = StreetLights::default();
    let dim = StreetLightState { intensity: 0.007, ..StreetLightState::OWN };
    set(&mut weak, 10, dim);
    assert!(measured(&mut cpu(1), &weak, NIGHT)[1][0] < 200);
}

#[test]
fn the_gpu_renders_the_same_street_lights() {
    let Some(mut gpu) = crate::gpu::tests::gpu() else { return };
    for lighting in [StreetLights::default(), lighting(), StreetLights::default()] {
        for sun in [DAY, NIGHT] {
            let by_gpu = measured(&mut gpu, &lighting, sun);
            let by_cpu = measured(&mut cpu(1), &lighting, sun);
            let apart = by_cpu.iter().flatten().zip(by_gpu.iter().flatten());
            assert!(apart.clone().all(|(a, b)| a.abs_diff(*b) <= 2), "{by_cpu:?} {by_gpu:?}");
        }
    }
}
