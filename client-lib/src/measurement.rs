//! The measurements of one bundle at one frame, read in the renderer's own memory.

use std::{sync::Arc, time::Duration};

use bus::BundleSample;
use protocol::{
    BundleHeader, CamReading, CollisionReading, Frame, GnssReading, ImuReading,
    LaneInvasionReading, MessageReading, ObstacleReading, OdometryReading, Plane, Reading,
    SensorSpec, output,
};

/// All that a bundle measured at one frame. Its bytes are the renderer's own; they stay until this is
/// dropped, so hold no more than the bundle's `max_borrowed`.
pub struct Measurement {
    bundle: BundleSample,
    sensors: Arc<[SensorSpec]>,
}

impl Measurement {
    pub(crate) fn new(bundle: BundleSample, sensors: Arc<[SensorSpec]>) -> Measurement {
        Measurement { bundle, sensors }
    }

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
