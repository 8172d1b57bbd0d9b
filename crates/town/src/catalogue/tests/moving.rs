//! Parts move as the posture of their actor demands; at rest they match the whole mesh.

use std::f32::consts::PI;

use glam::{Affine3A, Quat, Vec3};

use crate::catalogue::{GivenPose, Kind, Motion, Posture, blueprint, catalogue, stride_m};

/// The vertices of the visible pieces, by the name of their joint.
fn seen(id: &str, posture: &Posture) -> Vec<(&'static str, Vec<Vec3>)> {
    let (_, one) = blueprint(id).unwrap();
    let mut all = Vec::new();
    one.rig().place(posture, |piece, placed| {
        let corners = &one.geometry().pieces[piece].positions;
        let moved = corners.iter().map(|p| placed.transform_point3(Vec3::from_array(*p)));
        all.push((one.rig().joints[piece].name, moved.collect()));
    });
    all
}

fn part(id: &str, name: &str, posture: &Posture) -> Vec<Vec3> {
    seen(id, posture).into_iter().find(|(found, _)| *found == name).expect("a joint").1
}

const MODEL3: &str = "vehicle.tesla.model3";

#[test]
fn the_pieces_at_rest_make_up_the_whole_mesh() {
    for one in catalogue() {
        let (rig, geometry) = (one.rig(), one.geometry());
        assert_eq!(rig.joints.len(), geometry.pieces.len(), "{}", one.id);
        let mut triangles = 0;
        let rest = Posture { stride: 0.3, ..Posture::default() };
        rig.place(&rest, |piece, placed| {
            triangles += geometry.pieces[piece].triangles.len();
            assert!(placed.abs_diff_eq(Affine3A::IDENTITY, 1e-5), "{}: {piece}", one.id);
        });
        assert_eq!(triangles, geometry.whole.triangles.len(), "{}", one.id);
        let has_doors = one.kind == Kind::Vehicle && rig.door_count() > 0;
        let is_driven = has_doors || one.base_type == "bus";
        assert_eq!(is_driven, !geometry.occupants.triangles.is_empty(), "{}", one.id);
        for (piece, joint) in geometry.pieces.iter().zip(&rig.joints) {
            assert!(!piece.triangles.is_empty(), "{}: {} is empty", one.id, joint.name);
        }
    }
}

#[test]
fn every_wheel_is_a_part_that_turns_about_its_hub() {
    for one in catalogue().iter().filter(|one| one.kind == Kind::Vehicle) {
        for (wheel, joint) in one.wheels.iter().zip(&one.rig().joints[1..]) {
            assert!(joint.name.starts_with("wheel_"), "{}: {}", one.id, joint.name);
            assert_eq!(joint.pivot_m(), wheel.position_m, "{}", one.id);
        }
    }
}

/// The index of the vertex that lies furthest along an axis.
fn furthest(corners: &[Vec3], axis: usize) -> usize {
    let by = |a: &usize, b: &usize| corners[*a][axis].total_cmp(&corners[*b][axis]);
    (0..corners.len()).max_by(by).unwrap()
}

#[test]
fn wheels_roll_forwards_and_steer_to_the_left() {
    let rest = part(MODEL3, "wheel_rl", &Posture::default());
    let rolled = part(MODEL3, "wheel_rl", &Posture { spin_rad: 0.1, ..Posture::default() });
    let top = furthest(&rest, 2);
    assert!(rolled[top].x > rest[top].x + 0.02);
    let steered = Posture { steer_rad: 0.3, ..Posture::default() };
    let rest = part(MODEL3, "wheel_fl", &Posture::default());
    let turned = part(MODEL3, "wheel_fl", &steered);
    let front = furthest(&rest, 0);
    assert!(turned[front].y > rest[front].y + 0.05);
    assert_eq!(part(MODEL3, "wheel_rl", &steered), part(MODEL3, "wheel_rl", &Posture::default()));
}

#[test]
fn an_open_door_swings_outwards_and_the_others_stay_shut() {
    let reach = |name: &str, posture: &Posture| {
        part(MODEL3, name, posture).iter().map(|p| p.y.abs()).fold(0.0f32, f32::max)
    };
    for (bit, name) in ["door_fl", "door_fr", "door_rl", "door_rr"].into_iter().enumerate() {
        let one = Posture { doors: 1 << bit, ..Posture::default() };
        let other = Posture { doors: 1 << (3 - bit), ..Posture::default() };
        assert!(reach(name, &one) > reach(name, &other) + 0.4, "{name}");
        let side = if bit % 2 == 0 { 1.0 } else { -1.0 };
        assert!(part(MODEL3, name, &one).iter().all(|p| p.y * side > 0.0), "{name}");
    }
    let names: Vec<_> = seen(MODEL3, &Posture::default()).iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["body", "wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"]);
}

#[test]
fn a_walker_has_carlas_bones() {
    let (_, one) = blueprint("walker.pedestrian.0001").unwrap();
    let bones = &one.skeleton().unwrap().bones;
    assert_eq!(bones.len(), 66);
    for name in [
        "crl_root",
        "crl_hips__C",
        "crl_spine01__C",
        "crl_foreArm__R",
        "crl_Head__C",
        "crl_toeEnd__L",
        "crl_handThumb02__L",
        "crl_handPinkyEnd__R",
    ] {
        assert!(bones.iter().any(|bone| bone.name == name), "{name}");
    }
    assert!(bones.iter().enumerate().all(|(index, bone)| bone.parent <= index));
}

#[test]
fn a_step_covers_as_much_ground_as_its_length() {
    for id in ["walker.pedestrian.0004", "walker.pedestrian.0013"] {
        let (_, one) = blueprint(id).unwrap();
        let (skeleton, height) = (one.skeleton().unwrap(), 2.0 * one.half_extents_m.z);
        let foot = skeleton.bones.iter().position(|bone| bone.name == "crl_foot__L").unwrap();
        let rest = skeleton.bones[foot].at_m.z;
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for step in 0..40 {
            let posture =
                Posture { stride: step as f32 / 40.0, speed_mps: 1.4, ..Posture::default() };
            let at = skeleton.actor_from_bones(&posture)[foot].translation;
            (low, high) = (low.min(at.x), high.max(at.x));
            assert!(at.z > rest - 1e-3, "{id}: a foot is in the ground at step {step}");
        }
        let half_stride = stride_m(height, 1.4) * 0.5;
        let off = (high - low) / half_stride;
        assert!((0.75..1.25).contains(&off), "{id}: {} m for {half_stride} m", high - low);
    }
}

#[test]
fn a_cyclists_feet_stay_on_the_pedals() {
    for id in ["vehicle.bh.crossbike", "vehicle.diamondback.century", "vehicle.gazelle.omafiets"] {
        let (_, one) = blueprint(id).unwrap();
        let axle = one.rig().joints[4].pivot_m();
        for step in 0..12 {
            let spin_rad = step as f32 * std::f32::consts::FRAC_PI_6;
            let shoe = part(id, "shin_l", &Posture { spin_rad, ..Posture::default() });
            let sole =
                shoe.iter().fold(Vec3::splat(9.0), |low, p| if p.z < low.z { *p } else { low });
            let turn = Affine3A::from_rotation_y(spin_rad);
            let pedal = axle + turn.transform_vector3(Vec3::new(0.15, 0.0, -0.06));
            let off = Vec3::new(sole.x - pedal.x, 0.0, sole.z - pedal.z).length();
            assert!(off < 0.16, "{id}: {off} m off at {spin_rad}");
        }
    }
}

#[test]
fn a_given_pose_is_blended_by_its_weight_and_the_pieces_follow_the_bones() {
    let (_, one) = blueprint("walker.pedestrian.0002").unwrap();
    let skeleton = one.skeleton().unwrap();
    let number = |name: &str| skeleton.bones.iter().position(|bone| bone.name == name).unwrap();
    let (arm, hand) = (number("crl_arm__L"), number("crl_hand__L"));
    let walk = Posture { stride: 0.2, speed_mps: 1.4, ..Posture::default() };
    let shoulder = skeleton.bones[skeleton.bones[arm].parent].at_m;
    // Straight up. The origin of the bone comes with the pose.
    let mut bones = vec![None; arm + 1];
    let up = Quat::from_rotation_x(PI);
    bones[arm] = Some((skeleton.bones[arm].at_m - shoulder + Vec3::Z * 0.01, up));
    let with = |weight: f32| Posture { given: Some(GivenPose { weight, bones: &bones }), ..walk };
    let placed = |posture: &Posture| skeleton.actor_from_bones(posture);

    for (a, b) in placed(&walk).iter().zip(placed(&with(0.0))) {
        assert!(a.abs_diff_eq(b, 1e-5), "{a} {b}");
    }
    let given = placed(&with(1.0));
    assert!(given[hand].translation.z > given[arm].translation.z + 0.4, "{}", given[hand]);
    let thigh = number("crl_thigh__L");
    let at_rest = Affine3A::from_translation(skeleton.bones[thigh].at_m);
    assert!(given[thigh].abs_diff_eq(at_rest, 1e-5), "a bone that was not set is at rest");
    let half = placed(&with(0.5));
    let lift = |pose: &[Affine3A]| pose[hand].translation.z - pose[arm].translation.z;
    assert!(lift(&placed(&walk)) < -0.4 && lift(&half).abs() < 0.3, "{}", lift(&half));

    // Transforms relative to the parents give the same pose again.
    let told: Vec<_> = skeleton.parent_from_bones(&walk).into_iter().map(Some).collect();
    let still =
        Posture { given: Some(GivenPose { weight: 1.0, bones: &told }), ..Posture::default() };
    for (a, b) in placed(&walk).iter().zip(placed(&still)) {
        assert!(a.abs_diff_eq(b, 1e-4), "{a} {b}");
    }
    let rig = one.rig();
    rig.place(&with(1.0), |piece, placed| {
        let Motion::Bone(bone) = rig.joints[piece].motion else { panic!("a piece without a bone") };
        let begins = placed.transform_point3a(skeleton.bones[bone].at_m.into());
        assert!(begins.abs_diff_eq(given[bone].translation, 1e-5), "{piece}");
    });
}
