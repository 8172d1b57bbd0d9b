//! Mutations of inputs: bytes, numbers, pieces, and elements of markup.

use std::ops::Range;

use mesh::RandomStream;

/// Replacements for the values of attributes and for numbers in text.
const VALUES: &[&str] = &[
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

/// Numbers at the edges of their types, which replace words.
const EDGES: &[u64] = &[
    0,
    1,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    u64::MAX,
    // NaN, infinity, 3e38 and a subnormal number of single precision; NaN and infinity of double.
    0x7fc0_0000,
    0x7f80_0000,
    0x7f61_b1e6,
    0x0000_0010,
    0x7ff8_0000_0000_0000,
    0x7ff0_0000_0000_0000,
];

/// Returns one of the seeds with one to four changes.
pub(crate) fn mutate(seeds: &[&[u8]], is_markup: bool, random: &mut RandomStream) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].to_vec();
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            bytes.push(0);
        }
        if is_markup && random.below(10) < 6 {
            change_markup(&mut bytes, random);
        } else {
            change_bytes(&mut bytes, seeds, random);
        }
    }
    bytes
}

fn change_bytes(bytes: &mut Vec<u8>, seeds: &[&[u8]], random: &mut RandomStream) {
    let at = random.below(bytes.len());
    match random.below(11) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.below(256) as u8,
        // A number at the edge of its type.
        2 | 3 => {
            let width = 1 << random.below(4);
            let edge = EDGES[random.below(EDGES.len())].to_le_bytes();
            let end = (at + width).min(bytes.len());
            bytes[at..end].copy_from_slice(&edge[..end - at]);
        }
        // A slightly different number.
        4 => bytes[at] = bytes[at].wrapping_add(random.below(9) as u8).wrapping_sub(4),
        5 => {
            let end = (at + random.below(64)).min(bytes.len());
            bytes.drain(at..end);
        }
        6 => {
            let piece = piece(bytes, random).to_vec();
            bytes.splice(at..at, piece);
        }
        // A piece of another seed, inserted or over what is there.
        7 => {
            let piece = piece(seeds[random.below(seeds.len())], random).to_vec();
            let end = if random.below(2) == 0 { at } else { (at + piece.len()).min(bytes.len()) };
            bytes.splice(at..end, piece);
        }
        8 => bytes.insert(at, random.below(256) as u8),
        // Another number in text.
        9 => {
            let digit = |from: usize| bytes[from..].iter().position(u8::is_ascii_digit);
            let Some(begin) = digit(at).map(|digit| at + digit) else { return };
            let rest = bytes[begin..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.');
            let end = begin + rest.count();
            bytes.splice(begin..end, VALUES[random.below(VALUES.len())].bytes());
        }
        _ if random.below(4) == 0 => bytes.truncate(at),
        _ => bytes[at] = b"<>\"'/=&; \n0x-\x00"[random.below(14)],
    }
}

fn piece<'a>(of: &'a [u8], random: &mut RandomStream) -> &'a [u8] {
    if of.is_empty() {
        return of;
    }
    let from = random.below(of.len());
    &of[from..(from + random.below(200)).min(of.len())]
}

fn change_markup(bytes: &mut Vec<u8>, random: &mut RandomStream) {
    let from = random.below(bytes.len());
    if random.below(2) == 0 {
        // Another value for an attribute.
        let quote = |from: usize| bytes[from..].iter().position(|b| *b == b'"');
        let Some(open) = quote(from).map(|at| from + at + 1) else { return };
        let Some(close) = quote(open).map(|at| open + at) else { return };
        bytes.splice(open..close, VALUES[random.below(VALUES.len())].bytes());
        return;
    }
    // An element that is missing, duplicated or moved.
    let Some(element) = element(bytes, from) else { return };
    let whole = bytes[element.clone()].to_vec();
    let to = match random.below(3) {
        0 => {
            bytes.drain(element);
            return;
        }
        1 => element.end,
        _ => {
            let from = random.below(bytes.len());
            bytes[from..].iter().position(|b| *b == b'<').map_or(0, |at| from + at)
        }
    };
    bytes.splice(to..to, whole);
}

/// Returns the element that begins at or after `from`, to its own end.
fn element(bytes: &[u8], from: usize) -> Option<Range<usize>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let from = (from..text.len()).find(|at| text.is_char_boundary(*at))?;
    let begins =
        |at: usize| text[from + at + 1..].starts_with(|sign: char| sign.is_ascii_alphabetic());
    let begin = from + text[from..].match_indices('<').find(|(at, _)| begins(*at))?.0;
    let name: String =
        text[begin + 1..].chars().take_while(|sign| sign.is_ascii_alphanumeric()).collect();
    let tag_end = begin + text[begin..].find('>')? + 1;
    if text[..tag_end].ends_with("/>") {
        return Some(begin..tag_end);
    }
    let close = format!("</{name}>");
    Some(begin..tag_end + text[tag_end..].find(&close)? + close.len())
}
