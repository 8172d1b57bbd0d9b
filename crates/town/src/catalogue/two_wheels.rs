//! Motorcycles and bicycles, each with its rider.

use glam::{Quat, Vec2, Vec3, vec2, vec3};
use mesh::{Material, Tag};

use crate::{
    catalogue::{
        blueprint::Wheel,
        profile::Measure,
        rig::{Joint, Motion, PedalLeg, Rig},
        wheel,
    },
    mesh_builder::MeshBuilder,
};

/// The geometry of a two-wheeler: points in the vehicle's middle plane, (x, z) in metres.
#[derive(Debug)]
pub(super) struct Bike {
    seat: (f32, f32),
    grip: (f32, f32),
    foot: (f32, f32),
    tyre_m: f32,
    frame: Frame,
    helmet: bool,
}

#[derive(Debug)]
enum Frame {
    /// A tubular frame; the flag selects a straight top tube.
    Tubes(bool),
    /// A fairing with tank and exhaust.
    Fairing,
    /// A leg shield, a footboard and wide flanks.
    Scooter,
}

#[rustfmt::skip]
pub(super) const CROSS: Bike = Bike { seat: (-0.20, 0.92), grip: (0.36, 1.02), foot: (0.0, 0.28), tyre_m: 0.055, frame: Frame::Tubes(true), helmet: true };
#[rustfmt::skip]
pub(super) const RACER: Bike = Bike { seat: (-0.22, 0.96), grip: (0.42, 0.93), foot: (0.0, 0.27), tyre_m: 0.028, frame: Frame::Tubes(true), helmet: true };
#[rustfmt::skip]
pub(super) const ROADSTER: Bike = Bike { seat: (-0.30, 0.94), grip: (0.24, 1.12), foot: (0.02, 0.29), tyre_m: 0.042, frame: Frame::Tubes(false), helmet: false };
#[rustfmt::skip]
pub(super) const SPORT: Bike = Bike { seat: (-0.28, 0.83), grip: (0.40, 0.90), foot: (-0.30, 0.38), tyre_m: 0.150, frame: Frame::Fairing, helmet: true };
#[rustfmt::skip]
pub(super) const CRUISER: Bike = Bike { seat: (-0.36, 0.70), grip: (0.22, 1.02), foot: (0.34, 0.36), tyre_m: 0.150, frame: Frame::Fairing, helmet: true };
#[rustfmt::skip]
pub(super) const SCOOTER: Bike = Bike { seat: (-0.30, 0.78), grip: (0.36, 1.02), foot: (0.24, 0.30), tyre_m: 0.110, frame: Frame::Scooter, helmet: true };

/// The joint of handlebar and fork, after the body and both wheels.
const FORK: u32 = 3;
/// The joint of the pedals; thigh and shin follow, left then right.
const CRANK: u32 = 4;
/// The lengths of a rider's thigh and shin. Metres.
const LEG_M: Vec2 = vec2(0.44, 0.43);
/// The arm of the crank at zero wheel rotation: forward and down on the left.
const ARM_M: Vec2 = vec2(0.15, -0.06);

impl Bike {
    fn is_pedalled(&self) -> bool {
        matches!(self.frame, Frame::Tubes(_))
    }

    fn crank(&self, front: &Wheel) -> Vec3 {
        vec3(self.foot.0 - 0.02, 0.0, front.radius_m - 0.05)
    }

    /// The geometry on one side; left is 1, right −1.
    fn leg(&self, front: &Wheel, side: f32) -> PedalLeg {
        let axle = self.crank(front);
        PedalLeg {
            hip_m: vec2(self.seat.0 + 0.02, self.seat.1 + 0.06),
            axle_m: vec2(axle.x, axle.z),
            arm_m: ARM_M * side,
            ankle_m: vec2(-0.05, 0.075),
            lengths_m: LEG_M,
        }
    }

    /// The steering axis: the line from the front hub to the grips.
    fn steering(&self, front: &Wheel) -> Vec3 {
        (vec3(self.grip.0, 0.0, self.grip.1) - front.position_m).normalize_or(Vec3::Z)
    }
}

/// The joints: body, wheels, fork, and the pedalling legs.
pub(super) fn rig(bike: &Bike, measure: &Measure) -> Rig {
    let (front, rear) = (&measure.wheels[0], &measure.wheels[1]);
    let axis = bike.steering(front);
    let joint = |name, motion| Joint { name, motion };
    let mut joints = vec![
        joint("body", Motion::Still),
        joint("wheel_f", Motion::Wheel { hub_m: front.position_m, steers_about: axis }),
        joint("wheel_r", Motion::Wheel { hub_m: rear.position_m, steers_about: Vec3::ZERO }),
        joint("fork", Motion::Steer { pivot_m: front.position_m, axis }),
    ];
    if bike.is_pedalled() {
        joints.push(joint("crank", Motion::Crank { axle_m: bike.crank(front) }));
        for (side, thigh, shin) in [(1.0, "thigh_l", "shin_l"), (-1.0, "thigh_r", "shin_r")] {
            let leg = bike.leg(front, side);
            joints.push(joint(thigh, Motion::Leg { leg, is_shin: false }));
            joints.push(joint(shin, Motion::Leg { leg, is_shin: true }));
        }
    }
    Rig { joints, skeleton: None }
}

/// The front and the rear wheel.
pub(super) fn wheels(bike: &Bike, wheelbase: f32, radius: f32) -> Vec<Wheel> {
    let one = |x: f32, front: bool| Wheel {
        position_m: vec3(x, 0.0, radius),
        radius_m: radius,
        width_m: bike.tyre_m,
        steered: front,
        driven: !front,
    };
    vec![one(wheelbase * 0.5, true), one(-wheelbase * 0.5, false)]
}

/// Builds wheels, frame and rider.
pub(super) fn body(builder: &mut MeshBuilder, bike: &Bike, measure: &Measure) {
    let (front, rear) = (measure.wheels[0], measure.wheels[1]);
    let tag = if matches!(bike.frame, Frame::Tubes(_)) { Tag::Bicycle } else { Tag::Motorcycle };
    builder.paint(tag, Material::Rubber);
    for (one, joint) in [(&front, 1), (&rear, 2)] {
        builder.object(joint);
        wheel::spoked_wheel(builder, one, 24, if tag == Tag::Bicycle { 14 } else { 6 });
    }
    builder.object(0);
    match bike.frame {
        Frame::Tubes(straight) => tubes(builder, bike, &front, &rear, straight),
        Frame::Fairing => fairing(builder, bike, &front, &rear, measure),
        Frame::Scooter => scooter(builder, bike, &front, &rear, measure),
    }
    builder.object(FORK);
    handlebar(builder, bike, measure.size_m.y * 0.5);
    builder.object(0);
    rider(builder, bike, measure);
}

fn handlebar(builder: &mut MeshBuilder, bike: &Bike, half_width: f32) {
    let grip = vec3(bike.grip.0, 0.0, bike.grip.1);
    builder.material(Material::Metal);
    for side in [1.0f32, -1.0] {
        let end = grip + vec3(-0.06, side * half_width, 0.0);
        builder.rod(grip + vec3(0.02, 0.0, -0.02), end - Vec3::Y * side * 0.12, 0.013, 6);
        builder.material(Material::Rubber);
        // A rod extends beyond its axis only sideways, so the end is exact.
        builder.rod(end - Vec3::Y * side * 0.13, end, 0.018, 6);
        builder.material(Material::Metal);
    }
}

fn tubes(builder: &mut MeshBuilder, bike: &Bike, front: &Wheel, rear: &Wheel, straight: bool) {
    let seat = vec3(bike.seat.0, 0.0, bike.seat.1 - 0.06);
    let crank = bike.crank(front);
    let grip = vec3(bike.grip.0, 0.0, bike.grip.1);
    let axis = (front.position_m - grip).normalize_or_zero();
    let (head, fork) = (grip + axis * 0.12, grip + axis * 0.26);
    let joint = crank + (seat - crank) * if straight { 0.82 } else { 0.45 };
    builder.material(Material::CarPaint);
    builder.rod(head, joint, 0.020, 7);
    builder.rod(fork, crank, 0.022, 7);
    builder.rod(crank, seat, 0.018, 7);
    for side in [1.0f32, -1.0] {
        let out = Vec3::Y * side * 0.055;
        builder.rod(crank + out * 0.6, rear.position_m + out, 0.010, 5);
        builder.rod(joint + out * 0.4, rear.position_m + out, 0.009, 5);
        builder.object(FORK);
        builder.rod(fork + out * 0.8, front.position_m + out, 0.013, 6);
        builder.object(0);
    }
    builder.object(FORK).material(Material::Metal);
    builder.rod(grip, fork, 0.017, 6);
    builder.object(CRANK);
    builder.rod(crank - Vec3::Y * 0.05, crank + Vec3::Y * 0.06, 0.085, 12);
    for side in [1.0f32, -1.0] {
        let pedal = crank + vec3(ARM_M.x * side, 0.12 * side, ARM_M.y * side);
        builder.rod(crank + Vec3::Y * 0.07 * side, pedal, 0.011, 5);
        builder.block(pedal - vec3(0.045, 0.05, 0.01), pedal + vec3(0.045, 0.05, 0.01));
    }
    builder.object(0).material(Material::Plastic);
    let saddle = vec3(bike.seat.0, 0.0, bike.seat.1 - 0.03);
    builder.ball(saddle, vec3(0.14, 0.075, 0.035), 4, 8);
    builder.material(Material::LampRed);
    builder.block(seat + vec3(-0.10, -0.02, -0.09), seat + vec3(-0.06, 0.02, -0.05));
    builder.material(Material::LampWhite);
    builder.block(head + vec3(0.03, -0.03, 0.0), head + vec3(0.08, 0.03, 0.06));
    if !straight {
        // A rack and a mudguard, as on a city bicycle.
        builder.material(Material::Metal);
        let top = rear.position_m + vec3(0.0, 0.0, rear.radius_m + 0.06);
        builder.block(top - vec3(0.20, 0.07, 0.01), top + vec3(0.16, 0.07, 0.01));
    }
}

fn fairing(builder: &mut MeshBuilder, bike: &Bike, front: &Wheel, rear: &Wheel, measure: &Measure) {
    let grip = vec3(bike.grip.0, 0.0, bike.grip.1);
    // Outlines of the trunk from tail to nose: x, lower edge, upper edge, half width.
    let trunk = [
        (-0.48 * measure.size_m.x, 0.86, 0.90, 0.03),
        (-0.36 * measure.size_m.x, 0.76, 0.88, 0.11),
        (bike.seat.0, 0.60, bike.seat.1 - 0.03, 0.14),
        (-0.02, 0.36, bike.seat.1 + 0.08, 0.17),
        (0.16, 0.30, bike.seat.1 + 0.13, 0.20),
        (0.34, 0.38, 0.90, 0.22),
        (0.50, 0.58, 0.93, 0.20),
        (0.60, 0.70, 0.86, 0.08),
    ];
    hull(builder, &trunk, Material::CarPaint);
    builder.material(Material::Plastic);
    builder.ball(vec3(bike.seat.0 - 0.05, 0.0, bike.seat.1 - 0.03), vec3(0.26, 0.13, 0.05), 4, 8);
    builder.material(Material::Glass);
    builder.quad([
        vec3(0.56, 0.14, 0.90),
        vec3(0.40, 0.16, 1.10),
        vec3(0.40, -0.16, 1.10),
        vec3(0.56, -0.14, 0.90),
    ]);
    builder.quad([
        vec3(0.56, -0.14, 0.895),
        vec3(0.40, -0.16, 1.095),
        vec3(0.40, 0.16, 1.095),
        vec3(0.56, 0.14, 0.895),
    ]);
    lamps(builder, vec3(0.57, 0.0, 0.80), vec3(-0.47 * measure.size_m.x, 0.0, 0.87), 0.07);
    builder.material(Material::Metal);
    for side in [1.0f32, -1.0] {
        let out = Vec3::Y * side * 0.09;
        builder.object(FORK);
        builder.rod(grip + out, front.position_m + out, 0.028, 7);
        builder.object(0);
        builder.block(
            rear.position_m + vec3(-0.05, side * 0.10 - 0.02, -0.04),
            rear.position_m + vec3(0.60, side * 0.10 + 0.02, 0.06),
        );
    }
    builder.rod(vec3(0.1, -0.17, 0.32), vec3(-0.62, -0.20, 0.52), 0.055, 9);
    builder.material(Material::CarPaint);
    mudguard(builder, front, 0.09);
}

fn scooter(builder: &mut MeshBuilder, bike: &Bike, front: &Wheel, rear: &Wheel, measure: &Measure) {
    let tail = -measure.size_m.x * 0.5;
    let trunk = [
        (tail, 0.52, 0.66, 0.08),
        (tail + 0.10, 0.34, 0.72, 0.19),
        (rear.position_m.x + 0.12, 0.28, 0.74, 0.23),
        (bike.seat.0 + 0.22, 0.26, 0.72, 0.17),
        (bike.seat.0 + 0.30, 0.24, 0.40, 0.15),
        (0.22, 0.22, 0.30, 0.17),
        (0.30, 0.22, 0.46, 0.22),
        (0.40, 0.34, 0.88, 0.21),
        (0.46, 0.52, 0.94, 0.07),
    ];
    hull(builder, &trunk, Material::CarPaint);
    builder.material(Material::Plastic);
    builder.ball(vec3(bike.seat.0 - 0.02, 0.0, bike.seat.1 - 0.03), vec3(0.36, 0.14, 0.07), 4, 8);
    builder.material(Material::CarPaint);
    builder.ball(vec3(bike.grip.0 + 0.05, 0.0, bike.grip.1 - 0.02), vec3(0.11, 0.14, 0.08), 5, 8);
    mudguard(builder, front, 0.10);
    // The tip of the mudguard completes the full length.
    let nose = measure.size_m.x * 0.5;
    builder.block(vec3(nose - 0.16, -0.03, 0.40), vec3(nose, 0.03, 0.46));
    lamps(builder, vec3(bike.grip.0 + 0.15, 0.0, bike.grip.1), vec3(tail + 0.01, 0.0, 0.60), 0.06);
    builder.material(Material::Metal);
    builder.rod(
        vec3(bike.grip.0, 0.0, bike.grip.1 - 0.05),
        front.position_m + Vec3::Y * 0.08,
        0.028,
        7,
    );
}

/// A closed solid over outlines (x, lower, upper, half width), tail first.
fn hull(builder: &mut MeshBuilder, outlines: &[(f32, f32, f32, f32)], material: Material) {
    let rings: Vec<Vec<Vec3>> = outlines
        .iter()
        .map(|(x, low, high, half)| {
            let span = high - low;
            vec![
                vec3(*x, half * 0.45, *low),
                vec3(*x, *half, low + span * 0.35),
                vec3(*x, half * 0.95, low + span * 0.70),
                vec3(*x, half * 0.55, *high),
                vec3(*x, -half * 0.55, *high),
                vec3(*x, -half * 0.95, low + span * 0.70),
                vec3(*x, -half, low + span * 0.35),
                vec3(*x, -half * 0.45, *low),
            ]
        })
        .collect();
    builder.material(material);
    builder.loft(&rings, |_, _| None);
}

fn mudguard(builder: &mut MeshBuilder, wheel: &Wheel, half: f32) {
    let reach = wheel.radius_m + 0.03;
    let at = |step: u32, side: f32| {
        let angle = 0.5 + 0.42 * step as f32;
        wheel.position_m + vec3(angle.cos() * reach, side * half, angle.sin() * reach)
    };
    for step in 0..5 {
        builder.quad([at(step, -1.0), at(step, 1.0), at(step + 1, 1.0), at(step + 1, -1.0)]);
    }
}

fn lamps(builder: &mut MeshBuilder, head: Vec3, tail: Vec3, size: f32) {
    builder.material(Material::LampWhite);
    builder.ball(head, vec3(0.04, size * 1.4, size), 4, 8);
    builder.material(Material::LampRed);
    builder.block(tail - vec3(0.0, size, size * 0.5), tail + vec3(0.05, size, size * 0.5));
    for (side, indicator) in [(1.0f32, Material::IndicatorLeft), (-1.0, Material::IndicatorRight)] {
        builder.material(indicator);
        for (lamp, back) in [(head, -0.12), (tail, 0.08)] {
            builder.ball(lamp + vec3(back, side * (size + 0.12), -0.02), Vec3::splat(0.025), 3, 6);
        }
    }
}

fn rider(builder: &mut MeshBuilder, bike: &Bike, measure: &Measure) {
    builder.paint(Tag::Rider, Material::Cloth);
    let hip = vec3(bike.seat.0 + 0.02, 0.0, bike.seat.1 + 0.06);
    let grip = vec3(bike.grip.0 - 0.06, 0.0, bike.grip.1 + 0.02);
    let top = measure.size_m.z;
    let head = 0.125;
    // The nearer and lower the grips, the further the rider leans.
    let lean = ((top - grip.z) * 0.18 + (grip.x - hip.x) * 0.42).clamp(0.10, 0.38);
    let shoulder = vec3(hip.x + lean, 0.0, top - 2.0 * head - 0.07);
    builder.material(Material::CarPaint);
    torso(builder, hip, shoulder, 0.17, 0.21);
    let reach = measure.size_m.y * 0.5 - 0.07;
    for side in [1.0f32, -1.0] {
        let y = Vec3::Y * side;
        let hand = grip + y * reach;
        builder.tinted(Material::Cloth, [48, 54, 70]);
        let (knee, foot) = if bike.is_pedalled() {
            let (knee, ankle) = bike.leg(&measure.wheels[0], side).knee(0.0);
            (vec3(knee.x, side * 0.13, knee.y), vec3(ankle.x, side * 0.12, ankle.y))
        } else {
            let foot = vec3(bike.foot.0, side * 0.15, bike.foot.1);
            let lift = vec3(0.24, side * 0.08, 0.12);
            ((hip + foot) * 0.5 + lift, foot)
        };
        let thigh = if bike.is_pedalled() { CRANK + if side > 0.0 { 1 } else { 3 } } else { 0 };
        let shin = if thigh > 0 { thigh + 1 } else { 0 };
        builder.object(thigh);
        builder.ball(hip + y * 0.09, Vec3::splat(0.085), 5, 9);
        builder.cone(hip + y * 0.09, knee, [0.085, 0.062], 10);
        builder.object(shin);
        builder.ball(knee, Vec3::splat(0.062), 5, 9);
        builder.cone(knee, foot, [0.062, 0.045], 10);
        builder.material(Material::Rubber);
        builder.ball(foot + vec3(0.06, 0.0, -0.045), vec3(0.13, 0.045, 0.045), 5, 8);
        builder.object(0).material(Material::CarPaint);
        limb(
            builder,
            &[shoulder + y * 0.18, (shoulder + hand) * 0.5 + y * 0.06 - Vec3::Z * 0.10, hand],
            &[0.058, 0.046, 0.036],
        );
        builder.tinted(Material::Skin, [206, 158, 124]);
        builder.ball(hand, Vec3::splat(0.045), 4, 6);
    }
    let center = vec3(shoulder.x + 0.06, 0.0, top - head);
    builder.material(Material::Skin);
    builder.rod(shoulder, center, 0.055, 7);
    if bike.helmet {
        builder.ball(center, vec3(0.135, 0.115, head), 7, 10);
        builder.material(Material::Plastic);
        builder.ball(center + vec3(-0.012, 0.0, 0.022), vec3(0.145, 0.125, head - 0.022), 7, 10);
    } else {
        builder.ball(center, vec3(0.105, 0.085, head), 7, 10);
        builder.material(Material::Cloth);
        builder.ball(center + vec3(-0.02, 0.0, 0.03), vec3(0.10, 0.09, head - 0.03), 6, 10);
    }
    builder.paint(Tag::Motorcycle, Material::CarPaint);
}

/// A trunk from hips to shoulders.
fn torso(builder: &mut MeshBuilder, hip: Vec3, shoulder: Vec3, waist: f32, broad: f32) {
    let turn = Quat::from_rotation_arc(Vec3::Z, (shoulder - hip).normalize_or(Vec3::Z));
    let length = (shoulder - hip).length();
    let ring = |(along, wide): (f32, f32)| -> Vec<Vec3> {
        let half = wide * (waist + (broad - waist) * along.clamp(0.0, 1.0));
        (0..14)
            .map(|side| {
                let angle = std::f32::consts::TAU * side as f32 / 14.0;
                let flat = vec3(angle.cos() * half * 0.66, angle.sin() * half, 0.0);
                hip + turn * (flat + Vec3::Z * along * length)
            })
            .collect()
    };
    let profile =
        [(-0.10, 0.75), (0.0, 1.0), (0.35, 0.92), (0.75, 1.12), (0.95, 1.0), (1.06, 0.35)];
    builder.loft(&profile.map(ring), |_, _| None);
}

/// An arm through three joints.
fn limb(builder: &mut MeshBuilder, joints: &[Vec3; 3], radii: &[f32; 3]) {
    builder.cone(joints[0], joints[1], [radii[0], radii[1]], 9);
    builder.cone(joints[1], joints[2], [radii[1], radii[2]], 9);
    builder.ball(joints[1], Vec3::splat(radii[1]), 5, 9);
    builder.ball(joints[0], Vec3::splat(radii[0]), 5, 9);
}
