//! The camera and the lidar of a connection: one bundle on the ego, while they are subscribed to.

use client_lib::{
    ActorId, BlueprintInfo, CameraOutputs, Client, ClientError, LidarOptions, Measurement, Pose,
    Sensor, SensorBundle,
    glam::{DAffine3, DMat3, DVec3, Quat, Vec3},
};
use foxglove::{Calibration, Message, compressed_image, point_cloud};

use crate::{encode, stream::scene::affine, tiles};

/// Spaces of the sensors; optical space is x right, y down, z forward.
const CAMERA: &str = "front";
const OPTICAL: &str = "front_optical";
const LIDAR: &str = "lidar";
/// Size of the images, pixels, and their horizontal field of view.
const SIZE: [u32; 2] = [640, 360];
const FOV_RAD: f32 = std::f32::consts::FRAC_PI_2;
/// Channels and columns of the lidar; its elevations and its range are those of a page's lidar.
const LIDAR_SIZE: [u32; 2] = [32, 720];
/// See `Tiles`: the newest measurement, the one that takes its place, and a still newer one.
const BORROWED_MAX: u32 = 3;

/// Which sensors are subscribed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wanted {
    pub(crate) camera: bool,
    pub(crate) lidar: bool,
}

/// The sensors of a connection.
#[derive(Debug, Default)]
pub(crate) struct Sensors {
    /// The actor and the sensors that the bundle is for, or was refused for.
    on: Option<(ActorId, Wanted)>,
    bundle: Option<SensorBundle>,
    newest: Option<Measurement>,
}

impl Sensors {
    /// Mounts what is subscribed to on an actor, where that has changed.
    ///
    /// # Errors
    ///
    /// [`ClientError`] if the host refuses the sensors; they are not created again until something
    /// changes.
    pub(crate) fn mount(
        &mut self,
        client: &mut Client,
        ego: Option<(ActorId, [Pose; 2])>,
        wanted: Wanted,
    ) -> Result<(), ClientError> {
        let ego = ego.filter(|_| wanted != Wanted::default());
        let on = ego.map(|(id, _)| (id, wanted));
        if self.on == on {
            return Ok(());
        }
        *self = Sensors { on, ..Sensors::default() };
        let Some((id, poses)) = ego else { return Ok(()) };
        let [width, height] = SIZE;
        let camera = Sensor::camera(CAMERA, poses[0], width, height, FOV_RAD);
        let [channels, columns] = LIDAR_SIZE;
        let elevations = tiles::LIDAR_ELEVATIONS_DEG.map(f32::to_radians);
        let options = LidarOptions::new(channels, columns, elevations, tiles::LIDAR_RANGE_M);
        let lidar = Sensor::lidar(LIDAR, poses[1], options);
        let camera = wanted.camera.then(|| camera.outputs(CameraOutputs::COLOR));
        let sensors = camera.into_iter().chain(wanted.lidar.then_some(lidar));
        self.bundle = Some(client.create_bundle("foxglove", id, sensors, BORROWED_MAX)?);
        Ok(())
    }

    /// Returns the newest measurement.
    ///
    /// # Errors
    ///
    /// [`ClientError`] if the bundle has ended.
    pub(crate) fn newest(&mut self) -> Result<Option<&Measurement>, ClientError> {
        if let Some(bundle) = &mut self.bundle
            && let Some(newest) = bundle.latest()?
        {
            self.newest = Some(newest);
        }
        Ok(self.newest.as_ref())
    }

    /// Destroys the sensors.
    pub(crate) fn clear(&mut self) {
        *self = Sensors::default();
    }
}

/// Returns where camera and lidar are on a vehicle: above its roof.
pub(crate) fn poses(blueprint: &BlueprintInfo) -> [Pose; 2] {
    let (center, half) =
        (Vec3::from_array(blueprint.center_m), Vec3::from_array(blueprint.half_extents_m));
    let roof = center + Vec3::Z * half.z;
    let at = |ahead_m, above_m| Pose::new(roof + Vec3::new(ahead_m, 0.0, above_m), Quat::IDENTITY);
    [at(0.5 * half.x, 0.1), at(0.0, 0.4)]
}

/// Returns the spaces of the sensors in the space of the ego.
pub(crate) fn spaces([camera, lidar]: [Pose; 2]) -> [(&'static str, DAffine3); 3] {
    let camera = affine(&camera);
    let axes = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
    let optical = camera * DAffine3::from_mat3(axes);
    [(CAMERA, camera), (OPTICAL, optical), (LIDAR, affine(&lidar))]
}

/// Returns `foxglove.CameraCalibration`.
pub(crate) fn calibration(time: &Message) -> Message {
    let pinhole = client_lib::Intrinsics::from_fov(SIZE[0], SIZE[1], FOV_RAD);
    let [fx, fy, cx, cy] =
        [pinhole.fx, pinhole.fy, pinhole.cx - 0.5, pinhole.cy - 0.5].map(f64::from);
    let intrinsics_px = [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]];
    Calibration { size: SIZE, intrinsics_px, distortion: None }.message(time, OPTICAL)
}

/// Returns `foxglove.CompressedImage` of the first sensor of a measurement; `None` if that is no camera.
pub(crate) fn image(time: &Message, measured: &Measurement) -> Option<Message> {
    let file = encode::color_jpeg(&measured.color_image(0)?);
    let file = file.inspect_err(|e| log::warn!("an image was not encoded: {e}")).ok()?;
    Some(compressed_image(time, OPTICAL, "jpeg").bytes(2, &file))
}

/// Returns `foxglove.PointCloud` of what the lidar of a measurement has hit; `None` if there is none.
pub(crate) fn points(time: &Message, measured: &Measurement) -> Option<Message> {
    let cloud = [0, 1].into_iter().find_map(|sensor| measured.point_cloud(sensor))?;
    let (mut points, mut labels) = (Vec::new(), Vec::new());
    for (index, point) in cloud.points.iter().enumerate() {
        if point[..3] != [0.0; 3] {
            points.extend(point.iter().flat_map(|number| number.to_le_bytes()));
            let label = cloud.labels.get(index).copied().unwrap_or_default();
            labels.extend(label.iter().flat_map(|number| number.to_le_bytes()));
        }
    }
    Some(point_cloud(time, LIDAR, &points, &labels))
}
