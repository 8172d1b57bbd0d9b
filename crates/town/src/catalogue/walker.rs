//! Pedestrians: CARLA's 49 ids, adults and children of several builds, each with different clothes.

use glam::{Quat, Vec3, vec3};
use mesh::{Material, Mesh, Tag};

use crate::{
    catalogue::{
        blueprint::{Blueprint, Kind},
        face,
        mesh_source::MeshSource,
        rig::{Joint, Motion, Rig},
        skeleton::{Skeleton, bone},
    },
    mesh_builder::MeshBuilder,
};

/// The description of a walker.
#[derive(Clone, Copy, Debug)]
pub(super) struct Person {
    id: &'static str,
    pub(super) is_female: bool,
    pub(super) is_child: bool,
    height_m: f32,
    /// The breadth relative to an average person.
    girth: f32,
    top: Top,
    bottom: Bottom,
    hair: Hair,
    carries: Carries,
    /// Indices into [`COLORS`]: upper garment, lower garment, hair, skin.
    colors: [usize; 4],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Top {
    Shirt,
    Sleeves,
    Jacket,
    Coat,
    Vest,
    Uniform,
}
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bottom {
    Trousers,
    Shorts,
    Skirt,
    Dress,
}
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hair {
    Short,
    Long,
    Bun,
    Bald,
    Cap,
    Hat,
    Hood,
}
#[derive(Clone, Copy, Debug, PartialEq)]
enum Carries {
    Nothing,
    Backpack,
    Handbag,
}

/// Colours, sRGB.
#[rustfmt::skip]
const COLORS: [[u8; 3]; 24] = [
    [232, 230, 224], [34, 36, 42], [128, 130, 134], [172, 34, 34], [36, 70, 132], [44, 96, 60], [226, 178, 52], [110, 74, 50],
    [46, 58, 92], [186, 152, 112], [96, 150, 190], [126, 60, 110], [214, 112, 66], [92, 100, 70], [200, 150, 160], [70, 130, 130],
    [32, 24, 20], [84, 54, 32], [190, 150, 84], [160, 160, 160],
    [238, 200, 174], [206, 158, 124], [150, 104, 76], [94, 62, 46],
];

macro_rules! people {
    ($($number:literal $gender:ident $age:ident $height:literal $girth:literal $top:ident $bottom:ident $hair:ident $carries:ident [$a:literal $b:literal $c:literal $d:literal])*) => {
        [$(Person {
            id: concat!("walker.pedestrian.", $number),
            is_female: people!(@ $gender),
            is_child: people!(@ $age),
            height_m: $height,
            girth: $girth,
            top: Top::$top,
            bottom: Bottom::$bottom,
            hair: Hair::$hair,
            carries: Carries::$carries,
            colors: [$a, $b, $c, $d],
        }),*]
    };
    (@ female) => { true };
    (@ male) => { false };
    (@ child) => { true };
    (@ adult) => { false };
}

#[rustfmt::skip]
const PEOPLE: [Person; 49] = people!(
    "0001" female adult 1.68 0.94 Shirt   Trousers Long  Nothing  [3 8 17 20]
    "0002" male   adult 1.82 1.02 Sleeves Trousers Short Nothing  [2 1 16 21]
    "0003" male   adult 1.78 0.98 Jacket  Trousers Short Backpack [4 9 17 20]
    "0004" male   adult 1.85 1.08 Coat    Trousers Bald  Nothing  [1 2 16 22]
    "0005" female adult 1.64 0.92 Sleeves Skirt    Bun   Handbag  [0 1 18 20]
    "0006" female adult 1.72 0.96 Jacket  Trousers Long  Handbag  [11 8 16 21]
    "0007" female adult 1.60 1.06 Coat    Dress    Hat   Handbag  [7 7 19 20]
    "0008" female adult 1.66 0.90 Vest    Shorts   Long  Backpack [6 4 18 21]
    "0009" female child 1.16 0.92 Shirt   Skirt    Long  Nothing  [14 11 18 20]
    "0010" male   child 1.24 0.96 Shirt   Shorts   Cap   Backpack [3 4 17 21]
    "0011" male   child 1.36 0.94 Jacket  Trousers Short Backpack [5 8 16 22]
    "0012" female child 1.30 0.92 Sleeves Trousers Bun   Nothing  [6 4 16 23]
    "0013" male   child 1.12 1.00 Shirt   Shorts   Short Nothing  [10 9 18 20]
    "0014" female child 1.40 0.92 Vest    Dress    Long  Nothing  [15 15 17 21]
    "0015" male   adult 1.76 1.14 Shirt   Trousers Short Nothing  [0 4 16 23]
    "0016" male   adult 1.88 1.00 Jacket  Trousers Cap   Nothing  [13 1 16 22]
    "0017" male   adult 1.74 0.95 Sleeves Trousers Hood  Backpack [2 8 16 21]
    "0018" female adult 1.70 0.92 Coat    Trousers Long  Handbag  [9 1 17 20]
    "0019" male   adult 1.80 1.20 Shirt   Shorts   Bald  Nothing  [5 9 16 20]
    "0020" female adult 1.62 1.12 Sleeves Dress    Bun   Handbag  [4 4 16 23]
    "0021" female adult 1.75 0.90 Vest    Trousers Long  Nothing  [12 1 16 22]
    "0022" male   adult 1.79 1.00 Coat    Trousers Hat   Nothing  [8 2 19 20]
    "0023" male   adult 1.72 1.06 Jacket  Trousers Short Nothing  [7 8 19 21]
    "0024" male   adult 1.91 0.96 Shirt   Trousers Short Backpack [10 1 17 20]
    "0025" male   adult 1.77 1.04 Vest    Shorts   Cap   Nothing  [3 1 16 23]
    "0026" female adult 1.67 0.94 Jacket  Skirt    Long  Handbag  [1 2 16 20]
    "0027" female adult 1.71 0.92 Shirt   Shorts   Bun   Backpack [15 9 18 21]
    "0028" male   adult 1.83 1.10 Sleeves Trousers Bald  Nothing  [12 8 16 23]
    "0029" female adult 1.63 1.00 Coat    Dress    Hood  Nothing  [15 15 16 21]
    "0030" male   adult 1.84 1.06 Uniform Trousers Cap   Nothing  [8 8 16 20]
    "0031" male   adult 1.81 0.98 Jacket  Trousers Hood  Backpack [3 1 16 22]
    "0032" male   adult 1.78 1.02 Uniform Trousers Cap   Nothing  [8 8 17 22]
    "0033" male   adult 1.73 1.16 Coat    Trousers Hat   Nothing  [2 1 19 20]
    "0034" female adult 1.69 0.93 Sleeves Trousers Long  Backpack [14 4 17 20]
    "0035" female adult 1.65 0.98 Shirt   Skirt    Long  Handbag  [6 5 16 22]
    "0036" male   adult 1.86 1.00 Sleeves Trousers Short Nothing  [4 9 18 20]
    "0037" male   adult 1.75 1.08 Jacket  Shorts   Short Nothing  [10 13 17 21]
    "0038" female adult 1.58 1.04 Jacket  Trousers Bun   Handbag  [3 1 19 20]
    "0039" male   adult 1.70 1.12 Shirt   Trousers Cap   Nothing  [13 7 16 23]
    "0040" female adult 1.74 0.91 Coat    Trousers Bun   Nothing  [0 8 16 22]
    "0041" male   adult 1.89 1.04 Jacket  Trousers Short Nothing  [1 4 16 21]
    "0042" female adult 1.66 0.95 Vest    Skirt    Long  Nothing  [5 0 17 20]
    "0043" male   adult 1.76 0.94 Shirt   Trousers Long  Backpack [11 1 17 20]
    "0044" female adult 1.61 1.08 Jacket  Trousers Short Handbag  [9 7 19 21]
    "0045" male   adult 1.82 1.00 Vest    Trousers Short Backpack [12 2 16 23]
    "0046" female adult 1.73 0.92 Sleeves Dress    Long  Handbag  [3 3 16 20]
    "0047" male   adult 1.79 1.06 Coat    Trousers Hood  Nothing  [13 1 16 22]
    "0048" male   child 1.20 0.98 Jacket  Trousers Cap   Nothing  [6 8 16 23]
    "0049" female child 1.26 0.92 Sleeves Dress    Bun   Backpack [11 11 16 21]
);

/// Returns all walkers, sorted by id.
pub(super) fn walkers() -> Vec<Blueprint> {
    (0..PEOPLE.len()).map(walker).collect()
}

/// The description of a walker's blueprint.
pub(super) fn person(blueprint: &Blueprint) -> &'static Person {
    match blueprint.mesh_source {
        MeshSource::Walker(number) => &PEOPLE[number],
        _ => &PEOPLE[0],
    }
}

fn walker(number: usize) -> Blueprint {
    let Person { id, height_m, girth, colors, .. } = PEOPLE[number];
    let (half_m, middle_x) = Figure::new(number).half_size();
    Blueprint {
        generation: 2,
        half_extents_m: half_m,
        center_m: vec3(middle_x, 0.0, half_m.z),
        mass_kg: 22.0 * girth * girth * height_m * height_m,
        default_color: COLORS[colors[0]],
        ..Blueprint::new(id, Kind::Walker, Tag::Pedestrian, MeshSource::Walker(number))
    }
}

/// The pieces: number, name, and the bone that each follows.
const PIECES: [(&str, usize); 11] = [
    ("crl_hips__C", bone::HIPS),
    ("crl_spine01__C", bone::CHEST),
    ("crl_Head__C", bone::HEAD),
    ("crl_arm__L", bone::ARM[0]),
    ("crl_foreArm__L", bone::FOREARM[0]),
    ("crl_arm__R", bone::ARM[1]),
    ("crl_foreArm__R", bone::FOREARM[1]),
    ("crl_thigh__L", bone::THIGH[0]),
    ("crl_leg__L", bone::LEG[0]),
    ("crl_thigh__R", bone::THIGH[1]),
    ("crl_leg__R", bone::LEG[1]),
];

pub(super) fn rig(number: usize) -> Rig {
    let Person { height_m, girth, .. } = PEOPLE[number];
    let joint = |(name, bone): (&'static str, usize)| Joint { name, motion: Motion::Bone(bone) };
    Rig { joints: PIECES.map(joint).to_vec(), skeleton: Some(Skeleton::new(height_m, girth)) }
}

pub(super) fn build_mesh(number: usize) -> Mesh {
    let mut builder = MeshBuilder::new(Tag::Pedestrian, Material::Cloth, 0);
    Figure::new(number).build_mesh(&mut builder);
    builder.mesh
}

/// Builds a person at rest, facing along x.
struct Figure {
    /// The index in [`PEOPLE`], by which details vary.
    number: usize,
    person: &'static Person,
    bones: Skeleton,
    height: f32,
}

impl Figure {
    fn new(number: usize) -> Figure {
        let person = &PEOPLE[number];
        let height = person.height_m;
        Figure { number, person, bones: Skeleton::new(height, person.girth), height }
    }

    fn at(&self, bone: usize) -> Vec3 {
        self.bones.bones[bone].at_m
    }

    /// The height of the head from chin to crown; larger relative to the body for children.
    fn head_m(&self) -> f32 {
        (self.height * 0.125).max(0.185)
    }

    /// Half the depth of the figure at rest, and the middle of that depth.
    fn half_size(&self) -> (Vec3, f32) {
        let cuff = if self.is_bare() { 0.015 } else { 0.019 } * self.sleeve();
        let aside = self.at(bone::HAND[0]).y + HAND_M[1].max(cuff) * self.height;
        let front = self.at(bone::FOOT[0]).x + (FOOT_M[0] + FOOT_M[1]) * self.height;
        let girth = self.person.girth;
        let seat = 0.068 * girth + 0.006;
        let chest = if self.is_bulky() { 0.0713 * girth } else { 0.066 * girth };
        let pack = if self.person.carries == Carries::Backpack { 0.0875 * girth } else { 0.0 };
        let hem = self.hem().map_or(0.0, |(_, reach, _)| reach * 0.78 * girth);
        let back = -seat.max(chest).max(pack).max(hem) * self.height;
        (vec3((front - back) * 0.5, aside, self.height * 0.5), (front + back) * 0.5)
    }

    /// Of a skirt or coat: the height and the reach of its hem as fractions of the height, and
    /// whether it belongs to the upper garment.
    fn hem(&self) -> Option<(f32, f32, bool)> {
        match (self.person.bottom, self.person.top) {
            (Bottom::Skirt, _) => Some((0.33, 0.110, false)),
            (Bottom::Dress, _) => Some((0.27, 0.116, true)),
            (_, Top::Coat) => Some((0.31, 0.104, true)),
            _ => None,
        }
    }

    fn is_bulky(&self) -> bool {
        matches!(self.person.top, Top::Jacket | Top::Coat)
    }

    /// Whether the forearms are bare.
    fn is_bare(&self) -> bool {
        matches!(self.person.top, Top::Shirt | Top::Vest)
    }

    /// The thickness of the arms relative to an average person.
    fn sleeve(&self) -> f32 {
        (0.5 + 0.5 * self.person.girth) * if self.is_bulky() { 1.18 } else { 1.0 }
    }

    /// The breadth of shoulders, waist and hips relative to the mean of both sexes.
    fn breadths(&self) -> [f32; 3] {
        match (self.person.is_child, self.person.is_female) {
            (true, _) => [0.96, 1.04, 0.96],
            (_, true) => [0.94, 0.90, 1.06],
            (_, false) => [1.06, 1.03, 0.95],
        }
    }

    fn color(&self, which: usize) -> [u8; 3] {
        COLORS[self.person.colors[which]]
    }

    fn build_mesh(&self, builder: &mut MeshBuilder) {
        self.hips(builder);
        self.chest(builder);
        self.head(builder);
        for side in 0..2 {
            self.arm(builder, side);
            self.leg(builder, side);
        }
    }

    fn upper(&self, builder: &mut MeshBuilder) {
        builder.material(Material::CarPaint);
    }

    fn lower(&self, builder: &mut MeshBuilder) {
        match self.person.bottom {
            Bottom::Dress => self.upper(builder),
            _ => {
                builder.tinted(Material::Cloth, self.color(1));
            }
        }
    }

    fn skin(&self, builder: &mut MeshBuilder) {
        builder.tinted(Material::Skin, self.color(3));
    }

    /// The rings of an upright trunk: (height, half breadth, half depth, forward), all as fractions
    /// of the body's height.
    fn trunk(&self, builder: &mut MeshBuilder, rings: &[[f32; 4]]) {
        let sides = 12;
        let (h, wide) = (self.height, self.person.girth);
        let rings: Vec<Vec<Vec3>> = rings
            .iter()
            .map(|[z, y, x, ahead]| {
                (0..sides)
                    .map(|side| {
                        let angle = std::f32::consts::TAU * side as f32 / sides as f32;
                        // Between an ellipse and a rectangle.
                        let square = |v: f32| v.signum() * v.abs().powf(0.8);
                        vec3(
                            (x * wide * square(angle.cos()) + ahead) * h,
                            y * wide * square(angle.sin()) * h,
                            z * h,
                        )
                    })
                    .collect()
            })
            .collect();
        builder.loft(&rings, |_, _| None);
    }

    fn hips(&self, builder: &mut MeshBuilder) {
        builder.object(0);
        self.lower(builder);
        let [_, waist, hips] = self.breadths();
        self.trunk(
            builder,
            &[
                [0.470, 0.060, 0.045, 0.0],
                [0.490, 0.090 * hips, 0.060, -0.004],
                [0.530, 0.098 * hips, 0.068, -0.006],
                [0.575, 0.088, 0.060, -0.002],
                [0.600, 0.084 * waist, 0.056, 0.0],
            ],
        );
        if let Some((hem, reach, is_upper)) = self.hem() {
            if is_upper {
                self.upper(builder)
            } else {
                self.lower(builder)
            }
            self.trunk(
                builder,
                &[
                    [hem, reach, reach * 0.78, 0.0],
                    [0.46, 0.110, 0.080, -0.004],
                    [0.53, 0.102, 0.074, -0.006],
                    [0.595, 0.088, 0.062, 0.0],
                ],
            );
        }
        builder.tinted(Material::Plastic, COLORS[1]);
        if matches!(self.person.bottom, Bottom::Trousers | Bottom::Shorts) {
            self.trunk(builder, &[[0.588, 0.088, 0.061, 0.0], [0.604, 0.087, 0.060, 0.0]]);
        }
    }

    fn chest(&self, builder: &mut MeshBuilder) {
        builder.object(1);
        self.upper(builder);
        let bust = if self.person.is_female && !self.person.is_child { 0.010 } else { 0.0 };
        let bulk = if self.is_bulky() { 1.08 } else { 1.0 };
        let [shoulders, waist, _] = self.breadths();
        self.trunk(
            builder,
            &[
                [0.560, 0.091 * bulk, 0.064 * bulk, -0.002],
                [0.585, 0.087 * bulk * waist, 0.060 * bulk, 0.0],
                [0.630, 0.084 * bulk * waist, 0.057 * bulk, 0.002],
                [0.700, 0.098 * bulk, 0.064 * bulk + bust, 0.002 + bust * 0.6],
                [0.745, 0.105 * bulk * shoulders, 0.066 * bulk + bust, 0.002 + bust * 0.8],
                [0.790, 0.106 * bulk * shoulders, 0.058 * bulk, -0.002],
                [0.815, 0.094 * shoulders, 0.046, -0.004],
                [0.832, 0.060, 0.036, -0.002],
                [0.840, 0.034, 0.030, 0.0],
            ],
        );
        let h = self.height;
        if matches!(self.person.top, Top::Shirt | Top::Sleeves) && self.number % 3 == 1 {
            // A broad stripe across the chest.
            builder.tinted(Material::Cloth, COLORS[(self.person.colors[0] + 5) % 16]);
            self.trunk(
                builder,
                &[
                    [0.690, 0.0975, 0.0645 + bust, 0.002 + bust * 0.5],
                    [0.745, 0.107 * shoulders, 0.0672 + bust, 0.002 + bust * 0.8],
                ],
            );
        }
        if self.is_bulky() || self.number.is_multiple_of(2) {
            // A collar.
            builder.tinted(Material::Cloth, self.color(0).map(|c| c / 2 + 30));
            self.trunk(builder, &[[0.826, 0.050, 0.042, -0.001], [0.848, 0.040, 0.036, 0.002]]);
        }
        match self.person.top {
            Top::Jacket | Top::Coat => {
                // An open front with the garment below it.
                builder.tinted(Material::Cloth, self.color(1).map(|c| c / 2 + 110));
                let front = (0.0725 + bust) * self.person.girth;
                builder.block(vec3(0.040, -0.018, 0.60) * h, vec3(front, 0.018, 0.775) * h);
            }
            Top::Uniform => {
                builder.tinted(Material::Metal, COLORS[6]);
                builder.block(vec3(0.05, 0.035, 0.745) * h, vec3(0.0675, 0.055, 0.775) * h);
                builder.tinted(Material::Plastic, COLORS[1]);
                self.trunk(builder, &[[0.585, 0.094, 0.068, 0.0], [0.605, 0.093, 0.067, 0.0]]);
            }
            _ => {}
        }
        self.skin(builder);
        builder.cone(
            vec3(-0.002, 0.0, 0.825) * h,
            vec3(0.006, 0.0, 0.885) * h,
            [0.034 * h, 0.030 * h],
            10,
        );
        match self.person.carries {
            Carries::Backpack => {
                builder.tinted(Material::Cloth, COLORS[(self.person.colors[1] + 3) % 16]);
                let (low, high) = (vec3(-0.0875, -0.075, 0.62), vec3(-0.045, 0.075, 0.80));
                builder.block(low * h * vec3(self.person.girth, 1.0, 1.0), high * h);
                for y in [-0.062, 0.062] {
                    builder
                        .block(vec3(0.040, y - 0.010, 0.66) * h, vec3(0.069, y + 0.010, 0.80) * h);
                    builder
                        .block(vec3(-0.05, y - 0.010, 0.796) * h, vec3(0.06, y + 0.010, 0.828) * h);
                }
            }
            Carries::Handbag => {
                builder.tinted(Material::Cloth, COLORS[(self.person.colors[0] + 7) % 16]);
                let y = 0.115 * self.person.girth;
                builder.block(vec3(-0.05, y - 0.018, 0.50) * h, vec3(0.05, y + 0.018, 0.57) * h);
                builder.pipe(
                    &[
                        vec3(0.03, y, 0.565) * h,
                        vec3(0.01, 0.05, 0.832) * h,
                        vec3(-0.03, y, 0.565) * h,
                    ],
                    0.004 * h,
                    4,
                );
            }
            Carries::Nothing => {}
        }
    }

    fn head(&self, builder: &mut MeshBuilder) {
        builder.object(2);
        let (h, tall) = (self.height, self.head_m());
        let half = tall * 0.5;
        // Of the head below hair or hat.
        let top = match self.person.hair {
            Hair::Bald => h,
            Hair::Hat => h - 0.018 * h,
            _ => h - 0.004 * h,
        };
        let center = vec3(0.010 * h, 0.0, top - half);
        self.skin(builder);
        let ring = |z: f32, x: f32, y: f32, ahead: f32| -> Vec<Vec3> {
            (0..12)
                .map(|side| {
                    let angle = std::f32::consts::TAU * side as f32 / 12.0;
                    center + vec3(angle.cos() * x + ahead, angle.sin() * y, z) * half
                })
                .collect()
        };
        // Chin, jaw, mouth, cheeks, eye sockets, brow, crown.
        let jaw = if self.person.is_female || self.person.is_child { 0.92 } else { 1.04 };
        builder.loft(
            &[
                ring(-1.0, 0.20, 0.18 * jaw, 0.36),
                ring(-0.90, 0.42, 0.38 * jaw, 0.26),
                ring(-0.60, 0.66, 0.56 * jaw, 0.08),
                ring(-0.30, 0.74, 0.64, 0.02),
                ring(-0.05, 0.77, 0.68, 0.0),
                ring(0.08, 0.75, 0.68, -0.01),
                ring(0.24, 0.83, 0.70, -0.02),
                ring(0.55, 0.78, 0.66, -0.05),
                ring(0.82, 0.52, 0.47, -0.07),
                ring(0.97, 0.18, 0.16, -0.08),
            ],
            |_, _| None,
        );
        for y in [-0.68, 0.68] {
            builder.ball(
                center + vec3(-0.04, y, -0.08) * half,
                vec3(0.13, 0.06, 0.20) * half,
                4,
                6,
            );
        }
        face::build(
            builder,
            &face::Face {
                number: self.number,
                center,
                half,
                skin: self.color(3),
                hair: self.color(2),
                is_grown_man: !self.person.is_female && !self.person.is_child,
            },
        );
        let hair = |builder: &mut MeshBuilder| {
            builder.tinted(Material::Bark, self.color(2));
        };
        let cap_of_hair = |builder: &mut MeshBuilder, back: f32| {
            builder.loft(
                &[
                    ring(back, 0.52, 0.66, -0.42),
                    ring(0.10, 0.62, 0.73, -0.30),
                    ring(0.42, 0.84, 0.74, -0.10),
                    ring(0.72, 0.76, 0.64, -0.07),
                    ring(0.95, 0.46, 0.40, -0.08),
                    ring(1.05, 0.10, 0.10, -0.08),
                ],
                |_, _| None,
            );
        };
        match self.person.hair {
            Hair::Short => {
                hair(builder);
                cap_of_hair(builder, -0.35);
            }
            Hair::Long => {
                hair(builder);
                cap_of_hair(builder, -0.35);
                builder.loft(
                    &[
                        ring(-1.75, 0.22, 0.62, -0.60),
                        ring(-0.9, 0.34, 0.74, -0.56),
                        ring(0.1, 0.40, 0.74, -0.50),
                    ],
                    |_, _| None,
                );
            }
            Hair::Bun => {
                hair(builder);
                cap_of_hair(builder, -0.35);
                builder.ball(
                    center + vec3(-0.85, 0.0, 0.38) * half,
                    Vec3::splat(0.30 * half),
                    5,
                    8,
                );
            }
            Hair::Bald => {
                hair(builder);
                builder.loft(
                    &[
                        ring(-0.85, 0.30, 0.46, -0.40),
                        ring(-0.50, 0.44, 0.60, -0.42),
                        ring(-0.10, 0.50, 0.71, -0.38),
                        ring(0.28, 0.47, 0.69, -0.38),
                        ring(0.40, 0.40, 0.60, -0.40),
                    ],
                    |_, _| None,
                );
            }
            Hair::Cap => {
                hair(builder);
                builder.loft(
                    &[ring(-0.3, 0.48, 0.68, -0.42), ring(0.2, 0.60, 0.72, -0.32)],
                    |_, _| None,
                );
                builder.tinted(Material::Cloth, COLORS[self.person.colors[1]]);
                builder.loft(
                    &[
                        ring(0.30, 0.88, 0.75, -0.04),
                        ring(0.72, 0.80, 0.68, -0.06),
                        ring(0.98, 0.50, 0.44, -0.08),
                        ring(1.06, 0.12, 0.12, -0.08),
                    ],
                    |_, _| None,
                );
                builder
                    .loft(&[ring(0.30, 0.46, 0.56, 0.76), ring(0.37, 0.44, 0.54, 0.74)], |_, _| {
                        None
                    });
            }
            Hair::Hat => {
                hair(builder);
                builder.loft(
                    &[ring(-0.3, 0.48, 0.68, -0.42), ring(0.2, 0.60, 0.72, -0.32)],
                    |_, _| None,
                );
                builder.tinted(Material::Cloth, COLORS[9]);
                builder.loft(
                    &[
                        ring(0.40, 1.35, 1.25, -0.04),
                        ring(0.47, 1.35, 1.25, -0.04),
                        ring(0.48, 0.85, 0.76, -0.04),
                        ring(1.05, 0.74, 0.64, -0.04),
                        ring(1.28, 0.60, 0.52, -0.04),
                    ],
                    |_, _| None,
                );
            }
            Hair::Hood => {
                builder.material(Material::CarPaint);
                builder.loft(
                    &[
                        ring(-1.10, 0.66, 0.72, -0.20),
                        ring(-0.60, 0.74, 0.82, -0.22),
                        ring(0.10, 0.80, 0.82, -0.20),
                        ring(0.60, 0.90, 0.78, -0.08),
                        ring(0.95, 0.58, 0.52, -0.06),
                        ring(1.06, 0.14, 0.14, -0.06),
                    ],
                    |_, _| None,
                );
            }
        }
    }

    fn arm(&self, builder: &mut MeshBuilder, side: usize) {
        let h = self.height;
        let (shoulder, elbow, hand) =
            (self.at(bone::ARM[side]), self.at(bone::FOREARM[side]), self.at(bone::HAND[side]));
        let radius = |fraction: f32| fraction * h * self.sleeve();
        builder.object(3 + 2 * side as u32);
        if self.person.top == Top::Vest {
            self.skin(builder)
        } else {
            self.upper(builder)
        }
        builder.ball(shoulder - Vec3::Z * 0.004 * h, Vec3::splat(radius(0.031)), 5, 8);
        let sleeve = shoulder.lerp(elbow, 0.55);
        builder.cone(shoulder, sleeve, [radius(0.030), radius(0.027)], 8);
        if self.person.top == Top::Shirt {
            self.skin(builder);
        }
        let rest = if self.person.top == Top::Shirt { 0.86 } else { 1.0 };
        builder.cone(sleeve, elbow, [radius(0.027) * rest, radius(0.023) * rest], 8);
        builder.object(4 + 2 * side as u32);
        let bare = self.is_bare();
        if bare {
            self.skin(builder)
        } else {
            self.upper(builder)
        }
        builder.ball(elbow, Vec3::splat(radius(0.023) * rest), 4, 8);
        builder.cone(
            elbow,
            hand,
            [radius(0.023) * rest, radius(if bare { 0.015 } else { 0.019 })],
            10,
        );
        self.skin(builder);
        let [x, y, z] = HAND_M;
        builder.ball(hand - Vec3::Z * z * 0.42 * h, vec3(x, y, z * 0.62) * h, 5, 8);
        // Slightly bent fingers, and the thumb ahead of them.
        let inwards = if side == 0 { -1.0 } else { 1.0 };
        for finger in 0..4 {
            let ahead = (0.40 - 0.26 * finger as f32) * 1.9 * x;
            let long = [0.50, 0.60, 0.56, 0.44][finger] * z;
            let from = hand + vec3(ahead, 0.0, -0.85 * z) * h;
            let to = from + vec3(0.001, inwards * 0.004, -long) * h;
            builder.cone(from, to, [0.0042 * h, 0.0034 * h], 5);
        }
        let from = hand + vec3(x * 0.75, inwards * 0.002, -z * 0.25) * h;
        let to = from + vec3(0.008, inwards * 0.002, -0.024) * h;
        builder.cone(from, to, [0.006 * h, 0.0042 * h], 5);
    }

    fn leg(&self, builder: &mut MeshBuilder, side: usize) {
        let (h, wide) = (self.height, 0.4 + 0.6 * self.person.girth);
        let (hip, knee, ankle) =
            (self.at(bone::THIGH[side]), self.at(bone::LEG[side]), self.at(bone::FOOT[side]));
        let radius = |fraction: f32| fraction * h * wide;
        let covered = self.person.bottom == Bottom::Trousers;
        builder.object(7 + 2 * side as u32);
        match self.person.bottom {
            Bottom::Skirt | Bottom::Dress => self.skin(builder),
            _ => self.lower(builder),
        }
        let hem = hip.lerp(knee, 0.78);
        builder.ball(hip, Vec3::splat(radius(0.046)), 5, 8);
        builder.cone(hip, hem, [radius(0.048), radius(0.037)], 9);
        if !covered {
            self.skin(builder);
        }
        builder.cone(
            hem,
            knee,
            [radius(0.037) * if covered { 1.0 } else { 0.9 }, radius(0.031)],
            12,
        );
        builder.object(8 + 2 * side as u32);
        if covered {
            self.lower(builder)
        } else {
            self.skin(builder)
        }
        builder.ball(knee, Vec3::splat(radius(0.031)), 4, 8);
        let calf = knee.lerp(ankle, 0.35) - Vec3::X * 0.006 * h;
        builder.cone(knee, calf, [radius(0.031), radius(0.032)], 9);
        builder.cone(calf, ankle, [radius(0.032), radius(if covered { 0.026 } else { 0.018 })], 12);
        // The shoe belongs to the shin: the ankle hardly bends while walking.
        const SHOES: [usize; 8] = [1, 7, 0, 1, 16, 3, 17, 2];
        let shoes = if self.person.is_child { self.number * 3 } else { self.number };
        builder.tinted(Material::Rubber, COLORS[SHOES[shoes % SHOES.len()]]);
        let turn = Quat::from_rotation_z(if side == 0 { 0.10 } else { -0.10 });
        let [ahead, long] = FOOT_M;
        let sole = vec3(ankle.x + ahead * h, ankle.y, 0.0);
        let outline = |z: f32, grow: f32| -> Vec<Vec3> {
            [
                (1.0, 0.0),
                (0.86, 0.20),
                (0.45, 0.27),
                (-0.2, 0.22),
                (-0.75, 0.20),
                (-1.0, 0.0),
                (-0.75, -0.20),
                (-0.2, -0.22),
                (0.45, -0.27),
                (0.86, -0.20),
            ]
            .map(|(x, y): (f32, f32)| {
                let slope = if x > 0.2 { 1.0 - 0.55 * (x - 0.2) } else { 1.0 };
                sole + turn * vec3(x * grow, y * grow, 0.0) * long * h + Vec3::Z * z * slope * h
            })
            .to_vec()
        };
        builder.loft(
            &[
                outline(0.0, 0.985),
                outline(0.012, 0.985),
                outline(0.036, 0.90),
                outline(0.050, 0.55),
            ],
            |_, _| None,
        );
    }
}

/// Half the size of a hand, as a fraction of the height.
const HAND_M: [f32; 3] = [0.017, 0.011, 0.042];
/// The distance from a shoe's middle to the ankle, and half its length, as fractions of the height.
const FOOT_M: [f32; 2] = [0.042, 0.078];
