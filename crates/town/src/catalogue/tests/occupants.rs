//! Vehicles that drive have a driver; parked ones are empty. Wheels stay inside their arches.

use glam::Vec3;
use mesh::{Face, Material, Mesh};

use crate::catalogue::{Kind, Motion, Posture, catalogue};

fn with(mesh: &Mesh, material: Material) -> Vec<(&[u32; 3], &Face)> {
    let all = mesh.triangles.iter().zip(&mesh.faces);
    all.filter(|(_, face)| face.material == material as u8).collect()
}

#[test]
fn a_driven_car_has_a_driver_and_a_parked_one_has_none() {
    let doors = |one: &&crate::Blueprint| one.rig().door_count() > 0;
    let mut passengers = 0;
    for one in catalogue().iter().filter(|one| one.kind == Kind::Vehicle).filter(doors) {
        let geometry = one.geometry();
        assert!(with(&geometry.whole, Material::Skin).is_empty(), "{}: parked", one.id);
        for doors in [0, 1] {
            let mut heads = 0;
            one.rig().place(&Posture { doors, ..Posture::default() }, |piece, _| {
                assert!(with(&geometry.pieces[piece], Material::Skin).is_empty(), "{}", one.id);
                if !one.rig().is_body(piece) {
                    return;
                }
                let mesh = &geometry.occupants;
                let mut skin = with(mesh, Material::Skin);
                skin.retain(|(corners, _)| {
                    let at = |corner: u32| Vec3::from_array(mesh.positions[corner as usize]);
                    corners.iter().all(|corner| at(*corner).y > 0.0)
                });
                heads += skin.len();
                if doors == 0 {
                    passengers += usize::from(with(mesh, Material::Skin).len() > skin.len());
                }
                assert!(mesh.faces.iter().all(|face| face.tag == one.tag as u8));
            });
            assert!(heads > 100, "{}: {heads} triangles of a driver's skin", one.id);
        }
    }
    assert!((5..25).contains(&passengers), "{passengers} vehicles with passengers");
}

#[test]
fn occupants_are_inside_the_body() {
    for one in catalogue().iter().filter(|one| one.rig().door_count() > 0) {
        let [low, high] = [-1.0, 1.0].map(|side| one.center_m + one.half_extents_m * side);
        for point in &one.geometry().occupants.positions {
            let point = Vec3::from_array(*point);
            let inside = point.cmpgt(low).all() && point.cmplt(high - Vec3::Z * 0.02).all();
            assert!(inside, "{}: {point}", one.id);
        }
    }
}

#[test]
fn a_bus_has_rows_of_seats_and_people_only_where_it_is_driven() {
    let (_, bus) = crate::blueprint("vehicle.mitsubishi.fusorosa").unwrap();
    let whole = bus.mesh();
    assert!(with(whole, Material::Skin).is_empty(), "a parked bus is empty");
    let people = with(&bus.geometry().occupants, Material::Skin).len();
    assert!(people > 400, "{people} triangles of skin");
    // Upholstery along the aisle, on both sides, all of it between floor and roof.
    let cloth = with(whole, Material::Cloth);
    let points: Vec<Vec3> = cloth
        .iter()
        .filter(|(_, face)| face.tint != 0)
        .flat_map(|(corners, _)| corners.map(|c| Vec3::from_array(whole.positions[c as usize])))
        .filter(|point| point.z < 2.3)
        .collect();
    let (low, high) = points
        .iter()
        .fold((Vec3::MAX, Vec3::MIN), |(low, high), point| (low.min(*point), high.max(*point)));
    assert!(high.x - low.x > bus.half_extents_m.x * 1.2, "{low} to {high}");
    assert!(low.y < -0.6 && high.y > 0.6 && low.z > 1.0, "{low} to {high}");
    let [bottom, top] = [-1.0, 1.0].map(|side| bus.center_m + bus.half_extents_m * side);
    assert!(points.iter().all(|p| p.cmpgt(bottom).all() && p.cmplt(top).all()));
}

#[test]
fn wheels_do_not_touch_the_paint_above_them() {
    let closed = |one: &&crate::Blueprint| one.rig().door_count() == 4;
    for one in catalogue().iter().filter(closed) {
        let pieces = one.rig().joints.iter().zip(&one.geometry().pieces);
        for (joint, mesh) in pieces {
            if !matches!(joint.motion, Motion::Shut) {
                continue;
            }
            for (corners, _) in with(mesh, Material::CarPaint) {
                for corner in corners {
                    let point = Vec3::from_array(mesh.positions[*corner as usize]);
                    for wheel in &one.wheels {
                        let off = (point - wheel.position_m) * Vec3::new(1.0, 0.0, 1.0);
                        let clear = off.length() > wheel.radius_m * 1.03;
                        let beside = (point.y - wheel.position_m.y).abs() > wheel.width_m;
                        assert!(clear || beside, "{}: {point} at a wheel", one.id);
                    }
                }
            }
        }
    }
}
