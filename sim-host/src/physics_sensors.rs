//! Physics sensors: sensors that the host measures in the substeps of physics. Their bundles are
//! sent before the tick word of a frame is raised.
//!
//! They read the world and do not change it, so that the state hash does not depend on them.
//! Without a bundle of physics sensors, a tick does no work here.

mod cam;
mod gnss;
mod imu;
mod lanes;
mod noise;
mod odometry;
mod path_loss;
mod radio;
#[cfg(test)]
mod radio_tests;
mod scene;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use bus::{BusError, Writer, clock};
use glam::Vec3;
use protocol::{
    ActorId, BundleHeader, BundleId, BundleReceipt, CamSpec, CollisionReading, GnssSpec, ImuSpec,
    MessageSpec, ObstacleReading, ObstacleSpec, OdometrySpec, Page, Plane, Pose, Reading, Refusal,
    SensorSpec, SnapshotHeader, Transmit, layout, sensor, tracer,
};
use road::Network;

use self::{
    cam::Cam,
    gnss::Gnss,
    imu::Imu,
    lanes::Corners,
    noise::Noise,
    odometry::Odometry,
    radio::{Station, Transmission},
    scene::Scene,
};
use crate::{
    physics::{CastHit, Physics},
    world::World,
};

/// Semantic tag of the ground in the readings of obstacle sensors.
const GROUND_TAG: u32 = mesh::Tag::Ground as u32;

/// The bundles of physics sensors.
#[derive(Default)]
pub(crate) struct PhysicsSensors {
    bundles: BTreeMap<BundleId, SensorBundle>,
    /// The roads of the world, once a sensor needs them.
    network: Option<Network>,
}

struct SensorBundle {
    parent: ActorId,
    sensors: Vec<PhysicsSensor>,
    planes: Vec<Plane>,
    byte_len: u64,
    writer: Writer<BundleHeader, Page>,
}

/// A sensor with its state.
struct PhysicsSensor {
    spec: SensorSpec,
    receipt: BundleReceipt,
    state: State,
}

enum State {
    Imu(Box<Imu>),
    Gnss(Gnss),
    Odometry(Odometry),
    Collision,
    LaneInvasion(Corners),
    Obstacle(ObstacleSpec),
    Radio(Station),
}

/// Whether a sensor needs the road network.
pub(crate) fn needs_roads(spec: &SensorSpec) -> bool {
    matches!(spec.kind, sensor::GNSS | sensor::LANE_INVASION | sensor::CAM)
}

impl PhysicsSensors {
    /// Whether there are no bundles of physics sensors.
    pub(crate) fn is_empty(&self) -> bool {
        self.bundles.is_empty()
    }

    /// Whether the road network is set.
    pub(crate) fn has_roads(&self) -> bool {
        self.network.is_some()
    }

    /// Sets the road network of the world.
    pub(crate) fn set_roads(&mut self, network: Network) {
        self.network = Some(network);
    }

    /// Removes all sensors and the road network, for another world.
    pub(crate) fn begin_episode(&mut self) {
        *self = PhysicsSensors::default();
    }

    /// Adds a bundle, which is measured from now on.
    pub(crate) fn mount(
        &mut self,
        id: BundleId,
        parent: ActorId,
        specs: &[SensorSpec],
        receipt: BundleReceipt,
        writer: Writer<BundleHeader, Page>,
    ) {
        let sensors = specs.iter().filter_map(|spec| PhysicsSensor::new(spec, receipt)).collect();
        let (planes, byte_len) = layout(specs);
        self.bundles.insert(id, SensorBundle { parent, sensors, planes, byte_len, writer });
    }

    /// Removes a bundle.
    pub(crate) fn unmount(&mut self, id: BundleId) {
        self.bundles.remove(&id);
    }

    /// Queues a text for transmission by radio.
    ///
    /// # Errors
    ///
    /// The cause as a text.
    pub(crate) fn transmit(&mut self, command: &Transmit) -> Result<u32, Refusal> {
        let bundle = self.bundles.get_mut(&command.bundle);
        let bundle = bundle.ok_or_else(|| {
            Refusal::not_found(format!(
                "there is no bundle {} of physics sensors",
                command.bundle.0
            ))
        })?;
        let count = bundle.sensors.len();
        match bundle.sensors.get_mut(command.sensor as usize).map(|sensor| &mut sensor.state) {
            Some(State::Radio(station)) => station.queue(command.text).map(|()| command.bundle.0),
            Some(_) => Err(Refusal::wrong_kind(format!(
                "sensor {} of bundle {} is not a radio",
                command.sensor, command.bundle.0
            ))),
            None => Err(Refusal::not_found(format!(
                "bundle {} has {count} sensors; there is no sensor {}",
                command.bundle.0, command.sensor
            ))),
        }
    }

    /// Observes physics before the first substep of a frame, with `dt` 0, and after each substep.
    pub(crate) fn observe(&mut self, physics: &Physics, dt: f32) {
        for bundle in self.bundles.values_mut() {
            let imus = bundle.sensors.iter_mut().filter_map(|sensor| match &mut sensor.state {
                State::Imu(imu) => Some(imu),
                _ => None,
            });
            let mut imus = imus.peekable();
            if imus.peek().is_none() {
                continue;
            }
            let Some(carrier) = physics.motion(bundle.parent) else { continue };
            imus.for_each(|imu| imu.observe(&carrier, dt));
        }
    }

    /// Measures a frame and sends the bundles that have readings.
    pub(crate) fn send(&mut self, world: &World, header: &SnapshotHeader) -> Result<(), BusError> {
        let PhysicsSensors { bundles, network } = self;
        let transmissions = collect_transmissions(bundles, network.as_ref(), world, header);
        for (id, bundle) in bundles {
            let begin_nanos = clock::now_nanos();
            let Some(world_from_parent) = bundle.place(world) else { continue };
            let mut readings = Vec::new();
            for (index, sensor) in bundle.sensors.iter_mut().enumerate() {
                let Some(room) = bundle.planes.iter().find(|p| p.sensor as usize == index) else {
                    continue;
                };
                let world_from_sensor = world_from_parent.then(&sensor.spec.parent_from_sensor);
                let scene =
                    Scene { world, network: network.as_ref(), parent: bundle.parent, header };
                let most = room.width as usize;
                let bytes = sensor.measure(&scene, &world_from_sensor, &transmissions, most);
                if !bytes.is_empty() {
                    readings.push((Plane { world_from_sensor, ..*room }, bytes));
                }
            }
            if readings.is_empty() {
                continue;
            }
            let mut loan = bundle.writer.loan(bundle.byte_len.div_ceil(4096) as usize)?;
            let out: &mut [u8] = bytemuck::cast_slice_mut(loan.payload_mut());
            for (place, (plane, bytes)) in readings.iter().enumerate() {
                let each = protocol::element_bytes(plane.output);
                let (width, byte_len) = ((bytes.len() / each) as u32, bytes.len() as u64);
                let plane = Plane { width, height: 1, byte_len, ..*plane };
                let at = place * size_of::<Plane>();
                out[at..at + size_of::<Plane>()].copy_from_slice(bytemuck::bytes_of(&plane));
                let at = plane.offset as usize;
                out[at..at + bytes.len()].copy_from_slice(bytes);
            }
            loan.send(BundleHeader {
                stamp: header.stamp,
                bundle: *id,
                plane_count: readings.len() as u32,
                byte_len: bundle.byte_len,
                state_hash: header.state_hash,
                world_from_parent,
                parent: bundle.parent,
                tracer: tracer::HOST,
                reserved: 0,
                begin_nanos,
                end_nanos: clock::now_nanos(),
            })?;
        }
        Ok(())
    }
}

/// Returns the transmissions of all stations in this frame; they are received in the same frame.
fn collect_transmissions(
    bundles: &mut BTreeMap<BundleId, SensorBundle>,
    network: Option<&Network>,
    world: &World,
    header: &SnapshotHeader,
) -> Vec<Transmission> {
    let mut transmissions = Vec::new();
    for bundle in bundles.values_mut() {
        let Some(world_from_parent) = bundle.place(world) else { continue };
        for sensor in &mut bundle.sensors {
            let State::Radio(station) = &mut sensor.state else { continue };
            let pose = world_from_parent.then(&sensor.spec.parent_from_sensor);
            let scene = Scene { world, network, parent: bundle.parent, header };
            let mut noise = Noise::at(sensor.spec.seed, header.stamp.sim_time_nanos);
            station.send(&scene, &pose, &mut noise, &mut transmissions);
        }
    }
    transmissions
}

impl SensorBundle {
    /// Returns `world_from_parent`, or `None` if the carrier is gone.
    fn place(&self, world: &World) -> Option<Pose> {
        if self.parent == ActorId::NONE {
            return Some(Pose::IDENTITY);
        }
        world.state(self.parent).map(|state| state.pose)
    }
}

impl PhysicsSensor {
    /// Returns a sensor, or `None` if its kind is not a physics sensor.
    fn new(spec: &SensorSpec, receipt: BundleReceipt) -> Option<PhysicsSensor> {
        let mounted = spec.parent_from_sensor;
        let state = match spec.kind {
            sensor::IMU => State::Imu(Box::new(Imu::new(spec.numbers::<ImuSpec>()?, mounted))),
            sensor::GNSS => State::Gnss(Gnss::new(spec.numbers::<GnssSpec>()?)),
            sensor::ODOMETRY => {
                State::Odometry(Odometry::new(spec.numbers::<OdometrySpec>()?, mounted))
            }
            sensor::COLLISION => State::Collision,
            sensor::LANE_INVASION => State::LaneInvasion(Corners::default()),
            sensor::OBSTACLE => State::Obstacle(spec.numbers::<ObstacleSpec>()?),
            sensor::CAM => {
                State::Radio(Station::Cam(Box::new(Cam::new(spec.numbers::<CamSpec>()?))))
            }
            sensor::MESSAGE => State::Radio(Station::Text {
                spec: spec.numbers::<MessageSpec>()?,
                waiting: Vec::new(),
            }),
            _ => return None,
        };
        Some(PhysicsSensor { spec: *spec, receipt, state })
    }

    /// Returns the readings of this frame as bytes; empty if there are none.
    fn measure(
        &mut self,
        scene: &Scene,
        world_from_sensor: &Pose,
        transmissions: &[Transmission],
        most: usize,
    ) -> Vec<u8> {
        let Scene { world, network, parent, header } = *scene;
        let delta_secs = header.delta_nanos as f32 * 1e-9;
        let is_due = self.receipt.is_due(&self.spec, header);
        let mut noise = Noise::at(self.spec.seed, header.stamp.sim_time_nanos);
        let moving = || world.physics().motion(parent);
        let due = |bytes: &dyn Fn(Noise) -> Vec<u8>, noise: Noise| {
            if is_due { bytes(noise) } else { Vec::new() }
        };
        match &mut self.state {
            State::Imu(imu) => {
                imu.advance(delta_secs, &mut noise);
                if !is_due {
                    return Vec::new();
                }
                bytes_of(&[imu.read(world_from_sensor, &mut noise)])
            }
            State::Gnss(gnss) => {
                gnss.advance(delta_secs, &mut noise);
                let Some(network) = network else { return Vec::new() };
                let place = world_from_sensor.position();
                due(&|mut noise| bytes_of(&[gnss.read(place, network, &mut noise)]), noise)
            }
            State::Odometry(odometry) => {
                let (carrier, wheel_speed_mps) =
                    (moving(), world.physics().wheel_speed_mps(parent));
                odometry.advance(carrier.as_ref(), wheel_speed_mps, delta_secs);
                let steer_rad = world.state(parent).map_or(0.0, |state| state.wheel_steer_rad);
                let read = |mut noise| {
                    bytes_of(&[odometry.read(
                        carrier.as_ref(),
                        wheel_speed_mps,
                        steer_rad,
                        &mut noise,
                    )])
                };
                due(&read, noise)
            }
            State::Collision => {
                let mut readings = collisions(world, parent);
                readings.truncate(most);
                bytes_of(&readings)
            }
            State::LaneInvasion(corners) => {
                let (Some(carrier), Some(network)) = (world.state(parent), network) else {
                    return Vec::new();
                };
                let mut readings = corners.crossings(carrier, network);
                readings.truncate(most);
                bytes_of(&readings)
            }
            State::Radio(station) => {
                station.receive(scene, world_from_sensor, self.spec.seed, transmissions, most)
            }
            State::Obstacle(spec) => due(
                &|_| bytes_of(obstacle(world, parent, spec, world_from_sensor).as_slice()),
                noise,
            ),
        }
    }
}

fn bytes_of<T: Reading>(readings: &[T]) -> Vec<u8> {
    bytemuck::cast_slice(readings).to_vec()
}

/// Returns the collisions of an actor in this frame.
fn collisions(world: &World, carrier: ActorId) -> Vec<CollisionReading> {
    let concerned = world.frame_collisions().filter(|c| c.actor == carrier || c.other == carrier);
    let reading = |touch: &crate::physics::Collision| {
        let is_first = touch.actor == carrier;
        let other = if is_first { touch.other } else { touch.actor };
        let (object, tag) = match touch.static_box {
            Some(index) => world.object_of(index),
            None => (0, tag_of(world, other)),
        };
        let given = if is_first { touch.impulse_ns } else { -touch.impulse_ns };
        CollisionReading {
            other,
            object,
            tag: tag.into(),
            began: touch.began.into(),
            impulse_ns: given.to_array(),
        }
    };
    concerned.map(reading).collect()
}

fn tag_of(world: &World, id: ActorId) -> u8 {
    let blueprint = world.state(id).and_then(|s| town::catalogue().get(s.blueprint as usize));
    blueprint.map_or(0, |blueprint| blueprint.tag as u8)
}

/// Returns the nearest obstacle ahead of a sensor.
fn obstacle(
    world: &World,
    carrier: ActorId,
    spec: &ObstacleSpec,
    world_from_sensor: &Pose,
) -> Option<ObstacleReading> {
    let way = (world_from_sensor.position(), world_from_sensor.rotation() * Vec3::X);
    let only_actors = spec.only_dynamics != 0;
    let (distance_m, met) = world.physics().cast_sphere(
        way,
        spec.distance_m,
        spec.hit_radius_m,
        carrier,
        only_actors,
    )?;
    let (other, object, tag) = match met {
        CastHit::Actor(other) => (other, 0, tag_of(world, other).into()),
        CastHit::Static(index) => {
            let (object, tag) = world.object_of(index);
            (ActorId::NONE, object, tag.into())
        }
        CastHit::Ground => (ActorId::NONE, 0, GROUND_TAG),
    };
    Some(ObstacleReading { other, object, tag, distance_m })
}

/// Whether a bundle holds physics sensors.
pub(crate) fn are_physics_sensors(specs: &[SensorSpec]) -> bool {
    specs.iter().any(|spec| sensor::is_physics_sensor(spec.kind))
}
