//! The node: a client of the simulator on one side, a participant of DDS on the other.

use std::{
    f32::consts::FRAC_PI_2,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use client_lib::{
    ActorId, ActorKind, Client, ClientError, Command, Controller, Frame, GnssOptions, ImuOptions,
    Measurement, Observer, Pace, Pose, Projection, Sensor, SensorBundle, Spawn, VehicleControl,
    Waiter,
    glam::{Quat, Vec3},
    wire::{SensorSpec, output},
};

use crate::{
    DOMAIN_MAX,
    error::Ros2Error,
    messages::{self, EgoControl, Header, Motion},
    participant::{Deliver, Participant, Topic},
    topics::{Fixed, GNSS, IMU, Publications, SensorTopic, topic},
};

/// How long a wait lasts before the node looks whether it is to end.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// The coordinate frame of the world.
const WORLD: &str = "map";

/// What a node serves, and how.
#[derive(Clone, Debug)]
pub struct NodeOptions {
    /// The role name of the vehicle: part of its topics, and its coordinate frame.
    pub role: String,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Cameras and lidars on it.
    pub sensors: Vec<SensorSpec>,
    /// The domain of DDS, `ROS_DOMAIN_ID`.
    pub domain: u16,
    /// Whether participants of other machines are served.
    pub is_network: bool,
    /// Whether every frame waits until it is published.
    pub is_in_barrier: bool,
}

/// The vehicle of a node.
#[derive(Clone, Debug)]
pub enum Vehicle {
    /// One that exists.
    Existing(ActorId),
    /// One that the node spawns, and destroys when it ends.
    Spawned {
        /// Its blueprint.
        blueprint: String,
        /// The number of its spawn point; `None`: the first that is free.
        spawn_point: Option<usize>,
        /// Whether traffic drives it.
        is_on_autopilot: bool,
    },
}

/// What a node has published.
#[derive(Clone, Copy, Debug, Default)]
pub struct Published {
    /// Frames whose state was published.
    pub frames: u64,
    /// Frames of cameras and lidars that were published.
    pub measurements: u64,
    /// Frames between them that the renderer did not measure, or that newer ones have passed.
    pub missed: u64,
}

/// A node that is ready.
pub struct Node {
    observer: Observer,
    outlet: Outlet,
    motion: SensorBundle,
    rendered: Mutex<Rendered>,
    controller: Arc<Mutex<Controller>>,
    vehicle: ActorId,
    is_own_vehicle: bool,
    is_in_barrier: bool,
}

/// Where messages go, and under which names.
struct Outlet {
    participant: Participant,
    sensors: Vec<SensorTopic>,
    specs: Vec<SensorSpec>,
    topics: Vec<Topic>,
    role: String,
    /// Frame and `vehicle_from_frame` of each sensor.
    mounts: Vec<(String, Pose)>,
}

/// Cameras and lidars; `None` if there are none.
struct Rendered {
    bundle: Option<SensorBundle>,
    published: u64,
    passed: u64,
}

/// Nothing that a panic could leave half done is kept under these locks.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Node {
    /// Mounts the sensors and opens the topics.
    ///
    /// # Errors
    ///
    /// [`Ros2Error`]: the vehicle, a name, the domain or a sensor is not possible.
    pub fn start(mut client: Client, options: &NodeOptions) -> Result<Node, Ros2Error> {
        let NodeOptions { role, domain, sensors: specs, .. } = options;
        if *domain > DOMAIN_MAX {
            return Err(Ros2Error::Domain { domain: *domain });
        }
        let Publications { topics, sensors } = Publications::new(role, specs)?;
        let (vehicle, is_own_vehicle) = match &options.vehicle {
            Vehicle::Existing(actor) => (check_vehicle(&client, *actor)?, false),
            Vehicle::Spawned { blueprint, spawn_point, is_on_autopilot } => {
                let spawn = |place| {
                    let spawn = Spawn::new(blueprint, place).role(role);
                    if *is_on_autopilot { spawn.autopilot() } else { spawn }
                };
                (spawn_vehicle(&mut client, *spawn_point, spawn)?, true)
            }
        };
        let imu = Sensor::imu("imu", Pose::IDENTITY, ImuOptions::default());
        let gnss = Sensor::gnss("gnss", Pose::IDENTITY, GnssOptions::default());
        let motion = client.create_bundle("ros2_motion", vehicle, [imu, gnss], 2)?;
        let bundle = match specs.as_slice() {
            [] => None,
            specs => Some(client.create_bundle("ros2", vehicle, specs, 2)?),
        };
        let rendered = Mutex::new(Rendered { bundle, published: 0, passed: 0 });
        let (observer, controller) = client.split();
        let controller = Arc::new(Mutex::new(controller));
        let subscriptions = subscriptions(role, vehicle, &controller);
        let participant =
            Participant::open("omnibus", *domain, options.is_network, &topics, subscriptions)?;
        let mounts = mounts(role, specs);
        let (role, specs) = (role.clone(), specs.clone());
        let outlet = Outlet { participant, sensors, specs, topics, role, mounts };
        let is_in_barrier = options.is_in_barrier;
        Ok(Node {
            observer,
            outlet,
            motion,
            rendered,
            controller,
            vehicle,
            is_own_vehicle,
            is_in_barrier,
        })
    }

    /// The vehicle.
    #[must_use]
    pub fn vehicle(&self) -> ActorId {
        self.vehicle
    }

    /// Returns the names of the topics and the types of their messages.
    pub fn topics(&self) -> impl Iterator<Item = (&str, &'static str)> {
        self.outlet.topics.iter().map(|topic| (topic.name.as_str(), topic.message))
    }

    /// Publishes until `stop` is set, the simulator ends, or the vehicle is gone.
    ///
    /// # Errors
    ///
    /// [`Ros2Error::Client`] if the simulator has ended or another map was loaded;
    /// [`Ros2Error::VehicleGone`].
    pub fn run(mut self, stop: &AtomicBool) -> Result<Published, Ros2Error> {
        if self.is_in_barrier {
            lock(&self.controller).join_barrier()?;
        }
        let waiter = self.observer.waiter();
        let is_over = AtomicBool::new(false);
        let Node { observer, outlet, motion, rendered, controller, vehicle, is_in_barrier, .. } =
            &mut self;
        let (outlet, rendered, is_in_barrier) = (&*outlet, &*rendered, *is_in_barrier);
        let is_done = || stop.load(Ordering::Acquire) || is_over.load(Ordering::Acquire);
        let measuring = || {
            let measured = follow_measurements(outlet, rendered, &waiter, is_in_barrier, is_done);
            is_over.store(true, Ordering::Release);
            measured
        };
        let ended = std::thread::scope(|scope| {
            let thread = std::thread::Builder::new().name("ros2-sensors".to_owned());
            let thread = thread.spawn_scoped(scope, measuring).map_err(Ros2Error::Thread)?;
            let mut states =
                States { observer, outlet, motion, vehicle: *vehicle, is_seen: false, frames: 0 };
            let followed = states.follow(&waiter, is_done, || {
                if is_in_barrier {
                    lock(rendered).publish(outlet, false)?;
                    lock(controller).arrive();
                }
                Ok(())
            });
            is_over.store(true, Ordering::Release);
            // A panic there is a panic here.
            let measured = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            measured.and(followed)
        });
        if self.is_own_vehicle && !matches!(ended, Err(Ros2Error::VehicleGone { .. })) {
            // If the simulator has ended, the vehicle has, too.
            let _ = lock(&self.controller).send(&[Command::destroy(self.vehicle)]);
        }
        let rendered = lock(&self.rendered);
        let missed = rendered.passed + rendered.bundle.as_ref().map_or(0, SensorBundle::missed);
        ended.map(|frames| Published { frames, measurements: rendered.published, missed })
    }
}

fn check_vehicle(client: &Client, actor: ActorId) -> Result<ActorId, Ros2Error> {
    let world = client.world();
    let problem = match world.actor(actor) {
        Some(found) if found.kind() == ActorKind::Vehicle => return Ok(actor),
        Some(_) => "is no vehicle",
        None => "does not exist",
    };
    let all = world.actors().iter().filter(|actor| actor.kind() == ActorKind::Vehicle);
    let vehicles = all.map(|vehicle| {
        let blueprint = client.blueprints().get(vehicle.blueprint());
        format!("{} ({})", vehicle.id().0, blueprint.map_or("", |blueprint| &blueprint.id))
    });
    Err(Ros2Error::NoVehicle { actor, problem, vehicles: vehicles.collect() })
}

fn spawn_vehicle(
    client: &mut Client,
    spawn_point: Option<usize>,
    spawn: impl Fn(Pose) -> Spawn,
) -> Result<ActorId, Ros2Error> {
    let places = client.spawn_points()?;
    if let Some(number) = spawn_point {
        let place =
            places.get(number).ok_or(Ros2Error::SpawnPoint { number, count: places.len() })?;
        return Ok(client.spawn(spawn(*place))?);
    }
    for place in &places {
        match client.spawn(spawn(*place)) {
            Err(e) if e.refusal() == Some(client_lib::RefusalCode::SpawnCollision) => {}
            spawned => return Ok(spawned?),
        }
    }
    Err(Ros2Error::NoPlace { count: places.len() })
}

/// Returns the topics that the node reads, and what it does with their messages.
fn subscriptions(
    role: &str,
    vehicle: ActorId,
    controller: &Arc<Mutex<Controller>>,
) -> Vec<(Topic, Deliver)> {
    let (for_control, for_autopilot) = (Arc::clone(controller), Arc::clone(controller));
    let control: Deliver = Box::new(move |message| {
        let Some(control) = EgoControl::read(message) else {
            log::warn!(
                "a vehicle_control_cmd was ignored: it is damaged, or a number is not finite"
            );
            return;
        };
        if let Err(e) = lock(&for_control).control(&[pedals(vehicle, &control)]) {
            log::warn!("a vehicle_control_cmd was lost: {e}");
        }
    });
    let autopilot: Deliver = Box::new(move |message| {
        let Some(is_on) = messages::read_bool(message) else { return };
        if let Err(e) = lock(&for_autopilot).send(&[Command::set_autopilot(vehicle, is_on)]) {
            log::warn!("an enable_autopilot was lost: {e}");
        }
    });
    let of_vehicle = |name: &str| format!("/carla/{role}/{name}");
    vec![
        (
            topic(of_vehicle("vehicle_control_cmd"), "carla_msgs/msg/CarlaEgoVehicleControl"),
            control,
        ),
        (topic(of_vehicle("enable_autopilot"), "std_msgs/msg/Bool"), autopilot),
    ]
}

fn pedals(actor_id: ActorId, control: &EgoControl) -> VehicleControl {
    VehicleControl {
        actor_id,
        throttle: control.throttle.clamp(0.0, 1.0),
        brake: control.brake.clamp(0.0, 1.0),
        // CARLA counts to the right.
        steer: -control.steer.clamp(-1.0, 1.0),
        handbrake: control.hand_brake,
        reverse: control.reverse,
        gear: control.manual_gear_shift.then_some(control.gear),
    }
}

/// Returns the coordinate frame of each sensor. That of a camera is optical: x right, y down,
/// z forward (REP 103).
fn mounts(role: &str, specs: &[SensorSpec]) -> Vec<(String, Pose)> {
    let sensor_from_optical = Quat::from_rotation_z(-FRAC_PI_2) * Quat::from_rotation_x(-FRAC_PI_2);
    let optical = Pose::new(Vec3::ZERO, sensor_from_optical);
    let mount = |spec: &SensorSpec| {
        let is_lidar = spec.kind == client_lib::wire::sensor::LIDAR;
        let vehicle_from_sensor = spec.parent_from_sensor;
        let pose = if is_lidar { vehicle_from_sensor } else { vehicle_from_sensor.then(&optical) };
        (format!("{role}/{}", spec.name.as_str()), pose)
    };
    let of_motion = ["imu", "gnss"].map(|name| (format!("{role}/{name}"), Pose::IDENTITY));
    of_motion.into_iter().chain(specs.iter().map(mount)).collect()
}

/// The part of a node that follows snapshots and the sensors of motion.
struct States<'a> {
    observer: &'a mut Observer,
    outlet: &'a Outlet,
    motion: &'a mut SensorBundle,
    vehicle: ActorId,
    is_seen: bool,
    frames: u64,
}

impl States<'_> {
    /// Publishes each frame that is seen, and calls `after` behind it. Returns their number.
    fn follow(
        &mut self,
        waiter: &Waiter,
        is_done: impl Fn() -> bool,
        mut after: impl FnMut() -> Result<(), Ros2Error>,
    ) -> Result<u64, Ros2Error> {
        while !is_done() {
            if waiter.next_frame(self.observer.frame(), LOOK_EVERY)?.is_none() {
                continue;
            }
            if self.observer.refresh()? {
                self.motion.check(self.observer.episode())?;
                self.publish()?;
                after()?;
                self.frames += 1;
            }
        }
        Ok(self.frames)
    }

    fn publish(&mut self) -> Result<(), Ros2Error> {
        let (settings, world) = (self.observer.settings(), self.observer.world());
        let (stamp, frame, outlet) = (world.sim_time(), world.frame(), self.outlet);
        outlet.publish(Fixed::Clock, || messages::clock(stamp));
        let is_synchronous = settings.pace == Pace::Synchronous;
        outlet.publish(Fixed::Status, || messages::status(frame.0, settings.delta, is_synchronous));
        let Some(car) = world.actor(self.vehicle) else {
            return self.gone(frame);
        };
        self.is_seen = true;
        let (role, in_world) = (&outlet.role, Header { stamp, frame_id: WORLD });
        let vehicle_from_world = car.pose().rotation().inverse();
        let motion = Motion {
            pose: car.pose(),
            velocity: vehicle_from_world * car.velocity(),
            angular_velocity: vehicle_from_world * car.angular_velocity(),
        };
        outlet.publish(Fixed::Odometry, || messages::odometry(in_world, role, &motion));
        outlet.publish(Fixed::Speedometer, || messages::float32(motion.velocity.x));
        let rotation = car.pose().rotation();
        if let Some(state) = car.vehicle() {
            let (speed, acceleration) = (car.speed_mps(), car.acceleration());
            outlet.publish(Fixed::VehicleStatus, || {
                messages::vehicle_status(in_world, speed, acceleration, rotation, &state)
            });
        }
        outlet.publish(Fixed::Transforms, || {
            let of_vehicle = Header { stamp, frame_id: role };
            let mounts =
                outlet.mounts.iter().map(|(name, pose)| (of_vehicle, name.as_str(), *pose));
            let all: Vec<_> =
                std::iter::once((in_world, role.as_str(), car.pose())).chain(mounts).collect();
            messages::transforms(&all)
        });
        if let Some(measured) = self.motion.latest()? {
            outlet.publish_motion(&measured);
        }
        Ok(())
    }

    /// A vehicle that was spawned just now is not in the world before the next frame.
    fn gone(&self, frame: Frame) -> Result<(), Ros2Error> {
        if !self.is_seen {
            return Ok(());
        }
        let (role, actor) = (self.outlet.role.clone(), self.vehicle);
        Err(Ros2Error::VehicleGone { role, actor, frame })
    }
}

/// Publishes what cameras and lidars measure, each frame's as soon as it is complete.
fn follow_measurements(
    outlet: &Outlet,
    rendered: &Mutex<Rendered>,
    waiter: &Waiter,
    is_in_barrier: bool,
    is_done: impl Fn() -> bool,
) -> Result<(), Ros2Error> {
    while !is_done() {
        let look = || {
            let is_published = lock(rendered).publish(outlet, !is_in_barrier);
            is_published.map(|is_published| is_published.then_some(())).transpose()
        };
        waiter.until(LOOK_EVERY, look)?.transpose()?;
    }
    Ok(())
}

impl Rendered {
    /// Publishes what has come: all, or the newest. Returns whether there was anything.
    fn publish(&mut self, outlet: &Outlet, is_newest_only: bool) -> Result<bool, ClientError> {
        let Some(bundle) = &mut self.bundle else { return Ok(false) };
        let mut last: Option<Measurement> = None;
        let mut is_any = false;
        while let Some(next) = bundle.receive()? {
            is_any = true;
            if !is_newest_only {
                outlet.publish_rendered(&next);
                self.published += 1;
            } else if last.replace(next).is_some() {
                self.passed += 1;
            }
        }
        if let Some(last) = last {
            outlet.publish_rendered(&last);
            self.published += 1;
        }
        Ok(is_any)
    }
}

impl Outlet {
    /// Publishes a message, if there are subscribers.
    fn publish(&self, which: Fixed, message: impl FnOnce() -> Vec<u8>) {
        self.publish_at(which as usize, message);
    }

    fn publish_at(&self, publication: usize, message: impl FnOnce() -> Vec<u8>) {
        if self.participant.has_subscribers(publication) {
            self.participant.publish(publication, message());
        }
    }

    fn publish_motion(&self, measured: &Measurement) {
        let header =
            |mount: usize| Header { stamp: measured.sim_time(), frame_id: &self.mounts[mount].0 };
        let rotation = measured.world_from_parent().rotation();
        if let Some(imu) = measured.imu(IMU) {
            self.publish(Fixed::Imu, || messages::imu(header(IMU), rotation, &imu));
        }
        if let Some(gnss) = measured.gnss(GNSS) {
            self.publish(Fixed::Gnss, || messages::fix(header(GNSS), &gnss));
        }
    }

    fn publish_rendered(&self, measured: &Measurement) {
        for topic in &self.sensors {
            let header = Header { stamp: measured.sim_time(), frame_id: &topic.frame_id };
            let Some(info) = topic.info else {
                if let Some(cloud) = measured.point_cloud(topic.sensor) {
                    self.publish_at(topic.publication, || messages::point_cloud(header, &cloud));
                }
                continue;
            };
            let Some(data) = measured.data(topic.sensor, topic.output) else { continue };
            let spec = &self.specs[topic.sensor];
            let size = [spec.width, spec.height];
            let Ok(projection) = Projection::of(spec) else { continue };
            self.publish_at(info, || messages::camera_info(header, size, &projection));
            self.publish_at(topic.publication, || {
                messages::image(header, size, topic.encoding, data.len(), |bytes| {
                    if topic.output == output::COLOR {
                        bytes.extend(data.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0], p[3]]));
                    } else {
                        bytes.extend(data);
                    }
                })
            });
        }
    }
}
