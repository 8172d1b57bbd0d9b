//! A world of bicycle models that follows a planner's controls and measures how they drive.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use protocol::{
    ActorId, ActorState, Frame, JournalEntry, Pose, Stamp, VehicleControl, flag, kind, light,
};
use road::{LaneIndex, LaneTypes, Network};

use crate::{
    Planner,
    body::{Bodies, Body, CAR},
    obstacles::Footprint,
    tracks::NONE,
};

pub(crate) const DELTA_NANOS: u64 = 50_000_000;
pub(crate) const DELTA_S: f32 = 0.05;

/// A vehicle of the test world: a bicycle with the slip angles of tyres in a steady curve, and a delayed
/// drive train.
#[derive(Clone, Debug, Default)]
pub(crate) struct Car {
    pub(crate) position: Vec3,
    pub(crate) yaw: f32,
    pub(crate) speed: f32,
    /// Whether it stands still, without a planner.
    pub(crate) parked: bool,
    /// Blueprint and dimensions, if it is not one of those that plan as cars.
    pub(crate) built: Option<(u32, Body)>,
    pub(crate) acceleration: f32,
    pub(crate) yaw_rate: f32,
    pub(crate) lateral_mps2: f32,
    pub(crate) pitch: f32,
    pub(crate) throttle: f32,
    pub(crate) brake: f32,
    pub(crate) wheels: f32,
    pub(crate) driven_m: f32,
    pub(crate) stood_s: f32,
    pub(crate) longest_stand_s: f32,
}

/// A walker of the test world: it moves as its control says.
#[derive(Clone, Debug, Default)]
pub(crate) struct Foot {
    pub(crate) position: Vec2,
    pub(crate) velocity: Vec2,
    pub(crate) yaw: f32,
    /// Whether it stands still, without a planner.
    pub(crate) stands: bool,
}

/// Half the width of a walker.
pub(crate) const FOOT_RADIUS_M: f32 = 0.22;

/// A map, a planner, vehicles and walkers; vehicle `n` is actor `n + 1`.
pub(crate) struct Course {
    pub(crate) network: Arc<Network>,
    pub(crate) planner: Planner,
    pub(crate) stamp: Stamp,
    pub(crate) cars: Vec<Car>,
    /// The blueprint of all of them; by default none, which plans as a car.
    pub(crate) vehicle_blueprint: u32,
    /// Walkers, whose ids follow those of the lights.
    pub(crate) feet: Vec<Foot>,
    /// Vehicles and walkers that touched each other.
    pub(crate) hits: Vec<(usize, usize)>,
    /// Signal and state of every light.
    lights: Vec<(u32, u32)>,
    pub(crate) actors: Vec<ActorState>,
    /// Pairs of vehicles that collided.
    pub(crate) collisions: Vec<(usize, usize)>,
    /// Vehicles whose fronts passed the line before a light, and the state of the light.
    pub(crate) crossings: Vec<(usize, u32)>,
    /// By vehicle: the next lane of a junction with a light, and the distance to its line.
    lines: BTreeMap<usize, (u32, f32)>,
}

impl Course {
    /// Creates a world with `count` vehicles on spawn points spread over the map.
    pub(crate) fn new(network: Arc<Network>, seed: u64, count: usize) -> Course {
        let points = network.spawn_points();
        // A stride through the points spreads any count over the whole map.
        let stride = (points.len() / count.max(1)).max(1);
        let cars = points
            .iter()
            .step_by(stride)
            .take(count)
            .map(|&point| {
                let at = network.place(point);
                let (position, yaw) = (at.position.as_vec3(), at.heading_rad as f32);
                Car { position, yaw, ..Car::default() }
            })
            .collect();
        Course::with_cars(network, seed, cars)
    }

    pub(crate) fn with_cars(network: Arc<Network>, seed: u64, cars: Vec<Car>) -> Course {
        let lights = (0..network.signals().len() as u32)
            .filter(|&signal| network.signals()[signal as usize].dynamic)
            .map(|signal| (signal, light::RED))
            .collect();
        let mut course = Course {
            planner: Planner::new(network.clone(), seed),
            network,
            stamp: Stamp { episode: 1, ..Stamp::default() },
            cars,
            vehicle_blueprint: u32::MAX,
            feet: Vec::new(),
            hits: Vec::new(),
            lights,
            actors: Vec::new(),
            collisions: Vec::new(),
            crossings: Vec::new(),
            lines: BTreeMap::new(),
        };
        course.snapshot();
        course
    }

    /// Runs one frame: plans on the snapshot, moves the vehicles, and takes the next snapshot.
    pub(crate) fn tick(&mut self) {
        self.tick_with(&[]);
    }

    /// Runs one frame with the commands of a journal.
    pub(crate) fn tick_with(&mut self, journal: &[JournalEntry]) {
        self.planner.plan(DELTA_NANOS, &self.actors, journal);
        self.advance();
    }

    /// Runs one frame without planning.
    pub(crate) fn advance(&mut self) {
        self.watch_lines();
        for control in self.planner.controls() {
            self.cars[control.actor_id.0 as usize - 1].step(control);
        }
        for light in self.planner.lights() {
            let index = light.actor_id.0 as usize - 1 - self.cars.len();
            self.lights[index].1 = light.phase;
        }
        for control in self.planner.walker_controls() {
            let foot = control.actor_id.0 as usize - 1 - self.cars.len() - self.lights.len();
            self.feet[foot].step(Vec2::from(control.direction) * control.speed_mps);
        }
        self.settle();
        self.stamp.frame = Frame(self.stamp.frame.0 + 1);
        self.stamp.sim_time_nanos += DELTA_NANOS;
        self.snapshot();
        self.collide();
        self.hit();
    }

    /// Adds a walker on autopilot; call [`Course::snapshot`] after the last one.
    pub(crate) fn add_foot(&mut self, position: Vec2) -> ActorId {
        self.feet.push(Foot { position, ..Foot::default() });
        self.foot_id(self.feet.len() - 1)
    }

    /// Returns the id of a walker.
    pub(crate) fn foot_id(&self, foot: usize) -> ActorId {
        ActorId((self.cars.len() + self.lights.len() + foot) as u32 + 1)
    }

    /// Returns what a light shows.
    pub(crate) fn light(&self, signal: u32) -> u32 {
        self.lights.iter().find(|light| light.0 == signal).expect("a light of the map").1
    }

    pub(crate) fn time_s(&self) -> f32 {
        self.stamp.sim_time_nanos as f32 * 1e-9
    }

    pub(crate) fn snapshot(&mut self) {
        self.actors.clear();
        for (index, car) in self.cars.iter().enumerate() {
            let forward = Vec2::from_angle(car.yaw);
            self.actors.push(ActorState {
                actor_id: ActorId(index as u32 + 1),
                blueprint: car.built.map_or(self.vehicle_blueprint, |built| built.0),
                kind: kind::VEHICLE,
                flags: if car.parked { 0 } else { flag::AUTOPILOT },
                pose: Pose::new(
                    car.position,
                    Quat::from_rotation_z(car.yaw) * Quat::from_rotation_y(-car.pitch),
                ),
                velocity_mps: (forward * car.speed).extend(0.0).to_array(),
                angular_velocity_radps: [0.0, 0.0, car.yaw_rate],
                acceleration_mps2: (forward * car.acceleration).extend(0.0).to_array(),
                ..ActorState::default()
            });
        }
        for (index, &(signal, phase)) in self.lights.iter().enumerate() {
            self.actors.push(ActorState {
                actor_id: ActorId((self.cars.len() + index + 1) as u32),
                kind: kind::TRAFFIC_LIGHT,
                phase,
                signal,
                ..ActorState::default()
            });
        }
        self.push_feet();
    }

    fn push_feet(&mut self) {
        for (index, foot) in self.feet.iter().enumerate() {
            self.actors.push(ActorState {
                actor_id: self.foot_id(index),
                blueprint: walker_blueprint(),
                kind: kind::WALKER,
                flags: if foot.stands { 0 } else { flag::AUTOPILOT },
                pose: Pose::level(foot.position.extend(0.0), foot.yaw),
                velocity_mps: foot.velocity.extend(0.0).to_array(),
                ..ActorState::default()
            });
        }
    }

    /// Puts every vehicle onto the road below it, and measures its progress.
    fn settle(&mut self) {
        for car in &mut self.cars {
            let at = car.position.as_dvec3();
            if let Some(point) = self.network.nearest(at, LaneTypes::DRIVABLE) {
                let place = self.network.place(point);
                car.position.z = place.position.z as f32;
                let along = (car.yaw - place.heading_rad as f32).cos();
                car.pitch = -place.pitch_rad as f32 * along;
            }
            car.driven_m += car.speed.abs() * DELTA_S;
            car.stood_s = if car.speed.abs() < 0.1 { car.stood_s + DELTA_S } else { 0.0 };
            car.longest_stand_s = car.longest_stand_s.max(car.stood_s);
        }
    }

    /// Records vehicles that pass the line before a light, and the state of the light.
    fn watch_lines(&mut self) {
        let (tracks, approaches) = (&self.planner.map.tracks, &self.planner.map.approaches);
        for vehicle_plan in self.planner.vehicle_plans() {
            let car = vehicle_plan.actor_id.0 as usize - 1;
            let vehicles = &self.planner.state.vehicles;
            let row = vehicles
                .binary_search_by_key(&vehicle_plan.actor_id.0, |vehicle| vehicle.id)
                .unwrap();
            let lanes = vehicles[row].route.lanes();
            let mut begins = -vehicle_plan.along_m - CAR.front_m;
            let mut next = None;
            for &lane in lanes {
                let line_m = begins - approaches.line_m[lane as usize];
                if approaches.signal[lane as usize] != NONE && line_m > -8.0 {
                    next = Some((lane, line_m));
                    break;
                }
                begins += tracks.length(lane);
            }
            let before = self.lines.get(&car).copied();
            if let (Some((lane, line_m)), Some((old_lane, old_m))) = (next, before)
                && lane == old_lane
                && old_m > 0.0
                && line_m <= 0.0
            {
                let signal = approaches.signal[lane as usize];
                let light_states = self.lights.iter().find(|light| light.0 == signal).unwrap().1;
                self.crossings.push((car, light_states));
            }
            match next {
                Some(next) => self.lines.insert(car, next),
                None => self.lines.remove(&car),
            };
        }
    }

    fn collide(&mut self) {
        for a in 0..self.cars.len() {
            for b in a + 1..self.cars.len() {
                if touch(&self.cars[a], &self.cars[b]) && !self.collisions.contains(&(a, b)) {
                    self.collisions.push((a, b));
                }
            }
        }
    }

    /// Records vehicles that touch walkers.
    fn hit(&mut self) {
        for (at, car) in self.cars.iter().enumerate() {
            for (on_foot, foot) in self.feet.iter().enumerate() {
                let way = foot.position - car.position.truncate();
                let forward = Vec2::from_angle(car.yaw);
                let beside = Vec2::new(way.dot(forward).abs(), way.dot(forward.perp()).abs())
                    - Vec2::new(CAR.front_m, CAR.half_width_m);
                let touches = beside.max(Vec2::ZERO).length() < FOOT_RADIUS_M;
                if touches && !self.hits.contains(&(at, on_foot)) {
                    self.hits.push((at, on_foot));
                }
            }
        }
    }

    /// Returns the OpenDRIVE id of the road that a vehicle's planner follows.
    pub(crate) fn road_of(&self, car: usize) -> String {
        let vehicle_plan = self.planner.vehicle_plans().nth(car).expect("the vehicle is on a road");
        let road = self.network.lane(LaneIndex(vehicle_plan.lane.0)).road;
        self.network.roads()[road as usize].id.clone()
    }
}

impl Car {
    /// Returns the vehicle built as a blueprint.
    pub(crate) fn built_as(self, id: &str) -> Car {
        let (blueprint, _) = town::blueprint(id).expect("a blueprint of the catalogue");
        Car { built: Some((blueprint, Bodies::from_catalogue().of(blueprint))), ..self }
    }

    pub(crate) fn body(&self) -> Body {
        self.built.map_or(CAR, |built| built.1)
    }

    fn step(&mut self, control: &VehicleControl) {
        if self.parked {
            return;
        }
        let body = self.body();
        let lag = |value: &mut f32, target: f32, time: f32| {
            *value += (target - *value) * (DELTA_S / time).min(1.0);
        };
        lag(&mut self.throttle, control.throttle, 0.25);
        lag(&mut self.brake, control.brake, 0.12);
        let factor =
            1.0 - 0.018 * self.speed.abs().min(5.6) - 0.007 * (self.speed.abs() - 5.6).max(0.0);
        let wheels = control.steer.clamp(-1.0, 1.0) * body.max_steer_rad * factor;
        let turn = (wheels - self.wheels).clamp(-2.5 * DELTA_S, 2.5 * DELTA_S);
        self.wheels += turn;
        let direction = if control.flags & flag::REVERSE != 0 { -1.0 } else { 1.0 };
        let push = self.throttle * f32::min(4.2, 75.0 / self.speed.abs().max(1.0));
        let before = self.speed;
        self.speed += DELTA_S * (direction * push - 9.81 * self.pitch.sin());
        let resistance = 0.12 + 0.0005 * self.speed * self.speed + 8.0 * self.brake;
        let slowed = (self.speed.abs() - DELTA_S * resistance).max(0.0);
        self.speed = slowed * self.speed.signum();
        self.acceleration = (self.speed - before) / DELTA_S;
        // The tyres run outwards by their slip angles.
        lag(&mut self.lateral_mps2, self.speed * self.yaw_rate, 0.12);
        let [front_slip, rear_slip] = body.slip_radps2pm().map(|of| of * self.lateral_mps2);
        // The origin is the middle of the wheelbase, so that it has a sideslip angle in curves.
        let slip = (0.5 * (self.wheels - front_slip + rear_slip).tan()).atan();
        self.yaw_rate = self.speed * slip.sin() * 2.0 / body.wheelbase_m;
        let heading = self.yaw + 0.5 * self.yaw_rate * DELTA_S + slip - rear_slip;
        self.position += (Vec2::from_angle(heading) * self.speed * DELTA_S).extend(0.0);
        self.yaw += self.yaw_rate * DELTA_S;
    }
}

impl Foot {
    fn step(&mut self, velocity: Vec2) {
        if !self.stands {
            self.velocity = velocity;
            self.position += velocity * DELTA_S;
            if velocity != Vec2::ZERO {
                self.yaw = velocity.to_angle();
            }
        }
    }
}

/// Returns the index of a blueprint of a walker.
fn walker_blueprint() -> u32 {
    let is_walker = |blueprint: &town::Blueprint| blueprint.id.starts_with("walker.");
    town::catalogue().iter().position(is_walker).expect("the catalogue has walkers") as u32
}

fn touch(a: &Car, b: &Car) -> bool {
    let to = b.position - a.position;
    if to.z.abs() > 2.5 || to.truncate().length_squared() > 196.0 {
        return false;
    }
    let footprint = |car: &Car| {
        let forward = Vec2::from_angle(car.yaw);
        Footprint::of(&car.body(), car.position.truncate(), forward)
    };
    footprint(a).touches(&footprint(b))
}
