use glam::Vec3;
use protocol::VehicleControl;

use super::{FRAME_NANOS, Lone, SUBSTEP_NANOS};
use crate::physics::{Ground, Physics, StaticBox, SyntheticLoad, VehicleModel};

/// Returns a sedan below a plate that it does not touch but that keeps it in the rigid-body world.
fn below_a_plate(ground: std::sync::Arc<Ground>) -> Lone {
    let model = VehicleModel::sedan();
    let roof_m = model.box_center_m.z + model.box_half_m.z;
    let plate = StaticBox {
        center: Vec3::Z * (roof_m + 0.58),
        half_extents_m: Vec3::new(1000.0, 1000.0, 0.5),
        yaw_rad: 0.0,
    };
    let mut lone = Lone::new(std::sync::Arc::clone(&ground), model.clone());
    let mut physics = Physics::new(ground, &[plate]);
    let pose = protocol::Pose::IDENTITY;
    let id = protocol::ActorId(1);
    physics.spawn_vehicle(id, &std::sync::Arc::new(model), &pose, false).unwrap();
    lone.physics = physics;
    lone
}

#[test]
fn a_solo_car_drives_as_one_in_the_rigid_body_world() {
    let ground = std::sync::Arc::new(Ground::flat(0.0));
    let mut solo = Lone::new(std::sync::Arc::clone(&ground), VehicleModel::sedan());
    let mut near = below_a_plate(ground);
    for frame in 0..300 {
        let control = VehicleControl {
            throttle: if frame < 120 { 0.6 } else { 0.2 },
            brake: if (200..240).contains(&frame) { 0.5 } else { 0.0 },
            steer: 0.2 * (frame as f32 * 0.05).sin(),
            ..solo.control
        };
        (solo.control, near.control) = (control, control);
        solo.frame();
        near.frame();
        assert!(solo.physics.actors[0].solo && !near.physics.actors[0].solo, "{frame}");
        let apart = solo.position().distance(near.position());
        assert!(apart < 0.02, "{apart} m apart in frame {frame}");
        let turned = solo.rotation().angle_between(near.rotation());
        assert!(turned < 2e-3, "{turned} rad in frame {frame}");
    }
    assert!(solo.position().length() > 100.0);
}

#[test]
fn no_bit_depends_on_the_number_of_threads() {
    let hashes = |threads: usize| -> Vec<u64> {
        // Cars so close that many of them touch.
        let mut load = SyntheticLoad::spaced(2100, 7.0);
        load.set_threads(threads);
        let frames = (0..40).map(|frame| {
            load.frame(FRAME_NANOS, SUBSTEP_NANOS);
            if frame == 10 {
                load.make_dormant(700);
            }
            load.physics().hash()
        });
        let hashes = frames.collect();
        let physics = load.physics();
        let solo = physics.actors.iter().filter(|actor| actor.solo).count();
        assert!((300..2000).contains(&solo), "{solo} of 2100 are solo");
        let dormant = physics.actors.iter().filter(|actor| actor.dormant).count();
        assert!(dormant > 200, "{dormant} are dormant");
        hashes
    };
    let one = hashes(1);
    assert_eq!(hashes(2), one);
    assert_eq!(hashes(3), one);
}

#[test]
fn a_saved_state_continues_bit_for_bit_with_solo_cars() {
    let mut load = SyntheticLoad::spaced(60, 8.0);
    (0..20).for_each(|_| load.frame(FRAME_NANOS, SUBSTEP_NANOS));
    let saved = load.physics().save();
    let mut other = SyntheticLoad::spaced(60, 8.0);
    other.restore(&saved, 20);
    for frame in 0..40 {
        load.frame(FRAME_NANOS, SUBSTEP_NANOS);
        other.frame(FRAME_NANOS, SUBSTEP_NANOS);
        assert_eq!(load.physics().hash(), other.physics().hash(), "frame {frame}");
    }
}
