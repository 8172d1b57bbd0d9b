//! A drawing of flat shapes, written as PNG or SVG.

use std::io::Write;

use glam::DVec2;

use crate::map::glyphs;

/// sRGB and opacity, 0 to 255.
pub(super) type Color = [u8; 4];

/// One shape, in metres. Later shapes cover earlier ones.
pub(super) enum Shape {
    /// A filled polygon.
    Area { corners: Vec<DVec2>, color: Color },
    /// A line through points, with a width in metres and a minimum width in pixels.
    Line { points: Vec<DVec2>, width_m: f64, width_px: f64, color: Color },
    /// A filled circle with a radius in pixels.
    Dot { at: DVec2, radius_px: f64, color: Color },
    /// Text centred at a point; one dot of a letter is `dot_px` pixels wide.
    Words { at: DVec2, text: String, dot_px: f64, color: Color },
}

/// The shapes, and the part of the world that the picture shows; y points up.
pub(super) struct Drawing {
    pub(super) low: DVec2,
    pub(super) size: [u32; 2],
    pub(super) pixels_per_m: f64,
    pub(super) background: Color,
    pub(super) shapes: Vec<Shape>,
}

/// Each pixel is the mean of this many by this many samples.
const FINE: usize = 2;

impl Drawing {
    /// Converts metres to pixels; y points down.
    fn pixel(&self, at: DVec2) -> DVec2 {
        let from_low = (at - self.low) * self.pixels_per_m;
        DVec2::new(from_low.x, f64::from(self.size[1]) - from_low.y)
    }

    /// Writes the drawing as PNG.
    pub(super) fn write_png(&self, file: &mut dyn Write) -> anyhow::Result<()> {
        let mut raster = Raster::new(self.size, self.background);
        for shape in &self.shapes {
            match shape {
                Shape::Area { corners, color } => {
                    let corners: Vec<DVec2> = corners.iter().map(|at| self.pixel(*at)).collect();
                    raster.area(&corners, *color);
                }
                Shape::Line { points, width_m, width_px, color } => {
                    let half = 0.5 * (width_m * self.pixels_per_m).max(*width_px);
                    let points: Vec<DVec2> = points.iter().map(|at| self.pixel(*at)).collect();
                    points.windows(2).for_each(|ends| raster.bar(ends[0], ends[1], half, *color));
                }
                Shape::Dot { at, radius_px, color } => {
                    let at = self.pixel(*at);
                    let corner = |n: i32| {
                        at + DVec2::from_angle(f64::from(n) * std::f64::consts::TAU / 12.0)
                            * *radius_px
                    };
                    raster.area(&(0..12).map(corner).collect::<Vec<_>>(), *color);
                }
                Shape::Words { at, text, dot_px, color } => {
                    raster.words(self.pixel(*at), text, *dot_px, *color);
                }
            }
        }
        let mut encoder = png::Encoder::new(file, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&raster.pixels())?;
        writer.finish()?;
        Ok(())
    }

    /// Writes the drawing as SVG.
    pub(super) fn write_svg(&self, file: &mut dyn Write) -> anyhow::Result<()> {
        let [width, height] = self.size;
        let paint = |color: &Color| {
            let [r, g, b, a] = color;
            format!("#{r:02x}{g:02x}{b:02x}{a:02x}")
        };
        let list = |points: &[DVec2]| {
            let words = points.iter().map(|at| {
                let at = self.pixel(*at);
                format!("{:.2},{:.2}", at.x, at.y)
            });
            words.collect::<Vec<_>>().join(" ")
        };
        writeln!(
            file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"{}\"/>",
            paint(&self.background)
        )?;
        for shape in &self.shapes {
            match shape {
                Shape::Area { corners, color } => {
                    let points = list(corners);
                    writeln!(file, "<polygon points=\"{points}\" fill=\"{}\"/>", paint(color))?;
                }
                Shape::Line { points, width_m, width_px, color } => {
                    let width = (width_m * self.pixels_per_m).max(*width_px);
                    writeln!(
                        file,
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width:.2}\"/>",
                        list(points),
                        paint(color)
                    )?;
                }
                Shape::Dot { at, radius_px, color } => {
                    let at = self.pixel(*at);
                    writeln!(
                        file,
                        "<circle cx=\"{:.2}\" cy=\"{:.2}\" r=\"{radius_px}\" fill=\"{}\"/>",
                        at.x,
                        at.y,
                        paint(color)
                    )?;
                }
                Shape::Words { at, text, dot_px, color } => {
                    let at = self.pixel(*at);
                    let text = text.replace('&', "&amp;").replace('<', "&lt;");
                    writeln!(
                        file,
                        "<text x=\"{:.2}\" y=\"{:.2}\" fill=\"{}\" font-size=\"{}\" \
                         font-family=\"monospace\" text-anchor=\"middle\" \
                         dominant-baseline=\"middle\">{text}</text>",
                        at.x,
                        at.y,
                        paint(color),
                        dot_px * 7.0
                    )?;
                }
            }
        }
        writeln!(file, "</svg>")?;
        Ok(())
    }
}

/// Samples in a grid finer than the picture.
struct Raster {
    width: usize,
    height: usize,
    fine: Vec<[u8; 3]>,
    /// Positions where outlines cross a row, with the direction: 1 downwards, -1 upwards.
    crossings: Vec<(f64, i32)>,
}

impl Raster {
    fn new(size: [u32; 2], [r, g, b, _]: Color) -> Raster {
        let (width, height) = (size[0] as usize * FINE, size[1] as usize * FINE);
        Raster { width, height, fine: vec![[r, g, b]; width * height], crossings: Vec::new() }
    }

    /// Fills a polygon by the non-zero rule, as SVG does: a road that crosses itself has no hole.
    fn area(&mut self, corners: &[DVec2], color: Color) {
        let fine = FINE as f64;
        let top = corners.iter().fold(f64::INFINITY, |top, at| top.min(at.y)) * fine;
        let end = corners.iter().fold(f64::NEG_INFINITY, |end, at| end.max(at.y)) * fine;
        let first = (top - 0.5).ceil().max(0.0) as usize;
        let last = (end - 0.5).floor().min(self.height as f64 - 1.0);
        if corners.len() < 3 || last < 0.0 {
            return;
        }
        for row in first..=last as usize {
            let y = (row as f64 + 0.5) / fine;
            let mut crossings = std::mem::take(&mut self.crossings);
            crossings.clear();
            let mut from = corners[corners.len() - 1];
            for to in corners {
                if (from.y <= y) != (to.y <= y) {
                    let x = from.x + (y - from.y) / (to.y - from.y) * (to.x - from.x);
                    crossings.push((x, if from.y <= y { 1 } else { -1 }));
                }
                from = *to;
            }
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut winding = 0;
            for ends in crossings.windows(2) {
                winding += ends[0].1;
                if winding == 0 {
                    continue;
                }
                let [begin, end] = [ends[0].0, ends[1].0]
                    .map(|x| (x * fine - 0.5).ceil().clamp(0.0, self.width as f64) as usize);
                for pixel in &mut self.fine[row * self.width..][begin..end.max(begin)] {
                    blend(pixel, color);
                }
            }
            self.crossings = crossings;
        }
    }

    /// Draws a straight line.
    fn bar(&mut self, from: DVec2, to: DVec2, half: f64, color: Color) {
        let side = (to - from).normalize_or_zero().perp() * half;
        self.area(&[from + side, to + side, to - side, from - side], color);
    }

    fn words(&mut self, middle: DVec2, text: &str, dot: f64, color: Color) {
        let [columns, rows] = glyphs::SIZE;
        let step = dot * (columns + 1) as f64;
        let length = step * text.chars().count() as f64 - dot;
        let corner = middle - DVec2::new(0.5 * length, 0.5 * dot * rows as f64);
        for (letter, index) in text.chars().zip(0u32..) {
            for (column, row) in (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r))) {
                if glyphs::is_set(letter, column, row) {
                    let at =
                        DVec2::new(column as f64 * dot + f64::from(index) * step, row as f64 * dot);
                    let low = corner + at;
                    let (x, y) = (DVec2::X * dot, DVec2::Y * dot);
                    self.area(&[low, low + x, low + x + y, low + y], color);
                }
            }
        }
    }

    /// Returns the picture: rows from the top, three bytes per pixel.
    fn pixels(&self) -> Vec<u8> {
        let (width, height) = (self.width / FINE, self.height / FINE);
        let mut pixels = Vec::with_capacity(width * height * 3);
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column)))
        {
            for channel in 0..3 {
                let dots = (0..FINE * FINE).map(|n| {
                    let at = (row * FINE + n / FINE) * self.width + column * FINE + n % FINE;
                    u32::from(self.fine[at][channel])
                });
                pixels.push((dots.sum::<u32>() / (FINE * FINE) as u32) as u8);
            }
        }
        pixels
    }
}

fn blend(pixel: &mut [u8; 3], [r, g, b, cover]: Color) {
    let cover = u32::from(cover);
    for (old, new) in pixel.iter_mut().zip([r, g, b]) {
        *old = ((u32::from(*old) * (255 - cover) + u32::from(new) * cover + 127) / 255) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_that_overlaps_itself_has_no_hole() {
        // The same square twice, in the same direction.
        let square = [(2.0, 2.0), (8.0, 2.0), (8.0, 8.0), (2.0, 8.0)];
        let twice: Vec<DVec2> =
            square.iter().chain(&square).map(|(x, y)| DVec2::new(*x, *y)).collect();
        let mut raster = Raster::new([10, 10], [0, 0, 0, 255]);
        raster.area(&twice, [9, 8, 7, 255]);
        let at = |x: usize, y: usize| raster.fine[y * FINE * raster.width + x * FINE];
        assert_eq!([at(5, 5), at(1, 5)], [[9, 8, 7], [0, 0, 0]]);
    }
}
