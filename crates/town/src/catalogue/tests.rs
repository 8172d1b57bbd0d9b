mod moving;
mod occupants;
mod page;
mod replaced;

use glam::Vec3;
use mesh::Material;

use crate::{
    catalogue::{Kind, blueprint, catalogue, fleet},
    mesh_builder,
};

#[test]
fn outer_dimensions_are_within_two_percent_of_the_table() {
    for (id, promised) in fleet::promised() {
        let (_, found) = blueprint(id).unwrap();
        let (low, high) = mesh_builder::bounds(found.mesh());
        let size = high - low;
        let off = ((size - promised) / promised).abs();
        assert!(off.max_element() <= 0.02, "{id}: {size} is not {promised}");
        assert_eq!(found.half_extents_m, promised * 0.5, "{id}");
    }
}

#[test]
fn every_mesh_fills_its_bounding_box() {
    for one in catalogue() {
        let (low, high) = mesh_builder::bounds(one.mesh());
        let slack = (one.half_extents_m * 0.04).max(Vec3::splat(0.004));
        for (what, off) in [
            ("lower", low - (one.center_m - one.half_extents_m)),
            ("upper", high - (one.center_m + one.half_extents_m)),
        ] {
            assert!(off.abs().cmple(slack).all(), "{}: the {what} corner is off by {off}", one.id);
        }
    }
}

#[test]
fn every_mesh_stands_on_the_ground() {
    for one in catalogue().iter().filter(|one| one.kind != Kind::TrafficLight) {
        let lowest = mesh_builder::bounds(one.mesh()).0.z;
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
        let mesh = one.mesh();
        assert_eq!(mesh.triangles.len(), mesh.faces.len(), "{}", one.id);
        assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.positions.len()));
        assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()), "{}", one.id);
        assert!(mesh.faces.iter().all(|face| face.object == 0));
        let range = match one.kind {
            Kind::Vehicle => 1200..=19_500,
            Kind::Walker => 4500..=6400,
            _ => 12..=3000,
        };
        assert!(range.contains(&mesh.triangles.len()), "{}: {}", one.id, mesh.triangles.len());
    }
}

#[test]
fn every_car_has_a_rear_window_and_equal_covers_of_its_head_lamps() {
    for one in catalogue().iter().filter(|one| one.kind == Kind::Vehicle && one.base_type == "car")
    {
        let mesh = one.mesh();
        let (mut rear, mut covers) = (0.0, [0.0; 2]);
        for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
            if face.material != Material::Glass as u8 {
                continue;
            }
            let [a, b, c] = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
            let (normal, middle) = ((b - a).cross(c - a) * 0.5, (a + b + c) / 3.0);
            if face.tint == 1 {
                assert!(middle.x > one.center_m.x, "{}", one.id);
                covers[usize::from(middle.y < 0.0)] += normal.length();
            } else if middle.x < one.center_m.x && normal.x < -0.15 * normal.length() {
                rear += normal.x.hypot(normal.z);
            }
        }
        assert!(rear > 0.2, "{}: a rear window of {rear} square metres", one.id);
        assert!(
            (covers[0] - covers[1]).abs() < 0.02 * (covers[0] + 0.01),
            "{}: {covers:?}",
            one.id
        );
    }
    let covered = |id: &str| {
        blueprint(id)
            .unwrap()
            .1
            .mesh()
            .faces
            .iter()
            .any(|f| f.tint == 1 && f.material == Material::Glass as u8)
    };
    assert!(covered("vehicle.lincoln.mkz_2020") && !covered("vehicle.tesla.cybertruck"));
}

/// The cars whose bodies are painted down to their lower edge.
fn caged_cars() -> impl Iterator<Item = &'static super::Blueprint> {
    let cars = catalogue().iter().filter(|one| one.base_type == "car");
    cars.filter(|one| one.id != "vehicle.tesla.cybertruck")
}

#[test]
fn bodies_of_cars_have_creases_with_a_rounding() {
    // Off-roaders have flat panels.
    let flat = ["vehicle.jeep.wrangler_rubicon", "vehicle.nissan.patrol"];
    for one in caged_cars().filter(|one| !flat.contains(&one.id)) {
        let mesh = one.mesh();
        let paint = mesh.triangles.iter().zip(&mesh.faces);
        let paint = paint.filter(|(_, face)| face.material == Material::CarPaint as u8);
        // Triangles that are as narrow as the rounding of a crease, and longer than wide.
        let long: f32 = paint
            .map(|(corners, _)| {
                let [a, b, c] = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
                let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                let area = (b - a).cross(c - a).length() * 0.5;
                let high = 2.0 * area / longest;
                let is_strip = (0.008..0.014).contains(&high) && longest > 0.05;
                if is_strip { area / 0.012 } else { 0.0 }
            })
            .sum();
        // On each side a shoulder, the lower edge of the doors and the side of the bonnet; bumpers,
        // and the edges of bonnet and lid. Narrow parts as rims of lamps are about 5 wheelbases.
        let least = 7.0 * one.wheelbase_m;
        assert!(long > least, "{}: {long} m of creases, expected {least} m", one.id);
    }
}

#[test]
fn openings_of_cars_do_not_hang_below_the_body() {
    let dark = mesh::Face::tint([12, 12, 13]);
    for one in caged_cars() {
        let mesh = one.mesh();
        // The areas at the front and at the rear.
        let mut areas = [0.0; 2];
        let mut lowest = [[f32::MAX; 2]; 2];
        for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
            let corners = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
            let is_dark = face.material == Material::Plastic as u8 && face.tint == dark;
            if !is_dark && face.material != Material::CarPaint as u8 {
                continue;
            }
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a) * 0.5;
            let middle = (a + b + c) / 3.0 - one.center_m;
            // Seals have the same colour, and lie on the windows.
            if is_dark && (middle.x.abs() < 0.4 * one.half_extents_m.x || middle.z > 0.0) {
                continue;
            }
            let end = usize::from(middle.x < 0.0);
            if is_dark && normal.x * middle.x > 0.0 {
                areas[end] += normal.x.abs();
            }
            if middle.x.abs() > 0.85 * one.half_extents_m.x {
                let low = &mut lowest[end][usize::from(is_dark)];
                *low = corners.iter().fold(*low, |low, corner| low.min(corner.z));
            }
        }
        assert!(areas.iter().all(|area| *area > 0.02), "{}: {areas:?}", one.id);
        for [paint, dark] in lowest {
            assert!(dark > paint - 0.01, "{}: {dark} m below {paint} m", one.id);
        }
    }
}

/// A closed, outward-facing surface has a positive volume: the sum of signed tetrahedra.
#[test]
fn triangles_face_outwards() {
    for one in catalogue() {
        let volume: f32 = one
            .mesh()
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| Vec3::from_array(one.mesh().positions[i as usize]));
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
    let counts = ["vehicle.", "walker.pedestrian.", "static.prop."].map(count);
    assert_eq!(counts, [41, 49, 96], "95 props are CARLA's, one is ours");
    assert!(blueprint("vehicle.nobody.knows").is_none());
}

#[test]
fn attributes_follow_from_blueprints() {
    let of = |id: &str| {
        let (_, one) = blueprint(id).unwrap();
        one.attributes().into_iter().map(|a| (a.id, a.values[0].clone())).collect::<Vec<_>>()
    };
    let value = |id: &str, name: &str| {
        of(id).into_iter().find(|(found, _)| *found == name).map(|(_, value)| value)
    };
    let ids = |id: &str| of(id).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    assert_eq!(
        ids("vehicle.yamaha.yzf"),
        [
            "role_name",
            "ros_name",
            "color",
            "driver_id",
            "sticky_control",
            "terramechanics",
            "object_type",
            "base_type",
            "special_type",
            "number_of_wheels",
            "generation",
            "has_dynamic_doors",
            "has_lights",
        ]
    );
    assert_eq!(
        ids("walker.pedestrian.0001"),
        [
            "role_name",
            "ros_name",
            "is_invincible",
            "speed",
            "use_wheelchair",
            "gender",
            "generation",
            "age",
            "can_use_wheelchair",
        ]
    );
    assert_eq!(ids("static.prop.barrel"), ["role_name", "ros_name", "size"]);
    for (id, name, wanted) in [
        ("vehicle.ford.ambulance", "special_type", "emergency"),
        ("vehicle.ford.crown", "special_type", "taxi"),
        ("vehicle.ford.crown", "generation", "2"),
        ("vehicle.audi.a2", "generation", "1"),
        ("vehicle.audi.a2", "has_dynamic_doors", "true"),
        ("vehicle.yamaha.yzf", "has_dynamic_doors", "false"),
        ("vehicle.yamaha.yzf", "number_of_wheels", "2"),
        ("vehicle.harley-davidson.low_rider", "base_type", "motorcycle"),
        ("vehicle.harley-davidson.low_rider", "number_of_wheels", "2"),
        ("vehicle.harley-davidson.low_rider", "generation", "1"),
        ("vehicle.harley-davidson.low_rider", "driver_id", "1"),
        ("vehicle.mitsubishi.fusorosa", "base_type", "bus"),
        ("walker.pedestrian.0011", "age", "child"),
        ("static.prop.colacan", "size", "tiny"),
    ] {
        assert_eq!(value(id, name).as_deref(), Some(wanted), "{id} {name}");
    }
}

#[test]
fn building_the_catalogue_builds_no_mesh() {
    // Sizes are tables: a caller that asks only for sizes must not wait for meshes.
    let made = super::fleet::vehicles();
    assert!(made.iter().all(|one| one.geometry.get().is_none()));
    assert!(made.iter().all(|one| one.half_extents_m.min_element() > 0.1));
}

#[test]
fn light_bars_have_separate_modules_whose_lenses_are_dark_while_they_are_off() {
    let police = blueprint("vehicle.dodge.charger_police").unwrap().1.mesh();
    let lenses = police.triangles.iter().zip(&police.faces);
    let lenses = lenses.filter(|(_, face)| face.material == Material::Beacon as u8);
    let mut across: Vec<[f32; 2]> = Vec::new();
    for (corners, face) in lenses {
        let [red, green, blue] = [face.tint >> 11, face.tint >> 6 & 31, face.tint & 31];
        assert!(red.max(green).max(blue) < 20, "a dark lens: {red} {green} {blue}");
        let y = corners.map(|at| police.positions[at as usize][1]);
        across.push([y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2])]);
    }
    across.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut modules, mut end) = (0, f32::MIN);
    for [from, to] in across {
        modules += usize::from(from > end + 0.01);
        end = end.max(to);
    }
    assert_eq!(modules, 5);
}

#[test]
fn a_bumper_of_a_cage_ends_in_unpainted_plastic_and_an_angular_body_has_cladding() {
    for id in ["vehicle.lincoln.mkz_2020", "vehicle.nissan.patrol_2021", "vehicle.tesla.cybertruck"]
    {
        let one = blueprint(id).unwrap().1;
        let mesh = one.mesh();
        let mut area = [0.0; 2];
        for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
            let [a, b, c] = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
            let (normal, middle) = ((b - a).cross(c - a) * 0.5, (a + b + c) / 3.0);
            let is_end = normal.x.abs() > 0.6 * normal.length();
            // Beside the openings of both ends.
            let low = middle.z < one.half_extents_m.z * 0.5
                && middle.y.abs() > one.half_extents_m.y * 0.66;
            if is_end && low && face.material == Material::Plastic as u8 {
                area[usize::from(normal.x > 0.0)] += normal.length();
            }
        }
        assert!(area.iter().all(|area| *area > 0.008), "{id}: {area:?}");
    }
}

#[test]
fn the_cybertruck_is_made_of_flat_sheets_with_dark_cladding_and_a_dark_bed() {
    let (_, one) = blueprint("vehicle.tesla.cybertruck").unwrap();
    let mesh = one.mesh();
    let (mut sheets, mut dark): (Vec<(Vec3, f32)>, f32) = (Vec::new(), 0.0);
    for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
        let [a, b, c] = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
        let across = (b - a).cross(c - a) * 0.5;
        let (area, normal) = (across.length(), across.normalize_or_zero());
        let middle = (a + b + c) / 3.0;
        if face.material == Material::CarPaint as u8 {
            match sheets.iter_mut().find(|(other, _)| other.dot(normal) > 0.999) {
                Some((_, sum)) => *sum += area,
                None => sheets.push((normal, area)),
            }
        }
        let is_behind = middle.x < one.center_m.x && normal.z > 0.8;
        if is_behind && face.material == Material::Plastic as u8 && middle.z > 1.3 {
            dark += area;
        }
    }
    sheets.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (all, largest) = (
        sheets.iter().map(|sheet| sheet.1).sum::<f32>(),
        sheets.iter().take(24).map(|sheet| sheet.1).sum::<f32>(),
    );
    assert!(largest > 0.75 * all, "{largest} of {all} square metres in 24 directions");
    assert!(dark > 1.5, "a bed of {dark} square metres");
}

#[test]
fn roof_rails_follow_the_roof() {
    let with_rails = ["audi.etron", "bmw.grandtourer", "mini.cooper_s_2021", "nissan.patrol_2021"];
    for id in with_rails {
        let (_, one) = blueprint(&format!("vehicle.{id}")).unwrap();
        let mesh = one.mesh();
        let corners =
            |at: usize| mesh.triangles[at].map(|at| Vec3::from(mesh.positions[at as usize]));
        let of = |material: Material| {
            (0..mesh.faces.len()).filter(move |at| mesh.faces[*at].material == material as u8)
        };
        let high = one.half_extents_m.z * 1.7;
        let rails: Vec<Vec3> =
            of(Material::Metal).flat_map(corners).filter(|at| at.z > high).collect();
        assert!(rails.len() > 100, "{id}: {}", rails.len());
        let roof: Vec<[Vec3; 3]> =
            of(Material::CarPaint).chain(of(Material::Glass)).map(corners).collect();
        for rail in rails {
            // The highest point of the body below.
            let below = |[a, b, c]: &[Vec3; 3]| {
                let (u, v, w) = (*b - *a, *c - *a, rail - *a);
                let area = u.truncate().perp_dot(v.truncate());
                let s = w.truncate().perp_dot(v.truncate()) / area;
                let t = u.truncate().perp_dot(w.truncate()) / area;
                let inside = area.abs() > 1e-9 && s >= 0.0 && t >= 0.0 && s + t <= 1.0;
                inside.then_some(a.z + u.z * s + v.z * t)
            };
            let body = roof.iter().filter_map(below).fold(f32::MIN, f32::max);
            assert!((-0.07..0.07).contains(&(rail.z - body)), "{id}: {rail} over {body}");
        }
    }
}

#[test]
fn head_lamps_lie_no_higher_than_the_regulation_allows() {
    for one in catalogue().iter().filter(|one| one.wheels.len() == 4) {
        let mesh = one.mesh();
        let lamps = mesh.triangles.iter().zip(&mesh.faces);
        // Signs on roofs have a tint.
        let lamps = lamps.filter(|(_, f)| f.material == Material::LampWhite as u8 && f.tint == 0);
        let heights =
            lamps.flat_map(|(corners, _)| corners.map(|at| mesh.positions[at as usize][2]));
        let highest = heights.fold(f32::MIN, f32::max);
        // UN R48, 6.2.4.2; the outer end of a cover rises a little.
        assert!((0.4..1.24).contains(&highest), "{}: {highest} m", one.id);
    }
}

#[test]
fn pillars_are_polished_and_cladding_is_not() {
    for one in caged_cars() {
        let mesh = one.mesh();
        let dark = |material: Material| {
            let of = mesh.triangles.iter().zip(&mesh.faces);
            let of = of.filter(move |(_, face)| {
                face.material == material as u8 && face.tint == mesh::Face::tint([15, 15, 16])
            });
            of.flat_map(|(corners, _)| corners.map(|at| mesh.positions[at as usize][2]))
        };
        let height = one.half_extents_m.z * 2.0;
        assert!(dark(Material::CarPaint).count() > 0, "{}", one.id);
        assert!(dark(Material::CarPaint).all(|z| z > height * 0.4), "{}", one.id);
        let lowest = dark(Material::Plastic).fold(f32::MAX, f32::min);
        assert!(lowest < height * 0.3, "{}: {lowest}", one.id);
    }
}

#[test]
fn the_sign_of_a_bus_has_the_strokes_of_letters() {
    let mesh = blueprint("vehicle.mitsubishi.fusorosa").unwrap().1.mesh();
    let lit: Vec<f32> = mesh
        .triangles
        .iter()
        .zip(&mesh.faces)
        .filter(|(_, face)| face.material == Material::LampAmber as u8)
        .map(|(corners, _)| {
            let [a, b, c] = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
            let normal = (b - a).cross(c - a);
            assert!(normal.x > 0.0, "it faces ahead");
            normal.length() * 0.5
        })
        .collect();
    // Two triangles for each of the 37 segments of "25 SCHULE".
    assert_eq!(lit.len(), 2 * 37);
    assert!(lit.iter().all(|area| *area < 0.002), "{lit:?}");
}
