//! Texts that are parsed in several parts at once.

use super::shared_maps;
use crate::{Network, build::built, surface::surface};

/// Returns a file of `count` short roads in a row, with `between` after each.
fn row_of_roads(count: usize, between: &str) -> String {
    let mut text =
        String::from("<OpenDRIVE><header revMajor=\"1\" revMinor=\"6\" name=\"row\"/>\n");
    for road in 0..count {
        let x = 20 * road;
        let lane = r#"<lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>"#;
        let mut link = String::new();
        if road > 0 {
            link += &format!(
                r#"<predecessor elementType="road" elementId="{}" contactPoint="end"/>"#,
                road - 1
            );
        }
        if road + 1 < count {
            link += &format!(
                r#"<successor elementType="road" elementId="{}" contactPoint="start"/>"#,
                road + 1
            );
        }
        text += &format!(
            r#"{between}<road name="é" length="20" id="{road}" junction="-1"><link>{link}</link>
<planView><geometry s="0" x="{x}" y="0" hdg="0" length="20"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0"/></center><right>{lane}</right></laneSection></lanes>
<objects><object id="o{road}" type="pole" s="3" t="4"/><bridge id="b" s="1" length="2"/></objects>
<signals><signal id="s{road}" s="5" t="-2" orientation="+" type="274"/><signalReference id="s0" s="6" t="-2" orientation="+"/></signals></road>
"#
        );
    }
    text + "</OpenDRIVE>"
}

fn check(name: &str, text: &str) {
    let alone = built(text, 1000, 1);
    for threads in [2, 3, 7] {
        // Not by assert_eq: it would print whole maps.
        assert!(built(text, 1000, threads) == alone, "{name} with {threads} threads");
    }
    if let Ok(network) = alone {
        let alone = surface(&network, 4.0, 1);
        for threads in [2, 3, 7] {
            assert!(surface(&network, 4.0, threads) == alone, "{name}'s mesh, {threads} threads");
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    check("roads", &row_of_roads(3000, ""));
    for (name, text) in shared_maps() {
        check(&name, &text);
    }
}

#[test]
fn text_that_only_looks_like_a_road_is_not_one() {
    let trap = format!("<!-- {} -->", "<road id=\"x\" length=\"1\"> ".repeat(20));
    let text = row_of_roads(1500, &trap);
    check("comments", &text);
    assert_eq!(Network::parse(&text).expect("a map").roads().len(), 1500);
    let text = row_of_roads(
        1500,
        &trap.replace("<!--", "<userData><![CDATA[").replace("-->", "]]></userData>"),
    );
    check("sections of text", &text);
    assert_eq!(Network::parse(&text).expect("a map").roads().len(), 1500);
}

#[test]
fn the_first_of_several_errors_is_reported() {
    let text = row_of_roads(3000, "");
    let broken = text.replace(r#"length="20" id="2900""#, r#"length="far" id="2900""#);
    check("an error", &broken);
    let line = Network::parse(&broken).expect_err("no number").line;
    let twice = broken.replace(r#"length="20" id="2000""#, r#"length="away" id="2000""#);
    let first = Network::parse(&twice).expect_err("no number").line;
    assert_eq!((first, line), (2 + 5 * 2000, 2 + 5 * 2900));
    // A file that ends too early is reported at its end.
    check("cut off", &text[..text.len() / 2]);
}
