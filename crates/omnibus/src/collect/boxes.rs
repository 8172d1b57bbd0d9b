//! The actors in the measurements, counted in instance images and lidar labels.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3};
use mesh::Tag;
use protocol::{ActorId, ActorState, BlueprintInfo, Pose, kind, light};

use crate::collect::{
    format::{ActorBox, View},
    outline::outline,
    sensors::{Pinhole, sensor_from_optical},
    silhouette::Silhouette,
};

/// The pixels of one actor in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) pixels: u32,
    /// Left, top, right, bottom edge; right and bottom are exclusive.
    pub(crate) edges_px: [u32; 4],
}

/// Returns the pixels of each of `actors` (sorted by id) in an instance image.
pub(crate) fn seen(ids: &[u32], width: usize, actors: &[ActorState]) -> Vec<Option<Seen>> {
    let mut found: Vec<Option<Seen>> = vec![None; actors.len()];
    for (row, line) in (0..).zip(ids.chunks_exact(width)) {
        let mut from = 0;
        for run in line.chunk_by(|a, b| a == b) {
            let (left, right) = (from, from + run.len() as u32);
            from = right;
            let Some(index) = index_of(run[0], actors) else { continue };
            let seen =
                found[index].get_or_insert(Seen { pixels: 0, edges_px: [left, row, right, row] });
            let [l, t, r, _] = seen.edges_px;
            seen.edges_px = [l.min(left), t, r.max(right), row + 1];
            seen.pixels += right - left;
        }
    }
    found
}

/// Returns the number of lidar returns of each of `actors` (sorted by id).
pub(crate) fn returns(labels: &[[u32; 2]], actors: &[ActorState]) -> Vec<u32> {
    let mut counts = vec![0; actors.len()];
    for run in labels.chunk_by(|a, b| a[0] == b[0]) {
        if let Some(index) = index_of(run[0][0], actors) {
            counts[index] += run.len() as u32;
        }
    }
    counts
}

/// Returns the index of an actor in the list; static objects and the sky have none.
fn index_of(id: u32, actors: &[ActorState]) -> Option<usize> {
    if id == 0 || id >> 31 == 1 {
        return None;
    }
    actors.binary_search_by_key(&ActorId(id), |a| a.actor_id).ok()
}

/// The image of one camera.
pub(crate) struct CameraView<'a> {
    pub(crate) name: &'a str,
    pub(crate) camera: Pinhole,
    pub(crate) world_from_sensor: Pose,
    pub(crate) seen: Vec<Option<Seen>>,
}

/// The returns of one lidar.
pub(crate) struct LidarView<'a> {
    pub(crate) name: &'a str,
    pub(crate) returns: Vec<u32>,
}

/// Returns the boxes of all actors that a sensor saw, without `ego`.
pub(crate) fn boxes(
    actors: &[ActorState],
    ego: ActorId,
    blueprints: &[BlueprintInfo],
    cameras: &[CameraView],
    lidars: &[LidarView],
    raster: &mut Silhouette,
) -> Vec<ActorBox> {
    let mut all = Vec::new();
    for (index, actor) in actors.iter().enumerate() {
        let Some(blueprint) = blueprints.get(actor.blueprint as usize) else { continue };
        let points: BTreeMap<_, _> = lidars
            .iter()
            .filter(|l| l.returns[index] > 0)
            .map(|l| (l.name.to_owned(), l.returns[index]))
            .collect();
        let is_seen = !points.is_empty() || cameras.iter().any(|c| c.seen[index].is_some());
        if actor.actor_id == ego || !is_seen {
            continue;
        }
        let world_from_box =
            actor.pose.then(&Pose::new(Vec3::from_array(blueprint.center_m), glam::Quat::IDENTITY));
        let views = cameras.iter().filter_map(|camera| {
            let view = view(camera, camera.seen[index]?, actor, blueprint, &world_from_box, raster);
            Some((camera.name.to_owned(), view))
        });
        all.push(ActorBox {
            actor_id: actor.actor_id.0,
            blueprint: blueprint.id.clone(),
            tag: blueprint.tag,
            tag_name: tag_name(blueprint.tag),
            size_m: blueprint.half_extents_m.map(|half| half * 2.0),
            world_from_box: (&world_from_box).into(),
            velocity_mps: actor.velocity_mps,
            traffic_light_state: traffic_light_state(actor).map(str::to_owned),
            lidar_points: points,
            cameras: views.collect(),
        });
    }
    all
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

fn view(
    camera: &CameraView,
    seen: Seen,
    actor: &ActorState,
    blueprint: &BlueprintInfo,
    world_from_box: &Pose,
    raster: &mut Silhouette,
) -> View {
    let optical_from_world: Affine3A =
        (camera.world_from_sensor.affine() * sensor_from_optical()).inverse();
    let optical_from_box = optical_from_world * world_from_box.affine();
    let half_extents = Vec3::from_array(blueprint.half_extents_m);
    let outline = outline(half_extents, &optical_from_box, &camera.camera);
    let silhouette = match town::catalogue().get(actor.blueprint as usize) {
        Some(made) => {
            raster.pixels(made.mesh(), &(optical_from_world * actor.pose.affine()), &camera.camera)
        }
        None => 0,
    };
    // Steered wheels reach a pixel beyond the mesh that is drawn here.
    let silhouette = silhouette.max(seen.pixels);
    let (_, rotation, position) = optical_from_box.to_scale_rotation_translation();
    View {
        optical_from_box: (&Pose::new(position, rotation)).into(),
        visible_box_px: seen.edges_px,
        projected_box_px: outline.map_or(seen.edges_px.map(|e| e as f32), |o| o.edges_px),
        visible_px: seen.pixels,
        unoccluded_px: silhouette,
        occluded_fraction: 1.0 - seen.pixels as f32 / silhouette as f32,
        truncated_fraction: outline.map_or(0.0, |o| o.truncated),
    }
}

/// Returns the name of a semantic tag: `Car` for 14.
pub(crate) fn tag_name(code: u8) -> String {
    Tag::from_code(code).map_or_else(|| code.to_string(), |tag| format!("{tag:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let found = seen(&ids, 5, &[actor(7), actor(8), actor(9)]);
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
        assert_eq!(seen(&[0x8000_0007], 1, &[actor(7)]), [None]);
        assert_eq!(returns(&[[0x8000_0007, 3], [7, 14], [7, 14], [0, 0]], &[actor(7)]), [2]);
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
            let mut raster = Silhouette::default();
            let all = boxes(&[shown], ActorId(1), &blueprints, &[], &[lidar], &mut raster);
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
        let camera = Pinhole { width: 200, height: 100, focal_px: 100.0 };
        let seen_2 = Seen { pixels: 30, edges_px: [90, 50, 100, 60] };
        let front = CameraView {
            name: "front",
            camera,
            world_from_sensor: Pose::IDENTITY,
            seen: vec![Some(seen_2), Some(seen_2), None],
        };
        let lidar = LidarView { name: "roof", returns: vec![0, 0, 5] };
        let mut raster = Silhouette::default();
        let all = boxes(&actors, ActorId(1), &blueprints, &[front], &[lidar], &mut raster);

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
