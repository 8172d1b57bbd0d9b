use protocol::DEPTH_FAR_M;

use super::draw::Brush;
use super::geometry::{flows, normals};
use super::pencil::{Hits, Pencil};
use super::shade::Shade;
use super::walk::Stack;
use crate::simd::{Float, Kernel, LANES, V3, Word};
use crate::light::Light;
use crate::outputs::{PIECE_ROWS, Piece};
use crate::rays::Camera;
use crate::surface::Seen;
use crate::{Scene, World};

/// Groups of 4 × 4 pixels in a packet of 8 × 8.
const GROUPS: usize = 4;

/// From this side of a pixel at depth 1 on, rays travel alone: most of what lies between them is
/// met by none.
const COARSE: f32 = 0.0105;

const _: () = assert!(PIECE_ROWS == 8);

/// Rows of one image, to be rendered.
pub(crate) struct CameraRows<'a, 'b> {
    pub(crate) scene: &'a Scene,
    pub(crate) world: &'a World,
    pub(crate) light: &'a Light,
    pub(crate) camera: &'a Camera,
    pub(crate) piece: &'a mut Piece<'b>,
}

impl Kernel for CameraRows<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Float>(self) {
        rows::<F>(self.scene, self.world, self.light, self.camera, self.piece);
    }
}

#[inline(always)]
fn rows<F: Float>(scene: &Scene, world: &World, light: &Light, camera: &Camera, piece: &mut Piece) {
    let mut stack = Stack::new();
    let mut brush = match piece.sheets.color.is_empty() {
        true => None,
        false => Brush::new(&world.overlay, camera),
    };
    let mut x = 0;
    while x < camera.width {
        let pencil = packet::<F>(camera, x, piece.first);
        let hits = if camera.pixel < COARSE {
            pencil.closest(scene, world, &mut stack, f32::INFINITY)
        } else {
            pencil.closest_apart(scene, world, &mut stack, f32::INFINITY)
        };
        let brush = brush.as_mut();
        let brush = brush.and_then(|b| b.look_at(x, piece.first).then_some(&*b));
        for group in 0..GROUPS {
            let at = Place::new(camera, piece, x, group);
            if at.columns > 0 && at.rows > 0 {
                write(
                    scene, world, light, camera, &pencil, &hits, group, at, brush, &mut stack,
                    piece,
                );
            }
        }
        x += 8;
    }
}

/// The rays through 8 × 8 pixels from (x, y) on; some may lie outside of the image.
#[inline(always)]
fn packet<F: Float>(camera: &Camera, x: u32, y: u32) -> Pencil<F, GROUPS> {
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
    // A little wider than the outermost rays, so that rounding loses none.
    let corner = |x: f32, y: f32| camera.forward + camera.right * x + camera.down * y;
    let (left, top, right, bottom) = (x - 0.02, y - 0.02, x + 7.02, y + 7.02);
    Pencil {
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

/// Where a group's pixels lie in its piece.
#[derive(Clone, Copy)]
struct Place {
    /// In the image.
    x: u32,
    y: u32,
    first: usize,
    width: usize,
    columns: usize,
    rows: usize,
}

impl Place {
    #[inline(always)]
    fn new(camera: &Camera, piece: &Piece, x: u32, group: usize) -> Place {
        let (right, down) = (group % 2 * 4, group / 2 * 4);
        let (x, y) = (x as usize + right, down);
        let width = camera.width as usize;
        Place {
            x: x as u32,
            y: piece.first + y as u32,
            first: y * width + x,
            width,
            columns: width.saturating_sub(x).min(4),
            rows: (piece.count as usize).saturating_sub(y).min(4),
        }
    }

    /// Copies the lanes that are pixels.
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
    pencil: &Pencil<F, GROUPS>,
    hits: &Hits<F, GROUPS>,
    group: usize,
    at: Place,
    brush: Option<&Brush>,
    stack: &mut Stack,
    piece: &mut Piece,
) {
    let seen =
        Seen::<F>::new(scene, world, hits.t[group], hits.triangle[group], hits.instance[group]);
    let sheets = &mut piece.sheets;
    if !sheets.depth.is_empty() {
        let depth = hits.t[group].min(F::splat(DEPTH_FAR_M));
        at.put(sheets.depth, &depth.to_array());
    }
    if !sheets.tag.is_empty() {
        at.put(sheets.tag, &seen.face.to_array().map(|face| face as u8));
    }
    if !sheets.instance.is_empty() {
        at.put(sheets.instance, &seen.id.to_array());
    }
    if !sheets.normal.is_empty() {
        at.put(sheets.normal, &normals(camera, &pencil.directions[group], &seen));
    }
    if !sheets.flow.is_empty() {
        let directions = &pencil.directions[group];
        let flows = flows(world, camera, directions, &seen, hits.instance[group]);
        at.put(sheets.flow, &flows);
    }
    if !sheets.color.is_empty() {
        let direction = pencil.directions[group];
        let shade = Shade { scene, world, light, camera };
        let color = shade.colors(direction, hits, group, &seen, stack);
        let mut colors = color.to_array().map(u32::to_le_bytes);
        if let Some(brush) = brush {
            brush.paint(at.x, at.y, &hits.t[group].to_array(), &mut colors);
        }
        at.put(sheets.color, &colors);
    }
}
