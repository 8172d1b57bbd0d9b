//! Trees, hedges and fences on unbuilt ground.

use glam::{Vec2, Vec3, vec2, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        building::Style,
        density::Density,
        lots::Garden,
        plan::Plan,
        raster::{ground, rectangle, square},
        scene::{ObjectProperties, Place, Scene},
    },
    mesh_builder::MeshBuilder,
    plants::{Form, Species, VARIANTS, model_index, models},
    static_world::{Detail, Layer},
};

/// The least distance of simplified trees from roads. Metres.
const FAR_M: f32 = 18.0;

/// Plants a tree if its trunk has room: on a sidewalk or in the open, not among other objects.
pub(super) fn plant(
    plan: &mut Plan,
    scene: &mut Scene,
    species: Species,
    at: Vec2,
    scale: f32,
    random: &mut RandomStream,
) -> bool {
    let variant = random.remainder(VARIANTS);
    let yaw_rad = random.between(0.0, std::f32::consts::TAU);
    let form = match plan.detail {
        Detail::Low => Form::Coarse,
        Detail::Standard if is_far(plan, at) => Form::Far,
        Detail::Standard | Detail::High => Form::Near,
    };
    let index = model_index(species, form, variant);
    let model = &models()[index as usize];
    let trunk = (model.shape.trunk_radius_m * scale).max(0.3);
    let taken = ground::BESIDE;
    // Crowns may extend over sidewalks above head height, and pruned crowns over roads, but not
    // into buildings.
    let crown = model.shape.crown_radius_m * scale;
    let low_crown = matches!(species, Species::Spruce | Species::Bush);
    let room = if low_crown { crown } else { trunk };
    let over = if species == Species::Plane { trunk } else { crown * 0.95 };
    if !plan.raster.is_free(&square(at, room), taken)
        || !plan.raster.is_free(&square(at, over), ground::CARRIAGEWAY)
        || !plan.raster.is_free(&square(at, crown * 0.75), ground::BUILT)
    {
        return false;
    }
    plan.raster.stamp(&square(at, (crown * 0.7).max(0.5)), ground::FURNITURE);
    let place = Place { foot: plan.foot(at), yaw_rad };
    let properties =
        ObjectProperties { tag: Tag::Vegetation, layer: Layer::Foliage, color: [70, 110, 50] };
    if form == Form::Coarse {
        scene.add(properties, place, |builder| builder.append(model.mesh(), scale));
    } else {
        scene.plant(properties, place, index, scale);
    }
    if model.shape.trunk_radius_m > 0.0 {
        let (radius, height) = (model.shape.trunk_radius_m, model.shape.height_m * 0.6);
        scene.solid_post(&place, radius * scale, height * scale);
    }
    true
}

/// Whether no road is near a point.
fn is_far(plan: &Plan, at: Vec2) -> bool {
    let ring = |radius: f32, count: u32| {
        (0..count).all(|step| {
            let around = Vec2::from_angle(std::f32::consts::TAU * step as f32 / count as f32);
            plan.raster.at(at + around * radius) & ground::CARRIAGEWAY == 0
        })
    };
    ring(FAR_M / 3.0, 6) && ring(FAR_M * 2.0 / 3.0, 12) && ring(FAR_M, 18)
}

/// Plants hedges and fences in front of houses, and trees before and behind them.
pub(super) fn gardens(plan: &mut Plan, scene: &mut Scene, gardens: &[Garden]) {
    for (number, garden) in gardens.iter().enumerate() {
        let mut random = RandomStream::named(plan.seed, 0x6a4d + number as u64 * 16);
        let along = garden.out.perp();
        let homely = matches!(garden.style, Style::Villa | Style::Terrace);
        if homely && garden.front_m > 1.4 {
            enclose(plan, scene, garden, &mut random);
        }
        let trees = match garden.style {
            Style::Villa => 5,
            Style::Terrace | Style::Hall => 2,
            Style::Block | Style::Row | Style::Tower => 1,
            Style::Shell => 0,
        };
        for _ in 0..trees {
            let behind = random.chance(0.7);
            let (from, to) = if behind {
                (garden.back_m + 1.5, garden.back_m + 14.0)
            } else {
                (1.0, garden.front_m - 1.0)
            };
            if to <= from {
                continue;
            }
            let at = garden.gate
                + garden.out * random.between(from, to)
                + along * random.between(-0.5, 0.5) * garden.width_m;
            if plan.raster.at(at) & ground::ROAD != 0 {
                continue;
            }
            let species = *random.pick(&[
                Species::Lime,
                Species::Oak,
                Species::Spruce,
                Species::Bush,
                Species::Bush,
            ]);
            plant(plan, scene, species, at, random.between(0.55, 0.9), &mut random);
        }
    }
}

/// Adds a hedge, a wall or a fence along the street, with a gap in front of the door.
fn enclose(plan: &mut Plan, scene: &mut Scene, garden: &Garden, random: &mut RandomStream) {
    let along = garden.out.perp();
    let dice = random.unit();
    let half_gap = 1.1;
    let reach = garden.width_m * 0.5;
    for side in [-1.0f32, 1.0] {
        let length = (reach - half_gap) * 0.5;
        if length < 0.8 {
            continue;
        }
        let middle = garden.gate + garden.out * 0.55 + along * side * (half_gap + length);
        let yaw_rad = along.to_angle();
        let outline = rectangle(middle, vec2(length, 0.3), yaw_rad);
        if !plan.raster.is_free(&outline, ground::ANY) {
            continue;
        }
        plan.raster.stamp(&outline, ground::FURNITURE);
        // Both ends stand on the ground, whatever its slope.
        let heights = [-1.0, 1.0].map(|end| plan.height(middle + along * length * end));
        let foot = middle.extend(heights[0].min(heights[1]));
        let slope = (heights[1] - heights[0]).abs();
        let place = Place { foot, yaw_rad };
        let detail = plan.detail;
        if dice < 0.45 {
            let properties = ObjectProperties {
                tag: Tag::Vegetation,
                layer: Layer::Foliage,
                color: [60, 100, 48],
            };
            let top = slope + random.between(0.9, 1.5);
            let mut leaves = RandomStream::named(random.bits(), 0x1eaf);
            scene.add(properties, place, |builder| match detail {
                Detail::Low => {
                    builder.material(Material::Leaves);
                    builder.block(vec3(-length, -0.28, -0.3), vec3(length, 0.28, top));
                }
                _ => hedge(builder, length, top, &mut leaves),
            });
            scene.solid(&place, vec3(-length, -0.28, -0.3), vec3(length, 0.28, top));
        } else if dice < 0.65 {
            let properties =
                ObjectProperties { tag: Tag::Wall, layer: Layer::Walls, color: [150, 140, 130] };
            let (top, brick) = (slope + 0.85, random.chance(0.6));
            scene.add(properties, place, |builder| {
                builder.material(if brick {
                    Material::FacadeBrick
                } else {
                    Material::FacadePlaster
                });
                builder.block(vec3(-length, -0.12, -0.4), vec3(length, 0.12, top));
                builder.material(Material::Concrete);
                builder.block(vec3(-length, -0.17, top), vec3(length, 0.17, top + 0.07));
                let gate = -side * (length - 0.2);
                builder.block(vec3(gate - 0.2, -0.2, -0.4), vec3(gate + 0.2, 0.2, top + 0.35));
            });
            scene.solid(&place, vec3(-length, -0.2, -0.4), vec3(length, 0.2, top + 0.07));
        } else {
            let properties =
                ObjectProperties { tag: Tag::Fence, layer: Layer::Walls, color: [150, 120, 90] };
            let top = slope + 1.05;
            scene.add(properties, place, |builder| {
                builder.material(Material::Wood);
                for z in [slope + 0.25, slope + 0.8] {
                    builder.block(vec3(-length, -0.03, z), vec3(length, 0.03, z + 0.08));
                }
                let pitch = match detail {
                    Detail::Low => 2.7,
                    Detail::Standard => 0.9,
                    Detail::High => 0.22,
                };
                let count = (length * 2.0 / pitch) as u32;
                for picket in 0..=count {
                    let x = -length + length * 2.0 * picket as f32 / count.max(1) as f32;
                    builder.block(vec3(x - 0.05, 0.03, -0.3), vec3(x + 0.05, 0.06, top));
                }
            });
            scene.solid(&place, vec3(-length, -0.05, -0.3), vec3(length, 0.07, top));
        }
    }
}

/// The leaves of a hedge on a square metre of its surface.
const LEAVES_PER_M2: f32 = 19.0;

/// Adds a hedge along x: a dark core in the shape of a box, and leaves of many sizes on it.
fn hedge(builder: &mut MeshBuilder, length: f32, top: f32, random: &mut RandomStream) {
    let half = 0.28;
    builder.tinted(Material::Leaves, [34, 50, 24]);
    builder.block(vec3(-length, 0.07 - half, -0.3), vec3(length, half - 0.07, top - 0.07));
    let (wide, round) = (half * 2.0, top * 2.0 + half * 2.0);
    let count = (LEAVES_PER_M2 * (2.0 * length * round + 2.0 * wide * top)) as u32;
    let ends = wide * top / (length * round + wide * top);
    for _ in 0..count {
        let up = random.unit() * top;
        // A point on the long sides and the top, or on an end, and the direction out of it.
        let (at, out) = if random.chance(ends) {
            let end = if random.chance(0.5) { 1.0 } else { -1.0 };
            (vec3(end * length, random.between(-half, half), up), Vec3::X * end)
        } else {
            let x = random.between(-length, length);
            match random.unit() * round {
                along if along < top => (vec3(x, half, up), Vec3::Y),
                along if along < top * 2.0 => (vec3(x, -half, up), -Vec3::Y),
                _ => (vec3(x, random.between(-half, half), top), Vec3::Z),
            }
        };
        let mut tilt = || random.between(-0.7, 0.7);
        let normal = (out + vec3(tilt(), tilt(), tilt())).normalize_or(out);
        let along = vec3(tilt(), tilt(), tilt() - 0.2).reject_from_normalized(normal);
        let along = along.normalize_or(normal.any_orthonormal_vector());
        let size = 0.08 + 0.14 * random.unit() * random.unit();
        let at = at - out * random.between(0.0, 0.05);
        let side = normal.cross(along) * size * 0.55;
        let bright = random.between(0.72, 1.15) * (0.75 + 0.25 * (at.z / top).clamp(0.0, 1.0));
        builder.tinted(Material::Leaves, [78.0, 106.0, 50.0].map(|c| (c * bright) as u8));
        let along = along * size;
        builder.quad([at - along, at + side, at + along, at - side]);
    }
}

/// Plants trees in courtyards, in parks, and in woods round the town.
pub(super) fn open_ground(plan: &mut Plan, scene: &mut Scene, density: &Density) {
    let (low, high) = plan.town;
    let mut random = RandomStream::named(plan.seed, 0x9e0);
    let size = high - low;
    // On large maps woods are sparser, which limits the number of triangles.
    let area = size.x * size.y;
    let pitch = (area / 14_000.0).sqrt().max(9.0);
    let (rows, columns) = ((size.y / pitch) as i32, (size.x / pitch) as i32);
    let phase = random.between(0.0, std::f32::consts::TAU);
    for row in 0..rows {
        for column in 0..columns {
            let jitter = vec2(random.unit(), random.unit());
            let dice = random.unit();
            let at = low + (vec2(column as f32, row as f32) + jitter) * pitch;
            let wood = (at.x * 0.021 + phase).sin() * (at.y * 0.024 - phase).sin()
                + 0.4 * (at.x * 0.055 - at.y * 0.047).sin();
            let town = density.at(at);
            let wanted = if town > 0.25 { 0.22 } else { 0.10 + 0.55 * wood.max(0.0) };
            if dice > wanted || plan.raster.at(at) & ground::ANY != 0 {
                continue;
            }
            let species = match random.unit() {
                _ if wood > 0.5 && town < 0.25 => Species::Spruce,
                dice if dice < 0.35 => Species::Oak,
                dice if dice < 0.65 => Species::Lime,
                dice if dice < 0.75 => Species::Poplar,
                dice if dice < 0.85 => Species::Spruce,
                _ => Species::Bush,
            };
            // A distance from roads keeps branches off cars.
            if plan.raster.is_free(&square(at, 2.5), ground::CARRIAGEWAY | ground::BUILT) {
                plant(plan, scene, species, at, random.between(0.7, 1.15), &mut random);
            }
        }
    }
}
