//! Sensor bundles, and the numbers that name sensor types, outputs and tracers on the wire.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Name};

/// The id of a sensor bundle: sensors that are measured and delivered together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct BundleId(pub u32);

/// The most sensors in one bundle.
pub const SENSORS_MAX: usize = 4096;

/// Values of [`crate::SensorSpec::kind`].
pub mod sensor {
    /// A pinhole camera. Sensor space is x forward, y left, z up; pixel (0, 0) is top left and
    /// its centre lies at (0.5, 0.5).
    pub const CAMERA: u32 = 1;
    /// A lidar: `width` azimuth steps in one frame, `height` channels; [`crate::LidarSpec`].
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

/// Outputs of sensors: bits of [`crate::SensorSpec::outputs`], values of [`crate::Plane::output`].
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
    /// As [`POINTS`], of the last return of each ray if it is not the strongest, which is in
    /// [`POINTS`]; else of the second strongest. Zeros where there is only one.
    pub const LAST_POINTS: u32 = 1 << 8;
    /// As [`LABELS`], of the returns of [`LAST_POINTS`].
    pub const LAST_LABELS: u32 = 1 << 9;
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
    pub const OF_LIDAR: u32 = POINTS | LABELS | LAST_POINTS | LAST_LABELS;
    /// Every output of physics sensors.
    pub const PHYSICS: u32 = !0 << 16;
}

/// Values of [`crate::SensorSpec::point_attribute`].
pub mod point_attribute {
    /// Intensity of the return, 0 to 1.
    pub const INTENSITY: u32 = 0;
    /// Cosine of the angle of incidence, above 0 to 1.
    pub const COS_INCIDENCE: u32 = 1;
}

/// Values of [`crate::SensorSpec::quality`]: rays per pixel of a colour image. The other outputs of a
/// camera have one ray through the centre of each pixel at every level.
pub mod quality {
    /// The level of the renderer.
    pub const DEFAULT: u32 = 0;
    /// One ray.
    pub const LOW: u32 = 1;
    /// Four rays.
    pub const STANDARD: u32 = 2;
    /// Sixteen rays.
    pub const EPIC: u32 = 3;
}

/// Depth of a pixel where nothing is hit, metres.
pub const DEPTH_FAR_M: f32 = 1000.0;

/// Values of [`crate::BundleHeader::tracer`].
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

/// Parameters of [`crate::Command::CreateBundle`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CreateBundle {
    /// The actor that the sensors are attached to; [`ActorId::NONE`]: they are fixed in the world.
    pub parent: ActorId,
    /// Number of sensors that follow.
    pub sensor_count: u32,
    /// Number of measurements that a reader may borrow at a time, 1 to 8.
    pub max_borrowed: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// The name given by the user.
    pub name: Name,
}
