use glam::Vec3;

use super::{Kind, blueprint, catalogue, fleet};
use crate::clay;

#[test]
fn outer_dimensions_are_within_two_percent_of_the_table() {
    for (id, promised) in fleet::promised() {
        let (_, found) = blueprint(id).unwrap();
        let (low, high) = clay::bounds(&found.mesh);
        let size = high - low;
        let off = ((size - promised) / promised).abs();
        assert!(off.max_element() <= 0.02, "{id}: {size} is not {promised}");
        assert_eq!(found.half_extents_m, size * 0.5, "{id}");
        assert_eq!(found.center_m, (low + high) * 0.5, "{id}");
    }
}

#[test]
fn everything_stands_on_the_ground() {
    for one in catalogue().iter().filter(|one| one.kind != Kind::TrafficLight) {
        let lowest = clay::bounds(&one.mesh).0.z;
        assert!(lowest.abs() < 0.02, "{}: lowest point at {lowest} m", one.id);
    }
}

#[test]
fn wheels_touch_the_ground_inside_the_box_and_left_comes_first() {
    for one in catalogue().iter().filter(|one| one.kind == Kind::Vehicle) {
        assert!(one.wheels.len() == 4 || one.wheels.len() == 2, "{}", one.id);
        for wheel in &one.wheels {
            let foot = wheel.position_m - Vec3::Z * wheel.radius_m;
            assert!(foot.z.abs() < 1e-4, "{}", one.id);
            let inside = (wheel.position_m - one.center_m).abs();
            assert!(inside.cmplt(one.half_extents_m).all(), "{}", one.id);
        }
        assert!(one.wheels[0].steered && one.wheels[0].position_m.y >= 0.0, "{}", one.id);
        assert!(one.wheels.iter().any(|wheel| wheel.driven), "{}", one.id);
        let axles = one.wheels[0].position_m.x - one.wheels[one.wheels.len() - 1].position_m.x;
        assert!((axles - one.wheelbase_m).abs() < 1e-3, "{}", one.id);
    }
}

#[test]
fn meshes_are_sound_and_of_a_reasonable_size() {
    for one in catalogue() {
        let mesh = &one.mesh;
        assert_eq!(mesh.triangles.len(), mesh.faces.len(), "{}", one.id);
        assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.positions.len()));
        assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()), "{}", one.id);
        assert!(mesh.faces.iter().all(|face| face.object == 0 && face.reserved == 0));
        let range = match one.kind {
            Kind::Vehicle => 800..=3200,
            _ => 12..=2000,
        };
        assert!(range.contains(&mesh.triangles.len()), "{}: {}", one.id, mesh.triangles.len());
    }
}

/// A closed, outward skin has a positive volume: the sum of signed tetrahedra.
#[test]
fn skins_face_outwards() {
    for one in catalogue() {
        let volume: f32 = one
            .mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| Vec3::from_array(one.mesh.positions[i as usize]));
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!(volume > 0.0, "{}: volume {volume}", one.id);
    }
}

#[test]
fn ids_are_unique_and_found() {
    for (index, one) in catalogue().iter().enumerate() {
        assert_eq!(blueprint(one.id).unwrap().0 as usize, index);
    }
    let count = |prefix: &str| catalogue().iter().filter(|b| b.id.starts_with(prefix)).count();
    assert_eq!((count("vehicle."), count("walker.pedestrian.")), (40, 49));
    assert!(blueprint("vehicle.nobody.knows").is_none());
}
