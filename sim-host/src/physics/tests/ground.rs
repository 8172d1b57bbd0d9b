use bake::Cache;
use glam::Vec3;

use crate::physics::Ground;

fn mesh(quads: &[[[f32; 3]; 4]]) -> mesh::Mesh {
    let mut mesh = mesh::Mesh::default();
    for quad in quads {
        mesh.quad(*quad, mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0));
    }
    mesh
}

fn level(low: [f32; 2], high: [f32; 2], z: f32) -> [[f32; 3]; 4] {
    [[low[0], low[1], z], [high[0], low[1], z], [high[0], high[1], z], [low[0], high[1], z]]
}

#[test]
fn queries_under_and_on_a_bridge_find_the_road_and_the_bridge() {
    let ground = Ground::new(&mesh(&[
        level([-50.0, -50.0], [50.0, 50.0], 0.0),
        level([-50.0, -5.0], [50.0, 5.0], 6.0),
    ]));
    assert_eq!(ground.below(1.0, 1.0, 1.0).height_m, 0.0);
    assert_eq!(ground.below(1.0, 1.0, 6.5).height_m, 6.0);
    assert_eq!(ground.below(1.0, 20.0, 6.5).height_m, 0.0);
}

#[test]
fn a_point_just_below_the_surface_is_lifted_and_the_map_has_a_floor() {
    let ground = Ground::new(&mesh(&[level([0.0, 0.0], [10.0, 10.0], 3.0)]));
    assert_eq!(ground.below(5.0, 5.0, 2.0).height_m, 3.0);
    let beyond = ground.below(500.0, -1e9, 2.0);
    assert!(!beyond.on_map);
    assert_eq!(beyond.height_m, -2.0);
    assert!(!ground.below(f32::NAN, 0.0, 0.0).on_map);
}

#[test]
fn no_point_falls_through_the_seams_of_a_fan() {
    // Slivers that meet in one point, far from the origin: the hardest seams.
    let mut mesh = mesh::Mesh::default();
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    let center = Vec3::new(3011.3, -2017.7, 40.0);
    let middle = mesh.vertex(center.to_array());
    let rim: Vec<u32> = (0..720)
        .map(|i| {
            let angle = i as f32 * std::f32::consts::TAU / 720.0;
            mesh.vertex((center + Vec3::new(angle.cos(), angle.sin(), 0.02) * 30.0).to_array())
        })
        .collect();
    for i in 0..720 {
        mesh.triangle([middle, rim[i], rim[(i + 1) % 720]], face);
    }
    let ground = Ground::new(&mesh);
    for i in 0..200_000u32 {
        let angle = i as f32 * 0.377;
        let radius = 29.9 * ((i % 1009) as f32 / 1009.0).sqrt();
        let (x, y) = (center.x + angle.cos() * radius, center.y + angle.sin() * radius);
        let hit = ground.below(x, y, 45.0);
        assert!(hit.on_map, "fell through at {x}, {y}");
        assert!((hit.height_m - 40.0 - 0.02 * radius).abs() < 0.01, "{} at {radius}", hit.height_m);
    }
}

#[test]
fn walls_roofs_of_objects_and_undersides_are_not_ground() {
    let mut mesh = mesh(&[level([0.0, 0.0], [10.0, 10.0], 0.0)]);
    let face = mesh::Face::new(mesh::Tag::Building, mesh::Material::RoofFlat, 7);
    mesh.quad(level([2.0, 2.0], [4.0, 4.0], 5.0), face);
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    let mut underside = level([6.0, 6.0], [8.0, 8.0], 4.0);
    underside.reverse();
    mesh.quad(underside, face);
    let ground = Ground::new(&mesh);
    assert_eq!(ground.triangle_count(), 2);
    assert_eq!(ground.below(3.0, 3.0, 9.0).height_m, 0.0);
    assert_eq!(ground.below(7.0, 7.0, 9.0).height_m, 0.0);
}

#[test]
fn a_cached_query_returns_the_result_of_a_search() {
    // A plane of triangles, a bridge over it, a step, and slivers that overlap the plane.
    let mut mesh = mesh(&[
        level([0.0, 0.0], [60.0, 7.3], 0.0),
        level([0.0, 7.3], [60.0, 9.0], 0.15),
        level([20.0, -3.0], [24.0, 20.0], 5.0),
        level([30.0, 0.0], [30.4, 7.0], 0.01),
    ]);
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    let center = Vec3::new(45.0, 15.0, 1.0);
    let middle = mesh.vertex(center.to_array());
    let rim: Vec<u32> = (0..90)
        .map(|i| {
            let angle = i as f32 * std::f32::consts::TAU / 90.0;
            mesh.vertex((center + Vec3::new(angle.cos(), angle.sin(), 0.1) * 9.0).to_array())
        })
        .collect();
    for i in 0..90 {
        mesh.triangle([middle, rim[i], rim[(i + 1) % 90]], face);
    }
    let ground = Ground::new(&mesh);
    let mut cached_count = 0;
    for way in 0..4000u32 {
        let (mut cached, heading) = (None, way as f32 * 2.399);
        let from =
            Vec3::new((way % 61) as f32, (way % 23) as f32, [0.5, 6.0, -1.0][way as usize % 3]);
        for step in 0..200 {
            let at = from + Vec3::new(heading.cos(), heading.sin(), 0.001) * (step as f32 * 0.07);
            let hit = ground.below_cached(at.x, at.y, at.z, &mut cached);
            assert_eq!(hit, ground.below(at.x, at.y, at.z), "at {at}");
            cached_count += u32::from(cached.is_some());
        }
    }
    assert!(cached_count > 200_000, "only {cached_count} queries cached a topmost triangle");
}

#[test]
fn the_ground_from_the_cache_answers_with_the_bits_of_the_one_from_the_mesh() {
    let network = road::Network::parse(&mapgen::named("Flatford").unwrap()).unwrap();
    let mesh = town::furnish(&network, 3).without_scenery().mesh;
    let folder = std::env::temp_dir().join(format!("omnibus-ground-{}", std::process::id()));
    let cache = Cache::in_folder(&folder);
    let built = Ground::new(&mesh);
    Ground::cached(&cache, "a map", 3, || mesh.clone());
    let kept = Ground::cached(&cache, "a map", 3, || panic!("it is in the cache"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(kept.triangle_count(), built.triangle_count());
    let mut random = mesh::RandomStream::named(1, 2);
    let (mut on_map, mut cached) = (0, [None, None]);
    for _ in 0..20_000 {
        let [x, y, z] = mesh.positions[random.below(mesh.positions.len())];
        let mut near = || (random.below(4000) as f32 - 2000.0) * 1e-3;
        let (x, y, z) = (x + near(), y + near(), z + near());
        let hit = built.below(x, y, z);
        assert_eq!(kept.below(x, y, z), hit, "{x} {y} {z}");
        assert_eq!(built.below_cached(x, y, z, &mut cached[0]), hit, "{x} {y} {z}");
        assert_eq!(kept.below_cached(x, y, z, &mut cached[1]), hit, "{x} {y} {z}");
        on_map += usize::from(hit.on_map);
    }
    assert!(on_map > 10_000, "{on_map}");
}
