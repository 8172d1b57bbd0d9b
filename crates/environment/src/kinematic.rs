//! Vehicles that drive along the plans of traffic without physics of their own: a bicycle without
//! slip (Rajamani, Vehicle Dynamics and Control, section 2.2), on the ground under its axles.

use glam::{Mat3, Quat, Vec2, Vec3};
use protocol::ActorState;
use sim_host::physics::Ground;
use traffic::IntendedMotion;

/// The ground is looked for from this height above a vehicle's origin. Metres.
const STEP_M: f32 = 0.8;
/// The largest yaw rate. Radians per second.
const YAW_MAX_RADPS: f32 = 3.0;

/// The velocity of a vehicle's origin and its angular velocity, in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Velocity {
    pub(crate) velocity_mps: Vec3,
    pub(crate) angular_velocity_radps: Vec3,
}

/// Returns the velocities that move a vehicle for `delta_s` seconds as its controls mean.
pub(crate) fn velocity(
    state: &ActorState,
    motion: &IntendedMotion,
    ground: &Ground,
    delta_s: f32,
) -> Velocity {
    let IntendedMotion { direction, speed_mps, acceleration_mps2, wheel_steer_rad, wheelbase_m } =
        *motion;
    // Pedals slow down to standstill, and not through it.
    let before = direction * speed_mps;
    let after = (before + acceleration_mps2 * delta_s).max(before.min(0.0));
    let speed_mps = direction * 0.5 * (before + after).max(0.0);
    let position = state.pose.position();
    let forward = (state.pose.rotation() * Vec3::X).truncate().normalize_or(Vec2::X);
    let curvature_per_m = wheel_steer_rad.tan() / wheelbase_m;
    let yaw_radps = (speed_mps * curvature_per_m).clamp(-YAW_MAX_RADPS, YAW_MAX_RADPS);
    let turn_rad = yaw_radps * delta_s;
    // The rear axle follows an arc; the origin lies half a wheelbase before it.
    let rear = position.truncate() - forward * 0.5 * wheelbase_m;
    let rear = rear + Vec2::from_angle(0.5 * turn_rad).rotate(forward) * speed_mps * delta_s;
    let forward = Vec2::from_angle(turn_rad).rotate(forward);
    let front = rear + forward * wheelbase_m;
    let height_m = |at: Vec2| {
        let hit = ground.below(at.x, at.y, position.z + STEP_M);
        if hit.on_map { hit.height_m } else { position.z }
    };
    let (rear, front) = (rear.extend(height_m(rear)), front.extend(height_m(front)));
    let x = (front - rear).normalize_or(forward.extend(0.0));
    let y = Vec3::Z.cross(x).normalize_or(Vec3::Y);
    let rotation = Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y)));
    let by = rotation * state.pose.rotation().inverse();
    let by = if by.w < 0.0 { -by } else { by };
    Velocity {
        velocity_mps: (0.5 * (rear + front) - position) / delta_s,
        angular_velocity_radps: by.to_scaled_axis() / delta_s,
    }
}
