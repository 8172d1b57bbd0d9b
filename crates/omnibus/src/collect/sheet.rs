//! Tiles of pictures on one sheet.

use crate::collect::decode::Image;

const GAP: usize = 4;
const BACKGROUND: [u8; 3] = [24, 24, 26];

/// Tiles on a background.
pub(crate) struct Sheet {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) tile: [usize; 2],
    pub(crate) pixels: Vec<u8>,
}

impl Sheet {
    pub(crate) fn new(columns: usize, rows: usize, tile: [usize; 2]) -> Sheet {
        let [width, height] = [columns * (tile[0] + GAP) + GAP, rows * (tile[1] + GAP) + GAP];
        Sheet { width, height, tile, pixels: BACKGROUND.repeat(width * height) }
    }

    pub(crate) fn draw(
        &mut self,
        column: usize,
        row: usize,
        color: impl Fn(usize, usize) -> [u8; 3],
    ) {
        for y in 0..self.tile[1] {
            for x in 0..self.tile[0] {
                self.dot(column, row, [x, y], color(x, y));
            }
        }
    }

    pub(crate) fn dot(&mut self, column: usize, row: usize, [x, y]: [usize; 2], color: [u8; 3]) {
        let x = GAP + column * (self.tile[0] + GAP) + x;
        let y = GAP + row * (self.tile[1] + GAP) + y;
        self.pixels[(y * self.width + x) * 3..][..3].copy_from_slice(&color);
    }

    pub(crate) fn outline(&mut self, column: usize, row: usize, edges: [usize; 4], color: [u8; 3]) {
        let [left, top, right, bottom] = edges;
        let (right, bottom) = (right.min(self.tile[0] - 1), bottom.min(self.tile[1] - 1));
        for x in left..=right {
            self.dot(column, row, [x, top.min(bottom)], color);
            self.dot(column, row, [x, bottom], color);
        }
        for y in top..=bottom {
            self.dot(column, row, [left.min(right), y], color);
            self.dot(column, row, [right, y], color);
        }
    }
}

/// Returns the mean colour of the pixels below a pixel of a tile.
pub(crate) fn mean(image: &Image, [x, y]: [usize; 2], scale: f32) -> [u8; 3] {
    let span = |p: usize, end: usize| {
        let from = ((p as f32 * scale) as usize).min(end - 1);
        from..(((p + 1) as f32 * scale) as usize).clamp(from + 1, end)
    };
    let (mut sum, mut count) = ([0usize; 3], 0);
    for v in span(y, image.height) {
        for u in span(x, image.width) {
            let at = (v * image.width + u) * 3;
            for (total, value) in sum.iter_mut().zip(&image.bytes[at..at + 3]) {
                *total += usize::from(*value);
            }
            count += 1;
        }
    }
    sum.map(|total| (total / count) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_lies_in_its_row_and_column() {
        let mut sheet = Sheet::new(2, 2, [3, 2]);
        sheet.dot(1, 1, [2, 1], [255, 0, 0]);
        let (x, y) = (GAP + 3 + GAP + 2, GAP + 2 + GAP + 1);
        assert_eq!(sheet.pixels[(y * sheet.width + x) * 3..][..3], [255, 0, 0]);
        assert_eq!(sheet.pixels.iter().filter(|p| **p == 255).count(), 1);
    }
}
