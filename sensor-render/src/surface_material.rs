use glam::{Vec3, Vec4, Vec4Swizzles};
use mesh::{Material, Tag};
use protocol::{lamp, street_light};

use crate::{
    hit::NONE,
    instance::{StreetLight, lights},
    lidar_return::mixed,
    light::Light,
    plate,
    scene::Scene,
    triangle::Triangle,
    world::World,
};

/// Bits of [`SurfaceMaterial::pattern`].
pub(crate) mod pattern {
    /// Windows in rows, with wall between them.
    pub(crate) const WINDOWS: u32 = 1 << 0;
    /// Curtain wall: window panes only.
    pub(crate) const CURTAIN: u32 = 1 << 1;
    /// Courses of bricks.
    pub(crate) const BRICKS: u32 = 1 << 2;
    /// Square paving slabs.
    pub(crate) const SLABS: u32 = 1 << 3;
    /// Rows of roof tiles.
    pub(crate) const TILES: u32 = 1 << 4;
    /// Stains, cracks, repairs and covers of a road.
    pub(crate) const ROAD: u32 = 1 << 5;
    /// Worn paint on a road.
    pub(crate) const MARKING: u32 = 1 << 6;
    /// Dry and dense places of grass.
    pub(crate) const GRASS: u32 = 1 << 7;
    /// Pane of a building, with a room or a curtain behind it.
    pub(crate) const ROOM: u32 = 1 << 8;
    /// Lane of a road, with the tracks of wheels.
    pub(crate) const LANE: u32 = 1 << 9;
    /// Number plate.
    pub(crate) const PLATE: u32 = 1 << 10;
    /// Kerb stone.
    pub(crate) const KERB: u32 = 1 << 11;
    /// Lowest bit of how much oil lies on a lane, up to 3.
    pub(crate) const OIL_SHIFT: u32 = 12;
    /// Weathered wall of a building.
    pub(crate) const WALL: u32 = 1 << 14;
    /// Bark, with furrows and algae.
    pub(crate) const BARK: u32 = 1 << 15;
}

/// Shading parameters that are constant over a triangle.
///
/// Twin of `surface_material_of` in surface_material.wgsl.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceMaterial {
    /// Diffuse albedo, linear.
    pub(crate) albedo: Vec3,
    /// Specular reflectance at normal incidence.
    pub(crate) specular: f32,
    /// Emitted radiance, linear.
    pub(crate) emission: Vec3,
    /// Roughness of the specular reflection; 0 is a perfect mirror.
    pub(crate) roughness: f32,
    /// Wrap lighting: how far diffuse light reaches around the edge, as through leaves.
    pub(crate) wrap: f32,
    /// Bits of [`pattern`].
    pub(crate) pattern: u32,
    /// Strength and spots per metre of the fine grain, then of the coarse grain.
    pub(crate) grain: Vec4,
    /// Axes on the surface: horizontal and upward; on level surfaces world x and y.
    pub(crate) along: Vec3,
    pub(crate) up: Vec3,
    /// Wall that the triangle is part of; see [`crate::wall::Wall`]. Of a pane: its horizontal begin and width,
    /// its lower edge and height; so of a plate. Of a lane: x and y of the direction across it, the position of an edge along
    /// that, and the width.
    pub(crate) wall: [f32; 4],
    /// Hash of the object's id, for random variation; of a pane also of its tint.
    pub(crate) seed: u32,
    /// Of a vehicle's paint: plane from which heights above the road are measured, and the share of dirt at
    /// that height; see [`DIRT_M`].
    pub(crate) road: Vec4,
    pub(crate) dirt: f32,
}

impl SurfaceMaterial {
    /// Returns the shading parameters of a triangle of the town, or of an instance.
    #[inline]
    pub(crate) fn new(
        scene: &Scene,
        world: &World,
        light: &Light,
        triangle: u32,
        instance: u32,
    ) -> SurfaceMaterial {
        let triangle = &scene.triangles[triangle as usize];
        let actor = (instance != NONE).then(|| &world.instances[instance as usize]);
        let code = usize::from(triangle.material()).min(MATERIALS.len() - 1);
        let [color, parameters, grain] = MATERIALS[code].map(Vec4::from);
        let mut seed = mixed(actor.map_or(triangle.object, |actor| actor.id));
        let share = |bits: u32| (bits & 0xff) as f32 * (1.0 / 255.0) - 0.5;
        let (pale, warm) = (share(seed) * parameters.w, share(seed >> 8) * parameters.w);
        let tint = Vec3::new(1.0 + pale + warm * 0.4, 1.0 + pale, 1.0 + pale - warm * 0.6);
        let mut albedo = color.xyz() * tint;
        if code == Material::CarPaint as usize {
            let paint = match actor {
                Some(actor) => actor.color,
                None => PAINTS[(seed >> 16 & 7) as usize],
            };
            let [red, green, blue, _] = paint.to_le_bytes().map(|c| f32::from(c) * (1.0 / 255.0));
            albedo = linear(Vec3::new(red, green, blue)) * PAINT[1] + PAINT[0];
        }
        let foliage = code == Material::Leaves as usize || code == Material::Needles as usize;
        let own = u32::from(triangle.tint());
        if own != 0 {
            albedo = linear(Vec3::new(
                (own >> 11) as f32 * (1.0 / 31.0),
                (own >> 5 & 63) as f32 * (1.0 / 63.0),
                (own & 31) as f32 * (1.0 / 31.0),
            ));
            if foliage {
                // Plants of the same model differ.
                albedo *= tint;
            }
        }
        let normal = Vec3::from(triangle.edge1).cross(Vec3::from(triangle.edge2));
        let (mut along, mut up) = (Vec3::X, Vec3::Y);
        let mut pattern = parameters.z as u32;
        if own != 0 {
            // Façades in a colour of their own have windows of triangles.
            pattern &= !(pattern::WINDOWS | pattern::CURTAIN);
        }
        let flat = normal.x * normal.x + normal.y * normal.y;
        // Surfaces steeper than about 26 degrees have an upward axis.
        let bark = code == Material::Bark as usize;
        if foliage || bark {
            // Neighbouring facets of a tree crown or of a trunk share their axes.
            let [x, y, z] = normal.abs().to_array();
            if x >= y.max(z) {
                (along, up) = (Vec3::Y, Vec3::Z);
            } else if y >= z {
                (along, up) = (Vec3::X, Vec3::Z);
            }
            if bark {
                up *= BARK;
            }
        } else if flat > 0.24 * normal.z * normal.z {
            pattern &= !pattern::MARKING;
            along = Vec3::new(-normal.y, normal.x, 0.0) * (1.0 / flat.sqrt());
            up = normal.cross(along) * (1.0 / (flat + normal.z * normal.z).sqrt());
        }
        let (mut emission, mut grain) = (Vec3::ZERO, grain);
        let dark = light.horizon.w;
        let (mut road, mut dirt) = (Vec4::ZERO, 0.0);
        let mut wall = scene.walls[triangle.wall as usize].0;
        if let Some(actor) = actor {
            // Hair has the grain of bark.
            let is_plant = triangle.tag() == Tag::Vegetation as u8;
            pattern &= if is_plant { pattern::BARK } else { 0 };
            if !bark {
                grain = Vec4::ZERO;
            }
            emission = actor_emission(code, actor.lights, dark, albedo);
            if code == Material::LampWhite as usize && own != 0 {
                emission *= SIGN_SHARE;
            }
            if code == Material::CarPaint as usize {
                road = Vec4::from(actor.actor_from_world[2]);
                dirt = DIRT * ((seed >> 24) as f32 * (0.55 / 255.0) + 0.45);
            }
            if code == Material::Glass as usize && own == LENS {
                let lamp = Material::LampWhite as usize;
                emission = actor_emission(lamp, actor.lights, dark, albedo) * LENS_SHARE;
            }
            if code == Material::Sign as usize && own == plate::TINT {
                let [x, y, z] = actor.actor_from_world.map(Vec4::from);
                let origin = Vec3::new(x.w, y.w, z.w);
                wall = pane(triangle, along);
                wall[0] -= along.dot(origin);
                wall[2] -= up.dot(origin);
                let turned = |v: Vec3| x.xyz() * v.x + y.xyz() * v.y + z.xyz() * v.z;
                (along, up) = (turned(along), turned(up));
                (albedo, pattern) = (color.xyz(), pattern::PLATE);
            }
        } else if code == Material::LampWhite as usize {
            emission = street_light_emission(&world.street_lights, triangle.object, dark);
        } else if code == Material::Glass as usize
            && triangle.tag() == Tag::Building as u8
            && own != 0
        {
            emission = room_emission(seed, own, dark);
            if normal.z.abs() * 100.0 < flat.sqrt() {
                pattern |= pattern::ROOM;
                wall = pane(triangle, along);
                seed = mixed(seed ^ own);
            }
        } else if pattern & pattern::KERB != 0 {
            // Level stones have no foot, and that of stones on a slope is not level.
            let stone = pane(triangle, along);
            let has_foot = up.z > 0.9 && stone[3] < KERB_M;
            wall = if has_foot { stone } else { [0.0, 0.0, -1e4, 0.0] };
        } else if pattern & pattern::ROAD != 0 && own != 0 {
            let lane = lane(triangle);
            if lane[3] > LANE_M[0] && lane[3] < LANE_M[1] {
                // The blue of a lane's tint is its red, increased where vehicles wait.
                let oil = (own & 31).saturating_sub(own >> 11).min(3);
                albedo.z = albedo.x;
                pattern |= pattern::LANE | oil << pattern::OIL_SHIFT;
                wall = lane;
            }
        }
        SurfaceMaterial {
            albedo,
            specular: color.w,
            emission,
            roughness: parameters.x,
            wrap: parameters.y,
            pattern,
            grain,
            along,
            up,
            wall,
            seed,
            road,
            dirt,
        }
    }
}

/// Albedo from which on a pane of a building shows a curtain instead of a room.
pub(crate) const ROOM_ALBEDO_MAX: f32 = 0.09;

/// Largest height of a kerb stone on a level road. Metres.
const KERB_M: f32 = 0.19;

/// Smallest and largest width of a lane. Metres.
const LANE_M: [f32; 2] = [2.2, 5.5];

/// Returns the extent of a triangle that is half of an upright pane; see [`SurfaceMaterial::wall`].
fn pane(triangle: &Triangle, along: Vec3) -> [f32; 4] {
    let [corner, edge1, edge2] = [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
    let (a, b) = (edge1.dot(along), edge2.dot(along));
    let (left, right) = (a.min(b).min(0.0), a.max(b).max(0.0));
    let (low, high) = (edge1.z.min(edge2.z).min(0.0), edge1.z.max(edge2.z).max(0.0));
    [corner.dot(along) + left, right - left, corner.z + low, high - low]
}

/// Returns the lane of a triangle whose first edge lies along an edge of the lane; see
/// [`SurfaceMaterial::wall`].
fn lane(triangle: &Triangle) -> [f32; 4] {
    let [corner, edge1, edge2] = [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
    let long = (edge1.x * edge1.x + edge1.y * edge1.y).max(1e-6).sqrt();
    let (x, y) = (edge1.y * (1.0 / long), -edge1.x * (1.0 / long));
    let width = edge2.x * x + edge2.y * y;
    [x, y, corner.x * x + corner.y * y + width.min(0.0), width.abs()]
}

/// Converts from sRGB to linear, with a polynomial approximation of the curve.
fn linear(c: Vec3) -> Vec3 {
    c * (c * (c * 0.305_306_01 + 0.682_171_1) + 0.012_522_878)
}

/// Returns the radiance of a room behind a pane of a building: lit at night in a third of the panes,
/// which a hash of the object and the pane's tint decides, from warm to white. `dark` is 1 at night.
fn room_emission(seed: u32, tint: u32, dark: f32) -> Vec3 {
    let share = |word: u32| (mixed(word) & 0xff) as f32 * (1.0 / 255.0);
    let lit = if share(seed ^ tint) > 0.66 { 0.3 + 0.7 * share(seed ^ tint << 16) } else { 0.0 };
    let white = share(seed ^ tint << 8);
    Vec3::new(0.5, 0.3, 0.12).lerp(Vec3::new(0.4, 0.37, 0.31), white * white) * (lit * dark)
}

/// Returns the radiance that a street light emits. `dark` is 1 at night.
fn street_light_emission(overrides: &[StreetLight], number: u32, dark: f32) -> Vec3 {
    let own = Vec3::new(27.0, 22.5, 15.0);
    let Ok(at) = overrides.binary_search_by_key(&number, |lamp| lamp.number) else {
        return own * dark;
    };
    let lamp = overrides[at];
    let [r, g, b, _] = lamp.color.to_le_bytes().map(|part| f32::from(part) * (1.0 / 255.0));
    let emission = if lamp.color == 0 { own } else { linear(Vec3::new(r, g, b)) * 27.0 };
    let on = match lamp.mode {
        street_light::OFF => 0.0,
        street_light::ON => 1.0,
        _ => dark,
    };
    emission * (on * lamp.share)
}

/// Returns the radiance that a lamp of an actor emits. At night, head and tail lamps shine even if
/// they are not switched on, except those of parked vehicles.
fn actor_emission(code: usize, on: u32, dark: f32, albedo: Vec3) -> Vec3 {
    const LAMP_WHITE: usize = Material::LampWhite as usize;
    const LAMP_RED: usize = Material::LampRed as usize;
    const LAMP_AMBER: usize = Material::LampAmber as usize;
    const LAMP_HIGH: usize = Material::LampHigh as usize;
    const LAMP_REVERSE: usize = Material::LampReverse as usize;
    const LAMP_FOG: usize = Material::LampFog as usize;
    const LAMP_INTERIOR: usize = Material::LampInterior as usize;
    const INDICATOR_LEFT: usize = Material::IndicatorLeft as usize;
    const INDICATOR_RIGHT: usize = Material::IndicatorRight as usize;
    const BEACON: usize = Material::Beacon as usize;
    const SIGNAL_RED: usize = Material::SignalRed as usize;
    const SIGNAL_YELLOW: usize = Material::SignalYellow as usize;
    const SIGNAL_GREEN: usize = Material::SignalGreen as usize;
    let is_signal = on & lights::SIGNAL != 0;
    let shines = |bits: u32| f32::from(u8::from(!is_signal && on & bits != 0));
    let shows = |phase: u32| {
        let shown = on >> lights::PHASE_SHIFT & lights::PHASE_MASK;
        f32::from(u8::from(is_signal && shown == phase))
    };
    let dark = if on & lights::PARKED != 0 { 0.0 } else { dark };
    // Chromaticity (0.54, 0.40), between the limits of UN R148 towards red, y = 0.390, and green, y = x − 0.120;
    // the one towards white lies outside of sRGB.
    let amber = Vec3::new(3.6, 0.8, 0.03);
    match code {
        LAMP_WHITE => {
            let low = shines(lamp::LOW_BEAM | lamp::HIGH_BEAM);
            let weak = shines(lamp::POSITION) * 0.4;
            Vec3::new(24.0, 22.8, 20.4) * dark.max(low).max(weak)
        }
        LAMP_HIGH => Vec3::new(33.0, 31.8, 29.4) * shines(lamp::HIGH_BEAM),
        LAMP_RED => {
            let tail = 0.3 * dark.max(shines(lamp::POSITION | lamp::LOW_BEAM | lamp::HIGH_BEAM));
            Vec3::new(3.2, 0.12, 0.06) * shines(lamp::BRAKE).max(tail)
        }
        LAMP_REVERSE => Vec3::new(4.5, 4.4, 4.2) * shines(lamp::REVERSE),
        // Those at the rear are red.
        LAMP_FOG if albedo.x > albedo.y * 2.0 => Vec3::new(4.8, 0.18, 0.09) * shines(lamp::FOG),
        LAMP_FOG => Vec3::new(5.0, 4.8, 4.0) * shines(lamp::FOG),
        LAMP_INTERIOR => Vec3::new(4.0, 3.7, 3.0) * shines(lamp::INTERIOR),
        INDICATOR_LEFT => amber * shines(lamp::LEFT_BLINKER),
        INDICATOR_RIGHT => amber * shines(lamp::RIGHT_BLINKER),
        LAMP_AMBER => amber * 0.5,
        BEACON => {
            // Blue beacons belong to the second special light.
            let is_second = albedo.z > albedo.x;
            albedo * BEACON_GAIN * shines(if is_second { lamp::SPECIAL2 } else { lamp::SPECIAL1 })
        }
        SIGNAL_RED => Vec3::new(4.0, 0.12, 0.06) * shows(protocol::light::RED),
        // Chromaticity (0.52, 0.42), between the limits of EN 12368, y = 0.387 and y = 0.727 x + 0.054.
        SIGNAL_YELLOW => Vec3::new(3.6, 0.97, 0.03) * shows(protocol::light::YELLOW),
        SIGNAL_GREEN => Vec3::new(0.1, 3.0, 0.15) * shows(protocol::light::GREEN),
        _ => Vec3::ZERO,
    }
}

/// Tint of the clear cover of a head lamp, and the share of the lamp's radiance that the cover scatters.
const LENS: u32 = 1;
const LENS_SHARE: f32 = 0.012;

/// Share of a head lamp's radiance that a lit sign of a tint has: the radiance of a taxi's sign.
const SIGN_SHARE: f32 = 0.03;

/// Radiance of a beacon that shines, over the albedo of its dark lens.
const BEACON_GAIN: f32 = 24.0;

/// Dust and road film on the paint of vehicles: their albedo; the share of the paint that they cover at its lower
/// edge, of the dirtiest vehicle; and the heights above the road between which they end. Metres.
pub(crate) const DUST: Vec3 = Vec3::new(0.135, 0.122, 0.104);
const DIRT: f32 = 0.35;
pub(crate) const DIRT_M: [f32; 2] = [0.2, 0.95];

/// Albedo of the blackest car paint, and what the brightest colour of sRGB adds: no paint reflects all light of a
/// colour and none of another, and dust lies on white cars.
const PAINT: [f32; 2] = [0.01, 0.63];

/// How much longer than wide the grain of bark is, inverted.
pub(crate) const BARK: f32 = 0.35;

/// Albedo of the road that shows through a worn marking.
pub(crate) const WORN_PAINT: f32 = 0.1;

/// Colours of `CarPaint` on static objects, sRGB.
pub(crate) const PAINTS: [u32; 8] =
    [0x2a2a8c, 0x6e4628, 0x3c5a2d, 0x28282a, 0x969696, 0x1e82b4, 0x50286e, 0xb4bebe];

/// By the code of the [`Material`]: albedo and specular; roughness, wrap, pattern, variation of the
/// tint; grain.
pub(crate) const MATERIALS: [[[f32; 4]; 3]; Material::ALL.len()] = {
    let mut table = [[[0.3, 0.3, 0.3, 0.02], [0.6, 0.0, 0.0, 0.0], [0.0; 4]]; Material::ALL.len()];
    let mut index = 0;
    while index < Material::ALL.len() {
        let material = Material::ALL[index];
        table[material as usize] = parameters_of(material);
        index += 1;
    }
    table
};

const fn parameters_of(material: Material) -> [[f32; 4]; 3] {
    const WINDOWS: f32 = pattern::WINDOWS as f32;
    const CURTAIN: f32 = pattern::CURTAIN as f32;
    const BRICKS: f32 = (pattern::BRICKS | pattern::WALL) as f32;
    const WALL: f32 = pattern::WALL as f32;
    const SLABS: f32 = pattern::SLABS as f32;
    const TILES: f32 = pattern::TILES as f32;
    const ROAD: f32 = pattern::ROAD as f32;
    const MARKING: f32 = pattern::MARKING as f32;
    const GRASS: f32 = pattern::GRASS as f32;
    const KERB: f32 = pattern::KERB as f32;
    const BARK: f32 = pattern::BARK as f32;
    const SMOOTH: [f32; 4] = [0.0; 4];
    const STONE: [f32; 4] = [0.09, 19.0, 0.1, 0.4];
    const DULL: [f32; 4] = [0.6, 0.0, 0.0, 0.0];
    match material {
        Material::Asphalt => {
            [[0.082, 0.082, 0.086, 0.03], [0.78, 0.0, ROAD, 0.0], [0.34, 55.0, 0.1, 0.31]]
        }
        Material::PaintWhite => {
            [[0.68, 0.68, 0.66, 0.03], [0.6, 0.0, MARKING, 0.0], [0.3, 17.0, 0.3, 0.9]]
        }
        Material::PaintYellow => {
            [[0.62, 0.38, 0.05, 0.03], [0.6, 0.0, MARKING, 0.0], [0.3, 17.0, 0.3, 0.9]]
        }
        // Weathered concrete reflects 0.2 to 0.3 of the light, new one 0.4.
        Material::Paving => [[0.27, 0.258, 0.237, 0.02], [0.6, 0.0, SLABS, 0.0], STONE],
        Material::Kerb => [[0.34, 0.332, 0.316, 0.02], [0.6, 0.0, KERB, 0.0], STONE],
        Material::Grass => {
            [[0.085, 0.113, 0.045, 0.0], [0.8, 0.35, GRASS, 0.0], [0.42, 12.0, 0.26, 0.22]]
        }
        Material::Soil => [[0.15, 0.105, 0.07, 0.0], [0.8, 0.0, 0.0, 0.0], [0.5, 7.0, 0.4, 0.5]],
        Material::Concrete => [[0.40, 0.39, 0.37, 0.02], [0.6, 0.0, 0.0, 0.12], STONE],
        Material::FacadeBrick => {
            [[0.26, 0.125, 0.09, 0.01], [0.7, 0.0, WINDOWS + BRICKS, 0.8], [0.12, 9.0, 0.14, 0.4]]
        }
        Material::FacadePlaster => {
            [[0.60, 0.53, 0.43, 0.01], [0.7, 0.0, WINDOWS + WALL, 0.55], [0.06, 14.0, 0.07, 0.35]]
        }
        Material::FacadeGlass => {
            [[0.22, 0.23, 0.24, 0.05], [0.3, 0.0, CURTAIN, 0.5], [0.05, 5.0, 0.0, 0.5]]
        }
        Material::FacadeConcrete => {
            [[0.44, 0.43, 0.41, 0.01], [0.7, 0.0, WINDOWS + WALL, 0.4], [0.1, 9.0, 0.08, 0.4]]
        }
        Material::RoofFlat => [[0.15, 0.15, 0.155, 0.02], DULL, STONE],
        Material::RoofTiles => {
            [[0.27, 0.10, 0.06, 0.02], [0.6, 0.0, TILES, 0.7], [0.35, 5.0, 0.3, 0.5]]
        }
        Material::Bark => {
            [[0.12, 0.085, 0.06, 0.0], [0.8, 0.0, BARK, 0.3], [0.22, 27.0, 0.12, 5.0]]
        }
        Material::Leaves => {
            [[0.078, 0.128, 0.038, 0.0], [0.6, 0.5, 0.0, 0.5], [0.8, 8.5, 0.6, 1.7]]
        }
        Material::Needles => {
            [[0.042, 0.076, 0.042, 0.0], [0.7, 0.4, 0.0, 0.4], [0.95, 9.0, 0.5, 1.6]]
        }
        Material::Metal => [[0.32, 0.33, 0.34, 0.18], [0.35, 0.0, 0.0, 0.1], SMOOTH],
        Material::Glass => [[0.012, 0.015, 0.017, 0.08], [0.05, 0.0, 0.0, 0.0], SMOOTH],
        Material::CarPaint => [[0.3, 0.3, 0.3, 0.04], [0.03, 0.0, 0.0, 0.0], SMOOTH],
        Material::Rubber => [[0.030, 0.029, 0.028, 0.02], DULL, SMOOTH],
        Material::Plastic => [[0.035, 0.036, 0.038, 0.04], [0.4, 0.0, 0.0, 0.0], SMOOTH],
        Material::LampWhite => [[0.17, 0.175, 0.19, 0.28], [0.08, 0.0, 0.0, 0.0], SMOOTH],
        Material::LampRed => [[0.34, 0.015, 0.012, 0.06], [0.1, 0.0, 0.0, 0.0], SMOOTH],
        Material::LampAmber | Material::IndicatorLeft | Material::IndicatorRight => {
            [[0.5, 0.2, 0.02, 0.06], [0.1, 0.0, 0.0, 0.0], SMOOTH]
        }
        Material::LampHigh | Material::LampReverse | Material::LampFog => {
            [[0.17, 0.175, 0.19, 0.26], [0.08, 0.0, 0.0, 0.0], SMOOTH]
        }
        Material::LampInterior => [[0.6, 0.58, 0.52, 0.03], DULL, SMOOTH],
        Material::Beacon => [[0.5, 0.1, 0.1, 0.08], [0.1, 0.0, 0.0, 0.0], SMOOTH],
        Material::SignalRed => [[0.10, 0.012, 0.01, 0.04], [0.2, 0.0, 0.0, 0.0], SMOOTH],
        Material::SignalYellow => [[0.11, 0.07, 0.01, 0.04], [0.2, 0.0, 0.0, 0.0], SMOOTH],
        Material::SignalGreen => [[0.01, 0.085, 0.025, 0.04], [0.2, 0.0, 0.0, 0.0], SMOOTH],
        Material::Sign => [[0.72, 0.72, 0.72, 0.03], [0.3, 0.0, 0.0, 0.0], SMOOTH],
        Material::Wood => {
            [[0.20, 0.115, 0.06, 0.02], [0.5, 0.0, 0.0, 0.5], [0.14, 22.0, 0.07, 1.5]]
        }
        Material::Skin => [[0.48, 0.30, 0.22, 0.02], [0.5, 0.25, 0.0, 0.5], SMOOTH],
        Material::Cloth => [[0.19, 0.19, 0.24, 0.0], [0.9, 0.2, 0.0, 1.4], SMOOTH],
        Material::Water => [[0.02, 0.04, 0.05, 0.1], [0.06, 0.0, 0.0, 0.0], SMOOTH],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lane_lies_beside_the_first_edge_of_its_triangles() {
        // A lane 3.5 m wide from (10, 20) towards (3, 4) / 5, its triangles on both sides of a diagonal.
        let (along, right) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.8, -0.6, 0.0));
        let left0 = Vec3::new(10.0, 20.0, 0.0);
        let (left1, right0) = (left0 + along * 6.0, left0 + right * 3.5);
        let right1 = right0 + along * 6.0;
        for [a, b, c] in [[left1, left0, right0], [right0, right1, left0]] {
            let triangle = Triangle {
                corner: a.to_array(),
                edge1: (b - a).to_array(),
                edge2: (c - a).to_array(),
                ..Triangle::default()
            };
            let [x, y, edge, width] = lane(&triangle);
            assert!((width - 3.5).abs() < 1e-4, "{width}");
            for (share, point) in
                [(0.0, left0), (0.25, left0 + right * 0.875 + along), (1.0, right1)]
            {
                let off = (point.x * x + point.y * y - edge) / width;
                assert!((off - share).abs().min((1.0 - off - share).abs()) < 1e-4, "{off} {share}");
            }
        }
    }

    #[test]
    fn a_pane_has_the_extent_of_both_of_its_triangles() {
        let [a, b, c, d] =
            [[4., 1., 2.], [4., 3., 2.], [4., 3., 3.5], [4., 1., 3.5]].map(Vec3::from_array);
        for [a, b, c] in [[a, b, c], [a, c, d]] {
            let triangle = Triangle {
                corner: a.to_array(),
                edge1: (b - a).to_array(),
                edge2: (c - a).to_array(),
                ..Triangle::default()
            };
            assert_eq!(pane(&triangle, Vec3::Y), [1.0, 2.0, 2.0, 1.5]);
        }
    }
}
