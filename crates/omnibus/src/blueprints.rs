//! `omnibus blueprints`: lists what can be spawned, with attributes, or draws it.

mod pictures;

use std::path::PathBuf;

use serde_json::json;
use town::Blueprint;

/// Arguments of `omnibus blueprints`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct BlueprintsArgs {
    /// List only ids that contain this text, such as `vehicle` or `cone`
    #[arg(value_name = "TEXT")]
    text: Option<String>,
    /// Print everything about each blueprint, one JSON object per line
    #[arg(long)]
    json: bool,
    /// Write a picture of each blueprint, and a contact sheet of each kind, to this folder
    #[arg(long, value_name = "DIR")]
    sheet: Option<PathBuf>,
    /// A list of glTF files that replace meshes, one per line: id = "file.glb"
    #[arg(long, value_name = "FILE")]
    meshes: Option<PathBuf>,
}

/// Lists or draws blueprints.
pub(crate) fn blueprints(args: &BlueprintsArgs) -> anyhow::Result<()> {
    let wanted = args.text.as_deref().unwrap_or_default();
    let all: Vec<&Blueprint> = town::catalogue().iter().filter(|b| b.id.contains(wanted)).collect();
    anyhow::ensure!(
        !all.is_empty(),
        "no blueprint id contains {wanted:?}; `omnibus blueprints` lists all {}",
        town::catalogue().len()
    );
    if let Some(folder) = &args.sheet {
        return pictures::draw(&all, folder, args.meshes.as_deref());
    }
    for blueprint in all {
        if args.json {
            print_line!("{}", object(blueprint));
        } else {
            print_line!("{}", line(blueprint));
        }
    }
    Ok(())
}

/// Returns the id, size and mass, and the attributes that differ from the usual ones.
fn line(blueprint: &Blueprint) -> String {
    let [x, y, z] = (blueprint.half_extents_m * 2.0).to_array();
    let mut line =
        format!("{:<38} {x:5.2} x {y:4.2} x {z:4.2} m {:6.0} kg", blueprint.id, blueprint.mass_kg);
    const USUAL: [&str; 7] = [
        "role_name",
        "ros_name",
        "sticky_control",
        "terramechanics",
        "object_type",
        "is_invincible",
        "use_wheelchair",
    ];
    for attribute in blueprint.attributes() {
        let value = &attribute.values[0];
        if !USUAL.contains(&attribute.id) && !value.is_empty() {
            line += &format!(" {}={value}", attribute.id);
        }
    }
    line
}

fn object(blueprint: &Blueprint) -> serde_json::Value {
    let attributes: Vec<_> = blueprint
        .attributes()
        .into_iter()
        .map(|a| {
            json!({
                "id": a.id, "type": a.kind.name(), "default": a.values[0],
                "recommended": if a.is_modifiable { a.values.clone() } else { Vec::new() },
                "modifiable": a.is_modifiable, "only_recommended": a.only_recommended,
            })
        })
        .collect();
    let wheels: Vec<_> = blueprint
        .wheels
        .iter()
        .map(|w| {
            json!({
                "position_m": w.position_m.to_array(), "radius_m": w.radius_m,
                "width_m": w.width_m, "steered": w.steered, "driven": w.driven,
            })
        })
        .collect();
    let parts: Vec<_> = blueprint.rig().joints.iter().map(|joint| joint.name).collect();
    json!({
        "id": blueprint.id,
        "kind": pictures::kind_name(blueprint.kind),
        "tag": format!("{:?}", blueprint.tag),
        "size_m": (blueprint.half_extents_m * 2.0).to_array(),
        "center_m": blueprint.center_m.to_array(),
        "mass_kg": blueprint.mass_kg,
        "wheelbase_m": blueprint.wheelbase_m,
        "wheels": wheels,
        "parts": parts,
        "attributes": attributes,
    })
}
