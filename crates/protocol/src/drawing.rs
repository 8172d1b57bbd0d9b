//! Debug shapes: points, lines, arrows, boxes and texts drawn over camera images.

use bytemuck::{Pod, Zeroable};

use crate::{
    Frame, Stamp,
    outcome::Answer,
    range::{each, within},
};

/// The most shapes that exist at a time.
pub const SHAPES_MAX: usize = 16_384;
/// The most bytes of a text.
pub const SHAPE_TEXT_BYTES: usize = 124;
/// Largest coordinate of a shape, metres.
const FAR_M: f32 = 1e5;
/// Largest size and thickness of a shape, metres.
const LARGE_M: f32 = 1e4;
/// Largest minimum line width, pixels.
const PIXELS_MAX: f32 = 256.0;

/// Values of [`Shape::kind`].
pub mod shape {
    /// A sphere at `begin_m`.
    pub const POINT: u32 = 1;
    /// A line from `begin_m` to `end_m`.
    pub const LINE: u32 = 2;
    /// A line with four barbs at its end, each `head_m` back and to the sides.
    pub const ARROW: u32 = 3;
    /// The twelve edges of a box with centre `begin_m`, half extents `end_m` and orientation
    /// `rotation`.
    pub const BOX: u32 = 4;
    /// Text that faces the camera, centred at `begin_m`, of the same pixel size at every distance.
    pub const TEXT: u32 = 5;

    /// Value of [`super::Shape::life_nanos`]: the shape stays until it is erased.
    pub const FOR_EVER: u64 = u64::MAX;
}

/// Parameters of [`crate::Command::Draw`]. Shapes appear in the colour output of cameras, hidden by nearer
/// surfaces. No other output, no lidar and no collision is affected.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Shape {
    /// Life time in simulated time from the first frame that shows the shape; 0: one frame only;
    /// [`shape::FOR_EVER`].
    pub life_nanos: u64,
    /// One of [`shape`].
    pub kind: u32,
    /// Red, green, blue, 255; sRGB.
    pub color: u32,
    /// First point in world space; the centre of a box or text.
    pub begin_m: [f32; 3],
    /// Second point in world space; the half extents of a box.
    pub end_m: [f32; 3],
    /// Boxes: the rotation of `world_from_box` as x, y, z, w.
    pub rotation: [f32; 4],
    /// Thickness of lines; diameter of a point.
    pub size_m: f32,
    /// Minimum width of lines in the image, pixels.
    pub pixels: f32,
    /// Arrows: length of the barbs along the arrow and to each side.
    pub head_m: f32,
    /// Texts: 1 draws a dark shadow behind the letters.
    pub shadow: u32,
    /// UTF-8, padded with zeros.
    pub text: [u8; SHAPE_TEXT_BYTES],
    /// Reserved; 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<Shape>() == 200);

/// The response to [`crate::Command::Draw`], in the outcome whose id names the shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct ShapeReceipt {
    /// The first frame that shows the shape.
    pub frame: Frame,
    /// Simulated time from which the shape is no longer shown; 0: it is shown in one frame only.
    pub until_nanos: u64,
}

/// Parameters of [`crate::Command::EraseShapes`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct EraseShapes {
    /// 1: removes all shapes other than texts.
    pub shapes: u32,
    /// 1: removes all texts.
    pub texts: u32,
}

impl EraseShapes {
    /// Removes every shape.
    pub const ALL: EraseShapes = EraseShapes { shapes: 1, texts: 1 };

    /// Whether the command removes this shape.
    pub fn takes(&self, shape: &Shape) -> bool {
        if shape.kind == shape::TEXT { self.texts != 0 } else { self.shapes != 0 }
    }
}

impl Shape {
    /// A white, thin shape of the kind that is never removed, without coordinates.
    pub fn new(kind: u32) -> Shape {
        Shape {
            life_nanos: shape::FOR_EVER,
            kind,
            color: !0,
            pixels: 1.5,
            rotation: [0.0, 0.0, 0.0, 1.0],
            ..Shape::zeroed()
        }
    }

    /// The text.
    pub fn text(&self) -> &str {
        let end = self.text.iter().position(|&b| b == 0).unwrap_or(SHAPE_TEXT_BYTES);
        let valid = |e: std::str::Utf8Error| {
            std::str::from_utf8(&self.text[..e.valid_up_to()]).unwrap_or_default()
        };
        std::str::from_utf8(&self.text[..end]).unwrap_or_else(valid)
    }

    /// Sets the text. The error states its length if it has more than [`SHAPE_TEXT_BYTES`] bytes.
    pub fn with_text(mut self, text: &str) -> Result<Shape, String> {
        let (len, most) = (text.len(), SHAPE_TEXT_BYTES);
        let room = self.text.get_mut(..len);
        let room = room.ok_or_else(|| format!("the text has {len} bytes, not 0 to {most}"))?;
        room.copy_from_slice(text.as_bytes());
        self.text[len..].fill(0);
        Ok(self)
    }

    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        if !(shape::POINT..=shape::TEXT).contains(&self.kind) {
            return Err(format!("unknown shape kind {}", self.kind));
        }
        each("a shape's place", &self.begin_m, -FAR_M, FAR_M)?;
        match self.kind {
            shape::LINE | shape::ARROW => each("a shape's end", &self.end_m, -FAR_M, FAR_M)?,
            shape::BOX => {
                each("half a box's size", &self.end_m, 0.0, LARGE_M)?;
                let square: f32 = self.rotation.iter().map(|part| part * part).sum();
                within("the square of a box's rotation", square, 0.99, 1.01)?;
            }
            _ => {}
        }
        within("a shape's thickness", self.size_m, 0.0, LARGE_M)?;
        within("a shape's width in pixels", self.pixels, 0.0, PIXELS_MAX)?;
        within("an arrow's head", self.head_m, 0.0, LARGE_M)
    }

    /// The response if the frame `stamp` is the first that shows the shape.
    pub fn drawn(&self, stamp: Stamp) -> ShapeReceipt {
        let until_nanos = match self.life_nanos {
            0 => 0,
            life => stamp.sim_time_nanos.saturating_add(life),
        };
        ShapeReceipt { frame: stamp.frame, until_nanos }
    }
}

impl Answer for ShapeReceipt {}

impl ShapeReceipt {
    /// Whether the frame `stamp`, not before [`ShapeReceipt::frame`], shows the shape.
    pub fn is_shown(&self, stamp: Stamp) -> bool {
        match self.until_nanos {
            0 => stamp.frame == self.frame,
            until => stamp.sim_time_nanos < until,
        }
    }

    /// Whether no frame after `stamp` shows the shape.
    pub fn is_over(&self, stamp: Stamp) -> bool {
        match self.until_nanos {
            0 => stamp.frame >= self.frame,
            until => stamp.sim_time_nanos >= until,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(frame: u64, sim_time_nanos: u64) -> Stamp {
        Stamp { frame: Frame(frame), sim_time_nanos, ..Stamp::default() }
    }

    fn shown(life_nanos: u64) -> Vec<u64> {
        let drawn = Shape { life_nanos, ..Shape::new(shape::LINE) }.drawn(at(7, 700));
        (7..12).filter(|frame| drawn.is_shown(at(*frame, frame * 100))).collect()
    }

    #[test]
    fn a_shape_is_shown_for_its_life_from_its_first_frame_on() {
        assert_eq!(shown(0), [7]);
        assert_eq!(shown(1), [7]);
        assert_eq!(shown(100), [7]);
        assert_eq!(shown(101), [7, 8]);
        assert_eq!(shown(shape::FOR_EVER), [7, 8, 9, 10, 11]);
        let drawn = Shape { life_nanos: 100, ..Shape::new(shape::LINE) }.drawn(at(7, 700));
        assert!(!drawn.is_over(at(7, 700)) && drawn.is_over(at(8, 800)));
        let once = Shape { life_nanos: 0, ..Shape::new(shape::LINE) }.drawn(at(7, 700));
        assert!(!once.is_over(at(6, 600)) && once.is_over(at(7, 700)));
    }

    #[test]
    fn numbers_that_are_none_are_refused_by_name() {
        let line = Shape { end_m: [1.0, 2.0, 3.0], ..Shape::new(shape::LINE) };
        assert_eq!(line.check(), Ok(()));
        let cases = [
            (Shape { kind: 9, ..line }, "kind 9"),
            (Shape { begin_m: [0.0, f32::NAN, 0.0], ..line }, "place is NaN"),
            (Shape { end_m: [0.0, 0.0, f32::INFINITY], ..line }, "end is inf"),
            (Shape { end_m: [0.0, 1e9, 0.0], ..line }, "1000000000"),
            (Shape { size_m: -1.0, ..line }, "thickness is -1"),
            (Shape { pixels: f32::NAN, ..line }, "pixels is NaN"),
            (Shape { head_m: 1e9, ..line }, "head is 1000000000"),
            (Shape { kind: shape::BOX, rotation: [0.0; 4], ..line }, "rotation is 0"),
            (Shape { kind: shape::BOX, end_m: [1.0, -1.0, 1.0], ..line }, "size is -1"),
        ];
        for (shape, words) in cases {
            let why = shape.check().unwrap_err();
            assert!(why.contains(words), "{why:?} does not say {words:?}");
        }
    }

    #[test]
    fn a_text_is_kept_or_refused() {
        let text = Shape::new(shape::TEXT);
        assert_eq!(text.with_text("né 7").unwrap().text(), "né 7");
        assert!(text.with_text(&"x".repeat(SHAPE_TEXT_BYTES)).is_ok());
        let why = text.with_text(&"x".repeat(SHAPE_TEXT_BYTES + 1)).unwrap_err();
        assert!(why.contains("125 bytes, not 0 to 124"), "{why}");
    }
}
