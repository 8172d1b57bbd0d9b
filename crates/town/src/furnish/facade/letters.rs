//! Lettering: the strokes of `letters.toml` as flat quadrilaterals.

use std::{collections::BTreeMap, sync::OnceLock};

use glam::{Vec2, vec2};
use serde::Deserialize;

/// The height of capital letters in the units of the file.
const HEAD: f32 = 6.0;
/// The gap between letters, and the width of a blank, in the units of the file.
const GAP: f32 = 1.7;
const BLANK: f32 = 2.4;

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Letters {
    letters: BTreeMap<String, Vec<Vec<[f32; 2]>>>,
}

/// The letters; none if the file cannot be read, which a test excludes.
fn letters() -> &'static Letters {
    static LETTERS: OnceLock<Letters> = OnceLock::new();
    LETTERS.get_or_init(|| parsed().unwrap_or_default())
}

fn parsed() -> Result<Letters, toml::de::Error> {
    toml::from_str(include_str!("letters.toml"))
}

fn strokes(letter: char) -> Option<&'static [Vec<[f32; 2]>]> {
    let mut name = [0; 4];
    let name: &str = letter.to_ascii_uppercase().encode_utf8(&mut name);
    letters().letters.get(name).map(Vec::as_slice)
}

fn width(strokes: &[Vec<[f32; 2]>]) -> f32 {
    strokes.iter().flatten().map(|point| point[0]).fold(0.0, f32::max)
}

/// Writes a text about the origin, at most `width_m` wide and with capitals of at most `height_m`:
/// the quadrilaterals of its strokes, counter-clockwise with x to the right and y up. Metres.
///
/// Characters without strokes are blank.
pub(crate) fn write(text: &str, width_m: f32, height_m: f32) -> Vec<[Vec2; 4]> {
    let advance = |letter: char| strokes(letter).map_or(BLANK, width) + GAP;
    // A single stroke has no width.
    let whole = (text.chars().map(advance).sum::<f32>() - GAP).max(1.0);
    let scale = (height_m / HEAD).min(width_m / whole);
    let half = 0.42 * scale;
    let mut at = vec2(-0.5 * whole, -0.5 * HEAD);
    let mut quads = Vec::new();
    for letter in text.chars() {
        for stroke in strokes(letter).unwrap_or_default() {
            for pair in stroke.windows(2) {
                let [from, to] = [pair[0], pair[1]].map(|p| (at + Vec2::from_array(p)) * scale);
                let along = (to - from).normalize_or_zero() * half;
                let aside = along.perp();
                let (from, to) = (from - along * 0.7, to + along * 0.7);
                quads.push([from - aside, to - aside, to + aside, from + aside]);
            }
        }
        at.x += advance(letter);
    }
    quads
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_capital_and_digit_has_strokes_and_texts_keep_to_their_size() {
        parsed().expect("the embedded letters");
        for letter in ('A'..='Z').chain('0'..='9').chain(['&', '-', '.', '\'']) {
            assert!(!write(&letter.to_string(), 1.0, 1.0).is_empty(), "{letter}");
        }
        for text in ["BAKERY", "A & B", "50", "FLOWERS AND GARDEN TOOLS"] {
            let quads = write(text, 2.0, 0.3);
            for corner in quads.iter().flatten() {
                assert!(corner.x.abs() < 1.06 && corner.y.abs() < 0.21, "{text} {corner}");
            }
            for [a, b, c, _] in quads {
                assert!((b - a).perp_dot(c - b) > 0.0);
            }
        }
        assert!(write("", 1.0, 1.0).is_empty());
    }

    /// An L stands on its foot, and its stem is on the left.
    #[test]
    fn letters_are_upright_and_not_mirrored() {
        let quads = write("L", 1.0, 1.0);
        let middle = |quad: &[Vec2; 4]| quad.iter().sum::<Vec2>() * 0.25;
        assert!(middle(&quads[0]).x < -0.2 && middle(&quads[1]).y < -0.4, "{quads:?}");
    }
}
