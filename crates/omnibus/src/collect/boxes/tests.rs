use super::*;
use crate::collect::camera_model::tests::pinhole;
use town::Town;

/// The boxes of actors in a town without objects.
fn boxes(actors: &[ActorState], blueprints: &[BlueprintInfo], views: &Views) -> Vec<ActorBox> {
    let objects = StaticObjects::new(Town::default());
    let boxed = Boxed { actors, limbs: &[], objects: &objects };
    actor_boxes(boxed, ActorId(1), blueprints, views, &mut Silhouette::default())
}

fn no_views() -> Views<'static> {
    let labels = LabelSettings::default();
    Views { cameras: Vec::new(), lidars: Vec::new(), radars: Vec::new(), labels }
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
    let boxed =
        Boxed { actors: &actors, limbs: &[], objects: &StaticObjects::new(Town::default()) };
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
    let boxed = Boxed { actors: &[actor(3)], limbs: &[], objects: &objects };
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
        let views = Views { lidars: vec![lidar], ..no_views() };
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
    let actors =
        [place(1, 0.0, 0.0), place(2, 10.0, 0.0), place(3, -10.0, 0.0), place(4, 10.0, 30.0)];
    let camera = pinhole();
    let seen_2 = Seen { pixels: 30, edges_px: [90, 50, 100, 60] };
    let front = CameraView {
        name: "front",
        camera,
        world_from_sensor: Pose::IDENTITY,
        seen: vec![
            Some(seen_2),
            Some(seen_2),
            None,
            Some(Seen { pixels: 3, edges_px: [0, 50, 1, 53] }),
        ],
        // Thirty pixels show the car ahead, and three a mirror of the car beside the image.
        ids: &std::array::from_fn::<u32, 20_000, _>(|at| match (at / 200, at % 200) {
            (50..53, 90..100) => 2,
            (50..53, 0) => 4,
            _ => 0,
        }),
        depth: None,
    };
    let lidar = LidarView { name: "roof", returns: vec![0, 0, 5, 0] };
    let all = boxes(
        &actors,
        &blueprints,
        &Views { cameras: vec![front], lidars: vec![lidar], ..no_views() },
    );

    let ids: Vec<_> = all.iter().map(|b| b.actor_id).collect();
    assert_eq!(ids, [2, 3, 4], "the ego is left out");
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
    let beside = &all[2].cameras["front"];
    assert_eq!(beside.truncated_fraction, 1.0, "all of the box is outside");
    assert_eq!(beside.projected_box_px, [0.0, 50.0, 1.0, 53.0], "what shows");
}
