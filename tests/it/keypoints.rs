//! Keypoints of walkers in a running simulator: where the renderer shows them.

use std::f32::consts::PI;

use client_lib::{
    ActorId, Client, KEYPOINTS, KeypointView, KeypointVisibility, Measurement, Pose, Projection,
    SensorBundle, Spawn, bone,
    wire::{SensorSpec, camera},
};
use glam::{Quat, Vec3};
use protocol::output;

use crate::kit::Sim;

const WALKER: &str = "walker.pedestrian.0002";

/// A camera two and a half metres in front of a walker.
fn before() -> SensorSpec {
    let pose = Pose::new(Vec3::new(2.5, 0.0, 1.2), Quat::from_rotation_z(PI));
    camera("before", pose, 240, 320, 0.9, output::INSTANCE | output::DEPTH)
}

fn look(client: &mut Client, bundle: &mut SensorBundle) -> Measurement {
    let (_, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    measured.pop().flatten().expect("a measurement of this frame")
}

/// Returns the row and the visibility of a keypoint of a walker.
fn row(client: &mut Client, measured: &Measurement, walker: ActorId, name: &str) -> (f32, u8) {
    let found = client.keypoints(walker).unwrap().in_image(&KeypointView {
        projection: &Projection::of(&before()).unwrap(),
        world_from_sensor: measured.world_from_sensor(0).unwrap(),
        size_px: [240, 320],
        instances: measured.instances(0).unwrap(),
        depth: measured.depth(0),
    });
    let one = found[KEYPOINTS.iter().position(|one| *one == name).unwrap()];
    (one.px.y, one.visibility as u8)
}

#[test]
fn keypoints_follow_a_posed_walker_and_are_hidden_by_what_stands_before_it() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    let walker = client.spawn(Spawn::new(WALKER, place)).unwrap();
    let mut bundle = client.create_bundle("before", walker, [before()], 2).unwrap();
    look(&mut client, &mut bundle);
    let standing = look(&mut client, &mut bundle);
    let (hanging, head) = (
        row(&mut client, &standing, walker, "left_wrist"),
        row(&mut client, &standing, walker, "nose"),
    );
    assert!(hanging.0 > head.0 + 50.0, "{hanging:?} {head:?}");
    assert_eq!((hanging.1, head.1), (2, 2));
    drop(standing);

    // Half a turn about the forward axis lifts the arm.
    let skeleton = town::blueprint(WALKER).unwrap().1.skeleton().unwrap();
    let arm = bone("crl_arm__L").unwrap();
    let [at, parent] =
        [arm as usize, skeleton.bones[arm as usize].parent].map(|bone| skeleton.bones[bone].at_m);
    let raised = Pose::new(at - parent, Quat::from_rotation_x(PI));
    client.set_bones(walker, &[(arm, raised)]).unwrap();
    client.blend_pose(walker, 1.0).unwrap();
    let posed = look(&mut client, &mut bundle);
    let lifted = row(&mut client, &posed, walker, "left_wrist");
    assert!(lifted.0 < head.0 && lifted.1 == 2, "{lifted:?} {head:?}");
    // Joints are the bones that the client library places.
    let bones = client.bone_transforms(walker).unwrap();
    let points = client.keypoints(walker).unwrap();
    for (keypoint, bone) in [
        ("left_wrist", "crl_hand__L"),
        ("right_elbow", "crl_foreArm__R"),
        ("left_hip", "crl_thigh__L"),
        ("right_ankle", "crl_foot__R"),
    ] {
        let at = points.in_world[KEYPOINTS.iter().position(|one| *one == keypoint).unwrap()];
        let placed = bones.iter().find(|one| one.name == bone).unwrap();
        assert!(at.distance(placed.world_from_bone.position()) < 1e-4, "{keypoint}");
    }
    drop(posed);

    // A box between camera and walker hides its legs, and not its head.
    let there = client.world().actor(walker).unwrap().pose();
    let ground = there.affine().transform_point3(Vec3::new(1.2, 0.0, 0.0));
    let crate_pose = Pose::new(ground, there.rotation());
    client.spawn(Spawn::new("static.prop.box03", crate_pose).kinematic()).unwrap();
    let hidden = look(&mut client, &mut bundle);
    let occluded = KeypointVisibility::Occluded as u8;
    assert_eq!(row(&mut client, &hidden, walker, "left_ankle").1, occluded);
    assert_eq!(row(&mut client, &hidden, walker, "nose").1, KeypointVisibility::Visible as u8);
    drop((hidden, bundle, client));
    sim.end();
}
