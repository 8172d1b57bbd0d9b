//! Bitmap font for texts in images: glyphs of 5 by 7 dots.

/// Width and height of a glyph in dots, without the gap to the next.
pub(crate) const SIZE: [u32; 2] = [5, 7];
/// Dots from the begin of one letter to the begin of the next.
pub(crate) const ADVANCE: u32 = 6;
/// Number of glyphs: ASCII from blank to tilde, and one for all other characters.
pub(crate) const COUNT: usize = 96;

/// Rows of each glyph from top to bottom; five bits each, the leftmost dot in the highest.
#[rustfmt::skip]
const ROWS: [[u8; 7]; COUNT] = [
    [0; 7], [4, 4, 4, 4, 4, 0, 4], [10, 10, 0, 0, 0, 0, 0], [10, 10, 31, 10, 31, 10, 10],
    [4, 15, 20, 14, 5, 30, 4], [24, 25, 2, 4, 8, 19, 3], [12, 18, 20, 8, 21, 18, 13],
    [4, 4, 0, 0, 0, 0, 0], [2, 4, 8, 8, 8, 4, 2], [8, 4, 2, 2, 2, 4, 8],
    [0, 4, 21, 14, 21, 4, 0], [0, 4, 4, 31, 4, 4, 0], [0, 0, 0, 0, 12, 4, 8],
    [0, 0, 0, 31, 0, 0, 0], [0, 0, 0, 0, 0, 12, 12], [0, 1, 2, 4, 8, 16, 0],
    // 0 to 9
    [14, 17, 19, 21, 25, 17, 14], [4, 12, 4, 4, 4, 4, 14], [14, 17, 1, 2, 4, 8, 31],
    [31, 2, 4, 2, 1, 17, 14], [2, 6, 10, 18, 31, 2, 2], [31, 16, 30, 1, 1, 17, 14],
    [6, 8, 16, 30, 17, 17, 14], [31, 1, 2, 4, 8, 8, 8], [14, 17, 17, 14, 17, 17, 14],
    [14, 17, 17, 15, 1, 2, 12],
    // : ; < = > ? @
    [0, 12, 12, 0, 12, 12, 0], [0, 12, 12, 0, 12, 4, 8], [2, 4, 8, 16, 8, 4, 2],
    [0, 0, 31, 0, 31, 0, 0], [8, 4, 2, 1, 2, 4, 8], [14, 17, 1, 2, 4, 0, 4],
    [14, 17, 1, 13, 21, 21, 14],
    // A to Z
    [14, 17, 17, 17, 31, 17, 17], [30, 17, 17, 30, 17, 17, 30], [14, 17, 16, 16, 16, 17, 14],
    [28, 18, 17, 17, 17, 18, 28], [31, 16, 16, 30, 16, 16, 31], [31, 16, 16, 30, 16, 16, 16],
    [14, 17, 16, 23, 17, 17, 15], [17, 17, 17, 31, 17, 17, 17], [14, 4, 4, 4, 4, 4, 14],
    [7, 2, 2, 2, 2, 18, 12], [17, 18, 20, 24, 20, 18, 17], [16, 16, 16, 16, 16, 16, 31],
    [17, 27, 21, 21, 17, 17, 17], [17, 17, 25, 21, 19, 17, 17], [14, 17, 17, 17, 17, 17, 14],
    [30, 17, 17, 30, 16, 16, 16], [14, 17, 17, 17, 21, 18, 13], [30, 17, 17, 30, 20, 18, 17],
    [15, 16, 16, 14, 1, 1, 30], [31, 4, 4, 4, 4, 4, 4], [17, 17, 17, 17, 17, 17, 14],
    [17, 17, 17, 17, 17, 10, 4], [17, 17, 17, 21, 21, 21, 10], [17, 17, 10, 4, 10, 17, 17],
    [17, 17, 17, 10, 4, 4, 4], [31, 1, 2, 4, 8, 16, 31],
    // [ \ ] ^ _ `
    [14, 8, 8, 8, 8, 8, 14], [0, 16, 8, 4, 2, 1, 0], [14, 2, 2, 2, 2, 2, 14],
    [4, 10, 17, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 31], [8, 4, 2, 0, 0, 0, 0],
    // a to z
    [0, 0, 14, 1, 15, 17, 15], [16, 16, 22, 25, 17, 17, 30], [0, 0, 14, 16, 16, 17, 14],
    [1, 1, 13, 19, 17, 17, 15], [0, 0, 14, 17, 31, 16, 14], [6, 9, 8, 28, 8, 8, 8],
    [0, 15, 17, 17, 15, 1, 14], [16, 16, 22, 25, 17, 17, 17], [4, 0, 12, 4, 4, 4, 14],
    [2, 0, 6, 2, 2, 18, 12], [16, 16, 18, 20, 24, 20, 18], [12, 4, 4, 4, 4, 4, 14],
    [0, 0, 26, 21, 21, 17, 17], [0, 0, 22, 25, 17, 17, 17], [0, 0, 14, 17, 17, 17, 14],
    [0, 0, 30, 17, 30, 16, 16], [0, 0, 13, 19, 15, 1, 1], [0, 0, 22, 25, 16, 16, 16],
    [0, 0, 14, 16, 14, 1, 30], [8, 8, 28, 8, 8, 9, 6], [0, 0, 17, 17, 17, 19, 13],
    [0, 0, 17, 17, 17, 10, 4], [0, 0, 17, 17, 21, 21, 10], [0, 0, 17, 10, 4, 10, 17],
    [0, 0, 17, 17, 15, 1, 14], [0, 0, 31, 2, 4, 8, 31],
    // { | } ~, and a box
    [2, 4, 4, 8, 4, 4, 2], [4, 4, 4, 4, 4, 4, 4], [8, 4, 4, 2, 4, 4, 8],
    [0, 0, 8, 21, 2, 0, 0], [31, 17, 17, 17, 17, 17, 31],
];

/// Returns a glyph as bits: bit `5 row + column` is set where the glyph has a dot.
const fn dots(rows: [u8; 7]) -> u64 {
    let (mut dots, mut row) = (0, 0);
    while row < 7 {
        // The highest of the five bits is the leftmost dot.
        let first = (rows[row].reverse_bits() >> 3) as u64;
        dots |= first << (5 * row);
        row += 1;
    }
    dots
}

/// Bits of each glyph; shaders read them as two words.
pub(crate) const GLYPHS: [u64; COUNT] = {
    let (mut glyphs, mut at) = ([0; COUNT], 0);
    while at < COUNT {
        glyphs[at] = dots(ROWS[at]);
        at += 1;
    }
    glyphs
};

/// Returns the index of the glyph of a character.
pub(crate) fn glyph_index(letter: char) -> u8 {
    match letter {
        ' '..='~' => letter as u8 - b' ',
        _ => (COUNT - 1) as u8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(letter: char) -> String {
        let glyph = GLYPHS[glyph_index(letter) as usize];
        let dot = |at: u32| if glyph >> at & 1 != 0 { '#' } else { '.' };
        let row = |row: u32| (0..5).map(|column| dot(row * 5 + column)).collect::<String>();
        (0..7).map(row).collect::<Vec<_>>().join("/")
    }

    #[test]
    fn letters_read_from_left_to_right_and_down() {
        assert_eq!(drawn('L'), "#..../#..../#..../#..../#..../#..../#####");
        assert_eq!(drawn('7'), "#####/....#/...#./..#../.#.../.#.../.#...");
        assert_eq!(drawn('{'), "...#./..#../..#../.#.../..#../..#../...#.");
        assert_eq!(drawn('é'), "#####/#...#/#...#/#...#/#...#/#...#/#####");
    }

    #[test]
    fn no_two_glyphs_are_equal() {
        let mut all = GLYPHS.to_vec();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), COUNT);
    }
}
