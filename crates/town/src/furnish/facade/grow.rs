//! The growth of a façade: rules are applied to rectangles of wall until only elements are left.

use mesh::{Material, RandomStream, fnv1a64};

use crate::{
    furnish::facade::{
        book::{Book, Choice, Paint, Part, Rule, Slot},
        canvas::{Canvas, Frame},
        look::{Look, weighted},
        split::{Extent, split},
    },
    mesh_builder::MeshBuilder,
};

/// How finely a wall is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fineness {
    /// Windows are panes on the wall, for walls that are seldom seen.
    Flat,
    /// Openings have depth; there are no sills, bars and the like.
    Plain,
    /// Everything that the rules say.
    Full,
}

/// Which rule of the style a wall starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Front,
    Flank,
    Back,
}

/// A rectangle of wall: ranges of u and z. Metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) u: [f32; 2],
    pub(super) z: [f32; 2],
}

impl Area {
    pub(super) fn width(&self) -> f32 {
        self.u[1] - self.u[0]
    }

    pub(super) fn height(&self) -> f32 {
        self.z[1] - self.z[0]
    }

    pub(super) fn middle(&self) -> f32 {
        (self.u[0] + self.u[1]) * 0.5
    }
}

/// What a rule became, for tests: its element's name and the area.
#[cfg(test)]
pub(super) type Grown = Vec<(&'static str, Area)>;

/// A façade that grows.
pub(super) struct Facade<'a> {
    pub(super) canvas: Canvas<'a>,
    pub(super) look: &'a Look,
    pub(super) fine: Fineness,
    pub(super) random: RandomStream,
    book: &'static Book,
    #[cfg(test)]
    pub(super) grown: Grown,
}

/// Draws a wall from its foot to `height_m`, in the space of the building.
pub(crate) fn draw(
    builder: &mut MeshBuilder,
    look: &Look,
    (frame, height_m): (Frame, f32),
    (side, fine): (Side, Fineness),
    random: &mut RandomStream,
) {
    let area = Area { u: [-frame.half, frame.half], z: [0.0, height_m] };
    let mut facade = Facade::new(builder, look, frame, fine, random);
    facade.grow(facade.start(side), area);
    facade.canvas.finish();
}

impl<'a> Facade<'a> {
    pub(super) fn new(
        builder: &'a mut MeshBuilder,
        look: &'a Look,
        frame: Frame,
        fine: Fineness,
        random: &mut RandomStream,
    ) -> Facade<'a> {
        Facade {
            canvas: Canvas::new(builder, frame),
            look,
            fine,
            random: RandomStream::named(random.bits(), 0xfa),
            book: Book::embedded(),
            #[cfg(test)]
            grown: Vec::new(),
        }
    }

    /// The rule that a side starts from.
    pub(super) fn start(&self, side: Side) -> &'static str {
        let style = self.look.style();
        match side {
            Side::Front => &style.front,
            Side::Flank => &style.side,
            Side::Back => &style.back,
        }
    }

    /// Applies a rule to an area.
    pub(super) fn grow(&mut self, name: &str, area: Area) {
        let Some(rule) = self.book.rules.get(name) else { return };
        match rule {
            Rule::X(parts) => {
                for (part, u) in split(area.u[0], area.u[1], &extents(parts)) {
                    self.grow(&parts[part].name, Area { u, ..area });
                }
            }
            Rule::Z(parts) => {
                for (part, z) in split(area.z[0], area.z[1], &extents(parts)) {
                    self.grow(&parts[part].name, Area { z, ..area });
                }
            }
            Rule::Choose(choices) => {
                let own = fnv1a64(name.as_bytes());
                let mut random = RandomStream::named(self.look.seed, own);
                self.grow_one(choices, area, &mut random);
            }
            Rule::Vary(choices) => {
                let mut random = RandomStream::from_state(self.random.bits());
                self.grow_one(choices, area, &mut random);
            }
            Rule::Over(names) => names.iter().for_each(|name| self.grow(name, area)),
            element => self.fill(element, area),
        }
    }

    fn grow_one(&mut self, choices: &'static [Choice], area: Area, random: &mut RandomStream) {
        if let Some(choice) = weighted(choices, |choice| choice.weight, random) {
            self.grow(&choice.name, area);
        }
    }

    /// Fills an area with an element.
    fn fill(&mut self, element: &Rule, area: Area) {
        match element {
            Rule::Wall(part) => self.flat(area, part),
            Rule::Ledge(part) => self.course(area, part),
            Rule::Quoins(part) => self.quoins(area, part),
            Rule::Window(part) => self.window(area, part),
            Rule::Glazing(part) => self.glazing(area, part),
            Rule::Door(part) => self.door(area, part),
            Rule::Shop(part) => self.shop(area, part),
            Rule::Gate(part) => self.gate(area, part),
            Rule::Balcony(part) => self.balcony(area, part),
            Rule::Pipe(part) => self.pipe(area, part),
            Rule::X(_) | Rule::Z(_) | Rule::Choose(_) | Rule::Vary(_) | Rule::Over(_) => {}
        }
    }

    /// Notes an element for tests.
    pub(super) fn note(&mut self, _name: &'static str, _area: Area) {
        #[cfg(test)]
        self.grown.push((_name, _area));
    }

    pub(super) fn paint(&self, slot: Slot) -> Paint {
        self.look.paint(slot)
    }

    /// Adds the wall round an opening; joints are dark lines along its left and its foot.
    pub(super) fn around(&mut self, area: Area, hole: Area, slot: Slot) {
        let paint = self.paint(slot);
        let mut wall = |u: [f32; 2], z: [f32; 2]| self.canvas.wall(u, z, 0.0, paint);
        wall(area.u, [area.z[0], hole.z[0]]);
        wall([area.u[0], hole.u[0]], hole.z);
        wall([hole.u[1], area.u[1]], hole.z);
        wall(area.u, [hole.z[1], area.z[1]]);
    }

    /// Adds a pane at a depth: dark glass, or a curtain or a lamp-lit room behind it.
    ///
    /// The renderer lights panes of buildings at night by a hash of their tint, so tints differ a
    /// little.
    pub(super) fn pane(&mut self, u: [f32; 2], z: [f32; 2], o: f32, rgb: [u8; 3]) {
        let lighter = self.random.between(-10.0, 10.0);
        let rgb = rgb.map(|c| {
            let own = f32::from(c) + lighter + self.random.between(-3.0, 3.0);
            own.clamp(8.0, 250.0) as u8
        });
        self.glass(u, z, o, rgb);
    }

    /// Adds a pane of exactly this colour, so that all panes of one room are alike.
    pub(super) fn glass(&mut self, u: [f32; 2], z: [f32; 2], o: f32, rgb: [u8; 3]) {
        self.canvas.paint(Paint { material: Material::Glass, rgb });
        self.canvas.rect(u, z, o);
    }

    /// Dark lines along the left and the foot of an area.
    pub(super) fn joints(&mut self, area: Area, width: f32) {
        if width <= 0.0 || self.fine == Fineness::Flat {
            return;
        }
        let [r, g, b] = self.paint(Slot::Wall).rgb.map(|c| (f32::from(c) * 0.55) as u8);
        self.canvas.paint(Paint { material: Material::Concrete, rgb: [r, g, b] });
        let (u, z) = (area.u[0], area.z[0]);
        self.canvas.rect([u, u + width], area.z, 0.004);
        self.canvas.rect(area.u, [z, z + width], 0.004);
    }
}

fn extents(parts: &[Part]) -> Vec<Extent> {
    parts.iter().map(Part::extent).collect()
}
