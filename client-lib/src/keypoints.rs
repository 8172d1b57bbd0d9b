//! Keypoints of walkers: the 17 of COCO, in space and in the images of cameras.
//!
//! Shoulders, elbows, wrists, hips, knees and ankles are joints of the skeleton; nose, eyes and ears
//! are points on the surface of the head.

use glam::{Affine3A, Vec2, Vec3, vec3};
use protocol::{ActorId, ActorState, Pose, Projection, WalkerLimbs, flag, kind};
use town::{Blueprint, GivenPose, Skeleton};

use crate::{Client, ClientError, bones::posture_of};

/// Number of keypoints.
pub const KEYPOINT_COUNT: usize = 17;

/// Names of the keypoints in COCO's order. Left is the walker's own left.
pub const KEYPOINTS: [&str; KEYPOINT_COUNT] = [
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
];

/// Pairs of keypoints that COCO's `skeleton` connects, counted from 1.
pub const KEYPOINT_LINKS: [[u32; 2]; 19] = [
    [16, 14],
    [14, 12],
    [17, 15],
    [15, 13],
    [12, 13],
    [6, 12],
    [7, 13],
    [6, 7],
    [6, 8],
    [7, 9],
    [8, 10],
    [9, 11],
    [2, 3],
    [1, 2],
    [1, 3],
    [2, 4],
    [3, 5],
    [4, 6],
    [5, 7],
];

/// Where a keypoint lies in the space of the skeleton.
#[derive(Clone, Copy)]
enum Place {
    /// On the head: forward, left and up from its middle, in half heads.
    Head([f32; 3]),
    /// At the origin of a bone.
    Joint(usize),
}

use Place::{Head, Joint};

/// The bone that the head follows.
const HEAD: usize = 13;

/// Place of each keypoint, and how far below the surface of the body it may lie, metres for a walker
/// of 1.75 m. The bones are those of [`BONES`](crate::BONES).
const PLACES: [(Place, f32); KEYPOINT_COUNT] = [
    (Head([0.93, 0.0, -0.20]), 0.05),
    (Head([0.72, 0.27, 0.03]), 0.05),
    (Head([0.72, -0.27, 0.03]), 0.05),
    (Head([-0.04, 0.73, -0.08]), 0.05),
    (Head([-0.04, -0.73, -0.08]), 0.05),
    (Joint(5), 0.12),
    (Joint(9), 0.12),
    (Joint(6), 0.09),
    (Joint(10), 0.09),
    (Joint(7), 0.08),
    (Joint(11), 0.08),
    (Joint(16), 0.18),
    (Joint(21), 0.18),
    (Joint(17), 0.12),
    (Joint(22), 0.12),
    (Joint(18), 0.10),
    (Joint(23), 0.10),
];

/// Height of the walker that the depths in [`PLACES`] are for, metres.
const USUAL_HEIGHT_M: f32 = 1.75;

/// The keypoints of one walker at one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Keypoints {
    /// The walker.
    pub actor_id: ActorId,
    /// Positions in world space in the order of [`KEYPOINTS`], metres.
    pub in_world: [Vec3; KEYPOINT_COUNT],
    /// Distance below the surface at which each still counts as visible, metres.
    pub body_radius_m: [f32; KEYPOINT_COUNT],
}

/// Whether an image shows a keypoint: COCO's number `v`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum KeypointVisibility {
    /// Outside of the image.
    Outside = 0,
    /// In the image, behind something else or behind the walker's own body.
    Occluded = 1,
    /// Visible.
    Visible = 2,
}

/// A keypoint in the image of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ImageKeypoint {
    /// Position in sensor space (x forward, y left, z up), metres.
    pub in_sensor: Vec3,
    /// Column and row in pixels; the centre of pixel (0, 0) lies at (0.5, 0.5). Zeros outside of the
    /// image.
    pub px: Vec2,
    /// Whether the image shows it.
    pub visibility: KeypointVisibility,
}

/// The images of a camera that say what it shows.
#[derive(Clone, Copy, Debug)]
pub struct KeypointView<'a> {
    /// Projection of the camera.
    pub projection: &'a Projection,
    /// Pose of the camera.
    pub world_from_sensor: Pose,
    /// Width and height of the images, pixels.
    pub size_px: [u32; 2],
    /// The actor of each pixel, row by row.
    pub instances: &'a [u32],
    /// The depth of each pixel, metres. Without it, what hides a keypoint is found by `instances` alone,
    /// so that a walker's own body hides nothing.
    pub depth: Option<&'a [f32]>,
}

/// Returns the keypoints of a walker; `None` for an actor without a skeleton, as vehicles and their
/// riders are.
///
/// `limbs` are those of a fallen walker. `given` is the pose that clients have set, with its weight, as
/// [`Client::given_pose`] returns them.
#[must_use]
pub fn keypoints(
    blueprint: &Blueprint,
    state: &ActorState,
    limbs: Option<&WalkerLimbs>,
    given: Option<(Vec<Pose>, f32)>,
) -> Option<Keypoints> {
    let skeleton = blueprint.skeleton()?;
    let given = given.map(|(bones, weight)| {
        let bones = bones.iter().map(|pose| Some((pose.position(), pose.rotation())));
        (bones.collect::<Vec<_>>(), weight)
    });
    let given = given.as_ref().map(|(bones, weight)| GivenPose { weight: *weight, bones });
    let mut actor_from_rest = vec![Affine3A::IDENTITY; skeleton.bones.len()];
    let posture = town::Posture { given, ..posture_of(state, limbs) };
    skeleton.pose(&posture, &mut actor_from_rest);
    let world_from_actor = state.pose.affine();
    let height_m = 2.0 * blueprint.half_extents_m.z;
    let in_world = PLACES.map(|(place, _)| {
        let (bone, at_rest) = at_rest(place, skeleton, height_m);
        world_from_actor.transform_point3(actor_from_rest[bone].transform_point3(at_rest))
    });
    let body_radius_m = PLACES.map(|(_, radius)| radius * height_m / USUAL_HEIGHT_M);
    Some(Keypoints { actor_id: state.actor_id, in_world, body_radius_m })
}

/// Returns the bone that a keypoint follows, and its position in actor space while that is at rest.
fn at_rest(place: Place, skeleton: &Skeleton, height_m: f32) -> (usize, Vec3) {
    match place {
        Joint(bone) => (bone, skeleton.bones[bone].at_m),
        Head(from_middle) => {
            // The proportions of the meshes: an eighth of the height, and more for a child.
            let half = (0.125 * height_m).max(0.185) / 2.0;
            let middle = vec3(0.010 * height_m, 0.0, 0.995 * height_m - half);
            (HEAD, middle + Vec3::from_array(from_middle) * half)
        }
    }
}

impl Client {
    /// Returns the keypoints of a walker at the frame that was taken in last.
    ///
    /// # Errors
    ///
    /// [`ClientError::NoSuchActor`] if no walker has this id at that frame; as for
    /// [`Client::given_pose`], which is called if a client has set a pose.
    pub fn keypoints(&mut self, actor_id: ActorId) -> Result<Keypoints, ClientError> {
        let missing = ClientError::NoSuchActor { actor_id };
        let Some(state) = self.world().state(actor_id).copied() else { return Err(missing) };
        let limbs = WalkerLimbs::find(self.world().limbs(), actor_id).copied();
        let Some(blueprint) = town::catalogue().get(state.blueprint as usize) else {
            return Err(missing);
        };
        let is_posed = state.kind == kind::WALKER && state.has(flag::POSED);
        let given = if is_posed { Some(self.given_pose(actor_id)?) } else { None };
        keypoints(blueprint, &state, limbs.as_ref(), given).ok_or(missing)
    }
}

impl Keypoints {
    /// Returns the keypoints in the image of a camera.
    ///
    /// A keypoint is visible if one of the nine pixels around it shows its walker, and the surface there
    /// is nearer to the camera than the keypoint by at most its body radius.
    #[must_use]
    pub fn in_image(&self, view: &KeypointView<'_>) -> [ImageKeypoint; KEYPOINT_COUNT] {
        let sensor_from_world = view.world_from_sensor.affine().inverse();
        std::array::from_fn(|index| {
            let in_sensor = sensor_from_world.transform_point3(self.in_world[index]);
            let [width, height] = view.size_px.map(|size| size as f32);
            let pixel = view.projection.project(in_sensor).filter(|pixel| {
                (0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y)
            });
            let Some(px) = pixel else {
                let visibility = KeypointVisibility::Outside;
                return ImageKeypoint { in_sensor, px: Vec2::ZERO, visibility };
            };
            let nearest_m = view.projection.depth_m(in_sensor) - self.body_radius_m[index];
            let visibility = if view.shows(self.actor_id, px, nearest_m) {
                KeypointVisibility::Visible
            } else {
                KeypointVisibility::Occluded
            };
            ImageKeypoint { in_sensor, px, visibility }
        })
    }
}

impl KeypointView<'_> {
    /// Returns whether a pixel or one beside it shows an actor at this depth or behind it.
    fn shows(&self, actor_id: ActorId, px: Vec2, nearest_m: f32) -> bool {
        let [width, height] = self.size_px.map(|size| size as usize);
        let around = |at: f32, size: usize| {
            let at = at as usize;
            at.saturating_sub(1)..(at + 2).min(size)
        };
        around(px.y, height).any(|row| {
            around(px.x, width).any(|column| {
                let pixel = row * width + column;
                let depth_m = |depth: &[f32]| depth.get(pixel).copied().unwrap_or(0.0);
                self.instances.get(pixel) == Some(&actor_id.0)
                    && self.depth.is_none_or(|depth| depth_m(depth) >= nearest_m)
            })
        })
    }
}

#[cfg(test)]
mod tests;
