use glam::Vec3;

use super::shadow::Shadow;
use super::walk::Stack;
use crate::lanes::{Float, Mask, V3, Word};
use crate::light::Light;
use crate::surface::Seen;
use crate::{Scene, World};

/// The colours that sixteen rays see: red in bits 0 to 7, green, blue, 255.
#[expect(clippy::too_many_arguments, reason = "inlined once")]
#[inline(always)]
pub(crate) fn shade<F: Float>(
    scene: &Scene,
    world: &World,
    light: &Light,
    origin: Vec3,
    pixel: f32,
    direction: V3<F>,
    seen: &Seen<F>,
    stack: &mut Stack,
) -> F::Word {
    let _ = pixel;
    let away = F::splat(0.0).lt(seen.normal.dot(direction));
    let normal = (-seen.normal).or(away, seen.normal);
    let sun = light.sun.truncate();
    let facing = normal.dot(V3::splat(sun));
    let at = direction.mul_add(seen.t.min(F::splat(1e5)), V3::splat(origin));
    let lit = F::splat(0.0).lt(facing) & seen.hit;
    let mut open = lit;
    if lit.any() {
        let shadow =
            Shadow { direction: sun, origins: normal.mul_add(F::splat(0.01), at), active: lit };
        open = lit & !shadow.blocked(scene, world, stack);
    }
    let bright =
        facing.max(F::splat(0.0)).or(open, F::splat(0.0)) * F::splat(170.0) + F::splat(60.0);
    let grey = bright.or(seen.hit, F::splat(220.0)).to_int();
    grey | grey.shl::<8>() | grey.shl::<16>() | F::Word::splat(0xff00_0000)
}
