//! Route files on generated maps.

use std::sync::Arc;

use road::{LaneType, LaneTypes, Network};

use super::{Demand, DemandError, DepartPosition, DepartSpeed, VehicleClass};
use crate::{
    edge::Edge,
    elements::{self, Element},
    way,
};

fn town() -> Arc<Network> {
    let text = mapgen::named("Flatford").expect("a map of the generator");
    Arc::new(Network::parse(&text).expect("generated towns parse"))
}

/// Returns names of edges that follow each other, as netconvert names them.
fn chain(network: &Network, length: usize) -> Vec<String> {
    let name = |edge: &Edge| {
        let sign = if edge.right { "-" } else { "" };
        format!("{sign}{}", network.roads()[edge.road as usize].id)
    };
    let starts = network.lanes().iter().filter(|lane| {
        lane.junction.is_none() && LaneTypes::DRIVABLE.contains(lane.kind) && lane.length_m > 30.0
    });
    for start in starts {
        let mut lane = start;
        let mut names = Vec::new();
        for _ in 0..10 * length {
            let edge = Edge { road: lane.road, right: lane.id < 0, piece: None };
            if lane.junction.is_none() && names.last() != Some(&name(&edge)) {
                names.push(name(&edge));
            }
            let Some(next) = lane.successors.first() else { break };
            lane = network.lane(*next);
            if names.len() == length && lane.junction.is_some() {
                return names;
            }
        }
    }
    panic!("the town has no way of {length} edges");
}

fn read(network: &Network, body: &str) -> Result<Demand, DemandError> {
    Demand::read(&format!("<routes>\n{body}\n</routes>\n"), "day.rou.xml", network, 1)
}

#[test]
fn vehicles_trips_and_flows_depart_in_the_order_of_time() {
    let network = town();
    let edges = chain(&network, 4);
    let (from, to, all) = (&edges[0], &edges[3], edges.join(" "));
    let body = format!(
        r#"<vType id="lorry" vClass="truck" speedFactor="normc(0.9,0.1,0.2,2)" minGap="3"/>
        <route id="line" edges="{all}"/>
        <flow id="f" type="lorry" route="line" begin="10" end="70" number="3" departSpeed="max"/>
        <vehicle id="v" route="line" depart="0:00:20" departPos="12.5" departSpeed="5"/>
        <trip id="t" from="{from}" to="{to}" depart="5" departLane="best"/>
        <vehicle id="w" depart="90"><route edges="{all}"/></vehicle>
        <flow id="h" route="line" vehsPerHour="1800" begin="100" number="2"/>
        <flow id="p" route="line" period="exp(0.5)" begin="200" end="400"/>
        <flow id="q" route="line" probability="0.25" begin="500" end="900"/>
        <person id="walks" depart="0"/>"#
    );
    let demand = read(&network, &body).expect("a route file");
    let all = &demand.departures;
    assert!(all.windows(2).all(|pair| pair[0].at_s <= pair[1].at_s));
    let first: Vec<_> = all.iter().take(8).map(|d| (d.id.as_str(), d.at_s)).collect();
    let expected = [
        ("t", 5.0),
        ("f.0", 10.0),
        ("v", 20.0),
        ("f.1", 30.0),
        ("f.2", 50.0),
        ("w", 90.0),
        ("h.0", 100.0),
        ("h.1", 102.0),
    ];
    assert_eq!(first, expected);
    assert_eq!(demand.skipped.get("person"), Some(&1));
    let of = |id: &str| all.iter().find(|departure| departure.id == id).expect("it departs");
    assert_eq!(of("f.0").kind.class, VehicleClass::Truck);
    assert_eq!((of("f.0").kind.speed_factor, of("f.0").kind.gap_m), (Some(0.9), Some(3.0)));
    assert_eq!((of("f.0").speed, of("t").speed), (DepartSpeed::Limit, DepartSpeed::Fixed(0.0)));
    assert_eq!(of("v").position, DepartPosition::Front(12.5));
    assert_eq!((of("v").places.len(), of("t").places.len()), (4, 4));
    let count = |flow: &str| all.iter().filter(|d| d.id.starts_with(flow)).count();
    assert!((70..=130).contains(&count("p.")), "{} of 100 on average", count("p."));
    assert!((70..=130).contains(&count("q.")), "{} of 100 on average", count("q."));
}

#[test]
fn a_way_passes_the_end_of_each_edge_on_a_lane_that_leads_on() {
    let network = town();
    let edges = chain(&network, 5);
    let body =
        format!(r#"<vehicle id="v" depart="0"><route edges="{}"/></vehicle>"#, edges.join(" "));
    let demand = read(&network, &body).expect("a route file");
    let places = &demand.departures[0].places;
    assert_eq!(places.len(), 5);
    for (place, name) in places.iter().zip(&edges) {
        let at = network.nearest(place.as_dvec3(), LaneTypes::DRIVABLE).expect("a lane");
        let lane = network.lane(at.lane);
        let edge = Edge::parse(name, &network).expect("an edge");
        assert!(edge.has(lane), "{name}: {place} lies on road {}", lane.road);
        assert!(lane.length_m - at.along_m < 4.0 || lane.length_m < 8.0, "{name}: near its end");
    }
}

#[test]
fn errors_name_file_line_vehicle_and_edge() {
    let network = town();
    let edges = chain(&network, 3);
    let (first, third) = (&edges[0], &edges[2]);
    let vehicle = |rest: &str| format!(r#"<vehicle id="a7" depart="0" {rest}</vehicle>"#);
    let cases = [
        (
            vehicle(r#"><route edges="-nowhere"/>"#),
            "day.rou.xml:2: vehicle \"a7\": unknown edge \"-nowhere\": the map has no road nowhere",
        ),
        (vehicle(&format!(r#"><route edges="{first} {third}"/>"#)), "no lane leads from edge"),
        (vehicle(r#"route="none">"#), "vehicle \"a7\": unknown route \"none\""),
        (vehicle(r#"type="none">"#), "unknown type \"none\""),
        (vehicle(">"), "has no route"),
        (vehicle(&format!(r#"departLane="9"><route edges="{first}"/>"#)), "departLane is \"9\""),
        (
            vehicle(&format!(r#"departPos="last"><route edges="{first}"/>"#)),
            "departPos is \"last\"",
        ),
        (
            vehicle(&format!(r#"departSpeed="-3"><route edges="{first}"/>"#)),
            "departSpeed is \"-3\"",
        ),
        (
            format!("\n\n<trip id=\"b\" from=\"{first}\" to=\"{third}\" depart=\"triggered\"/>"),
            "day.rou.xml:4: trip \"b\": depart is \"triggered\"",
        ),
        (
            format!(r#"<flow id="f" from="{first}" to="{third}" begin="0"/>"#),
            "flow \"f\": has no end",
        ),
        (
            format!(r#"<flow id="f" from="{first}" to="{third}" end="9" probability="3"/>"#),
            "probability is 3",
        ),
        (
            format!(
                r#"<flow id="f" from="{first}" to="{third}" end="9" period="2" probability="1"/>"#
            ),
            "has period and probability at once",
        ),
        (r#"<vType id="ship" vClass="ship"/>"#.to_owned(), "vType \"ship\": vClass is \"ship\""),
        (r#"<vType id="slow" minGap="-1"/>"#.to_owned(), "minGap is -1"),
        ("<vehicle id=\"a\">".to_owned(), "day.rou.xml:3: no valid XML"),
    ];
    for (body, expected) in cases {
        let error = read(&network, &body).expect_err(&body).to_string();
        assert!(error.contains(expected), "{body}: {error}");
    }
    let other = Demand::read("<net/>", "day.rou.xml", &network, 1).expect_err("no route file");
    assert!(other.to_string().contains("the outermost element is <net>"), "{other}");
}

/// Notes that the running test skips what it cannot do; `./run test` counts and lists these notes.
fn note_skipped(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or_default().rsplit("::").next().unwrap_or_default().to_owned();
    eprintln!("skipped {test}: {why}");
    if let Some(path) = std::env::var_os("OMNIBUS_TEST_NOTES") {
        use std::io::Write as _;
        let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
        let line = format!("skipped {test}: {why}\n");
        file.and_then(|mut file| file.write_all(line.as_bytes())).expect("the notes of the tests");
    }
}

/// Returns the net that netconvert makes from a map: `None` if there is no netconvert. It is the program
/// that `OMNIBUS_NETCONVERT` names, or the one on the path.
fn netconvert(open_drive: &str) -> Option<Vec<Element>> {
    let program = std::env::var("OMNIBUS_NETCONVERT").unwrap_or_else(|_| "netconvert".to_owned());
    let dir = std::env::temp_dir().join(format!("omnibus-netconvert-{}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a folder for temporary files");
    let (map, net) = (dir.join("map.xodr"), dir.join("map.net.xml"));
    std::fs::write(&map, open_drive).expect("a temporary file");
    let run = std::process::Command::new(&program)
        .args(["--offset.disable-normalization", "--opendrive-files"])
        .args([map.as_os_str(), "-o".as_ref(), net.as_os_str()])
        .output();
    let text = run.ok().and_then(|_| std::fs::read_to_string(&net).ok());
    std::fs::remove_dir_all(&dir).expect("the folder of temporary files");
    let Some(text) = text else {
        note_skipped(&format!("{program} does not run; it is in eclipse-sumo (pip)"));
        return None;
    };
    Some(elements::read(&text, "map.net.xml", "net").expect("a net"))
}

#[test]
fn netconvert_names_edges_and_lanes_as_they_are_read_here() {
    let text = mapgen::named("Flatford").expect("a map of the generator");
    let network = town();
    let Some(net) = netconvert(&text) else { return };
    let is_own = |element: &&Element| !element.get("id").is_some_and(|id| id.starts_with(':'));
    let (mut edges, mut lanes) = (0, 0);
    for element in net.iter().filter(|e| e.name == "edge").filter(is_own) {
        let name = element.require("id").expect("an id");
        let edge = Edge::parse(name, &network).unwrap_or_else(|why| panic!("{name}: {why}"));
        edges += 1;
        let own = edge.numbered_lanes(&network);
        let theirs: Vec<_> = element.children.iter().filter(|e| e.name == "lane").collect();
        assert_eq!(theirs.len(), own.len(), "lanes of {name}");
        for (nth, lane) in theirs.iter().enumerate() {
            let (index, is_parking) = (own[nth], lane.get("type") == Some("parking"));
            assert_eq!(is_parking, network.lane(index).kind == LaneType::Parking, "{name} {nth}");
            let shape = lane.require("shape").expect("a shape");
            let ends = [shape.split(' ').next(), shape.split(' ').next_back()];
            let [from, to] = ends.map(|point| {
                let xy = point.expect("points").split(',').map(|n| n.parse().expect("a number"));
                let xy: Vec<f64> = xy.take(2).collect();
                glam::DVec2::new(xy[0], xy[1])
            });
            // A straight lane has its middle between its ends.
            let place = |part: f64| {
                let along_m = network.lane(index).length_m * part;
                network.place(road::LanePoint { lane: index, along_m }).position.truncate()
            };
            let along = place(1.0) - place(0.0);
            assert!((to - from).dot(along) > 0.0, "{name}, lane {nth}: the direction");
            let beside = along.normalize_or_zero().perp_dot(from - place(0.0));
            let straight = (place(0.5) - 0.5 * (place(0.0) + place(1.0))).length() < 0.1;
            // The lane of a piece begins elsewhere, and parking lanes have ends.
            if straight && !is_parking {
                assert!(beside.abs() < 0.5, "{name}, lane {nth}: {beside} m beside");
                lanes += 1;
            }
        }
    }
    assert!(edges > 20 && lanes > 20, "{edges} edges, {lanes} straight lanes");
    let mut links = 0;
    for element in net.iter().filter(|e| e.name == "connection") {
        let [from, to] = ["from", "to"].map(|end| element.require(end).expect("an edge"));
        if from.starts_with(':') || to.starts_with(':') {
            continue;
        }
        let [a, b] = [from, to].map(|name| Edge::parse(name, &network).expect("an edge"));
        let turns_round = a.road == b.road;
        let way = way::find(&network, &[a, b], &a.first_lanes(&network));
        assert!(way.is_ok() || turns_round, "{from} leads to {to}");
        links += 1;
    }
    assert!(links > 50, "{links} connections");
}
