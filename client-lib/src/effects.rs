//! Effects of cameras on their colour images.

use protocol::{EffectsSpec, exposure};

use crate::options::options;

/// What the brightness of a colour image follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Exposure {
    /// The weather: it is the same for every image of a weather.
    #[default]
    Weather,
    /// The image itself: a light meter reads the mean of the logarithms of its luminance.
    Automatic {
        /// Smallest exposure value at ISO 100: darker images stay dark.
        ev_min: f32,
        /// Largest exposure value at ISO 100: brighter images stay bright.
        ev_max: f32,
    },
    /// Three numbers of a camera; the exposure value at ISO 100 is log2(N² / t · 100 / ISO).
    Manual {
        /// Sensitivity, ISO 12232.
        iso: f32,
        /// Exposure time.
        shutter_secs: f32,
        /// Focal length divided by the diameter of the entrance pupil.
        f_number: f32,
    },
}

impl Exposure {
    /// Automatic exposure between street lights at night and snow in the sun.
    pub const AUTOMATIC: Exposure = Exposure::Automatic {
        ev_min: EffectsSpec::EV_LIMITS[0],
        ev_max: EffectsSpec::EV_LIMITS[1],
    };
}

/// Curve from exposed radiance to display light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum ToneCurve {
    /// That of cameras without effects: muted colours and the curve of Hable (2010).
    #[default]
    Hable,
    /// The filmic curve of Unreal Engine 4, with its parameters.
    Filmic {
        /// Slope of the straight part, by the logarithm to base 10 of the radiance.
        slope: f32,
        /// Length of the toe.
        toe: f32,
        /// Length of the shoulder.
        shoulder: f32,
        /// Depth below black at which the toe ends.
        black_clip: f32,
        /// Height above white at which the shoulder ends.
        white_clip: f32,
    },
}

options! {
    /// Effects of a camera on its colour image; none by default. Formulas and sources are in the
    /// documentation of sensors.
    pub struct CameraEffects {
        /// What the brightness follows.
        exposure: Exposure,
        /// Exposure compensation, stops; an image is twice as bright with each.
        compensation_ev: f32,
        /// Share of the natural vignetting (cos⁴ of the angle from the axis), 0 to 1.
        vignette: f32,
        /// Share of the light that the lens scatters around each point, 0 to 1.
        bloom: f32,
        /// Standard deviation of the inner part of the scattered light, as a share of the width of the
        /// image, 0.001 to 0.1.
        bloom_radius: f32,
        /// Lateral chromatic aberration: share by which the red image is larger than the green one, and the
        /// green one larger than the blue one.
        chromatic_aberration: f32,
        /// Electrons in a pixel of exposed radiance 1 at ISO 100, which shot noise depends on; `None`: no
        /// noise.
        white_electrons: Option<f32>,
        /// Standard deviation of the noise of reading a pixel, electrons.
        read_electrons: f32,
        /// Correlated colour temperature of the light that is shown white, kelvin.
        temperature_k: f32,
        /// Offset of that light across the line of black bodies, −1 to 1: above 0 it is more magenta, and the
        /// image greener.
        tint: f32,
        /// The image is encoded with the power 1 / `gamma`; `None`: with the curve of sRGB.
        gamma: Option<f32>,
        /// Curve from exposed radiance to display light.
        tone_curve: ToneCurve,
        /// Rolling shutter: time from the reading of the first row to that of the last, which is the time of
        /// the frame; 0: all rows at once. It bends every image of the camera.
        readout_secs: f32,
        /// Motion blur: time before that of the frame during which each row is exposed; 0: an instant.
        blur_secs: f32,
        /// Diameter of the entrance pupil, metres, which gives the depth of field; 0: everything is sharp.
        aperture_m: f32,
        /// Distance along the optical axis of what is sharp, metres.
        focus_m: f32,
    }
}

impl CameraEffects {
    /// No effect: the image is the one that cameras have without this.
    pub const NONE: CameraEffects = CameraEffects {
        exposure: Exposure::Weather,
        compensation_ev: 0.0,
        vignette: 0.0,
        bloom: 0.0,
        bloom_radius: EffectsSpec::BLOOM_RADIUS,
        chromatic_aberration: 0.0,
        white_electrons: None,
        read_electrons: 0.0,
        temperature_k: EffectsSpec::TEMPERATURE_K,
        tint: 0.0,
        gamma: None,
        tone_curve: ToneCurve::Hable,
        readout_secs: 0.0,
        blur_secs: 0.0,
        aperture_m: 0.0,
        focus_m: 0.0,
    };

    /// Returns the effects in the protocol's layout.
    pub(crate) fn wire(&self) -> EffectsSpec {
        if *self == CameraEffects::NONE {
            return EffectsSpec::default();
        }
        let mut wire = EffectsSpec {
            compensation_ev: self.compensation_ev,
            vignette: self.vignette,
            bloom: self.bloom,
            bloom_radius: self.bloom_radius,
            chromatic_aberration: self.chromatic_aberration,
            white_electrons: self.white_electrons.unwrap_or(0.0),
            read_electrons: self.read_electrons,
            temperature_k: self.temperature_k,
            tint: self.tint,
            gamma: self.gamma.unwrap_or(0.0),
            readout_secs: self.readout_secs,
            blur_secs: self.blur_secs,
            aperture_m: self.aperture_m,
            focus_m: self.focus_m,
            ..EffectsSpec::default()
        };
        match self.exposure {
            Exposure::Weather => {}
            Exposure::Automatic { ev_min, ev_max } => {
                (wire.exposure, wire.ev_limits) = (exposure::AUTOMATIC, [ev_min, ev_max]);
            }
            Exposure::Manual { iso, shutter_secs, f_number } => {
                wire.exposure = exposure::MANUAL;
                (wire.iso, wire.shutter_secs, wire.f_number) = (iso, shutter_secs, f_number);
            }
        }
        if let ToneCurve::Filmic { slope, toe, shoulder, black_clip, white_clip } = self.tone_curve
        {
            (wire.slope, wire.toe, wire.shoulder) = (slope, toe, shoulder);
            (wire.black_clip, wire.white_clip) = (black_clip, white_clip);
        }
        wire
    }
}

impl Default for CameraEffects {
    fn default() -> CameraEffects {
        CameraEffects::NONE
    }
}
