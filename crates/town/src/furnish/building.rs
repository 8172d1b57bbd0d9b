//! Buildings. In a building's own space, x runs along the street, y points to the street, and the
//! origin is the middle of the footprint on the ground.

use glam::{Quat, Vec3, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        roof,
        window::{Wall, Windows},
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
    pub(super) facade: Material,
    pub(super) detail: Detail,
}

/// Colours of the plaster of old buildings, sRGB.
const PLASTER: [[u8; 3]; 7] = [
    [214, 178, 112],
    [224, 205, 168],
    [196, 138, 108],
    [208, 168, 152],
    [172, 184, 152],
    [228, 222, 208],
    [184, 192, 200],
];

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

    /// Builds the mesh.
    pub(super) fn model(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        builder.paint(Tag::Building, self.facade);
        if self.detail == Detail::Low {
            return self.plain(builder, random);
        }
        match self.style {
            Style::Block => self.block(builder, random),
            Style::Tower => self.tower(builder, random),
            Style::Row => self.row(builder, random),
            Style::Terrace => self.terrace(builder, random),
            Style::Villa => self.villa(builder, random),
            Style::Hall => self.hall(builder, random),
            Style::Shell => self.shell(builder, random),
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
            roof::pitched(builder, [x, y], eaves, random.between(0.6, 0.9), self.facade, false);
        } else {
            builder.material(Material::RoofFlat);
            builder.block(vec3(-x - 0.2, -y - 0.2, eaves), vec3(x + 0.2, y + 0.2, eaves + 0.8));
        }
    }

    fn block(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        self.walls(builder, SHOP_M, eaves);
        self.courses(builder, SHOP_M, eaves, random);
        if random.chance(0.6) {
            self.shops(builder, random);
        } else {
            self.entrance(builder, 0.0, 0.0, true);
            self.windows(builder, 0.0, SHOP_M, Some(0.0), &[0]);
        }
        self.windows(builder, 0.0, SHOP_M, None, &[1, 2, 3]);
        let ribbons = self.facade == Material::FacadeGlass
            || self.facade == Material::FacadeConcrete && random.chance(0.5);
        if ribbons {
            self.bands(builder, self.half, SHOP_M, eaves);
        } else {
            self.windows(builder, SHOP_M, eaves, None, &[0, 1, 2, 3]);
        }
        roof::flat(builder, [x, y], eaves, random, self.detail);
        if matches!(self.facade, Material::FacadeBrick | Material::FacadePlaster) {
            self.balconies(builder, eaves, random);
        }
    }

    fn tower(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], top) = (self.half, self.eaves_m());
        self.walls(builder, SHOP_M, top * 0.3);
        self.bands(builder, self.half, SHOP_M, top * 0.3);
        self.entrance(builder, 0.0, 0.0, true);
        let podium = House { floors: 1, ..self.clone() };
        podium.shops(builder, random);
        let mut step = [x, y];
        let mut low = top * 0.3;
        let cuts = [0.72, 0.9, 1.0];
        for (index, cut) in cuts.into_iter().enumerate() {
            roof::flat(builder, step, low, random, self.detail);
            let shrink = random.between(0.80, 0.93);
            step = [step[0] * shrink, step[1] * shrink];
            let high = top * cut;
            builder.material(self.facade);
            builder.block(vec3(-step[0], -step[1], low), vec3(step[0], step[1], high));
            self.bands(builder, step, low, high);
            fins(builder, step, low, high, if self.detail == Detail::High { 1.8 } else { 3.6 });
            low = high;
            if index == 2 {
                roof::flat(builder, step, high, random, self.detail);
                roof::mast(builder, high, random.between(6.0, 14.0));
            }
        }
    }

    fn row(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        builder.material(Material::Concrete);
        builder.block(vec3(-x, -y - 0.06, -FOOTING_M), vec3(x, y + 0.06, 0.6));
        if self.facade == Material::FacadePlaster {
            builder.tinted(self.facade, *random.pick(&PLASTER));
        } else {
            builder.material(self.facade);
        }
        builder.block(vec3(-x, -y, 0.58), vec3(x, y, eaves));
        // A ledge above the shops, and a cornice below the roof.
        builder.material(Material::Concrete);
        for (z, out) in [(SHOP_M, 0.10), (eaves - 0.25, 0.28)] {
            builder.block(vec3(-x, -y - out, z - 0.1), vec3(x, y + out, z + 0.14));
        }
        if random.chance(0.65) {
            self.shops(builder, random);
        } else {
            let door = random.between(-0.5, 0.5) * (x - 1.2).max(0.0);
            self.entrance(builder, door, 0.0, false);
            self.windows(builder, 0.0, SHOP_M, Some(door), &[0]);
        }
        self.windows(builder, 0.0, SHOP_M, None, &[2]);
        self.windows(builder, SHOP_M, eaves, None, &[0, 2]);
        roof::pitched(builder, [x, y], eaves, random.between(0.8, 1.1), self.facade, false);
        roof::chimneys(builder, [x, y], eaves, random, 2);
        if random.chance(0.8) {
            roof::dormers(builder, [x, y], eaves, random);
        }
        downpipe(builder, vec3(x - 0.25, y + 0.06, eaves));
    }

    fn terrace(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        self.walls(builder, 0.5, eaves);
        let door = random.between(-0.6, 0.6) * (x - 1.2).max(0.0);
        self.entrance(builder, door, 0.5, false);
        // Its side walls touch those of the neighbouring buildings.
        self.windows(builder, 0.5, 0.5 + FLOOR_M, Some(door), &[0]);
        self.windows(builder, 0.5 + FLOOR_M, eaves, None, &[0]);
        self.windows(builder, 0.5, eaves, None, &[2]);
        roof::pitched(builder, [x, y], eaves, random.between(0.65, 1.0), self.facade, false);
        roof::chimneys(builder, [x, y], eaves, random, 1);
        if random.chance(0.55) {
            roof::dormers(builder, [x, y], eaves, random);
        }
        downpipe(builder, vec3(x - 0.25, y + 0.06, eaves));
    }

    fn villa(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        let hipped = random.chance(0.4);
        // A projecting wing makes the plan an L.
        let wing = random.chance(0.5);
        self.walls(builder, 0.5, eaves);
        roof::pitched(builder, [x, y], eaves, random.between(0.55, 0.85), self.facade, hipped);
        roof::chimneys(builder, [x, y], eaves, random, 1);
        let door = random.between(-0.5, 0.1) * x;
        self.entrance(builder, door, 0.5, true);
        self.windows(builder, 0.5, eaves, None, &[1, 2, 3]);
        if !wing {
            self.windows(builder, 0.5, 0.5 + FLOOR_M, Some(door), &[0]);
            self.windows(builder, 0.5 + FLOOR_M, eaves, None, &[0]);
        }
        if wing {
            let (from, to) = (x * 0.35, x * 0.92);
            builder.material(self.facade);
            builder.block(vec3(from, y - 0.5, -FOOTING_M), vec3(to, y + 1.6, eaves - 0.35));
            let front = Wall::new([0.0, y + 1.6], 0);
            for floor in 0..self.floors {
                let sill = 1.4 + FLOOR_M * floor as f32;
                let middle = (from + to) * 0.5;
                builder.material(Material::PaintWhite);
                front.patch(
                    builder,
                    [middle - 0.85, middle + 0.85],
                    [sill - 0.1, sill + 1.4],
                    0.015,
                );
                builder.material(Material::Glass);
                front.patch(builder, [middle - 0.75, middle + 0.75], [sill, sill + 1.3], 0.03);
            }
            builder.material(Material::RoofTiles);
            let (left, right) = (from - 0.3, to + 0.3);
            let (front, ridge) = (y + 1.95, eaves - 0.35 + (to - from) * 0.38);
            roof::prism(builder, [left, right], [y - 1.5, front], eaves - 0.35, ridge);
        }
        downpipe(builder, vec3(-x + 0.2, y + 0.06, eaves));
        downpipe(builder, vec3(x - 0.2, -y - 0.06, eaves));
    }

    fn hall(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let ([x, y], eaves) = (self.half, self.eaves_m());
        self.walls(builder, 1.0, eaves);
        roof::flat(builder, [x, y], eaves, random, self.detail);
        builder.material(Material::Glass);
        for side in 0..4 {
            Wall::new(self.half, side).band(builder, [eaves - 1.5, eaves - 0.7], 0.4);
        }
        // Pilasters, and gates towards the street.
        builder.material(Material::Concrete);
        let bays = ((x * 2.0 / 5.5) as u32).max(2);
        for bay in 0..=bays {
            let at = -x + 2.0 * x * bay as f32 / bays as f32;
            for front in [-1.0f32, 1.0] {
                let (a, b) = (front * (y - 0.05), front * (y + 0.16));
                builder
                    .block(vec3(at - 0.22, a.min(b), -1.0), vec3(at + 0.22, a.max(b), eaves + 0.1));
            }
        }
        for bay in (0..bays).step_by(2) {
            let at = -x + 2.0 * x * (bay as f32 + 0.5) / bays as f32;
            builder.material(Material::Metal);
            let half = (x / bays as f32 - 0.5).min(2.0);
            for slat in 0..5 {
                let z = 0.1 + 0.62 * slat as f32;
                builder.block(vec3(at - half, y - 0.05, z), vec3(at + half, y + 0.06, z + 0.58));
            }
        }
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

    /// Adds the box of the building, with a plinth of another material below `plinth`.
    fn walls(&self, builder: &mut MeshBuilder, plinth: f32, eaves: f32) {
        let [x, y] = self.half;
        builder.material(Material::Concrete);
        let out = 0.06;
        builder.block(vec3(-x - out, -y - out, -FOOTING_M), vec3(x + out, y + out, plinth));
        builder.material(self.facade);
        builder.block(vec3(-x, -y, plinth - 0.02), vec3(x, y, eaves));
    }

    /// Adds bands between floors, and pilasters at the corners.
    fn courses(&self, builder: &mut MeshBuilder, low: f32, eaves: f32, random: &mut RandomStream) {
        let [x, y] = self.half;
        let every =
            if self.facade == Material::FacadeGlass { 4 } else { 1 + random.remainder(3) as u32 };
        builder.material(Material::Concrete);
        let mut floor = 0;
        while low + FLOOR_M * (floor as f32) < eaves - 1.0 {
            let (z, out) = (low + FLOOR_M * floor as f32, if floor == 0 { 0.16 } else { 0.08 });
            builder.block(vec3(-x - out, -y - out, z - 0.12), vec3(x + out, y + out, z + 0.12));
            floor += every;
        }
        for (sx, sy) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            let corner = vec3(sx * (x - 0.3), sy * (y - 0.3), 0.0);
            builder.block(corner + vec3(-0.38, -0.38, low), corner + vec3(0.38, 0.38, eaves));
        }
        if self.detail == Detail::High {
            fins(builder, self.half, low, eaves, 4.8);
        }
    }

    /// Adds windows to some of the walls, on every floor between two heights.
    fn windows(
        &self,
        builder: &mut MeshBuilder,
        low: f32,
        high: f32,
        door: Option<f32>,
        walls: &[usize],
    ) {
        let homely = matches!(self.style, Style::Row | Style::Villa | Style::Terrace);
        let spec = Windows {
            pitch_m: if homely { 2.5 } else { 2.8 },
            size_m: if homely { [1.1, 1.35] } else { [1.35, 1.65] },
            frame: if self.facade == Material::FacadeBrick || homely {
                Material::PaintWhite
            } else {
                Material::Metal
            },
            detail: self.detail,
        };
        // The plinth of an apartment block protrudes.
        let half = if low < 0.4 { self.half.map(|half| half + 0.06) } else { self.half };
        let mut sill = low + 0.95;
        while sill + 1.7 < high {
            for wall in walls {
                Wall::new(half, *wall).row(builder, sill, &spec, door);
            }
            sill += FLOOR_M;
        }
    }

    /// Adds floors and windows as strips round the whole building.
    fn bands(&self, builder: &mut MeshBuilder, half: [f32; 2], low: f32, high: f32) {
        let glass = self.facade == Material::FacadeGlass;
        builder.material(if glass { Material::Metal } else { Material::Glass });
        let (from, to) = if glass { (-0.3, 0.3) } else { (0.9, 2.5) };
        let mut floor = low;
        while floor + to + 0.3 < high {
            if floor + from > low {
                for side in 0..4 {
                    Wall::new(half, side).band(builder, [floor + from, floor + to], 0.3);
                }
            }
            floor += FLOOR_M;
        }
    }

    /// Adds shop windows, doors and awnings along the street.
    fn shops(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let [x, y] = self.half;
        let count = ((x * 2.0 / 5.0) as u32).max(1);
        let width = x * 2.0 / count as f32;
        for shop in 0..count {
            let middle = -x + width * (shop as f32 + 0.5);
            let half = width * 0.5 - 0.35;
            let front = y + 0.06;
            builder.material(Material::Glass);
            builder.block(
                vec3(middle - half, front - 0.05, 0.55),
                vec3(middle + half * 0.4, front + 0.04, 2.9),
            );
            builder.material(Material::Wood);
            builder.block(
                vec3(middle + half * 0.48, front - 0.05, 0.02),
                vec3(middle + half, front + 0.05, 2.5),
            );
            builder.material(Material::CarPaint);
            builder.block(
                vec3(middle - half, front - 0.02, 3.05),
                vec3(middle + half, front + 0.12, 3.55),
            );
            if random.chance(0.5) {
                builder.material(Material::Cloth);
                let (low, high) = (2.55, 3.0);
                let at = |x: f32, out: f32, z: f32| vec3(middle + x, front + out, z);
                builder.quad([
                    at(-half, 0.0, high),
                    at(half, 0.0, high),
                    at(half, 1.3, low),
                    at(-half, 1.3, low),
                ]);
                builder.quad([
                    at(half, 0.0, high - 0.03),
                    at(-half, 0.0, high - 0.03),
                    at(-half, 1.3, low - 0.03),
                    at(half, 1.3, low - 0.03),
                ]);
                builder.quad([
                    at(-half, 1.3, low),
                    at(half, 1.3, low),
                    at(half, 1.3, low - 0.22),
                    at(-half, 1.3, low - 0.22),
                ]);
            }
        }
    }

    /// Adds a door with steps, and optionally a canopy.
    fn entrance(&self, builder: &mut MeshBuilder, x: f32, sill: f32, canopy: bool) {
        let y = self.half[1] + 0.06;
        builder.material(Material::Wood);
        builder.block(vec3(x - 0.6, y - 0.1, sill), vec3(x + 0.6, y + 0.05, sill + 2.25));
        builder.material(Material::Concrete);
        let steps = (sill / 0.17).ceil() as u32;
        for step in 0..steps {
            let out = y + 0.35 * (steps - step) as f32;
            let top = sill - 0.17 * (steps - 1 - step) as f32;
            builder.block(vec3(x - 0.9, y - 0.1, -FOOTING_M), vec3(x + 0.9, out, top.max(0.1)));
        }
        if canopy {
            builder.block(vec3(x - 1.2, y - 0.1, sill + 2.6), vec3(x + 1.2, y + 1.1, sill + 2.75));
            builder.material(Material::Metal);
            for side in [-1.05f32, 1.05] {
                let post = vec3(x + side, y + 0.95, 0.0);
                builder.rod(post - Vec3::Z * 0.5, post + Vec3::Z * (sill + 2.6), 0.06, 5);
            }
        }
    }

    /// Adds balconies on the street side.
    fn balconies(&self, builder: &mut MeshBuilder, eaves: f32, random: &mut RandomStream) {
        if !random.chance(0.5) {
            return;
        }
        let [x, y] = self.half;
        let count = ((x * 2.0 / 6.5) as u32).max(1);
        let rails = if self.detail == Detail::High { 9 } else { 0 };
        let mut z = SHOP_M;
        while z < eaves - 2.0 {
            for bay in 0..count {
                let at = -x + x * 2.0 * (bay as f32 + 0.5) / count as f32;
                builder.material(Material::Concrete);
                builder
                    .block(vec3(at - 1.3, y - 0.05, z - 0.08), vec3(at + 1.3, y + 1.15, z + 0.08));
                builder.material(Material::Metal);
                let (low, high) =
                    if rails > 0 { (z + 0.95, z + 1.05) } else { (z + 0.08, z + 1.05) };
                builder.block(vec3(at - 1.3, y + 1.09, low), vec3(at + 1.3, y + 1.14, high));
                for side in [-1.3f32, 1.25] {
                    builder.block(vec3(at + side, y, low), vec3(at + side + 0.05, y + 1.14, high));
                }
                for rail in 0..rails {
                    let x = at - 1.25 + 2.5 * rail as f32 / (rails - 1) as f32;
                    builder
                        .block(vec3(x - 0.015, y + 1.10, z), vec3(x + 0.015, y + 1.13, z + 0.95));
                }
            }
            z += FLOOR_M;
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

/// Adds vertical ribs round a box.
fn fins(builder: &mut MeshBuilder, [x, y]: [f32; 2], low: f32, high: f32, pitch: f32) {
    builder.material(Material::Metal);
    for side in 0..4 {
        let turn = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2 * side as f32);
        let (across, out) = if side % 2 == 0 { (x, y) } else { (y, x) };
        let count = ((across * 2.0 / pitch) as u32).max(1);
        for fin in 0..=count {
            let at = -across + across * 2.0 * fin as f32 / count as f32;
            let center = turn * vec3(at, out + 0.05, 0.0) + Vec3::Z * (low + high) * 0.5;
            builder.block_at(center, vec3(0.08, 0.12, (high - low) * 0.5), turn);
        }
    }
}

fn downpipe(builder: &mut MeshBuilder, top: Vec3) {
    builder.material(Material::Metal);
    builder.rod(vec3(top.x, top.y, -0.5), top, 0.05, 5);
}
