//! Texts without lane sections shorter than a millimetre.

use super::shared_maps;
use crate::{Network, repair};

const LINE: &str = r#"<geometry s="0" x="3" y="4" hdg="0.5" length="50"><line/></geometry>"#;

fn file(length: f64, geometry: &str, lanes: &str) -> String {
    format!(
        r#"<OpenDRIVE><header revMajor="1" revMinor="6"/><road id="7" length="{length}" junction="-1"><planView>{geometry}</planView><lanes>{lanes}</lanes></road></OpenDRIVE>"#
    )
}

fn section(s: f64, lanes: &str) -> String {
    format!(
        r#"<laneSection s="{s}"><center><lane id="0" type="none"/></center><right>{lanes}</right></laneSection>"#
    )
}

fn lane(id: i32, before: i32, after: i32, width: &str) -> String {
    format!(
        r#"<lane id="{id}" type="driving"><link><predecessor id="{before}"/><successor id="{after}"/></link><width sOffset="0" {width}/></lane>"#
    )
}

const WIDTH: &str = r#"a="3.5" b="0" c="0" d="0""#;

/// Checks that no section is shorter than a millimetre, that links are the same and that no point has
/// moved by more than a millimetre, or half as much more on the outside of a curve.
fn check(name: &str, text: &str, repaired: &str) {
    let (before, after) = (Network::parse(text).unwrap(), Network::parse(repaired).unwrap());
    assert_eq!(before.lanes().len(), after.lanes().len(), "{name}");
    for (old, new) in before.lanes().iter().zip(after.lanes()) {
        let what =
            format!("{name}: lane {} of road {}", old.id, before.roads()[old.road as usize].id);
        assert!(new.length_m > 0.999e-3, "{what} is {} m long", new.length_m);
        assert_eq!(
            (&old.successors, &old.predecessors),
            (&new.successors, &new.predecessors),
            "{what}"
        );
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let was = before.place_at(old.index, share * old.length_m, 0.0).position;
            let is = after.place_at(new.index, share * new.length_m, 0.0).position;
            assert!(is.distance(was) < 1.5e-3, "{what}: {was} is now {is}");
        }
    }
    assert_eq!(repair(repaired).unwrap(), None, "{name}: a repaired text needs no repair");
}

#[test]
fn short_sections_within_a_road_take_a_millimetre_of_the_one_before() {
    let same = |s: f64, width: &str| section(s, &lane(-1, -1, -1, width));
    // The width would grow by 9 mm over a millimetre.
    let steep = r#"a="3.5" b="9" c="0" d="0""#;
    let lanes =
        [same(0.0, WIDTH), same(20.0, steep), same(20.000_06, r#"a="3.5" b="0.01" c="0" d="0""#)];
    let text = file(50.0, LINE, &lanes.concat());
    let repaired = repair(&text).unwrap().unwrap();
    assert_eq!((repaired.sections, repaired.lanes), (1, 0));
    check("within", &text, &repaired.text);
}

#[test]
fn short_sections_at_the_start_of_a_road_take_a_millimetre_of_the_next_one_and_its_offset() {
    let first = lane(-1, -1, 0, WIDTH) + &lane(-2, -2, -1, WIDTH);
    let offsets = r#"<laneOffset s="0" a="3.5" b="0" c="0" d="0"/><laneOffset s="0.0000045" a="0" b="0.001" c="0" d="0"/>"#;
    let lanes = offsets.to_owned()
        + &section(0.0, &first)
        + &section(0.000_004_5, &lane(-1, -2, -1, WIDTH));
    let text = file(50.0, LINE, &lanes);
    let repaired = repair(&text).unwrap().unwrap();
    assert_eq!((repaired.sections, repaired.lanes), (1, 0));
    check("start", &text, &repaired.text);
}

#[test]
fn short_roads_are_lengthened() {
    let cubic = r#"<geometry s="0" x="3" y="4" hdg="0.5" length="2e-7"><paramPoly3 pRange="normalized" aU="0" bU="2e-7" cU="0" dU="0" aV="0" bV="0" cV="1e-12" dV="0"/></geometry>"#;
    let line = r#"<geometry s="0" x="3" y="4" hdg="0.5" length="2e-7"><line/></geometry>"#;
    for geometry in [cubic, line] {
        let text = file(2e-7, geometry, &section(0.0, &lane(-1, -1, -1, WIDTH)));
        let repaired = repair(&text).unwrap().unwrap();
        assert_eq!((repaired.sections, repaired.lanes), (1, 0));
        check(geometry, &text, &repaired.text);
        let network = Network::parse(&repaired.text).unwrap();
        let [lane] = network.lanes() else { panic!("one lane") };
        let at = |along_m: f64| network.place_at(lane.index, along_m, 0.0).position;
        assert!((at(lane.length_m).distance(at(0.0)) - 1e-3).abs() < 1e-5, "{geometry}");
    }
}

#[test]
fn short_driving_lanes_without_links_lose_their_type() {
    let alone =
        r#"<lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>"#;
    let line = r#"<geometry s="0" x="3" y="4" hdg="0.5" length="0.0013"><line/></geometry>"#;
    let repaired = repair(&file(0.0013, line, &section(0.0, alone))).unwrap().unwrap();
    assert_eq!((repaired.sections, repaired.lanes), (0, 1));
    assert!(repaired.text.contains(r#"<lane id="-1" type="none">"#), "{}", repaired.text);
    assert_eq!(repair(&file(50.0, LINE, &section(0.0, alone))).unwrap(), None);
}

#[test]
fn the_shared_maps_are_repaired_within_a_millimetre() {
    for (name, text) in shared_maps() {
        if let Some(repaired) = repair(&text).unwrap() {
            println!("{name}: {} sections, {} lanes", repaired.sections, repaired.lanes);
            check(&name, &text, &repaired.text);
        }
    }
}
