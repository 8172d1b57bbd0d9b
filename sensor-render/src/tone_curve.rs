//! Tone curves of cameras with effects, as tables that every tracer reads.

use glam::Vec3;
use protocol::EffectsSpec;

/// Entries of a table: each octave of exposed radiance from 2⁻¹² to 2⁶ has 32.
pub(crate) const CURVE: usize = 18 * 32 + 1;

/// Bits of an `f32` by which an entry is farther than the one before, and the bits of the first entry.
pub(crate) const CURVE_STEP_BITS: u32 = 18;
pub(crate) const CURVE_FIRST_BITS: u32 = (127 - 12) << 23;

/// Returns the table of a camera: entry i is the value of the pixel, from 0 to 255, at the exposed radiance
/// whose bits are `CURVE_FIRST_BITS + (i << CURVE_STEP_BITS)`; between entries it is linear.
pub(crate) fn table(effects: &EffectsSpec) -> [f32; CURVE] {
    let filmic = (effects.slope > 0.0).then(|| Filmic::new(effects));
    std::array::from_fn(|entry| {
        let exposed = f32::from_bits(CURVE_FIRST_BITS + ((entry as u32) << CURVE_STEP_BITS));
        let exposed = f64::from(exposed);
        let shown = match &filmic {
            Some(filmic) => filmic.of(exposed),
            None => fit(exposed),
        };
        (encoded(shown.clamp(0.0, 1.0), f64::from(effects.gamma)) * 255.0) as f32
    })
}

/// Coefficients of the curve of cameras without effects, c₀ to c₄ in
/// x (c₀ x + c₁) / (x (c₂ x + c₃) + c₄) of the exposed radiance x: that of J. Hable, *Uncharted 2: HDR
/// Lighting*, GDC 2010, ((x (A x + C B) + D E) / (x (A x + B) + D F) − E / F) of 4 x, divided by its value
/// at x = 3.4, with a stronger toe and less of the linear part than in those slides, so that the contrast of
/// middle tones is that of cameras: the curve follows the fit of K. Narkowicz, *ACES Filmic Tone Mapping
/// Curve*, 2015, of 1.07 x, within 5 of 255.
pub(crate) const HABLE: [f64; 5] = {
    let [a, b, c, d, e, f] = [0.22, 0.20, 0.11, 0.60, 0.02, 0.30];
    let (gain, white) = (4.0, 4.0 * 3.4);
    let (square, line, foot) = (a * (1.0 - e / f), b * (c - e / f), d * f);
    let of_white = white * (square * white + line) / (white * (a * white + b) + foot);
    [square * gain * gain / of_white, line * gain / of_white, a * gain * gain, b * gain, foot]
};

/// Share of the way that the values of a pixel move towards their luma, as the channels of a sensor overlap.
/// After the curve, where a bright colour has no more weight than a dark one: before it, a lamp turned white.
pub(crate) const MUTED: f32 = 0.08;

/// Weights of luma, ITU-R BT.709.
pub(crate) const LUMA: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Returns the share of a camera with these effects: 0 with the filmic curve, which Unreal Engine does not
/// follow with any.
pub(crate) fn muted(effects: &EffectsSpec) -> f32 {
    if effects.slope > 0.0 { 0.0 } else { MUTED }
}

/// Curve of cameras without effects.
fn fit(x: f64) -> f64 {
    let [square, line, square_below, line_below, foot] = HABLE;
    x * (square * x + line) / (x * (square_below * x + line_below) + foot)
}

/// Returns display light encoded with the power 1 / `gamma`; 0: with the curve of sRGB, IEC 61966-2-1.
fn encoded(light: f64, gamma: f64) -> f64 {
    if gamma > 0.0 {
        light.powf(1.0 / gamma)
    } else if light <= 0.003_130_8 {
        light * 12.92
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// The filmic curve of Unreal Engine 4 (*Color Grading and Filmic Tonemapper*): on the scale of the
/// logarithm a straight line of the slope through middle grey, and sigmoids as toe and shoulder. Red, green
/// and blue have the curve each, without the change of colour space of the engine.
struct Filmic {
    slope: f64,
    black_clip: f64,
    white_clip: f64,
    /// Heights of the sigmoids.
    toe_scale: f64,
    shoulder_scale: f64,
    /// Logarithms at which toe and shoulder meet the line, and its offset.
    toe_at: f64,
    shoulder_at: f64,
    line_at: f64,
}

/// Radiance of middle grey, which the curve keeps.
const MIDDLE_GREY: f64 = 0.18;

impl Filmic {
    fn new(effects: &EffectsSpec) -> Filmic {
        let EffectsSpec { slope, toe, shoulder, black_clip, white_clip, .. } = *effects;
        let [slope, toe, shoulder] = [slope, toe, shoulder].map(f64::from);
        let [black_clip, white_clip] = [black_clip, white_clip].map(f64::from);
        let toe_scale = 1.0 + black_clip - toe;
        let toe_at = if toe > 0.8 {
            (1.0 - toe - MIDDLE_GREY) / slope + MIDDLE_GREY.log10()
        } else {
            let share = (MIDDLE_GREY + black_clip) / toe_scale - 1.0;
            let share = share.clamp(-0.999, 0.999);
            MIDDLE_GREY.log10() - 0.5 * ((1.0 + share) / (1.0 - share)).ln() * (toe_scale / slope)
        };
        let line_at = (1.0 - toe) / slope - toe_at;
        Filmic {
            slope,
            black_clip,
            white_clip,
            toe_scale,
            shoulder_scale: 1.0 + white_clip - shoulder,
            toe_at,
            shoulder_at: shoulder / slope - line_at,
            line_at,
        }
    }

    fn of(&self, x: f64) -> f64 {
        let log = x.max(1e-9).log10();
        let line = self.slope * (log + self.line_at);
        let sigmoid =
            |scale: f64, from: f64| 2.0 * scale / (1.0 + (-2.0 * self.slope / scale * from).exp());
        let toe = if log < self.toe_at {
            sigmoid(self.toe_scale, log - self.toe_at) - self.black_clip
        } else {
            line
        };
        let shoulder = if log > self.shoulder_at {
            1.0 + self.white_clip - sigmoid(self.shoulder_scale, self.shoulder_at - log)
        } else {
            line
        };
        let share = ((log - self.toe_at) / (self.shoulder_at - self.toe_at)).clamp(0.0, 1.0);
        let share = if self.shoulder_at < self.toe_at { 1.0 - share } else { share };
        toe + (shoulder - toe) * (share * share * (3.0 - 2.0 * share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_without_parameters_is_the_curve_of_cameras_without_effects() {
        let table = table(&EffectsSpec::default());
        assert!(table[0] < 0.5 && table[CURVE - 1] == 255.0);
        assert!(table.is_sorted());
        // 2⁻¹ is 11 octaves after the first entry.
        let shown = fit(0.5);
        let byte = (1.055 * shown.powf(1.0 / 2.4) - 0.055) * 255.0;
        assert!((f64::from(table[11 * 32]) - byte).abs() < 1e-3);
    }

    #[test]
    fn the_curve_is_that_of_hable_with_its_white_and_without_its_offset() {
        let hable = |x: f64| {
            ((x * (0.22 * x + 0.022) + 0.012) / (x * (0.22 * x + 0.2) + 0.18)) - 0.02 / 0.3
        };
        for x in [0.0, 0.002, 0.05, 0.18, 1.0, 3.4] {
            let expected = hable(4.0 * x) / hable(4.0 * 3.4);
            assert!((fit(x) - expected).abs() < 1e-9, "{x}: {} {expected}", fit(x));
        }
    }

    #[test]
    fn shadows_have_the_contrast_of_a_camera_and_sunlit_white_is_below_the_white_point() {
        // Two stops, of surfaces in the shade.
        assert!(fit(0.08) > 7.5 * fit(0.02), "{} {}", fit(0.08), fit(0.02));
        assert!((0.80..0.88).contains(&fit(1.0)), "{}", fit(1.0));
    }

    #[test]
    fn the_filmic_curve_keeps_middle_grey_and_rises() {
        let unreal = EffectsSpec {
            slope: 0.88,
            toe: 0.55,
            shoulder: 0.26,
            white_clip: 0.04,
            ..EffectsSpec::default()
        };
        let filmic = Filmic::new(&unreal);
        assert!((filmic.of(MIDDLE_GREY) - MIDDLE_GREY).abs() < 0.02, "{}", filmic.of(MIDDLE_GREY));
        assert!(table(&unreal).is_sorted());
        let steep = Filmic::new(&EffectsSpec { slope: 1.5, ..unreal });
        assert!(steep.of(0.05) < filmic.of(0.05) && steep.of(0.6) > filmic.of(0.6));
    }

    #[test]
    fn a_larger_gamma_brightens_middle_tones_only() {
        let [low, high] =
            [1.8, 2.6].map(|gamma| table(&EffectsSpec { gamma, ..Default::default() }));
        assert!(low[9 * 32] < high[9 * 32] && low[CURVE - 1] == high[CURVE - 1]);
    }
}
