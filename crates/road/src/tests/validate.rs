//! Each kind of inconsistency, in a map that is otherwise consistent.

use super::shared_maps;
use crate::{Severity, validate};

/// Road 1 leads through connection 2 of junction 9 into road 3.
const GOOD: &str = r#"<OpenDRIVE>
<header revMajor="1" revMinor="6" name="good"/>
<road name="in" length="60" id="1" junction="-1" rule="RHT">
<link><successor elementType="junction" elementId="9"/></link>
<type s="0" type="town"/>
<planView>
<geometry s="0" x="0" y="0" hdg="0" length="40"><line/></geometry>
<geometry s="40" x="40" y="0" hdg="0" length="20"><line/></geometry>
</planView>
<elevationProfile>
<elevation s="0" a="0" b="0.01" c="0" d="0"/>
<elevation s="30" a="0.3" b="0.01" c="0" d="0"/>
</elevationProfile>
<lanes>
<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
<laneOffset s="10" a="0.5" b="0" c="0" d="0"/>
<laneSection s="0">
<center><lane id="0" type="none"/></center>
<right>
<lane id="-1" type="driving" level="false"><link><successor id="-1"/></link>
<width sOffset="0" a="3" b="0" c="0" d="0"/>
<width sOffset="20" a="3" b="0" c="0" d="0"/>
<roadMark sOffset="0" type="broken" color="white" weight="standard" laneChange="both"/>
</lane>
<lane id="-2" type="sidewalk"><link><successor id="-2"/></link>
<width sOffset="0" a="2" b="0" c="0" d="0"/>
</lane>
</right>
</laneSection>
<laneSection s="25">
<center><lane id="0" type="none"/></center>
<right>
<lane id="-1" type="driving"><link><predecessor id="-1"/></link>
<width sOffset="0" a="3" b="0" c="0" d="0"/>
</lane>
<lane id="-2" type="sidewalk"><link><predecessor id="-2"/></link>
<width sOffset="0" a="2" b="0" c="0" d="0"/>
</lane>
</right>
</laneSection>
</lanes>
<objects>
<object id="o1" type="pole" s="5" t="-9"/>
<object id="o2" type="pole" s="6" t="-9"/>
<bridge id="b" s="1" length="10" type="concrete"/>
</objects>
<signals>
<signal id="s1" s="50" t="-7" dynamic="yes" orientation="+" type="1000001" subtype="-1"/>
<signal id="s2" s="55" t="-7" dynamic="no" orientation="+" type="206" subtype="-1"/>
<signalReference id="s2" s="51" t="-7" orientation="+"/>
</signals>
</road>
<road name="way" length="20" id="2" junction="9">
<link>
<predecessor elementType="road" elementId="1" contactPoint="end"/>
<successor elementType="road" elementId="3" contactPoint="start"/>
</link>
<planView>
<geometry s="0" x="60" y="0" hdg="0" length="20"><paramPoly3 pRange="normalized" aU="0" bU="20" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/></geometry>
</planView>
<elevationProfile>
<elevation s="0" a="0.6" b="0.01" c="0" d="0"/>
</elevationProfile>
<lanes>
<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
<laneSection s="0">
<center><lane id="0" type="none"/></center>
<right>
<lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link>
<width sOffset="0" a="3" b="0" c="0" d="0"/>
</lane>
</right>
</laneSection>
</lanes>
</road>
<road name="out" length="30" id="3" junction="-1">
<link><predecessor elementType="junction" elementId="9"/></link>
<planView>
<geometry s="0" x="80" y="0" hdg="0" length="30"><line/></geometry>
</planView>
<elevationProfile>
<elevation s="0" a="0.8" b="0.01" c="0" d="0"/>
</elevationProfile>
<lanes>
<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
<laneSection s="0">
<center><lane id="0" type="none"/></center>
<right>
<lane id="-1" type="driving"><link/>
<width sOffset="0" a="3" b="0" c="0" d="0"/>
</lane>
</right>
</laneSection>
</lanes>
</road>
<controller id="c1" name="c"><control signalId="s1" type="0"/></controller>
<junction id="9" name="j">
<connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">
<laneLink from="-1" to="-1"/>
</connection>
<controller id="c1" type="0"/>
</junction>
</OpenDRIVE>
"#;

/// Returns everything found in the good map with `old` replaced by `new`: severity, line, reason. A
/// rejected map has one error.
fn found(old: &str, new: &str) -> Vec<(Severity, usize, String)> {
    assert_eq!(GOOD.matches(old).count(), 1, "{old} should stand once");
    match validate(&GOOD.replace(old, new)) {
        Ok(found) => found.into_iter().map(|f| (f.severity, f.line, f.reason)).collect(),
        Err(error) => vec![(Severity::Error, error.line, error.reason)],
    }
}

/// Checks that replacing `old` by `new` is reported on the line of `at`.
fn check(old: &str, new: &str, at: &str, severity: Severity, reason: &str) {
    let text = GOOD.replace(old, new);
    let line = 1 + text[..text.find(at).expect("a place")].matches('\n').count();
    let found = found(old, new);
    let is_reported = found.iter().any(|f| f.0 == severity && f.1 == line && f.2.contains(reason));
    assert!(
        is_reported,
        "{new}: {severity:?} on line {line} with {reason:?} is not among {found:#?}"
    );
}

use Severity::{Error, Warning};

#[test]
fn a_good_map_has_no_findings() {
    assert_eq!(validate(GOOD).expect("a map"), []);
}

#[test]
fn discontinuous_lines_are_reported() {
    let second = r#"<geometry s="40" x="40" y="0" hdg="0" length="20">"#;
    let at = r#"<geometry s="40"#;
    check(second, &second.replace(r#"x="40""#, r#"x="40.05""#), at, Warning, "begins 0.050 m from");
    check(second, &second.replace(r#"x="40""#, r#"x="41""#), at, Error, "begins 1.000 m from");
    check(second, &second.replace(r#"hdg="0""#, r#"hdg="0.02""#), at, Warning, "a kink of 0.020");
    check(second, &second.replace("s=\"40", "s=\"40.5"), at, Error, "previous one ends at 40");
    check(
        second,
        &second.replace("s=\"40", "s=\"-1"),
        "<geometry s=\"-1",
        Error,
        "previous one at 0",
    );
    let first = r#"<geometry s="0" x="0" y="0" hdg="0" length="40">"#;
    check(first, &first.replace("s=\"0", "s=\"1"), "<geometry s=\"1", Error, "begins at s 1");
    let step = r#"<elevation s="30" a="0.3""#;
    check(step, r#"<elevation s="30" a="0.33""#, r#"<elevation s="30"#, Warning, "step of 0.030");
    check(step, r#"<elevation s="30" a="0.5""#, r#"<elevation s="30"#, Error, "step of 0.200");
    check(step, r#"<elevation s="-3" a="0.3""#, r#"<elevation s="-3"#, Error, "after one that");
    let jump = r#"<laneOffset s="10" a="0.5""#;
    check(jump, r#"<laneOffset s="10" a="0.9""#, r#"<road name="in"#, Error, "jumps by 0.400 m");
}

#[test]
fn lengths_that_contradict_the_geometry_are_reported() {
    let road = r#"<road name="in" length="60""#;
    check(road, r#"<road name="in" length="60.5""#, r#"<road name="in"#, Error, "ends at 60");
    check(road, r#"<road name="in" length="90""#, r#"<road name="in"#, Error, "ends at 60");
    check(road, r#"<road name="in" length="59.95""#, r#"<road name="in"#, Warning, "ends at 60");
    check("bU=\"20\"", "bU=\"20.5\"", "bU=\"20.5\"", Warning, "its curve is 20.500 m");
}

#[test]
fn lanes_that_do_not_fit_are_reported() {
    let section = r#"<laneSection s="25">"#;
    check(section, r#"<laneSection s="-25">"#, "<laneSection s=\"-25", Error, "previous one at 0");
    check(section, r#"<laneSection s="65">"#, "<laneSection s=\"65", Error, "60 m long");
    let width = r#"<width sOffset="20" a="3" b="0" c="0" d="0"/>"#;
    let lane = r#"<lane id="-1" type="driving" level"#;
    check(width, &width.replace("a=\"3\" b=\"0\"", "a=\"3\" b=\"-1\""), lane, Error, "m between");
    check(width, &width.replace("a=\"3\"", "a=\"3.05\""), lane, Warning, "jumps by 0.050");
    check(
        width,
        &width.replace("sOffset=\"20\"", "sOffset=\"-2\""),
        "sOffset=\"-2",
        Error,
        "after one",
    );
    let first = "<link><successor id=\"-1\"/></link>\n<width sOffset=\"0\"";
    check(first, &first.replace("sOffset=\"0", "sOffset=\"2"), lane, Error, "no width before 2");
    let second = r#"<lane id="-2" type="sidewalk"><link><successor"#;
    check(second, &second.replace("-2", "-3"), "<lane id=\"-3", Error, "follows -1");
    check(
        second,
        &second.replace("-2", "-1"),
        "<lane id=\"-1\" type=\"side",
        Error,
        "duplicate lane",
    );
    let bare = "<lane id=\"-1\" type=\"driving\"><link/>\n<width sOffset=\"0\" a=\"3\" b=\"0\" c=\"0\" d=\"0\"/>";
    let at = "<lane id=\"-1\" type=\"driving\"><link/>";
    check(bare, at, at, Warning, "neither width nor border");
}

#[test]
fn gaps_between_lanes_are_reported() {
    let way = r#"<geometry s="0" x="60" y="0" hdg="0" length="20">"#;
    let before = r#"<laneSection s="25">"#;
    check(way, &way.replace("60", "60.03"), before, Warning, "ends 0.030 m from");
    check(way, &way.replace("y=\"0\"", "y=\"0.5\""), before, Error, "ends 0.500 m from");
    check(way, &way.replace("hdg=\"0\"", "hdg=\"0.1\""), before, Warning, "0.100 rad from");
    let rise = r#"<elevation s="0" a="0.6""#;
    check(rise, r#"<elevation s="0" a="0.9""#, before, Error, "0.300 m above or below");
    let lane = "<link/>\n<width sOffset=\"0\" a=\"3\"";
    let before = "<lane id=\"-1\" type=\"driving\"><link><predecessor id=\"-1\"/><successor";
    let wide = lane.replace("a=\"3\"", "a=\"3.5\"");
    let text = GOOD.replace(lane, &wide);
    let section = text[..text.find(before).expect("the way")].rfind("<laneSection").expect("one");
    let line = 1 + text[..section].matches('\n').count();
    let reason = "begins 3.500 m wide";
    assert!(found(lane, &wide).iter().any(|f| f.0 == Error && f.1 == line && f.2.contains(reason)));
}

#[test]
fn links_without_a_matching_counterpart_are_reported() {
    let out = r#"elementId="3" contactPoint="start""#;
    let way = r#"<road name="way"#;
    check(out, r#"elementId="7" contactPoint="start""#, way, Error, "road 7, which does not exist");
    let into = r#"<successor elementType="junction" elementId="9"/>"#;
    check(into, &into.replace('9', "8"), r#"<road name="in"#, Error, "junction 8, which does not");
    check(
        into,
        "<successor elementType=\"road\" elementId=\"3\" contactPoint=\"start\"/>",
        "<road name=\"in",
        Error,
        "which leads into junction 9",
    );
    check(
        into,
        "<successor elementType=\"road\" elementId=\"2\" contactPoint=\"end\"/>",
        "<road name=\"in",
        Error,
        "which leads to the start of road 3",
    );
    let lane = "<link><predecessor id=\"-1\"/></link>";
    let at = format!("<lane id=\"-1\" type=\"driving\">{}", lane.replace("-1", "-2"));
    check(
        lane,
        &lane.replace("-1", "-2"),
        r#"<lane id="-1" type="driving" level"#,
        Error,
        "leads to lane -1 of road 1, which leads to lane -2",
    );
    check(
        lane,
        &lane.replace("-1", "-7"),
        &at.replace("or id=\"-2", "or id=\"-7"),
        Error,
        "leads to lane -7",
    );
    let member = r#"id="2" junction="9""#;
    check(member, r#"id="2" junction="7""#, way, Error, "junction 7, which does not exist");
    check(member, r#"id="2" junction="-1""#, "<connection", Error, "does not belong to it");
    let connection = r#"incomingRoad="1" connectingRoad="2" contactPoint="start""#;
    check(
        connection,
        &connection.replace("Road=\"2", "Road=\"5"),
        "<connection",
        Error,
        "at least one does not exist",
    );
    check(
        connection,
        &connection.replace("start", "end"),
        "<connection",
        Error,
        "does not lead back",
    );
    check("<laneLink from=\"-1\"", "<laneLink from=\"-5\"", "<connection", Error, "no such lane");
    check(
        "<laneLink from=\"-1\" to=\"-1\"/>",
        "<laneLink from=\"-1\" to=\"-5\"/>",
        "<lane id=\"-1\" type=\"driving\"><link><predecessor id=\"-1\"/></link>",
        Error,
        "leads to lane -5",
    );
}

#[test]
fn positions_beyond_the_road_and_duplicate_ids_are_reported() {
    check("id=\"s1\" s=\"50\"", "id=\"s1\" s=\"61\"", "<signal id=\"s1", Warning, "at s 61");
    check(
        "id=\"o2\" type=\"pole\" s=\"6\"",
        "id=\"o2\" type=\"pole\" s=\"-6\"",
        "<object id=\"o2",
        Warning,
        "at s -6",
    );
    check(
        "id=\"b\" s=\"1\" length=\"10\"",
        "id=\"b\" s=\"1\" length=\"99\"",
        "<bridge",
        Warning,
        "ends at s 100",
    );
    check(
        "<signal id=\"s2\"",
        "<signal id=\"s1\"",
        "<signal id=\"s1\" s=\"55",
        Error,
        "duplicate signal",
    );
    check(
        "id=\"o2\"",
        "id=\"o1\"",
        "<object id=\"o1\" type=\"pole\" s=\"6",
        Warning,
        "duplicate object",
    );
    check(
        "id=\"3\" junction",
        "id=\"1\" junction",
        "<road name=\"out",
        Error,
        "duplicate road id 1",
    );
    check(
        "</junction>",
        "</junction>\n<junction id=\"9\"/>",
        "<junction id=\"9\"/>",
        Error,
        "duplicate junction",
    );
    check(
        "<junction id",
        "<controller id=\"c1\"/>\n<junction id",
        "<controller id=\"c1\"/>",
        Error,
        "duplicate controller",
    );
    check(
        "<signalReference id=\"s2\"",
        "<signalReference id=\"s7\"",
        "<signalReference",
        Error,
        "signal s7, which",
    );
    check(
        "signalId=\"s1\"",
        "signalId=\"s9\"",
        "<controller id=\"c1\" name",
        Error,
        "signal s9, which",
    );
    check(
        "<controller id=\"c1\" type",
        "<controller id=\"c5\" type",
        "<junction",
        Error,
        "controller c5, which",
    );
}

#[test]
fn unknown_words_are_reported() {
    for (old, new) in [
        ("type=\"driving\" level", "type=\"diving\" level"),
        ("level=\"false\"", "level=\"maybe\""),
        ("type=\"broken\"", "type=\"shattered\""),
        ("color=\"white\"", "color=\"plaid\""),
        ("weight=\"standard\"", "weight=\"heavy\""),
        ("laneChange=\"both\"", "laneChange=\"perhaps\""),
        ("rule=\"RHT\"", "rule=\"MHT\""),
        ("type=\"town\"", "type=\"village\""),
        ("pRange=\"normalized\"", "pRange=\"weird\""),
        ("dynamic=\"yes\"", "dynamic=\"often\""),
        ("s=\"51\" t=\"-7\" orientation=\"+\"", "s=\"51\" t=\"-7\" orientation=\"?\""),
        ("elementId=\"1\" contactPoint=\"end\"", "elementId=\"1\" contactPoint=\"ending\""),
    ] {
        check(old, new, new, Warning, "unknown value");
    }
}

#[test]
fn good_maps_have_no_errors() {
    let good = [
        "Town01",
        "Town02",
        "Town04",
        "Town10HD",
        "curvatures",
        "Crest",
        "roadmarks",
        "e6mini",
        "curves_elevation",
        "merge_and_split",
        "tunnels",
        "velodrome",
        "Bidirectional",
    ];
    for (name, text) in shared_maps() {
        let found = validate(&text).expect("a map that loads");
        let errors: Vec<_> = found.iter().filter(|f| f.severity == Error).collect();
        let is_good = good.iter().any(|good| name.contains(good));
        assert!(!is_good || errors.is_empty(), "{name}: {errors:#?}");
        println!(
            "validate: {name}: {} errors, {} warnings",
            errors.len(),
            found.len() - errors.len()
        );
    }
}
