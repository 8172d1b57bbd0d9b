//! Objects with outlines, and their paint.

use glam::DVec3;
use mesh::{Material, Mesh, Tag};

use super::{
    small::{JOINED, text},
    structures::{is_closed, is_solid, volume},
    surface::Caster,
};
use crate::{Network, Structure, object_paint, structures};

fn network(objects: &str) -> Network {
    let inside = format!("<objects>{objects}</objects></road>");
    Network::parse(&text(JOINED).replacen("</road>", &inside, 1)).expect("a valid map")
}

fn one(objects: &str) -> Structure {
    let all = structures(&network(objects));
    let [one] = &all[..] else { panic!("{} things", all.len()) };
    one.clone()
}

/// Returns height, tag and material of the topmost face over a place of the first road.
fn top(mesh: &Mesh, x: f64, y: f64) -> Option<(f64, Tag, u8)> {
    let (z, triangle) = Caster::new(mesh).below(DVec3::new(x, y, 50.0), 60.0)?;
    let face = mesh.faces[triangle];
    Some((z, Tag::from_code(face.tag).expect("a tag"), face.material))
}

#[test]
fn an_outline_along_the_road_rises_to_the_height_of_each_corner() {
    let house = one(
        r#"<object id="1" type="building" s="10" t="9"><outlines><outline id="0" closed="true">
<cornerRoad s="10" t="8" dz="0" height="6"/><cornerRoad s="20" t="8" dz="0" height="6"/>
<cornerRoad s="20" t="12" dz="0" height="8"/><cornerRoad s="10" t="12" dz="0" height="8"/></outline></outlines></object>"#,
    );
    assert!(is_closed(&house.mesh));
    // 20 cm of it are in the ground.
    let wanted = 10.0 * 4.0 * 7.2;
    assert!((volume(&house.mesh) - wanted).abs() < 1e-2, "{}", volume(&house.mesh));
    let (z, tag, _) = top(&house.mesh, 15.0, 10.0).expect("a roof");
    assert!((z - 7.0).abs() < 1e-3 && tag == Tag::Building && house.tag == Tag::Building);
    assert_eq!(house.solids.len(), 1, "a rectangle is one box");
    let house = [house];
    assert!(is_solid(&house, DVec3::new(15.0, 10.0, 3.0)));
    assert!(!is_solid(&house, DVec3::new(15.0, 7.8, 3.0)));
    assert!(!is_solid(&house, DVec3::new(9.8, 10.0, 3.0)));
}

#[test]
fn a_concave_outline_is_solid_along_its_sides_only() {
    // Clockwise and L-shaped, about (20, -20).
    let corners = [(0, 0), (0, 8), (4, 8), (4, 4), (8, 4), (8, 0)];
    let corners: String = corners
        .iter()
        .map(|(u, v)| format!(r#"<cornerLocal u="{u}" v="{v}" z="0" height="3"/>"#))
        .collect();
    let body = one(&format!(
        r#"<object id="1" type="obstacle" s="20" t="-20"><outline id="0">{corners}</outline></object>"#
    ));
    assert!(is_closed(&body.mesh));
    assert!((volume(&body.mesh) - 48.0 * 3.2).abs() < 1e-2, "{}", volume(&body.mesh));
    assert!(top(&body.mesh, 22.0, -14.0).is_some() && top(&body.mesh, 26.0, -14.0).is_none());
    let body = [body];
    assert!(is_solid(&body, DVec3::new(20.05, -16.0, 1.0)), "its left side");
    assert!(!is_solid(&body, DVec3::new(26.0, -14.0, 1.0)), "the corner that is missing");
    assert!(!is_solid(&body, DVec3::new(19.9, -16.0, 1.0)));
}

#[test]
fn an_open_outline_is_a_wall_and_a_flat_one_a_patch() {
    let wall = one(
        r#"<object id="1" type="wall" s="0" t="0"><outlines><outline id="0" closed="false">
<cornerRoad s="10" t="9" height="2"/><cornerRoad s="20" t="9" height="2"/><cornerRoad s="20" t="14" height="2"/></outline></outlines></object>"#,
    );
    assert!(is_closed(&wall.mesh) && wall.tag == Tag::Wall);
    assert!(top(&wall.mesh, 15.0, 9.0).is_some_and(|hit| (hit.0 - 2.0).abs() < 1e-3));
    assert!(top(&wall.mesh, 15.0, 11.5).is_none(), "no wall from its end to its beginning");
    assert!(is_solid(&[wall], DVec3::new(20.0, 12.0, 1.0)));
    let patch = |fill: &str| {
        structures(&network(&format!(
            r#"<object id="1" type="none" s="0" t="0"><outlines><outline id="0" {fill}>
<cornerRoad s="10" t="9"/><cornerRoad s="20" t="9"/><cornerRoad s="20" t="14"/></outline></outlines></object>"#
        )))
    };
    let gravel = patch(r#"fillType="gravel""#);
    let [gravel] = &gravel[..] else { panic!("one patch") };
    let (z, _, material) = top(&gravel.mesh, 17.0, 10.0).expect("a patch");
    assert!((z - 0.01).abs() < 1e-3 && material == Material::Soil as u8);
    assert!(gravel.is_ground && gravel.solids.is_empty());
    assert!(patch("").is_empty());
}

#[test]
fn an_outline_is_repeated_with_its_object() {
    let all = structures(&network(
        r#"<object id="1" type="obstacle" s="5" t="-12"><repeat s="5" length="20" distance="10" tStart="-12" tEnd="-12"/>
<outline id="0"><cornerLocal u="-1" v="-1" height="1"/><cornerLocal u="1" v="-1" height="1"/><cornerLocal u="1" v="1" height="1"/><cornerLocal u="-1" v="1" height="1"/></outline></object>"#,
    ));
    assert_eq!(all.len(), 3);
    for x in [5.0, 15.0, 25.0] {
        assert!(is_solid(&all, DVec3::new(x, -12.0, 0.5)), "at {x}");
    }
    assert!(!is_solid(&all, DVec3::new(10.0, -12.0, 0.5)));
}

#[test]
fn markings_are_as_wide_and_broken_as_the_file_says() {
    let paint = object_paint(&network(
        r#"<object id="1" type="parkingSpace" s="20" t="-9"><parkingSpace access="all"/><outlines><outline id="0">
<cornerRoad id="0" s="10" t="-8"/><cornerRoad id="1" s="30" t="-8"/><cornerRoad id="2" s="30" t="-12"/></outline></outlines>
<markings><marking color="yellow" width="0.2" lineLength="2" spaceLength="1" startOffset="0.5" stopOffset="1.5"><cornerReference id="0"/><cornerReference id="1"/></marking></markings></object>"#,
    ));
    for step in 0..400 {
        let x = 10.0 + 0.05 * f64::from(step) + 0.013;
        let wanted = x > 10.5 && x < 28.5 && (x - 10.5).rem_euclid(3.0) < 2.0;
        let hit = top(&paint, x, -8.0);
        assert_eq!(hit.is_some(), wanted, "at {x}");
        if let Some((_, tag, material)) = hit {
            assert!(tag == Tag::RoadLine && material == Material::PaintYellow as u8);
        }
    }
    for step in 0..80 {
        let y = -8.2 + 0.005 * f64::from(step) + 0.002;
        assert_eq!(top(&paint, 11.0, y).is_some(), (y + 8.0).abs() < 0.1, "at {y}");
    }
    assert!(top(&paint, 30.0, -10.0).is_none(), "a side that nobody named");
}

#[test]
fn the_sides_of_a_parking_space_follow_its_heading() {
    // Its front faces the left of the road.
    let paint = object_paint(&network(
        r#"<object id="1" type="parkingSpace" s="20" t="-10" hdg="1.5707963267948966" length="5" width="2.4">
<markings><marking side="left" color="white" width="0.1"/><marking side="front" color="white" width="0.1"/></markings></object>"#,
    ));
    assert!(top(&paint, 18.8, -10.03).is_some() && top(&paint, 21.2, -10.03).is_none());
    assert!(top(&paint, 20.03, -7.5).is_some() && top(&paint, 20.03, -12.5).is_none());
}

#[test]
fn a_crosswalk_has_stripes_along_the_road() {
    let paint = object_paint(&network(
        r#"<object id="1" type="crosswalk" s="20" t="0"><outline><cornerRoad s="18" t="-5"/><cornerRoad s="21" t="-5"/><cornerRoad s="21" t="3"/><cornerRoad s="18" t="3"/><cornerRoad s="18" t="-5"/></outline></object>"#,
    ));
    let painted = |x: f64, y: f64| top(&paint, x, y).is_some();
    let across: Vec<bool> =
        (0..800).map(|k| painted(19.53, -5.0 + 0.01 * f64::from(k) + 0.003)).collect();
    let stripes = across.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    let share = across.iter().filter(|on| **on).count() as f64 / 800.0;
    assert!(stripes == 8 && (0.44..0.5).contains(&share), "{stripes} stripes, {share} painted");
    // From one end of a stripe to the other there is no gap.
    let y = -5.0 + 0.01 * across.iter().position(|on| *on).expect("a stripe") as f64 + 0.1;
    assert!((0..299).all(|k| painted(18.004 + 0.01 * f64::from(k), y)));
    assert!(!painted(17.9, y) && !painted(21.1, y));
}

#[test]
fn a_border_is_a_kerb_along_its_listed_corners() {
    let kerb = one(
        r#"<object id="1" type="none" s="0" t="0"><outlines><outline id="3"><cornerRoad id="0" s="10" t="9"/><cornerRoad id="1" s="20" t="9"/><cornerRoad id="2" s="20" t="14"/></outline></outlines>
<borders><border type="curb" width="0.2" outlineId="3"><cornerReference id="0"/><cornerReference id="1"/></border></borders></object>"#,
    );
    let (z, tag, material) = top(&kerb.mesh, 15.0, 9.05).expect("a kerb");
    assert!((z - 0.1).abs() < 1e-3 && tag == Tag::SideWalks && material == Material::Kerb as u8);
    assert!(is_closed(&kerb.mesh) && top(&kerb.mesh, 20.0, 12.0).is_none());
}
