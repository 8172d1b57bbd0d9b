//! Buildings along streets: each frontage is divided into lots, and each lot gets a building that
//! fits.

use glam::{Vec2, Vec3, vec2, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        building::{House, Style},
        density::{Density, FAST_MPS},
        facade::Look,
        frontage::{Frontage, STEP_M, Station},
        plan::Plan,
        raster::{ground, rectangle},
        scene::{ObjectProperties, Place, Scene},
    },
    static_world::{Detail, Layer},
};

/// The clearance round a building. Metres.
const MARGIN_M: f32 = 0.5;
/// The greatest overhang of a roof or awning. Metres.
const ROOF_M: f32 = 1.5;
/// The density from which on terraced houses are built.
const OPEN_COUNTRY: f32 = 0.06;
/// The gap between houses up to which they are neighbours. Metres.
const NEIGHBOUR_M: f32 = 14.0;
/// The fraction of buildings that are unfinished.
const UNFINISHED: f32 = 0.035;
/// The density from which on gaps are filled.
const BUILT_UP: f32 = 0.35;

/// Builds along every outline; returns the gardens, as rectangles of ground before and behind
/// houses.
pub(super) fn build(
    plan: &mut Plan,
    scene: &mut Scene,
    outlines: &[Frontage],
    density: &Density,
) -> Vec<Garden> {
    let mut gardens = Vec::new();
    for (number, outline) in outlines.iter().enumerate() {
        // First the planned buildings, then small houses in the gaps.
        for (pass, narrow) in [(0, false), (1, true)] {
            let mut random = RandomStream::named(plan.seed, 0x107 + number as u64 * 16 + pass);
            line(plan, scene, outline, density, narrow, &mut random, &mut gardens);
        }
    }
    gardens
}

/// The ground that belongs to a house.
#[derive(Clone, Debug)]
pub(super) struct Garden {
    /// The point on the edge of the street in front of the middle of the house.
    pub(super) gate: Vec2,
    /// The direction away from the street.
    pub(super) out: Vec2,
    /// The width along the street. Metres.
    pub(super) width_m: f32,
    /// The distance from the street to the house. Metres.
    pub(super) front_m: f32,
    /// The distance from the street to the rear wall of the house. Metres.
    pub(super) back_m: f32,
    pub(super) style: Style,
    /// What the house looks like; `None` in low detail and if it is unfinished.
    pub(super) look: Option<Look>,
}

impl Garden {
    /// Whether the house at `gate` of this width would be a neighbour: beside it, or across a gap.
    pub(super) fn is_beside(&self, gate: Vec2, width_m: f32) -> bool {
        self.gate.distance(gate) < (self.width_m + width_m) * 0.5 + NEIGHBOUR_M
    }
}

fn line(
    plan: &mut Plan,
    scene: &mut Scene,
    frontage: &[Station],
    density: &Density,
    narrow: bool,
    random: &mut RandomStream,
    gardens: &mut Vec<Garden>,
) {
    let mut start = 0;
    while start + 2 < frontage.len() {
        let here = frontage[start];
        let dense = density.at(here.edge + here.out * 12.0);
        // There are no houses beside a motorway, but there are beside any road with a sidewalk.
        let fast = here.limit_mps >= FAST_MPS && here.walk_m < 0.5;
        if fast || dense < OPEN_COUNTRY || random.chance(0.03) {
            start += 4;
            continue;
        }
        let mut house = draw(dense, plan.is_old, random);
        if narrow {
            if dense < BUILT_UP {
                start += 4;
                continue;
            }
            if matches!(house.style, Style::Tower | Style::Hall | Style::Shell) {
                house.style = if plan.is_old { Style::Row } else { Style::Block };
                house.floors = if plan.is_old { 3 } else { 4 } + random.remainder(4) as u32;
            }
            house.half = [random.between(4.0, 6.5), random.between(4.5, 6.5)];
        }
        let wanted = (house.half[0] * 2.0 + gap(house.style)) / STEP_M;
        let end = (start + wanted.round() as usize).min(frontage.len() - 1);
        match place(plan, scene, &frontage[start..=end], house, dense, (random, gardens)) {
            Some(garden) => {
                gardens.push(garden);
                start = end;
            }
            None => start += 1,
        }
    }
}

/// The gap between neighbouring buildings. Metres.
fn gap(style: Style) -> f32 {
    match style {
        Style::Block => 0.4,
        Style::Row => 0.1,
        Style::Terrace => 0.3,
        Style::Tower => 5.0,
        Style::Villa => 7.0,
        Style::Hall => 6.0,
        Style::Shell => 3.0,
    }
}

/// Returns the building for a place of this density.
fn draw(dense: f32, is_old: bool, random: &mut RandomStream) -> House {
    let detail = Detail::Standard;
    let dice = random.unit();
    let style = if dense > 0.3 && random.chance(UNFINISHED) {
        Style::Shell
    } else if is_old && dense > 0.25 {
        if dice < 0.93 { Style::Row } else { Style::Terrace }
    } else if dense > 0.72 {
        if dice < 0.22 { Style::Tower } else { Style::Block }
    } else if dense > 0.42 {
        match dice {
            _ if dice < 0.55 => Style::Block,
            _ if dice < 0.95 => Style::Terrace,
            _ => Style::Hall,
        }
    } else if dense > 0.25 {
        match dice {
            _ if dice < 0.12 => Style::Block,
            _ if dice < 0.55 => Style::Terrace,
            _ if dice < 0.93 => Style::Villa,
            _ => Style::Hall,
        }
    } else {
        if dice < 0.93 { Style::Villa } else { Style::Hall }
    };
    let plaster = [Material::FacadePlaster, Material::FacadeBrick, Material::FacadeConcrete];
    let (width, depth, floors, facade) = match style {
        Style::Shell => (
            random.between(16.0, 26.0),
            random.between(11.0, 16.0),
            2 + random.remainder(4) as u32,
            Material::Concrete,
        ),
        Style::Tower => (
            random.between(20.0, 30.0),
            random.between(18.0, 26.0),
            10 + random.remainder(14) as u32,
            *random.pick(&[Material::FacadeGlass, Material::FacadeGlass, Material::FacadeConcrete]),
        ),
        Style::Block => (
            random.between(14.0, 30.0),
            random.between(11.0, 17.0),
            3 + random.remainder(3) as u32 + (dense * 3.0) as u32,
            if random.chance(0.15) { Material::FacadeGlass } else { *random.pick(&plaster) },
        ),
        Style::Row => (
            random.between(9.0, 17.0),
            random.between(10.0, 13.0),
            3 + random.remainder(2) as u32 + u32::from(dense > 0.5),
            if random.chance(0.75) { Material::FacadePlaster } else { Material::FacadeBrick },
        ),
        Style::Terrace => (
            random.between(7.0, 12.0),
            random.between(9.0, 12.0),
            2 + random.remainder(2) as u32,
            *random.pick(&plaster[..2]),
        ),
        Style::Villa => (
            random.between(9.0, 14.0),
            random.between(8.0, 11.0),
            1 + random.remainder(2) as u32,
            *random.pick(&plaster[..2]),
        ),
        Style::Hall => (
            random.between(20.0, 36.0),
            random.between(16.0, 26.0),
            1 + random.remainder(2) as u32,
            *random.pick(&[Material::FacadeConcrete, Material::Metal, Material::FacadeBrick]),
        ),
    };
    House { style, half: [width * 0.5, depth * 0.5], floors, facade, look: None, detail }
}

/// Places a building behind the stations: with the given depth if it fits, else a shallower one,
/// else none.
fn place(
    plan: &mut Plan,
    scene: &mut Scene,
    stations: &[Station],
    mut house: House,
    dense: f32,
    (random, gardens): (&mut RandomStream, &[Garden]),
) -> Option<Garden> {
    let (first, last) = (stations[0], stations[stations.len() - 1]);
    let along = (last.edge - first.edge).try_normalize()?;
    let mut out = along.perp();
    if out.dot(first.out) < 0.0 {
        out = -out;
    }
    house.half[0] = house.half[0].min((last.edge.distance(first.edge) - gap(house.style)) * 0.5);
    if house.half[0] < 3.2 {
        return None;
    }
    house.detail = plan.detail;
    let gate = (first.edge + last.edge) * 0.5;
    let front = match house.style {
        Style::Block if dense > 0.6 && first.walk_m > 1.5 => random.between(0.8, 1.6),
        Style::Block | Style::Tower => random.between(1.5, 5.0),
        // The buildings stand in one line along the street.
        Style::Row => 0.6,
        Style::Shell => random.between(4.5, 7.0),
        Style::Terrace => random.between(1.2, 3.5),
        Style::Villa => random.between(4.0, 9.0),
        Style::Hall => random.between(6.0, 12.0),
    } + if first.walk_m > 0.5 { 0.0 } else { 2.0 };
    let depth = house.half[1];
    for (shrink, back) in [(1.0, 0.0), (0.8, 0.0), (0.65, 0.0), (1.0, 2.0), (0.7, 3.0)] {
        house.half[1] = depth * shrink;
        if house.half[1] < 3.0 {
            continue;
        }
        // Steps, awnings and wings extend towards the street.
        let front = front + back;
        let center = gate + out * (front + house.half[1]);
        // The building's x is chosen so that its y points to the street.
        let yaw_rad = (-out).to_angle() - std::f32::consts::FRAC_PI_2;
        let taken = rectangle(center, vec2(house.half[0], house.half[1]) + MARGIN_M, yaw_rad);
        let roof = rectangle(center, vec2(house.half[0], house.half[1]) + ROOF_M, yaw_rad);
        if !plan.raster.is_free(&taken, ground::ANY)
            || !plan.raster.is_free(&roof, ground::CARRIAGEWAY)
        {
            continue;
        }
        plan.raster.stamp(&taken, ground::BUILT);
        let width_m = house.half[0] * 2.0 + gap(house.style);
        house.look = look(&house, gate, width_m, gardens, random.skip(1 << 20));
        erect(plan, scene, &house, Place { foot: plan.foot(center), yaw_rad }, random);
        return Some(Garden {
            gate,
            out,
            width_m,
            front_m: front,
            back_m: front + house.half[1] * 2.0,
            style: house.style,
            look: house.look,
        });
    }
    None
}

/// Draws what a house looks like, unlike its neighbours.
fn look(
    house: &House,
    gate: Vec2,
    width_m: f32,
    gardens: &[Garden],
    mut random: RandomStream,
) -> Option<Look> {
    if house.detail == Detail::Low {
        return None;
    }
    let beside = gardens.iter().filter(|other| other.is_beside(gate, width_m));
    let neighbours: Vec<&Look> = beside.filter_map(|other| other.look.as_ref()).collect();
    Look::draw(house.suits()?, house.facade, &neighbours, &mut random)
}

fn erect(
    plan: &Plan,
    scene: &mut Scene,
    house: &House,
    mut place: Place,
    random: &mut RandomStream,
) {
    // The building stands as high as the highest ground at its corners permits a door to be.
    let [x, y] = house.half;
    let highest = [(x, y), (-x, y), (x, -y), (-x, -y)]
        .map(|(x, y)| plan.height(place.point(vec3(x, y, 0.0)).truncate()))
        .into_iter()
        .fold(place.foot.z, f32::max);
    place.foot.z = (place.foot.z + highest) * 0.5;
    let colors = [[150, 36, 32], [30, 70, 120], [40, 96, 64], [196, 150, 40], [70, 70, 76]];
    let properties = ObjectProperties {
        tag: Tag::Building,
        layer: Layer::Buildings,
        color: *random.pick(&colors),
    };
    // A separate stream: numbers drawn by a finer model do not change later decisions.
    let mut inside = RandomStream::named(random.bits(), 0x40);
    scene.add(properties, place, |builder| house.model(builder, &mut inside));
    let low = Vec3::new(-x, -y, -3.0);
    scene.solid(&place, low, Vec3::new(x, y, house.eaves_m()));
}
