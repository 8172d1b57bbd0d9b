//! Waypoints, routes, landmarks and places on Earth.

use glam::DVec3;

use super::{
    shared_maps,
    small::{JOINED, text},
};
use crate::{CarlaMercator, GeoPoint, LanePoint, LaneTypes, Network, TransverseMercator};

fn small() -> Network {
    Network::parse(&text(JOINED)).expect("a valid map")
}

/// A road of two lanes each way with broken lines, 100 m, in two sections, and a signal.
fn wide() -> Network {
    let lane = |id: i32, mark: &str| {
        format!(
            r#"<lane id="{id}" type="driving"><link><predecessor id="{id}"/><successor id="{id}"/></link><width sOffset="0" a="3" b="0" c="0" d="0"/><roadMark sOffset="0" type="{mark}" color="white" laneChange="both"/></lane>"#
        )
    };
    let section = |s: f64| {
        format!(
            r#"<laneSection s="{s}"><left>{}{}</left><center><lane id="0" type="none"><roadMark sOffset="0" type="solid" color="yellow" laneChange="none"/></lane></center><right>{}{}</right></laneSection>"#,
            lane(2, "solid"),
            lane(1, "broken"),
            lane(-1, "broken"),
            lane(-2, "solid"),
        )
    };
    Network::parse(&format!(
        r#"<OpenDRIVE><header revMajor="1" revMinor="4"/><road name="" length="100" id="7" junction="-1">
<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
<lanes>{}{}</lanes>
<signals><signal id="3" s="70" t="-8" dynamic="yes" orientation="+" zOffset="4" type="1000001" subtype="-1"/></signals>
</road></OpenDRIVE>"#,
        section(0.0),
        section(40.0)
    ))
    .expect("a valid map")
}

#[test]
fn waypoint_ids_equal_those_of_carla() {
    // Values of carla 0.9.16 for road 253, section 0, lane -1, s 12 of its Town01.
    let network =
        Network::parse(&text(JOINED).replace("\"1\" junction", "\"253\" junction")).expect("a map");
    let at = network.lane_point("253", -1, 12.0).expect("a lane");
    assert_eq!(network.waypoint_id(at), 1_933_706_114_412_182_501);
}

#[test]
fn every_lane_has_a_waypoint_at_every_step() {
    let network = wide();
    let points = network.waypoints(10.0, LaneTypes::DRIVING);
    assert_eq!(points.len(), 40);
    let at_40 = network.find_lane("7", 1, -2).expect("a lane");
    assert!(points.contains(&LanePoint { lane: at_40, along_m: 0.0 }));
    assert!(network.waypoints(0.0, LaneTypes::ANY).is_empty());
    assert!(network.waypoints(f64::NAN, LaneTypes::ANY).is_empty());
}

#[test]
fn markings_refer_to_the_driving_direction() {
    let network = wide();
    for (lane, left, right) in [(-1, false, true), (-2, true, true), (1, false, true)] {
        let at = network.lane_point("7", lane, 10.0).expect("a lane");
        let marks = network.marks(at);
        assert_eq!((marks.left_change, marks.right_change), (left, right), "lane {lane}");
    }
    let inner = network.marks(network.lane_point("7", -1, 10.0).expect("a lane"));
    assert_eq!(inner.left.map(|mark| mark.kind), Some(crate::MarkKind::Solid));
    assert_eq!(inner.right.map(|mark| mark.kind), Some(crate::MarkKind::Broken));
}

#[test]
fn the_rest_of_a_lane_ends_where_the_road_does() {
    let network = wide();
    let at = network.lane_point("7", -1, 5.0).expect("a lane");
    let points = network.advance_to_end(at, 30.0);
    let s: Vec<f64> = points.iter().map(|at| network.road_space(*at).3).collect();
    assert_eq!(s, [35.0, 65.0, 95.0, 100.0]);
    let back = network.retreat_to_start(at, 3.0);
    let s: Vec<f64> = back.iter().map(|at| network.road_space(*at).3).collect();
    assert_eq!(s, [2.0, 0.0]);
}

#[test]
fn a_route_changes_lanes_to_a_goal_beside_it() {
    let network = wide();
    let from = network.lane_point("7", -1, 10.0).expect("a lane");
    let to = network.lane_point("7", -2, 90.0).expect("a lane");
    let route = network.route(from, to).expect("a way");
    assert!((route.length_m - 80.0).abs() < 1e-9);
    assert_eq!(route.legs.iter().filter(|leg| leg.changes).count(), 1);
    let points = route.points(1.0);
    let first = network.place(points[0]).position;
    let last = network.place(points[points.len() - 1]).position;
    assert!(first.distance(network.place(from).position) < 1e-9);
    assert!(last.distance(network.place(to).position) < 1e-9);
    // Not backwards, and not over the solid line to the other side.
    assert!(network.route(to, from).is_none());
    let other_side = network.lane_point("7", 1, 50.0).expect("a lane");
    assert!(network.route(from, other_side).is_none());
}

#[test]
fn a_route_is_no_longer_than_any_walk() {
    for (name, text) in shared_maps().into_iter().filter(|(name, _)| name.contains("Town0")) {
        let network = Network::parse(&text).expect("a map that loads");
        let starts = network.spawn_points();
        for at in starts.iter().step_by(starts.len() / 20 + 1) {
            for ahead in network.advance(*at, 150.0).iter().take(4) {
                let route = network.route(*at, *ahead).expect("the walk found a way");
                assert!(route.length_m <= 150.0 + 1e-6, "{name}: {}", route.length_m);
            }
        }
    }
}

#[test]
fn a_landmark_ahead_is_found_from_the_lanes_that_it_applies_to() {
    let network = wide();
    let at = network.lane_point("7", -2, 10.0).expect("a lane");
    let seen = network.landmarks_ahead(at, 100.0, false);
    assert_eq!(seen.len(), 1);
    assert!((seen[0].distance_m - 60.0).abs() < 1e-9);
    assert!(network.landmarks_ahead(at, 50.0, false).is_empty());
    let oncoming = network.lane_point("7", 1, 90.0).expect("a lane");
    assert!(network.landmarks_ahead(oncoming, 100.0, false).is_empty());
    assert_eq!(network.landmarks().count(), 1);
}

#[test]
fn transverse_mercator_is_invertible_and_measures_the_meridian() {
    let utm = TransverseMercator::from_proj("+proj=utm +zone=32 +datum=WGS84").expect("UTM");
    for (latitude_deg, longitude_deg) in [(48.0, 11.0), (-33.9, 9.0), (0.0, 6.1), (80.0, 12.0)] {
        let point = GeoPoint { latitude_deg, longitude_deg, altitude_m: 3.0 };
        let (east, north) = utm.project(point);
        let back = utm.unproject(east, north, 3.0);
        assert!((back.latitude_deg - latitude_deg).abs() < 1e-11, "{back:?}");
        assert!((back.longitude_deg - longitude_deg).abs() < 1e-11, "{back:?}");
    }
    // The equator to 45° along the meridian: 4 984 944.378 m on WGS84.
    let plain = TransverseMercator::from_proj("+proj=tmerc +lat_0=0 +lon_0=9").expect("tmerc");
    let (east, north) =
        plain.project(GeoPoint { latitude_deg: 45.0, longitude_deg: 9.0, altitude_m: 0.0 });
    assert!(east.abs() < 1e-9 && (north - 4_984_944.378).abs() < 1e-3, "{east} {north}");
    assert!(TransverseMercator::from_proj("+proj=merc +lon_0=0").is_none());
    assert!(TransverseMercator::from_proj("").is_none());
}

#[test]
fn the_formula_of_carla_gives_its_numbers() {
    // Values of carla 0.9.16 for x 1000, y -2000 with its origin at 49° N 8° E.
    let mercator = CarlaMercator::from_proj("+lat_0=4.9e+1 +lon_0=8.0e+0");
    let point = mercator.unproject(1000.0, -2000.0, 0.0);
    assert!((point.latitude_deg - 48.982_025_694_678_5).abs() < 1e-12, "{point:?}");
    assert!((point.longitude_deg - 8.013_693_136_749_248).abs() < 1e-12, "{point:?}");
    let (x, y) = mercator.project(point);
    assert!((x - 1000.0).abs() < 1e-6 && (y + 2000.0).abs() < 1e-6);
    let lost = CarlaMercator::from_proj("+proj=utm +zone=32");
    assert_eq!((lost.latitude_deg, lost.longitude_deg), (42.0, 2.0));
}

#[test]
fn world_space_to_earth_and_back_is_the_identity() {
    let header = r#"<header revMajor="1" revMinor="4" name="small"><geoReference>+proj=tmerc +lat_0=50 +lon_0=9</geoReference><offset x="1000" y="-500" z="2" hdg="0.3"/></header>"#;
    let text = text(JOINED).replace(r#"<header revMajor="1" revMinor="4" name="small"/>"#, header);
    let network = Network::parse(&text).expect("a valid map");
    let point = DVec3::new(40.0, 30.0, 1.0);
    let geo = network.geo(point).expect("a projection");
    assert!((geo.altitude_m - 3.0).abs() < 1e-9 && (geo.latitude_deg - 50.0).abs() < 0.01);
    assert!(network.from_geo(geo).expect("a projection").distance(point) < 1e-6);
    assert!(small().geo(point).is_none());
}

#[test]
fn no_lane_is_nearer_than_the_nearest_lane() {
    for (name, text) in shared_maps() {
        let network = Network::parse(&text).expect("a map that loads");
        // Every lane's centre, every half metre.
        let mut centres: Vec<DVec3> = Vec::new();
        for at in network.waypoints(0.5, LaneTypes::DRIVING) {
            centres.push(network.place(at).position);
        }
        for (number, centre) in centres.iter().enumerate().step_by(centres.len() / 100 + 1) {
            let turn = DVec3::new((number as f64).sin(), (number as f64).cos(), 0.0);
            let point = *centre + turn * 2.5;
            let Some(found) = network.nearest(point, LaneTypes::DRIVING) else { continue };
            let ours = network.place(found).position.distance(point);
            let best = centres.iter().map(|other| other.distance(point));
            let best = best.fold(f64::INFINITY, f64::min);
            assert!(ours <= best + 1e-3, "{name}: {ours} but {best} at {point}");
        }
    }
}
