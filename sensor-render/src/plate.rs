//! Number plates with characters by actor. Twin of plate.wgsl.
//!
//! A plate is a rectangle of [`Material::Sign`](mesh::Material::Sign) with the tint [`TINT`], on which two letters
//! and four digits are drawn. A character is a line through points of a grid.

use crate::lidar_return::mixed;

/// Tint of the rectangles that are plates.
pub(crate) const TINT: u32 = 1;

/// Albedo of the characters.
pub(crate) const INK: f32 = 0.02;

/// Width and height of a plate. Metres.
pub(crate) const SIZE_M: [f32; 2] = [0.52, 0.11];

/// Half the width of a line. Metres.
pub(crate) const HALF_LINE_M: f32 = 0.006;

/// Distance between two points of the grid of a character, and between two characters. Metres.
const UNIT_M: f32 = 0.0115;
const PITCH_M: f32 = 0.072;
/// Half the additional distance between the letters and the digits. Metres.
const SPACE_M: f32 = 0.012;

/// Points of each character: columns from 0 to 4 and rows from 0 to 6, from the lower left corner. Digits from 0 to
/// 9, then the letters A to X without I, O, Q and W.
const PATHS: [&str; 30] = [
    "10 01 05 16 36 45 41 30 10",
    "14 26 20",
    "05 16 36 45 44 00 40",
    "05 16 36 45 44 33 23 33 42 41 30 10 01",
    "30 36 02 42",
    "46 06 04 34 43 41 30 10 01",
    "45 36 16 05 01 10 30 41 42 33 03",
    "06 46 10",
    "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "01 10 30 41 45 36 16 05 04 13 43",
    "00 04 26 44 40 42 02",
    "00 06 36 45 44 33 03 33 42 41 30 00",
    "45 36 16 05 01 10 30 41",
    "00 06 36 45 41 30 00",
    "46 06 03 33 03 00 40",
    "46 06 03 33 03 00",
    "45 36 16 05 01 10 30 41 43 23",
    "00 06 03 43 46 40",
    "46 41 30 10 01",
    "00 06 02 46 13 40",
    "06 00 40",
    "00 06 23 46 40",
    "00 06 40 46",
    "00 06 36 45 44 33 03",
    "00 06 36 45 44 33 03 23 40",
    "45 36 16 05 04 13 33 42 41 30 10 01",
    "06 46 26 20",
    "06 01 10 30 41 46",
    "06 20 46",
    "00 46 23 06 40",
];
const DIGITS: u32 = 10;
const LETTERS: u32 = 20;

/// Points that a character has at most, and the code after its last one.
const POINTS_MAX: u32 = 20;
const END: u32 = 63;

/// The points of each character, five in each word: column and eight times the row in six bits.
pub(crate) const GLYPHS: [[u32; 4]; 30] = {
    let mut glyphs = [[u32::MAX >> 2; 4]; 30];
    let mut glyph = 0;
    while glyph < 30 {
        let text = PATHS[glyph].as_bytes();
        let mut point = 0;
        while point * 3 < text.len() {
            let (column, row) = (text[point * 3] - b'0', text[point * 3 + 1] - b'0');
            let shift = 6 * (point % 5);
            let word = glyphs[glyph][point / 5] & !(END << shift);
            glyphs[glyph][point / 5] = word | ((column + 8 * row) as u32) << shift;
            point += 1;
        }
        glyph += 1;
    }
    glyphs
};

/// Returns the index in [`GLYPHS`] of the character that an actor with a hash of its id shows at a place. The first
/// two of six places have letters.
fn glyph_at(seed: u32, place: u32) -> usize {
    let dice = mixed(seed ^ place.wrapping_mul(0x9e37_79b1)) >> 8;
    (if place < 2 { DIGITS + dice % LETTERS } else { dice % DIGITS }) as usize
}

/// Returns the distance in metres from the middle of the nearest line of the characters; `x` and `y` begin at the
/// lower left corner of the plate.
pub(crate) fn distance(seed: u32, x: f32, y: f32) -> f32 {
    let x = x - SIZE_M[0] * 0.5;
    let (space, from, to) = if x < -PITCH_M { (-SPACE_M, 0.0, 1.0) } else { (SPACE_M, 2.0, 5.0) };
    let place = ((x - space) * (1.0 / PITCH_M) + 3.0).floor().clamp(from, to);
    let u = (x - space - (place - 2.5) * PITCH_M) * (1.0 / UNIT_M) + 2.0;
    let v = (y - SIZE_M[1] * 0.5) * (1.0 / UNIT_M) + 3.0;
    let glyph = GLYPHS[glyph_at(seed, place as u32)];
    let point = |at: u32| glyph[(at / 5) as usize] >> (6 * (at % 5)) & END;
    let mut nearest = f32::MAX;
    let mut from = point(0);
    for at in 1..POINTS_MAX {
        let to = point(at);
        if to == END {
            break;
        }
        let [ax, ay, bx, by] = [from & 7, from >> 3, to & 7, to >> 3].map(|part| part as f32);
        let (dx, dy) = (bx - ax, by - ay);
        let t = (((u - ax) * dx + (v - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        let (ex, ey) = (u - ax - dx * t, v - ay - dy * t);
        nearest = nearest.min(ex * ex + ey * ey);
        from = to;
    }
    nearest.sqrt() * UNIT_M
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shader_has_the_same_characters() {
        let shader = include_str!("shader/plate.wgsl");
        let (_, table) = shader.split_once("array<vec4u, 30>(").unwrap();
        let (table, _) = table.split_once(");\n").unwrap();
        let number = |word: &str| word.trim_end_matches('u').parse::<u32>().ok();
        let words: Vec<u32> =
            table.split(|letter: char| !letter.is_alphanumeric()).filter_map(number).collect();
        assert_eq!(words, GLYPHS.as_flattened());
    }

    #[test]
    fn characters_are_lines_between_the_points_of_their_paths() {
        // Of 400 plates one begins with an L: a line up its left side and one along its foot.
        let l = DIGITS as usize + 10;
        let seed = (0..400).find(|seed| glyph_at(*seed, 0) == l).unwrap();
        let (left, low) = (SIZE_M[0] * 0.5 - 2.5 * PITCH_M - SPACE_M - 2.0 * UNIT_M, 0.0205);
        for (u, v, apart) in [(0.0, 3.0, 0.0), (3.0, 0.0, 0.0), (2.0, 3.0, 2.0), (4.0, 1.0, 1.0)] {
            let found = distance(seed, left + u * UNIT_M, low + v * UNIT_M);
            assert!((found - apart * UNIT_M).abs() < 1e-5, "{u} {v}: {found}");
        }
        // Between the letters and the digits there is no line.
        for seed in 0..400 {
            let high = (0..12).map(|step| f32::from(step as u8) * 0.01);
            let nearest = high.map(|y| distance(seed, SIZE_M[0] * 0.5 - PITCH_M, y));
            assert!(nearest.reduce(f32::min).unwrap() > 1.5 * HALF_LINE_M, "{seed}");
        }
    }

    #[test]
    fn plates_differ() {
        let text =
            |seed: u32| -> [usize; 6] { std::array::from_fn(|place| glyph_at(seed, place as u32)) };
        let mut all: Vec<[usize; 6]> = (1..200).map(|id| text(mixed(id))).collect();
        assert!(all.iter().all(|text| text[1] >= 10 && text[2] < 10));
        for place in 0..6 {
            let mut used: Vec<usize> = all.iter().map(|text| text[place]).collect();
            used.sort_unstable();
            used.dedup();
            assert!(used.len() >= if place < 2 { 16 } else { 8 }, "place {place}");
        }
        all.sort_unstable();
        all.dedup();
        assert!(all.len() > 195, "{}", all.len());
    }
}
