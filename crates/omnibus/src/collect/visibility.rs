//! Which road users the cameras on the ego show: decided by geometry, not by images, so that it is
//! known before a frame is rendered and in a run that is resumed without rendering.

use client_lib::{Client, ClientError, Tag};
use glam::{Affine3A, Vec3, Vec3A};
use protocol::{ActorId, ActorState, Pose, SensorSpec, sensor};

use crate::collect::{camera_model::CameraModel, sensors::sensor_from_optical};

/// The cameras on the ego.
pub(crate) struct EgoCameras {
    cameras: Vec<(CameraModel, Pose)>,
}

/// The cameras at one frame.
pub(crate) struct PlacedCameras<'a> {
    client: &'a Client,
    ego: ActorId,
    /// Each with `optical_from_world` and its place in world space.
    cameras: Vec<(CameraModel, Affine3A, Vec3)>,
}

/// What is looked for: a box that stands on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    /// `None`: nothing stands there yet.
    pub(crate) actor: Option<ActorId>,
    /// Its centre, and its forward axis.
    pub(crate) pose: Pose,
    pub(crate) half_extents_m: Vec3,
}

impl Target {
    /// The centre, the middle of the top, and both ends at half of the height.
    fn points(&self) -> [Vec3; 4] {
        let Vec3 { x, z, .. } = self.half_extents_m;
        [Vec3::ZERO, Vec3::Z * 0.9 * z, Vec3::X * 0.9 * x, Vec3::NEG_X * 0.9 * x]
            .map(|point| self.pose.affine().transform_point3(point))
    }
}

impl EgoCameras {
    /// Returns the cameras among the sensors.
    pub(crate) fn new(sensors: &[SensorSpec]) -> EgoCameras {
        let cameras = sensors.iter().filter(|spec| spec.kind == sensor::CAMERA);
        EgoCameras {
            cameras: cameras.map(|spec| (CameraModel::of(spec), spec.parent_from_sensor)).collect(),
        }
    }

    /// Returns the cameras where the ego is now.
    pub(crate) fn at<'a>(&self, client: &'a Client, ego: &ActorState) -> PlacedCameras<'a> {
        let place = |(camera, vehicle_from_sensor): &(CameraModel, Pose)| {
            let world_from_sensor = ego.pose.then(vehicle_from_sensor);
            let optical_from_world = (world_from_sensor.affine() * sensor_from_optical()).inverse();
            (*camera, optical_from_world, world_from_sensor.position())
        };
        let cameras = self.cameras.iter().map(place).collect();
        PlacedCameras { client, ego: ego.actor_id, cameras }
    }
}

impl PlacedCameras<'_> {
    /// Returns whether a camera shows a part of the target, which would be at least `height_px` high.
    /// `margin` widens the images by this fraction of their size on each side.
    pub(crate) fn show(
        &self,
        target: &Target,
        height_px: f32,
        margin: f32,
    ) -> Result<bool, ClientError> {
        for (camera, optical_from_world, from) in &self.cameras {
            for point in target.points() {
                let is_shown = is_in_image(camera, optical_from_world, point, margin)
                    && camera.focal_px * 2.0 * target.half_extents_m.z
                        >= height_px * from.distance(point);
                if is_shown && !self.is_hidden(target, *from, point)? {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Returns whether something stands between a camera and a point of the target. Leaves hide little.
    fn is_hidden(&self, target: &Target, from: Vec3, point: Vec3) -> Result<bool, ClientError> {
        // The last part of the way is inside of the target.
        let reach_m = from.distance(point) - target.half_extents_m.x;
        let hits = self.client.cast_ray(from, point)?;
        Ok(hits.iter().any(|hit| {
            let is_own =
                hit.actor == Some(self.ego) || hit.actor.is_some() && hit.actor == target.actor;
            !is_own && hit.tag != Tag::Vegetation as u8 && from.distance(hit.position) < reach_m
        }))
    }
}

fn is_in_image(
    camera: &CameraModel,
    optical_from_world: &Affine3A,
    point: Vec3,
    margin: f32,
) -> bool {
    let at = optical_from_world.transform_point3a(Vec3A::from(point));
    if camera.depth(at) < 0.5 {
        return false;
    }
    let Some([u, v]) = camera.project(at) else { return false };
    let within = |pixel: f32, count: u32| {
        let size = count as f32;
        (-margin * size..(1.0 + margin) * size).contains(&pixel)
    };
    within(u, camera.width) && within(v, camera.height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::sensors::default_sensors;

    #[test]
    fn a_point_is_in_the_image_of_a_camera_ahead_of_it_and_a_margin_widens_the_image() {
        let spec = &default_sensors(800, 600)[0];
        let camera = CameraModel::of(spec);
        let ego = Pose::level(Vec3::new(10.0, 20.0, 0.0), 1.0);
        let world_from_optical =
            ego.then(&spec.parent_from_sensor).affine() * sensor_from_optical();
        let optical_from_world = world_from_optical.inverse();
        let shows = |x: f32, y: f32, margin: f32| {
            let point = ego.affine().transform_point3(Vec3::new(x, y, 1.0));
            is_in_image(&camera, &optical_from_world, point, margin)
        };
        // The horizontal field of view is 90 degrees, from 1.5 m ahead of the middle of the car.
        assert!(shows(21.5, 0.0, 0.0) && shows(21.5, 19.0, 0.0) && !shows(21.5, 21.0, 0.0));
        assert!(!shows(-20.0, 0.0, 0.0), "behind");
        assert!(shows(21.5, 21.0, 0.1) && !shows(21.5, 25.0, 0.1));
    }
}
