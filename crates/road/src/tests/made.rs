//! Hand-made maps with every feature of surfaces, for machines without other maps.

use std::fmt::Write;

/// Parameters of one road.
struct Way {
    id: u32,
    junction: i32,
    length: f64,
    geometry: String,
    profile: &'static str,
    lanes: String,
    link: String,
}

fn road(text: &mut String, way: &Way) {
    let Way { id, junction, length, geometry, profile, lanes, link } = way;
    let _ = write!(
        text,
        r#"<road name="" length="{length}" id="{id}" junction="{junction}"><link>{link}</link><planView>{geometry}</planView>{profile}<lanes>{lanes}</lanes></road>"#
    );
}

fn lane(id: i32, kind: &str, width: &str, linked: bool) -> String {
    let link = if linked {
        format!(r#"<link><predecessor id="{id}"/><successor id="{id}"/></link>"#)
    } else {
        String::new()
    };
    format!(
        r#"<lane id="{id}" type="{kind}">{link}{width}<roadMark sOffset="0" type="broken" color="white" width="0.12"/></lane>"#
    )
}

fn width(a: f64, b: f64, c: f64, d: f64) -> String {
    format!(r#"<width sOffset="0" a="{a}" b="{b}" c="{c}" d="{d}"/>"#)
}

fn section(s: f64, left: &str, right: &str) -> String {
    format!(
        r#"<laneSection s="{s}"><left>{left}</left><center><lane id="0"><roadMark sOffset="0" type="solid" color="yellow"/></lane></center><right>{right}</right></laneSection>"#
    )
}

fn file(roads: &str) -> String {
    format!(r#"<OpenDRIVE><header revMajor="1" revMinor="7"/>{roads}</OpenDRIVE>"#)
}

/// A road of a spiral, an arc and a cubic that climbs and banks, over three sections of which one
/// widens and one begins with a new lane, with an offset, a sidewalk and a crown.
fn long() -> String {
    let geometry = r#"<geometry s="0" x="0" y="0" hdg="0.3" length="40"><spiral curvStart="0" curvEnd="0.03"/></geometry><geometry s="40" x="34.556452632" y="18.850695596" hdg="0.9" length="30"><arc curvature="0.03"/></geometry>"#;
    let constant = |a: f64| width(a, 0.0, 0.0, 0.0);
    let both = |right: &str| lane(-1, "driving", right, true);
    let walk = |id: i32| lane(id, "sidewalk", &constant(2.0), false);
    let left = lane(1, "driving", &constant(3.25), true);
    let lanes = [
        r#"<laneOffset s="0" a="0" b="0" c="0.0004" d="0"/>"#.to_string(),
        section(0.0, &left, &(both(&width(3.0, 0.0, 0.003, -0.0001)) + &walk(-2))),
        section(20.0, &left, &(both(&constant(3.4)) + &walk(-2))),
        section(
            45.0,
            &left,
            &(both(&constant(3.4))
                + &lane(-2, "driving", &width(0.0, 0.14, 0.0, 0.0), false)
                + &walk(-3)),
        ),
    ];
    let mut roads = String::new();
    road(
        &mut roads,
        &Way {
            id: 1,
            junction: -1,
            length: 70.0,
            geometry: geometry.to_string(),
            profile: r#"<elevationProfile><elevation s="0" a="3" b="0.02" c="0.001" d="-0.00001"/></elevationProfile><lateralProfile><superelevation s="0" a="0" b="0.001" c="0" d="0"/><shape s="0" t="-10" a="-0.2" b="0.02" c="0" d="0"/><shape s="0" t="0" a="0" b="-0.02" c="0" d="0"/></lateralProfile>"#,
            lanes: lanes.concat(),
            link: String::new(),
        },
    );
    file(&roads)
}

/// Four roads that meet in a junction with twelve connections.
fn crossing() -> String {
    let constant = width(3.5, 0.0, 0.0, 0.0);
    let two_way =
        section(0.0, &lane(1, "driving", &constant, true), &lane(-1, "driving", &constant, true));
    let one_way = section(0.0, "", &lane(-1, "driving", &constant, true));
    let (mut roads, mut connections) = (String::new(), String::new());
    // Each arm begins 12 m from the middle and leads away.
    for arm in 0..4u32 {
        let (sin, cos) = (f64::from(arm) * std::f64::consts::FRAC_PI_2).sin_cos();
        let heading = f64::from(arm) * std::f64::consts::FRAC_PI_2;
        let (x, y) = (12.0 * cos, 12.0 * sin);
        road(
            &mut roads,
            &Way {
                id: arm,
                junction: -1,
                length: 40.0,
                geometry: format!(
                    r#"<geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="40"><line/></geometry>"#
                ),
                profile: "",
                lanes: two_way.clone(),
                link: r#"<predecessor elementType="junction" elementId="9"/>"#.to_string(),
            },
        );
        for other in (0..4u32).filter(|other| *other != arm) {
            let id = 10 + 4 * arm + other;
            // A cubic from this arm's end to the other's, in coordinates that begin inwards.
            let turn = f64::from((other + 4 - arm) % 4) * std::f64::consts::FRAC_PI_2;
            let to = (12.0 + 12.0 * -turn.cos(), -12.0 * turn.sin());
            let away = (-turn.cos(), -turn.sin());
            let pull = 12.0;
            let cubic = |end: f64, first: f64, last: f64| {
                let (c, d) = (3.0 * end - 2.0 * first - last, first + last - 2.0 * end);
                (first, c, d)
            };
            let (bu, cu, du) = cubic(to.0, pull, pull * away.0);
            let (bv, cv, dv) = cubic(to.1, 0.0, pull * away.1);
            let speed = |p: f64| {
                let u = bu + p * (2.0 * cu + p * 3.0 * du);
                let v = bv + p * (2.0 * cv + p * 3.0 * dv);
                u.hypot(v)
            };
            let length: f64 =
                (0..1000).map(|n| speed((f64::from(n) + 0.5) / 1000.0) / 1000.0).sum();
            let heading = heading + std::f64::consts::PI;
            road(
                &mut roads,
                &Way {
                    id,
                    junction: 9,
                    length,
                    geometry: format!(
                        r#"<geometry s="0" x="{x}" y="{y}" hdg="{heading}" length="{length}"><paramPoly3 pRange="normalized" aU="0" bU="{bu}" cU="{cu}" dU="{du}" aV="0" bV="{bv}" cV="{cv}" dV="{dv}"/></geometry>"#
                    ),
                    profile: "",
                    lanes: one_way.replace(
                        r#"<predecessor id="-1"/><successor id="-1"/>"#,
                        r#"<predecessor id="1"/><successor id="-1"/>"#,
                    ),
                    link: format!(
                        r#"<predecessor elementType="road" elementId="{arm}" contactPoint="start"/><successor elementType="road" elementId="{other}" contactPoint="start"/>"#
                    ),
                },
            );
            let _ = write!(
                connections,
                r#"<connection id="{id}" incomingRoad="{arm}" connectingRoad="{id}" contactPoint="start"><laneLink from="1" to="-1"/></connection>"#
            );
        }
    }
    file(&format!(r#"{roads}<junction id="9" name="">{connections}</junction>"#))
}

/// Returns names and texts of the maps.
pub(super) fn maps() -> Vec<(String, String)> {
    vec![("long".to_string(), long()), ("crossing".to_string(), crossing())]
}

#[test]
fn hand_made_maps_have_no_errors() {
    for (name, text) in maps() {
        let found = crate::validate(&text).expect("a map");
        assert!(found.is_empty(), "{name}: {found:#?}");
    }
}
