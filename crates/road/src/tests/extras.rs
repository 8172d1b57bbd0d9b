//! Elements that few files contain: one small map for each.

use glam::DVec3;

use super::small::{JOINED, text};
use crate::{JunctionKind, MarkColor, Network, Owner};

/// Returns the small map with `inside` at the end of its first road.
fn with(inside: &str) -> Network {
    let text = text(JOINED).replacen("</road>", &format!("{inside}</road>"), 1);
    Network::parse(&text).expect("a valid map")
}

/// Returns the small map with `beside` after its roads.
fn beside(beside: &str) -> Network {
    let text = text(JOINED).replace("</OpenDRIVE>", &format!("{beside}</OpenDRIVE>"));
    Network::parse(&text).expect("a valid map")
}

#[test]
fn repetitions_change_their_size_and_place() {
    let network = with(
        r#"<objects><object id="1" type="pole" s="0" t="0" height="2" width="0.4">
<repeat s="10" length="20" distance="5" tStart="-4" tEnd="-8" widthStart="0.2" widthEnd="0.6" heightStart="1" heightEnd="3"/>
</object></objects>"#,
    );
    let object = &network.objects()[0];
    assert_eq!(object.places.len(), 5);
    assert!(object.runs.is_empty());
    let middle = object.places[2];
    assert!(middle.position.distance(DVec3::new(20.0, -6.0, 0.0)) < 1e-9, "{middle:?}");
    assert!((middle.width_m - 0.4).abs() < 1e-9 && (middle.height_m - 2.0).abs() < 1e-9);
    assert!((object.places[4].height_m - 3.0).abs() < 1e-9);
}

#[test]
fn a_repetition_without_distance_is_continuous() {
    let network = with(
        r#"<objects><object id="1" type="barrier" s="0" t="-6" height="0.8" width="0.1">
<repeat s="0" length="9" distance="0" tStart="-6" tEnd="-6" heightEnd="0.5" heightStart="0.8"/></object></objects>"#,
    );
    let object = &network.objects()[0];
    let run = &object.runs[0];
    assert_eq!(run.len(), 6);
    assert!(run.windows(2).all(|pair| pair[0].position.distance(pair[1].position) <= 2.0));
    assert_eq!(object.places, [run[0], run[5]]);
    assert!((run[5].height_m - 0.5).abs() < 1e-9 && (run[5].width_m - 0.1).abs() < 1e-9);
}

#[test]
fn markings_borders_and_validity_of_objects_are_kept() {
    let network = with(
        r#"<objects><object id="7" type="parkingSpace" subtype="street" dynamic="yes" s="5" t="-8" length="5" width="2">
<validity fromLane="-2" toLane="-1"/><parkingSpace access="women"/>
<outlines><outline id="0"><cornerLocal id="4" u="0" v="0" z="0"/><cornerLocal id="6" u="5" v="0" z="0"/><cornerLocal id="9" u="5" v="2" z="0"/></outline></outlines>
<markings><marking side="left" color="yellow" weight="bold" lineLength="0.5" spaceLength="0.3" startOffset="0.1" stopOffset="0.2" zOffset="0.005"><cornerReference id="4"/><cornerReference id="6"/></marking></markings>
<borders><border type="curb" width="0.15" outlineId="0" useCompleteOutline="true"/></borders></object></objects>"#,
    );
    let object = &network.objects()[0];
    assert_eq!((object.subtype.as_str(), object.dynamic), ("street", true));
    assert_eq!(object.validity, [(-2, -1)]);
    assert_eq!(object.parking.as_deref(), Some("women"));
    assert_eq!(object.corner_ids, [[4, 6, 9]]);
    let marking = &object.markings[0];
    assert_eq!(
        (marking.side.as_str(), marking.color, marking.bold),
        ("left", MarkColor::Yellow, true)
    );
    assert_eq!((marking.length_m, marking.space_m, marking.width_m), (0.5, 0.3, 0.25));
    assert_eq!(marking.corners, [4, 6]);
    let border = &object.borders[0];
    assert_eq!((border.kind.as_str(), border.width_m, border.is_complete), ("curb", 0.15, true));
}

#[test]
fn an_object_may_apply_to_other_roads() {
    let network = with(
        r#"<objects><object id="7" type="building" s="5" t="-8"/><objectReference id="7" s="9" t="-3" zOffset="1" validLength="4" orientation="+"><validity fromLane="1" toLane="1"/></objectReference><objectReference id="8" s="0" t="0"/></objects>"#,
    );
    let [reference] = network.object_references() else { panic!("one reference") };
    assert_eq!((reference.object, reference.road, reference.s), (0, 0, 9.0));
    assert_eq!((reference.valid_length_m, reference.validity.as_slice()), (4.0, &[(1, 1)][..]));
    assert!(network.findings()[0].reason.contains("object 8, which does not exist"));
}

#[test]
fn bridges_and_tunnels_keep_their_lanes_and_light() {
    let network = with(
        r#"<objects><tunnel id="1" name="t" type="underpass" s="5" length="20" lighting="0.4" daylight="0.1"><validity fromLane="-1" toLane="1"/></tunnel><bridge id="2" type="steel" s="30" length="9"/></objects>"#,
    );
    let [tunnel, bridge] = network.spans() else { panic!("two spans") };
    assert!(tunnel.is_tunnel && !bridge.is_tunnel);
    assert_eq!((tunnel.lighting, tunnel.daylight), (Some(0.4), Some(0.1)));
    assert_eq!(tunnel.validity, [(-1, 1)]);
    assert_eq!((bridge.s, bridge.length_m, bridge.lighting), (30.0, 9.0, None));
}

#[test]
fn signals_refer_to_what_belongs_to_them() {
    let network = with(
        r#"<signals><signal id="1" s="5" t="-8" type="206"><reference elementType="object" elementId="9" type="stopLine"/></signal></signals>"#,
    );
    let reference = &network.signals()[0].references[0];
    assert_eq!((reference.element.as_str(), reference.id.as_str()), ("object", "9"));
    assert_eq!(reference.kind, "stopLine");
}

#[test]
fn junctions_have_priorities_groups_and_virtual_joints() {
    let network = beside(
        r#"<junction id="5" type="virtual" mainRoad="1" sStart="10" sEnd="20" orientation="+">
<connection id="0" type="virtual"><predecessor elementType="road" elementId="1" elementS="12" elementDir="+"/><successor elementType="road" elementId="2" elementS="3" elementDir="-"/></connection>
<connection id="1" incomingRoad="1" connectingRoad="2" contactPoint="start"><predecessor elementType="road" elementId="1" elementS="14" elementDir="-"/><laneLink from="-1" to="-1"/></connection>
<priority high="1" low="2"/></junction>
<junctionGroup id="3" name="ring" type="roundabout"><junctionReference junction="5"/><junctionReference junction="6"/></junctionGroup>"#,
    );
    let junction = &network.junctions()[0];
    assert_eq!(
        (junction.kind, junction.priorities.as_slice()),
        (JunctionKind::Virtual, &[(0, 1)][..])
    );
    let joint = junction.connections[0].predecessor.expect("a joint");
    assert_eq!((joint.road, joint.s, joint.forward), (0, 14.0, false));
    assert_eq!(junction.connections[0].successor, None);
    let group = &network.junction_groups()[0];
    assert_eq!((group.kind.as_str(), group.junctions.as_slice()), ("roundabout", &[0][..]));
    let reason = |what: &str| network.findings().iter().any(|found| found.reason.contains(what));
    assert!(reason("junction 6, which does not exist"), "{:?}", network.findings());
}

#[test]
fn rules_of_lanes_and_swaying_marks_are_kept() {
    let rules = r#"<rule sOffset="20" value="no stopping"/><rule sOffset="0" value="bus only"/><roadMark sOffset="0" type="solid"><sway ds="0" a="0.1" b="0.01" c="0" d="0"/><sway ds="9" a="0.2" b="0" c="0" d="0"/></roadMark></lane>"#;
    let text = text(JOINED).replacen("</lane>", rules, 1);
    let network = Network::parse(&text).expect("a valid map");
    let lane = network.lane(network.find_lane("1", 0, 1).expect("lane 1"));
    let rules: Vec<_> = lane.rules.iter().map(|rule| (rule.from_m, rule.text.as_str())).collect();
    assert_eq!(rules, [(0.0, "bus only"), (20.0, "no stopping")]);
    assert_eq!(lane.marks[0].sways.len(), 2);
    assert_eq!(lane.marks[0].sways[0].factors, [0.1, 0.01, 0.0, 0.0]);
}

#[test]
fn a_cross_section_surface_lifts_the_road() {
    // A crown: down 2 % to both sides of the middle for 3 m, then a relative strip down 10 %.
    let strip = |id: i32, mode: &str, slope: f64, width: &str| {
        format!(
            r#"<strip id="{id}" mode="{mode}">{width}<linear><coefficients s="0" a="{slope}" b="0" c="0" d="0"/></linear></strip>"#
        )
    };
    let width = r#"<width><coefficients s="0" a="3" b="0" c="0" d="0"/></width>"#;
    let surface = format!(
        r#"</planView><lateralProfile><crossSectionSurface><tOffset><coefficients s="0" a="0.5" b="0" c="0" d="0"/></tOffset><surfaceStrips>{}{}{}</surfaceStrips></crossSectionSurface></lateralProfile>"#,
        strip(1, "independent", -0.02, ""),
        strip(-1, "independent", 0.02, width),
        strip(-2, "relative", 0.1, ""),
    );
    let text = text(JOINED).replacen("</planView>", &surface, 1);
    let network = Network::parse(&text).expect("a valid map");
    let lane = network.find_lane("1", 0, -1).expect("lane -1");
    let height = |offset: f64| network.place_at(lane, 20.0, offset).position.z;
    // The lane's middle lies at t = -1.75, that is 2.25 m right of the crown.
    assert!((height(0.0) - -0.045).abs() < 1e-9, "{}", height(0.0));
    assert!((height(2.25) - 0.0).abs() < 1e-9, "{}", height(2.25));
    let walk = network.find_lane("1", 0, -2).expect("lane -2");
    // The sidewalk's middle lies at t = -4.5: 5 m right of the crown.
    let z = network.place_at(walk, 20.0, 0.0).position.z;
    assert!((z - (-0.06 - 0.2)).abs() < 1e-9, "{z}");
    let mesh = crate::surface_mesh(&network, 2.0);
    let (under, _) =
        super::surface::Caster::new(&mesh).below(DVec3::new(20.0, -1.75, 1.0), 2.0).expect("road");
    assert!((under - -0.045).abs() < 2e-3, "{under}");
}

#[test]
fn user_data_are_kept_with_their_owner() {
    let data = r#"<userData code="a" value="1 &lt; 2"/>"#;
    let text = text(JOINED).replacen("</road>", &format!("{data}</road>"), 1).replace(
        "</OpenDRIVE>",
        r#"<junction id="4"><userData code="b" value=""/></junction><userData code="c" value="z"/><userData><x/></userData></OpenDRIVE>"#,
    );
    let network = Network::parse(&text).expect("a valid map");
    let found: Vec<_> = network
        .user_data()
        .iter()
        .map(|data| (data.owner, data.code.as_str(), data.value.as_str()))
        .collect();
    assert_eq!(
        found,
        [(Owner::Road(0), "a", "1 < 2"), (Owner::Junction(0), "b", ""), (Owner::Map, "c", "z")]
    );
}

#[test]
fn an_include_is_reported_and_not_read() {
    let network = beside(r#"<include file="more.xodr"/>"#);
    let reason = &network.findings()[0].reason;
    assert!(reason.contains("unsupported <include> of \"more.xodr\""), "{reason}");
}

#[test]
fn switches_of_a_railway_are_kept() {
    let network = with(
        r#"<railroad><switch name="w" id="3" position="dynamic"><mainTrack id="1" s="12" dir="+"/><sideTrack id="2" s="4" dir="-"/><partner id="5"/></switch></railroad>"#,
    );
    let switch = &network.roads()[0].switches[0];
    assert_eq!((switch.id.as_str(), switch.position.as_str(), switch.s), ("3", "dynamic", 12.0));
    assert_eq!(switch.side_track, ("2".to_string(), 4.0));
}

#[test]
fn the_license_of_a_map_is_kept() {
    let text = text(JOINED).replace(
        r#"name="small"/>"#,
        r#"name="small"><license name="CC-BY-4.0" spdxid="CC-BY-4.0"/></header>"#,
    );
    assert_eq!(Network::parse(&text).expect("a map").header().license, "CC-BY-4.0");
}
