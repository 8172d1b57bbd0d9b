//! Broken files: bytes and attributes changed at random must never cause a panic, a hang or
//! excessive memory use.
//!
//! `OMNIBUS_SOAK=1` continues for ten minutes and prints the number of files.

use std::{
    ops::Range,
    time::{Duration, Instant},
};

use glam::DVec3;
use mesh::RandomStream;

use super::{
    made, shared_maps,
    small::{JOINED, text},
};
use crate::{LaneTypes, Network, object_paint, structures, surface_mesh, validate};

/// Replacements for numbers and words.
const VALUES: [&str; 29] = [
    "0",
    "-1",
    "1",
    "2",
    "1e9",
    "-1e9",
    "1e308",
    "1e-308",
    "nan",
    "inf",
    "-0",
    "0.5",
    "1000000",
    "4294967296",
    "-2147483648",
    "99999999999999999999",
    "",
    " ",
    "x",
    "&amp;",
    "&#0;",
    "true",
    "+",
    "1e6",
    "1e-9",
    "-1e-300",
    "0.0000001",
    "123456789012345678901234567890.5",
    "8.98e307",
];

/// Returns the text with one to four changes.
fn mutated(text: &str, random: &mut RandomStream) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(4) {
        match random.below(10) {
            // Another value for an attribute; in half of the cases, because most of a map is
            // attributes.
            0..=2 => {
                let from = random.below(bytes.len());
                let quote = |from: usize| bytes[from..].iter().position(|b| *b == b'"');
                let Some(open) = quote(from).map(|at| from + at + 1) else { continue };
                let Some(close) = quote(open).map(|at| open + at) else { continue };
                let value = VALUES[random.below(VALUES.len())];
                bytes.splice(open..close, value.bytes());
            }
            // Another byte.
            3 => {
                let at = random.below(bytes.len());
                bytes[at] = b"<>\"'/=&; \n0x-\x00"[random.below(14)];
            }
            // A missing piece.
            4 => {
                let from = random.below(bytes.len());
                let to = (from + random.below(200)).min(bytes.len());
                bytes.drain(from..to);
            }
            // Another bit.
            5 => {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            // The file ends too early.
            6 if random.below(4) == 0 => bytes.truncate(random.below(bytes.len())),
            // An element that is missing, duplicated or moved.
            6..=8 => {
                let Some(element) = element(&bytes, random.below(bytes.len())) else { continue };
                let whole = bytes[element.clone()].to_vec();
                let to = match random.below(3) {
                    0 => {
                        bytes.drain(element);
                        continue;
                    }
                    1 => element.end,
                    _ => {
                        let from = random.below(bytes.len());
                        bytes[from..].iter().position(|b| *b == b'<').map_or(0, |at| from + at)
                    }
                };
                bytes.splice(to..to, whole);
            }
            // A duplicated piece.
            _ => {
                let from = random.below(bytes.len());
                let to = (from + random.below(400)).min(bytes.len());
                let piece = bytes[from..to].to_vec();
                bytes.splice(from..from, piece);
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Returns the element that begins at or after `from`, to its own end.
fn element(bytes: &[u8], from: usize) -> Option<Range<usize>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let from = (from..text.len()).find(|at| text.is_char_boundary(*at))?;
    let begin = from
        + text[from..]
            .match_indices('<')
            .find(|(at, _)| {
                text[from + at + 1..].starts_with(|sign: char| sign.is_ascii_alphabetic())
            })?
            .0;
    let name: String =
        text[begin + 1..].chars().take_while(|sign| sign.is_ascii_alphanumeric()).collect();
    let tag_end = begin + text[begin..].find('>')? + 1;
    if text[..tag_end].ends_with("/>") {
        return Some(begin..tag_end);
    }
    let close = format!("</{name}>");
    Some(begin..tag_end + text[tag_end..].find(&close)? + close.len())
}

/// Calls every query of a network a few times.
fn ask(network: &Network, random: &mut RandomStream) {
    let lanes = network.lanes().len();
    let (low, high) = network.bounds();
    let middle = (low + high) * 0.5;
    for point in [middle, DVec3::ZERO, DVec3::splat(1e12), DVec3::NAN] {
        let Some(at) = network.nearest(point, LaneTypes::ANY) else { continue };
        let _ = (network.place(at), network.width(at), network.marks(at), network.waypoint_id(at));
        let _ = (network.advance(at, 30.0), network.retreat(at, 30.0));
        let _ = network.landmarks_ahead(at, 100.0, false);
        let _ = (network.advance_to_end(at, 50.0), network.geo(point));
        let other = crate::LaneIndex(random.below(lanes) as u32);
        let to = crate::LanePoint { lane: other, along_m: 1.0 };
        if let Some(route) = network.route(at, to) {
            assert!(route.length_m.is_finite() && !route.legs.is_empty());
        }
    }
    let total: f64 = network.roads().iter().map(|road| road.length_m).sum();
    let _ = network.waypoints(total / 200.0 + 1.0, LaneTypes::ANY);
    let _ = (network.topology(), network.landmarks().count(), network.crosswalks().count());
    if total < 3e4 {
        let _ = network.spawn_points();
        let mesh = surface_mesh(network, 10.0);
        assert!(mesh.triangles.len() < 20_000_000);
    }
    let triangles: usize = structures(network).iter().map(|one| one.mesh.triangles.len()).sum();
    assert!(triangles + object_paint(network).triangles.len() < 20_000_000);
}

/// Upper bound of the memory for maps of a few kilobytes.
const MEMORY_MAX_KB: u64 = 6_000_000;

/// Returns the peak memory of this process; 0 where the system does not tell.
fn peak_memory_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().next());
    number.and_then(|number| number.parse().ok()).unwrap_or(0)
}

#[test]
fn a_broken_map_is_an_error_or_a_map() {
    let soak = std::env::var_os("OMNIBUS_SOAK").is_some();
    let mut maps = vec![("small".to_string(), text(JOINED))];
    maps.extend(made::maps());
    maps.extend(shared_maps().into_iter().filter(|(_, text)| text.len() < 80_000));
    let begun = Instant::now();
    let (mut refused, mut loaded, mut findings) = (0, 0, 0);
    for round in 0u64.. {
        for (number, (name, text)) in maps.iter().enumerate() {
            let mut random = RandomStream::from_state(round * 1000 + number as u64 + 1);
            let text = mutated(text, &mut random);
            match Network::parse(&text) {
                Err(error) => {
                    assert!(error.line >= 1 && !error.reason.is_empty(), "{name}");
                    refused += 1;
                }
                Ok(network) => {
                    ask(&network, &mut random);
                    findings += validate(&text).expect("it was parsed").len();
                    loaded += 1;
                }
            }
        }
        let is_over = if soak {
            begun.elapsed() > Duration::from_secs(600)
        } else {
            (round + 1) as usize * maps.len() >= 600
        };
        if is_over {
            break;
        }
    }
    println!(
        "mutation: {} executions: {refused} refused, {loaded} loaded and asked, of {} maps; \
         {findings} findings",
        refused + loaded,
        maps.len()
    );
    assert!(refused > 0 && loaded > 0 && findings > 0);
    assert!(peak_memory_kb() < MEMORY_MAX_KB, "{} kB", peak_memory_kb());
}

#[test]
fn excessive_texts_are_rejected_or_parsed() {
    let head = "<OpenDRIVE><header revMajor=\"1\" revMinor=\"6\"/>";
    let deep = "<a>".repeat(1_000_000);
    let wide: String = (0..200_000).map(|at| format!(" a{at}=\"{at}\"")).collect();
    let small = text(JOINED);
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
        let answer = Network::parse(&text);
        if let Ok(network) = &answer {
            ask(network, &mut RandomStream::from_state(1));
        }
        let _ = validate(&text);
        let is_borne = ["deep and closed", "wide", "ampersands", "lanes", "repeats", "runs"];
        assert_eq!(answer.is_ok(), is_borne.contains(&what), "{what}");
        if let Err(error) = &answer {
            assert!(error.reason.len() < 200, "{what}: {} bytes", error.reason.len());
        }
    }
    assert!(peak_memory_kb() < MEMORY_MAX_KB, "{} kB", peak_memory_kb());
}
