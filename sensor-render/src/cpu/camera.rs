use glam::Vec3;
use protocol::DEPTH_FAR_M;

use super::geometry::{flows, normals};
use super::lens;
use super::overlay_raster::OverlayRaster;
use super::rain::in_rain;
use super::ray_packet::{Hits, RayPacket};
use super::shade::{Radiance, Shade};
use super::shortlist::Surroundings;
use super::sky::{encode, tone_map};
use super::traversal::Stack;
use crate::hit::NONE;
use crate::outputs::{TILE_ROWS, Tile};
use crate::quality::{Quality, Sample};
use crate::rays::Camera;
use crate::simd::{Float, Kernel, LANES, Mask, V3, Word};
use crate::surface_sample::SurfaceSample;
use crate::world::World;

/// Groups of 4 × 4 rays in a packet.
const GROUPS: usize = 4;

/// Distance of neighbouring rays at depth 1 from which on groups of 4 × 4 rays are traversed on their own, because
/// most boxes between such rays are hit by none of them.
const COARSE: f32 = 0.0105;

const _: () = assert!(TILE_ROWS == 8);

/// Kernel that renders some rows of an image.
pub(crate) struct CameraRows<'a, 'b> {
    pub(crate) shade: Shade<'a>,
    pub(crate) tile: &'a mut Tile<'b>,
}

impl Kernel for CameraRows<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Float>(self) {
        rows::<F>(&self.shade, self.tile);
    }
}

#[inline(always)]
fn rows<F: Float>(shade: &Shade, tile: &mut Tile) {
    let slices = &tile.slices;
    let has_color = !slices.color.is_empty() || !slices.film.is_empty();
    let is_smooth = has_color && shade.camera.quality > Quality::Low;
    let [depth, tag, instance, normal, flow] = [
        slices.depth.is_empty(),
        slices.tag.is_empty(),
        slices.instance.is_empty(),
        slices.normal.is_empty(),
        slices.flow.is_empty(),
    ];
    let is_color_alone = depth && tag && instance && normal && flow;
    if !(is_smooth && is_color_alone) {
        measure_centers::<F>(shade, has_color && !is_smooth, tile);
    }
    if is_smooth {
        render_smooth::<F>(shade, tile);
    }
}

/// Casts a ray through the centre of each pixel, in packets of 8 × 8 pixels, and writes every output
/// but the colour; with `has_color` that too.
#[inline(always)]
fn measure_centers<F: Float>(shade: &Shade, has_color: bool, tile: &mut Tile) {
    let camera = shade.camera;
    let mut stack = Stack::new();
    let mut raster =
        if has_color { OverlayRaster::new(&shade.world.overlay, camera) } else { None };
    let sample = Quality::Low.samples()[0];
    for x in (0..camera.width).step_by(8) {
        let block = packet::<F>(shade, Rays::Centers, x, tile.first);
        let hits = closest(shade, [shade.world; GROUPS], &block, camera.pixel, &mut stack);
        let raster = raster.as_mut();
        let raster = raster.and_then(|r| r.find_shapes(x, tile.first).then_some(&*r));
        for group in 0..GROUPS {
            let [right, below] = [group as u32 % 2 * 4, group as u32 / 2 * 4];
            let at = GroupPixels::new(camera, tile, x + right, below);
            if at.columns == 0 || at.rows == 0 {
                continue;
            }
            let shown = block.shown[group];
            let surface = surface_sample(shade, &hits, group, shown);
            let direction = block.packet.directions[group];
            write(shade, &direction, &hits, group, &surface, shown, at, tile);
            if has_color {
                let origin = block.origin(group);
                let radiance = shade.radiance::<F, GROUPS, false>(
                    origin, direction, &hits, group, &surface, shown, &mut stack,
                );
                let color = shade
                    .with_shadows(radiance, origin, direction, &surface, sample, None, &mut stack);
                let color = in_rain(shade.light, camera, color, origin, direction, hits.t[group]);
                let color = shown_light(shade, color, tile).or(shown, V3::splat(Vec3::ZERO));
                put_color(color, hits.t[group], raster, at, tile);
            }
        }
    }
}

/// Renders the colours with several rays per pixel: packets of 4 × 4 pixels and four of their rays.
#[inline(always)]
fn render_smooth<F: Float>(shade: &Shade, tile: &mut Tile) {
    let camera = shade.camera;
    let samples = camera.quality.samples();
    let slices = shade.world.slices_of(camera);
    let mut stack = Stack::new();
    let mut around = Surroundings::new();
    let mut raster = OverlayRaster::new(&shade.world.overlay, camera);
    for (below, x) in (0..tile.count)
        .step_by(4)
        .flat_map(|below| (0..camera.width).step_by(4).map(move |x| (below, x)))
    {
        let at = GroupPixels::new(camera, tile, x, below);
        let mut sum = V3::splat(Vec3::ZERO);
        let mut nearest = F::splat(f32::INFINITY);
        let sky = camera.quality.sky_directions();
        let chunks = samples.chunks_exact(GROUPS).zip(sky.chunks_exact(GROUPS));
        for (number, (samples, sky)) in (0..).step_by(GROUPS).zip(chunks) {
            let block = packet::<F>(shade, Rays::Samples(samples, number), x, tile.first + below);
            let worlds = match slices {
                Some(slices) => std::array::from_fn(|group| &slices[number + group]),
                None => [shade.world; GROUPS],
            };
            let hits = closest(shade, worlds, &block, camera.pixel * 0.5, &mut stack);
            let mut hit = block.shown;
            let mut points = block.packet.directions;
            for group in 0..GROUPS {
                hit[group] = hit[group] & !hits.triangle[group].eq(F::Word::splat(NONE));
                let t = hits.t[group].or(hit[group], F::splat(1.0));
                points[group] = points[group].mul_add(t, block.origin(group));
            }
            let directions = [
                std::array::from_fn(|group| shade.light.on_sun(samples[group])),
                std::array::from_fn(|group| sky[group].truncate()),
            ];
            around.begin(points, &hits.t, hit, directions, slices.is_none());
            let mut earlier = [Radiance::black(); GROUPS];
            for group in 0..GROUPS {
                let shown = block.shown[group];
                let shade = &Shade { world: worlds[group], ..*shade };
                let surface = surface_sample(shade, &hits, group, shown);
                let (origin, direction) = (block.origin(group), block.packet.directions[group]);
                // Rays of a pixel that hit the same triangle share its shading.
                let mut radiance = Radiance::black();
                let mut fresh = shown;
                // Worlds of other times have other numbers of instances.
                let alike: &[Radiance<F>] = if slices.is_some() { &[] } else { &earlier[..group] };
                for (other, own) in alike.iter().enumerate() {
                    let same = hits.triangle[group].eq(hits.triangle[other])
                        & hits.instance[group].eq(hits.instance[other])
                        & block.shown[other]
                        & fresh;
                    radiance = own.or(same, radiance);
                    fresh = fresh & !same;
                }
                if fresh.any() {
                    let own = shade.radiance::<F, GROUPS, true>(
                        origin, direction, &hits, group, &surface, fresh, &mut stack,
                    );
                    radiance = own.or(fresh, radiance);
                }
                earlier[group] = radiance;
                let of_sky = Some((sky[group].truncate(), &mut around));
                let color = shade.with_shadows(
                    radiance,
                    origin,
                    direction,
                    &surface,
                    samples[group],
                    of_sky,
                    &mut stack,
                );
                let color = in_rain(shade.light, camera, color, origin, direction, hits.t[group]);
                sum = sum + shown_light(shade, color, tile).or(shown, V3::splat(Vec3::ZERO));
                nearest = nearest.min(hits.t[group].or(shown, nearest));
            }
        }
        let color = sum * F::splat(1.0 / samples.len() as f32);
        let raster = raster.as_mut();
        let raster = raster.and_then(|r| r.find_shapes(x, tile.first).then_some(&*r));
        put_color(color, nearest, raster, at, tile);
    }
}

/// Returns the first intersections of rays that are `step` apart at depth 1. Those of a camera whose rays have
/// origins of their own are traced in these worlds, those of others in that of `shade`.
#[inline(always)]
fn closest<F: Float>(
    shade: &Shade,
    worlds: [&World; GROUPS],
    block: &Block<F>,
    step: f32,
    stack: &mut Stack,
) -> Hits<F, GROUPS> {
    let Shade { scene, world, .. } = *shade;
    if block.is_dark {
        Hits::none(f32::INFINITY)
    } else if let Some(origins) = &block.origins {
        block.packet.closest_from(origins, scene, worlds, stack, f32::INFINITY)
    } else if step < COARSE && block.is_narrow {
        block.packet.closest(scene, world, stack, f32::INFINITY)
    } else {
        block.packet.closest_separately(scene, world, stack, f32::INFINITY)
    }
}

/// Looks up what the rays of a group hit. Rays that are not `shown` hit nothing, and have no tag.
#[inline(always)]
fn surface_sample<F: Float>(
    shade: &Shade,
    hits: &Hits<F, GROUPS>,
    group: usize,
    shown: F::Mask,
) -> SurfaceSample<F> {
    let (t, none) = (hits.t[group], F::Word::splat(NONE));
    let triangle = hits.triangle[group].or(shown, none);
    let instance = hits.instance[group].or(shown, none);
    let mut sample = SurfaceSample::new(shade.scene, shade.world, t, triangle, instance);
    sample.face = sample.face.or(shown, F::Word::splat(0));
    sample
}

/// Returns what the rays of a pixel are averaged as: display light, or on a film radiance.
#[inline(always)]
fn shown_light<F: Float>(shade: &Shade, radiance: V3<F>, tile: &Tile) -> V3<F> {
    if tile.slices.film.is_empty() { tone_map(shade.light, radiance) } else { radiance }
}

/// Writes display light as colours, with the debug shapes in front of what lies at `depth`; on a film,
/// radiance and depth.
#[inline(always)]
fn put_color<F: Float>(
    color: V3<F>,
    depth: F,
    raster: Option<&OverlayRaster>,
    at: GroupPixels,
    tile: &mut Tile,
) {
    if !tile.slices.film.is_empty() {
        let (red, green, blue) = (color.x.to_array(), color.y.to_array(), color.z.to_array());
        let depth = depth.to_array();
        let lanes = std::array::from_fn(|lane| [red[lane], green[lane], blue[lane], depth[lane]]);
        at.put(tile.slices.film, &lanes);
        return;
    }
    let mut colors = encode(color).to_array().map(u32::to_le_bytes);
    if let Some(raster) = raster {
        raster.draw(at.x, at.y, &depth.to_array(), &mut colors);
    }
    at.put(tile.slices.color, &colors);
}

/// Rays of a block of pixels.
#[derive(Clone, Copy, Debug)]
enum Rays<'a> {
    /// 8 × 8 pixels, one ray through the centre of each.
    Centers,
    /// 4 × 4 pixels, four rays at these offsets from the centre of each, and the number of the first of them.
    Samples(&'a [Sample], usize),
}

/// Block of pixels that one packet of rays measures.
struct Block<F: Float> {
    packet: RayPacket<F, GROUPS>,
    /// Origins of the rays of a camera whose rays have origins of their own.
    origins: Option<[V3<F>; GROUPS]>,
    /// Rays that the lens shows.
    shown: [F::Mask; GROUPS],
    /// Whether the rays can be traversed as one beam.
    is_narrow: bool,
    /// Whether the lens shows none of them.
    is_dark: bool,
}

impl<F: Float> Block<F> {
    /// Returns the origins of the rays of a group.
    #[inline(always)]
    fn origin(&self, group: usize) -> V3<F> {
        match &self.origins {
            Some(origins) => origins[group],
            None => V3::splat(self.packet.origin),
        }
    }
}

/// Returns the rays of a block with its first pixel at (x, y); some may lie outside of the image.
#[inline(always)]
fn packet<F: Float>(shade: &Shade, rays: Rays, x: u32, y: u32) -> Block<F> {
    let camera = shade.camera;
    let mut block = packet_of_view(camera, rays, x, y);
    if !camera.effects.is_none() {
        bend(shade, rays, y, &mut block);
    }
    block
}

/// Gives the rays of a camera with a shutter the pose of their row and time, and those of a thin lens their
/// points of its disc. Twin of `bent_ray` in camera.wgsl.
#[inline(always)]
fn bend<F: Float>(shade: &Shade, rays: Rays, y: u32, block: &mut Block<F>) {
    let camera = shade.camera;
    let mut origins = [V3::splat(camera.origin); GROUPS];
    let shutter = camera.shutter(shade.world.delta_nanos);
    if let Some(shutter) = &shutter {
        let view = &shutter.to_before;
        for (group, origin) in origins.iter_mut().enumerate() {
            let (below, blur) = match rays {
                Rays::Centers => ((group / 2 * 4) as f32, 0.0),
                Rays::Samples(samples, first) => (samples[group][1], shutter.blur[first + group]),
            };
            let row = F::from_array(LANE_Y) + F::splat(y as f32 + below);
            let share = row.mul_add(F::splat(shutter.step), F::splat(shutter.first + blur));
            let direction = &mut block.packet.directions[group];
            let turned = V3::splat(view.forward) * along(direction, camera.forward)
                + V3::splat(view.right) * along(direction, camera.right)
                + V3::splat(view.down) * along(direction, camera.down);
            *direction = turned.mul_add(share, *direction);
            *origin = V3::splat(view.origin).mul_add(share, *origin);
        }
    }
    let lens = camera.thin_lens();
    if let (Some(lens), Rays::Samples(samples, _)) = (&lens, rays) {
        for (group, [_, _, across, along]) in samples.iter().enumerate() {
            let offset = lens.right * *across + lens.down * *along;
            origins[group] = origins[group] + V3::splat(offset);
            let direction = &mut block.packet.directions[group];
            *direction = *direction + V3::splat(offset * -lens.per_focus);
        }
    }
    let blurs = camera.effects.blur_secs > 0.0;
    if shutter.is_some() || lens.is_some() || blurs {
        block.origins = Some(origins);
    }
}

/// Returns how many times an axis of a camera goes into directions.
#[inline(always)]
fn along<F: Float>(direction: &V3<F>, axis: Vec3) -> F {
    direction.dot(V3::splat(axis / axis.length_squared()))
}

/// Returns the rays of a block from the position of the camera.
#[inline(always)]
fn packet_of_view<F: Float>(camera: &Camera, rays: Rays, x: u32, y: u32) -> Block<F> {
    let [x, y] = [x as f32 - camera.center[0], y as f32 - camera.center[1]];
    let (forward, right, down) =
        (V3::splat(camera.forward), V3::splat(camera.right), V3::splat(camera.down));
    let mut directions = [forward; GROUPS];
    let mut shown = [F::Mask::from_bits(!0); GROUPS];
    if let Some(lens) = &camera.lens {
        for group in 0..GROUPS {
            let (x, y) = places(rays, group, x, y);
            (directions[group], shown[group]) = lens::directions(camera, lens, x, y);
        }
        let is_dark = !shown.iter().any(|shown| shown.any());
        let lens::Bounds { corners, axis, is_narrow } =
            lens::bounds(camera, lens, &directions, &shown);
        for (direction, shown) in directions.iter_mut().zip(shown) {
            *direction = direction.or(shown, V3::splat(axis));
        }
        let packet = RayPacket { origin: camera.origin, corners, axis, directions };
        return Block { packet, origins: None, shown, is_narrow, is_dark };
    }
    for (group, direction) in directions.iter_mut().enumerate() {
        let (x, y) = places(rays, group, x, y);
        *direction = down.mul_add(y, right.mul_add(x, forward));
    }
    // Slightly wider than the outermost rays, to allow for rounding.
    let (before, behind) = match rays {
        Rays::Centers => (0.02, 7.02),
        Rays::Samples(..) => (0.52, 3.52),
    };
    let corner = |x: f32, y: f32| camera.forward + camera.right * x + camera.down * y;
    let (left, top, right, bottom) = (x - before, y - before, x + behind, y + behind);
    let packet = RayPacket {
        origin: camera.origin,
        corners: [
            corner(left, top),
            corner(right, top),
            corner(right, bottom),
            corner(left, bottom),
        ],
        axis: camera.forward,
        directions,
    };
    Block { packet, origins: None, shown, is_narrow: true, is_dark: false }
}

/// Returns columns and rows of the rays of a group, in pixels, for a block with its first pixel at (x, y).
#[inline(always)]
fn places<F: Float>(rays: Rays, group: usize, x: f32, y: f32) -> (F, F) {
    let [dx, dy] = match rays {
        Rays::Centers => [(group % 2 * 4) as f32, (group / 2 * 4) as f32],
        Rays::Samples(samples, _) => [samples[group][0], samples[group][1]],
    };
    (F::from_array(LANE_X) + F::splat(x + dx), F::from_array(LANE_Y) + F::splat(y + dy))
}

/// Column and row of each lane among 4 × 4 pixels.
#[rustfmt::skip]
const LANE_X: [f32; LANES] = [0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3.];
#[rustfmt::skip]
const LANE_Y: [f32; LANES] = [0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.];

/// Position of 4 × 4 pixels in their tile.
#[derive(Clone, Copy)]
struct GroupPixels {
    /// Pixel in the image.
    x: u32,
    y: u32,
    first: usize,
    width: usize,
    columns: usize,
    rows: usize,
}

impl GroupPixels {
    /// Returns the pixels from column `x` of the image on, `below` the first row of the tile.
    #[inline(always)]
    fn new(camera: &Camera, tile: &Tile, x: u32, below: u32) -> GroupPixels {
        let (width, right) = (camera.width as usize, x as usize);
        GroupPixels {
            x,
            y: tile.first + below,
            first: below as usize * width + right,
            width,
            columns: width.saturating_sub(right).min(4),
            rows: (tile.count as usize).saturating_sub(below as usize).min(4),
        }
    }

    /// Copies the lanes that lie within the image.
    #[inline(always)]
    fn put<T: Copy>(self, plane: &mut [T], lanes: &[T; LANES]) {
        for row in 0..self.rows {
            let begin = self.first + row * self.width;
            plane[begin..begin + self.columns].copy_from_slice(&lanes[row * 4..][..self.columns]);
        }
    }
}

/// Writes every output but the colour.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "inlined; a struct would name them again")]
fn write<F: Float>(
    shade: &Shade,
    directions: &V3<F>,
    hits: &Hits<F, GROUPS>,
    group: usize,
    sample: &SurfaceSample<F>,
    shown: F::Mask,
    at: GroupPixels,
    tile: &mut Tile,
) {
    let slices = &mut tile.slices;
    if !slices.depth.is_empty() {
        let far = F::splat(DEPTH_FAR_M);
        let depth = hits.t[group].or(shown, far).min(far);
        at.put(slices.depth, &depth.to_array());
    }
    if !slices.tag.is_empty() {
        at.put(slices.tag, &sample.face.to_array().map(|face| face as u8));
    }
    if !slices.instance.is_empty() {
        at.put(slices.instance, &sample.id.to_array());
    }
    if !slices.normal.is_empty() {
        at.put(slices.normal, &normals(shade.camera, directions, sample));
    }
    if !slices.flow.is_empty() {
        let flows =
            flows(shade.world, shade.camera, directions, sample, hits.instance[group], shown);
        at.put(slices.flow, &flows);
    }
}
