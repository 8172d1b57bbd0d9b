//! What is drawn over the world, ready for rays: rods in a hierarchy, and texts.

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};
use protocol::{Shape, shape};

use crate::bvh::{Hierarchy, Link, Node};
use crate::glyphs;

/// A line with round ends; a point is one without length. The shaders read the same 48 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Rod {
    pub(crate) begin: [f32; 3],
    /// Half its thickness. Metres.
    pub(crate) radius: f32,
    pub(crate) end: [f32; 3],
    /// Half its thickness is at least so many pixels.
    pub(crate) pixels: f32,
    /// Red in bits 0 to 7, green, blue, 255.
    pub(crate) color: u32,
    pub(crate) reserved: [u32; 3],
}

const _: () = assert!(size_of::<Rod>() == 48);

/// The most letters of a text.
pub(crate) const LETTERS_MAX: usize = 128;

/// Letters about a place. The shaders read the same 160 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Text {
    pub(crate) at: [f32; 3],
    /// Red in bits 0 to 7, green, blue, 255.
    pub(crate) color: u32,
    pub(crate) count: u32,
    /// 1: dark dots lie behind its own, below to the right.
    pub(crate) shadow: u32,
    pub(crate) reserved: [u32; 2],
    /// Numbers of glyphs.
    pub(crate) letters: [u8; LETTERS_MAX],
}

const _: () = assert!(size_of::<Text>() == 160);
const _: () = assert!(protocol::SHAPE_TEXT_BYTES <= LETTERS_MAX);

/// Shapes as tracers see them.
#[derive(Debug)]
pub struct Overlay {
    /// In the order of the hierarchy's leaves.
    pub(crate) rods: Vec<Rod>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Link,
    /// Of all rods the most [`Rod::pixels`].
    pub(crate) pixels: f32,
    pub(crate) texts: Vec<Text>,
}

impl Default for Overlay {
    fn default() -> Overlay {
        Overlay::new(&[])
    }
}

impl Overlay {
    /// Those of the shapes that are what [`Shape::check`] asks for.
    pub fn new<'a>(shapes: impl IntoIterator<Item = &'a Shape>) -> Overlay {
        let (mut rods, mut texts) = (Vec::new(), Vec::new());
        for shape in shapes {
            if shape.check().is_ok() {
                add(shape, &mut rods, &mut texts);
            }
        }
        let boxes: Vec<_> = rods.iter().map(bounds).collect();
        let tree = Hierarchy::over_boxes(&boxes);
        let pixels = rods.iter().map(|rod| rod.pixels).fold(0.0, f32::max);
        let rods = tree.order.iter().map(|at| rods[*at as usize]).collect();
        Overlay { rods, nodes: tree.nodes, root: tree.root, pixels, texts }
    }

    /// Nothing is drawn.
    pub fn is_empty(&self) -> bool {
        self.rods.is_empty() && self.texts.is_empty()
    }
}

fn bounds(rod: &Rod) -> (Vec3, Vec3) {
    let (begin, end) = (Vec3::from(rod.begin), Vec3::from(rod.end));
    (begin.min(end) - rod.radius, begin.max(end) + rod.radius)
}

fn add(shape: &Shape, rods: &mut Vec<Rod>, texts: &mut Vec<Text>) {
    let color = shape.color | 0xff00_0000;
    let (begin, end) = (Vec3::from(shape.begin_m), Vec3::from(shape.end_m));
    let (radius, pixels) = (shape.size_m * 0.5, shape.pixels * 0.5);
    let mut rod = |begin: Vec3, end: Vec3| {
        let (begin, end) = (begin.to_array(), end.to_array());
        rods.push(Rod { begin, radius, end, pixels, color, reserved: [0; 3] });
    };
    match shape.kind {
        shape::POINT => rod(begin, begin),
        shape::LINE => rod(begin, end),
        shape::ARROW => {
            rod(begin, end);
            let ahead = (end - begin).normalize_or(Vec3::X);
            let left = Vec3::Z.cross(ahead).try_normalize().unwrap_or(Vec3::Y);
            let up = ahead.cross(left);
            for (left, up) in [(left, up), (left, -up), (-left, up), (-left, -up)] {
                rod(end + (left + up - ahead) * shape.head_m, end);
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
                        rod(corner(at), corner(at | bit));
                    }
                }
            }
        }
        _ => {
            let mut letters = [0; LETTERS_MAX];
            let mut count = 0;
            for (room, letter) in letters.iter_mut().zip(shape.text().chars()) {
                *room = glyphs::number(letter);
                count += 1;
            }
            let (at, shadow) = (begin.to_array(), shape.shadow);
            texts.push(Text { at, color, count, shadow, reserved: [0; 2], letters });
        }
    }
}
