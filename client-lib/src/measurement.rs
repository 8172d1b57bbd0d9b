//! The measurements of one bundle at one frame, read in the renderer's own memory.

use std::{sync::Arc, time::Duration};

use bus::BundleSample;
use protocol::{ActorId, BundleHeader, Frame, Plane, Pose, Reading, SensorSpec, output};

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

    /// Returns the header in the protocol's layout: frame, tracer and times. The typed way is
    /// [`Measurement::frame`], [`Measurement::sim_time`], [`Measurement::episode`],
    /// [`Measurement::state_hash`], [`Measurement::parent`] and [`Measurement::world_from_parent`].
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

    /// Returns the number of the world that was measured, from 1.
    #[must_use]
    pub fn episode(&self) -> u32 {
        self.header().stamp.episode
    }

    /// Returns the state hash of the measured snapshot: [`World::state_hash`](crate::World::state_hash)
    /// at this frame.
    #[must_use]
    pub fn state_hash(&self) -> u64 {
        self.header().state_hash
    }

    /// Returns the actor that carries the bundle; `None` if the bundle is fixed in the world.
    #[must_use]
    pub fn parent(&self) -> Option<ActorId> {
        Some(self.header().parent).filter(|parent| *parent != ActorId::NONE)
    }

    /// Returns the pose of the bundle's parent in world space at the measured frame.
    #[must_use]
    pub fn world_from_parent(&self) -> Pose {
        self.header().world_from_parent
    }

    /// Returns the pose of a sensor in world space at the measured frame; `None` if the sensor did
    /// not measure.
    #[must_use]
    pub fn world_from_sensor(&self, sensor: usize) -> Option<Pose> {
        let plane = self.planes().iter().find(|plane| plane.sensor as usize == sensor);
        plane.map(|plane| plane.world_from_sensor)
    }

    /// Returns the whole payload.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.bundle.payload())
    }

    /// Returns the position of each output in the payload, in the protocol's layout. The typed way
    /// is [`Measurement::color_image`] and its siblings, [`Measurement::point_cloud`], and
    /// [`Measurement::world_from_sensor`].
    #[must_use]
    pub fn planes(&self) -> &[Plane] {
        let len = self.header().plane_count as usize * size_of::<Plane>();
        bytemuck::cast_slice(&self.bytes()[..len])
    }

    /// Returns the position of one output of one sensor, in the protocol's layout: see
    /// [`Measurement::planes`].
    #[must_use]
    pub fn plane(&self, sensor: usize, output: u32) -> Option<&Plane> {
        self.planes().iter().find(|p| p.sensor as usize == sensor && p.output == output)
    }

    /// Returns the bytes of one output: of a camera row by row from the top left, of a lidar column by
    /// column. The typed way is the method of the output, as [`Measurement::color`] and
    /// [`Measurement::points`].
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

    /// Returns x, y, z in sensor space (metres) and the [`PointAttribute`](crate::PointAttribute) of
    /// each ray; zeros where nothing is hit.
    #[must_use]
    pub fn points(&self, sensor: usize) -> Option<&[[f32; 4]]> {
        self.data(sensor, output::POINTS).map(bytemuck::cast_slice)
    }

    /// Returns instance and semantic tag of each ray.
    #[must_use]
    pub fn labels(&self, sensor: usize) -> Option<&[[u32; 2]]> {
        self.data(sensor, output::LABELS).map(bytemuck::cast_slice)
    }

    /// Returns the points of the last returns, see [`LidarOutputs`](crate::LidarOutputs); zeros where
    /// there is but one return.
    #[must_use]
    pub fn last_points(&self, sensor: usize) -> Option<&[[f32; 4]]> {
        self.data(sensor, output::LAST_POINTS).map(bytemuck::cast_slice)
    }

    /// Returns instance and semantic tag of each of the last returns.
    #[must_use]
    pub fn last_labels(&self, sensor: usize) -> Option<&[[u32; 2]]> {
        self.data(sensor, output::LAST_LABELS).map(bytemuck::cast_slice)
    }

    /// Returns the readings of one physics sensor in the protocol's layout. The typed way is the
    /// method of the sensor's kind, as [`Measurement::imu`] and [`Measurement::collisions`].
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
