//! The description of one sensor, and the layout of a bundle's measurements.

use std::mem::offset_of;

use bytemuck::{Pod, Zeroable};

use crate::{
    ActorId, BundleId, CamSpec, CollisionSpec, EffectsSpec, GnssSpec, ImuSpec, LaneInvasionSpec,
    LensSpec, LidarSpec, MessageSpec, Name, ObstacleSpec, OdometrySpec, PhysicsSensorSpec, Pose,
    Stamp, physics_sensor,
    sensor_code::{output, sensor},
};

/// The specification of one sensor of a bundle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SensorSpec {
    /// Name given by the user; unique within the bundle.
    pub name: Name,
    /// One of [`sensor`].
    pub kind: u32,
    /// Bits of [`output`].
    pub outputs: u32,
    /// `parent_from_sensor`: the parent is the bundle's actor, or the world.
    pub parent_from_sensor: Pose,
    /// Cameras: one of [`crate::quality`].
    pub quality: u32,
    /// Seed of the sensor's noise.
    pub seed: u64,
    /// Simulated time between two measurements, counted from the bundle's first frame, which is
    /// measured; 0: every frame. [`crate::BundleReceipt::is_due`] is the rule.
    pub period_nanos: u64,
    /// Cameras: width in pixels. Lidars: azimuth steps per frame.
    pub width: u32,
    /// Cameras: height in pixels. Lidars: channels.
    pub height: u32,
    /// Horizontal field of view; a full turn for most lidars. Cameras: unless their lens has focal
    /// lengths.
    pub fov_rad: f32,
    /// Lidar: elevation of the highest channel.
    pub upper_rad: f32,
    /// Lidar: elevation of the lowest channel.
    pub lower_rad: f32,
    /// Lidar: range.
    pub range_m: f32,
    /// Lidar: intensity falls as `exp(-attenuation * distance)`.
    pub attenuation_per_m: f32,
    /// Lidar: standard deviation of the range, along the ray.
    pub noise_m: f32,
    /// Lidar: fraction of the returns that are dropped at random, 0 to 1.
    pub dropoff: f32,
    /// Lidar: revolutions per second; 0: the whole field of view at one instant in every frame.
    pub rotation_rate_hz: f32,
    /// Lidar: the fourth number of a point, one of [`crate::point_attribute`].
    pub point_attribute: u32,
    /// Cameras: lens.
    pub lens: LensSpec,
    /// Reserved; 0.
    pub reserved: u32,
    /// Cameras: effects on the colour image.
    pub effects: EffectsSpec,
    /// Lidars: beams.
    pub lidar: LidarSpec,
}

const _: () = assert!(size_of::<SensorSpec>() == 584);
const _: () = assert!(offset_of!(SensorSpec, width) == PHYSICS_OFFSET);

/// Offset from which a physics sensor stores its own parameters: that of `width`.
const PHYSICS_OFFSET: usize = 96;

impl SensorSpec {
    /// A sensor that the host measures during physics.
    pub fn physics<T: PhysicsSensorSpec>(
        name: &str,
        parent_from_sensor: Pose,
        numbers: &T,
    ) -> SensorSpec {
        let mut spec = SensorSpec {
            name: Name::new(name),
            kind: T::KIND,
            outputs: T::OUTPUT,
            parent_from_sensor,
            ..SensorSpec::default()
        };
        let bytes = bytemuck::bytes_of(numbers);
        bytemuck::bytes_of_mut(&mut spec)[PHYSICS_OFFSET..PHYSICS_OFFSET + bytes.len()]
            .copy_from_slice(bytes);
        spec
    }

    /// The parameters of a physics sensor of type `T`; `None` for another type.
    pub fn numbers<T: PhysicsSensorSpec>(&self) -> Option<T> {
        let bytes = &bytemuck::bytes_of(self)[PHYSICS_OFFSET..PHYSICS_OFFSET + size_of::<T>()];
        (self.kind == T::KIND).then(|| bytemuck::pod_read_unaligned(bytes))
    }

    /// Checks the parameters of a physics sensor; the error names the first that is out of range.
    pub fn check_physics_sensor(&self) -> Result<(), String> {
        match self.kind {
            sensor::IMU => self.check_as::<ImuSpec>(),
            sensor::GNSS => self.check_as::<GnssSpec>(),
            sensor::ODOMETRY => self.check_as::<OdometrySpec>(),
            sensor::COLLISION => self.check_as::<CollisionSpec>(),
            sensor::LANE_INVASION => self.check_as::<LaneInvasionSpec>(),
            sensor::OBSTACLE => self.check_as::<ObstacleSpec>(),
            sensor::CAM => self.check_as::<CamSpec>(),
            sensor::MESSAGE => self.check_as::<MessageSpec>(),
            other => Err(format!("unknown sensor type {other}")),
        }
    }

    /// Checks the beams of a lidar; the error names the first number that is out of range.
    ///
    /// # Errors
    /// The cause as a text.
    pub fn check_beams(&self) -> Result<(), String> {
        self.lidar.check(self.height, self.fov_rad, self.rotation_rate_hz)
    }

    fn check_as<T: PhysicsSensorSpec>(&self) -> Result<(), String> {
        if self.outputs != T::OUTPUT {
            return Err(format!(
                "outputs are {:#x}, but this sensor type has only {:#x}",
                self.outputs,
                T::OUTPUT
            ));
        }
        self.numbers::<T>().map_or(Ok(()), |numbers| numbers.check())
    }
}

impl From<&SensorSpec> for SensorSpec {
    fn from(spec: &SensorSpec) -> SensorSpec {
        *spec
    }
}

/// Header of a bundle's measurements of one frame.
///
/// The payload starts with `plane_count` [`Plane`]s, which locate the data of each output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BundleHeader {
    /// The frame that was measured.
    pub stamp: Stamp,
    /// The bundle.
    pub bundle: BundleId,
    /// Number of planes in the table.
    pub plane_count: u32,
    /// Used bytes, including the table.
    pub byte_len: u64,
    /// State hash of the measured snapshot.
    pub state_hash: u64,
    /// `world_from_parent` at the measured frame.
    pub world_from_parent: Pose,
    /// The actor that the bundle is attached to, or [`ActorId::NONE`].
    pub parent: ActorId,
    /// One of [`crate::tracer`].
    pub tracer: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// Monotonic clock when measuring began.
    pub begin_nanos: u64,
    /// Monotonic clock when measuring ended.
    pub end_nanos: u64,
}

const _: () = assert!(size_of::<BundleHeader>() == 104);

/// Location and pose of one output of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Plane {
    /// Index of the sensor in its bundle.
    pub sensor: u32,
    /// One of [`output`].
    pub output: u32,
    /// Elements per row (see [`SensorSpec::width`]); the number of readings of a physics sensor.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Offset of the data from the start of the payload, a multiple of 64.
    pub offset: u64,
    /// Length of the data in bytes.
    pub byte_len: u64,
    /// `world_from_sensor` at the measured frame.
    pub world_from_sensor: Pose,
    /// Lidar: azimuth of column 0, positive to the left.
    pub first_azimuth_rad: f32,
}

const _: () = assert!(size_of::<Plane>() == 64);

/// Bytes of one element of `output`; 0 for an unknown output.
pub fn element_bytes(output: u32) -> usize {
    match output {
        output::COLOR | output::DEPTH | output::INSTANCE => 4,
        output::TAG => 1,
        output::POINTS | output::LAST_POINTS => 16,
        output::LABELS | output::LAST_LABELS | output::FLOW => 8,
        output::NORMAL => 12,
        other => physics_sensor::element_bytes(other),
    }
}

/// Computes the layout of a bundle's payload: the table, then each plane aligned to 64 bytes, in the
/// order of sensors and, within a sensor, of output bits. Returns the planes, with identity poses, and
/// the total length in bytes. Planes of physics sensors have room for the most readings of one frame.
pub fn layout(sensors: &[SensorSpec]) -> (Vec<Plane>, u64) {
    let count: usize = sensors.iter().map(|s| s.outputs.count_ones() as usize).sum();
    let mut offset = (count * size_of::<Plane>()).next_multiple_of(64) as u64;
    let mut planes = Vec::with_capacity(count);
    for (index, spec) in sensors.iter().enumerate() {
        for bit in (0..32).map(|b| 1u32 << b).filter(|b| spec.outputs & b != 0) {
            let [width, height] = match physics_sensor::readings_max(bit) {
                0 => [spec.width, spec.height],
                most => [most, 1],
            };
            let byte_len = u64::from(width) * u64::from(height) * element_bytes(bit) as u64;
            planes.push(Plane {
                sensor: index as u32,
                output: bit,
                width,
                height,
                offset,
                byte_len,
                world_from_sensor: Pose::IDENTITY,
                first_azimuth_rad: 0.0,
            });
            offset = (offset + byte_len).next_multiple_of(64);
        }
    }
    (planes, offset)
}
