use std::mem::offset_of;

use bytemuck::{Pod, Zeroable};

use crate::{
    ActorId, Name, Pose, Stamp,
    physics_sensor::{self, PhysicsSensorSpec},
};

/// The id of a sensor bundle: sensors that are measured and delivered together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct BundleId(pub u32);

/// The most sensors in one bundle.
pub const SENSORS_MAX: usize = 4096;

/// Values of [`SensorSpec::kind`].
pub mod sensor {
    /// A pinhole camera. Sensor space is x forward, y left, z up; pixel (0, 0) is top left and
    /// its centre lies at (0.5, 0.5).
    pub const CAMERA: u32 = 1;
    /// A spinning lidar: `width` azimuth steps in one frame, `height` channels.
    pub const LIDAR: u32 = 2;
    /// Inertial measurement unit: [`crate::ImuSpec`].
    pub const IMU: u32 = 16;
    /// GNSS receiver: [`crate::GnssSpec`].
    pub const GNSS: u32 = 17;
    /// Odometry: [`crate::OdometrySpec`].
    pub const ODOMETRY: u32 = 18;
    /// Collisions of the parent actor: [`crate::CollisionSpec`].
    pub const COLLISION: u32 = 19;
    /// Lane markings crossed by the parent actor: [`crate::LaneInvasionSpec`].
    pub const LANE_INVASION: u32 = 20;
    /// Nearest obstacle ahead: [`crate::ObstacleSpec`].
    pub const OBSTACLE: u32 = 21;

    /// V2X radio for cooperative awareness messages: [`crate::CamSpec`].
    pub const CAM: u32 = 22;
    /// V2X radio for texts: [`crate::MessageSpec`].
    pub const MESSAGE: u32 = 23;

    /// Whether the host measures sensors of this type during physics, instead of the renderer by rays.
    pub const fn is_physics_sensor(kind: u32) -> bool {
        kind >= IMU
    }
}

/// Outputs of sensors: bits of [`SensorSpec::outputs`], values of [`Plane::output`].
pub mod output {
    /// Four bytes per pixel: red, green, blue, 255; sRGB.
    pub const COLOR: u32 = 1 << 0;
    /// One `f32` per pixel: metres along the optical axis; [`super::DEPTH_FAR_M`] where nothing is hit.
    pub const DEPTH: u32 = 1 << 1;
    /// One `u8` per pixel: CARLA's semantic tag (`mesh::Tag`).
    pub const TAG: u32 = 1 << 2;
    /// One `u32` per pixel: an actor's id, or a static object's id with the top bit set; 0 for the sky.
    pub const INSTANCE: u32 = 1 << 3;
    /// Four `f32` per ray: x, y, z in sensor space, and the attribute chosen by
    /// [`super::point_attribute`]; zeros where nothing is hit. Ray `column * channels + channel`; channel 0 is the highest.
    pub const POINTS: u32 = 1 << 4;
    /// Two `u32` per ray: instance and tag; zeros where nothing is hit.
    pub const LABELS: u32 = 1 << 5;
    /// Three `f32` per pixel: the unit normal of the surface in sensor space, towards the camera; zeros
    /// where nothing is hit.
    pub const NORMAL: u32 = 1 << 6;
    /// Two `f32` per pixel: optical flow, the displacement of the visible surface in the image since the
    /// frame before, in pixels to the right and down.
    pub const FLOW: u32 = 1 << 7;
    /// One [`crate::ImuReading`].
    pub const IMU: u32 = 1 << 16;
    /// One [`crate::GnssReading`].
    pub const GNSS: u32 = 1 << 17;
    /// One [`crate::OdometryReading`].
    pub const ODOMETRY: u32 = 1 << 18;
    /// One [`crate::CollisionReading`] per contact.
    pub const COLLISION: u32 = 1 << 19;
    /// One [`crate::LaneInvasionReading`] per marking and corner.
    pub const LANE_INVASION: u32 = 1 << 20;
    /// At most one [`crate::ObstacleReading`].
    pub const OBSTACLE: u32 = 1 << 21;
    /// One [`crate::CamReading`] per received message.
    pub const CAM: u32 = 1 << 22;
    /// One [`crate::MessageReading`] per received text.
    pub const MESSAGE: u32 = 1 << 23;

    /// Every output of a camera.
    pub const OF_CAMERA: u32 = COLOR | DEPTH | TAG | INSTANCE | NORMAL | FLOW;
    /// Every output of a lidar.
    pub const OF_LIDAR: u32 = POINTS | LABELS;
    /// Every output of physics sensors.
    pub const PHYSICS: u32 = !0 << 16;
}

/// Values of [`SensorSpec::point_attribute`].
pub mod point_attribute {
    /// Intensity of the return, 0 to 1.
    pub const INTENSITY: u32 = 0;
    /// Cosine of the angle of incidence, above 0 to 1.
    pub const COS_INCIDENCE: u32 = 1;
}

/// Depth of a pixel where nothing is hit, metres.
pub const DEPTH_FAR_M: f32 = 1000.0;

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
    /// Reserved; 0.
    pub reserved_word: u32,
    /// Seed of the sensor's noise.
    pub seed: u64,
    /// Simulated time between two measurements; 0: every frame.
    pub period_nanos: u64,
    /// Cameras: width in pixels. Lidars: azimuth steps per frame.
    pub width: u32,
    /// Cameras: height in pixels. Lidars: channels.
    pub height: u32,
    /// Horizontal field of view; a full turn for most lidars.
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
    /// Lidar: the fourth number of a point, one of [`point_attribute`].
    pub point_attribute: u32,
    /// Reserved; 0.
    pub reserved_half: u32,
    /// Reserved; 0.
    pub reserved: [u64; 7],
}

const _: () = assert!(size_of::<SensorSpec>() == 200);
const _: () = assert!(offset_of!(SensorSpec, width) == BORN_AT);

/// Offset from which a physics sensor stores its own parameters: that of `width`.
const BORN_AT: usize = 96;

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
        bytemuck::bytes_of_mut(&mut spec)[BORN_AT..BORN_AT + bytes.len()].copy_from_slice(bytes);
        spec
    }

    /// The parameters of a physics sensor of type `T`; `None` for another type.
    pub fn numbers<T: PhysicsSensorSpec>(&self) -> Option<T> {
        let bytes = &bytemuck::bytes_of(self)[BORN_AT..BORN_AT + size_of::<T>()];
        (self.kind == T::KIND).then(|| bytemuck::pod_read_unaligned(bytes))
    }
}

/// Values of [`BundleHeader::tracer`].
pub mod tracer {
    /// Writes headers only, to measure the transport alone.
    pub const NULL: u32 = 1;
    /// The SIMD tracer on the CPU.
    pub const CPU: u32 = 2;
    /// The compute tracer on the GPU.
    pub const GPU: u32 = 3;
    /// The host, for physics sensors.
    pub const HOST: u32 = 4;
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
    /// One of [`tracer`].
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
        output::POINTS => 16,
        output::LABELS | output::FLOW => 8,
        output::NORMAL => 12,
        born => physics_sensor::element_bytes(born),
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
