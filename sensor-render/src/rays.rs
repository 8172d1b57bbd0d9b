use glam::{Affine3A, DVec3, Mat3, Vec3};
use protocol::{EffectsSpec, Plane, Pose, Projection, SensorSpec, Stamp, lens_model, sensor};

use crate::lidar::{Lidar, noise_seed};
use crate::rain::Rainfall;
use crate::time_slices::{RAYS_MAX, shares};
use crate::{error::TraceError, lens::Lens, quality::Quality};

/// Sets each plane's `world_from_sensor` for the given pose of the bundle's parent.
pub fn pose_planes(planes: &mut [Plane], sensors: &[SensorSpec], world_from_parent: &Pose) {
    for plane in planes {
        if let Some(spec) = sensors.get(plane.sensor as usize) {
            plane.world_from_sensor = world_from_parent.then(&spec.parent_from_sensor);
        }
    }
}

/// Ray generator of a sensor.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "lidars are few beside cameras")]
pub(crate) enum Sensor {
    Camera(Camera),
    Lidar(Box<Lidar>),
}

/// Camera: one ray through the centre of each pixel. The component of each direction along the optical
/// axis is 1, so that the ray parameter is the depth; directions of a fisheye have unit length.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Position in world space. The directions are in world space too.
    pub(crate) origin: Vec3,
    pub(crate) forward: Vec3,
    /// Vector from the centre of a pixel to that of its right neighbour, at depth 1.
    pub(crate) right: Vec3,
    pub(crate) down: Vec3,
    /// Principal point, in pixels from the centre of pixel (0, 0).
    pub(crate) center: [f32; 2],
    /// Width of a pixel at depth 1, in the middle of the image. Metres.
    pub(crate) pixel: f32,
    /// Height of a pixel at depth 1, in the middle of the image. Metres.
    pub(crate) pixel_down: f32,
    /// Lens; `None`: a pinhole.
    pub(crate) lens: Option<Box<Lens>>,
    /// Rays per pixel of the colour image.
    pub(crate) quality: Quality,
    /// Effects on the colour image.
    pub(crate) effects: EffectsSpec,
    /// Seed of the noise of this frame.
    pub(crate) seed: u32,
    /// View of the previous frame, if the camera has moved since.
    pub(crate) before: Option<View>,
    /// Drops and spray in front of it, if there are any.
    pub(crate) rain: Option<Box<Rainfall>>,
}

/// Position and axes of a camera, scaled as in [`Camera`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub(crate) origin: Vec3,
    pub(crate) forward: Vec3,
    pub(crate) right: Vec3,
    pub(crate) down: Vec3,
}

/// Shutter: the view of each ray lies between that of this frame and that of the previous one. Axes are
/// interpolated linearly, which shortens them by the square of the angle between the frames / 8.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shutter {
    /// Share of the way to the previous view in row 0, and what each further row adds.
    pub(crate) first: f32,
    pub(crate) step: f32,
    /// What each ray of a pixel adds.
    pub(crate) blur: [f32; RAYS_MAX],
    /// Difference of the previous view from this one.
    pub(crate) to_before: View,
}

/// Thin lens: each ray of a pixel begins at a point of a disc, and all meet at the distance in focus (R. Cook,
/// T. Porter and L. Carpenter, *Distributed Ray Tracing*, SIGGRAPH 1984). The points are the same for all
/// pixels, so that there is no noise: P. Haeberli and K. Akeley, *The Accumulation Buffer*, SIGGRAPH 1990.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThinLens {
    /// Radii of the disc, in world space.
    pub(crate) right: Vec3,
    pub(crate) down: Vec3,
    /// 1 / distance in focus.
    pub(crate) per_focus: f32,
}

impl Camera {
    #[inline]
    fn new(
        spec: &SensorSpec,
        pose: &Pose,
        stamp: Stamp,
        quality: Quality,
    ) -> Result<Camera, TraceError> {
        let projection =
            Projection::of(spec).map_err(|why| TraceError::Lens { sensor: spec.name, why })?;
        let [pixel, pixel_down] = projection.focal_px().map(|focal| (1.0 / focal) as f32);
        let axes = Mat3::from_quat(pose.rotation());
        Ok(Camera {
            width: spec.width,
            height: spec.height,
            origin: pose.position(),
            forward: axes.x_axis,
            right: -axes.y_axis * pixel,
            down: -axes.z_axis * pixel_down,
            center: projection.center_px().map(|center| (center - 0.5) as f32),
            pixel,
            pixel_down,
            lens: (projection.model() != lens_model::PINHOLE)
                .then(|| Box::new(Lens::new(projection))),
            quality: quality.or_own(spec.quality),
            effects: spec.effects,
            seed: noise_seed(spec.seed, stamp.sim_time_nanos),
            before: None,
            rain: None,
        })
    }

    /// Returns the direction of the ray through the centre of a pixel; `None` where the lens shows nothing.
    #[inline(always)]
    pub(crate) fn direction(&self, x: u32, y: u32) -> Option<Vec3> {
        if let Some(lens) = &self.lens {
            let ray = lens.ray(x, y)?;
            let [x, y] = [ray.x * lens.focal[0], ray.y * lens.focal[1]];
            return Some(self.forward * ray.z + self.right * x + self.down * y);
        }
        let (x, y) = (x as f32 - self.center[0], y as f32 - self.center[1]);
        Some(self.forward + self.right * x + self.down * y)
    }

    /// Projects a vector from the camera in the given view. Returns column and row in pixels from the
    /// centre of pixel (0, 0), and the depth; `None` where that is less than `near`, and where a lens shows
    /// nothing.
    pub(crate) fn project(&self, view: &View, to: Vec3, near: f32) -> Option<([f32; 2], f32)> {
        let depth = to.dot(view.forward);
        // `right` and `down` have the length of a pixel's side at depth 1.
        if let Some(lens) = &self.lens {
            let [x, y] = [(view.right, lens.focal[0]), (view.down, lens.focal[1])]
                .map(|(axis, focal)| to.dot(axis) * focal);
            let at = lens.project(DVec3::new(x.into(), y.into(), depth.into()))?;
            let depth = if lens.is_fisheye { to.length() } else { depth };
            return (depth >= near).then_some((at, depth));
        }
        if depth < near {
            return None;
        }
        let across = to.dot(view.right) / (self.pixel * self.pixel * depth) + self.center[0];
        let down = to.dot(view.down) / (self.pixel_down * self.pixel_down * depth) + self.center[1];
        Some(([across, down], depth))
    }

    /// Returns the shutter; `None` if all rays see the same pose.
    ///
    /// `delta_nanos` is the time since the previous frame.
    pub(crate) fn shutter(&self, delta_nanos: u64) -> Option<Shutter> {
        let before = self.before.as_ref()?;
        let EffectsSpec { readout_secs, blur_secs, .. } = self.effects;
        let readout = readout_secs * 1e9 / delta_nanos.max(1) as f32;
        (readout_secs > 0.0 || blur_secs > 0.0).then(|| Shutter {
            first: readout * (1.0 - 0.5 / self.height as f32),
            step: -readout / self.height as f32,
            blur: shares(&self.effects, self.quality.samples().len(), delta_nanos),
            to_before: View {
                origin: before.origin - self.origin,
                forward: before.forward - self.forward,
                right: before.right - self.right,
                down: before.down - self.down,
            },
        })
    }

    /// Returns the thin lens; `None` if everything is sharp.
    pub(crate) fn thin_lens(&self) -> Option<ThinLens> {
        let EffectsSpec { aperture_m, focus_m, .. } = self.effects;
        (aperture_m > 0.0 && focus_m > 0.0).then(|| ThinLens {
            right: self.right * (0.5 * aperture_m / self.pixel),
            down: self.down * (0.5 * aperture_m / self.pixel_down),
            per_focus: 1.0 / focus_m,
        })
    }

    /// Returns the view of this frame.
    pub(crate) fn view(&self) -> View {
        let Camera { origin, forward, right, down, .. } = *self;
        View { origin, forward, right, down }
    }

    /// Returns the view after the transform `moved`.
    pub(crate) fn moved(&self, moved: &Affine3A) -> View {
        View {
            origin: moved.transform_point3(self.origin),
            forward: moved.transform_vector3(self.forward),
            right: moved.transform_vector3(self.right),
            down: moved.transform_vector3(self.down),
        }
    }
}

/// Returns the ray generator of one sensor of a bundle. `quality` is that of cameras that ask for none.
///
/// # Errors
/// [`TraceError`] if the pose is not rigid, the kind is unsupported, or the lens is out of range.
#[inline]
pub(crate) fn rays(
    spec: &SensorSpec,
    pose: &Pose,
    stamp: Stamp,
    delta_nanos: u64,
    quality: Quality,
) -> Result<Sensor, TraceError> {
    if !pose.is_valid() {
        return Err(TraceError::InvalidPose { sensor: spec.name });
    }
    match spec.kind {
        sensor::CAMERA => Camera::new(spec, pose, stamp, quality).map(Sensor::Camera),
        sensor::LIDAR => Ok(Sensor::Lidar(Box::new(Lidar::new(spec, pose, stamp, delta_nanos)))),
        kind => Err(TraceError::UnknownKind { sensor: spec.name, kind }),
    }
}
