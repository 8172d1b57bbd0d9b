//! Poses that clients set for walkers: rendered from the next frame on, by a restarted renderer
//! too, and part of saved states.

use std::f32::consts::PI;

use bus::Role;
use client_lib::{ActorId, Client, Measurement, Pose, SensorBundle, Spawn, bone, wire::camera};
use glam::{Quat, Vec3};
use mesh::WordHash;
use protocol::{BONES, flag, output};
use rustix::process::Signal;

use crate::kit::{Scratch, Sim, eventually, kill, lives};

const WALKER: &str = "walker.pedestrian.0002";

fn skeleton() -> &'static town::Skeleton {
    town::blueprint(WALKER).unwrap().1.skeleton().unwrap()
}

/// A walker, and a camera two metres in front of it.
fn with_walker(client: &mut Client) -> (ActorId, SensorBundle) {
    let place = client.spawn_points().unwrap()[0];
    let walker = client.spawn(Spawn::new(WALKER, place)).unwrap();
    let before = Pose::new(Vec3::new(2.5, 0.0, 1.2), Quat::from_rotation_z(PI));
    let sensors = [camera("before", before, 160, 160, 1.2, output::INSTANCE)];
    (walker, client.create_bundle("before", walker, sensors, 2).unwrap())
}

fn look(client: &mut Client, bundle: &mut SensorBundle) -> Measurement {
    let (_, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    measured.pop().flatten().expect("a measurement of this frame")
}

fn digest(measured: &Measurement) -> WordHash {
    let mut digest = WordHash::new();
    digest.bytes(bytemuck::cast_slice(measured.instances(0).unwrap()));
    digest
}

/// Returns the rows from the top of the image to the walker's highest pixel.
fn top(measured: &Measurement, walker: ActorId) -> usize {
    let seen = measured.instances(0).unwrap().iter().position(|id| *id == walker.0);
    seen.expect("it is in sight") / 160
}

/// Raises the left arm straight up.
fn raised() -> [(u32, Pose); 1] {
    let arm = bone("crl_arm__L").unwrap();
    let at = |bone: usize| skeleton().bones[bone].at_m;
    let parent = skeleton().bones[arm as usize].parent;
    let up = Quat::from_rotation_x(PI);
    [(arm, Pose::new(at(arm as usize) - at(parent), up))]
}

#[test]
fn the_bones_of_the_bus_are_those_of_walkers() {
    for one in town::catalogue().iter().filter_map(town::Blueprint::skeleton) {
        assert!(one.bones.iter().map(|bone| bone.name.as_str()).eq(BONES));
    }
}

#[test]
fn an_arm_is_raised_by_its_weight_and_stays_raised_in_a_restarted_renderer() {
    let scratch = Scratch::new();
    let path = scratch.path().join("state");
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (walker, mut bundle) = with_walker(&mut client);
    look(&mut client, &mut bundle);
    let standing = look(&mut client, &mut bundle);
    let (rest, head) = (digest(&standing), top(&standing, walker));
    drop(standing);

    client.set_bones(walker, &raised()).unwrap();
    let unseen = digest(&look(&mut client, &mut bundle));
    assert_eq!(unseen, rest, "a pose that does not show changes nothing");
    client.blend_pose(walker, 1.0).unwrap();
    let up = look(&mut client, &mut bundle);
    assert!(client.world().state(walker).unwrap().has(flag::POSED));
    assert!(top(&up, walker) + 5 < head, "row {} and {head}", top(&up, walker));
    let up = digest(&up);
    client.blend_pose(walker, 0.5).unwrap();
    let half = digest(&look(&mut client, &mut bundle));
    assert!(half != up && half != rest);
    client.save_state_to(&path).unwrap();

    // The restarted renderer reads it from the standing state.
    let renderer = sim.pid(Role::Render).unwrap();
    kill(renderer, Signal::KILL);
    eventually("its end", || !lives(renderer));
    assert_eq!(digest(&look(&mut client, &mut bundle)), half);

    client.blend_pose(walker, 0.0).unwrap();
    assert_eq!(digest(&look(&mut client, &mut bundle)), rest);
    client.load_state_from(&path).unwrap();
    assert_eq!(digest(&look(&mut client, &mut bundle)), half, "the pose is part of a saved state");
    let (bones, share) = client.given_pose(walker).unwrap();
    let [(arm, given)] = raised();
    assert_eq!((bones.len(), share, bones[arm as usize]), (BONES.len(), 0.5, given));

    let refused = client.set_bones(walker, &[(66, Pose::IDENTITY)]).unwrap_err().to_string();
    assert!(refused.contains("66"), "{refused}");
    drop(bundle);
    client.reload_map().unwrap();
    let (walker, mut bundle) = with_walker(&mut client);
    look(&mut client, &mut bundle);
    assert_eq!(digest(&look(&mut client, &mut bundle)), rest, "a new world knows no poses");
    assert_eq!(client.given_pose(walker).unwrap().1, 0.0);
    drop((bundle, client));
    sim.end();
}
