use glam::Vec3;
use protocol::DEPTH_FAR_M;

use super::geometry::{flows, normals};
use super::overlay_raster::OverlayRaster;
use super::ray_packet::{Hits, RayPacket};
use super::shade::{Radiance, Shade};
use super::sky::{encode, tone_map};
use super::traversal::Stack;
use crate::outputs::{TILE_ROWS, Tile};
use crate::quality::Sample;
use crate::rays::Camera;
use crate::simd::{Float, Kernel, LANES, Mask, V3, Word};
use crate::surface_sample::SurfaceSample;

/// Groups of 4 × 4 rays in a packet.
const GROUPS: usize = 4;

/// Distance of neighbouring rays at depth 1 from which on rays are traversed separately, because most
/// boxes between such rays are hit by none of them.
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

/// Block of pixels that one packet of rays measures.
#[derive(Clone, Copy, Debug)]
enum Block<'a> {
    /// 8 × 8 pixels, one ray through the centre of each.
    Centers,
    /// 4 × 4 pixels, each group of rays at one offset from their centres; for the colour image.
    Samples(&'a [Sample]),
}

#[inline(always)]
fn rows<F: Float>(shade: &Shade, tile: &mut Tile) {
    let camera = shade.camera;
    let mut stack = Stack::new();
    let mut raster = match tile.slices.color.is_empty() {
        true => None,
        false => OverlayRaster::new(&shade.world.overlay, camera),
    };
    let samples = camera.quality.samples();
    let is_smooth = samples.len() > 1 && !tile.slices.color.is_empty();
    let has_others = {
        let s = &tile.slices;
        let empty = s.depth.is_empty() && s.tag.is_empty() && s.instance.is_empty();
        !(empty && s.normal.is_empty() && s.flow.is_empty())
    };
    for is_centers in [true, false] {
        if (is_centers && is_smooth && !has_others) || (!is_centers && !is_smooth) {
            continue;
        }
        let side = if is_centers { 8 } else { 4 };
        for down in (0..tile.count).step_by(side) {
            for x in (0..camera.width).step_by(side) {
                let mut sum = V3::splat(Vec3::ZERO);
                let mut depth = F::splat(f32::INFINITY);
                for pass in 0..if is_centers { 1 } else { samples.len() / GROUPS } {
                    let block = match is_centers {
                        true => Block::Centers,
                        false => Block::Samples(&samples[pass * GROUPS..][..GROUPS]),
                    };
                    let y = tile.first + down;
                    let packet = packet::<F>(camera, block, x, y);
                    let step = camera.pixel * if is_centers { 1.0 } else { 0.5 };
                    let hits = if step < COARSE {
                        packet.closest(shade.scene, shade.world, &mut stack, f32::INFINITY)
                    } else {
                        packet.closest_separately(
                            shade.scene,
                            shade.world,
                            &mut stack,
                            f32::INFINITY,
                        )
                    };
                    let mut earlier = [Radiance::black(); GROUPS];
                    for group in 0..GROUPS {
                        let at = GroupPixels::new(camera, tile, block, x, down, group);
                        if at.columns == 0 || at.rows == 0 {
                            continue;
                        }
                        let sample = SurfaceSample::<F>::new(
                            shade.scene,
                            shade.world,
                            hits.t[group],
                            hits.triangle[group],
                            hits.instance[group],
                        );
                        if is_centers {
                            write(
                                shade,
                                &packet.directions[group],
                                &hits,
                                group,
                                &sample,
                                at,
                                tile,
                            );
                        }
                        if is_centers && (is_smooth || tile.slices.color.is_empty()) {
                            continue;
                        }
                        // Rays of a pixel that hit the same triangle share its shading.
                        let mut shared = Radiance::black();
                        let mut fresh = F::Mask::from_bits(!0);
                        let before = if is_centers { 0 } else { group };
                        for (other, own) in earlier[..before].iter().enumerate() {
                            let same = hits.triangle[group].eq(hits.triangle[other])
                                & hits.instance[group].eq(hits.instance[other])
                                & fresh;
                            shared = own.or(same, shared);
                            fresh = fresh & !same;
                        }
                        let direction = packet.directions[group];
                        if fresh.any() {
                            let own = shade.radiance(direction, &hits, group, &sample, fresh);
                            shared = own.or(fresh, shared);
                        }
                        earlier[group] = shared;
                        let of_pixel =
                            if is_centers { samples[0] } else { samples[pass * GROUPS + group] };
                        let color =
                            shade.with_shadows(shared, direction, &sample, of_pixel, &mut stack);
                        let film = tone_map(shade.light, color);
                        if is_centers {
                            (sum, depth) = (film, hits.t[group]);
                        } else {
                            sum = sum + film;
                            depth = if pass == 0 && group == 0 { hits.t[group] } else { depth };
                            if pass + 1 < samples.len() / GROUPS || group + 1 < GROUPS {
                                continue;
                            }
                            sum = sum * F::splat(1.0 / samples.len() as f32);
                        }
                        let mut colors = encode(sum).to_array().map(u32::to_le_bytes);
                        if let Some(raster) = &mut raster
                            && raster.find_shapes(at.x, tile.first)
                        {
                            raster.draw(at.x, at.y, &depth.to_array(), &mut colors);
                        }
                        at.put(tile.slices.color, &colors);
                    }
                }
            }
        }
    }
}

/// Returns the rays of a block with its first pixel at (x, y); some may lie outside of the image.
#[inline(always)]
fn packet<F: Float>(camera: &Camera, block: Block, x: u32, y: u32) -> RayPacket<F, GROUPS> {
    let [x, y] = [x as f32 - camera.center[0], y as f32 - camera.center[1]];
    let lane_x: [f32; LANES] = std::array::from_fn(|lane| (lane % 4) as f32);
    let lane_y: [f32; LANES] = std::array::from_fn(|lane| (lane / 4) as f32);
    let (lane_x, lane_y) = (F::from_array(lane_x), F::from_array(lane_y));
    let (forward, right, down) =
        (V3::splat(camera.forward), V3::splat(camera.right), V3::splat(camera.down));
    let mut directions = [forward; GROUPS];
    for (group, direction) in directions.iter_mut().enumerate() {
        let [dx, dy] = match block {
            Block::Centers => [(group % 2 * 4) as f32, (group / 2 * 4) as f32],
            Block::Samples(samples) => [samples[group][0], samples[group][1]],
        };
        let (x, y) = (lane_x + F::splat(x + dx), lane_y + F::splat(y + dy));
        *direction = down.mul_add(y, right.mul_add(x, forward));
    }
    // Slightly wider than the outermost rays, to allow for rounding.
    let (before, behind) = match block {
        Block::Centers => (0.02, 7.02),
        Block::Samples(_) => (0.52, 3.52),
    };
    let corner = |x: f32, y: f32| camera.forward + camera.right * x + camera.down * y;
    let (left, top, right, bottom) = (x - before, y - before, x + behind, y + behind);
    RayPacket {
        origin: camera.origin,
        corners: [
            corner(left, top),
            corner(right, top),
            corner(right, bottom),
            corner(left, bottom),
        ],
        axis: camera.forward,
        directions,
    }
}

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
    /// Returns the pixels of a group of rays of the block at column `x` of the image, `down` rows
    /// below the begin of the tile.
    #[inline(always)]
    fn new(
        camera: &Camera,
        tile: &Tile,
        block: Block,
        x: u32,
        down: u32,
        group: usize,
    ) -> GroupPixels {
        let (right, below) = match block {
            Block::Centers => (group % 2 * 4, group / 2 * 4),
            Block::Samples(_) => (0, 0),
        };
        let (x, y) = (x as usize + right, down as usize + below);
        let width = camera.width as usize;
        GroupPixels {
            x: x as u32,
            y: tile.first + y as u32,
            first: y * width + x,
            width,
            columns: width.saturating_sub(x).min(4),
            rows: (tile.count as usize).saturating_sub(y).min(4),
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
fn write<F: Float>(
    shade: &Shade,
    directions: &V3<F>,
    hits: &Hits<F, GROUPS>,
    group: usize,
    sample: &SurfaceSample<F>,
    at: GroupPixels,
    tile: &mut Tile,
) {
    let slices = &mut tile.slices;
    if !slices.depth.is_empty() {
        let depth = hits.t[group].min(F::splat(DEPTH_FAR_M));
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
        let flows = flows(shade.world, shade.camera, directions, sample, hits.instance[group]);
        at.put(slices.flow, &flows);
    }
}
