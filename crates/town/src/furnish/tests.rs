use std::path::PathBuf;

use glam::{DVec3, Quat, Vec2, Vec3, Vec3Swizzles, vec2};
use mesh::{Material, Mesh, RandomStream, Tag};
use road::{LanePoint, LaneTypes, Network};

use crate::{
    Kind, catalogue,
    furnish::{
        facade::{Look, Suits},
        furnish, furnish_with,
        index::TriangleIndex,
        roof,
    },
    mesh_builder::MeshBuilder,
    static_world::{Collider, Detail, Layer, Object, Town},
};
use mapgen::{default_map, named};

fn default_town() -> (Network, Town) {
    let network = Network::parse(&default_map().1).expect("a valid map");
    let town = furnish(&network, 1);
    (network, town)
}

/// Name and text of every map in the folder that `OMNIBUS_MAPS` names, sorted by name; empty
/// without it.
fn shared_maps() -> Vec<(String, String)> {
    let Some(folder) = std::env::var_os("OMNIBUS_MAPS").map(PathBuf::from) else {
        note_skipped("OMNIBUS_MAPS names no folder");
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).expect("OMNIBUS_MAPS names a folder");
    let paths = entries.map(|entry| entry.expect("a readable folder").path());
    let mut maps: Vec<(String, String)> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "xodr"))
        .map(|path| {
            let name = path.file_stem().expect("a name").to_string_lossy().to_string();
            (name, std::fs::read_to_string(&path).expect("a readable map"))
        })
        .collect();
    maps.sort();
    maps
}

/// Notes that the running test skips a part; `./run test` counts and lists these notes.
fn note_skipped(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or_default().rsplit("::").next().unwrap_or_default().to_owned();
    eprintln!("skipped {test}: {why}");
    if let Some(path) = std::env::var_os("OMNIBUS_TEST_NOTES") {
        use std::io::Write as _;
        let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
        let line = format!("skipped {test}: {why}\n");
        file.and_then(|mut file| file.write_all(line.as_bytes())).expect("the notes are writable");
    }
}

#[test]
fn the_default_town_is_as_large_as_promised() {
    let (_, town) = default_town();
    let houses = town.objects.iter().filter(|object| object.tag == Tag::Building).count();
    assert!(town.mesh.triangles.len() >= 200_000, "{} triangles", town.mesh.triangles.len());
    assert!(houses >= 100, "{houses} houses");
    assert_eq!(town.mesh.triangles.len(), town.mesh.faces.len());
}

#[test]
fn detail_changes_meshes_but_not_the_positions_of_buildings() {
    let network = Network::parse(&named("Flatford").expect("a named town")).expect("a valid map");
    let (plain, fine) = (furnish(&network, 1), furnish_with(&network, 1, Detail::High));
    let coarse = furnish_with(&network, 1, Detail::Low);
    let walls = |town: &Town| -> Vec<Collider> { walls(town).copied().collect() };
    let flat = |walls: Vec<Collider>| -> Vec<(Vec2, Vec2, f32)> {
        walls.iter().map(|w| (w.center.xy(), w.half_extents_m.xy(), w.yaw_rad)).collect()
    };
    assert_eq!(flat(walls(&plain)), flat(walls(&fine)));
    assert_eq!(flat(walls(&plain)), flat(walls(&coarse)));
    let [plain, fine, coarse] =
        [plain, fine, coarse].map(|town| town.assembled_mesh().triangles.len());
    assert!(plain > 2 * coarse && 2 * fine > 3 * plain, "{coarse}, {plain}, {fine} triangles");
}

/// The colliders of buildings.
fn walls(town: &Town) -> impl Iterator<Item = &Collider> {
    town.colliders.iter().filter(|one| one.half_extents_m.xy().min_element() > 2.5)
}

#[test]
fn every_house_is_solid_and_within_its_box() {
    let (_, town) = default_town();
    let houses: Vec<&Object> =
        town.objects.iter().filter(|object| object.tag == Tag::Building).collect();
    let walls: Vec<&Collider> = walls(&town).collect();
    assert_eq!(houses.len(), walls.len());
    for (house, wall) in houses.iter().zip(&walls) {
        let turned = Vec2::from_angle(-house.yaw_rad)
            .rotate((wall.center - house.center).truncate())
            .extend(wall.center.z - house.center.z);
        let room = house.half_extents_m - wall.half_extents_m - turned.abs();
        assert!(room.min_element() > -0.01, "{house:?} {wall:?}");
        assert!(wall.half_extents_m.z > 0.25 * house.half_extents_m.z, "{house:?} {wall:?}");
    }
}

/// The corners of a box on the plan.
fn corners(one: &Collider) -> [Vec2; 4] {
    super::raster::rectangle(one.center.truncate(), one.half_extents_m.truncate(), one.yaw_rad)
}

/// Whether one side of the first outline separates it from the other.
fn apart(one: &[Vec2; 4], other: &[Vec2; 4]) -> bool {
    (0..4).any(|side| {
        let out = -(one[(side + 1) % 4] - one[side]).perp();
        other.iter().all(|corner| out.dot(*corner - one[side]) > 0.0)
    })
}

#[test]
fn no_two_buildings_overlap() {
    let (_, town) = default_town();
    let outlines: Vec<[Vec2; 4]> = walls(&town).map(corners).collect();
    for (number, one) in outlines.iter().enumerate() {
        for other in &outlines[..number] {
            assert!(apart(one, other) || apart(other, one), "{one:?} {other:?}");
        }
    }
}

#[test]
fn no_house_stands_on_a_road_or_a_sidewalk() {
    let (_, town) = default_town();
    let paved = [Tag::Roads, Tag::RoadLine, Tag::SideWalks].map(|tag| tag as u8);
    let ground = TriangleIndex::new(&town.mesh, |number| {
        let face = town.mesh.faces[number];
        face.object == 0 && paved.contains(&face.tag)
    });
    for wall in walls(&town) {
        let [a, b, _, d] = corners(wall);
        for i in 0..=20 {
            for j in 0..=20 {
                let at = a + (b - a) * (i as f32 / 20.0) + (d - a) * (j as f32 / 20.0);
                assert!(!ground.covers(at), "a house at {at} stands on the road");
            }
        }
    }
}

/// The clearance above a lane below which an object is in the way. Metres.
const CLEARANCE_M: f32 = 3.4;

/// Points on driving lanes at which an object stands, hangs too low, or the road is missing.
fn obstacles(network: &Network, town: &Town) -> Vec<String> {
    let things = TriangleIndex::new(&town.mesh, |number| town.mesh.faces[number].object != 0);
    let ground = TriangleIndex::new(&town.mesh, |number| town.mesh.faces[number].object == 0);
    let mut found = Vec::new();
    for lane in network.lanes() {
        if !LaneTypes::DRIVABLE.contains(lane.kind) {
            continue;
        }
        let steps = (lane.length_m / 1.5).ceil() as usize;
        for step in 0..steps {
            let along_m = lane.length_m * (step as f64 + 0.5) / steps as f64;
            let width = network.width(LanePoint { lane: lane.index, along_m });
            for fraction in [-0.4, 0.0, 0.4] {
                let point =
                    network.place_at(lane.index, along_m, fraction * width).position.as_vec3();
                let at = point.truncate();
                things.heights(at, |z| {
                    if (0.2..CLEARANCE_M).contains(&(z - point.z)) {
                        let near = town.objects.iter().min_by(|a, b| {
                            let far = |one: &Object| (one.center.truncate() - at).length();
                            far(a).total_cmp(&far(b))
                        });
                        found.push(format!("{near:?} {:.2} m above {point}", z - point.z));
                    }
                });
                let surface = ground.topmost(at, point.z + 1.0);
                if width > 0.5 && surface.is_none_or(|z| z < point.z - 0.6) {
                    found.push(format!("a hole at {point}: {surface:?}"));
                }
            }
        }
    }
    for collider in &town.colliders {
        let lowest = collider.center.z - collider.half_extents_m.z;
        let [a, b, c, d] = corners(collider);
        for at in [a, b, c, d, (a + c) * 0.5] {
            let probe = at.extend(lowest + 0.5).as_dvec3();
            let Some(near) = network.nearest(probe, LaneTypes::DRIVABLE) else { continue };
            let lane = network.place(near);
            // In the plane: beside a steeply banked lane the ground may be level.
            let left = lane.rotation() * DVec3::Y;
            let (across, half) = (left.truncate().normalize(), left.truncate().length() * 0.5);
            let offset = probe - lane.position;
            let side_m = offset.truncate().dot(across).abs();
            let inside = side_m < half * network.width(near) - 0.3
                && offset.truncate().perp_dot(across).abs() < 0.3;
            if inside && offset.z.abs() < 2.0 {
                found.push(format!(
                    "a collider on a lane at {probe}, {side_m:.2} m beside its middle"
                ));
            }
        }
    }
    found
}

#[test]
fn no_object_stands_on_a_driving_lane() {
    let (network, town) = default_town();
    let found = obstacles(&network, &town);
    assert!(found.is_empty(), "{} places: {:?}", found.len(), &found[..found.len().min(5)]);
}

/// Solid objects in the way of a bus that turns, but those that the map places.
fn in_the_way_of_buses(network: &Network, town: &Town) -> Vec<String> {
    let mut outlines = super::swept_path::outlines(network);
    outlines.sort_by(|one, other| one[0].x.total_cmp(&other[0].x));
    let mut found = Vec::new();
    for collider in &town.colliders {
        let object = &town.objects[collider.object as usize];
        let is_near = |outline: &[Vec2; 4]| {
            let reach = collider.half_extents_m.truncate().length() + 11.5;
            (outline[0].x - collider.center.x).abs() < reach
        };
        let own = corners(collider);
        if outlines.iter().any(|one| is_near(one) && !apart(one, &own) && !apart(&own, one)) {
            found.push(format!("{:?} {:?} at {}", object.layer, object.tag, object.center));
        }
    }
    found
}

#[test]
fn no_object_stands_where_a_bus_turns() {
    let mut found = Vec::new();
    for name in ["Greatmoor", "Longreach", "Millbrook", "Swanringway"] {
        let network = Network::parse(&named(name).expect("a named town")).expect("a map");
        let places = in_the_way_of_buses(&network, &furnish(&network, 1));
        found.extend(places.into_iter().map(|place| format!("{name}: {place}")));
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn parked_cars_stand_on_the_ground_and_not_in_each_other() {
    let (_, town) = default_town();
    assert!(town.parked.len() >= 30, "{} parked cars", town.parked.len());
    let models: std::collections::BTreeSet<u32> =
        town.parked.iter().map(|one| one.blueprint).collect();
    assert!((6..=14).contains(&models.len()), "{models:?}");
    let ground = TriangleIndex::new(&town.mesh, |number| town.mesh.faces[number].object == 0);
    let mut outlines = Vec::new();
    for parked in &town.parked {
        let (car, object) =
            (&catalogue()[parked.blueprint as usize], &town.objects[parked.object as usize]);
        assert_eq!(
            (object.layer, object.half_extents_m),
            (Layer::ParkedVehicles, car.half_extents_m)
        );
        let rotation = Quat::from_array(parked.rotation);
        for wheel in &car.wheels {
            let hub = parked.position + rotation * wheel.position_m;
            let below = ground.topmost(hub.truncate(), hub.z + 1.0).expect("ground under a wheel");
            let gap = hub.z - wheel.radius_m - below;
            assert!(gap.abs() < 0.2, "a wheel of {} hangs {gap} m over {hub}", car.id);
        }
        outlines.push(super::raster::rectangle(
            object.center.truncate(),
            object.half_extents_m.truncate(),
            object.yaw_rad,
        ));
    }
    let houses: Vec<[Vec2; 4]> = walls(&town).map(corners).collect();
    for (number, one) in outlines.iter().enumerate() {
        for other in outlines[..number].iter().chain(&houses) {
            assert!(apart(one, other) || apart(other, one), "{one:?} {other:?}");
        }
    }
}

/// A prop that is missing in the catalogue would be left out silently.
#[test]
fn every_prop_that_furnishing_uses_is_in_the_catalogue() {
    let sources = [include_str!("leisure.rs"), include_str!("street.rs"), include_str!("works.rs")];
    let mut asked = 0;
    for quoted in sources.iter().flat_map(|source| source.split('"').skip(1).step_by(2)) {
        if quoted.starts_with("static.prop.") {
            assert!(crate::blueprint(quoted).is_some(), "{quoted}");
            asked += 1;
        }
    }
    assert!(asked > 30, "{asked}");
}

#[test]
fn a_town_has_objects_of_every_common_kind() {
    let (_, town) = default_town();
    for layer in Layer::ALL {
        let count = town.objects.iter().filter(|object| object.layer == layer).count();
        assert!(count >= 20, "{count} objects of {layer:?}");
    }
    for tag in [Tag::Building, Tag::Fence, Tag::Wall, Tag::Pole, Tag::TrafficSign, Tag::Vegetation]
    {
        assert!(town.objects.iter().any(|object| object.tag == tag), "no {tag:?}");
    }
}

#[test]
fn residential_streets_are_dark_between_their_lights() {
    let (_, town) = default_town();
    let at: Vec<Vec2> = town.lamps.iter().map(|lamp| lamp.position.truncate()).collect();
    let mut gaps: Vec<f32> = at
        .iter()
        .map(|own| {
            let others = at.iter().filter(|other| *other != own);
            others.map(|other| own.distance(*other)).fold(f32::INFINITY, f32::min)
        })
        .collect();
    gaps.sort_by(f32::total_cmp);
    let middle = gaps[gaps.len() / 2];
    assert!(at.len() > 20 && (22.0..36.0).contains(&middle), "{} lights, {middle} m", at.len());
}

#[test]
fn plants_fill_their_boxes_and_are_hidden_with_their_layer() {
    let (_, town) = default_town();
    assert!(town.plants.len() > 200, "{} plants", town.plants.len());
    for plant in &town.plants {
        let object = &town.objects[plant.object as usize];
        assert_eq!((object.tag, object.layer), (Tag::Vegetation, Layer::Foliage));
        let mesh = crate::plant_mesh(plant.model).expect("a model");
        let box_from_world = Quat::from_rotation_z(-object.yaw_rad);
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for corner in &mesh.positions {
            let at = plant.world_from_model().transform_point3(Vec3::from_array(*corner));
            let at = box_from_world * (at - object.center);
            (low, high) = (low.min(at), high.max(at));
        }
        let off = (low + object.half_extents_m).abs().max((high - object.half_extents_m).abs());
        assert!(off.max_element() < 0.01, "{plant:?} lies {off} off its box");
    }
    let bare = town.visible(|_, layer| layer == Layer::Foliage);
    assert!(bare.plants.is_empty() && bare.objects == town.objects);
}

#[test]
fn every_signal_of_the_map_has_one_head() {
    let (network, town) = default_town();
    assert!(!town.heads.is_empty());
    check_heads(&network, &town);
}

fn check_heads(network: &Network, town: &Town) {
    let lights: Vec<u32> = network
        .signals()
        .iter()
        .zip(0..)
        .filter(|(signal, _)| signal.dynamic)
        .map(|(_, number)| number)
        .collect();
    let heads: Vec<u32> = town.heads.iter().map(|head| head.signal).collect();
    assert_eq!(heads, lights);
    for head in &town.heads {
        let signal = &network.signals()[head.signal as usize];
        let away = head.position.truncate().distance(signal.pose.position.truncate().as_vec2());
        assert!(away < 0.5, "the head of signal {} hangs {away} m off", signal.id);
    }
}

/// The ground is closed: every vertical ray within the town hits it.
#[test]
fn the_ground_has_no_gaps() {
    let (_, town) = default_town();
    let ground = TriangleIndex::new(&town.mesh, |number| town.mesh.faces[number].object == 0);
    let (low, high) = road_bounds(&town.mesh);
    let (mut missed, mut rays) = (Vec::new(), 0);
    let step = 1.37;
    for row in 0..((high.y - low.y) / step) as u32 {
        for column in 0..((high.x - low.x) / step) as u32 {
            let at = low + vec2(column as f32, row as f32) * step;
            rays += 1;
            if !ground.covers(at) {
                missed.push(at);
            }
        }
    }
    assert!(missed.is_empty(), "{} of {rays}: {:?}", missed.len(), missed.first());
}

fn road_bounds(mesh: &Mesh) -> (Vec2, Vec2) {
    let roads = mesh.triangles.iter().zip(&mesh.faces).filter(|(_, f)| f.tag == Tag::Roads as u8);
    let points = roads.flat_map(|(t, _)| t.map(|i| Vec3::from_array(mesh.positions[i as usize])));
    points
        .map(|point| point.truncate())
        .fold((Vec2::MAX, Vec2::MIN), |(low, high), point| (low.min(point), high.max(point)))
}

#[test]
fn every_shared_map_becomes_a_town() {
    let mut failed = Vec::new();
    for (name, text) in shared_maps() {
        let network = Network::parse(&text).expect("a map that loads");
        let town = furnish(&network, 1);
        let found = obstacles(&network, &town);
        let houses = town.objects.iter().filter(|object| object.tag == Tag::Building).count();
        println!(
            "{name:<55} {:>8} triangles {houses:>5} houses {:>5} objects {:>4} parked {:>4} heads, {} obstacles {:?}",
            town.mesh.triangles.len(),
            town.objects.len(),
            town.parked.len(),
            town.heads.len(),
            found.len(),
            found.first(),
        );
        check_heads(&network, &town);
        let ways = in_the_way_of_buses(&network, &town);
        println!("{ways:#?}");
        if !found.is_empty() || !ways.is_empty() {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn town10hd_in_high_detail_is_large_enough_for_benchmarks() {
    let maps = shared_maps();
    let Some((_, text)) = maps.iter().find(|(name, _)| name.ends_with("Town10HD")) else { return };
    let network = Network::parse(text).expect("a map that loads");
    let town = furnish_with(&network, 1, Detail::High);
    let cars: Vec<usize> = catalogue()
        .iter()
        .filter(|one| one.kind == Kind::Vehicle)
        .map(|one| one.mesh().triangles.len())
        .collect();
    let hundred: usize = cars.iter().cycle().take(100).sum();
    // Plants share meshes; each counts where it stands.
    let plants = town.plants.iter().filter_map(|plant| crate::plant_mesh(plant.model));
    let plants: usize = plants.map(|mesh| mesh.triangles.len()).sum();
    let (fixed, all) = (town.mesh.triangles.len(), town.mesh.triangles.len() + plants + hundred);
    println!("Town10HD: {fixed} triangles, with 100 cars {all}");
    assert!(all >= 1_200_000, "{fixed} triangles, with 100 cars {all}");
}

#[test]
fn a_tunnel_of_the_map_is_an_object_of_the_town() {
    let text = default_map().1;
    let tunnel = r#"<objects><tunnel id="t" s="1" length="9" type="standard"/></objects></road>"#;
    // Structures of the map are the first objects.
    let town = furnish(&Network::parse(&text.replacen("</road>", tunnel, 1)).expect("a map"), 1);
    assert!((town.objects[0].tag, town.objects[0].layer) == (Tag::Wall, crate::Layer::Walls));
    let is_wall = |face: &&mesh::Face| face.tag == Tag::Wall as u8 && face.object == 1;
    assert!(town.mesh.faces.iter().filter(is_wall).count() > 50);
    assert!(town.colliders.iter().filter(|solid| solid.object == 0).count() >= 2);
    let bare = furnish(&Network::parse(&text).expect("a map"), 1);
    assert!(bare.objects[0].tag != Tag::Wall);
}

#[test]
fn crosswalks_are_painted_on_the_ground_itself() {
    let (_, text) = default_map();
    let network = Network::parse(&text).expect("a map");
    let town = furnish(&network, 1);
    let stripes = road::object_paint(&network);
    assert!(!stripes.triangles.is_empty());
    let index = TriangleIndex::new(&town.mesh, |number| {
        let tag = town.mesh.faces[number].tag;
        tag == Tag::Roads as u8 || tag == Tag::RoadLine as u8 || tag == Tag::SideWalks as u8
    });
    for [a, b, c] in &stripes.triangles {
        let corner = |at: &u32| Vec3::from_array(stripes.positions[*at as usize]);
        let middle = (corner(a) + corner(b) + corner(c)) / 3.0;
        let (mut top, mut next) = (f32::MIN, f32::MIN);
        index.heights(middle.truncate(), |z| {
            if z > top {
                (top, next) = (z, top);
            } else {
                next = next.max(z);
            }
        });
        // The paint is the visible surface, and hardly above the ground.
        assert!(
            (0.0005..0.012).contains(&(top - next)),
            "{} over the road at {middle}",
            top - next
        );
    }
}

#[test]
fn an_old_town_consists_of_rows_under_steep_roofs() {
    use mapgen::{Character, Plan, generate};
    let built = |character: Character, seed: u64| {
        let (size_m, relief_m) = character.default_size_and_relief_m();
        let plan = Plan { name: "built".to_string(), seed, size_m, character, relief_m };
        let town = furnish(&Network::parse(&generate(&plan)).expect("a generated town"), 1);
        let houses = || town.objects.iter().filter(|one| one.tag == Tag::Building);
        let tallest = houses().map(|one| one.half_extents_m.z * 2.0).fold(0.0, f32::max);
        let glass = |face: &&mesh::Face| face.material == mesh::Material::FacadeGlass as u8;
        let tiled: std::collections::BTreeSet<u32> = town
            .mesh
            .faces
            .iter()
            .filter(|face| face.material == mesh::Material::RoofTiles as u8)
            .map(|face| face.object)
            .collect();
        let fraction = tiled.len() as f32 / houses().count() as f32;
        (tallest, town.mesh.faces.iter().filter(glass).count(), fraction)
    };
    for seed in [1, 2, 3] {
        let (tallest, glass, tiled) = built(Character::OldTown, seed);
        assert!(tallest < 35.0 && glass == 0 && tiled > 0.85, "{tallest} m, {glass}, {tiled}");
    }
    // A modern city differs.
    let (tallest, glass, _) = built(Character::Grid, 1);
    assert!(tallest > 35.0 && glass > 0, "{tallest} m, {glass}");
}

/// The gardens of houses of a map, in the order in which they were built.
fn gardens(name: &str) -> Vec<super::lots::Garden> {
    let network = Network::parse(&named(name).expect("a named town")).expect("a map");
    let mut plan = super::plan::Plan::new(&network, 1, Detail::Standard);
    let mut scene = super::scene::Scene::new(plan.take_ground());
    let outlines = std::mem::take(&mut plan.outlines);
    let density = std::mem::take(&mut plan.density);
    super::lots::build(&mut plan, &mut scene, &outlines, &density)
}

#[test]
fn no_house_resembles_the_house_beside_it() {
    for name in ["Altmarkt", "Flatford"] {
        let gardens = gardens(name);
        let (mut pairs, mut alike) = (0, Vec::new());
        for (number, one) in gardens.iter().enumerate() {
            for other in &gardens[..number] {
                let (Some(own), Some(others)) = (&one.look, &other.look) else { continue };
                // Next to each other, without a plot between them.
                if one.gate.distance(other.gate) < (one.width_m + other.width_m) * 0.5 + 4.0 {
                    pairs += 1;
                    if own.resembles(others) {
                        alike.push((one.gate, other.gate));
                    }
                }
            }
        }
        assert!(pairs > 60 && alike.is_empty(), "{name}: {pairs} pairs, {alike:?}");
    }
}

/// Façades in detail make the largest of these maps at most 1.75 times as large as plain ones did.
#[test]
fn facades_keep_to_their_budget() {
    for (name, most) in [("Fernhill", 3_740_000), ("Greatmoor", 5_200_000)] {
        let network = Network::parse(&named(name).expect("a named town")).expect("a map");
        let town = furnish(&network, 1);
        let is_house = |face: &&mesh::Face| face.tag == Tag::Building as u8;
        let walls = town.mesh.faces.iter().filter(is_house).count();
        let houses = town.objects.iter().filter(|one| one.tag == Tag::Building).count();
        let all = town.mesh.triangles.len();
        assert!(all < most && walls < houses * 2_000, "{name}: {all}, {walls} of {houses} houses");
    }
}

#[test]
fn gables_have_windows_with_sills_where_they_fit() {
    let windows = |[x, y]: [f32; 2], pitch: f32, hipped: bool| {
        let mut random = RandomStream::named(3, 1);
        let walls = Material::FacadePlaster;
        let look = Look::draw(Suits::Villa, walls, &[], &mut random).expect("a style");
        let mut builder = MeshBuilder::new(Tag::Building, walls, 1);
        let cover = roof::Cover { gable: walls, look: Some(&look) };
        roof::pitched(&mut builder, [x, y], 6.0, pitch, &cover, hipped);
        let mesh = builder.mesh;
        let panes = mesh.triangles.iter().zip(&mesh.faces);
        let panes = panes.filter(|(_, face)| face.material == Material::Glass as u8);
        let corners = panes.flat_map(|(corners, _)| *corners);
        corners.map(|at| Vec3::from(mesh.positions[at as usize])).collect::<Vec<_>>()
    };
    let (half, pitch) = ([6.0f32, 4.5f32], 0.9);
    let corners = windows(half, pitch, false);
    for side in [1.0, -1.0] {
        let of_side = corners.iter().filter(|at| at.x * side > 0.0);
        assert!(of_side.clone().count() >= 6, "a window in the gable at {side}");
        for at in of_side {
            assert!((at.x * side - half[0]).abs() < 0.05 && at.z > 6.5, "{at}");
            let cover = 6.0 + (half[1] - at.y.abs()) * pitch;
            assert!(at.z < cover - 0.2, "{at} below {cover}");
        }
    }
    assert!(windows(half, pitch, true).is_empty(), "a hipped roof has no gables");
    assert!(windows(half, 0.4, false).is_empty(), "a gable that is too low");
}
