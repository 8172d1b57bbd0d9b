//! glTF files that replace meshes.

use glam::Vec3;

use crate::{
    catalogue::{MeshError, Motion, Posture, blueprint, replaced},
    mesh_builder,
};

/// Returns a binary glTF with these nodes, each with one triangle about its origin.
fn glb(nodes: &[(&str, [f32; 3])], material: &str) -> Vec<u8> {
    let corners: [[f32; 3]; 3] = [[0.0, -0.3, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.4]];
    let mut bin: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bin.extend([0u16, 1, 2, 0].iter().flat_map(|i| i.to_le_bytes()));
    let list: Vec<String> = nodes
        .iter()
        .map(|(name, [x, y, z])| {
            format!(r#"{{"name":"{name}","mesh":0,"translation":[{x},{y},{z}]}}"#)
        })
        .collect();
    let numbers: Vec<String> = (0..nodes.len()).map(|n| n.to_string()).collect();
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],"materials":[{material}],"buffers":[{{"byteLength":{}}}],"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,-0.3,0],"max":[0,0.3,0.4]}},{{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}]}}"#,
        numbers.join(","),
        list.join(","),
        bin.len(),
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let mut file = Vec::new();
    file.extend(b"glTF");
    file.extend(2u32.to_le_bytes());
    file.extend((12 + 8 + json.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
    file.extend((json.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(json.as_bytes());
    file.extend((bin.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

const RED: &str =
    r#"{"name":"hull","pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"metallicFactor":0}}"#;

#[test]
fn nodes_named_as_wheels_become_wheels_and_the_rest_the_body() {
    let (_, one) = blueprint("vehicle.tesla.model3").unwrap();
    // In glTF z is forward, y up and x left.
    let file = glb(&[("chassis", [0.0, 0.5, 0.0]), ("wheel_fl", [0.8, 0.3, 1.4])], RED);
    let (geometry, rig) = replaced(one, &file).unwrap();
    assert_eq!(geometry.whole.triangles.len(), 2);
    let wheel = rig.joints.iter().position(|joint| joint.name == "wheel_fl").unwrap();
    let Motion::Wheel { hub_m, .. } = rig.joints[wheel].motion else { panic!("no wheel") };
    assert_eq!(hub_m, Vec3::new(1.4, 0.8, 0.3));
    let (low, high) = mesh_builder::bounds(&geometry.pieces[wheel]);
    assert!((low - Vec3::new(1.4, 0.8, 0.0)).length() < 1e-5, "{low}");
    assert!((high - Vec3::new(1.8, 0.8, 0.6)).length() < 1e-5, "{high}");
    assert_eq!(geometry.pieces[0].triangles.len(), 1, "the body is seen while doors are shut");
    let face = geometry.pieces[0].faces[0];
    assert_eq!(face.tint >> 11, 31, "pure red stays red");
    let mut shown = 0;
    rig.place(&Posture { spin_rad: 1.0, ..Posture::default() }, |_, _| shown += 1);
    assert_eq!(shown, 5);
}

#[test]
fn a_material_named_like_one_of_the_catalogue_is_that_material() {
    let (_, one) = blueprint("static.prop.barrel").unwrap();
    let file = glb(&[("x", [0.0, 0.3, 0.0])], r#"{"name":"carpaint"}"#);
    let (geometry, _) = replaced(one, &file).unwrap();
    assert_eq!(geometry.whole.faces[0].material, mesh::Material::CarPaint as u8);
    assert_eq!(geometry.whole.faces[0].tint, 0);
}

#[test]
fn a_broken_file_is_refused_and_never_panics() {
    let (_, one) = blueprint("vehicle.tesla.model3").unwrap();
    assert!(matches!(replaced(one, b"no glTF at all"), Err(MeshError::Syntax(_))));
    let whole = glb(&[("body", [0.0, 0.5, 0.0])], RED);
    assert!(replaced(one, &whole).is_ok());
    for end in 0..whole.len() {
        assert!(replaced(one, &whole[..end]).is_err(), "cut after {end}");
    }
    let mut refused = 0;
    for at in 0..whole.len() {
        for bits in [0x01, 0x10, 0x80] {
            let mut bytes = whole.clone();
            bytes[at] ^= bits;
            refused += usize::from(replaced(one, &bytes).is_err());
        }
    }
    assert!(refused > whole.len() / 2, "{refused} of {}", whole.len() * 3);
    let nothing = glb(&[], RED);
    assert!(replaced(one, &nothing).is_err());
}
