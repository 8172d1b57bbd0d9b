use std::mem::offset_of;

use bytemuck::{Pod, Zeroable};

use crate::{
    ActorId, Name, Pose, Stamp,
    physics_sensor::{self, PhysicsSensorSpec},
};

/// Names a bundle: sensors that are measured together and handed over in one bundle.
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
    /// EgoSensors acceleration, turning and heading: [`crate::ImuSpec`].
    pub const IMU: u32 = 16;
    /// A place on the earth: [`crate::GnssSpec`].
    pub const GNSS: u32 = 17;
    /// How fast and how far: [`crate::OdometrySpec`].
    pub const ODOMETRY: u32 = 18;
    /// Who touched the carrier: [`crate::CollisionSpec`].
    pub const COLLISION: u32 = 19;
    /// Which markings the carrier crossed: [`crate::LaneInvasionSpec`].
    pub const LANE_INVASION: u32 = 20;
    /// What lies ahead: [`crate::ObstacleSpec`].
    pub const OBSTACLE: u32 = 21;

    /// Cooperative awareness messages: [`crate::CamSpec`].
    pub const CAM: u32 = 22;
    /// Texts by radio: [`crate::MessageSpec`].
    pub const MESSAGE: u32 = 23;

    /// Whether a sensor is measured by the host, in the midst of physics, and not by rays.
    pub const fn is_physics_sensor(kind: u32) -> bool {
        kind >= IMU
    }
}

/// What a sensor can give: bits of [`SensorSpec::outputs`], values of [`Plane::output`].
pub mod output {
    /// 4 bytes a pixel: red, green, blue, 255; sRGB.
    pub const COLOR: u32 = 1 << 0;
    /// f32 a pixel: metres along the optical axis; [`super::DEPTH_FAR_M`] where nothing is hit.
    pub const DEPTH: u32 = 1 << 1;
    /// u8 a pixel: CARLA's semantic tag (`mesh::Tag`).
    pub const TAG: u32 = 1 << 2;
    /// u32 a pixel: an actor's id, or a static object's id with the top bit set; 0 is the sky.
    pub const INSTANCE: u32 = 1 << 3;
    /// 4 f32 a ray: x, y, z in sensor space, intensity 0 to 1 (or see [`super::point_attribute`]); all four 0 where nothing is hit.
    /// Ray `column * channels + channel`; channel 0 is the highest.
    pub const POINTS: u32 = 1 << 4;
    /// 2 u32 a ray: instance, tag; both 0 where nothing is hit.
    pub const LABELS: u32 = 1 << 5;
    /// 3 f32 a pixel: the surface's normal in sensor space, of unit length, towards the camera; all
    /// three 0 where nothing is hit.
    pub const NORMAL: u32 = 1 << 6;
    /// 2 f32 a pixel: how far to the right and down, in pixels, what is seen there has moved in the
    /// image since the frame before.
    pub const FLOW: u32 = 1 << 7;
    /// One [`crate::ImuReading`].
    pub const IMU: u32 = 1 << 16;
    /// One [`crate::GnssReading`].
    pub const GNSS: u32 = 1 << 17;
    /// One [`crate::OdometryReading`].
    pub const ODOMETRY: u32 = 1 << 18;
    /// A [`crate::CollisionReading`] for each who touched the carrier.
    pub const COLLISION: u32 = 1 << 19;
    /// A [`crate::LaneInvasionReading`] for each marking and corner.
    pub const LANE_INVASION: u32 = 1 << 20;
    /// At most one [`crate::ObstacleReading`].
    pub const OBSTACLE: u32 = 1 << 21;
    /// A [`crate::CamReading`] for each message that was received.
    pub const CAM: u32 = 1 << 22;
    /// A [`crate::MessageReading`] for each text that was received.
    pub const MESSAGE: u32 = 1 << 23;

    /// All that a camera can give.
    pub const OF_CAMERA: u32 = COLOR | DEPTH | TAG | INSTANCE | NORMAL | FLOW;
    /// All that a lidar can give.
    pub const OF_LIDAR: u32 = POINTS | LABELS;
    /// The outputs of sensors born of physics.
    pub const PHYSICS: u32 = !0 << 16;
}

/// Values of [`SensorSpec::point_attribute`].
pub mod point_attribute {
    /// Intensity of the return, 0 to 1.
    pub const INTENSITY: u32 = 0;
    /// Cosine of the angle of incidence, above 0 to 1.
    pub const COS_INCIDENCE: u32 = 1;
}

/// The depth of a pixel that sees nothing but sky.
pub const DEPTH_FAR_M: f32 = 1000.0;

/// One sensor of a bundle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SensorSpec {
    /// What the user calls it; unique within the bundle.
    pub name: Name,
    /// One of [`sensor`].
    pub kind: u32,
    /// Bits of [`output`].
    pub outputs: u32,
    /// `parent_from_sensor`: the parent is the bundle's actor, or the world.
    pub parent_from_sensor: Pose,
    /// Zero.
    pub reserved_word: u32,
    /// Seed of the sensor's own noise.
    pub seed: u64,
    /// Simulated time between two measurements; 0: every frame.
    pub period_nanos: u64,
    /// Camera: pixels across. Lidar: azimuth steps in one frame.
    pub width: u32,
    /// Camera: pixels down. Lidar: channels.
    pub height: u32,
    /// Horizontal field of view; a full turn for most lidars.
    pub fov_rad: f32,
    /// Lidar: elevation of the highest channel.
    pub upper_rad: f32,
    /// Lidar: elevation of the lowest channel.
    pub lower_rad: f32,
    /// Lidar: nothing farther is seen.
    pub range_m: f32,
    /// Lidar: intensity falls as `exp(-attenuation * distance)`.
    pub attenuation_per_m: f32,
    /// Lidar: standard deviation of the range, along the ray.
    pub noise_m: f32,
    /// Lidar: share of the returns that are lost, 0 to 1.
    pub dropoff: f32,
    /// Lidar: turns per second. 0: the whole field of view at one instant, at every frame.
    pub rotation_rate_hz: f32,
    /// Lidar: what a point's point_attribute number is, one of [`point_attribute`].
    pub point_attribute: u32,
    /// Zero.
    pub reserved_half: u32,
    /// Zero.
    pub reserved: [u64; 7],
}

const _: () = assert!(size_of::<SensorSpec>() == 200);
const _: () = assert!(offset_of!(SensorSpec, width) == BORN_AT);

/// From here on, which is `width`, a sensor born of physics keeps numbers of its own.
const BORN_AT: usize = 96;

impl SensorSpec {
    /// A sensor that the host measures, in the midst of physics.
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

    /// The numbers of a sensor born of physics; none if it is another one.
    pub fn numbers<T: PhysicsSensorSpec>(&self) -> Option<T> {
        let bytes = &bytemuck::bytes_of(self)[BORN_AT..BORN_AT + size_of::<T>()];
        (self.kind == T::KIND).then(|| bytemuck::pod_read_unaligned(bytes))
    }
}

/// Values of [`BundleHeader::tracer`].
pub mod tracer {
    /// Writes nothing but headers: for measuring the hand-over alone.
    pub const NULL: u32 = 1;
    /// The SIMD tracer.
    pub const CPU: u32 = 2;
    /// The compute tracer.
    pub const GPU: u32 = 3;
    /// No rays: the host measured.
    pub const HOST: u32 = 4;
}

/// Header of one bundle: all that one bundle measured at one frame.
///
/// The payload starts with `plane_count` [`Plane`]s; each says where its bytes lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BundleHeader {
    /// The frame that was measured.
    pub stamp: Stamp,
    /// Whose bundle this is.
    pub bundle: BundleId,
    /// How many planes the table holds.
    pub plane_count: u32,
    /// Bytes in use, the table included.
    pub byte_len: u64,
    /// The measured snapshot's hash.
    pub state_hash: u64,
    /// `world_from_parent` at that frame.
    pub world_from_parent: Pose,
    /// The actor that carries the bundle, or nobody.
    pub parent: ActorId,
    /// One of [`tracer`].
    pub tracer: u32,
    /// Zero.
    pub reserved: u32,
    /// Monotonic clock when measuring began.
    pub begin_nanos: u64,
    /// Monotonic clock when measuring ended.
    pub end_nanos: u64,
}

const _: () = assert!(size_of::<BundleHeader>() == 104);

/// One output of one sensor, inside a bundle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Plane {
    /// Index of the sensor in its bundle.
    pub sensor: u32,
    /// One of [`output`].
    pub output: u32,
    /// Elements across (see [`SensorSpec::width`]); of sensors born of physics, how many there are.
    pub width: u32,
    /// Elements down.
    pub height: u32,
    /// Where the bytes begin, from the start of the payload; a multiple of 64.
    pub offset: u64,
    /// How many bytes.
    pub byte_len: u64,
    /// `world_from_sensor` at the measured frame.
    pub world_from_sensor: Pose,
    /// Lidar: azimuth of column 0, positive to the left.
    pub first_azimuth_rad: f32,
}

const _: () = assert!(size_of::<Plane>() == 64);

/// Bytes of one element of `output`, or 0 if there is no such output.
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

/// Lays a bundle's planes out: the table first, then each plane at a 64-byte edge, sensors in order,
/// outputs from the lowest bit. Returns the planes (poses still identity) and the bytes in all.
/// Planes of sensors born of physics have room for the most readings of one frame.
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
