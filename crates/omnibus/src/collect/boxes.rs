//! The actors and static objects in the measurements, counted in instance images and lidar labels.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3};
use mesh::{ObjectId, Tag};
use protocol::{ActorId, ActorState, BlueprintInfo, Pose, kind, light};
use town::Blueprint;

use crate::collect::{
    camera_model::CameraModel,
    encode::file_id,
    format::{ActorBox, ObjectBox, View},
    objects::StaticObjects,
    outline::outline,
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
}

impl Views<'_> {
    fn is_seen(&self, index: usize) -> bool {
        self.cameras.iter().any(|c| c.seen[index].is_some())
            || self.lidars.iter().chain(&self.radars).any(|l| l.returns[index] > 0)
    }

    /// Returns one box in the image of each camera that saw it. `draw` counts the pixels of its
    /// mesh, given `optical_from_world`.
    fn in_cameras(
        &self,
        index: usize,
        size_m: [f32; 3],
        world_from_box: &Pose,
        mut draw: impl FnMut(&Affine3A, &CameraModel) -> u32,
    ) -> BTreeMap<String, View> {
        let half_extents = Vec3::from_array(size_m) * 0.5;
        let view = |camera: &CameraView| {
            let seen = camera.seen[index]?;
            let optical_from_world =
                (camera.world_from_sensor.affine() * sensor_from_optical()).inverse();
            // Steered wheels reach a pixel beyond the mesh that is drawn here.
            let silhouette = draw(&optical_from_world, &camera.camera).max(seen.pixels);
            let optical_from_box = optical_from_world * world_from_box.affine();
            let outline = outline(half_extents, &optical_from_box, &camera.camera);
            let (_, rotation, position) = optical_from_box.to_scale_rotation_translation();
            let view = View {
                optical_from_box: (&Pose::new(position, rotation)).into(),
                visible_box_px: seen.edges_px,
                projected_box_px: outline.map_or(seen.edges_px.map(|e| e as f32), |o| o.edges_px),
                visible_px: seen.pixels,
                unoccluded_px: silhouette,
                occluded_fraction: 1.0 - seen.pixels as f32 / silhouette as f32,
                truncated_fraction: outline.map_or(0.0, |o| o.truncated),
            };
            Some((camera.name.to_owned(), view))
        };
        self.cameras.iter().filter_map(view).collect()
    }
}

/// Returns the boxes of all actors that a sensor saw, without `ego`.
pub(crate) fn actor_boxes(
    actors: &[ActorState],
    ego: ActorId,
    blueprints: &[BlueprintInfo],
    views: &Views,
    raster: &mut Silhouette,
) -> Vec<ActorBox> {
    let mut all = Vec::new();
    for (index, actor) in actors.iter().enumerate() {
        let Some(blueprint) = blueprints.get(actor.blueprint as usize) else { continue };
        if actor.actor_id == ego || !views.is_seen(index) {
            continue;
        }
        let world_from_box =
            actor.pose.then(&Pose::new(Vec3::from_array(blueprint.center_m), glam::Quat::IDENTITY));
        let size_m = blueprint.half_extents_m.map(|half| half * 2.0);
        let made = town::catalogue().get(actor.blueprint as usize);
        let draw = |optical_from_world: &Affine3A, camera: &CameraModel| {
            let optical_from_actor = *optical_from_world * actor.pose.affine();
            let drawn = |made: &Blueprint| {
                raster.pixels(Part::whole(made.mesh()), &optical_from_actor, camera)
            };
            made.map_or(0, drawn)
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
            cameras: views.in_cameras(index, size_m, &world_from_box, draw),
        });
    }
    all
}

/// Returns the boxes of all objects of the town that a sensor saw.
pub(crate) fn object_boxes(boxed: Boxed, views: &Views, raster: &mut Silhouette) -> Vec<ObjectBox> {
    let first = boxed.actors.len();
    let seen = (0..boxed.objects.len()).filter(|index| views.is_seen(first + index));
    let describe = |index: usize| {
        let object = boxed.objects.describe(index);
        let (part, world_from_mesh) = boxed.objects.mesh(index);
        let draw = |optical_from_world: &Affine3A, camera: &CameraModel| {
            raster.pixels(part, &(*optical_from_world * world_from_mesh), camera)
        };
        ObjectBox {
            object_id: file_id(ObjectId::from_index(index as u32).instance()),
            layer: object.layer.name().to_owned(),
            blueprint: object.blueprint.map(str::to_owned),
            tag: object.tag as u8,
            tag_name: tag_name(object.tag as u8),
            size_m: object.size_m,
            world_from_box: (&object.world_from_box).into(),
            lidar_points: points(&views.lidars, first + index),
            radar_points: points(&views.radars, first + index),
            cameras: views.in_cameras(first + index, object.size_m, &object.world_from_box, draw),
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
mod tests {
    use super::*;
    use crate::collect::camera_model::tests::pinhole;
    use town::Town;

    /// The boxes of actors in a town without objects.
    fn boxes(actors: &[ActorState], blueprints: &[BlueprintInfo], views: &Views) -> Vec<ActorBox> {
        actor_boxes(actors, ActorId(1), blueprints, views, &mut Silhouette::default())
    }

    fn actor(id: u32) -> ActorState {
        ActorState { actor_id: ActorId(id), ..ActorState::default() }
    }

    #[test]
    fn pixels_are_counted_and_bounded_for_each_actor() {
        let s = mesh::ObjectId::new(7).instance();
        #[rustfmt::skip]
        let ids = [
            0, s, 0, 0, 9,
            s, 7, 7, s, 9,
            0, 7, s, 7, 9,
        ];
        let actors = [actor(7), actor(8), actor(9)];
        let boxed = Boxed { actors: &actors, objects: &StaticObjects::new(Town::default()) };
        let found = seen(&ids, 5, boxed);
        assert_eq!(
            found,
            [
                Some(Seen { pixels: 4, edges_px: [1, 1, 4, 3] }),
                None,
                Some(Seen { pixels: 3, edges_px: [4, 0, 5, 3] }),
            ]
        );
    }

    #[test]
    fn a_static_object_is_not_the_actor_with_the_same_low_bits() {
        let object = |tag| town::Object {
            tag,
            layer: town::Layer::Props,
            center: Vec3::ZERO,
            half_extents_m: Vec3::ONE,
            yaw_rad: 0.0,
            color: [0; 3],
        };
        let objects = [Tag::Static, Tag::Building, Tag::Pole].map(object).to_vec();
        let objects = StaticObjects::new(Town { objects, ..Town::default() });
        let boxed = Boxed { actors: &[actor(3)], objects: &objects };
        // The ground, and objects 1 to 3; 4 is unknown.
        let ids = [0x8000_0000, 0x8000_0001, 0x8000_0002, 0x8000_0003, 0x8000_0003, 0x8000_0004];
        let one = |left, pixels| Some(Seen { pixels, edges_px: [left, 0, left + pixels, 1] });
        assert_eq!(seen(&ids, 6, boxed), [None, one(1, 1), None, one(3, 2)], "no building");
        let labels = [[0x8000_0003, 6], [3, 14], [3, 14], [0, 0], [0x8000_0002, 3]];
        assert_eq!(returns(&labels, boxed), [2, 0, 0, 1]);
    }

    #[test]
    fn the_box_of_a_traffic_light_has_its_state() {
        let blueprints = [BlueprintInfo {
            id: "traffic.traffic_light".to_owned(),
            tag: Tag::TrafficLight as u8,
            half_extents_m: [0.2, 0.3, 0.6],
            center_m: [0.2, 0.0, 0.5],
        }];
        let states = [light::RED, light::YELLOW, light::GREEN, light::OFF].map(|phase| {
            let shown = ActorState { kind: kind::TRAFFIC_LIGHT, phase, ..actor(2) };
            let lidar = LidarView { name: "roof", returns: vec![1] };
            let views = Views { cameras: Vec::new(), lidars: vec![lidar], radars: Vec::new() };
            let all = boxes(&[shown], &blueprints, &views);
            serde_json::to_value(&all[0]).unwrap()["traffic_light_state"].clone()
        });
        assert_eq!(states, ["red", "yellow", "green", "off"]);
    }

    /// A camera at the origin that looks along x at a car 10 m ahead, and one beside the image.
    #[test]
    fn the_box_of_a_car_ahead_encloses_its_pixels() {
        let (index, made) = town::blueprint("vehicle.tesla.model3").unwrap();
        let blueprints: Vec<_> = town::catalogue()
            .iter()
            .map(|b| BlueprintInfo {
                id: b.id.to_owned(),
                tag: b.tag as u8,
                half_extents_m: b.half_extents_m.to_array(),
                center_m: b.center_m.to_array(),
            })
            .collect();
        let place = |id, x, y| ActorState {
            blueprint: index,
            pose: Pose::level(Vec3::new(x, y, -1.0), 0.0),
            ..actor(id)
        };
        let actors = [place(1, 0.0, 0.0), place(2, 10.0, 0.0), place(3, -10.0, 0.0)];
        let camera = pinhole();
        let seen_2 = Seen { pixels: 30, edges_px: [90, 50, 100, 60] };
        let front = CameraView {
            name: "front",
            camera,
            world_from_sensor: Pose::IDENTITY,
            seen: vec![Some(seen_2), Some(seen_2), None],
        };
        let lidar = LidarView { name: "roof", returns: vec![0, 0, 5] };
        let all = boxes(
            &actors,
            &blueprints,
            &Views { cameras: vec![front], lidars: vec![lidar], radars: Vec::new() },
        );

        let ids: Vec<_> = all.iter().map(|b| b.actor_id).collect();
        assert_eq!(ids, [2, 3], "the ego is left out");
        assert_eq!(all[0].size_m, (made.half_extents_m * 2.0).to_array());
        assert_eq!(all[0].tag_name, "Car");
        let view = &all[0].cameras["front"];
        let [x, y, z] = view.optical_from_box.position_m;
        let middle = made.center_m;
        assert!((x + middle.y).abs() < 1e-4, "right is minus left");
        assert!((y - (1.0 - middle.z)).abs() < 1e-4, "down is minus up");
        assert!((z - (10.0 + middle.x)).abs() < 1e-4, "ahead");
        let [left, top, right, bottom] = view.projected_box_px;
        assert!(left < 100.0 && 100.0 < right && 50.0 < bottom && top < bottom);
        let drawn = view.unoccluded_px as f32;
        let boxed = (right - left) * (bottom - top);
        assert!((0.5..1.0).contains(&(drawn / boxed)), "a car fills most of its box: {view:?}");
        assert_eq!(view.occluded_fraction, 1.0 - 30.0 / drawn);
        assert_eq!(view.truncated_fraction, 0.0);
        assert!(all[1].cameras.is_empty());
        assert!(all.iter().all(|b| b.traffic_light_state.is_none()), "vehicles show no phase");
        assert_eq!(all[1].lidar_points["roof"], 5, "behind the camera, but the lidar met it");
    }
}
