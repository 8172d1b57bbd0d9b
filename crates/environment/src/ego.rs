//! An ego vehicle: its course, its observations of itself, its reward and its ending.

use glam::{Vec2, Vec3};
use protocol::{ActorId, ActorState, Command, VehicleControl};

use crate::{
    config::{Config, Reward},
    course::{Course, OnCourse},
    error::EnvironmentError,
};

/// Distances along the course of the points in the state vector. Metres.
const AHEAD_M: [f32; 8] = [3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0];
/// Scales of the state vector.
const SPEED_SCALE_MPS: f32 = 30.0;
const PLACE_SCALE_M: f32 = 50.0;
/// The numbers of the state vector.
pub const STATE: usize = 8 + 2 * AHEAD_M.len();

/// Limits of [`Action::Waypoint`].
const LEFT_MAX_M: f32 = 10.0;
const SPEED_MAX_MPS: f32 = 60.0;
/// The distance to the point that a vehicle is steered to: a time at its speed, and at least these
/// metres.
const LOOKAHEAD_S: f32 = 0.7;
const LOOKAHEAD_MIN_M: f32 = 4.0;
/// The steering angle of the wheels at full lock. Radians.
const STEER_MAX_RAD: f32 = 0.61;
/// Pedal for each metre per second that the speed is off.
const PEDAL_PER_MPS: f32 = 0.5;

/// What an ego vehicle does during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Steering wheel and pedals.
    Pedals {
        /// The steering wheel, −1 (full right) to 1 (full left).
        steer: f32,
        /// −1 (full brake) to 1 (full throttle).
        pedal: f32,
    },
    /// A place beside the middle of the lane, and a speed: a controller steers to the point of the
    /// route 0.7 s ahead, and accelerates or brakes, in every frame.
    Waypoint {
        /// Distance to the left of the middle of the lane. Metres, −10 to 10.
        left_m: f32,
        /// Metres per second, 0 to 60.
        speed_mps: f32,
    },
}

impl Action {
    pub(crate) fn check(&self, ego: usize) -> Result<(), EnvironmentError> {
        let bad = |name, value, range| EnvironmentError::Action { ego, name, value, range };
        let within = |name, value: f32, low: f32, high: f32, range| {
            (low..=high).contains(&value).then_some(()).ok_or_else(|| bad(name, value, range))
        };
        match *self {
            Action::Pedals { steer, pedal } => {
                within("steer", steer, -1.0, 1.0, "-1 to 1")?;
                within("pedal", pedal, -1.0, 1.0, "-1 to 1")
            }
            Action::Waypoint { left_m, speed_mps } => {
                within("left_m", left_m, -LEFT_MAX_M, LEFT_MAX_M, "-10 to 10")?;
                within("speed_mps", speed_mps, 0.0, SPEED_MAX_MPS, "0 to 60")
            }
        }
    }
}

/// Why an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The ego vehicle reached the end of its route.
    Arrival,
    /// It touched something.
    Collision,
    /// It left its route.
    OffRoute,
    /// It had no more steps: the episode is truncated, not terminated.
    Steps,
}

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The reward.
    pub reward: f32,
    /// Why the episode ended; `None` if it goes on.
    pub ending: Option<Ending>,
}

/// An ego vehicle. After its ending it stays as it was then.
#[derive(Debug)]
pub struct Ego {
    id: ActorId,
    state: ActorState,
    course: Course,
    at: OnCourse,
    /// The farthest place that was rewarded. Metres along the course.
    reached_m: f32,
    /// The steering wheel and the pedal of the last frame, and the steering wheel of the step before.
    pedals: [f32; 2],
    steer_before: f32,
    ending: Option<Ending>,
}

impl Ego {
    /// Creates an ego vehicle at the beginning of its course.
    pub(crate) fn new(id: ActorId, state: ActorState, course: Course) -> Ego {
        let at = course.locate(state.pose.position(), &OnCourse::default());
        Ego {
            id,
            state,
            course,
            reached_m: at.along_m,
            at,
            pedals: [0.0; 2],
            steer_before: 0.0,
            ending: None,
        }
    }

    /// Takes in the state of a frame.
    pub(crate) fn observe(&mut self, state: &ActorState) {
        self.state = *state;
        self.at = self.course.locate(state.pose.position(), &self.at);
    }

    /// Returns the command of an action for one frame.
    pub(crate) fn control(&mut self, action: &Action) -> Command {
        self.pedals = match *action {
            Action::Pedals { steer, pedal } => [steer, pedal],
            Action::Waypoint { left_m, speed_mps } => self.pedals_to(left_m, speed_mps),
        };
        control(self.id, self.pedals)
    }

    /// Returns steering wheel and pedal by pure pursuit (Coulter, "Implementation of the pure
    /// pursuit path tracking algorithm", 1992).
    fn pedals_to(&self, left_m: f32, speed_mps: f32) -> [f32; 2] {
        let now_mps = self.forward_mps();
        let ahead_m = (LOOKAHEAD_S * now_mps).max(LOOKAHEAD_MIN_M);
        let to = self.in_vehicle(self.course.beside(&self.at, ahead_m, left_m));
        let wheelbase_m = town::catalogue()[self.state.blueprint as usize].wheelbase_m;
        let curvature_per_m = 2.0 * to.y / to.length_squared().max(1.0);
        let steer_rad = (curvature_per_m * wheelbase_m).atan();
        let pedal = PEDAL_PER_MPS * (speed_mps - now_mps);
        [(steer_rad / STEER_MAX_RAD).clamp(-1.0, 1.0), pedal.clamp(-1.0, 1.0)]
    }

    /// Ends a step: finds the ending and returns the reward.
    pub(crate) fn end_step(&mut self, has_collided: bool, is_over: bool, config: &Config) -> Step {
        self.ending = if has_collided {
            Some(Ending::Collision)
        } else if self.at.left_m.abs() > self.at.half_width_m + config.off_route_m {
            Some(Ending::OffRoute)
        } else if self.at.along_m >= self.course.length_m() - 1.0 {
            Some(Ending::Arrival)
        } else {
            is_over.then_some(Ending::Steps)
        };
        Step { reward: self.reward(&config.reward), ending: self.ending }
    }

    fn reward(&mut self, rewards: &Reward) -> f32 {
        let progress_m = (self.at.along_m - self.reached_m).max(0.0);
        self.reached_m += progress_m;
        let speed = (self.forward_mps() / self.at.limit_mps).max(0.0);
        let beside = (self.at.left_m / self.at.half_width_m.max(0.1)).abs().min(1.0);
        let turned = (self.pedals[0] - self.steer_before).abs();
        self.steer_before = self.pedals[0];
        let last = match self.ending {
            Some(Ending::Arrival) => rewards.arrival,
            Some(Ending::Collision) => rewards.collision,
            Some(Ending::OffRoute) => rewards.off_route,
            Some(Ending::Steps) | None => 0.0,
        };
        rewards.per_metre * progress_m
            + rewards.speed * speed.min(1.0)
            + rewards.speeding * (speed - 1.0).max(0.0)
            + rewards.off_centre * beside
            + rewards.steering * turned
            + last
    }

    /// The actor. After the ending, in a world with other ego vehicles, it does not exist any more.
    pub fn id(&self) -> ActorId {
        self.id
    }

    /// The state of the actor, at the newest frame or at its ending.
    pub fn actor(&self) -> &ActorState {
        &self.state
    }

    /// Why its episode ended; `None` if it goes on.
    pub fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// Distance along the route, and its length. Metres.
    pub fn progress_m(&self) -> (f32, f32) {
        (self.at.along_m, self.course.length_m())
    }

    /// Distance to the left of the middle of its lane. Metres.
    pub fn left_m(&self) -> f32 {
        self.at.left_m
    }

    /// Speed straight ahead. Metres per second.
    pub fn forward_mps(&self) -> f32 {
        Vec3::from_array(self.state.velocity_mps).truncate().dot(self.forward())
    }

    /// Calls `stretch` with the ends and half the width of each stretch of the course that begins
    /// within `reach_m` along it, behind and ahead.
    pub(crate) fn route(&self, reach_m: f32, stretch: impl FnMut(Vec2, Vec2, f32)) {
        self.course.stretches(&self.at, reach_m, stretch);
    }

    /// Straight ahead in the plane, of unit length.
    pub(crate) fn forward(&self) -> Vec2 {
        (self.state.pose.rotation() * Vec3::X).truncate().normalize_or(Vec2::X)
    }

    /// Returns a place of the world in the plane of the vehicle.
    fn in_vehicle(&self, place: Vec3) -> Vec2 {
        let offset = (place - self.state.pose.position()).truncate();
        Vec2::new(self.forward().dot(offset), self.forward().perp_dot(offset))
    }

    /// Returns the state vector, each number limited to −10 to 10:
    ///
    /// | index | value |
    /// |---|---|
    /// | 0 | forward speed / 30 m/s |
    /// | 1 | speed limit / 30 m/s |
    /// | 2 | distance to the left of the lane's centre / half the lane's width |
    /// | 3, 4 | sine and cosine of the heading, seen from the lane's, positive to the left |
    /// | 5 | yaw rate, rad/s |
    /// | 6, 7 | the steering wheel and the pedal of the last step |
    /// | 8 to 23 | x and y / 50 m of the points of the route 3, 6, 10, 15, 20, 30, 40 and 50 m ahead, in the frame of the ego vehicle |
    pub fn state(&self) -> [f32; STATE] {
        let forward = self.forward();
        let mut state = [0.0; STATE];
        state[0] = self.forward_mps() / SPEED_SCALE_MPS;
        state[1] = self.at.limit_mps / SPEED_SCALE_MPS;
        state[2] = self.at.left_m / self.at.half_width_m.max(0.1);
        state[3] = self.at.tangent.perp_dot(forward);
        state[4] = self.at.tangent.dot(forward);
        state[5] = self.state.angular_velocity_radps[2];
        [state[6], state[7]] = self.pedals;
        for (point, ahead_m) in state[8..].chunks_exact_mut(2).zip(AHEAD_M) {
            let ahead = self.in_vehicle(self.course.beside(&self.at, ahead_m, 0.0));
            [point[0], point[1]] = (ahead / PLACE_SCALE_M).to_array();
        }
        state.map(|value| value.clamp(-10.0, 10.0))
    }
}

/// Returns the command of a steering wheel and a pedal.
pub(crate) fn control(actor_id: ActorId, [steer, pedal]: [f32; 2]) -> Command {
    Command::Control(VehicleControl {
        actor_id,
        throttle: pedal.max(0.0),
        brake: (-pedal).max(0.0),
        steer,
        ..VehicleControl::default()
    })
}
