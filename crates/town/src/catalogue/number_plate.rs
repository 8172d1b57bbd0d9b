//! Number plates.

use glam::vec3;
use mesh::{Material, RandomStream};

use crate::{
    catalogue::end::{End, OUT_M},
    mesh_builder::MeshBuilder,
};

/// Adds a number plate with six characters and its lower edge at `z`; `number` decides the characters.
pub(super) fn number_plate(builder: &mut MeshBuilder, end: &End, z: f32, number: usize) {
    let forward = end.forward();
    let front =
        [z + 0.02, z + 0.055, z + 0.09].map(|z| end.ahead(0.0, z).map(|hit| hit.0.x * forward));
    let middle = front.iter().flatten().copied().reduce(f32::max);
    let x = middle.unwrap_or(end.place(0.0).0[0] * forward) * forward + forward * OUT_M * 0.6;
    builder.material(Material::Sign);
    let back = x - forward * 0.05;
    builder.block(vec3(x.min(back), -0.26, z), vec3(x.max(back), 0.26, z + 0.11));
    builder.tinted(Material::Plastic, [16, 18, 24]);
    let x = x + forward * 0.003;
    let mut random = RandomStream::named(0x91a7e, number as u64);
    for place in 0..6 {
        let glyph =
            if place < 2 { LETTERS[random.below(LETTERS.len())] } else { DIGITS[random.below(10)] };
        // Seen from ahead, the text runs towards the vehicle's left, and from behind to its right.
        let left = (place as f32 - 2.5) * 0.072 + if place < 2 { -0.012 } else { 0.012 };
        for (bit, [from, to]) in STROKES.iter().enumerate() {
            if glyph >> bit & 1 == 0 {
                continue;
            }
            let corner = |u: f32, v: f32| vec3(x, (left + u) * forward, z + 0.055 + v);
            let (a, b) = (from.map(|c| c * 0.026), to.map(|c| c * 0.026));
            let low = [a[0].min(b[0]) - 0.005, a[1].min(b[1]) - 0.005];
            let high = [a[0].max(b[0]) + 0.005, a[1].max(b[1]) + 0.005];
            builder.quad([
                corner(low[0], low[1]),
                corner(high[0], low[1]),
                corner(high[0], high[1]),
                corner(low[0], high[1]),
            ]);
        }
    }
}

/// The seven strokes of a character, from and to in half widths: top, both upper sides, middle,
/// both lower sides, bottom.
const STROKES: [[[f32; 2]; 2]; 7] = [
    [[-0.7, 1.3], [0.7, 1.3]],
    [[-0.7, 0.0], [-0.7, 1.3]],
    [[0.7, 0.0], [0.7, 1.3]],
    [[-0.7, 0.0], [0.7, 0.0]],
    [[-0.7, -1.3], [-0.7, 0.0]],
    [[0.7, -1.3], [0.7, 0.0]],
    [[-0.7, -1.3], [0.7, -1.3]],
];
/// The strokes of the digits, one bit each.
const DIGITS: [u8; 10] = [
    0b111_0111, 0b010_0100, 0b101_1101, 0b110_1101, 0b010_1110, 0b110_1011, 0b111_1011, 0b010_0101,
    0b111_1111, 0b110_1111,
];
/// The strokes of A, C, E, F, H, J, L, P and U.
const LETTERS: [u8; 9] = [
    0b011_1111, 0b101_0011, 0b101_1011, 0b001_1011, 0b011_1110, 0b111_0100, 0b101_0010, 0b001_1111,
    0b111_0110,
];
