use glam::Vec3;
use mesh::{Material, RandomStream, Tag};

use super::{
    Fineness, Frame, Look, Side, Suits,
    book::Book,
    grow::{Area, Facade},
};
use crate::mesh_builder::{MeshBuilder, bounds};

const KINDS: [(Suits, Material, [f32; 3]); 9] = [
    (Suits::Block, Material::FacadePlaster, [22.0, 14.0, 16.3]),
    (Suits::Block, Material::FacadeBrick, [17.0, 12.0, 13.2]),
    (Suits::Block, Material::FacadeConcrete, [27.0, 15.0, 19.4]),
    (Suits::Tower, Material::FacadeGlass, [24.0, 20.0, 18.0]),
    (Suits::Row, Material::FacadePlaster, [11.0, 11.0, 13.2]),
    (Suits::Row, Material::FacadeBrick, [9.5, 12.0, 10.1]),
    (Suits::Terrace, Material::FacadeBrick, [7.5, 10.0, 6.7]),
    (Suits::Villa, Material::FacadePlaster, [12.0, 9.0, 6.7]),
    (Suits::Hall, Material::Metal, [30.0, 18.0, 6.8]),
];

/// Calls `check` with every wall of a few buildings of every kind: half its width, its height, what
/// grew on it, and its mesh, in which the wall looks along y and stands on y = 0.
fn each_wall(mut check: impl FnMut([f32; 2], &[(&'static str, Area)], &mesh::Mesh)) {
    for (number, (suits, material, [wide, deep, high])) in KINDS.into_iter().enumerate() {
        for seed in 0..12 {
            let mut random = RandomStream::named(seed, number as u64);
            let look = Look::draw(suits, material, &[], &mut random).expect("a style");
            for (side, width) in [(Side::Front, wide), (Side::Flank, deep), (Side::Back, wide)] {
                let mut builder = MeshBuilder::new(Tag::Building, material, 1);
                let half = width * 0.5;
                let frame = Frame { turn: glam::Quat::IDENTITY, foot: Vec3::ZERO, half };
                let mut facade =
                    Facade::new(&mut builder, &look, frame, Fineness::Full, &mut random);
                let area = Area { u: [-half, half], z: [0.0, high] };
                facade.grow(facade.start(side), area);
                let grown = std::mem::take(&mut facade.grown);
                facade.canvas.finish();
                check([half, high], &grown, &builder.mesh);
            }
        }
    }
}

#[test]
fn the_embedded_rules_are_valid_and_suit_every_kind_of_building() {
    let book = Book::parse(include_str!("rules.toml")).expect("valid rules");
    assert!(book.styles.len() >= 12 && book.words.len() > 20);
    for (suits, ..) in KINDS {
        assert!(book.styles.iter().any(|style| style.suits.contains(&suits)), "{suits:?}");
    }
}

#[test]
fn a_mistake_in_the_rules_is_one_error_that_names_the_rule() {
    let good = include_str!("rules.toml");
    for (from, to, error) in [
        ("use = \"downpipe\"", "use = \"drainpipe\"", "rule drain: there is no rule drainpipe"),
        ("nothing.over = []", "nothing.over = [\"drain\"]", "contains itself"),
        ("{ each = 4.6, use", "{ each = -4.6, use", "rule shop-run: shop-bay needs one of"),
        (
            "{ each = 4.6, use",
            "{ each = 4.6, size = 1, use",
            "rule shop-run: shop-bay needs one of",
        ),
        ("plinth.wall = {", "plinth.well = {", "unknown variant `well`"),
        (
            "front = \"loft-front\"",
            "front = \"lift-front\"",
            "style warehouse lofts: there is no rule",
        ),
        ("colors = \"office\"", "colors = \"offices\"", "no colours for the paint Wall"),
        (
            "weight = 3, use = \"shops\"",
            "weight = 0, use = \"shops\"",
            "rule street-ground: needs choices",
        ),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from}");
        let said = Book::parse(&bad).expect_err(to);
        assert!(said.contains(error), "{to}: {said}");
    }
}

/// Windows and doors lie inside the wall, and none covers another.
#[test]
fn openings_do_not_overlap_and_stay_inside_the_wall() {
    let (mut doors, mut windows) = (0, 0);
    each_wall(|[half, high], grown, _| {
        for (number, (name, one)) in grown.iter().enumerate() {
            doors += u32::from(*name == "door");
            windows += u32::from(*name == "window");
            assert!(one.u[0] >= -half - 1e-3 && one.u[1] <= half + 1e-3, "{name} {one:?}");
            assert!(one.z[0] >= -1e-3 && one.z[1] <= high + 1e-3, "{name} {one:?}");
            for (other_name, other) in &grown[..number] {
                let apart = |a: [f32; 2], b: [f32; 2]| a[1] <= b[0] + 1e-3 || b[1] <= a[0] + 1e-3;
                assert!(
                    apart(one.u, other.u) || apart(one.z, other.z),
                    "{name} {one:?} and {other_name} {other:?}"
                );
            }
        }
    });
    assert!(doors > 100 && windows > 3000, "{doors} doors, {windows} windows");
}

/// The pieces of a front cover it: every ray at the wall hits something.
#[test]
fn walls_have_no_holes() {
    each_wall(|[half, high], _, mesh| {
        let flat: Vec<[[f32; 2]; 3]> = mesh
            .triangles
            .iter()
            .map(|t| t.map(|at| mesh.positions[at as usize]).map(|[x, _, z]| [x, z]))
            .collect();
        for step in 0..160 {
            let x = half * (((step * 37) % 160) as f32 / 80.0 - 0.9937);
            let z = high * (step as f32 + 0.37) / 160.3;
            let side =
                |[a, b]: [[f32; 2]; 2]| (b[0] - a[0]) * (z - a[1]) - (b[1] - a[1]) * (x - a[0]);
            let covered = flat.iter().any(|[a, b, c]| {
                let s = [side([*a, *b]), side([*b, *c]), side([*c, *a])];
                s.iter().all(|s| *s >= -1e-4) || s.iter().all(|s| *s <= 1e-4)
            });
            assert!(covered, "a hole at {x}, {z}");
        }
    });
}

/// How far balconies, awnings, steps and canopies may stand out of the wall, and openings go into
/// it. Metres.
const OUT_M: f32 = 1.5;
const IN_M: f32 = 0.5;

#[test]
fn nothing_projects_farther_than_a_plot_allows() {
    each_wall(|[half, high], _, mesh| {
        let (low, top) = bounds(mesh);
        assert!(top.y <= OUT_M && low.y >= -IN_M, "{low} {top}");
        assert!(low.x >= -half - 0.35 && top.x <= half + 0.35, "{low} {top}");
        assert!(low.z >= -1.0 && top.z <= high + 0.3, "{low} {top} {high}");
    });
}

#[test]
fn neighbours_do_not_resemble_each_other_and_the_same_seed_gives_the_same_look() {
    let draw = |seed: u64, neighbours: &[&Look]| {
        let mut random = RandomStream::named(seed, 1);
        Look::draw(Suits::Row, Material::FacadePlaster, neighbours, &mut random).expect("a look")
    };
    for seed in 0..300 {
        let first = draw(seed, &[]);
        assert_eq!(first, draw(seed, &[]));
        // The same random numbers would give the same look.
        let second = draw(seed, &[&first]);
        assert!(!second.resembles(&first), "{first:?}");
    }
}
