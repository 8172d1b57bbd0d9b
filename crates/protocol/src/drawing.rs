//! What is drawn into images over the world: points, lines, arrows, boxes, texts.

use bytemuck::{Pod, Zeroable};

use crate::{Frame, Stamp, vehicle::within};

/// The most shapes that stand at a time.
pub const SHAPES_MAX: usize = 16_384;
/// The most bytes of a drawn text.
pub const SHAPE_TEXT_BYTES: usize = 124;
/// No place of a shape lies farther out. Metres.
const FAR_M: f32 = 1e5;
/// No shape is larger or thicker. Metres.
const LARGE_M: f32 = 1e4;
/// No shape is so many pixels wide at least.
const PIXELS_MAX: f32 = 256.0;

/// Values of [`Shape::kind`].
pub mod shape {
    /// A ball at `begin_m`.
    pub const POINT: u32 = 1;
    /// From `begin_m` to `end_m`.
    pub const LINE: u32 = 2;
    /// A line with four barbs at its end, each `head_m` back and to the sides.
    pub const ARROW: u32 = 3;
    /// The twelve edges of a box about `begin_m`, half as large as `end_m` says, turned by
    /// `rotation`.
    pub const BOX: u32 = 4;
    /// Letters that face the camera, as large wherever they are, their middle at `begin_m`.
    pub const TEXT: u32 = 5;

    /// [`super::Shape::life_nanos`]: until it is erased.
    pub const FOR_EVER: u64 = u64::MAX;
}

/// See [`crate::Command::Draw`]. ShapeReceipt into the colours of cameras, behind what stands before it; no
/// other output shows it, no lidar, and nobody runs into it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Shape {
    /// How long it is shown, in simulated time from the first frame that shows it; 0: in one
    /// frame; [`shape::FOR_EVER`].
    pub life_nanos: u64,
    /// One of [`shape`].
    pub kind: u32,
    /// Red, green, blue, 255; sRGB.
    pub color: u32,
    /// In world space; a box's and a text's middle.
    pub begin_m: [f32; 3],
    /// In world space; of a box half its size.
    pub end_m: [f32; 3],
    /// Of a box: `world_from_box` as x, y, z, w.
    pub rotation: [f32; 4],
    /// How thick its lines are; of a point its diameter.
    pub size_m: f32,
    /// In an image its lines are at least so wide.
    pub pixels: f32,
    /// How long an arrow's barbs are, along the arrow and to each side.
    pub head_m: f32,
    /// Of a text: 1 for a dark shadow behind its letters.
    pub shadow: u32,
    /// UTF-8, padded with zeros.
    pub text: [u8; SHAPE_TEXT_BYTES],
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<Shape>() == 200);

/// What became of a [`Shape`] that was drawn: in the outcome of its command, under the id by which it
/// is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct ShapeReceipt {
    /// The first frame that shows it.
    pub frame: Frame,
    /// Frames of this simulated time, and later ones, do not show it; 0: that one frame alone
    /// does.
    pub until_nanos: u64,
}

/// See [`crate::Command::EraseShapes`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct EraseShapes {
    /// 1: everything that is no text.
    pub shapes: u32,
    /// 1: all texts.
    pub texts: u32,
}

impl EraseShapes {
    /// Everything.
    pub const ALL: EraseShapes = EraseShapes { shapes: 1, texts: 1 };

    /// Whether it concerns this one.
    pub fn takes(&self, shape: &Shape) -> bool {
        if shape.kind == shape::TEXT { self.texts != 0 } else { self.shapes != 0 }
    }
}

impl Shape {
    /// Nothing yet: white, thin, for ever.
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

    /// Its letters.
    pub fn text(&self) -> &str {
        let end = self.text.iter().position(|&b| b == 0).unwrap_or(SHAPE_TEXT_BYTES);
        let valid = |e: std::str::Utf8Error| {
            std::str::from_utf8(&self.text[..e.valid_up_to()]).unwrap_or_default()
        };
        std::str::from_utf8(&self.text[..end]).unwrap_or_else(valid)
    }

    /// The same with these letters; an error says how many bytes they have if they are too many.
    pub fn with_text(mut self, text: &str) -> Result<Shape, String> {
        let (len, most) = (text.len(), SHAPE_TEXT_BYTES);
        let room = self.text.get_mut(..len);
        let room = room.ok_or_else(|| format!("the text has {len} bytes, not 0 to {most}"))?;
        room.copy_from_slice(text.as_bytes());
        self.text[len..].fill(0);
        Ok(self)
    }

    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        if !(shape::POINT..=shape::TEXT).contains(&self.kind) {
            return Err(format!("there is no shape of kind {}", self.kind));
        }
        let all = |what: &str, values: &[f32], low: f32, high: f32| {
            values.iter().try_for_each(|value| within(what, *value, low, high))
        };
        all("a shape's place", &self.begin_m, -FAR_M, FAR_M)?;
        match self.kind {
            shape::LINE | shape::ARROW => all("a shape's end", &self.end_m, -FAR_M, FAR_M)?,
            shape::BOX => {
                all("half a box's size", &self.end_m, 0.0, LARGE_M)?;
                let square: f32 = self.rotation.iter().map(|part| part * part).sum();
                within("the square of a box's rotation", square, 0.99, 1.01)?;
            }
            _ => {}
        }
        within("a shape's thickness", self.size_m, 0.0, LARGE_M)?;
        within("a shape's width in pixels", self.pixels, 0.0, PIXELS_MAX)?;
        within("an arrow's head", self.head_m, 0.0, LARGE_M)
    }

    /// What becomes of it, if frame `stamp` is the first that shows it.
    pub fn drawn(&self, stamp: Stamp) -> ShapeReceipt {
        let until_nanos = match self.life_nanos {
            0 => 0,
            life => stamp.sim_time_nanos.saturating_add(life),
        };
        ShapeReceipt { frame: stamp.frame, until_nanos }
    }
}

impl ShapeReceipt {
    /// Whether a frame, the one of [`ShapeReceipt::frame`] or a later one, shows it.
    pub fn is_shown(&self, stamp: Stamp) -> bool {
        match self.until_nanos {
            0 => stamp.frame == self.frame,
            until => stamp.sim_time_nanos < until,
        }
    }

    /// Whether no frame after this one shows it.
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
