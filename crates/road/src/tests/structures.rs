//! Rails, tunnels and bridges.

use glam::DVec3;
use mesh::{Mesh, Tag};

use super::{
    small::{JOINED, text},
    surface::Caster,
};
use crate::{Network, Structure, structures};

fn things(objects: &str) -> Vec<Structure> {
    let inside = format!("<objects>{objects}</objects></road>");
    let text = text(JOINED).replacen("</road>", &inside, 1);
    structures(&Network::parse(&text).expect("a valid map"))
}

fn built(objects: &str) -> Mesh {
    together(&things(objects))
}

fn together(things: &[Structure]) -> Mesh {
    let mut mesh = Mesh::default();
    things.iter().for_each(|one| mesh.append(&one.mesh));
    mesh
}

/// Returns whether each edge is used once in each direction, with vertices identified by position.
pub(super) fn is_closed(mesh: &Mesh) -> bool {
    let place = |corner: u32| mesh.positions[corner as usize].map(|x| (x * 1e4).round() as i64);
    let mut edges = std::collections::BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (place(*from), place(*to));
            *edges.entry((from.min(to), from.max(to))).or_insert(0) +=
                if from < to { 1 } else { -1 };
        }
    }
    edges.values().all(|sum| *sum == 0)
}

/// Returns six times the enclosed volume, which is positive where faces point outwards.
pub(super) fn volume(mesh: &Mesh) -> f64 {
    let of = |corners: &[u32; 3]| {
        let [a, b, c] =
            corners.map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(of).sum()
}

fn tag(mesh: &Mesh, triangle: usize) -> Option<Tag> {
    Tag::from_code(mesh.faces[triangle].tag)
}

#[test]
fn a_tunnel_has_sides_and_a_roof() {
    let mesh = built(r#"<tunnel id="1" s="10" length="20" type="standard"/>"#);
    assert!(is_closed(&mesh));
    // Half a metre around a room of 10 m (3.5, 3.5, 2 and two berms) by 5 m, 40 cm in the ground.
    let solid = 20.0 * (11.0 * 5.9 - 10.0 * 5.4);
    assert!((volume(&mesh) - solid).abs() < 0.1, "{} for {solid}", volume(&mesh));
    let caster = Caster::new(&mesh);
    let over = |x: f64, y: f64, from: f64| caster.below(DVec3::new(x, y, from), 20.0);
    let (roof, triangle) = over(20.0, 0.1, 9.0).expect("a roof");
    assert!((roof - 5.5).abs() < 1e-3 && tag(&mesh, triangle) == Some(Tag::Wall));
    assert!(over(20.0, 0.1, 4.9).is_none(), "something lies on the road");
    assert!(over(9.0, 0.1, 9.0).is_none(), "it begins too early");
    assert!(over(31.0, 0.1, 9.0).is_none(), "it ends too late");
}

#[test]
fn a_bridge_has_parapets_and_a_deck() {
    let mesh = built(r#"<bridge id="1" s="10" length="20" type="concrete"/>"#);
    assert!(is_closed(&mesh));
    let caster = Caster::new(&mesh);
    let top = |y: f64| caster.below(DVec3::new(20.0, y, 9.0), 20.0).map(|hit| hit.0);
    assert!((top(3.6).expect("a parapet") - 1.0).abs() < 1e-3);
    assert!((top(-5.6).expect("a parapet") - 1.0).abs() < 1e-3);
    assert!((top(0.0).expect("a deck") - -0.05).abs() < 1e-3);
    assert!(top(4.0).is_none() && top(-6.0).is_none());
    assert!(mesh.faces.iter().all(|face| face.tag == Tag::Bridge as u8));
}

#[test]
fn a_guard_rail_has_posts_and_a_wall_has_none() {
    let along = r#"<repeat s="5" length="30" distance="0" tStart="-7" tEnd="-7"/></object>"#;
    let rail =
        built(&format!(r#"<object id="1" type="barrier" subtype="guardRail" s="0" t="0">{along}"#));
    assert!(is_closed(&rail));
    let lowest = |mesh: &Mesh, x: f64| {
        let near = mesh.positions.iter().filter(|at| (f64::from(at[0]) - x).abs() < 0.01);
        near.map(|at| at[2]).fold(f32::INFINITY, f32::min)
    };
    assert!((lowest(&rail, 15.0) - 0.44).abs() < 1e-3, "{}", lowest(&rail, 15.0));
    assert!(rail.faces.iter().all(|face| face.tag == Tag::GuardRail as u8));
    let wall = built(&format!(
        r#"<object id="1" type="barrier" name="wall" height="3" s="0" t="0">{along}"#
    ));
    assert!(is_closed(&wall));
    let (top, triangle) =
        Caster::new(&wall).below(DVec3::new(20.0, -7.0, 9.0), 20.0).expect("a wall");
    assert!((top - 3.0).abs() < 1e-3 && tag(&wall, triangle) == Some(Tag::Wall));
    // A tree is not a structure.
    assert!(
        built(&format!(r#"<object id="1" type="tree" s="0" t="0">{along}"#)).triangles.is_empty()
    );
}

#[test]
fn no_structure_stands_on_another_road() {
    // A wall along the first road's end, over the second one's lanes.
    let mesh = built(
        r#"<object id="1" type="wall" s="0" t="0"><repeat s="40" length="10" distance="0" tStart="-3" tEnd="-3"/></object>"#,
    );
    assert!(!mesh.triangles.is_empty());
    let text = text(JOINED).replacen("</road>", r#"<objects><object id="1" type="wall" s="0" t="0"><repeat s="0" length="50" distance="0" tStart="-9" tEnd="-9"/></object></objects></road>
<road name="side" length="30" id="7" junction="-1"><planView><geometry s="0" x="25" y="-5" hdg="-1.5707963267948966" length="30"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0"/></center><right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>"#, 1);
    let crossed = together(&structures(&Network::parse(&text).expect("a valid map")));
    assert!(is_closed(&crossed));
    let caster = Caster::new(&crossed);
    let stands = |x: f64| caster.below(DVec3::new(x, -9.0, 9.0), 20.0).is_some();
    assert!(stands(10.0) && stands(40.0));
    assert!(!stands(22.5) && !stands(24.5));
}

/// Returns whether a place lies in one of the solid boxes.
pub(super) fn is_solid(things: &[Structure], at: DVec3) -> bool {
    things.iter().flat_map(|one| &one.solids).any(|solid| {
        let offset = at - solid.center;
        let (sin, cos) = solid.yaw_rad.sin_cos();
        let along = offset.x * cos + offset.y * sin;
        let own = DVec3::new(along, offset.y * cos - offset.x * sin, offset.z);
        own.abs().cmple(solid.half_extents_m).all()
    })
}

#[test]
fn structures_are_solid_exactly_where_they_are_visible() {
    let along = r#"<repeat s="5" length="30" distance="0" tStart="-7" tEnd="-7"/></object>"#;
    let rail = format!(r#"<object id="1" type="barrier" subtype="guardRail" s="0" t="0">{along}"#);
    let rail = things(&rail);
    for step in 0..=29 {
        let x = 5.5 + f64::from(step);
        // Below the beam as well, from the ground up.
        for z in [0.05, 0.3, 0.7] {
            assert!(is_solid(&rail, DVec3::new(x, -7.0, z)), "{x} {z}");
        }
        assert!(!is_solid(&rail, DVec3::new(x, -7.0, 0.9)), "{x} over it");
        assert!(!is_solid(&rail, DVec3::new(x, -6.7, 0.5)), "{x} beside it");
    }
    assert!(!is_solid(&rail, DVec3::new(4.5, -7.0, 0.5)));
    // A straight rail needs few boxes.
    assert!(rail.iter().map(|one| one.solids.len()).sum::<usize>() <= 3);

    let tunnel = things(r#"<tunnel id="1" s="10" length="20" type="standard"/>"#);
    assert!(is_solid(&tunnel, DVec3::new(20.0, 4.2, 1.0)), "its left wall");
    assert!(is_solid(&tunnel, DVec3::new(20.0, -6.2, 1.0)), "its right wall");
    assert!(!is_solid(&tunnel, DVec3::new(20.0, 3.8, 1.0)) && !is_solid(&tunnel, DVec3::Z));

    let bridge = things(r#"<bridge id="1" s="10" length="20" type="concrete"/>"#);
    assert!(is_solid(&bridge, DVec3::new(20.0, 3.6, 0.5)), "its parapet");
    assert!(!is_solid(&bridge, DVec3::new(20.0, 3.4, 0.5)) && !is_solid(&bridge, DVec3::Z));
    let decks: Vec<_> = bridge.iter().filter(|one| one.is_ground).collect();
    assert!(decks.len() == 1 && decks[0].solids.is_empty());
}
