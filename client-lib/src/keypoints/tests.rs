use std::f32::consts::FRAC_PI_2;

use glam::Quat;
use protocol::{BONES, LensSpec, lens_model};

use super::*;
use crate::bone;

const WALKER: &str = "walker.pedestrian.0002";

fn index(name: &str) -> usize {
    KEYPOINTS.iter().position(|one| *one == name).unwrap()
}

fn state(pose: Pose) -> ActorState {
    ActorState { actor_id: ActorId(7), kind: kind::WALKER, pose, ..ActorState::default() }
}

fn of(id: &str, pose: Pose, given: Option<(Vec<Pose>, f32)>) -> Keypoints {
    keypoints(town::blueprint(id).unwrap().1, &state(pose), None, given).unwrap()
}

#[test]
fn joints_are_the_bones_of_their_names() {
    let joint = |name: &str, side: &str| {
        let bone_of = match name {
            "shoulder" => "arm",
            "elbow" => "foreArm",
            "wrist" => "hand",
            "hip" => "thigh",
            "knee" => "leg",
            _ => "foot",
        };
        bone(&format!("crl_{bone_of}__{side}")).unwrap() as usize
    };
    assert_eq!(BONES[HEAD], "crl_Head__C");
    for (name, (place, _)) in KEYPOINTS.iter().zip(PLACES) {
        let (side, part) = name.split_once('_').unwrap_or(("", name));
        match place {
            Joint(bone) => {
                assert_eq!(bone, joint(part, if side == "left" { "L" } else { "R" }), "{name}");
            }
            Head([_, left, _]) => {
                let expected = ["right", "", "left"].iter().position(|one| *one == side).unwrap();
                assert_eq!(left.partial_cmp(&0.0), Some((expected as i8 - 1).cmp(&0)), "{name}");
            }
        }
    }
}

/// A corner of the mesh lies within 12 mm of each point on a head; hats push three heads down.
#[test]
fn nose_eyes_and_ears_lie_on_the_mesh_of_every_head() {
    let walkers = town::catalogue().iter().filter(|one| one.skeleton().is_some());
    let (mut count, mut close) = (0, 0);
    for blueprint in walkers {
        let mesh = blueprint.mesh();
        let points = of(blueprint.id, Pose::IDENTITY, None);
        for (name, point) in KEYPOINTS.iter().zip(points.in_world).take(5) {
            let near = mesh.positions.iter().map(|at| point.distance(Vec3::from_array(*at)));
            let near = near.fold(f32::INFINITY, f32::min);
            assert!(near < 0.026, "{}: {name} is {near} m from the mesh", blueprint.id);
            close += u32::from(near < 0.012);
        }
        count += 1;
    }
    assert_eq!(count, 49);
    assert!(close >= 46 * 5, "{close}");
}

#[test]
fn a_standing_walker_has_its_keypoints_at_known_heights_and_sides() {
    // It stands at (10, 20) and looks along y; its left is −x.
    let pose = Pose::level(Vec3::new(10.0, 20.0, 3.0), FRAC_PI_2);
    let points = of(WALKER, pose, None);
    let height = 1.82;
    let at = |name: &str| points.in_world[index(name)] - Vec3::new(10.0, 20.0, 3.0);
    for (name, share) in [
        ("left_shoulder", 0.808),
        ("left_elbow", 0.635),
        ("left_wrist", 0.487),
        ("left_hip", 0.510),
        ("left_knee", 0.285),
        ("left_ankle", 0.045),
    ] {
        let left = at(name);
        let right = at(&name.replace("left", "right"));
        assert!((left.z - share * height).abs() < 1e-4, "{name}: {left}");
        assert!(left.x < -0.05 && (left.x + right.x).abs() < 1e-4, "{name}: {left} {right}");
        assert!((left - right).truncate().y.abs() < 1e-4, "{name}: {left} {right}");
    }
    // The eyes are above the nose, the ears behind both; the head ends at the height of the walker.
    let (nose, eye, ear) = (at("nose"), at("left_eye"), at("left_ear"));
    assert!(nose.y > eye.y && eye.y > ear.y && eye.z > nose.z, "{nose} {eye} {ear}");
    assert!((height - eye.z - 0.0626 * height * 0.97).abs() < 0.01 * height, "{eye}");
}

#[test]
fn a_raised_arm_lifts_elbow_and_wrist_and_nothing_else() {
    let blueprint = town::blueprint(WALKER).unwrap().1;
    let skeleton = blueprint.skeleton().unwrap();
    let rest: Vec<Pose> = skeleton
        .bones
        .iter()
        .enumerate()
        .map(|(index, bone)| {
            let begins =
                if index == bone.parent { Vec3::ZERO } else { skeleton.bones[bone.parent].at_m };
            Pose::new(bone.at_m - begins, Quat::IDENTITY)
        })
        .collect();
    let arm = bone("crl_arm__L").unwrap() as usize;
    let mut raised = rest.clone();
    // Half a turn about the forward axis points the hanging arm upwards.
    raised[arm] = Pose::new(rest[arm].position(), Quat::from_rotation_x(std::f32::consts::PI));
    let (before, after) =
        (of(WALKER, Pose::IDENTITY, None), of(WALKER, Pose::IDENTITY, Some((raised, 1.0))));
    for (name, (before, after)) in KEYPOINTS.iter().zip(before.in_world.iter().zip(after.in_world))
    {
        let shoulder = skeleton.bones[arm].at_m;
        if ["left_elbow", "left_wrist"].contains(name) {
            let hangs = *before - shoulder;
            let expected = shoulder + Vec3::new(hangs.x, -hangs.y, -hangs.z);
            assert!(after.distance(expected) < 1e-4, "{name}: {after} {expected}");
        } else {
            assert!(after.distance(*before) < 1e-4, "{name} moved");
        }
    }
}

#[test]
fn an_actor_without_a_skeleton_has_no_keypoints() {
    for id in ["vehicle.tesla.model3", "vehicle.bh.crossbike"] {
        let blueprint = town::blueprint(id).unwrap().1;
        assert!(keypoints(blueprint, &state(Pose::IDENTITY), None, None).is_none(), "{id}");
    }
}

/// A camera of 200 × 100 pixels at the origin that looks along x.
fn projection(model: u32) -> Projection {
    let lens = LensSpec {
        model,
        focal_px: [60.0; 2],
        center_px: [100.0, 50.0],
        max_angle_rad: if model == lens_model::FISHEYE { 1.658 } else { 0.0 },
        ..LensSpec::default()
    };
    Projection::new(&lens, [200, 100], 0.0).unwrap()
}

/// Looks at a walker ahead that turns its back to the camera; all pixels show `id` at `depth_m`.
fn seen(model: u32, distance_m: f32, id: u32, depth_m: f32) -> [ImageKeypoint; KEYPOINT_COUNT] {
    let pose = Pose::level(Vec3::new(distance_m, 0.0, -1.0), 0.0);
    let view = KeypointView {
        projection: &projection(model),
        world_from_sensor: Pose::IDENTITY,
        size_px: [200, 100],
        instances: &[id; 20_000],
        depth: Some(&[depth_m; 20_000]),
    };
    of(WALKER, pose, None).in_image(&view)
}

#[test]
fn keypoints_are_projected_through_the_lens() {
    let ankle = index("left_ankle");
    for model in [lens_model::PINHOLE, lens_model::FISHEYE] {
        let found = seen(model, 4.0, 7, 4.0)[ankle];
        let [x, y, z] = found.in_sensor.to_array();
        assert!(y > 0.05 && z < -0.9, "left and below: {found:?}");
        // Column and row of a pinhole, and of a fisheye whose radius is the angle.
        let from_axis = y.hypot(z);
        let scale = match model {
            lens_model::PINHOLE => 60.0 / x,
            _ => 60.0 * from_axis.atan2(x) / from_axis,
        };
        let expected = Vec2::new(100.0 - y * scale, 50.0 - z * scale);
        assert!(found.px.distance(expected) < 1e-3, "{found:?} {expected}");
        assert_eq!(found.visibility, KeypointVisibility::Visible);
    }
}

#[test]
fn what_a_wall_hides_is_occluded_and_what_is_beside_the_image_is_outside() {
    use KeypointVisibility::{Occluded, Outside, Visible};
    let all = |found: [ImageKeypoint; KEYPOINT_COUNT]| found.map(|one| one.visibility);
    let pinhole = lens_model::PINHOLE;
    assert_eq!(all(seen(pinhole, 4.0, 7, 4.2)), [Visible; KEYPOINT_COUNT]);
    // From behind, the back of the head hides the face, and no more.
    let mut from_behind = [Visible; KEYPOINT_COUNT];
    from_behind[..3].fill(Occluded);
    assert_eq!(all(seen(pinhole, 4.0, 7, 3.97)), from_behind);
    assert_eq!(all(seen(pinhole, 4.0, 0x8000_0003, 2.0)), [Occluded; KEYPOINT_COUNT]);
    let behind = seen(pinhole, -4.0, 7, 4.0);
    assert_eq!(all(behind), [Outside; KEYPOINT_COUNT]);
    assert!(behind.iter().all(|one| one.px == Vec2::ZERO));
    // At half a metre the ankles are below the image.
    let near = all(seen(pinhole, 0.5, 7, 0.5));
    assert_eq!((near[index("left_ankle")], near[index("left_wrist")]), (Outside, Visible));
    // The body's own surface, further in front of a joint than its radius, hides it.
    let turned = all(seen(pinhole, 4.0, 7, 3.88));
    assert_eq!((turned[index("left_hip")], turned[index("left_wrist")]), (Visible, Occluded));
}
