//! A world of bicycle models that obeys a mind, and watches how it drives.

use std::sync::Arc;

use bus::{ActorId, ActorState, Frame, Pose, Stamp, VehicleControl, flag, kind};
use glam::{DVec3, Quat, Vec2, Vec3};
use road::{LaneTypes, Network};

use crate::Mind;
use crate::body::{Body, CAR};
use crate::route::shift_at;

pub(super) const DELTA_NANOS: u64 = 50_000_000;
const DELTA_S: f32 = 0.05;

/// A vehicle of the test world: a kinematic bicycle with a lazy drive train.
#[derive(Clone, Debug, Default)]
pub(super) struct Car {
    pub(super) position: Vec3,
    pub(super) yaw: f32,
    pub(super) speed: f32,
    acceleration: f32,
    yaw_rate: f32,
    pitch: f32,
    throttle: f32,
    brake: f32,
    wheels: f32,
}

/// What was seen of one vehicle.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    pub(super) driven_m: f32,
    pub(super) stood_s: f32,
    pub(super) longest_stand_s: f32,
    pub(super) stand_at: Vec3,
    pub(super) worst_offset_m: f32,
    pub(super) offset_at: Vec3,
    free_s: f32,
    free_share: f32,
}

pub(super) struct Course {
    pub(super) network: Arc<Network>,
    pub(super) mind: Mind,
    pub(super) stamp: Stamp,
    pub(super) cars: Vec<Car>,
    pub(super) lights: Vec<(u32, u32)>,
    pub(super) actors: Vec<ActorState>,
    pub(super) records: Vec<Record>,
    pub(super) touching: Vec<(usize, usize)>,
    pub(super) collisions: Vec<(f32, usize, usize, Vec3)>,
}

impl Course {
    /// Puts `count` vehicles onto spawn points spread over the map.
    pub(super) fn new(network: Arc<Network>, seed: u64, count: usize) -> Course {
        let points = network.spawn_points();
        let mut cars = Vec::new();
        // Strides through the points, so that any count is spread over the whole map.
        let stride = (points.len() / count.max(1)).max(1);
        for point in points.iter().step_by(stride).take(count) {
            let at = network.place(*point);
            cars.push(Car {
                position: at.position.as_vec3(),
                yaw: at.heading_rad as f32,
                ..Car::default()
            });
        }
        Course::with_cars(network, seed, cars)
    }

    pub(super) fn with_cars(network: Arc<Network>, seed: u64, cars: Vec<Car>) -> Course {
        let lights = (0..network.signals().len() as u32)
            .filter(|&signal| network.signals()[signal as usize].dynamic)
            .map(|signal| (signal, bus::light::RED))
            .collect();
        let mind = Mind::new(network.clone(), seed);
        let records = vec![Record::default(); cars.len()];
        let mut course = Course {
            network,
            mind,
            stamp: Stamp { episode: 1, ..Stamp::default() },
            cars,
            lights,
            actors: Vec::new(),
            records,
            touching: Vec::new(),
            collisions: Vec::new(),
        };
        course.snapshot();
        course
    }

    /// One frame: plan on the snapshot, move, and take the next snapshot.
    pub(super) fn tick(&mut self) {
        self.mind.plan(&self.stamp, DELTA_NANOS, &self.actors, &[]);
        self.advance();
    }

    /// Everything but planning.
    pub(super) fn advance(&mut self) {
        self.watch();
        let controls = self.mind.controls().to_vec();
        for (car, control) in self.cars.iter_mut().zip(&controls) {
            car.step(control);
        }
        for light in self.mind.lights() {
            let index = light.actor_id.0 as usize - 1 - self.cars.len();
            self.lights[index].1 = light.phase;
        }
        self.settle();
        self.stamp.frame = Frame(self.stamp.frame.0 + 1);
        self.stamp.sim_time_nanos += DELTA_NANOS;
        self.snapshot();
        self.collide();
    }

    /// What a vehicle does and why, for people.
    pub(super) fn describe(&self, row: usize) -> String {
        describe(&self.network, &self.mind, &self.cars[row], row)
    }
}

fn describe(network: &Network, mind: &Mind, car: &Car, row: usize) -> String {
    let rows = &mind.memory.rows;
    let tracks = &mind.map.tracks;
    let lanes: Vec<String> = rows.route[row]
        .lanes()
        .iter()
        .take(6)
        .map(|&lane| {
            let of = network.lane(road::LaneIndex(lane));
            let road = &network.roads()[of.road as usize].id;
            let junction = if tracks.in_junction(lane) { "J" } else { "" };
            format!("{road}/{}/{}{junction}({lane}:{:.0})", of.section, of.id, tracks.length(lane))
        })
        .collect();
    format!(
        "{} at {:.1} v {:.1} arc {:.1} order {} end {} passed {} wait {:.0} idle {:.0} shift {:.1} stuck {:.1} rev {:.1} | {} | {} {}",
        row + 1,
        car.position,
        car.speed,
        rows.arc_m[row],
        rows.order[row],
        rows.pass_end[row],
        rows.route[row].passed,
        rows.wait_s[row],
        rows.idle_s[row],
        rows.shift_m[row],
        rows.stuck_s[row],
        rows.reverse_s[row],
        mind.describe(row),
        lanes.join(" "),
        rows.route[row].lanes().len(),
    )
}

impl Course {
    fn snapshot(&mut self) {
        self.actors.clear();
        for (index, car) in self.cars.iter().enumerate() {
            let forward = Vec2::from_angle(car.yaw);
            self.actors.push(ActorState {
                actor_id: ActorId(index as u32 + 1),
                blueprint: u32::MAX,
                kind: kind::VEHICLE,
                flags: flag::AUTOPILOT,
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
    }

    /// Sets every vehicle onto the road below it.
    fn settle(&mut self) {
        for car in &mut self.cars {
            let at = DVec3::from(car.position.as_dvec3());
            if let Some(point) = self.network.nearest(at, LaneTypes::DRIVABLE) {
                let place = self.network.place(point);
                car.position.z = place.position.z as f32;
                let along = (car.yaw - place.heading_rad as f32).cos();
                car.pitch = -place.pitch_rad as f32 * along;
            }
        }
    }

    fn watch(&mut self) {
        let rows = &self.mind.memory.rows;
        let tracks = &self.mind.map.tracks;
        for (row, record) in self.records.iter_mut().enumerate() {
            let car = &self.cars[row];
            record.driven_m += car.speed.abs() * DELTA_S;
            record.stood_s = if car.speed.abs() < 0.1 { record.stood_s + DELTA_S } else { 0.0 };
            if record.stood_s > record.longest_stand_s {
                record.longest_stand_s = record.stood_s;
                record.stand_at = car.position;
            }
            let lane = rows.route[row].lane();
            let seat = tracks.project(lane, car.position.truncate(), rows.arc_m[row]);
            if std::env::var_os("OMNIBUS_DESCRIBE").is_some()
                && (seat.left_m - shift_at(rows, row, 0.0).0).abs() > 1.0
            {
                println!(
                    "off {:.2} seat {seat:?} {:?} t {:.2}",
                    seat.left_m,
                    lane,
                    self.stamp.sim_time_nanos as f32 * 1e-9
                );
                println!("{}", describe(&self.network, &self.mind, car, row));
            }
            let offset = (seat.left_m - shift_at(rows, row, 0.0).0).abs();
            if offset > record.worst_offset_m && rows.turning[row] == 0 {
                record.worst_offset_m = offset;
                record.offset_at = car.position;
            }
            if self.mind.is_free(row) {
                record.free_s += DELTA_S;
                record.free_share += DELTA_S * car.speed / tracks.limit_mps[lane as usize];
            }
        }
    }

    fn collide(&mut self) {
        let mut touching = Vec::new();
        for a in 0..self.cars.len() {
            for b in a + 1..self.cars.len() {
                if touch(&self.cars[a], &self.cars[b]) {
                    touching.push((a, b));
                    if !self.touching.contains(&(a, b)) {
                        let time = self.stamp.sim_time_nanos as f32 * 1e-9;
                        self.collisions.push((time, a, b, self.cars[a].position));
                    }
                }
            }
        }
        self.touching = touching;
    }

    /// Mean share of the limit while free, over all vehicles.
    pub(super) fn free_share(&self) -> f32 {
        let time: f32 = self.records.iter().map(|r| r.free_s).sum();
        self.records.iter().map(|r| r.free_share).sum::<f32>() / time.max(1e-3)
    }

    /// One line of all figures.
    pub(super) fn summary(&self) -> String {
        let seconds = self.stamp.sim_time_nanos as f32 * 1e-9;
        let of = |what: fn(&Record) -> f32| -> Vec<f32> { self.records.iter().map(what).collect() };
        let driven = of(|r| r.driven_m);
        let least = driven.iter().copied().fold(f32::INFINITY, f32::min);
        let mean = driven.iter().sum::<f32>() / driven.len() as f32;
        let (jam, jam_at) = self.worst(|r| (r.longest_stand_s, r.stand_at));
        let (offset, offset_at) = self.worst(|r| (r.worst_offset_m, r.offset_at));
        format!(
            "{} vehicles, {seconds:.0} s: driven mean {mean:.0} m, least {least:.0} m; free {:.2} of the limit; \
             longest stand {jam:.0} s at {jam_at:.0}; worst offset {offset:.2} m at {offset_at:.0}; collisions {}",
            self.cars.len(),
            self.free_share(),
            self.collisions.len(),
        )
    }

    /// The vehicle for which a figure is largest, the figure, and where.
    pub(super) fn worst(&self, of: impl Fn(&Record) -> (f32, Vec3)) -> (f32, Vec3) {
        self.records.iter().map(of).max_by(|a, b| a.0.total_cmp(&b.0)).expect("a vehicle")
    }
}

impl Car {
    fn step(&mut self, control: &VehicleControl) {
        let lag = |value: &mut f32, wanted: f32, time: f32| {
            *value += (wanted - *value) * (DELTA_S / time).min(1.0);
        };
        lag(&mut self.throttle, control.throttle, 0.25);
        lag(&mut self.brake, control.brake, 0.12);
        let share =
            1.0 - 0.018 * self.speed.abs().min(5.6) - 0.007 * (self.speed.abs() - 5.6).max(0.0);
        let wheels = control.steer.clamp(-1.0, 1.0) * 0.61 * share;
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
        // The origin is the middle of the wheelbase, so it slips sideways in curves.
        let slip = (0.5 * self.wheels.tan()).atan();
        self.yaw_rate = self.speed * slip.sin() * 2.0 / CAR.wheelbase_m;
        let heading = self.yaw + 0.5 * self.yaw_rate * DELTA_S + slip;
        self.position += (Vec2::from_angle(heading) * self.speed * DELTA_S).extend(0.0);
        self.yaw += self.yaw_rate * DELTA_S;
    }
}

fn touch(a: &Car, b: &Car) -> bool {
    let to = b.position - a.position;
    if to.z.abs() > 2.5 || to.truncate().length_squared() > 36.0 {
        return false;
    }
    let Body { front_m, half_width_m, .. } = CAR;
    let (forward_a, forward_b) = (Vec2::from_angle(a.yaw), Vec2::from_angle(b.yaw));
    let axes = [forward_a, forward_a.perp(), forward_b, forward_b.perp()];
    axes.iter().all(|axis| {
        let reach = |forward: Vec2| {
            front_m * axis.dot(forward).abs() + half_width_m * axis.dot(forward.perp()).abs()
        };
        to.truncate().dot(*axis).abs() <= reach(forward_a) + reach(forward_b)
    })
}
