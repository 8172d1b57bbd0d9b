use protocol::DEPTH_FAR_M;

use super::geometry::{flows, normals};
use super::overlay_raster::OverlayRaster;
use super::ray_packet::{Hits, RayPacket};
use super::shade::Shade;
use super::traversal::Stack;
use crate::light::Light;
use crate::outputs::{TILE_ROWS, Tile};
use crate::rays::Camera;
use crate::scene::Scene;
use crate::simd::{Float, Kernel, LANES, V3, Word};
use crate::surface_sample::SurfaceSample;
use crate::world::World;

/// Groups of 4 × 4 pixels in a packet of 8 × 8 pixels.
const GROUPS: usize = 4;

/// Side of a pixel at depth 1 from which on rays are traversed separately, because most boxes
/// between such rays are hit by none of them.
const COARSE: f32 = 0.0105;

const _: () = assert!(TILE_ROWS == 8);

/// Kernel that renders some rows of an image.
pub(crate) struct CameraRows<'a, 'b> {
    pub(crate) scene: &'a Scene,
    pub(crate) world: &'a World,
    pub(crate) light: &'a Light,
    pub(crate) camera: &'a Camera,
    pub(crate) tile: &'a mut Tile<'b>,
}

impl Kernel for CameraRows<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Float>(self) {
        rows::<F>(self.scene, self.world, self.light, self.camera, self.tile);
    }
}

#[inline(always)]
fn rows<F: Float>(scene: &Scene, world: &World, light: &Light, camera: &Camera, tile: &mut Tile) {
    let mut stack = Stack::new();
    let mut raster = match tile.slices.color.is_empty() {
        true => None,
        false => OverlayRaster::new(&world.overlay, camera),
    };
    let mut x = 0;
    while x < camera.width {
        let packet = packet::<F>(camera, x, tile.first);
        let hits = if camera.pixel < COARSE {
            packet.closest(scene, world, &mut stack, f32::INFINITY)
        } else {
            packet.closest_separately(scene, world, &mut stack, f32::INFINITY)
        };
        let raster = raster.as_mut();
        let raster = raster.and_then(|r| r.find_shapes(x, tile.first).then_some(&*r));
        for group in 0..GROUPS {
            let at = GroupPixels::new(camera, tile, x, group);
            if at.columns > 0 && at.rows > 0 {
                write(
                    scene, world, light, camera, &packet, &hits, group, at, raster, &mut stack,
                    tile,
                );
            }
        }
        x += 8;
    }
}

/// Returns the rays through 8 × 8 pixels from (x, y) on; some may lie outside of the image.
#[inline(always)]
fn packet<F: Float>(camera: &Camera, x: u32, y: u32) -> RayPacket<F, GROUPS> {
    let [x, y] = [x as f32 - camera.center[0], y as f32 - camera.center[1]];
    let lane_x: [f32; LANES] = std::array::from_fn(|lane| (lane % 4) as f32);
    let lane_y: [f32; LANES] = std::array::from_fn(|lane| (lane / 4) as f32);
    let (lane_x, lane_y) = (F::from_array(lane_x), F::from_array(lane_y));
    let (forward, right, down) =
        (V3::splat(camera.forward), V3::splat(camera.right), V3::splat(camera.down));
    let mut directions = [forward; GROUPS];
    for (group, direction) in directions.iter_mut().enumerate() {
        let x = lane_x + F::splat(x + (group % 2 * 4) as f32);
        let y = lane_y + F::splat(y + (group / 2 * 4) as f32);
        *direction = down.mul_add(y, right.mul_add(x, forward));
    }
    // Slightly wider than the outermost rays, to allow for rounding.
    let corner = |x: f32, y: f32| camera.forward + camera.right * x + camera.down * y;
    let (left, top, right, bottom) = (x - 0.02, y - 0.02, x + 7.02, y + 7.02);
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

/// Position of a group of 4 × 4 pixels in its tile.
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
    #[inline(always)]
    fn new(camera: &Camera, tile: &Tile, x: u32, group: usize) -> GroupPixels {
        let (right, down) = (group % 2 * 4, group / 2 * 4);
        let (x, y) = (x as usize + right, down);
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

#[expect(clippy::too_many_arguments, reason = "inlined once; a struct would name them again")]
#[inline(always)]
fn write<F: Float>(
    scene: &Scene,
    world: &World,
    light: &Light,
    camera: &Camera,
    packet: &RayPacket<F, GROUPS>,
    hits: &Hits<F, GROUPS>,
    group: usize,
    at: GroupPixels,
    raster: Option<&OverlayRaster>,
    stack: &mut Stack,
    tile: &mut Tile,
) {
    let sample = SurfaceSample::<F>::new(
        scene,
        world,
        hits.t[group],
        hits.triangle[group],
        hits.instance[group],
    );
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
        at.put(slices.normal, &normals(camera, &packet.directions[group], &sample));
    }
    if !slices.flow.is_empty() {
        let directions = &packet.directions[group];
        let flows = flows(world, camera, directions, &sample, hits.instance[group]);
        at.put(slices.flow, &flows);
    }
    if !slices.color.is_empty() {
        let direction = packet.directions[group];
        let shade = Shade { scene, world, light, camera };
        let color = shade.colors(direction, hits, group, &sample, stack);
        let mut colors = color.to_array().map(u32::to_le_bytes);
        if let Some(raster) = raster {
            raster.draw(at.x, at.y, &hits.t[group].to_array(), &mut colors);
        }
        at.put(slices.color, &colors);
    }
}
