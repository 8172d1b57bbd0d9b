//! Up to four wheels at once: contact, load, rotation and force.
//!
//! A *bank* holds up to four wheels with both ends of an axle side by side, so that the anti-roll
//! bar is a swap of neighbouring lanes. Lanes without a wheel never touch the ground.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{
    drivetrain::Drive,
    ground::{CachedTriangle, Ground},
    lanes::{Lanes, Lanes3, neighbours, select},
    model::{VehicleModel, WheelModel},
    motion::{Motion, Wrench},
    suspension::Suspensions,
    tyre::{ContactVelocity, PatchDeflection, Tyres},
};

/// Height above the static hub at which the ground query starts.
const RAY_ABOVE_M: f32 = 0.6;
/// A step in the ground lifts a wheel at most at the vehicle's speed plus this.
const CLIMB_MIN_MPS: f32 = 0.5;
/// Largest compression of a suspension.
const RAISED_MAX_M: f32 = 0.4;
/// Slip that anti-lock brakes allow, as a multiple of friction over slip stiffness; the longitudinal
/// force is largest at 2.9 of it.
const ABS_SLIP: f32 = 2.0;
/// Speed of the rim over the ground that they allow in addition. They do not act below it, and the
/// tyre's force builds up quickly at low speed.
const ABS_MPS: f32 = 1.0;
/// The same for traction control.
const TRACTION_MPS: f32 = 0.6;
/// A slip that no wheel has.
const UNLIMITED_SLIP: f32 = 1e6;
/// Smallest factor on friction: slip is divided by friction.
const GRIP_MIN: f32 = 1e-3;

/// The ground and its wetness.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub ground: &'a Ground,
    /// Factor on the friction of the dry ground.
    pub grip: f32,
}

/// The constant parameters of up to four wheels.
#[derive(Debug)]
pub(super) struct WheelBank {
    count: usize,
    present: Lanes,
    hub_in_body_m: Lanes3,
    radius_m: Lanes,
    inertia_kgm2: Lanes,
    drive_share: Lanes,
    brake_nm: Lanes,
    handbrake_nm: Lanes,
    /// Rolling resistance coefficient times radius.
    rolling_m: Lanes,
    /// Camber gain, signed by the side of the wheel.
    camber_radpm: Lanes,
    damping_nmsprad: Lanes,
    grip: Lanes,
    /// Slip that anti-lock brakes allow, for a friction factor of 1; without them, a large number.
    abs_slip: Lanes,
    /// The same for driven wheels and traction control.
    traction_slip: Lanes,
    /// 1 for wheels on the left and −1 on the right, where they are steered, and where they are not.
    front_side: Lanes,
    rear_side: Lanes,
    anti_roll_npm: Lanes,
    /// Load transfer by the links per newton of lateral force of both wheels: roll centre height
    /// over track, signed.
    link_share: Lanes,
    /// Distance ahead of the turning line, and to the left, of a steered wheel; 0 for others.
    steered_ahead_m: Lanes,
    steered_left_m: Lanes,
    suspensions: Suspensions,
    tyres: Tyres,
}

/// The state of up to four wheels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct WheelBankState {
    pub spin_radps: Lanes,
    pub angle_rad: Lanes,
    pub load_n: Lanes,
    deflection: PatchDeflection,
    pub across_n: Lanes,
    pub along_n: Lanes,
    /// Torque of engine and brakes.
    pub torque_nm: Lanes,
    /// Height of the ground under each wheel; minus infinity in the air.
    ground_m: Lanes,
}

/// The contacts of up to four wheels with the ground during one substep.
#[derive(Clone, Copy, Default)]
pub(super) struct WheelContacts {
    touching: Lanes,
    on_ground_m: Lanes3,
    normal: Lanes3,
    friction: Lanes,
    /// Vector from the hub to the contact point, in world space.
    foot_m: Lanes3,
    /// Camber relative to the ground: inclination to the right with the body.
    camber: Lanes,
    /// Direction of the wheels in body axes.
    heading_x: Lanes,
    heading_y: Lanes,
}

/// What brakes the wheels of a bank.
#[derive(Clone, Copy)]
pub(super) struct Braking {
    /// From 0 to 1.
    pub pedal: f32,
    /// 0 or 1.
    pub handbrake: f32,
    /// Torques of stability control.
    pub single_nm: Lanes,
}

/// Returns the wheels of a vehicle in banks, each wheel beside its partner. `rear_x_m` is the
/// turning line.
pub(super) fn banks(model: &VehicleModel, rear_x_m: f32) -> Vec<WheelBank> {
    // Two wheels without a partner may be neighbours: their axle parameters are 0.
    lane_order(model).chunks(4).map(|wheels| WheelBank::new(model, wheels, rear_x_m)).collect()
}

/// Returns the index of the wheel in each lane of the banks.
pub(super) fn lane_order(model: &VehicleModel) -> Vec<usize> {
    let mut order: Vec<usize> = Vec::new();
    for (index, wheel) in model.wheels.iter().enumerate() {
        if !order.contains(&index) {
            order.push(index);
            order.extend(wheel.partner.map(usize::from).filter(|p| !order.contains(p)));
        }
    }
    order
}

impl WheelBank {
    fn new(model: &VehicleModel, order: &[usize], rear_x_m: f32) -> WheelBank {
        let wheels: [&WheelModel; 4] =
            std::array::from_fn(|lane| &model.wheels[*order.get(lane).unwrap_or(&order[0])]);
        let present: [bool; 4] = std::array::from_fn(|lane| lane < order.len());
        let lanes =
            |value: &dyn Fn(&WheelModel) -> f32| {
                Lanes::new(std::array::from_fn(|lane| {
                    if present[lane] { value(wheels[lane]) } else { 0.0 }
                }))
            };
        let track = |wheel: &WheelModel| {
            wheel.partner.map(|p| wheel.hub_m.y - model.wheels[usize::from(p)].hub_m.y)
        };
        let steered = |wheel: &WheelModel| if wheel.steered { wheel.steer_share } else { 0.0 };
        let best_slip = |wheel: &WheelModel| ABS_SLIP * wheel.tyre.grip_x / wheel.tyre.stiffness_x;
        // A rider does what traction control does in a car.
        let has_traction = model.stability_control || model.class.leans();
        let mut hub_in_body_m = Lanes3::default();
        for (lane, wheel) in wheels.iter().enumerate() {
            hub_in_body_m.set(lane, wheel.hub_m - model.com_m);
        }
        WheelBank {
            count: order.len(),
            present: Lanes::new(present.map(|p| f32::from_bits(if p { u32::MAX } else { 0 }))),
            hub_in_body_m,
            // Empty lanes divide by these values.
            radius_m: Lanes::new(wheels.map(|w| w.radius_m)),
            inertia_kgm2: Lanes::new(wheels.map(|w| w.inertia_kgm2)),
            drive_share: lanes(&|w| w.drive_share),
            brake_nm: lanes(&|w| w.brake_torque_nm),
            handbrake_nm: lanes(&|w| w.handbrake_torque_nm),
            rolling_m: lanes(&|w| w.tyre.rolling_resistance * w.radius_m),
            camber_radpm: lanes(&|w| w.camber_radpm * w.hub_m.y.signum()),
            damping_nmsprad: lanes(&|w| w.damping_nmsprad),
            grip: Lanes::new(wheels.map(|w| w.grip.max(GRIP_MIN))),
            abs_slip: lanes(&|w| if model.abs { best_slip(w) } else { UNLIMITED_SLIP }),
            traction_slip: lanes(&|w| if has_traction { best_slip(w) } else { UNLIMITED_SLIP }),
            front_side: lanes(&|w| if w.steered { w.hub_m.y.signum() } else { 0.0 }),
            rear_side: lanes(&|w| if w.steered { 0.0 } else { w.hub_m.y.signum() }),
            anti_roll_npm: lanes(&|w| track(w).map_or(0.0, |_| w.anti_roll_npm)),
            link_share: lanes(&|w| track(w).map_or(0.0, |track| w.roll_center_m / track)),
            steered_ahead_m: lanes(&|w| steered(w) * (w.hub_m.x - rear_x_m)),
            steered_left_m: lanes(&|w| steered(w) * w.hub_m.y),
            suspensions: Suspensions::new(wheels),
            tyres: Tyres::new(wheels.map(|w| &w.tyre)),
        }
    }

    pub(super) fn at_rest() -> WheelBankState {
        WheelBankState {
            spin_radps: Lanes::ZERO,
            angle_rad: Lanes::ZERO,
            load_n: Lanes::ZERO,
            deflection: PatchDeflection::default(),
            across_n: Lanes::ZERO,
            along_n: Lanes::ZERO,
            torque_nm: Lanes::ZERO,
            ground_m: Lanes::splat(f32::NEG_INFINITY),
        }
    }

    /// Returns this bank's part of the mean speed of the driven wheels.
    #[inline]
    pub(super) fn driven_radps(&self, state: &WheelBankState) -> f32 {
        (self.drive_share * state.spin_radps).reduce_add()
    }

    /// Returns the brake torque of stability control on each wheel. A positive torque is for the left
    /// wheel of an axle, a negative one for the right.
    #[inline]
    pub(super) fn single_brakes(&self, front_nm: f32, rear_nm: f32) -> Lanes {
        (self.front_side * front_nm + self.rear_side * rear_nm).fast_max(Lanes::ZERO)
    }

    /// Sets the wheels rolling without slip.
    pub(super) fn roll_without_slip(&self, state: &mut WheelBankState, forward_mps: f32) {
        state.spin_radps =
            select(self.present, Lanes::splat(forward_mps) / self.radius_m, Lanes::ZERO);
        state.deflection = PatchDeflection::default();
    }

    /// Whether a wheel load is so high that the collision box may touch the ground.
    pub(super) fn is_pressed(&self, state: &WheelBankState) -> bool {
        state.load_n.simd_gt(self.suspensions.rest_n * 3.0).any()
    }

    /// Returns the smallest factor on friction of the wheels.
    pub(super) fn friction(&self, contacts: &WheelContacts) -> f32 {
        contacts.friction.to_array()[..self.count].iter().copied().fold(f32::INFINITY, f32::min)
    }

    pub(super) fn all_touch(&self, contacts: &WheelContacts) -> bool {
        (contacts.touching | !self.present).all()
    }

    /// Finds the contacts in the middle of the coming substep. `curvature_per_m` is the curvature
    /// of the path of the steering angle.
    pub(super) fn contacts(
        &self,
        state: &mut WheelBankState,
        cached_ground: &mut [Option<CachedTriangle>; 4],
        surface: &Surface,
        start: &Motion,
        curvature_per_m: f32,
        dt: f32,
    ) -> WheelContacts {
        let axes = &start.axes;
        let up = Lanes3::splat(axes.z_axis);
        // Ackermann geometry: all wheels turn about one point on the turning line.
        let ahead = self.steered_ahead_m * curvature_per_m;
        let inner = Lanes::ONE - self.steered_left_m * curvature_per_m;
        let length = (ahead * ahead + inner * inner).sqrt();
        let (heading_x, heading_y) = (inner / length, ahead / length);
        let axle = Lanes3::splat(axes.y_axis) * heading_x - Lanes3::splat(axes.x_axis) * heading_y;

        let middle = start.com_m + start.velocity_mps * (0.5 * dt);
        let hub = Lanes3::splat(middle) + self.hub_in_body_m.turned(axes);
        let guess = hub - up * self.radius_m;
        let mut on_ground_m = guess;
        let mut normal = Lanes3::splat(Vec3::Z);
        let mut friction = Lanes::ONE;
        let (guess_x, guess_y, hub_z) = (guess.x.to_array(), guess.y.to_array(), hub.z.to_array());
        for lane in 0..self.count {
            let z_from = hub_z[lane] + RAY_ABOVE_M * axes.z_axis.z;
            let cached = &mut cached_ground[lane];
            let hit = surface.ground.below_cached(guess_x[lane], guess_y[lane], z_from, cached);
            on_ground_m.z.as_mut_array()[lane] = hit.height_m;
            normal.set(lane, hit.normal);
            friction.as_mut_array()[lane] = hit.friction;
        }
        let speed = start.velocity_mps.length();
        let climb_m = (speed + CLIMB_MIN_MPS) * dt;
        let rolled = state.ground_m.simd_gt(Lanes::splat(f32::NEG_INFINITY));
        let highest = select(rolled, state.ground_m + climb_m, Lanes::splat(f32::INFINITY));
        on_ground_m.z = on_ground_m.z.fast_min(highest);

        // A disc touches a plane at the point towards the plane's normal, projected into the disc.
        let camber = normal.dot(axle);
        let in_disc = normal - axle * camber;
        let foot_m =
            in_disc * (self.radius_m / -in_disc.dot(in_disc).fast_max(Lanes::splat(1e-6)).sqrt());
        let gap = (hub + foot_m - on_ground_m).dot(normal);
        let reach = Lanes::splat(0.3 * speed.min(1.0)) - self.suspensions.droop_m;
        let touching = gap.simd_lt(reach) & self.present;
        state.ground_m = select(touching, on_ground_m.z, Lanes::splat(f32::NEG_INFINITY));
        let friction = friction * self.grip * surface.grip;
        WheelContacts {
            touching,
            on_ground_m,
            normal,
            friction,
            foot_m,
            camber,
            heading_x,
            heading_y,
        }
    }

    /// Computes one sub-iteration: loads, tyre forces and wheel speeds.
    #[inline]
    #[expect(clippy::too_many_arguments, reason = "all that acts on a wheel, nothing twice")]
    pub(super) fn advance(
        &self,
        state: &mut WheelBankState,
        contacts: &WheelContacts,
        motion: &Motion,
        drive: &Drive,
        braking: Braking,
        dt: f32,
        wrench: &mut Wrench,
    ) {
        let axes = &motion.axes;
        let up = Lanes3::splat(axes.z_axis);
        let normal = contacts.normal;
        let hub = self.hub_in_body_m.turned(axes);
        let velocity = Lanes3::splat(motion.velocity_mps);
        let spin = Lanes3::splat(motion.spin_radps);

        // Compression of each suspension, and its rate.
        let upright = Lanes::ONE / normal.dot(up).fast_max(Lanes::splat(0.2));
        let foot = hub + contacts.foot_m;
        let depth = (contacts.on_ground_m - Lanes3::splat(motion.com_m) - foot).dot(normal);
        let droop = self.suspensions.droop_m;
        let raised = (depth * upright).fast_max(droop).fast_min(Lanes::splat(RAISED_MAX_M));
        let raised = select(contacts.touching, raised, droop);
        let hub_mps = velocity + spin.cross(hub);
        let rate = -(hub_mps.dot(normal) * upright);
        let shifted = self.anti_roll_npm * (raised - neighbours(raised))
            - self.link_share * (state.across_n + neighbours(state.across_n));
        let load = self.suspensions.load_n(raised, rate, shifted);
        let load = select(contacts.touching, load, Lanes::ZERO);
        state.load_n = load;

        // The axes of the contact plane: along the wheel's heading, and to its left.
        let heading = Lanes3::splat(axes.x_axis) * contacts.heading_x
            + Lanes3::splat(axes.y_axis) * contacts.heading_y;
        let left = normal.cross(heading);
        let left = left * (Lanes::ONE / left.dot(left).fast_max(Lanes::splat(1e-6)).sqrt());
        let along = left.cross(normal);
        let foot = foot + up * raised;
        let foot_mps = velocity + spin.cross(foot);
        let along_mps = foot_mps.dot(along);
        let velocity = ContactVelocity {
            along_mps,
            across_mps: foot_mps.dot(left),
            wheel_speed_mps: state.spin_radps * self.radius_m,
            camber: contacts.camber + self.camber_radpm * raised,
        };
        let forces =
            self.tyres.forces(&mut state.deflection, load, contacts.friction, &velocity, dt);

        // The new wheel speed and the longitudinal force depend on each other, and are solved
        // together.
        let slope = forces.slope_nspm;
        let hold = self.drive_share * drive.damping_nmsprad;
        let inertia = self.inertia_kgm2 + self.drive_share * drive.inertia_kgm2;
        let hold = hold + self.damping_nmsprad;
        let stiff = Lanes::ONE / (inertia + (hold + self.radius_m * self.radius_m * slope) * dt);
        let pull = self.drive_share * drive.torque_nm
            - self.radius_m * (forces.held_n - slope * along_mps);
        let free = (inertia * state.spin_radps + pull * dt) * stiff;
        // Anti-lock brakes release a wheel that would slip further than they allow.
        let allowed = self.abs_slip * contacts.friction;
        let ground_mps = along_mps.abs();
        let slowest = ground_mps * (Lanes::ONE - allowed) - Lanes::splat(ABS_MPS);
        let spare = free.abs() - slowest.fast_max(Lanes::ZERO) / self.radius_m;
        let spare = spare.fast_max(Lanes::ZERO);
        let service = self.brake_nm * braking.pedal + braking.single_nm;
        let steady = self.handbrake_nm * braking.handbrake + self.rolling_m * load;
        let most = (service * dt * stiff).fast_min(spare) + steady * dt * stiff;
        // Traction control brakes a wheel that would spin.
        let grips = self.traction_slip * contacts.friction + Lanes::ONE;
        let fastest = (ground_mps * grips + Lanes::splat(TRACTION_MPS)) / self.radius_m;
        let most = most.fast_max(free.abs() - fastest);
        let stopped = free.fast_max(-most).fast_min(most);
        state.spin_radps = free - stopped;
        state.torque_nm = self.drive_share
            * (drive.torque_nm - state.spin_radps * drive.damping_nmsprad)
            - stopped / (dt * stiff);
        let slide = state.spin_radps * self.radius_m - along_mps;
        state.deflection.along_m = (state.deflection.along_m + slide * dt) * forces.fade;

        let (force_x, force_y) = (forces.held_n + slope * slide, forces.across_n);
        let length = (force_x * force_x + force_y * force_y).sqrt();
        let cut = (forces.limit_n / length.fast_max(Lanes::splat(1e-3))).fast_min(Lanes::ONE);
        let (force_x, force_y) = (force_x * cut, force_y * cut);
        state.across_n = force_y;
        state.along_n = force_x;
        let loaded = load.simd_gt(Lanes::ZERO);
        state.deflection.along_m = select(loaded, state.deflection.along_m, Lanes::ZERO);
        state.deflection.across_m = select(loaded, state.deflection.across_m, Lanes::ZERO);

        let force = normal * load + along * force_x + left * force_y;
        wrench.force_n += force.sum();
        wrench.torque_nm += foot.cross(force).sum();
    }

    /// Advances the rotation angles; called once per substep.
    pub(super) fn advance_angles(&self, state: &mut WheelBankState, dt: f32) {
        let revolutions = (state.angle_rad + state.spin_radps * dt) * (1.0 / std::f32::consts::TAU);
        state.angle_rad = (revolutions - revolutions.floor()) * std::f32::consts::TAU;
    }
}
