//! Buildings. In a building's own space, x runs along the street, y points to the street, and the
//! origin is the middle of the footprint on the ground.

use glam::{Quat, Vec3, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        facade::{self, Fineness, Frame, Look, Side, Suits},
        roof,
        window::Wall,
    },
    mesh_builder::MeshBuilder,
    static_world::Detail,
};

/// The style of a building.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    /// Offices or flats above shops, with a flat roof.
    Block,
    /// A tower of many floors in several steps.
    Tower,
    /// Flats above shops in a closed row under a steep roof, as in the centre of an old town.
    Row,
    /// A terraced house with a pitched roof.
    Terrace,
    /// A detached house in a garden.
    Villa,
    /// A workshop or a warehouse.
    Hall,
    /// An unfinished building: columns, floors, a scaffold.
    Shell,
}

/// The parameters of a building, decided before its mesh is built.
#[derive(Clone, Debug)]
pub(super) struct House {
    pub(super) style: Style,
    /// Half of its width along the street and of its depth. Metres.
    pub(super) half: [f32; 2],
    pub(super) floors: u32,
    /// What the walls are made of.
    pub(super) facade: Material,
    /// The style and the colours of the façades; `None` in low detail and on unfinished buildings.
    pub(super) look: Option<Look>,
    pub(super) detail: Detail,
}

/// The height of a floor, and of a ground floor with shops. Metres.
const FLOOR_M: f32 = 3.1;
const SHOP_M: f32 = 3.9;
/// The depth of walls below the ground, for slopes. Metres.
const FOOTING_M: f32 = 3.0;

impl House {
    /// The height from the ground to the eaves. Metres.
    pub(super) fn eaves_m(&self) -> f32 {
        match self.style {
            Style::Block | Style::Row | Style::Tower | Style::Shell => {
                SHOP_M + FLOOR_M * (self.floors - 1) as f32
            }
            Style::Terrace | Style::Villa => 0.5 + FLOOR_M * self.floors as f32,
            Style::Hall => 3.6 + 1.6 * self.floors as f32,
        }
    }

    /// The kind of building that styles of façades suit.
    pub(super) fn suits(&self) -> Option<Suits> {
        Some(match self.style {
            Style::Block => Suits::Block,
            Style::Tower => Suits::Tower,
            Style::Row => Suits::Row,
            Style::Terrace => Suits::Terrace,
            Style::Villa => Suits::Villa,
            Style::Hall => Suits::Hall,
            Style::Shell => return None,
        })
    }

    /// Builds the mesh.
    pub(super) fn model(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        builder.paint(Tag::Building, self.facade);
        match (&self.look, self.style) {
            (_, Style::Shell) if self.detail != Detail::Low => self.shell(builder, random),
            (Some(look), Style::Tower) => self.tower(builder, look, random),
            (Some(look), Style::Villa) => self.villa(builder, look, random),
            (Some(look), _) => self.house(builder, look, random),
            (None, _) => self.plain(builder, random),
        }
    }

    /// Adds walls, a strip of glass for each floor, a door and a roof.
    fn plain(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        builder.block(vec3(-x, -y, -FOOTING_M), vec3(x, y, eaves));
        builder.material(Material::Wood);
        builder.block(vec3(-0.7, y - 0.1, 0.0), vec3(0.7, y + 0.06, 2.3));
        builder.material(Material::Glass);
        let mut sill = if eaves > SHOP_M + FLOOR_M { SHOP_M } else { 0.5 } + 0.95;
        while sill + 1.6 < eaves {
            for side in 0..4 {
                Wall::new(self.half, side).band(builder, [sill, sill + 1.5], 0.8);
            }
            sill += FLOOR_M;
        }
        if matches!(self.style, Style::Row | Style::Terrace | Style::Villa) {
            let cover = roof::Cover { gable: self.facade, look: None };
            roof::pitched(builder, [x, y], eaves, random.between(0.6, 0.9), &cover, false);
        } else {
            builder.material(Material::RoofFlat);
            builder.block(vec3(-x - 0.2, -y - 0.2, eaves), vec3(x + 0.2, y + 0.2, eaves + 0.8));
        }
    }

    /// Adds the footing below the ground.
    fn footing(&self, builder: &mut MeshBuilder, look: &Look) {
        let [x, y] = self.half;
        look.plinth().apply(builder);
        builder.block(vec3(-x - 0.05, -y - 0.05, -FOOTING_M), vec3(x + 0.05, y + 0.05, 0.02));
    }

    /// How finely the front, the sides and the back are built.
    fn fineness(&self) -> [Fineness; 3] {
        match self.detail {
            Detail::High => [Fineness::Full; 3],
            _ => [Fineness::Full, Fineness::Plain, Fineness::Flat],
        }
    }

    /// Adds all four walls of a box; walls that touch those of neighbours are bare.
    fn walls(
        &self,
        builder: &mut MeshBuilder,
        look: &Look,
        (half, height): ([f32; 2], f32),
        random: &mut RandomStream,
    ) {
        let touching = matches!(self.style, Style::Row | Style::Terrace);
        let [front, side, back] = self.fineness();
        let starts =
            [(Side::Front, front), (Side::Flank, side), (Side::Back, back), (Side::Flank, side)];
        for (number, start) in starts.into_iter().enumerate() {
            let frame = Frame::of_box(half, number);
            if touching && start.0 == Side::Flank {
                bare(builder, look, half, number, height);
                if self.detail != Detail::Low {
                    firewall(builder, look, half, number, height);
                }
            } else {
                facade::draw(builder, look, (frame, height), start, random);
            }
        }
    }

    fn house(&self, builder: &mut MeshBuilder, look: &Look, random: &mut RandomStream) {
        let (half, eaves) = (self.half, self.eaves_m());
        self.footing(builder, look);
        self.walls(builder, look, (half, eaves), random);
        self.roof(builder, look, eaves, random);
    }

    /// Adds the roof of the style.
    fn roof(&self, builder: &mut MeshBuilder, look: &Look, eaves: f32, random: &mut RandomStream) {
        let (half, rule) = (self.half, look.roof());
        let Some([least, most]) = rule.pitch else {
            roof::flat(builder, half, eaves, (random, self.detail), Some(look));
            return;
        };
        let hipped = self.style == Style::Villa && random.chance(rule.hipped);
        let pitch = random.between(least, most);
        let cover = roof::Cover { gable: self.facade, look: Some(look) };
        roof::pitched(builder, half, eaves, pitch, &cover, hipped);
        roof::chimneys(builder, half, eaves, random, rule.chimneys);
        if hipped {
            return;
        }
        let slope = roof::Slope { half, eaves, pitch };
        if random.chance(rule.dormers) {
            slope.dormers(builder, look, random);
        } else if random.chance(rule.skylights) {
            slope.skylights(builder, random);
        }
        if random.chance(rule.solar) {
            slope.solar(builder, random);
        }
        if random.chance(rule.antenna) {
            slope.antenna(builder, random);
        }
    }

    fn tower(&self, builder: &mut MeshBuilder, look: &Look, random: &mut RandomStream) {
        let top = self.eaves_m();
        self.footing(builder, look);
        let mut half = self.half;
        let mut low = top * 0.3;
        self.walls(builder, look, (half, low), random);
        for (step, cut) in [0.72, 0.9, 1.0].into_iter().enumerate() {
            roof::flat(builder, half, low, (random, self.detail), Some(look));
            let shrink = random.between(0.80, 0.93);
            half = half.map(|half| half * shrink);
            let high = top * cut;
            for side in 0..4 {
                let frame = Frame::of_box(half, side).raised(low);
                // The far sides of a tower are seen as well as its front.
                let fine = self.fineness()[usize::from(side != 0)];
                facade::draw(builder, look, (frame, high - low), (Side::Flank, fine), random);
            }
            low = high;
            if step == 2 {
                roof::flat(builder, half, high, (random, self.detail), Some(look));
                roof::mast(builder, high, random.between(6.0, 14.0));
            }
        }
    }

    fn villa(&self, builder: &mut MeshBuilder, look: &Look, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        // A projecting wing makes the plan an L.
        if !random.chance(0.45) {
            return self.house(builder, look, random);
        }
        self.footing(builder, look);
        let [front, side, back] = self.fineness();
        for (number, start) in [(1, side), (2, back), (3, side)] {
            let rule = if number == 2 { Side::Back } else { Side::Flank };
            let frame = Frame::of_box(self.half, number);
            facade::draw(builder, look, (frame, eaves), (rule, start), random);
        }
        let (from, to) = (x * 0.3, x * 0.92);
        let beside = Frame {
            turn: Quat::IDENTITY,
            foot: vec3((from - x) * 0.5, y, 0.0),
            half: (from + x) * 0.5,
        };
        facade::draw(builder, look, (beside, eaves), (Side::Front, front), random);
        look.wall().apply(builder);
        let wall = |builder: &mut MeshBuilder, a: [f32; 2], b: [f32; 2], top: f32| {
            let [a, b] = [a, b].map(|[x, y]| vec3(x, y, -FOOTING_M));
            let up = Vec3::Z * (top + FOOTING_M);
            builder.quad([a, b, b + up, a + up]);
        };
        let (low, out) = (eaves - 0.35, y + 1.5);
        wall(builder, [x, y], [from, y], eaves);
        wall(builder, [to, out], [to, y], low);
        wall(builder, [from, y], [from, out], low);
        let wing = Frame {
            turn: Quat::IDENTITY,
            foot: vec3((from + to) * 0.5, out, 0.0),
            half: (to - from) * 0.5,
        };
        facade::draw(builder, look, (wing, low), (Side::Flank, front), random);
        look.plinth().apply(builder);
        builder.block(vec3(from, y, -FOOTING_M), vec3(to, out + 0.04, 0.02));
        let (left, right) = (from - 0.3, to + 0.3);
        let ridge = low + (to - from) * 0.42;
        look.tiles().apply(builder);
        roof::prism(builder, [left, right], [y - 1.5, out + 0.35], low, ridge);
        look.wall().apply(builder);
        let gable = [(from, low), (to, low), ((from + to) * 0.5, ridge - 0.1)]
            .map(|(x, z)| builder.vertex(vec3(x, out + 0.355, z)));
        builder.triangle([gable[1], gable[0], gable[2]]);
        self.roof(builder, look, eaves, random);
    }

    fn shell(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], top) = (self.half, self.eaves_m());
        builder.material(Material::Concrete);
        builder.block(vec3(-x, -y, -FOOTING_M), vec3(x, y, 0.15));
        let mut slabs = vec![SHOP_M];
        slabs.extend((1..self.floors).map(|floor| SHOP_M + FLOOR_M * floor as f32));
        for slab in &slabs {
            builder.block(vec3(-x, -y, slab - 0.25), vec3(x, y, *slab));
        }
        let bays = [x, y].map(|half| (half * 2.0 / 5.0).ceil().max(1.0) as u32);
        let column = |step: u32, count: u32, half: f32| {
            -half + 0.3 + (half * 2.0 - 0.6) * step as f32 / count as f32
        };
        for i in 0..=bays[0] {
            for j in 0..=bays[1] {
                let at = vec3(column(i, bays[0], x), column(j, bays[1], y), 0.0);
                // The columns of the next floor already stand.
                let high = if random.chance(0.8) { top + 1.1 } else { top };
                builder.block(at - vec3(0.2, 0.2, 0.0), at + vec3(0.2, 0.2, high));
            }
        }
        // The staircase is built first.
        builder.block(vec3(-1.6, -y + 0.4, 0.0), vec3(1.6, -y + 4.0, top + 2.2));
        scaffold(builder, x, y, top);
    }
}

/// Adds one wall of a box as a single rectangle.
fn bare(builder: &mut MeshBuilder, look: &Look, half: [f32; 2], side: usize, height: f32) {
    let Frame { turn, foot, half } = Frame::of_box(half, side);
    look.wall().apply(builder);
    let corners = [(half, 0.0), (-half, 0.0), (-half, height), (half, height)];
    builder.quad(corners.map(|(x, z)| foot + turn * vec3(x, 0.0, z)));
}

/// How many columns of windows such a wall has at most: few, as a fire must not cross a boundary.
const FIREWALL_COLUMNS: u32 = 2;

/// Adds what shows on a wall where its neighbour is lower: a strip over a flue, and small windows.
fn firewall(builder: &mut MeshBuilder, look: &Look, half: [f32; 2], side: usize, height: f32) {
    let Frame { turn, foot, half } = Frame::of_box(half, side);
    let mut random = look.stream(0xf12e + side as u64);
    let rect = |builder: &mut MeshBuilder, x: [f32; 2], z: [f32; 2], out: f32| {
        let corners = [(x[1], z[0]), (x[0], z[0]), (x[0], z[1]), (x[1], z[1])];
        builder.quad(corners.map(|(x, z)| foot + turn * vec3(x, out, z)));
    };
    let dim = |paint: [u8; 3], by: f32| paint.map(|c| (f32::from(c) * by) as u8);
    let wall = look.wall();
    let flue = half * random.between(-0.6, 0.6);
    builder.tinted(wall.material, dim(wall.rgb, 1.06));
    rect(builder, [flue - 0.45, flue + 0.45], [0.0, height], 0.011);
    let mut columns = vec![flue];
    for _ in 0..FIREWALL_COLUMNS {
        let x = half * random.between(-0.8, 0.8);
        if x.abs() > half - 0.8 || columns.iter().any(|other| (x - other).abs() < 1.3) {
            continue;
        }
        columns.push(x);
        let mut sill = SHOP_M + 1.1;
        while sill + 1.0 < height {
            let glass = [26.0, 30.0, 35.0].map(|c| (c + random.between(0.0, 14.0)) as u8);
            look.frame().apply(builder);
            rect(builder, [x - 0.42, x + 0.42], [sill - 0.06, sill + 1.06], 0.012);
            builder.tinted(Material::Glass, glass);
            rect(builder, [x - 0.36, x + 0.36], [sill, sill + 1.0], 0.024);
            look.trim().apply(builder);
            roof::sill(builder, (turn, foot), [x - 0.5, x + 0.5], sill - 0.06);
            sill += FLOOR_M;
        }
    }
}

/// Adds poles, planks and rails in front of the street side.
fn scaffold(builder: &mut MeshBuilder, x: f32, y: f32, top: f32) {
    let (near, far) = (y + 0.12, y + 0.9);
    let bays = (x * 2.0 / 2.5).ceil().max(1.0) as u32;
    let at = |step: u32| -x + x * 2.0 * step as f32 / bays as f32;
    builder.material(Material::Metal);
    for step in 0..=bays {
        for out in [near, far] {
            builder.rod(vec3(at(step), out, -1.0), vec3(at(step), out, top + 1.0), 0.03, 5);
        }
    }
    let mut deck = 2.0;
    while deck < top + 0.5 {
        builder.material(Material::Wood);
        builder.block(vec3(-x, near, deck - 0.05), vec3(x, far, deck));
        builder.material(Material::Metal);
        for rail in [0.5, 1.0] {
            builder.rod(vec3(-x, far, deck + rail), vec3(x, far, deck + rail), 0.02, 4);
        }
        deck += 2.0;
    }
}
