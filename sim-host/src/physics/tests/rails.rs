//! Parapets keep cars on bridges.

use std::sync::Arc;

use glam::{Quat, Vec3};
use mapgen::{Character, Plan};
use protocol::{ActorId, ActorState, Pose, VehicleControl};
use town::Town;

use super::{FRAME_NANOS, SUBSTEP_NANOS};
use crate::physics::{Ground, Physics, StaticBox, VehicleModel};

/// Frames of a second and a half: enough to reach the parapet, not the end of the bridge.
const FRAMES: usize = 30;
const KMH_80_MPS: f32 = 80.0 / 3.6;
const SHALLOW_RAD: f64 = 0.2;

/// Returns a bridge of a generated town: its road, and where it begins and ends.
fn overpass() -> (road::Network, Town, usize) {
    let plan = Plan {
        name: "rails".to_string(),
        seed: 5,
        size_m: 0.0,
        character: Character::Highway,
        relief_m: 0.0,
    };
    let network = road::Network::parse(&mapgen::generate(&plan)).unwrap();
    let furnished = town::furnish(&network, 1);
    let span = network.spans().iter().position(|span| !span.is_tunnel).unwrap();
    (network, furnished, span)
}

/// Returns the height above the bridge's road, and the distance from its outer edge, of a car that
/// steers to the right.
fn after_steering_aside(
    network: &road::Network,
    town: &Town,
    span: usize,
    boxes: &[StaticBox],
) -> (f64, f64, f32) {
    let span = &network.spans()[span];
    let driving = network
        .lanes()
        .iter()
        .find(|lane| lane.road == span.road && lane.kind == road::LaneType::Driving && lane.forward)
        .unwrap();
    let along_m = span.s + 2.0;
    let from = network.place_at(driving.index, along_m, 0.0);
    let heading = from.heading_rad - SHALLOW_RAD;
    let rotation = Quat::from_rotation_z(heading as f32);
    let position = from.position.as_vec3() + Vec3::Z * 0.3;
    let pose = Pose::new(position, rotation);
    let mut physics = Physics::new(Arc::new(Ground::new(&town.mesh)), boxes);
    let id = ActorId(1);
    physics.spawn_vehicle(id, &Arc::new(VehicleModel::sedan()), &pose, false).unwrap();
    physics.set_velocity(id, rotation * Vec3::X * KMH_80_MPS, Vec3::ZERO).unwrap();
    let control = VehicleControl { actor_id: id, throttle: 0.3, ..VehicleControl::default() };
    for _ in 0..FRAMES {
        physics.control(&control).unwrap();
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let mut state = ActorState { actor_id: id, ..ActorState::default() };
    assert!(physics.write_state(&mut state));
    let at = state.pose.position().as_dvec3();
    // Along the straight bridge, from the middle of the lane to the right.
    let offset = at - from.position;
    let right = glam::DVec2::from_angle(from.heading_rad - std::f64::consts::FRAC_PI_2);
    let aside = offset.truncate().dot(right);
    (offset.z, aside, state.velocity().length())
}

#[test]
fn a_parapet_holds_a_car_on_its_bridge() {
    let (network, town, span) = overpass();
    let boxes: Vec<StaticBox> = town
        .colliders
        .iter()
        .map(|one| StaticBox {
            center: one.center,
            half_extents_m: one.half_extents_m,
            yaw_rad: one.yaw_rad,
        })
        .collect();
    let (height, aside, speed) = after_steering_aside(&network, &town, span, &boxes);
    println!("with: {height:.2} m over its road, {aside:.2} m aside, {speed:.1} m/s");
    // The same drive without static boxes ends far below.
    let (fallen, beyond, _) = after_steering_aside(&network, &town, span, &[]);
    println!("without: {fallen:.2} m, {beyond:.2} m aside");
    let road = &network.roads()[network.spans()[span].road as usize];
    let edge: f64 = road.sections[0]
        .lanes
        .iter()
        .map(|lane| network.lane(*lane))
        .filter(|lane| lane.forward)
        .map(|lane| network.width(road::LanePoint { lane: lane.index, along_m: 10.0 }))
        .sum();
    assert!(beyond > edge, "the test drives straight on: {beyond} m of {edge} m");
    assert!(height > -1.0 && aside < edge, "{height} m, {aside} m of {edge} m");
}
