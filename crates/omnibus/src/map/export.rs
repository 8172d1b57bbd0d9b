//! `omnibus map export`: the furnished town, with parked cars and traffic lights, for other
//! programs.
//!
//! glTF is right-handed with y up: world (x, y, z) becomes (x, -z, y). OBJ keeps z up.

use std::{
    collections::BTreeMap,
    io::Write,
    path::{Path, PathBuf},
};

use mesh::{Material, Mesh, Tag};
use serde_json::json;

use crate::map::{
    output::write_file,
    source::{Loaded, Source},
};

/// Arguments of `omnibus map export`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    source: Source,
    /// The file to write, .glb or .obj
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The seed of the scenery
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Export only the surface of the roads
    #[arg(long)]
    roads_only: bool,
}

/// Writes the town to a file.
pub(super) fn export(args: &ExportArgs) -> anyhow::Result<()> {
    let extension = args.out.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let write: fn(&Parts, &mut dyn Write) -> anyhow::Result<()> =
        match extension.to_ascii_lowercase().as_str() {
            "glb" => write_glb,
            "obj" => write_obj,
            _ => anyhow::bail!("--out {}: the name must end in .glb or .obj", args.out.display()),
        };
    let Loaded { name, network, .. } = args.source.load()?;
    let mesh = if args.roads_only {
        road::surface_mesh(&network, SPACING_M)
    } else {
        town::furnish(&network, args.seed).assembled_mesh()
    };
    let name = Path::new(&name).file_stem().map_or(name.clone(), |n| n.to_string_lossy().into());
    let parts = Parts::of(&name, &mesh);
    write_file(&args.out, |file| write(&parts, file))?;
    print_line!(
        "{}: {} triangles in {} parts",
        args.out.display(),
        mesh.triangles.len(),
        parts.parts.len()
    );
    Ok(())
}

/// Distance between stations along bare roads, in metres.
const SPACING_M: f64 = 2.0;

/// A mesh grouped by its faces: each part has one tag and material.
struct Parts<'a> {
    name: &'a str,
    mesh: &'a Mesh,
    parts: BTreeMap<(u8, u8), Vec<[u32; 3]>>,
}

impl Parts<'_> {
    fn of<'a>(name: &'a str, mesh: &'a Mesh) -> Parts<'a> {
        let mut parts: BTreeMap<(u8, u8), Vec<[u32; 3]>> = BTreeMap::new();
        for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
            parts.entry((face.tag, face.material)).or_default().push(*corners);
        }
        Parts { name, mesh, parts }
    }
}

fn part_name((tag, material): (u8, u8)) -> String {
    let tag = Tag::from_code(tag).unwrap_or(Tag::Unlabeled);
    match Material::from_code(material) {
        Some(material) => format!("{tag:?}.{material:?}"),
        None => format!("{tag:?}"),
    }
}

/// Returns the sRGB colour of a part, roughly as the renderer shows it.
fn color_of((tag, material): (u8, u8)) -> [u8; 3] {
    match Material::from_code(material) {
        Some(Material::Asphalt) => [74, 75, 78],
        Some(Material::PaintWhite) => [232, 232, 228],
        Some(Material::PaintYellow) => [226, 178, 42],
        Some(Material::Paving | Material::Concrete | Material::FacadeConcrete) => [168, 164, 158],
        Some(Material::Kerb | Material::RoofFlat) => [140, 138, 134],
        Some(Material::Grass) => [104, 132, 66],
        Some(Material::Soil | Material::Bark) => [110, 86, 62],
        Some(Material::FacadeBrick | Material::RoofTiles) => [150, 82, 62],
        Some(Material::FacadePlaster) => [214, 204, 184],
        Some(Material::FacadeGlass | Material::Glass) => [120, 146, 160],
        Some(Material::Leaves) => [76, 112, 48],
        Some(Material::Needles) => [52, 84, 48],
        Some(Material::Metal) => [132, 136, 140],
        Some(Material::Rubber) => [30, 30, 30],
        _ => Tag::from_code(tag).unwrap_or(Tag::Unlabeled).color(),
    }
}

fn write_obj(parts: &Parts, file: &mut dyn Write) -> anyhow::Result<()> {
    writeln!(file, "# {}: metres, x east, y north, z up", parts.name)?;
    for [x, y, z] in &parts.mesh.positions {
        writeln!(file, "v {x} {y} {z}")?;
    }
    for (part, triangles) in &parts.parts {
        writeln!(file, "g {}", part_name(*part))?;
        for [a, b, c] in triangles {
            writeln!(file, "f {} {} {}", a + 1, b + 1, c + 1)?;
        }
    }
    Ok(())
}

fn write_glb(parts: &Parts, file: &mut dyn Write) -> anyhow::Result<()> {
    let positions: Vec<[f32; 3]> =
        parts.mesh.positions.iter().map(|[x, y, z]| [*x, *z, -*y]).collect();
    let limit = |pick: fn(f32, f32) -> f32, start: f32| {
        let merge = |sum: [f32; 3], p: &[f32; 3]| [0, 1, 2].map(|axis| pick(sum[axis], p[axis]));
        positions.iter().fold([start; 3], merge)
    };
    let (low, high) = (limit(f32::min, f32::INFINITY), limit(f32::max, f32::NEG_INFINITY));
    let positions_bytes = size_of_val(positions.as_slice());
    let mut accessors = vec![json!({
        "bufferView": 0, "componentType": 5126, "count": positions.len(), "type": "VEC3",
        "min": low, "max": high,
    })];
    let (mut primitives, mut materials) = (Vec::new(), Vec::new());
    let mut at = 0;
    for (part, triangles) in &parts.parts {
        let linear = color_of(*part).map(|byte| (f32::from(byte) / 255.0).powf(2.2));
        materials.push(json!({
            "name": part_name(*part),
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [linear[0], linear[1], linear[2], 1.0],
                "metallicFactor": 0.0, "roughnessFactor": 0.9,
            },
        }));
        primitives.push(json!({
            "attributes": { "POSITION": 0 }, "indices": accessors.len(),
            "material": materials.len() - 1,
        }));
        accessors.push(json!({
            "bufferView": 1, "byteOffset": at, "componentType": 5125,
            "count": triangles.len() * 3, "type": "SCALAR",
        }));
        at += size_of_val(triangles.as_slice());
    }
    let total = positions_bytes + at;
    let scene = json!({
        "asset": { "version": "2.0", "generator": "omnibus" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": parts.name }],
        "meshes": [{ "name": parts.name, "primitives": primitives }],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": positions_bytes, "target": 34962 },
            { "buffer": 0, "byteOffset": positions_bytes, "byteLength": at, "target": 34963 },
        ],
        "buffers": [{ "byteLength": total }],
    });
    let mut text = serde_json::to_vec(&scene)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + total;
    let short = |length: usize| {
        u32::try_from(length).map_err(|_| anyhow::anyhow!("glTF holds 4 GiB, the town has more"))
    };
    file.write_all(b"glTF")?;
    file.write_all(&2u32.to_le_bytes())?;
    file.write_all(&short(length)?.to_le_bytes())?;
    file.write_all(&short(text.len())?.to_le_bytes())?;
    file.write_all(b"JSON")?;
    file.write_all(&text)?;
    file.write_all(&short(total)?.to_le_bytes())?;
    file.write_all(b"BIN\0")?;
    file.write_all(bytemuck::cast_slice(&positions))?;
    for triangles in parts.parts.values() {
        file.write_all(bytemuck::cast_slice(triangles))?;
    }
    Ok(())
}
