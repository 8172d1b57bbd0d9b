//! The tables of `docs/blueprints.md` match the catalogue. `UPDATE_PAGES=1` rewrites them.

use std::fmt::Write;

use crate::catalogue::{Blueprint, Kind, catalogue};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/blueprints.md");
const BEGIN: &str = "<!-- tables: written by the tests of town -->\n";

fn value(one: &Blueprint, id: &str) -> String {
    let found = one.attributes().into_iter().find(|a| a.id == id);
    found.map(|a| a.values[0].clone()).unwrap_or_default()
}

fn tables() -> String {
    let mut text = String::new();
    let of = |kind: Kind| catalogue().iter().filter(move |one| one.kind == kind);
    let size = |one: &Blueprint| {
        let [x, y, z] = (one.half_extents_m * 2.0).to_array();
        format!("{x:.3} × {y:.3} × {z:.3}")
    };
    let _ = writeln!(
        text,
        "\n## Vehicles\n\nLength, width with mirrors and height in metres; wheelbase in metres; mass in kilograms.\n"
    );
    let _ = writeln!(
        text,
        "| id | size | wheelbase | mass | base type | special type | generation | doors |\n|---|---|---|---|---|---|---|---|"
    );
    for one in of(Kind::Vehicle) {
        let _ = writeln!(
            text,
            "| `{}` | {} | {:.3} | {} | {} | {} | {} | {} |",
            one.id,
            size(one),
            one.wheelbase_m,
            one.mass_kg,
            value(one, "base_type"),
            one.special_type,
            one.generation,
            one.rig().door_count(),
        );
    }
    let _ = writeln!(text, "\n## Walkers\n\n| id | height | gender | age |\n|---|---|---|---|");
    for one in of(Kind::Walker) {
        let height = one.half_extents_m.z * 2.0;
        let _ = writeln!(
            text,
            "| `{}` | {height:.2} | {} | {} |",
            one.id,
            value(one, "gender"),
            value(one, "age")
        );
    }
    let _ = writeln!(text, "\n## Props\n\n| id | size | mass | `size` |\n|---|---|---|---|");
    for one in of(Kind::Prop) {
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} |",
            one.id,
            size(one),
            one.mass_kg,
            value(one, "size")
        );
    }
    text
}

#[test]
fn the_documentation_page_lists_the_catalogue() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (head, found) = page.split_once(BEGIN).expect("the page has its tables");
    let right = tables();
    if std::env::var_os("UPDATE_PAGES").is_some() {
        std::fs::write(PAGE, format!("{head}{BEGIN}{right}")).unwrap();
        return;
    }
    let differs = found.lines().zip(right.lines()).find(|(a, b)| a != b);
    assert_eq!(differs, None, "outdated table; UPDATE_PAGES=1 rewrites docs/blueprints.md");
    assert_eq!(found.len(), right.len());
    for motion in
        ["wheel_fl", "door_fl", "crl_thigh__L", "VehicleLightState", "--meshes", "--sheet"]
    {
        assert!(head.contains(motion), "docs/blueprints.md does not explain {motion}");
    }
}
