//! What the optics, the sensor and the processing of a camera do to its colour image.

use bytemuck::{Pod, Zeroable};

use crate::range::within;

/// Values of [`EffectsSpec::exposure`].
pub mod exposure {
    /// By the weather: the same for every image of a weather.
    pub const WEATHER: u32 = 0;
    /// By the brightness of the image itself.
    pub const AUTOMATIC: u32 = 1;
    /// By sensitivity, exposure time and f-number.
    pub const MANUAL: u32 = 2;
}

/// Effects of a camera on its colour image; all 0 is none, and the image is that of every version before.
///
/// Where 0 would have no meaning, it stands for the default that the field names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EffectsSpec {
    /// One of [`exposure`].
    pub exposure: u32,
    /// Exposure compensation, stops; an image is twice as bright with each.
    pub compensation_ev: f32,
    /// Automatic exposure: smallest and largest exposure value at ISO 100. Both 0:
    /// [`EffectsSpec::EV_LIMITS`].
    pub ev_limits: [f32; 2],
    /// Manual exposure: sensitivity, ISO 12232.
    pub iso: f32,
    /// Manual exposure: exposure time.
    pub shutter_secs: f32,
    /// Manual exposure: focal length divided by the diameter of the entrance pupil.
    pub f_number: f32,
    /// Share of the natural vignetting (cos⁴ of the angle from the axis), 0 to 1.
    pub vignette: f32,
    /// Share of the light that the lens scatters around each point, 0 to 1.
    pub bloom: f32,
    /// Standard deviation of the inner part of the scattered light, as a share of the width of the image.
    /// 0: [`EffectsSpec::BLOOM_RADIUS`].
    pub bloom_radius: f32,
    /// Lateral chromatic aberration: share by which the red image is larger than the green one, and the
    /// green one larger than the blue one.
    pub chromatic_aberration: f32,
    /// Electrons in a pixel of exposed radiance 1 at ISO 100, which shot noise depends on. 0: no noise.
    pub white_electrons: f32,
    /// Standard deviation of the noise of reading a pixel. Electrons.
    pub read_electrons: f32,
    /// Correlated colour temperature of the light that is shown white, kelvin. 0: 6500 K.
    pub temperature_k: f32,
    /// Offset of that light across the line of black bodies, −1 to 1: above 0 it is more magenta, and the
    /// image greener.
    pub tint: f32,
    /// The image is encoded with the power 1 / `gamma`. 0: the curve of sRGB.
    pub gamma: f32,
    /// Slope of the filmic tone curve. 0: the tone curve of cameras without effects, and the following four
    /// are 0.
    pub slope: f32,
    /// Filmic tone curve: length of the toe.
    pub toe: f32,
    /// Filmic tone curve: length of the shoulder.
    pub shoulder: f32,
    /// Filmic tone curve: depth below black at which the toe ends.
    pub black_clip: f32,
    /// Filmic tone curve: height above white at which the shoulder ends.
    pub white_clip: f32,
    /// Rolling shutter: time from the reading of the first row to that of the last, which is the time of the
    /// frame. 0: all rows at once.
    pub readout_secs: f32,
    /// Diameter of the entrance pupil, which gives the depth of field. Metres. 0: everything is sharp.
    pub aperture_m: f32,
    /// Distance along the optical axis of what is sharp. Metres.
    pub focus_m: f32,
    /// Motion blur: time before that of the frame during which each row is exposed. 0: an instant.
    pub blur_secs: f32,
    /// Reserved; 0.
    pub reserved: [u32; 3],
}

const _: () = assert!(size_of::<EffectsSpec>() == 112);

impl EffectsSpec {
    /// Default limits of the automatic exposure, exposure values at ISO 100: street lights at night, and
    /// snow in the sun.
    pub const EV_LIMITS: [f32; 2] = [11.0, 17.0];
    /// Default radius of bloom.
    pub const BLOOM_RADIUS: f32 = 0.01;
    /// Default colour temperature. Kelvin.
    pub const TEMPERATURE_K: f32 = 6500.0;

    /// Returns whether the camera has no effect.
    pub fn is_none(&self) -> bool {
        *self == EffectsSpec::default()
    }

    /// Returns the limits of the automatic exposure.
    pub fn ev_limits(&self) -> [f32; 2] {
        if self.ev_limits == [0.0; 2] { EffectsSpec::EV_LIMITS } else { self.ev_limits }
    }

    /// Returns the exposure value at ISO 100 of a manual exposure, log2(N² / t · 100 / ISO), without
    /// compensation (ISO 2720).
    pub fn manual_ev(&self) -> f32 {
        (self.f_number * self.f_number / self.shutter_secs * 100.0 / self.iso).log2()
    }

    /// Checks the range of each number; the error names the first that is out of range.
    ///
    /// # Errors
    /// The number, its value and its range.
    pub fn check(&self) -> Result<(), String> {
        let or = |value: f32, default: f32| if value == 0.0 { default } else { value };
        match self.exposure {
            exposure::WEATHER => {}
            exposure::AUTOMATIC => {
                let [low, high] = self.ev_limits();
                within("ev_min", low, -20.0, 30.0)?;
                within("ev_max", high, low, 30.0)?;
            }
            exposure::MANUAL => {
                within("iso", self.iso, 1.0, 1e6)?;
                within("shutter_secs", self.shutter_secs, 1e-6, 60.0)?;
                within("f_number", self.f_number, 0.5, 128.0)?;
            }
            other => {
                return Err(format!(
                    "exposure is {other}, not 0 (weather), 1 (automatic) or 2 (manual)"
                ));
            }
        }
        within("compensation_ev", self.compensation_ev, -20.0, 20.0)?;
        within("vignette", self.vignette, 0.0, 1.0)?;
        within("bloom", self.bloom, 0.0, 1.0)?;
        within("bloom_radius", or(self.bloom_radius, 0.01), 0.001, 0.1)?;
        within("chromatic_aberration", self.chromatic_aberration, -0.05, 0.05)?;
        within("white_electrons", or(self.white_electrons, 1.0), 1.0, 1e7)?;
        within("read_electrons", self.read_electrons, 0.0, 1e5)?;
        if self.read_electrons > 0.0 && self.white_electrons == 0.0 {
            return Err(format!(
                "read_electrons is {}, but white_electrons is 0, which is no noise; give both",
                self.read_electrons
            ));
        }
        within("temperature_k", or(self.temperature_k, 6500.0), 1500.0, 15_000.0)?;
        within("tint", self.tint, -1.0, 1.0)?;
        within("gamma", or(self.gamma, 2.2), 0.5, 5.0)?;
        let curve = [self.toe, self.shoulder, self.black_clip, self.white_clip];
        if self.slope == 0.0 && curve != [0.0; 4] {
            return Err(
                "slope is 0, but toe, shoulder, black_clip or white_clip are not; give all five"
                    .into(),
            );
        }
        within("slope", or(self.slope, 1.0), 0.1, 5.0)?;
        // Beyond, the straight part of the curve would have no length.
        within("toe", self.toe, 0.0, 0.95)?;
        within("shoulder", self.shoulder, 0.0, 0.95)?;
        within("black_clip", self.black_clip, 0.0, 0.5)?;
        within("white_clip", self.white_clip, 0.0, 0.5)?;
        within("readout_secs", self.readout_secs, 0.0, 0.2)?;
        within("blur_secs", self.blur_secs, 0.0, 0.2)?;
        within("aperture_m", self.aperture_m, 0.0, 1.0)?;
        if self.aperture_m > 0.0 || self.focus_m != 0.0 {
            within("focus_m", self.focus_m, 0.01, 1e5)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exposure_value_is_that_of_the_sunny_16_rule() {
        let sunny =
            EffectsSpec { iso: 100.0, shutter_secs: 0.008, f_number: 16.0, ..Default::default() };
        assert!((sunny.manual_ev() - 14.966).abs() < 1e-3, "{}", sunny.manual_ev());
        let faster = EffectsSpec { iso: 200.0, ..sunny };
        assert!((sunny.manual_ev() - faster.manual_ev() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_number_out_of_range_is_named() {
        let none = EffectsSpec::default();
        assert!(none.is_none() && none.check().is_ok());
        let refused = |effects: EffectsSpec, text: &str| {
            let error = effects.check().unwrap_err();
            assert!(error.contains(text), "{error}");
        };
        refused(EffectsSpec { exposure: 3, ..none }, "exposure is 3, not 0");
        refused(EffectsSpec { exposure: exposure::MANUAL, ..none }, "iso is 0, not 1");
        let limits = [9.0, 8.0];
        let automatic = EffectsSpec { exposure: exposure::AUTOMATIC, ev_limits: limits, ..none };
        refused(automatic, "ev_max is 8, not 9 to 30");
        refused(EffectsSpec { bloom: f32::NAN, ..none }, "bloom is NaN, not 0 to 1");
        refused(EffectsSpec { read_electrons: 3.0, ..none }, "white_electrons is 0");
        refused(EffectsSpec { toe: 0.5, ..none }, "slope is 0");
        refused(EffectsSpec { gamma: 9.0, ..none }, "gamma is 9");
        refused(EffectsSpec { readout_secs: -0.1, ..none }, "readout_secs is -0.1");
        refused(EffectsSpec { aperture_m: 0.02, ..none }, "focus_m is 0, not 0.01");
    }
}
