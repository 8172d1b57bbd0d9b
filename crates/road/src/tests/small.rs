//! A map small enough to be written here, for machines without other maps.

use glam::DVec3;
use mesh::Tag;

use super::surface::Caster;
use crate::{LaneTypes, Network, surface_mesh};

/// Returns a straight and a bend after it, with one lane each way and a sidewalk on the right.
pub(super) fn text(successor: &str) -> String {
    let lanes = |successor: &str, predecessor: &str| {
        let link = format!("<link>{predecessor}{successor}</link>");
        let lane = |id: i32, kind: &str, width: f64| {
            let link = link.replace("ID", &id.to_string());
            format!(
                r#"<lane id="{id}" type="{kind}" level="false">{link}<width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane>"#
            )
        };
        format!(
            r#"<lanes><laneSection s="0"><left>{}</left><center><lane id="0" type="none" level="false"/></center><right>{}{}</right></laneSection></lanes>"#,
            lane(1, "driving", 3.5),
            lane(-1, "driving", 3.5),
            lane(-2, "sidewalk", 2.0),
        )
    };
    format!(
        r#"<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="4" name="small"/>
<road name="straight" length="50" id="1" junction="-1">
<link><successor elementType="road" elementId="2" contactPoint="start"/></link>
<planView><geometry s="0" x="0" y="0" hdg="0" length="50"><line/></geometry></planView>
{}</road>
<road name="bend" length="40" id="2" junction="-1">
<link><predecessor elementType="road" elementId="1" contactPoint="end"/></link>
<planView><geometry s="0" x="50" y="0" hdg="0" length="40"><arc curvature="0.02"/></geometry></planView>
{}</road></OpenDRIVE>"#,
        lanes(successor, ""),
        lanes("", r#"<predecessor id="ID"/>"#),
    )
}

pub(super) const JOINED: &str = r#"<successor id="ID"/>"#;

#[test]
fn lanes_lie_as_in_the_file_and_are_connected() {
    let network = Network::parse(&text(JOINED)).expect("a valid map");
    assert!(network.findings().is_empty(), "{:?}", network.findings());
    let right = network.find_lane("1", 0, -1).expect("lane -1");
    let left = network.find_lane("1", 0, 1).expect("lane 1");
    let pose = network.place_at(right, 10.0, 0.0);
    let here = network.to_projected(pose.position);
    assert!(here.distance(DVec3::new(10.0, -1.75, 0.0)) < 1e-9, "{here}");
    let pose = network.place_at(left, 10.0, 0.0);
    let here = network.to_projected(pose.position);
    assert!(here.distance(DVec3::new(40.0, 1.75, 0.0)) < 1e-9, "{here}");
    assert!((pose.heading_rad.abs() - std::f64::consts::PI).abs() < 1e-9);
    let bend = network.find_lane("2", 0, -1).expect("lane -1 of the bend");
    assert_eq!(network.lane(right).successors, [bend]);
    let bent = network.find_lane("2", 0, 1).expect("lane 1 of the bend");
    assert_eq!(network.lane(left).predecessors, [bent]);
    // The right lane of a left bend of radius 50 m runs at 51.75 m.
    let curvature = network.place_at(bend, 20.0, 0.0).curvature_per_m;
    assert!((curvature - 1.0 / 51.75).abs() < 1e-9, "{curvature}");
}

#[test]
fn nearest_finds_the_lane_below() {
    let network = Network::parse(&text(JOINED)).expect("a valid map");
    for lane in network.lanes().iter().filter(|lane| LaneTypes::DRIVING.contains(lane.kind)) {
        for along_m in [0.5, 13.0, lane.length_m - 0.5] {
            let point = network.place_at(lane.index, along_m, 0.4).position;
            let found = network.nearest(point, LaneTypes::DRIVING).expect("a lane");
            assert_eq!(found.lane, lane.index);
            assert!((found.along_m - along_m).abs() < 1e-3, "{} {along_m}", found.along_m);
        }
    }
}

#[test]
fn the_surface_is_closed_and_sidewalks_are_raised() {
    let network = Network::parse(&text(JOINED)).expect("a valid map");
    let mesh = surface_mesh(&network, 5.0);
    let caster = Caster::new(&mesh);
    for lane in network.lanes() {
        let (tag, up) = match LaneTypes::DRIVING.contains(lane.kind) {
            true => (Tag::Roads, 0.0),
            false => (Tag::SideWalks, 0.12),
        };
        for step in 0..1000 {
            let along_m = lane.length_m * (f64::from(step) + 0.5) / 1000.0;
            let point = network.place_at(lane.index, along_m, 0.3).position;
            let (z, triangle) = caster.below(point + DVec3::Z, 3.0).expect("a surface");
            assert!((z - point.z - up).abs() < 0.005, "{z} at {point}");
            assert_eq!(Tag::from_code(mesh.faces[triangle].tag), Some(tag), "at {point}");
        }
    }
}

#[test]
fn triangles_of_a_lane_begin_with_an_edge_along_it() {
    let network = Network::parse(&text(JOINED)).expect("a valid map");
    let mesh = surface_mesh(&network, 5.0);
    let mut area = 0.0;
    for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
        let [a, b, c] =
            corners.map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
        let (along, across) = (b - a, c - a);
        let width = along.cross(across).length() / along.length();
        if face.material != mesh::Material::Asphalt as u8 || width < 2.2 {
            continue;
        }
        assert!(face.tint != 0, "outside of junctions the asphalt of a road has an age");
        let near = network.nearest((a + b + c) / 3.0, LaneTypes::DRIVING).expect("a lane");
        let ahead = network.place(near).rotation() * DVec3::X;
        let cosine = ahead.dot(along.normalize_or_zero()).abs();
        assert!(cosine > 0.99, "{cosine} at {a}");
        area += along.cross(across).length() * 0.5;
    }
    let lanes = network.lanes().iter().filter(|lane| LaneTypes::DRIVING.contains(lane.kind));
    let long: f64 = lanes.map(|lane| lane.length_m).sum();
    assert!(area > long * 2.5, "{area} square metres on {long} m");
}

#[test]
fn asphalt_where_vehicles_wait_for_a_junction_has_a_bluer_tint() {
    let text = text(JOINED)
        .replace(r#"id="2" junction="-1""#, r#"id="2" junction="7""#)
        .replace("</OpenDRIVE>", r#"<junction id="7" name="end"></junction></OpenDRIVE>"#);
    let network = Network::parse(&text).expect("a valid map");
    let mesh = surface_mesh(&network, 4.0);
    let mut seen = [false; 4];
    for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
        let points =
            corners.map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
        let middle = (points[0] + points[1] + points[2]) / 3.0;
        // The straight before its end, where strips continue below the next surface.
        if face.material != mesh::Material::Asphalt as u8 || face.tint == 0 || middle.x > 49.9 {
            continue;
        }
        let oil = (face.tint & 31) - (face.tint >> 11);
        seen[usize::from(oil)] = true;
        let leads_there = middle.y < 0.0;
        let wanted = if leads_there && middle.x > 46.0 { 3..=3 } else { 0..=3 };
        assert!(wanted.contains(&oil), "{oil} at {middle}");
        let is_free = !leads_there || middle.x < 36.0;
        assert!(!is_free || oil == 0, "{oil} at {middle}");
    }
    assert_eq!(seen, [true; 4]);
}

#[test]
fn a_broken_file_is_rejected_with_its_line() {
    let whole = text(JOINED);
    let cut = Network::parse(&whole[..whole.len() / 2]).expect_err("half a map");
    assert!(cut.line > 1 && !cut.reason.is_empty(), "{cut}");
    let other = Network::parse("<scene/>").expect_err("no map");
    assert_eq!(other.to_string(), "line 1: the root element is <scene>, not <OpenDRIVE>");
    let length = Network::parse(&whole.replace(r#"length="40" id"#, r#"length="wide" id"#));
    assert_eq!(length.expect_err("no number").line, 7);
}

/// A single road with one geometry and lane sections that begin at `sections`.
fn one_road(length: f64, shape: &str, sections: &[f64]) -> String {
    let lane = r#"<lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>"#;
    let center = r#"<center><lane id="0" type="none" level="false"/></center>"#;
    let section =
        |s: &f64| format!(r#"<laneSection s="{s}">{center}<right>{lane}</right></laneSection>"#);
    let sections: String = sections.iter().map(section).collect();
    format!(
        r#"<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="4" name="one"/>
<road name="" length="{length}" id="1" junction="-1">
<planView><geometry s="0" x="0" y="0" hdg="0" length="{length}">{shape}</geometry></planView>
<lanes>{sections}</lanes></road></OpenDRIVE>"#
    )
}

#[test]
fn numbers_that_make_a_short_file_a_huge_map_are_rejected() {
    let reject = |length, shape| {
        let error = Network::parse(&one_road(length, shape, &[0.0])).expect_err(shape);
        assert_eq!(error.line, 3, "{error}");
        error.reason
    };
    let long = reject(1e6, "<line/>");
    assert_eq!(long, "road 1 is 1000000 m long; lengths from 0 to 100000 are allowed");
    let wound = reject(9e4, r#"<spiral curvStart="0" curvEnd="0.1"/>"#);
    assert_eq!(wound, "road 1 turns by 257831 degrees in all; at most 18000 are allowed");
    reject(9e4, r#"<arc curvature="-0.05"/>"#);
    reject(9e4, r#"<spiral curvStart="0.1" curvEnd="-0.1"/>"#);
    let helix = one_road(2000.0, r#"<arc curvature="0.1"/>"#, &[0.0]);
    assert!(Network::parse(&helix).is_ok(), "a helix of a car park");
}

#[test]
fn lane_sections_beyond_the_end_of_their_road_are_left_out() {
    let network = Network::parse(&one_road(100.0, "<line/>", &[0.0, 60.0, 1e6])).expect("a map");
    let lengths: Vec<f64> = network.lanes().iter().map(|lane| lane.length_m).collect();
    assert_eq!(lengths, [60.0, 40.0]);
    let said = network.findings()[0].to_string();
    assert!(said.contains("begins at s 1000000, but the road ends at 100"), "{said}");
    assert!(network.spawn_points().len() < 12);
}

#[test]
fn a_map_that_spans_more_than_any_road_is_refused() {
    let far = text(JOINED).replacen("x=\"50\" y=\"0\"", "x=\"5e6\" y=\"0\"", 1);
    let reason = |text: &str| Network::parse(text).map(|_| ()).unwrap_err().reason;
    let error = reason(&far);
    assert!(error.starts_with("the lanes of the map span 5000"), "{error}");
}

#[test]
fn a_lane_that_becomes_wider_or_higher_than_any_is_refused() {
    let refusal = |text: &str| Network::parse(text).map(|_| ()).unwrap_err();
    let width = r#"a="3.5" b="0" c="0" d="0""#;
    for wrong in [r#"a="3.5" b="0" c="0" d="1""#, r#"a="3.5" b="0" c="2" d="0""#] {
        let error = refusal(&text(JOINED).replacen(width, wrong, 1));
        assert!(error.reason.contains("m wide; at most 200 m are allowed"), "{error}");
    }
    let steep = |d: f64| {
        let profile = format!(
            r#"<elevationProfile><elevation s="0" a="0" b="0" c="0" d="{d}"/></elevationProfile><lanes>"#
        );
        text(JOINED).replacen("<lanes>", &profile, 1)
    };
    let error = refusal(&steep(1.0));
    assert!(error.reason.contains("at most 10000 m are allowed"), "{error}");
    assert!(Network::parse(&steep(1e-4)).is_ok(), "a hill");
}
