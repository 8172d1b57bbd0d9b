//! Debug shapes in the form that tracers draw: capsules in a hierarchy, and texts.

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};
use protocol::{Shape, shape};

use crate::{
    bvh::{Link, Node},
    glyphs,
    sah_build::over_boxes,
};

/// Capsule: a line with round ends; a point has length 0. The shaders read the same 48 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Capsule {
    pub(crate) begin: [f32; 3],
    /// Radius in metres.
    pub(crate) radius: f32,
    pub(crate) end: [f32; 3],
    /// Minimum radius in pixels.
    pub(crate) pixels: f32,
    /// Colour: red in bits 0 to 7, green, blue, 255.
    pub(crate) color: u32,
    pub(crate) reserved: [u32; 3],
}

const _: () = assert!(size_of::<Capsule>() == 48);

/// Minimum depth of a text. Metres.
pub(crate) const TEXT_NEAR_M: f32 = 0.05;

/// Maximum number of letters of a text.
pub(crate) const LETTERS_MAX: usize = 128;

/// Text at a point of the world. The shaders read the same 160 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Text {
    pub(crate) at: [f32; 3],
    /// Red in bits 0 to 7, green, blue, 255.
    pub(crate) color: u32,
    pub(crate) count: u32,
    /// 1 if the text has a black shadow, one dot to the right and below.
    pub(crate) shadow: u32,
    pub(crate) reserved: [u32; 2],
    /// Indices of glyphs.
    pub(crate) letters: [u8; LETTERS_MAX],
}

const _: () = assert!(size_of::<Text>() == 160);
const _: () = assert!(protocol::SHAPE_TEXT_BYTES <= LETTERS_MAX);

/// Debug shapes in the form that tracers draw.
#[derive(Debug)]
pub struct Overlay {
    /// Capsules in the order of the leaves of the hierarchy.
    pub(crate) capsules: Vec<Capsule>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Link,
    /// Largest [`Capsule::pixels`].
    pub(crate) pixels: f32,
    pub(crate) texts: Vec<Text>,
}

impl Default for Overlay {
    fn default() -> Overlay {
        Overlay::new(&[])
    }
}

impl Overlay {
    /// Converts the shapes; those that [`Shape::check`] rejects are left out.
    pub fn new<'a>(shapes: impl IntoIterator<Item = &'a Shape>) -> Overlay {
        let (mut capsules, mut texts) = (Vec::new(), Vec::new());
        for shape in shapes {
            if shape.check().is_ok() {
                add(shape, &mut capsules, &mut texts);
            }
        }
        let boxes: Vec<_> = capsules.iter().map(bounds).collect();
        let tree = over_boxes(&boxes);
        let pixels = capsules.iter().map(|capsule| capsule.pixels).fold(0.0, f32::max);
        let capsules = tree.order.iter().map(|at| capsules[*at as usize]).collect();
        Overlay { capsules, nodes: tree.nodes, root: tree.root, pixels, texts }
    }

    /// Returns whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.capsules.is_empty() && self.texts.is_empty()
    }
}

fn bounds(capsule: &Capsule) -> (Vec3, Vec3) {
    let (begin, end) = (Vec3::from(capsule.begin), Vec3::from(capsule.end));
    (begin.min(end) - capsule.radius, begin.max(end) + capsule.radius)
}

fn add(shape: &Shape, capsules: &mut Vec<Capsule>, texts: &mut Vec<Text>) {
    let color = shape.color | 0xff00_0000;
    let (begin, end) = (Vec3::from(shape.begin_m), Vec3::from(shape.end_m));
    let (radius, pixels) = (shape.size_m * 0.5, shape.pixels * 0.5);
    let mut capsule = |begin: Vec3, end: Vec3| {
        let (begin, end) = (begin.to_array(), end.to_array());
        capsules.push(Capsule { begin, radius, end, pixels, color, reserved: [0; 3] });
    };
    match shape.kind {
        shape::POINT => capsule(begin, begin),
        shape::LINE => capsule(begin, end),
        shape::ARROW => {
            capsule(begin, end);
            let ahead = (end - begin).normalize_or(Vec3::X);
            let left = Vec3::Z.cross(ahead).try_normalize().unwrap_or(Vec3::Y);
            let up = ahead.cross(left);
            for (left, up) in [(left, up), (left, -up), (-left, up), (-left, -up)] {
                capsule(end + (left + up - ahead) * shape.head_m, end);
            }
        }
        shape::BOX => {
            let turn = Quat::from_array(shape.rotation).normalize();
            let corner = |at: usize| {
                let side = |bit: usize| if at & bit == 0 { -1.0 } else { 1.0 };
                begin + turn * (end * Vec3::new(side(1), side(2), side(4)))
            };
            for at in 0..8 {
                for bit in [1, 2, 4] {
                    if at & bit == 0 {
                        capsule(corner(at), corner(at | bit));
                    }
                }
            }
        }
        _ => {
            let mut letters = [0; LETTERS_MAX];
            let mut count = 0;
            for (room, letter) in letters.iter_mut().zip(shape.text().chars()) {
                *room = glyphs::glyph_index(letter);
                count += 1;
            }
            let (at, shadow) = (begin.to_array(), shape.shadow);
            texts.push(Text { at, color, count, shadow, reserved: [0; 2], letters });
        }
    }
}
