//! Maps of megabytes that mean little: parsed or refused, and never with a long message.

use omnibus_fuzz::{folder, target};
use road::Network;

/// The small map of the corpus.
fn small() -> String {
    std::fs::read_to_string(folder("open_drive").join("small.xodr")).unwrap()
}

#[test]
fn excessive_texts_are_rejected_or_parsed() {
    let head = "<OpenDRIVE><header revMajor=\"1\" revMinor=\"6\"/>";
    let deep = "<a>".repeat(1_000_000);
    let wide: String = (0..200_000).map(|at| format!(" a{at}=\"{at}\"")).collect();
    let small = small();
    let lane = "<lane id=\"-2\"";
    let lanes: String = (3..3000)
        .map(|id| format!("<lane id=\"-{id}\" type=\"driving\"><width sOffset=\"0\" a=\"0.01\" b=\"0\" c=\"0\" d=\"0\"/></lane>"))
        .collect();
    let repeat = |distance: &str| {
        format!(
            "<objects><object id=\"1\" type=\"barrier\" s=\"0\" t=\"0\">{}</object></objects></road>",
            format!("<repeat s=\"0\" length=\"1000000\" distance=\"{distance}\"/>").repeat(30)
        )
    };
    for (what, text) in [
        ("deep", format!("{head}{deep}")),
        (
            "deep and closed",
            small.replacen(
                "</road>",
                &format!("{}{}</road>", "<a>".repeat(300_000), "</a>".repeat(300_000)),
                1,
            ),
        ),
        ("wide", small.replacen("<road ", &format!("<road {wide} "), 1)),
        ("one name", format!("{head}<{}", "x".repeat(3_000_000))),
        (
            "ampersands",
            small.replacen("name=\"straight\"", &format!("name=\"{}\"", "&".repeat(2_000_000)), 1),
        ),
        ("comments", format!("{head}{}", "<!--".repeat(500_000))),
        ("brackets", format!("<!DOCTYPE x {}", "[".repeat(3_000_000))),
        ("lanes", small.replacen(lane, &format!("{lanes}{lane}"), 1)),
        ("repeats", small.replacen("</road>", &repeat("0.000001"), 1)),
        ("runs", small.replacen("</road>", &repeat("0"), 1)),
        ("nothing", String::new()),
        ("zeros", "\0".repeat(1_000_000)),
    ] {
        let (is_accepted, _) = target("open_drive").unwrap().check(text.as_bytes());
        let is_borne = ["deep and closed", "wide", "ampersands", "lanes", "repeats", "runs"];
        assert_eq!(is_accepted, is_borne.contains(&what), "{what}");
        if let Err(error) = Network::parse(&text) {
            assert!(error.reason.len() < 200, "{what}: {} bytes", error.reason.len());
        }
    }
}
