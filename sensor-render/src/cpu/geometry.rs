//! Normals and optical flow of surfaces.

use glam::Vec3;

use crate::rays::Camera;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::surface_sample::SurfaceSample;
use crate::world::World;

/// Minimum depth at which a point is projected. Metres.
const NEAR_M: f32 = 1e-3;

/// Returns the normals at sixteen pixels, in sensor space, facing the camera.
#[inline(always)]
pub(crate) fn normals<F: Float>(
    camera: &Camera,
    directions: &V3<F>,
    sample: &SurfaceSample<F>,
) -> [[f32; 3]; LANES] {
    let hit = sample.hit.bits();
    let (normals, directions) = (vectors(&sample.normal), vectors(directions));
    let (per_pixel, per_pixel_down) = (1.0 / camera.pixel, 1.0 / camera.pixel_down);
    std::array::from_fn(|lane| {
        if hit >> lane & 1 == 0 {
            return [0.0; 3];
        }
        let normal = normals[lane];
        let normal = if normal.dot(directions[lane]) > 0.0 { -normal } else { normal };
        let left = -normal.dot(camera.right) * per_pixel;
        let up = -normal.dot(camera.down) * per_pixel_down;
        [normal.dot(camera.forward), left, up]
    })
}

/// Returns the image-space motion, in pixels, of the surfaces at sixteen pixels since the previous
/// frame; 0 for pixels that are not `shown`.
#[inline(always)]
pub(crate) fn flows<F: Float>(
    world: &World,
    camera: &Camera,
    directions: &V3<F>,
    sample: &SurfaceSample<F>,
    instances: F::Word,
    shown: F::Mask,
) -> [[f32; 2]; LANES] {
    let (hit, shown) = (sample.hit.bits(), shown.bits());
    let (t, instances, directions) =
        (sample.t.to_array(), instances.to_array(), vectors(directions));
    std::array::from_fn(|lane| {
        let (direction, instance) = (directions[lane], instances[lane]);
        let is_hit = hit >> lane & 1 != 0;
        let now = camera.origin + direction * t[lane];
        let before = if is_hit { world.motions.before(instance, now) } else { None };
        if shown >> lane & 1 == 0 || camera.before.is_none() && before.is_none() {
            return [0.0; 2];
        }
        let view = camera.before.unwrap_or_else(|| camera.view());
        // The sky is at infinity: only its direction changes.
        let to = if is_hit { before.unwrap_or(now) - view.origin } else { direction };
        let now = camera.project(&camera.view(), direction, 0.0);
        match (now, camera.project(&view, to, NEAR_M)) {
            (Some((now, _)), Some((before, _))) => [now[0] - before[0], now[1] - before[1]],
            _ => [0.0; 2],
        }
    })
}

#[inline(always)]
fn vectors<F: Float>(vectors: &V3<F>) -> [Vec3; LANES] {
    let (x, y, z) = (vectors.x.to_array(), vectors.y.to_array(), vectors.z.to_array());
    std::array::from_fn(|lane| Vec3::new(x[lane], y[lane], z[lane]))
}
