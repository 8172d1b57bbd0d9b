//! The `effects` of a camera.

use protocol::{EffectsSpec, exposure};
use serde::{Deserialize, Serialize};

/// Effects of a camera on its colour image, as in [`EffectsSpec`].
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct EffectsEntry {
    exposure: ExposureMode,
    compensation_ev: f32,
    /// Automatic exposure.
    #[serde(skip_serializing_if = "Option::is_none")]
    ev_limits: Option<[f32; 2]>,
    /// Manual exposure.
    iso: f32,
    shutter_secs: f32,
    f_number: f32,
    vignette: f32,
    bloom: f32,
    bloom_radius: f32,
    chromatic_aberration: f32,
    white_electrons: f32,
    read_electrons: f32,
    temperature_k: f32,
    tint: f32,
    gamma: f32,
    /// Slope, toe, shoulder, black clip and white clip.
    #[serde(skip_serializing_if = "Option::is_none")]
    filmic: Option<[f32; 5]>,
    readout_secs: f32,
    blur_secs: f32,
    aperture_m: f32,
    focus_m: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
enum ExposureMode {
    #[default]
    Weather,
    Automatic,
    Manual,
}

impl EffectsEntry {
    /// Returns the effects in the protocol's layout.
    pub(super) fn spec(&self) -> EffectsSpec {
        let [slope, toe, shoulder, black_clip, white_clip] = self.filmic.unwrap_or_default();
        EffectsSpec {
            exposure: match self.exposure {
                ExposureMode::Weather => exposure::WEATHER,
                ExposureMode::Automatic => exposure::AUTOMATIC,
                ExposureMode::Manual => exposure::MANUAL,
            },
            compensation_ev: self.compensation_ev,
            ev_limits: self.ev_limits.unwrap_or_default(),
            iso: self.iso,
            shutter_secs: self.shutter_secs,
            f_number: self.f_number,
            vignette: self.vignette,
            bloom: self.bloom,
            bloom_radius: self.bloom_radius,
            chromatic_aberration: self.chromatic_aberration,
            white_electrons: self.white_electrons,
            read_electrons: self.read_electrons,
            temperature_k: self.temperature_k,
            tint: self.tint,
            gamma: self.gamma,
            slope,
            toe,
            shoulder,
            black_clip,
            white_clip,
            readout_secs: self.readout_secs,
            blur_secs: self.blur_secs,
            aperture_m: self.aperture_m,
            focus_m: self.focus_m,
            ..EffectsSpec::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_of_a_file_are_those_of_the_protocol() {
        let text = "exposure = \"automatic\"\nev_limits = [9.0, 15.5]\nbloom = 0.08\nvignette = 1.0\n\
                    white_electrons = 12000\nreadout_secs = 0.02\nfilmic = [0.9, 0.5, 0.3, 0.0, 0.04]\n";
        let spec = toml::from_str::<EffectsEntry>(text).unwrap().spec();
        let expected = EffectsSpec {
            exposure: exposure::AUTOMATIC,
            ev_limits: [9.0, 15.5],
            bloom: 0.08,
            vignette: 1.0,
            white_electrons: 12_000.0,
            readout_secs: 0.02,
            slope: 0.9,
            toe: 0.5,
            shoulder: 0.3,
            white_clip: 0.04,
            ..EffectsSpec::default()
        };
        assert_eq!(spec, expected);
        assert!(toml::from_str::<EffectsEntry>("").unwrap().spec().is_none());
    }
}
