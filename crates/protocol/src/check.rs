//! The ranges of the numbers in commands about actors and about the standing state. The host checks
//! every such command with these functions, saved ones included; what depends on the world is
//! checked where the command is carried out.

use glam::Vec3;

use crate::{
    ActorState, ApplyForce, BONES, BlendPose, PIPELINE_MAX, Pose, Refusal, RouteCommand, SetBones,
    SetVelocity, Settings, StandingCommand, TrafficParam, VehicleControl, WalkerLimbs, Weather,
    WorldCommand,
    range::{each, within},
    route_step,
};

/// Largest coordinate of an actor that a client places: f32 resolves half a centimetre there.
/// Metres.
pub const PLACE_MAX_M: f32 = 50_000.0;
/// Largest speed of an actor. Metres per second.
pub const SPEED_MAX_MPS: f32 = 400.0;
/// Largest angular speed that a client sets. Radians per second.
const SET_SPIN_MAX_RADPS: f32 = 100.0;
/// Largest impulse, force, angular impulse and torque.
const FORCE_MAX: f32 = 1e8;
/// Largest distance of a bone from its parent. Metres.
const BONE_MAX_M: f32 = 10.0;
/// The largest magnitude of a number in the weather or in a traffic parameter.
const NUMBER_MAX: f32 = 1e6;
/// The largest magnitude of a number in the state of an actor: sums and products of such numbers are
/// finite.
const STATE_MAX: f32 = 1e10;

impl WorldCommand {
    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`crate::RefusalCode::OutOfRange`] with the first number that is not, and its range.
    pub fn check(&self) -> Result<(), Refusal> {
        let checked = match self {
            WorldCommand::Spawn(spawn) => spawn.pose.check(PLACE_MAX_M),
            WorldCommand::Teleport(to) => to.pose.check(PLACE_MAX_M),
            WorldCommand::Control(control) => control.check(),
            WorldCommand::SetVelocity(to) => to.check(),
            WorldCommand::SetBody(body) => body.check(),
            WorldCommand::SetEngine(engine) => engine.check(),
            WorldCommand::SetGearbox(gearbox) => gearbox.check(),
            WorldCommand::SetSteering(steering) => steering.check(),
            WorldCommand::SetWheel(wheel) => wheel.check(),
            WorldCommand::ApplyForce(force) => force.check(),
            WorldCommand::Ackermann(control) => control.check(),
            WorldCommand::SetAckermann(settings) => settings.check(),
            WorldCommand::RouteCommand(route) => route.check(),
            // Ids, switches and sets of bits.
            WorldCommand::Destroy(_)
            | WorldCommand::Autopilot(_)
            | WorldCommand::SetTrafficLight(_)
            | WorldCommand::SetPhysics(_)
            | WorldCommand::SetVehicleLights(_)
            | WorldCommand::SetDoors(_)
            | WorldCommand::SetGravity(_)
            | WorldCommand::SetCollisions(_)
            | WorldCommand::Jump(_)
            | WorldCommand::SetDead(_) => Ok(()),
        };
        checked.map_err(Refusal::out_of_range)
    }
}

impl StandingCommand {
    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`crate::RefusalCode::OutOfRange`] with the first number that is not, and its range.
    pub fn check(&self) -> Result<(), Refusal> {
        let checked = match self {
            StandingCommand::SetWeather(weather) => weather.check(),
            StandingCommand::SetSettings(settings) => settings.check(),
            StandingCommand::TrafficParam(set) => set.check(),
            StandingCommand::SetStreetLights(to) => to.check(),
            StandingCommand::SetBones(to) => to.check(),
            StandingCommand::BlendPose(to) => to.check(),
            StandingCommand::Draw(shape) => shape.check(),
            // Switches and sets of bits.
            StandingCommand::HideLayers(_)
            | StandingCommand::HideObjects(_)
            | StandingCommand::SetWeatherAffectsGrip(_)
            | StandingCommand::EraseShapes(_) => Ok(()),
        };
        checked.map_err(Refusal::out_of_range)
    }
}

impl Pose {
    /// Checks that the pose is a rigid transform whose coordinates are at most `most_m`; the error
    /// names the number and the limit.
    pub fn check(&self, most_m: f32) -> Result<(), String> {
        if !self.is_valid() {
            return Err(format!(
                "pose {:?}, {:?} is not finite, or its rotation not of unit length",
                self.position_m, self.rotation
            ));
        }
        each("a coordinate of the position", &self.position_m, -most_m, most_m)
    }
}

impl VehicleControl {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        for (what, value, low) in [
            ("throttle", self.throttle, 0.0),
            ("brake", self.brake, 0.0),
            ("steer", self.steer, -1.0),
        ] {
            within(what, value, low, 1.0).map_err(|why| format!("{}: {why}", self.actor_id))?;
        }
        Ok(())
    }
}

impl SetVelocity {
    /// Checks that both velocities are in their ranges; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        length("the speed in m/s", self.velocity_mps, SPEED_MAX_MPS)?;
        length("the angular speed in rad/s", self.angular_velocity_radps, SET_SPIN_MAX_RADPS)
    }
}

impl ApplyForce {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        length("the force or impulse", self.linear, FORCE_MAX)?;
        length("the torque or angular impulse", self.angular, FORCE_MAX)?;
        match self.has_point {
            0 => Ok(()),
            _ => each("at_m", &self.at_m, -STATE_MAX, STATE_MAX),
        }
    }
}

impl RouteCommand {
    /// Checks the kinds and places of the valid steps; the error names the first that is wrong.
    pub fn check(&self) -> Result<(), String> {
        for (nth, step) in self.steps.iter().take(self.count as usize).enumerate() {
            each("its place", &step.position_m, -2.0 * PLACE_MAX_M, 2.0 * PLACE_MAX_M)
                .map_err(|why| format!("step {nth} of the route: {why}"))?;
            if !(route_step::PLACE..=route_step::LANE_RIGHT).contains(&step.kind) {
                let kind = step.kind;
                return Err(format!("step {nth} of the route has unknown kind {kind}, not 1 to 6"));
            }
        }
        Ok(())
    }
}

impl Weather {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        let values: &[f32] = bytemuck::cast_slice(std::slice::from_ref(self));
        each("a number of the weather", values, -NUMBER_MAX, NUMBER_MAX)
    }
}

impl Settings {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        let (delta, substep) = (self.delta_nanos, self.substep_max_nanos);
        if !(100_000..=10_000_000_000).contains(&delta) {
            return Err(format!(
                "delta_nanos is {delta}, not 100000 to 10000000000 (0.1 ms to 10 s)"
            ));
        }
        if !(100_000..=100_000_000).contains(&substep) {
            return Err(format!("substep_max_nanos is {substep}, not 100000 to 100000000"));
        }
        if self.pipeline > PIPELINE_MAX {
            let pipeline = self.pipeline;
            return Err(format!("pipeline is {pipeline}, PIPELINE_MAX is {PIPELINE_MAX}"));
        }
        Ok(())
    }
}

impl TrafficParam {
    /// Checks that the value is in its range.
    pub fn check(&self) -> Result<(), String> {
        within(&format!("traffic param {}", self.param), self.value, -NUMBER_MAX, NUMBER_MAX)
    }
}

impl SetBones {
    /// Checks that the pose of every bone is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        for (bone, pose) in self.bones() {
            pose.check(BONE_MAX_M).map_err(|why| {
                let name = BONES.get(bone as usize).copied().unwrap_or("a bone");
                format!("{name} of {}: {why}", self.actor_id)
            })?;
        }
        Ok(())
    }
}

impl BlendPose {
    /// Checks that the weight is in its range.
    pub fn check(&self) -> Result<(), String> {
        within(&format!("the pose weight of {}", self.actor_id), self.weight, 0.0, 1.0)
    }
}

impl ActorState {
    /// Whether the pose is a rigid transform and every number finite and at most 1e10. The states
    /// of recordings and saved states are checked with it.
    pub fn is_valid(&self) -> bool {
        let vectors = [self.velocity_mps, self.angular_velocity_radps, self.acceleration_mps2];
        let wheels = [self.engine_rpm, self.wheel_steer_rad, self.wheel_spin_rad];
        let pedals = [self.throttle, self.brake, self.steer];
        let numbers = vectors.as_flattened().iter().chain(&wheels).chain(&pedals);
        self.pose.check(STATE_MAX).is_ok() && numbers.copied().all(|x| x.abs() <= STATE_MAX)
    }
}

impl WalkerLimbs {
    /// Whether every number is one of a rotation.
    pub fn is_valid(&self) -> bool {
        self.rotations.as_flattened().iter().all(|part| part.abs() <= 1.01)
    }
}

fn length(what: &str, vector: [f32; 3], most: f32) -> Result<(), String> {
    within(&format!("{what}, {vector:?},"), Vec3::from_array(vector).length(), 0.0, most)
}
