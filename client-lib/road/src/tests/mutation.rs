//! Broken files: bytes and attributes changed at random must never panic, hang or fill memory.
//!
//! `OMNIBUS_SOAK=1` tries a hundred times as many.

use super::shared_maps;
use super::small::{JOINED, text};
use crate::{LaneTypes, Network, surface_mesh};
use glam::DVec3;

/// The generator "splitmix64" (Steele, Lea, Flood 2014).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.roll() % end.max(1) as u64) as usize
    }
}

/// What numbers and words are replaced by.
const VALUES: [&str; 24] = [
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
];

/// The text with one to four things changed.
fn mutated(text: &str, dice: &mut Dice) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=dice.below(4) {
        match dice.below(6) {
            // Another value for an attribute; half the time, as attributes are what maps are of.
            0..=2 => {
                let from = dice.below(bytes.len());
                let quote = |from: usize| bytes[from..].iter().position(|b| *b == b'"');
                let Some(open) = quote(from).map(|at| from + at + 1) else { continue };
                let Some(close) = quote(open).map(|at| open + at) else { continue };
                let value = VALUES[dice.below(VALUES.len())];
                bytes.splice(open..close, value.bytes());
            }
            // Another byte.
            3 => {
                let at = dice.below(bytes.len());
                bytes[at] = b"<>\"'/=&; \n0x-\x00"[dice.below(14)];
            }
            // A piece is missing.
            4 => {
                let from = dice.below(bytes.len());
                let to = (from + dice.below(200)).min(bytes.len());
                bytes.drain(from..to);
            }
            // A piece comes twice.
            _ => {
                let from = dice.below(bytes.len());
                let to = (from + dice.below(400)).min(bytes.len());
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

/// Asks a network everything that it can be asked, a little.
fn ask(network: &Network, dice: &mut Dice) {
    let lanes = network.lanes().len();
    let (low, high) = network.bounds();
    let middle = (low + high) * 0.5;
    for point in [middle, DVec3::ZERO, DVec3::splat(1e12), DVec3::NAN] {
        let Some(at) = network.nearest(point, LaneTypes::ANY) else { continue };
        let _ = (network.place(at), network.width(at), network.marks(at), network.waypoint_id(at));
        let _ = (network.advance(at, 30.0), network.retreat(at, 30.0));
        let _ = network.landmarks_ahead(at, 100.0, false);
        let _ = (network.advance_to_end(at, 50.0), network.geo(point));
        let other = crate::LaneIndex(dice.below(lanes) as u32);
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
}

#[test]
fn a_broken_map_is_an_error_or_a_map() {
    let soak = std::env::var_os("OMNIBUS_SOAK").is_some();
    let mut maps = vec![("small".to_string(), text(JOINED))];
    maps.extend(shared_maps().into_iter().filter(|(_, text)| text.len() < 80_000));
    let each = if soak { 40_000 } else { 400 };
    let (mut refused, mut loaded) = (0, 0);
    for (number, (name, text)) in maps.iter().enumerate() {
        let mut dice = Dice(number as u64 + 1);
        for _ in 0..each / maps.len().max(1) + 20 {
            let text = mutated(text, &mut dice);
            match Network::parse(&text) {
                Err(error) => {
                    assert!(error.line >= 1 && !error.reason.is_empty(), "{name}");
                    refused += 1;
                }
                Ok(network) => {
                    ask(&network, &mut dice);
                    loaded += 1;
                }
            }
        }
    }
    println!("mutation: {refused} refused, {loaded} loaded and asked, of {} maps", maps.len());
    assert!(refused > 0 && loaded > 0);
}
