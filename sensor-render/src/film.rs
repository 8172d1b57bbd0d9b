//! The film of a camera with effects: the radiance of each pixel before it becomes a colour.
//!
//! Such a camera is measured in two steps. First its rays fill the film with linear radiance. Then the film
//! is developed: the meter reads it, the lens scatters light (bloom), and each pixel is exposed, gets its
//! noise, and goes through the tone curve. The meter and bloom work on cells of the image, at most
//! [`CELLS`] across and down, so that they do not depend on the number of pixels.

use bytemuck::{Pod, Zeroable};
use protocol::{EffectsSpec, exposure};

use crate::light::Light;
use crate::rays::{Camera, View};
use crate::time_slices::RAYS_MAX;
use crate::tone_curve::{CURVE, muted, table};
use crate::white_balance;

/// Most cells along the longer side of an image.
pub(crate) const CELLS: u32 = 160;

/// Cells of the first level along the side of a cell of the second, which the outer part of bloom is
/// computed on.
pub(crate) const COARSER: u32 = 4;

/// Standard deviation of the outer part of bloom as a multiple of that of the inner part, and the share of
/// the scattered light in it. Two Gaussians are a rough fit of the steep core and the long tail of the glare
/// of a lens: G. Spencer, P. Shirley, K. Zimmerman and D. Greenberg, *Physically-Based Glare Effects for
/// Digital Images*, SIGGRAPH 1995.
pub(crate) const OUTER_RADIUS: f32 = 5.0;
pub(crate) const OUTER_SHARE: f32 = 0.4;

/// Luminance of a radiance of 1, the sunlit white surface of [`Light`]. cd/m².
const LUMINANCE: f32 = 25_000.0;

/// Luminance that saturates a sensor at an exposure value of 0 and ISO 100, by ISO 12232, with a lens that
/// transmits 65 % of the light: S. Lagarde and C. de Rousiers, *Moving Frostbite to Physically Based
/// Rendering*, 2014, section 5.1.2. cd/m².
const SATURATION: f32 = 1.2;

/// Mean luminance for which a light meter reads an exposure value of 0 at ISO 100, by ISO 2720. cd/m².
const METER: f32 = 0.125;

/// Bins of the meter: a quarter of a stop each, from the logarithm to base 2 of a radiance [`BIN_FIRST`] on.
pub(crate) const BINS: usize = 96;
pub(crate) const BINS_PER_STOP: f32 = 4.0;
pub(crate) const BIN_FIRST: f32 = -16.0;

/// Shares of the darkest and of the brightest cells that the meter leaves out.
pub(crate) const METER_SHARES: [f32; 2] = [0.1, 0.9];

/// Returns the factor from radiance to exposed radiance at an exposure value.
fn exposure_of(ev: f32) -> f32 {
    LUMINANCE / (SATURATION * ev.exp2())
}

/// Way through fog along which its droplets scatter light of a point to around its image: diffraction at droplets of
/// 10 micrometres, half of what they scatter, turns light by about 3 degrees, as far as bloom reaches (H. C. van de
/// Hulst, *Light Scattering by Small Particles*, 1957). Half of the distance to the traffic ahead. Metres.
const FOG_GLOW_M: f32 = 10.0;

/// Returns the share of light that arrives around the image of its point, scattered by the lens or by fog; 0
/// without bloom.
fn scattered(bloom: f32, light: &Light) -> f32 {
    if bloom > 0.0 { 1.0 - (1.0 - bloom) * (-light.air.x * FOG_GLOW_M).exp() } else { 0.0 }
}

/// How the film of one camera is developed in one frame. The shaders read the same words.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Development {
    /// Factor from radiance to exposed radiance; 0: the meter's.
    pub(crate) exposure: f32,
    /// Automatic exposure: limits of the factor, and the factor from 1 / mean radiance.
    pub(crate) exposure_min: f32,
    pub(crate) exposure_max: f32,
    pub(crate) key: f32,
    /// Principal point in pixels from the centre of pixel (0, 0), and sides of a pixel at depth 1.
    pub(crate) center: [f32; 2],
    pub(crate) pixel: [f32; 2],
    pub(crate) vignette: f32,
    pub(crate) chromatic_aberration: f32,
    pub(crate) bloom: f32,
    /// Standard deviation of the inner part of bloom. Cells.
    pub(crate) bloom_radius: f32,
    /// Variance of the noise of exposed radiance v: v · `shot` + `read`.
    pub(crate) shot: f32,
    pub(crate) read: f32,
    /// Seed of the noise of this frame.
    pub(crate) seed: u32,
    /// Side of a cell. Pixels.
    pub(crate) side: u32,
    /// Columns and rows of cells of both levels.
    pub(crate) grid: [u32; 2],
    pub(crate) coarse: [u32; 2],
    /// Rows of the matrix of the white balance; the fourth number is 0.
    pub(crate) balance: [[f32; 4]; 3],
    /// The tone curve; see [`crate::tone_curve::table`].
    pub(crate) curve: [f32; CURVE],
    /// Share of the way that values of a pixel move towards their luma.
    pub(crate) muted: f32,
    pub(crate) reserved: [f32; 2],
    /// Shutter: differences of the previous view from this one, position and axes; w of the first two:
    /// the share of the way there in row 0, and what each further row adds.
    pub(crate) to_before: [[f32; 4]; 4],
    /// What each ray of a pixel adds to that share.
    pub(crate) blur: [f32; RAYS_MAX],
    /// Thin lens: radii of its disc in world space; w of the first: 1 / distance in focus.
    pub(crate) thin_lens: [[f32; 4]; 2],
    /// 1: the view depends on row and ray.
    pub(crate) has_shutter: u32,
    /// Roots of the top levels that each ray of a pixel is traced in, if `has_roots` is 1.
    pub(crate) has_roots: u32,
    pub(crate) reserved2: [u32; 2],
    pub(crate) roots: [u32; RAYS_MAX],
}

const _: () = assert!(size_of::<Development>().is_multiple_of(16));

impl Development {
    /// Returns how the film of a camera is developed; `None` if it has no effects. `delta_nanos` is the time
    /// since the previous frame.
    pub(crate) fn new(camera: &Camera, light: &Light, delta_nanos: u64) -> Option<Development> {
        let effects = &camera.effects;
        if effects.is_none() {
            return None;
        }
        let brighter = effects.compensation_ev.exp2();
        let shutter = camera.shutter(delta_nanos);
        let [ev_min, ev_max] = effects.ev_limits();
        let exposure = match effects.exposure {
            exposure::AUTOMATIC => 0.0,
            exposure::MANUAL => exposure_of(effects.manual_ev()) * brighter,
            _ => light.air.z * brighter,
        };
        let or = |given: f32, default: f32| if given > 0.0 { given } else { default };
        let iso = if effects.exposure == exposure::MANUAL { effects.iso } else { 100.0 };
        let per_electron =
            if effects.white_electrons > 0.0 { iso / 100.0 / effects.white_electrons } else { 0.0 };
        let side = camera.width.max(camera.height).div_ceil(CELLS);
        let grid = [camera.width, camera.height].map(|pixels| pixels.div_ceil(side));
        let width = or(effects.bloom_radius, EffectsSpec::BLOOM_RADIUS) * camera.width as f32;
        let temperature_k = or(effects.temperature_k, EffectsSpec::TEMPERATURE_K);
        let balance = white_balance::matrix(temperature_k, effects.tint);
        let balance = balance.transpose();
        Some(Development {
            exposure,
            exposure_min: exposure_of(ev_max) * brighter,
            exposure_max: exposure_of(ev_min) * brighter,
            key: METER / SATURATION * brighter,
            center: camera.center,
            pixel: [camera.pixel, camera.pixel_down],
            vignette: effects.vignette,
            chromatic_aberration: effects.chromatic_aberration,
            bloom: scattered(effects.bloom, light),
            bloom_radius: width / side as f32,
            shot: per_electron,
            read: (per_electron * effects.read_electrons).powi(2),
            seed: camera.seed,
            side,
            grid,
            coarse: grid.map(|cells| cells.div_ceil(COARSER)),
            balance: [balance.x_axis, balance.y_axis, balance.z_axis]
                .map(|row| row.extend(0.0).to_array()),
            curve: table(effects),
            muted: muted(effects),
            reserved: [0.0; 2],
            to_before: shutter.map_or([[0.0; 4]; 4], |shutter| {
                let View { origin, forward, right, down } = shutter.to_before;
                [(origin, shutter.first), (forward, shutter.step), (right, 0.0), (down, 0.0)]
                    .map(|(vector, w)| vector.extend(w).to_array())
            }),
            blur: shutter.map_or([0.0; RAYS_MAX], |shutter| shutter.blur),
            has_shutter: u32::from(shutter.is_some()),
            has_roots: 0,
            reserved2: [0; 2],
            roots: [0; RAYS_MAX],
            thin_lens: camera.thin_lens().map_or([[0.0; 4]; 2], |lens| {
                [(lens.right, lens.per_focus), (lens.down, 0.0)]
                    .map(|(vector, w)| vector.extend(w).to_array())
            }),
        })
    }

    /// Returns the numbers of cells of both levels.
    pub(crate) fn cells(&self) -> [usize; 2] {
        [self.grid, self.coarse].map(|[columns, rows]| columns as usize * rows as usize)
    }

    /// Returns the number of vectors of a film: its pixels, the exposure, the cells of both levels, and as
    /// many to blur them.
    pub(crate) fn film_len(&self, camera: &Camera) -> u64 {
        let cells: usize = self.cells().iter().sum();
        u64::from(camera.width) * u64::from(camera.height) + 1 + cells as u64 * 2
    }
}

#[cfg(test)]
mod tests {
    use protocol::Weather;

    use super::*;

    #[test]
    fn fog_scatters_light_around_lamps_where_a_camera_has_bloom() {
        let of = |fog_density: f32, bloom: f32| {
            scattered(bloom, &Light::new(&Weather { fog_density, ..Weather::default() }, 0))
        };
        let (clear, fog) = (of(0.0, 0.02), of(60.0, 0.02));
        assert!((clear - 0.02).abs() < 0.004 && fog > 0.1 && fog < 0.3, "{clear} {fog}");
        assert_eq!(of(60.0, 0.0), 0.0);
    }
}
