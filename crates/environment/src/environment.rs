//! Episodes: an ego vehicle on a course among vehicles in traffic.

use std::sync::Arc;

use bake::Cache;
use glam::{Vec2, Vec3};
use mesh::RandomStream;
use protocol::{
    ActorId, ActorState, Command, Name, Pose, Settings, Spawn, VehicleControl, flag, status,
};
use road::{LanePoint, Network};
use town::Town;

use crate::{
    course::{Course, OnCourse},
    error::EnvironmentError,
    lidar::{BoxGrid, Lidar, UprightBox},
    simulation::Simulation,
};

/// The name of the random stream of an episode.
const EPISODE: u64 = u64::from_le_bytes(*b"episode ");
/// The ego vehicle.
const EGO: &str = "vehicle.tesla.model3";
/// Height of a spawn point above the road. Metres.
const START_HEIGHT_M: f64 = 0.5;
/// Frames at the beginning of an episode in which vehicles settle on their wheels.
const SETTLING_FRAMES: u32 = 10;
/// Least distance between two vehicles at the beginning. Metres.
const APART_M: f32 = 12.0;
/// Height of the lidar above the ego vehicle's origin. Metres.
const LIDAR_HEIGHT_M: f32 = 0.8;
/// Distances along the course of the points in the state vector. Metres.
const AHEAD_M: [f32; 8] = [3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0];
/// Scales of the state vector.
const SPEED_SCALE_MPS: f32 = 30.0;
const PLACE_SCALE_M: f32 = 50.0;
/// The numbers of the state vector.
pub const STATE: usize = 8 + 2 * AHEAD_M.len();

/// What decides an episode beside its seed and the actions.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Other vehicles, driven by traffic.
    pub vehicles: usize,
    /// Length of a frame, rounded to a microsecond. Seconds, 0.005 to 0.1.
    pub frame_s: f32,
    /// Frames for each step, which all have the same action. 1 to 100.
    pub frames_per_step: u32,
    /// Length of the route. Metres, 10 to 10 000.
    pub route_m: f32,
    /// Steps after which an episode is truncated; 0: never.
    pub steps_max: u32,
    /// Rays of the lidar, 0 to 4096.
    pub lidar_rays: usize,
    /// Range of the lidar. Metres, 1 to 500.
    pub lidar_range_m: f32,
    /// How far beside its lane the vehicle's middle may be. Metres.
    pub off_route_m: f32,
    /// Rewards.
    pub reward: Reward,
}

impl Default for Config {
    fn default() -> Config {
        Config {
            vehicles: 12,
            frame_s: 0.05,
            frames_per_step: 2,
            route_m: 300.0,
            steps_max: 1000,
            lidar_rays: 240,
            lidar_range_m: 50.0,
            off_route_m: 0.5,
            reward: Reward::default(),
        }
    }
}

impl Config {
    fn check(&self) -> Result<(), EnvironmentError> {
        let range = |name, value: f64, low: f64, high: f64, range| match value {
            v if (low..=high).contains(&v) => Ok(()),
            value => Err(EnvironmentError::Config { name, value, range }),
        };
        let Reward { per_metre, speed, arrival, collision, off_route } = self.reward;
        range("vehicles", self.vehicles as f64, 0.0, 1000.0, "0 to 1000")?;
        range("frame_s", self.frame_s.into(), 0.005, 0.100_01, "0.005 to 0.1")?;
        range("frames_per_step", self.frames_per_step.into(), 1.0, 100.0, "1 to 100")?;
        range("route_m", self.route_m.into(), 10.0, 10_000.0, "10 to 10000")?;
        range("lidar_rays", self.lidar_rays as f64, 0.0, 4096.0, "0 to 4096")?;
        range("lidar_range_m", self.lidar_range_m.into(), 1.0, 500.0, "1 to 500")?;
        range("off_route_m", self.off_route_m.into(), 0.0, 1000.0, "0 to 1000")?;
        for (name, value) in [
            ("reward.per_metre", per_metre),
            ("reward.speed", speed),
            ("reward.arrival", arrival),
            ("reward.collision", collision),
            ("reward.off_route", off_route),
        ] {
            range(name, value.into(), -1e6, 1e6, "-1000000 to 1000000")?;
        }
        Ok(())
    }
}

/// The rewards of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reward {
    /// For each metre along the route.
    pub per_metre: f32,
    /// Times the speed as a fraction of the speed limit, at most 1.
    pub speed: f32,
    /// At the end of the route.
    pub arrival: f32,
    /// At a collision.
    pub collision: f32,
    /// Beside the route.
    pub off_route: f32,
}

impl Default for Reward {
    fn default() -> Reward {
        Reward { per_metre: 1.0, speed: 0.1, arrival: 10.0, collision: -5.0, off_route: -5.0 }
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

/// A map, and what environments on it share.
pub struct EnvironmentMap {
    network: Arc<Network>,
    /// A simulation that never steps.
    blank: Simulation,
    solids: BoxGrid,
    places: Vec<(LanePoint, Pose)>,
    cars: Vec<Name>,
}

impl EnvironmentMap {
    /// Loads a map, from the cache if possible. `seed` decides how the town is furnished.
    ///
    /// # Errors
    /// [`EnvironmentError::Map`] with the line of the file.
    pub fn load(
        cache: &Cache,
        name: &str,
        open_drive: &str,
        seed: u64,
    ) -> Result<EnvironmentMap, EnvironmentError> {
        let network = Arc::new(cache.network(name, open_drive)?);
        let town = cache.town_around(&network, open_drive, seed);
        Ok(EnvironmentMap::new(network, &town, seed))
    }

    /// Creates the map of a furnished town.
    pub fn new(network: Arc<Network>, town: &Town, seed: u64) -> EnvironmentMap {
        let solids: Vec<UprightBox> = town
            .colliders
            .iter()
            .map(|collider| UprightBox {
                center: collider.center,
                half_extents_m: collider.half_extents_m,
                axis: Vec2::from_angle(collider.yaw_rad),
            })
            .collect();
        let place = |at| {
            let place = network.place(at);
            let position = place.position.as_vec3() + Vec3::Z * START_HEIGHT_M as f32;
            (at, Pose::new(position, place.rotation().as_quat()))
        };
        let cars = town::catalogue().iter().filter(|blueprint| blueprint.base_type == "car");
        EnvironmentMap {
            blank: Simulation::new(Arc::clone(&network), town, seed),
            solids: BoxGrid::new(&solids),
            places: network.spawn_points().into_iter().map(place).collect(),
            cars: cars.map(|blueprint| Name::new(blueprint.id)).collect(),
            network,
        }
    }
}

/// An environment: one world with an ego vehicle.
pub struct Environment {
    map: Arc<EnvironmentMap>,
    config: Config,
    simulation: Simulation,
    ego: ActorId,
    course: Course,
    at: OnCourse,
    /// The farthest place that was rewarded. Metres along the course.
    reached_m: f32,
    steps: u32,
    action: [f32; 2],
    ending: Option<Ending>,
}

impl Environment {
    /// Creates an environment in its first episode.
    ///
    /// # Errors
    /// [`EnvironmentError::Config`], and those of [`Environment::reset`].
    pub fn new(
        map: Arc<EnvironmentMap>,
        config: Config,
        seed: u64,
    ) -> Result<Environment, EnvironmentError> {
        config.check()?;
        let (simulation, ego, course) = begin(&map, &config, seed)?;
        let mut environment = Environment {
            map,
            config,
            simulation,
            ego,
            course,
            at: OnCourse::default(),
            reached_m: 0.0,
            steps: 0,
            action: [0.0; 2],
            ending: None,
        };
        environment.settle();
        Ok(environment)
    }

    /// Begins another episode. The same seed gives the same episode.
    ///
    /// # Errors
    /// [`EnvironmentError::NoRoute`] and [`EnvironmentError::NoPlace`] if the map is too small; the
    /// environment is unchanged then.
    pub fn reset(&mut self, seed: u64) -> Result<(), EnvironmentError> {
        let (simulation, ego, course) = begin(&self.map, &self.config, seed)?;
        (self.simulation, self.ego, self.course) = (simulation, ego, course);
        self.settle();
        Ok(())
    }

    /// Lets the vehicles come to rest on their wheels, with the brake on.
    fn settle(&mut self) {
        for _ in 0..SETTLING_FRAMES {
            self.simulation.request(control(self.ego, [0.0, -1.0]));
            self.simulation.step();
        }
        self.at = self.course.locate(self.ego().pose.position(), &OnCourse::default());
        (self.reached_m, self.steps, self.ending) = (self.at.along_m, 0, None);
        self.action = [0.0; 2];
    }

    /// Advances by one step. `action` is the steering wheel, −1 (full right) to 1 (full left), and
    /// the pedal, −1 (full brake) to 1 (full throttle). After the end of an episode nothing
    /// happens until the next one begins.
    ///
    /// # Errors
    /// [`EnvironmentError::Action`]; the world is unchanged then.
    pub fn step(&mut self, action: [f32; 2]) -> Result<Step, EnvironmentError> {
        let [steer, pedal] = action;
        if !action.iter().all(|part| (-1.0..=1.0).contains(part)) {
            return Err(EnvironmentError::Action { steer, pedal });
        }
        if self.ending.is_some() {
            return Ok(Step { reward: 0.0, ending: self.ending });
        }
        let mut has_collided = false;
        for _ in 0..self.config.frames_per_step {
            self.simulation.request(control(self.ego, action));
            self.simulation.step();
            let collisions = self.simulation.sim().world().physics().collisions();
            has_collided |= collisions.iter().any(|c| c.actor == self.ego || c.other == self.ego);
        }
        self.action = action;
        self.steps += 1;
        self.at = self.course.locate(self.ego().pose.position(), &self.at);
        self.ending = self.find_ending(has_collided);
        Ok(Step { reward: self.reward(), ending: self.ending })
    }

    fn find_ending(&self, has_collided: bool) -> Option<Ending> {
        if has_collided {
            return Some(Ending::Collision);
        }
        if self.at.left_m.abs() > self.at.half_width_m + self.config.off_route_m {
            return Some(Ending::OffRoute);
        }
        if self.at.along_m >= self.course.length_m() - 1.0 {
            return Some(Ending::Arrival);
        }
        let is_over = self.config.steps_max != 0 && self.steps >= self.config.steps_max;
        is_over.then_some(Ending::Steps)
    }

    fn reward(&mut self) -> f32 {
        let rewards = &self.config.reward;
        let progress_m = (self.at.along_m - self.reached_m).max(0.0);
        self.reached_m += progress_m;
        let speed = (self.forward_mps() / self.at.limit_mps).clamp(0.0, 1.0);
        let last = match self.ending {
            Some(Ending::Arrival) => rewards.arrival,
            Some(Ending::Collision) => rewards.collision,
            Some(Ending::OffRoute) => rewards.off_route,
            Some(Ending::Steps) | None => 0.0,
        };
        rewards.per_metre * progress_m + rewards.speed * speed + last
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The state of the ego vehicle.
    pub fn ego(&self) -> &ActorState {
        // It is spawned at the beginning and never destroyed.
        self.simulation.sim().world().state(self.ego).expect("the ego vehicle exists")
    }

    /// Distance along the route, and its length. Metres.
    pub fn progress_m(&self) -> (f32, f32) {
        (self.at.along_m, self.course.length_m())
    }

    fn forward(&self) -> Vec2 {
        (self.ego().pose.rotation() * Vec3::X).truncate().normalize_or(Vec2::X)
    }

    fn forward_mps(&self) -> f32 {
        Vec3::from_array(self.ego().velocity_mps).truncate().dot(self.forward())
    }

    /// Returns the state vector:
    ///
    /// | index | value |
    /// |---|---|
    /// | 0 | forward speed / 30 m/s |
    /// | 1 | speed limit / 30 m/s |
    /// | 2 | distance to the left of the lane's centre / half the lane's width |
    /// | 3, 4 | sine and cosine of the heading, seen from the lane's, positive to the left |
    /// | 5 | yaw rate, rad/s |
    /// | 6, 7 | the last action |
    /// | 8 to 23 | x and y / 50 m of the points of the route 3, 6, 10, 15, 20, 30, 40 and 50 m ahead, in the frame of the ego vehicle |
    pub fn state(&self) -> [f32; STATE] {
        let (ego, forward) = (self.ego(), self.forward());
        let position = ego.pose.position();
        let mut state = [0.0; STATE];
        state[0] = self.forward_mps() / SPEED_SCALE_MPS;
        state[1] = self.at.limit_mps / SPEED_SCALE_MPS;
        state[2] = self.at.left_m / self.at.half_width_m.max(0.1);
        state[3] = self.at.tangent.perp_dot(forward);
        state[4] = self.at.tangent.dot(forward);
        state[5] = ego.angular_velocity_radps[2];
        [state[6], state[7]] = self.action;
        for (point, ahead_m) in state[8..].chunks_exact_mut(2).zip(AHEAD_M) {
            let offset = (self.course.ahead(&self.at, ahead_m) - position).truncate();
            point[0] = forward.dot(offset) / PLACE_SCALE_M;
            point[1] = forward.perp_dot(offset) / PLACE_SCALE_M;
        }
        state
    }

    /// Measures the lidar: for each ray the distance to the next actor or solid object, as a
    /// fraction of the range; 1 if there is none. Ray `i` of `n` points `i / n` of a turn to the
    /// left of straight ahead, from the middle of the ego vehicle, 0.8 m above its origin.
    pub fn lidar(&self, out: &mut Vec<f32>) {
        out.clear();
        out.resize(self.config.lidar_rays, self.config.lidar_range_m);
        if out.is_empty() {
            return;
        }
        let range_m = self.config.lidar_range_m;
        let origin = self.ego().pose.position() + Vec3::Z * LIDAR_HEIGHT_M;
        let lidar = Lidar { origin, forward: self.forward(), range_m };
        self.map.solids.for_each_near(origin.truncate(), range_m, |solid| lidar.meet(solid, out));
        for state in self.simulation.sim().states() {
            if state.actor_id != self.ego && !state.has(flag::KINEMATIC) {
                lidar.meet(&box_of(state), out);
            }
        }
        out.iter_mut().for_each(|distance| *distance /= range_m);
    }
}

/// Returns the bounding box of an actor, upright.
fn box_of(state: &ActorState) -> UprightBox {
    let blueprint = &town::catalogue()[state.blueprint as usize];
    let rotation = state.pose.rotation();
    UprightBox {
        center: state.pose.position() + rotation * blueprint.center_m,
        half_extents_m: blueprint.half_extents_m,
        axis: (rotation * Vec3::X).truncate().normalize_or(Vec2::X),
    }
}

fn control(actor_id: ActorId, [steer, pedal]: [f32; 2]) -> Command {
    Command::Control(VehicleControl {
        actor_id,
        throttle: pedal.max(0.0),
        brake: (-pedal).max(0.0),
        steer,
        ..VehicleControl::default()
    })
}

/// Creates the world of an episode at frame 0: ego vehicle, other vehicles, course.
fn begin(
    map: &EnvironmentMap,
    config: &Config,
    seed: u64,
) -> Result<(Simulation, ActorId, Course), EnvironmentError> {
    let mut random = RandomStream::named(seed, EPISODE);
    let mut places = map.places.clone();
    for last in (1..places.len()).rev() {
        places.swap(last, random.below(last + 1));
    }
    let course_from =
        |(at, _): &(LanePoint, Pose)| Course::new(&map.network, *at, config.route_m, &mut random);
    let found = places.iter().map(course_from).enumerate().find_map(|(index, c)| Some((index, c?)));
    let Some((index, course)) = found else {
        let (places, route_m) = (places.len(), config.route_m);
        return Err(EnvironmentError::NoRoute { places, route_m });
    };
    let (_, pose) = places.swap_remove(index);
    let mut simulation = map.blank.restarted(seed);
    let settings = Settings {
        delta_nanos: (f64::from(config.frame_s) * 1e6).round() as u64 * 1000,
        ..*simulation.sim().settings()
    };
    simulation.apply(Command::SetSettings(settings)).result()?;
    let spawn = Spawn { blueprint: Name::new(EGO), pose, ..Spawn::default() };
    let ego = ActorId(simulation.apply(Command::Spawn(spawn)).result()?);
    let start = course.start();
    let distance = |(_, pose): &(LanePoint, Pose)| pose.position().distance_squared(start);
    // The nearest places first: the other vehicles are where the ego vehicle drives.
    places.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let mut taken = vec![pose.position()];
    for (_, pose) in &places {
        if taken.len() == config.vehicles + 1 {
            break;
        }
        if taken.iter().any(|other| other.distance(pose.position()) < APART_M) {
            continue;
        }
        let blueprint = *random.choose(&map.cars);
        let spawn = Spawn { blueprint, pose: *pose, flags: flag::AUTOPILOT, ..Spawn::default() };
        if simulation.apply(Command::Spawn(spawn)).status == status::DONE {
            taken.push(pose.position());
        }
    }
    if taken.len() <= config.vehicles {
        let (found, wanted) = (taken.len() - 1, config.vehicles);
        return Err(EnvironmentError::NoPlace { found, wanted });
    }
    Ok((simulation, ego, course))
}
