//! Sensor bundles and their measurements, read in the renderer's own memory.

use std::{
    sync::{Arc, Weak},
    time::Duration,
};

use bus::{BundleSample, Reader};
use protocol::{
    ActorId, BundleHeader, BundleId, CamReading, CamSpec, CollisionReading, CollisionSpec, Command,
    CreateBundle, Frame, GnssReading, GnssSpec, ImuReading, ImuSpec, LaneInvasionReading,
    LaneInvasionSpec, MessageReading, MessageSpec, Name, ObstacleReading, ObstacleSpec,
    OdometryReading, OdometrySpec, Page, Plane, Pose, RawCommand, Reading, SensorSpec, TEXT_BYTES,
    Transmit, output, sensor,
};

use crate::{Client, ClientError, connection::Connection};

/// A camera at `parent_from_sensor`; `outputs` are bits of [`output`].
pub fn camera(
    name: &str,
    parent_from_sensor: Pose,
    width: u32,
    height: u32,
    fov_rad: f32,
    outputs: impl Into<u32>,
) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::CAMERA,
        outputs: outputs.into(),
        parent_from_sensor,
        width,
        height,
        fov_rad,
        ..SensorSpec::default()
    }
}

/// A lidar that sees the whole turn at every frame: `channels` between elevations `lower_rad` and
/// `upper_rad`, `columns` azimuth steps.
pub fn lidar(
    name: &str,
    parent_from_sensor: Pose,
    channels: u32,
    columns: u32,
    [lower_rad, upper_rad]: [f32; 2],
    range_m: f32,
) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::LIDAR,
        outputs: output::POINTS | output::LABELS,
        parent_from_sensor,
        width: columns,
        height: channels,
        fov_rad: std::f32::consts::TAU,
        upper_rad,
        lower_rad,
        range_m,
        attenuation_per_m: 0.004,
        ..SensorSpec::default()
    }
}

/// An inertial measurement unit.
///
/// This and the following sensors are measured by the host, in the midst of physics. They go into
/// bundles of their own, apart from cameras and lidars; [`crate::Client::tick_and_collect`] takes
/// both.
pub fn imu(name: &str, parent_from_sensor: Pose, errors: ImuSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A receiver of satellites.
pub fn gnss(name: &str, parent_from_sensor: Pose, errors: GnssSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A speedometer and odometer.
pub fn odometry(name: &str, parent_from_sensor: Pose, errors: OdometrySpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// Tells of everybody and everything that touches its carrier.
pub fn collision(name: &str) -> SensorSpec {
    SensorSpec::physics(name, Pose::IDENTITY, &CollisionSpec::default())
}

/// Tells of the markings that its carrier crosses.
pub fn lane_invasion(name: &str) -> SensorSpec {
    SensorSpec::physics(name, Pose::IDENTITY, &LaneInvasionSpec::default())
}

/// Pushes a ball ahead, and tells what it runs into.
pub fn obstacle(name: &str, parent_from_sensor: Pose, look: ObstacleSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &look)
}

/// Sends and receives cooperative awareness messages.
pub fn cam(name: &str, parent_from_sensor: Pose, station: CamSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &station)
}

/// Sends texts ([`crate::Client::transmit`]) and receives them.
pub fn message(name: &str, parent_from_sensor: Pose, station: MessageSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &station)
}

/// Sensors that are measured together, and the stream of their measurements.
///
/// Dropped, it is destroyed: rendering stops with the next frame. It is `Send`.
#[must_use = "dropped, the bundle is destroyed"]
pub struct SensorBundle {
    id: BundleId,
    /// The number of the world that it was made in.
    episode: u32,
    sensors: Arc<[SensorSpec]>,
    reader: Reader<BundleHeader, Page>,
    last: Frame,
    missed: u64,
    /// Whose it is; none once it was destroyed.
    owner: Weak<Connection>,
}

impl SensorBundle {
    pub(crate) fn new(
        id: BundleId,
        episode: u32,
        sensors: Arc<[SensorSpec]>,
        reader: Reader<BundleHeader, Page>,
        owner: Weak<Connection>,
    ) -> SensorBundle {
        SensorBundle { id, episode, sensors, reader, last: Frame(0), missed: 0, owner }
    }

    /// Whether the world that it was made in still stands.
    pub(crate) fn check(&self, standing: u32) -> Result<(), ClientError> {
        if self.episode == standing {
            return Ok(());
        }
        Err(ClientError::WorldGone { bundle: self.id, standing })
    }

    /// Its id.
    pub fn id(&self) -> BundleId {
        self.id
    }

    /// Its sensors.
    pub fn sensors(&self) -> &[SensorSpec] {
        &self.sensors
    }

    /// The oldest measurement that was not read yet, if there is one. Never blocks. A restarted
    /// renderer may send a frame once more; each comes out once.
    pub fn receive(&mut self) -> Result<Option<Measurement>, ClientError> {
        while let Some(bundle) = self.reader.receive()? {
            let frame = bundle.header().stamp.frame;
            if frame > self.last {
                if self.last.0 > 0 {
                    self.missed += frame.0 - self.last.0 - 1;
                }
                self.last = frame;
                let sensors = Arc::clone(&self.sensors);
                return Ok(Some(Measurement { bundle, sensors }));
            }
        }
        Ok(None)
    }

    /// The measurement of `frame`. Earlier ones are dropped, and counted as missed.
    pub(crate) fn receive_at(&mut self, frame: Frame) -> Result<Option<Measurement>, ClientError> {
        while self.last < frame {
            let Some(next) = self.receive()? else { break };
            if next.frame() == frame {
                return Ok(Some(next));
            }
            self.missed += 1;
        }
        Ok(None)
    }

    /// The newest measurement, older ones dropped.
    pub fn latest(&mut self) -> Result<Option<Measurement>, ClientError> {
        let mut newest = None;
        while let Some(next) = self.receive()? {
            newest = Some(next);
        }
        Ok(newest)
    }

    /// The last frame that came out.
    pub fn last(&self) -> Frame {
        self.last
    }

    /// Frames between the first and the last that never came out.
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

impl Drop for SensorBundle {
    /// Sends the command that destroys the bundle, and does not wait for it. A client that is gone,
    /// or a world that is, has taken the bundle along.
    fn drop(&mut self) {
        if let Some(owner) = self.owner.upgrade()
            && owner.episode() == self.episode
        {
            let command = RawCommand::from(Command::DestroyBundle(self.id));
            // A host that takes no commands any more frees the bundle with its client.
            let _ = owner.send(std::iter::once(command), true);
        }
    }
}

impl std::fmt::Debug for SensorBundle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SensorBundle")
            .field("id", &self.id)
            .field("episode", &self.episode)
            .field("sensors", &self.sensors)
            .field("last", &self.last)
            .field("missed", &self.missed)
            .finish_non_exhaustive()
    }
}

impl Client {
    /// Mounts sensors on an actor, or in the world (`ActorId::NONE`), as one bundle: measured
    /// together, delivered together. `max_borrowed` measurements may be held at a time, 1 to 8.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist, a sensor is not possible, or shared
    /// memory has no room.
    pub fn create_bundle(
        &mut self,
        name: &str,
        parent: ActorId,
        sensors: &[SensorSpec],
        max_borrowed: u32,
    ) -> Result<SensorBundle, ClientError> {
        let bundle = CreateBundle {
            parent,
            sensor_count: sensors.len() as u32,
            max_borrowed,
            reserved: 0,
            name: Name::new(name),
        };
        let mut commands = vec![Command::CreateBundle(bundle)];
        commands.extend(sensors.iter().map(|s| Command::Sensor(*s)));
        let id = BundleId(self.request("bundle", &commands)?[0]);
        self.open_bundle(id, sensors)
    }

    /// Destroys a bundle and waits until that was carried out. Dropping it destroys it, too,
    /// without waiting.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it was destroyed with its actor or world.
    pub fn destroy_bundle(&mut self, mut bundle: SensorBundle) -> Result<(), ClientError> {
        bundle.owner = Weak::new();
        self.request_one("bundle", Command::DestroyBundle(bundle.id())).map(drop)
    }

    /// Sends a text by radio with the next frame, from a [`message`] sensor of a bundle; at most
    /// [`TEXT_BYTES`] bytes.
    ///
    /// # Errors
    ///
    /// [`ClientError::BadArgument`] if the text is longer; [`ClientError::Refused`] if there is no
    /// such sensor.
    pub fn transmit(
        &mut self,
        bundle: &SensorBundle,
        sensor: usize,
        text: &str,
    ) -> Result<(), ClientError> {
        let mut bytes = [0; TEXT_BYTES];
        let room = bytes.get_mut(..text.len()).ok_or_else(|| {
            let len = text.len();
            let why = format!("the text has {len} bytes; {TEXT_BYTES} is the limit");
            ClientError::bad_argument("transmit", why)
        })?;
        room.copy_from_slice(text.as_bytes());
        let transmit = Transmit { bundle: bundle.id(), sensor: sensor as u32, text: bytes };
        self.request_one("transmit", Command::Transmit(transmit)).map(drop)
    }
}

/// All that a bundle measured at one frame. Its bytes are the renderer's own; they stay until this is
/// dropped, so hold no more than the bundle's `max_borrowed`.
pub struct Measurement {
    bundle: BundleSample,
    sensors: Arc<[SensorSpec]>,
}

impl Measurement {
    /// Which frame, which tracer, when.
    pub fn header(&self) -> &BundleHeader {
        self.bundle.header()
    }

    pub(crate) fn sensors(&self) -> &[SensorSpec] {
        &self.sensors
    }

    /// Simulated time of the measured frame.
    #[must_use]
    pub fn sim_time(&self) -> Duration {
        Duration::from_nanos(self.header().stamp.sim_time_nanos)
    }

    /// The frame that was measured.
    pub fn frame(&self) -> Frame {
        self.header().stamp.frame
    }

    /// The whole payload.
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.bundle.payload())
    }

    /// Where each output lies.
    pub fn planes(&self) -> &[Plane] {
        let len = self.header().plane_count as usize * size_of::<Plane>();
        bytemuck::cast_slice(&self.bytes()[..len])
    }

    /// One output of one sensor (by its place in the bundle).
    pub fn plane(&self, sensor: usize, output: u32) -> Option<&Plane> {
        self.planes().iter().find(|p| p.sensor as usize == sensor && p.output == output)
    }

    /// The bytes of one output, row by row from the top left, or column by column of a lidar.
    pub fn data(&self, sensor: usize, output: u32) -> Option<&[u8]> {
        let plane = self.plane(sensor, output)?;
        self.bytes().get(plane.offset as usize..)?.get(..plane.byte_len as usize)
    }

    /// Red, green, blue, 255 of each pixel.
    pub fn color(&self, sensor: usize) -> Option<&[[u8; 4]]> {
        self.data(sensor, output::COLOR).map(bytemuck::cast_slice)
    }

    /// Metres along the optical axis of each pixel.
    pub fn depth(&self, sensor: usize) -> Option<&[f32]> {
        self.data(sensor, output::DEPTH).map(bytemuck::cast_slice)
    }

    /// The semantic tag of each pixel.
    pub fn tags(&self, sensor: usize) -> Option<&[u8]> {
        self.data(sensor, output::TAG)
    }

    /// The actor or object of each pixel.
    pub fn instances(&self, sensor: usize) -> Option<&[u32]> {
        self.data(sensor, output::INSTANCE).map(bytemuck::cast_slice)
    }

    /// The surface's normal of each pixel, in sensor space and towards the camera; zeros where
    /// nothing is hit.
    pub fn normals(&self, sensor: usize) -> Option<&[[f32; 3]]> {
        self.data(sensor, output::NORMAL).map(bytemuck::cast_slice)
    }

    /// How far to the right and down, in pixels, each pixel's surface has moved in the image since
    /// the frame before.
    pub fn flow(&self, sensor: usize) -> Option<&[[f32; 2]]> {
        self.data(sensor, output::FLOW).map(bytemuck::cast_slice)
    }

    /// x, y, z in sensor space, and intensity, of each ray; zeros where it met nothing.
    pub fn points(&self, sensor: usize) -> Option<&[[f32; 4]]> {
        self.data(sensor, output::POINTS).map(bytemuck::cast_slice)
    }

    /// Instance and tag of each ray.
    pub fn labels(&self, sensor: usize) -> Option<&[[u32; 2]]> {
        self.data(sensor, output::LABELS).map(bytemuck::cast_slice)
    }

    /// What an inertial measurement unit felt, if its turn had come.
    pub fn imu(&self, sensor: usize) -> Option<&ImuReading> {
        self.readings(sensor).first()
    }

    /// Where a receiver believes to be, if its turn had come.
    pub fn gnss(&self, sensor: usize) -> Option<&GnssReading> {
        self.readings(sensor).first()
    }

    /// What a speedometer shows, if its turn had come.
    pub fn odometry(&self, sensor: usize) -> Option<&OdometryReading> {
        self.readings(sensor).first()
    }

    /// Who touched the carrier during this frame.
    pub fn collisions(&self, sensor: usize) -> &[CollisionReading] {
        self.readings(sensor)
    }

    /// The markings that the carrier crossed during this frame.
    pub fn lane_invasions(&self, sensor: usize) -> &[LaneInvasionReading] {
        self.readings(sensor)
    }

    /// What lies ahead, if anything does and the sensor's turn had come.
    pub fn obstacle(&self, sensor: usize) -> Option<&ObstacleReading> {
        self.readings(sensor).first()
    }

    /// The awareness messages that were received in this frame.
    pub fn cams(&self, sensor: usize) -> &[CamReading] {
        self.readings(sensor)
    }

    /// The texts that were received in this frame.
    pub fn messages(&self, sensor: usize) -> &[MessageReading] {
        self.readings(sensor)
    }

    /// The readings of one kind of a sensor that the host measures.
    pub fn readings<T: Reading>(&self, sensor: usize) -> &[T] {
        self.data(sensor, T::OUTPUT).map(bytemuck::cast_slice).unwrap_or_default()
    }
}

impl std::fmt::Debug for Measurement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Measurement").field("header", self.header()).finish_non_exhaustive()
    }
}
