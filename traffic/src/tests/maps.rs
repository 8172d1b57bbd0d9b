//! Small maps as OpenDRIVE text.

use std::sync::Arc;

use road::Network;

/// Returns a small generated town: lights, stop signs, one and two lanes each way.
pub(crate) fn town() -> Arc<Network> {
    let text = mapgen::named("Flatford").expect("a map of the generator");
    Arc::new(Network::parse(&text).expect("generated towns parse"))
}

/// Returns a straight road of `length_m` along x with a lane each way, 50 km/h.
pub(super) fn straight(length_m: f64) -> Arc<Network> {
    let road = road("1", "-1", (0.0, 0.0, 0.0, length_m), "", true);
    parse(&road)
}

/// Returns a straight road as [`straight`], with a continuous line between the lanes.
pub(super) fn straight_with_solid_line(length_m: f64) -> Arc<Network> {
    let line = r#"<lane id="0" type="none" level="false"><roadMark sOffset="0" type="solid"
        weight="standard" color="standard" width="0.12" laneChange="none"/></lane>"#;
    let road = road("1", "-1", (0.0, 0.0, 0.0, length_m), "", true);
    parse(&road.replace(r#"<lane id="0" type="none" level="false"/>"#, line))
}

/// Returns a crossing of four arms of 150 m around the origin, with a lane each way and neither
/// lights nor signs.
///
/// West arm 1, east arm 2, south arm 3, north arm 4; straight on only.
pub(crate) fn crossing() -> Arc<Network> {
    parse(&crossing_text())
}

/// Returns the crossing with lanes of 3 m.
pub(crate) fn narrow_crossing() -> Arc<Network> {
    parse(&crossing_text().replace(r#"a="3.5""#, r#"a="3""#))
}

/// Returns the crossing with a stop sign on the southern arm.
pub(super) fn stop_before_crossing() -> Arc<Network> {
    let sign = r#"<signals><signal s="149" t="-4" id="1" name="" dynamic="no" orientation="+"
        zOffset="2" country="OpenDRIVE" type="206" subtype="-1" value="-1"/></signals></road>"#;
    let text = crossing_text();
    let south = text.find(r#"id="3""#).expect("the southern arm exists");
    let end = south + text[south..].find("</road>").expect("the road element ends");
    parse(&format!("{}{sign}{}", &text[..end], &text[end + "</road>".len()..]))
}

/// Returns two such crossings, the centre of the second at `second_x_m` on the eastern arm of the first,
/// 6 or so metres after it at 26. Its western and its southern arm, roads 2 and 6, have lights at its
/// lines; its eastern and northern arms are 5 and 7.
pub(crate) fn two_crossings(second_x_m: f64) -> Arc<Network> {
    two_crossings_with_line(second_x_m, 0.5)
}

/// Returns those crossings with the line of the southern light this far before the second one.
pub(super) fn two_crossings_with_line(second_x_m: f64, before_m: f64) -> Arc<Network> {
    crossings_with_lights(second_x_m, before_m, false)
}

/// Returns those crossings with lights on the western and southern arms of the first one too.
pub(crate) fn two_lit_crossings(second_x_m: f64) -> Arc<Network> {
    crossings_with_lights(second_x_m, 0.5, true)
}

fn crossings_with_lights(second_x_m: f64, before_m: f64, at_first: bool) -> Arc<Network> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let between_m = second_x_m - 20.0;
    let joins = |first: &str, second: &str| {
        format!(
            r#"<predecessor elementType="junction" elementId="{first}"/>
               <successor elementType="junction" elementId="{second}"/>"#
        )
    };
    let light = |id: u32, s_m: f64| {
        format!(
            r#"<signals><signal s="{s_m}" t="-4" id="{id}" name="" dynamic="yes" orientation="+"
            zOffset="5" country="OpenDRIVE" type="1000001" subtype="-1" value="-1"/></signals></road>"#
        )
    };
    let lit = |road: String, id: u32, s_m: f64| road.replace("</road>", &light(id, s_m));
    let middle = road("2", "-1", (10.0, 0.0, 0.0, between_m), &joins("9", "8"), true);
    let south = road("6", "-1", (second_x_m, -160.0, quarter, 150.0), &ends_at("8"), true);
    let mut text = lit(middle, 1, between_m - 0.5) + &lit(south, 2, 150.0 - before_m);
    let west = road("1", "-1", (-160.0, 0.0, 0.0, 150.0), &ends_at("9"), true);
    let south = road("3", "-1", (0.0, -160.0, quarter, 150.0), &ends_at("9"), true);
    for (road, id) in [(west, 3), (south, 4)] {
        text += &if at_first { lit(road, id, 149.5) } else { road };
    }
    text += &road("4", "-1", (0.0, 10.0, quarter, 150.0), &begins_at("9"), true);
    text += &road("5", "-1", (second_x_m + 10.0, 0.0, 0.0, 150.0), &begins_at("8"), true);
    text += &road("7", "-1", (second_x_m, 10.0, quarter, 150.0), &begins_at("8"), true);
    text += &junction("9", 0.0, ["1", "2", "3", "4"], 10);
    text += &junction("8", second_x_m, ["2", "5", "6", "7"], 20);
    parse(&text)
}

fn ends_at(junction: &str) -> String {
    format!(r#"<successor elementType="junction" elementId="{junction}"/>"#)
}

fn begins_at(junction: &str) -> String {
    format!(r#"<predecessor elementType="junction" elementId="{junction}"/>"#)
}

fn crossing_text() -> String {
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut text = String::new();
    text += &road("1", "-1", (-160.0, 0.0, 0.0, 150.0), &ends_at("9"), true);
    text += &road("2", "-1", (10.0, 0.0, 0.0, 150.0), &begins_at("9"), true);
    text += &road("3", "-1", (0.0, -160.0, quarter, 150.0), &ends_at("9"), true);
    text += &road("4", "-1", (0.0, 10.0, quarter, 150.0), &begins_at("9"), true);
    text += &junction("9", 0.0, ["1", "2", "3", "4"], 10);
    text
}

/// Returns a junction at `x_m` between the ends of its western and southern arms and the starts of its
/// eastern and northern ones, with its roads, whose ids begin with `first_road`.
fn junction(id: &str, x_m: f64, [west, east, south, north]: [&str; 4], first_road: u32) -> String {
    let quarter = std::f64::consts::FRAC_PI_2;
    let through = [
        ((x_m - 10.0, 0.0, 0.0), (west, "end", -1), (east, "start", -1)),
        ((x_m + 10.0, 0.0, 2.0 * quarter), (east, "start", 1), (west, "end", 1)),
        ((x_m, -10.0, quarter), (south, "end", -1), (north, "start", -1)),
        ((x_m, 10.0, 3.0 * quarter), (north, "start", 1), (south, "end", 1)),
    ];
    let (mut text, mut junction) = (String::new(), String::new());
    for (road_id, through) in (first_road..).zip(through) {
        let ((x, y, heading), (from, from_end, from_lane), (to, to_end, to_lane)) = through;
        let link = format!(
            r#"<predecessor elementType="road" elementId="{from}" contactPoint="{from_end}"/>
               <successor elementType="road" elementId="{to}" contactPoint="{to_end}"/>"#
        );
        let lane_link =
            format!(r#"<link><predecessor id="{from_lane}"/><successor id="{to_lane}"/></link>"#);
        let connecting = road(&road_id.to_string(), id, (x, y, heading, 20.0), &link, false);
        text += &connecting.replace("<link-of-lane/>", &lane_link);
        junction += &format!(
            r#"<connection id="{road_id}" incomingRoad="{from}" connectingRoad="{road_id}"
               contactPoint="start"><laneLink from="{from_lane}" to="-1"/></connection>"#
        );
    }
    text + &format!(r#"<junction id="{id}" name="">{junction}</junction>"#)
}

/// Returns a one-way lane in a loop to the left: four quarter circles, with straight roads between
/// them, or a circle of one road if `straight_m` is 0.
pub(crate) fn loop_road(radius_m: f64, straight_m: f64) -> Arc<Network> {
    loop_lanes(radius_m, straight_m, [1, 1], false, "")
}

/// Returns one-way lanes in a circle to the left with this speed limit.
pub(super) fn ring(radius_m: f64, limit_kmh: u32, lanes: i32) -> Arc<Network> {
    let limit =
        format!(r#"<type s="0" type="motorway"><speed max="{limit_kmh}" unit="km/h"/></type>"#);
    loop_lanes(radius_m, 0.0, [lanes, lanes], false, &limit)
}

/// Returns a loop with two lanes, between which changes are allowed; its first straight is 600 m
/// along x, with lane -1 about y = -1.75 and -2 about y = -5.25.
pub(super) fn two_lanes() -> Arc<Network> {
    loop_lanes(60.0, 600.0, [2, 2], false, "")
}

/// Returns a road of two lanes that turns left by a half circle of 30 m around (0, 30), and then runs
/// 300 m along -x, with lane -1 about y = 61.75 and -2 about y = 65.25.
pub(super) fn curve_before_straight() -> Arc<Network> {
    let half_m = 30.0 * std::f64::consts::PI;
    let lanes: String = [-1, -2].map(|id| driving_lane(id, "")).concat();
    parse(&format!(
        r#"<road name="" length="{}" id="1" junction="-1"><planView>
        <geometry s="0" x="0" y="0" hdg="0" length="{half_m}"><arc curvature="{}"/></geometry>
        <geometry s="{half_m}" x="0" y="60" hdg="{}" length="300"><line/></geometry></planView>
        <lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
        <right>{lanes}</right></laneSection></lanes></road>"#,
        half_m + 300.0,
        1.0 / 30.0,
        std::f64::consts::PI,
    ))
}

/// Returns that loop with the second lane on its first straight alone, where the lane ends at x = 600.
pub(super) fn ending_lane() -> Arc<Network> {
    loop_lanes(60.0, 600.0, [2, 1], false, "")
}

/// Returns a loop with a lane each way: four quarter circles, with straight roads between them.
pub(crate) fn two_way_loop(radius_m: f64, straight_m: f64) -> Arc<Network> {
    loop_lanes(radius_m, straight_m, [1, 1], true, "")
}

/// Returns a lane of 3.5 m that may be left to both sides.
fn driving_lane(id: i32, link: &str) -> String {
    format!(
        r#"<lane id="{id}" type="driving" level="false"><link>{link}</link>
        <width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken"
        weight="standard" color="standard" width="0.12" laneChange="both"/></lane>"#
    )
}

/// `lanes` are those of the first road and of the others.
fn loop_lanes(
    radius_m: f64,
    straight_m: f64,
    lanes: [i32; 2],
    both_ways: bool,
    limit: &str,
) -> Arc<Network> {
    let lane = |id: i32| {
        let link = if id.abs() <= lanes[1] {
            format!(r#"<predecessor id="{id}"/><successor id="{id}"/>"#)
        } else {
            String::new()
        };
        driving_lane(id, &link)
    };
    let left = if both_ways { format!("<left>{}</left>", lane(1)) } else { String::new() };
    let right = lanes.map(|count| (1..=count).map(|id| lane(-id)).collect::<String>());
    let quarter = std::f64::consts::FRAC_PI_2;
    // Length and curvature of each road; one that is its own successor, or eight.
    let arc = |turn: f64| (radius_m * turn, 1.0 / radius_m);
    let pieces = if straight_m > 0.0 {
        [(straight_m, 0.0), arc(quarter)].repeat(4)
    } else {
        vec![arc(4.0 * quarter)]
    };
    let count = pieces.len();
    let (mut x, mut y, mut heading) = (0.0f64, 0.0f64, 0.0f64);
    let mut text = String::new();
    for (index, (length_m, curvature)) in pieces.into_iter().enumerate() {
        let (before, after) = ((index + count - 1) % count, (index + 1) % count);
        let lanes = &right[index.min(1)];
        let shape = if curvature == 0.0 {
            "<line/>".to_owned()
        } else {
            format!(r#"<arc curvature="{curvature}"/>"#)
        };
        text += &format!(
            r#"<road name="" length="{length_m}" id="{index}" junction="-1">
            <link><predecessor elementType="road" elementId="{before}" contactPoint="end"/>
            <successor elementType="road" elementId="{after}" contactPoint="start"/></link>{limit}
            <planView><geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length_m}">{shape}
            </geometry></planView>
            <lanes><laneSection s="0">{left}<center><lane id="0" type="none" level="false"/></center>
            <right>{lanes}</right></laneSection></lanes></road>"#
        );
        if curvature == 0.0 {
            (x, y) = (x + length_m * heading.cos(), y + length_m * heading.sin());
        } else {
            let turned = heading + length_m * curvature;
            x += radius_m * (turned.sin() - heading.sin());
            y -= radius_m * (turned.cos() - heading.cos());
            heading = turned;
        }
    }
    parse(&text)
}

/// Returns a one-way lane that rises in three quarters of a circle and crosses over itself: along x
/// below, then down x = 160 and 7 m above.
pub(super) fn overpass() -> Arc<Network> {
    let arc_m = 60.0 * std::f64::consts::PI;
    let down = -std::f64::consts::FRAC_PI_2;
    let (bend, length_m) = (200.0 + arc_m, 400.0 + arc_m);
    // A cubic from 0 to 7 m, level at both ends.
    let (c, d) = (21.0 / arc_m.powi(2), -14.0 / arc_m.powi(3));
    parse(&format!(
        r#"<road name="" length="{length_m}" id="1" junction="-1"><link/>
        <planView>
        <geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry>
        <geometry s="200" x="200" y="0" hdg="0" length="{arc_m}"><arc curvature="0.025"/></geometry>
        <geometry s="{bend}" x="160" y="40" hdg="{down}" length="200"><line/></geometry>
        </planView>
        <elevationProfile><elevation s="0" a="0" b="0" c="0" d="0"/>
        <elevation s="200" a="0" b="0" c="{c}" d="{d}"/>
        <elevation s="{bend}" a="7" b="0" c="0" d="0"/></elevationProfile>
        <lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
        <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes>
        </road>"#
    ))
}

fn road(
    id: &str,
    junction: &str,
    (x, y, heading, length_m): (f64, f64, f64, f64),
    link: &str,
    both_ways: bool,
) -> String {
    let lane = |id: i32| {
        format!(
            r#"<lane id="{id}" type="driving" level="false"><link-of-lane/>
               <width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>"#
        )
    };
    let left = if both_ways { format!("<left>{}</left>", lane(1)) } else { String::new() };
    format!(
        r#"<road name="" length="{length_m}" id="{id}" junction="{junction}">
            <link>{link}</link>
            <type s="0" type="town"><speed max="50" unit="km/h"/></type>
            <planView><geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length_m}"><line/>
            </geometry></planView>
            <lanes><laneSection s="0">{left}<center><lane id="0" type="none" level="false"/></center>
            <right>{}</right></laneSection></lanes></road>"#,
        lane(-1)
    )
}

fn parse(roads: &str) -> Arc<Network> {
    let text = format!(
        r#"<OpenDRIVE><header revMajor="1" revMinor="4" name="" version="1"/>{}</OpenDRIVE>"#,
        roads.replace("<link-of-lane/>", "")
    );
    Arc::new(Network::parse(&text).expect("the map of the test parses"))
}
