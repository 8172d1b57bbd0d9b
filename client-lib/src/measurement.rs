//! The measurements of one bundle at one frame, read in the renderer's own memory.

use std::{sync::Arc, time::Duration};

use bus::BundleSample;
use protocol::{
    BundleHeader, CamReading, CollisionReading, Frame, GnssReading, ImuReading,
    LaneInvasionReading, MessageReading, ObstacleReading, OdometryReading, Plane, Reading,
    SensorSpec, output,
};

/// All that a bundle measured at one frame, in the renderer's own memory. It stays valid until this
/// is dropped; at most the bundle's `max_borrowed` measurements can be held. `Send` and `Sync`.
///
/// Sensors are named by their index in the bundle. An accessor gives `None`, or an empty slice, if the
/// sensor did not measure at this frame or has no such output.
pub struct Measurement {
    bundle: BundleSample,
    sensors: Arc<[SensorSpec]>,
}

impl Measurement {
    pub(crate) fn new(bundle: BundleSample, sensors: Arc<[SensorSpec]>) -> Measurement {
        Measurement { bundle, sensors }
    }

    /// Returns the header in the protocol's layout: frame, tracer and times. See also
    /// [`Measurement::frame`] and [`Measurement::sim_time`].
    #[must_use]
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

    /// Returns the measured frame.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.header().stamp.frame
    }

    /// Returns the whole payload.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.bundle.payload())
    }

    /// Returns the position of each output in the payload, in the protocol's layout.
    #[must_use]
    pub fn planes(&self) -> &[Plane] {
        let len = self.header().plane_count as usize * size_of::<Plane>();
        bytemuck::cast_slice(&self.bytes()[..len])
    }

    /// Returns the position of one output of one sensor, in the protocol's layout.
    #[must_use]
    pub fn plane(&self, sensor: usize, output: u32) -> Option<&Plane> {
        self.planes().iter().find(|p| p.sensor as usize == sensor && p.output == output)
    }

    /// Returns the bytes of one output: of a camera row by row from the top left, of a lidar column by
    /// column.
    #[must_use]
    pub fn data(&self, sensor: usize, output: u32) -> Option<&[u8]> {
        let plane = self.plane(sensor, output)?;
        self.bytes().get(plane.offset as usize..)?.get(..plane.byte_len as usize)
    }

    /// Returns red, green, blue and 255 of each pixel, sRGB.
    #[must_use]
    pub fn color(&self, sensor: usize) -> Option<&[[u8; 4]]> {
        self.data(sensor, output::COLOR).map(bytemuck::cast_slice)
    }

    /// Returns the depth of each pixel: metres along the optical axis.
    #[must_use]
    pub fn depth(&self, sensor: usize) -> Option<&[f32]> {
        self.data(sensor, output::DEPTH).map(bytemuck::cast_slice)
    }

    /// Returns the semantic tag of each pixel.
    #[must_use]
    pub fn tags(&self, sensor: usize) -> Option<&[u8]> {
        self.data(sensor, output::TAG)
    }

    /// Returns the actor or static object of each pixel.
    #[must_use]
    pub fn instances(&self, sensor: usize) -> Option<&[u32]> {
        self.data(sensor, output::INSTANCE).map(bytemuck::cast_slice)
    }

    /// Returns the surface normal of each pixel, in sensor space and towards the camera; zeros where
    /// nothing is hit.
    #[must_use]
    pub fn normals(&self, sensor: usize) -> Option<&[[f32; 3]]> {
        self.data(sensor, output::NORMAL).map(bytemuck::cast_slice)
    }

    /// Returns the optical flow of each pixel: motion in the image since the frame before, pixels to
    /// the right and down.
    #[must_use]
    pub fn flow(&self, sensor: usize) -> Option<&[[f32; 2]]> {
        self.data(sensor, output::FLOW).map(bytemuck::cast_slice)
    }

    /// Returns x, y, z in sensor space (metres) and intensity of each ray; zeros where nothing is hit.
    #[must_use]
    pub fn points(&self, sensor: usize) -> Option<&[[f32; 4]]> {
        self.data(sensor, output::POINTS).map(bytemuck::cast_slice)
    }

    /// Returns instance and semantic tag of each ray.
    #[must_use]
    pub fn labels(&self, sensor: usize) -> Option<&[[u32; 2]]> {
        self.data(sensor, output::LABELS).map(bytemuck::cast_slice)
    }

    /// Returns the reading of an inertial measurement unit.
    #[must_use]
    pub fn imu(&self, sensor: usize) -> Option<&ImuReading> {
        self.readings(sensor).first()
    }

    /// Returns the reading of a GNSS receiver.
    #[must_use]
    pub fn gnss(&self, sensor: usize) -> Option<&GnssReading> {
        self.readings(sensor).first()
    }

    /// Returns the reading of a speedometer and odometer.
    #[must_use]
    pub fn odometry(&self, sensor: usize) -> Option<&OdometryReading> {
        self.readings(sensor).first()
    }

    /// Returns the contacts of the carrier during this frame.
    #[must_use]
    pub fn collisions(&self, sensor: usize) -> &[CollisionReading] {
        self.readings(sensor)
    }

    /// Returns the lane markings that the carrier crossed during this frame.
    #[must_use]
    pub fn lane_invasions(&self, sensor: usize) -> &[LaneInvasionReading] {
        self.readings(sensor)
    }

    /// Returns the nearest obstacle ahead; `None` if there is none in range.
    #[must_use]
    pub fn obstacle(&self, sensor: usize) -> Option<&ObstacleReading> {
        self.readings(sensor).first()
    }

    /// Returns the cooperative awareness messages that were received in this frame.
    #[must_use]
    pub fn cams(&self, sensor: usize) -> &[CamReading] {
        self.readings(sensor)
    }

    /// Returns the texts that were received in this frame.
    #[must_use]
    pub fn messages(&self, sensor: usize) -> &[MessageReading] {
        self.readings(sensor)
    }

    /// Returns the readings of one physics sensor.
    #[must_use]
    pub fn readings<T: Reading>(&self, sensor: usize) -> &[T] {
        self.data(sensor, T::OUTPUT).map(bytemuck::cast_slice).unwrap_or_default()
    }
}

impl std::fmt::Debug for Measurement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Measurement").field("header", self.header()).finish_non_exhaustive()
    }
}
