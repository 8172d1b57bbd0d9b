//! A simulation in one process has the frames of one with processes, and its cameras the images.

use std::sync::Arc;

use client_lib::{Spawn, VehicleControl, wire::camera};
use environment::{Camera, CameraOutput, CameraView, Simulation};
use glam::{Quat, Vec3};
use mesh::Tag;
use protocol::{ActorId, Command, Name, Pose, flag, output};
use road::Network;
use sensor_render::Scene;

use crate::kit::{Sim, small_map};

const SEED: u64 = 5;

#[test]
fn a_simulation_in_one_process_has_the_state_hashes_of_one_with_processes() {
    let sim = Sim::start(&["--seed", &SEED.to_string(), "--device", "null"]);
    let mut client = sim.ticker();
    let network = Arc::new(Network::parse(&std::fs::read_to_string(small_map()).unwrap()).unwrap());
    let town = town::furnish(&network, SEED);
    let mut alone = Simulation::new(network, &town, SEED);
    let places = client.spawn_points().unwrap();
    let mut ego = ActorId::NONE;
    for (index, place) in places.iter().step_by(places.len() / 8).take(8).enumerate() {
        let mut spawn = Spawn::new("vehicle.audi.tt", *place);
        if index > 0 {
            spawn = spawn.autopilot();
        }
        let id = client.spawn(spawn).unwrap();
        let outcome = alone.apply(Command::Spawn(protocol::Spawn {
            blueprint: Name::new("vehicle.audi.tt"),
            pose: *place,
            flags: if index > 0 { flag::AUTOPILOT } else { 0 },
            ..protocol::Spawn::default()
        }));
        assert_eq!(outcome.result(), Ok(id.0));
        ego = if index == 0 { id } else { ego };
    }
    for frame in 0..200 {
        let steer = if frame % 40 < 20 { 0.2 } else { -0.2 };
        let control =
            VehicleControl { actor_id: ego, throttle: 0.5, steer, ..VehicleControl::default() };
        client.control(&[control]).unwrap();
        alone.request(Command::Control(control.into()));
        client.tick().unwrap();
        let outputs = alone.step();
        assert_eq!(client.world().header().state_hash, outputs.state_hash, "frame {frame}");
    }
    drop(client);
    sim.end();
}

#[test]
fn a_camera_in_one_process_has_the_bytes_of_one_with_processes() {
    let sim = Sim::start(&["--seed", &SEED.to_string(), "--device", "cpu", "--quality", "low"]);
    let mut client = sim.ticker();
    let network = Arc::new(Network::parse(&std::fs::read_to_string(small_map()).unwrap()).unwrap());
    let town = town::furnish(&network, SEED);
    let scene = Arc::new(Scene::of_town(&town).unwrap());
    let mut alone = Simulation::new(network, &town, SEED);
    let places = client.spawn_points().unwrap();
    let mut ego = ActorId::NONE;
    for (index, place) in places.iter().step_by(places.len() / 8).take(8).enumerate() {
        let spawn = Spawn::new("vehicle.audi.tt", *place).autopilot();
        ego = client.spawn(spawn).unwrap();
        let outcome = alone.apply(Command::Spawn(protocol::Spawn {
            blueprint: Name::new("vehicle.audi.tt"),
            pose: *place,
            flags: flag::AUTOPILOT,
            ..protocol::Spawn::default()
        }));
        assert_eq!(outcome.result(), Ok(ego.0), "vehicle {index}");
    }
    let mount = Pose::new(Vec3::new(-6.0, 0.5, 3.0), Quat::from_rotation_y(0.2));
    let (width_px, height_px, fov_rad) = (90, 70, 1.4);
    let outputs = [
        (CameraOutput::Color, output::COLOR),
        (CameraOutput::Tags, output::TAG),
        (CameraOutput::Depth, output::DEPTH),
    ];
    let mut views = outputs.map(|(output, _)| {
        let camera = Camera { width_px, height_px, fov_rad, mount, output };
        CameraView::new(Arc::clone(&scene), &camera)
    });
    let all = output::COLOR | output::TAG | output::DEPTH;
    let sensors = [camera("behind", mount, width_px, height_px, fov_rad, all)];
    let mut bundle = client.create_bundle("view", ego, sensors, 4).unwrap();
    let (mut image, mut cars) = (Vec::new(), 0);
    for frame in 0..60 {
        let (_, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        let measured = measured[0].as_ref().unwrap();
        alone.step();
        let vehicle = alone.sim().world().state(ego).unwrap().pose;
        for (view, (_, output)) in views.iter_mut().zip(outputs) {
            view.place(&alone);
            view.render(&vehicle, &mut image).unwrap();
            let expected = match output {
                output::COLOR => measured
                    .color(0)
                    .unwrap()
                    .iter()
                    .flat_map(|pixel| pixel[..3].to_vec())
                    .collect(),
                _ => measured.data(0, output).unwrap().to_vec(),
            };
            assert!(image == expected, "frame {frame}, output {output}");
        }
        cars += measured.tags(0).unwrap().iter().filter(|tag| **tag == Tag::Car as u8).count();
    }
    // The camera sees its own vehicle: what moves is in the images.
    assert!(cars > 60 * 100, "{cars}");
    drop(client);
    sim.end();
}
