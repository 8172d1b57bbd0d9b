//! The actors and static objects in the measurements, counted in instance images and lidar labels.

use std::collections::BTreeMap;

use client_lib::{ImageKeypoint, KeypointView, Keypoints, posture_of};
use glam::{Affine3A, Vec3};
use mesh::{ObjectId, Tag};
use protocol::{ActorId, ActorState, BlueprintInfo, Pose, WalkerLimbs, kind, light};
use town::Blueprint;

use crate::collect::{
    camera_model::CameraModel,
    encode::file_id,
    format::{ActorBox, ObjectBox, View, ViewKeypoints},
    label_settings::LabelSettings,
    objects::StaticObjects,
    outline::{Outline, outline},
    rle::Rle,
    sensors::sensor_from_optical,
    silhouette::{Part, Silhouette},
};

/// The pixels of one actor or object in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) pixels: u32,
    /// Left, top, right, bottom edge; right and bottom are exclusive.
    pub(crate) edges_px: [u32; 4],
}

/// Everything that may have a box: the actors of a frame (sorted by id), then the objects of the
/// town.
#[derive(Clone, Copy)]
pub(crate) struct Boxed<'a> {
    pub(crate) actors: &'a [ActorState],
    /// Of the fallen walkers.
    pub(crate) limbs: &'a [WalkerLimbs],
    pub(crate) objects: &'a StaticObjects,
}

impl Boxed<'_> {
    fn len(&self) -> usize {
        self.actors.len() + self.objects.len()
    }

    /// Returns the position in this order of what an instance image shows; the sky, the ground and
    /// objects without a box have none.
    fn index_of(&self, id: u32) -> Option<usize> {
        match ObjectId::from_instance(id) {
            None if id == 0 => None,
            None => self.actors.binary_search_by_key(&ActorId(id), |a| a.actor_id).ok(),
            Some(object) => {
                let index = object.index()? as usize;
                self.objects.has_box(index).then_some(self.actors.len() + index)
            }
        }
    }
}

/// Returns the pixels of everything that may have a box in an instance image.
pub(crate) fn seen(ids: &[u32], width: usize, boxed: Boxed) -> Vec<Option<Seen>> {
    let mut found: Vec<Option<Seen>> = vec![None; boxed.len()];
    for (row, line) in (0..).zip(ids.chunks_exact(width)) {
        let mut from = 0;
        for run in line.chunk_by(|a, b| a == b) {
            let (left, right) = (from, from + run.len() as u32);
            from = right;
            let Some(index) = boxed.index_of(run[0]) else { continue };
            let seen =
                found[index].get_or_insert(Seen { pixels: 0, edges_px: [left, row, right, row] });
            let [l, t, r, _] = seen.edges_px;
            seen.edges_px = [l.min(left), t, r.max(right), row + 1];
            seen.pixels += right - left;
        }
    }
    found
}

/// Returns the number of lidar returns of everything that may have a box.
pub(crate) fn returns(labels: &[[u32; 2]], boxed: Boxed) -> Vec<u32> {
    let mut counts = vec![0; boxed.len()];
    for run in labels.chunk_by(|a, b| a[0] == b[0]) {
        if let Some(index) = boxed.index_of(run[0][0]) {
            counts[index] += run.len() as u32;
        }
    }
    counts
}

/// The image of one camera.
pub(crate) struct CameraView<'a> {
    pub(crate) name: &'a str,
    pub(crate) camera: CameraModel,
    pub(crate) world_from_sensor: Pose,
    pub(crate) seen: Vec<Option<Seen>>,
    /// The instance image.
    pub(crate) ids: &'a [u32],
    /// The depth image, if the camera has that output. Metres.
    pub(crate) depth: Option<&'a [f32]>,
}

impl CameraView<'_> {
    /// Adds the pixels that show an instance to its drawing.
    fn add_visible(&self, id: u32, edges_px: [u32; 4], raster: &mut Silhouette) {
        let [left, top, right, bottom] = edges_px.map(|edge| edge as usize);
        let width = self.camera.width as usize;
        for row in top..bottom {
            let line = &self.ids[row * width..][left..right];
            let mut from = left;
            for run in line.chunk_by(|a, b| (*a == id) == (*b == id)) {
                let to = from + run.len();
                if run[0] == id {
                    raster.add(row, from, to);
                }
                from = to;
            }
        }
    }

    /// Returns the keypoints of a walker in the image.
    fn keypoints(&self, keypoints: &Keypoints) -> ViewKeypoints {
        let found = keypoints.in_image(&KeypointView {
            projection: &self.camera.projection,
            world_from_sensor: self.world_from_sensor,
            size_px: [self.camera.width, self.camera.height],
            instances: self.ids,
            depth: self.depth,
        });
        let in_optical = |one: ImageKeypoint| {
            let [x, y, z] = one.in_sensor.to_array();
            [-y, -z, x]
        };
        ViewKeypoints {
            in_optical_m: found.map(in_optical),
            px: found.map(|one| one.px.to_array()),
            visibility: found.map(|one| one.visibility as u8),
        }
    }
}

/// The returns of one lidar, or the detections of one radar.
pub(crate) struct LidarView<'a> {
    pub(crate) name: &'a str,
    pub(crate) returns: Vec<u32>,
}

/// Returns the number of points on one box, by the name of the sensor that has any.
fn points(views: &[LidarView], index: usize) -> BTreeMap<String, u32> {
    let hit = views.iter().filter(|view| view.returns[index] > 0);
    hit.map(|view| (view.name.to_owned(), view.returns[index])).collect()
}

/// The sensors of a frame, and what they saw.
pub(crate) struct Views<'a> {
    pub(crate) cameras: Vec<CameraView<'a>>,
    pub(crate) lidars: Vec<LidarView<'a>>,
    pub(crate) radars: Vec<LidarView<'a>>,
    pub(crate) labels: LabelSettings,
}

/// What has a box: where it is in the lists of a frame, and what images show of it.
struct Labelled<'a> {
    index: usize,
    /// As in instance images.
    id: u32,
    size_m: [f32; 3],
    world_from_box: &'a Pose,
    keypoints: Option<&'a Keypoints>,
}

impl Views<'_> {
    fn is_seen(&self, index: usize) -> bool {
        self.cameras.iter().any(|c| c.seen[index].is_some())
            || self.lidars.iter().chain(&self.radars).any(|l| l.returns[index] > 0)
    }

    /// Returns one box in the image of each camera that saw it. `draw` draws its mesh, given
    /// `optical_from_world`.
    fn in_cameras(
        &self,
        one: &Labelled,
        raster: &mut Silhouette,
        mut draw: impl FnMut(&mut Silhouette, &Affine3A, &CameraModel),
    ) -> BTreeMap<String, View> {
        let half_extents = Vec3::from_array(one.size_m) * 0.5;
        let view = |view: &CameraView| {
            let (seen, camera) = (view.seen[one.index]?, &view.camera);
            let optical_from_world =
                (view.world_from_sensor.affine() * sensor_from_optical()).inverse();
            raster.begin(camera);
            draw(raster, &optical_from_world, camera);
            // A moving camera with a rolling shutter bends what it sees; edges are rounded.
            view.add_visible(one.id, seen.edges_px, raster);
            let unoccluded_px = raster.count();
            let amodal_mask = self
                .labels
                .amodal_masks
                .then(|| Rle::new([camera.width, camera.height], &raster.runs(camera)));
            let optical_from_box = optical_from_world * one.world_from_box.affine();
            // A foot or a mirror may leave its box and be all that the image shows.
            let outline = outline(half_extents, &optical_from_box, camera)
                .unwrap_or(Outline { edges_px: seen.edges_px.map(|e| e as f32), truncated: 1.0 });
            let (_, rotation, position) = optical_from_box.to_scale_rotation_translation();
            let labels = View {
                optical_from_box: (&Pose::new(position, rotation)).into(),
                visible_box_px: seen.edges_px,
                projected_box_px: outline.edges_px,
                visible_px: seen.pixels,
                unoccluded_px,
                occluded_fraction: 1.0 - seen.pixels as f32 / unoccluded_px as f32,
                truncated_fraction: outline.truncated,
                keypoints: one.keypoints.map(|keypoints| view.keypoints(keypoints)),
                amodal_mask,
            };
            Some((view.name.to_owned(), labels))
        };
        self.cameras.iter().filter_map(view).collect()
    }
}

/// Returns the boxes of all actors that a sensor saw, without `ego`.
pub(crate) fn actor_boxes(
    boxed: Boxed,
    ego: ActorId,
    blueprints: &[BlueprintInfo],
    views: &Views,
    raster: &mut Silhouette,
) -> Vec<ActorBox> {
    let mut all = Vec::new();
    for (index, actor) in boxed.actors.iter().enumerate() {
        let Some(blueprint) = blueprints.get(actor.blueprint as usize) else { continue };
        if actor.actor_id == ego || !views.is_seen(index) {
            continue;
        }
        let world_from_box =
            actor.pose.then(&Pose::new(Vec3::from_array(blueprint.center_m), glam::Quat::IDENTITY));
        let size_m = blueprint.half_extents_m.map(|half| half * 2.0);
        let made = town::catalogue().get(actor.blueprint as usize);
        let limbs = WalkerLimbs::find(boxed.limbs, actor.actor_id);
        let draw =
            |raster: &mut Silhouette, optical_from_world: &Affine3A, camera: &CameraModel| {
                let Some(made) = made else { return };
                let optical_from_actor = *optical_from_world * actor.pose.affine();
                draw_pieces(made, actor, limbs, &mut |part, actor_from_part| {
                    raster.draw(part, &(optical_from_actor * actor_from_part), camera);
                });
            };
        let keypoints = made
            .filter(|_| views.labels.keypoints)
            .and_then(|made| client_lib::keypoints(made, actor, limbs, None));
        let one = Labelled {
            index,
            id: actor.actor_id.0,
            size_m,
            world_from_box: &world_from_box,
            keypoints: keypoints.as_ref(),
        };
        all.push(ActorBox {
            actor_id: actor.actor_id.0,
            blueprint: blueprint.id.clone(),
            tag: blueprint.tag,
            tag_name: tag_name(blueprint.tag),
            size_m,
            world_from_box: (&world_from_box).into(),
            velocity_mps: actor.velocity_mps,
            traffic_light_state: traffic_light_state(actor).map(str::to_owned),
            lidar_points: points(&views.lidars, index),
            radar_points: points(&views.radars, index),
            keypoints_in_world_m: keypoints.map(|found| found.in_world.map(|at| at.to_array())),
            cameras: views.in_cameras(&one, raster, draw),
        });
    }
    all
}

/// Calls `draw` with each piece of an actor that shows, and `actor_from_piece`.
fn draw_pieces(
    made: &Blueprint,
    actor: &ActorState,
    limbs: Option<&WalkerLimbs>,
    draw: &mut dyn FnMut(Part, Affine3A),
) {
    let rig = made.rig();
    if rig.is_still() {
        return draw(Part::whole(made.mesh()), Affine3A::IDENTITY);
    }
    let geometry = made.geometry();
    rig.place(&posture_of(actor, limbs), |piece, actor_from_piece| {
        draw(Part::whole(&geometry.pieces[piece]), actor_from_piece);
        if rig.is_body(piece) {
            draw(Part::whole(&geometry.occupants), actor_from_piece);
        }
    });
}

/// Returns the boxes of all objects of the town that a sensor saw.
pub(crate) fn object_boxes(boxed: Boxed, views: &Views, raster: &mut Silhouette) -> Vec<ObjectBox> {
    let first = boxed.actors.len();
    let seen = (0..boxed.objects.len()).filter(|index| views.is_seen(first + index));
    let describe = |index: usize| {
        let object = boxed.objects.describe(index);
        let (part, world_from_mesh) = boxed.objects.mesh(index);
        let draw =
            |raster: &mut Silhouette, optical_from_world: &Affine3A, camera: &CameraModel| {
                raster.draw(part, &(*optical_from_world * world_from_mesh), camera);
            };
        let one = Labelled {
            index: first + index,
            id: ObjectId::from_index(index as u32).instance(),
            size_m: object.size_m,
            world_from_box: &object.world_from_box,
            keypoints: None,
        };
        ObjectBox {
            object_id: file_id(one.id),
            layer: object.layer.name().to_owned(),
            blueprint: object.blueprint.map(str::to_owned),
            tag: object.tag as u8,
            tag_name: tag_name(object.tag as u8),
            size_m: object.size_m,
            world_from_box: (&object.world_from_box).into(),
            lidar_points: points(&views.lidars, first + index),
            radar_points: points(&views.radars, first + index),
            cameras: views.in_cameras(&one, raster, draw),
        }
    };
    seen.map(describe).collect()
}

/// Returns what a traffic light shows; `None` for other actors.
fn traffic_light_state(actor: &ActorState) -> Option<&'static str> {
    let state = match actor.phase {
        light::RED => "red",
        light::YELLOW => "yellow",
        light::GREEN => "green",
        _ => "off",
    };
    (actor.kind == kind::TRAFFIC_LIGHT).then_some(state)
}

/// Returns the name of a semantic tag: `Car` for 14.
pub(crate) fn tag_name(code: u8) -> String {
    Tag::from_code(code).map_or_else(|| code.to_string(), |tag| format!("{tag:?}"))
}

#[cfg(test)]
mod rendered_tests;
#[cfg(test)]
mod tests;
