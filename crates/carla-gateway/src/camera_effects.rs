//! Attributes of CARLA's cameras that change the colour image.
//!
//! An attribute with CARLA's default has no effect: such an image is that of a camera without effects. The
//! formulas are those of Unreal Engine 4, on which CARLA's server is built.

use client_lib::wire::{EffectsSpec, exposure};

use crate::{args::RpcError, wire::Description};

/// Exposure values at ISO 100 of this simulator, less those of CARLA: noon is at 15 here, by the sunny 16
/// rule, and at 11 in CARLA, the middle of the default `exposure_min_bright` and `exposure_max_bright`.
const EV_ABOVE_CARLA: f32 = 4.0;

/// Default limits of CARLA's automatic exposure.
const EV_LIMITS: [f32; 2] = [10.0, 12.0];

/// Light that Unreal's bloom adds around each point, for each unit of its intensity: the mean of the six
/// tints of its Gaussians.
const BLOOM_PER_INTENSITY: f32 = 0.1325;

/// Share by which the red image is larger than the blue one, for each unit of the intensity of Unreal's
/// chromatic aberration.
const FRINGE_PER_INTENSITY: f32 = 0.0103;

/// Frames per second that Unreal's motion blur refers to: an intensity of 1 exposes for one of them.
const BLUR_RATE_HZ: f32 = 30.0;

/// Width of the sensor that Unreal computes the depth of field with. Metres.
const SENSOR_WIDTH_M: f32 = 0.024_576;

/// Returns the effects of a colour camera.
///
/// # Errors
///
/// Returns an error if an attribute is not a number, or out of range.
pub(crate) fn effects(d: &Description) -> Result<EffectsSpec, RpcError> {
    let mut effects = EffectsSpec::default();
    if d.get("enable_postprocess_effects").is_some() && !d.flag("enable_postprocess_effects") {
        return Ok(effects);
    }
    let changed = |id: &str, default: f32| -> Result<Option<f32>, RpcError> {
        let value = d.number(id, default)?;
        Ok(Some(value).filter(|value| *value != default))
    };
    effects.compensation_ev = d.number("exposure_compensation", 0.0)?;
    let limits = [
        d.number("exposure_min_bright", EV_LIMITS[0])?,
        d.number("exposure_max_bright", EV_LIMITS[1])?,
    ];
    if d.get("exposure_mode") == Some("manual") {
        effects.exposure = exposure::MANUAL;
        effects.iso = d.number("iso", 100.0)?;
        effects.f_number = d.number("fstop", 1.4)?;
        let shutter_per_sec = positive(d, "shutter_speed", 200.0)?;
        effects.shutter_secs = 1.0 / shutter_per_sec;
        effects.compensation_ev -= EV_ABOVE_CARLA;
    } else if limits != EV_LIMITS {
        effects.exposure = exposure::AUTOMATIC;
        effects.ev_limits = limits.map(|ev| ev + EV_ABOVE_CARLA);
    }
    if let Some(intensity) = changed("bloom_intensity", 0.675)? {
        // Unreal adds the light that this simulator takes from the image.
        let added = intensity.max(0.0) * BLOOM_PER_INTENSITY;
        effects.bloom = added / (1.0 + added);
    }
    if let Some(intensity) = changed("chromatic_aberration_intensity", 0.0)? {
        effects.chromatic_aberration = intensity * FRINGE_PER_INTENSITY * 0.5;
    }
    if let Some(intensity) = changed("motion_blur_intensity", 0.45)? {
        effects.blur_secs = intensity.max(0.0) / BLUR_RATE_HZ;
    }
    if let Some(focus_cm) = changed("focal_distance", 1000.0)? {
        let half_fov_rad = d.number("fov", 90.0)?.clamp(1.0, 170.0).to_radians() * 0.5;
        let focal_length_m = SENSOR_WIDTH_M * 0.5 / half_fov_rad.tan();
        effects.aperture_m = focal_length_m / positive(d, "fstop", 1.4)?;
        effects.focus_m = focus_cm * 0.01;
    }
    effects.gamma = changed("gamma", 2.2)?.unwrap_or(0.0);
    effects.temperature_k = changed("temp", 6500.0)?.unwrap_or(0.0);
    effects.tint = d.number("tint", 0.0)?;
    let curve = [("slope", 0.88), ("toe", 0.55), ("shoulder", 0.26)];
    let clips = [("black_clip", 0.0), ("white_clip", 0.04)];
    let mut numbers = [0.0; 5];
    let mut is_changed = false;
    for (number, (id, default)) in numbers.iter_mut().zip(curve.into_iter().chain(clips)) {
        *number = d.number(id, default)?;
        is_changed |= *number != default;
    }
    if is_changed {
        positive(d, "slope", 0.88)?;
        [effects.slope, effects.toe, effects.shoulder, effects.black_clip, effects.white_clip] =
            numbers;
    }
    effects.check().map_err(|why| format!("attributes of {}: {why}", d.id))?;
    Ok(effects)
}

fn positive(d: &Description, id: &str, default: f32) -> Result<f32, RpcError> {
    let value = d.number(id, default)?;
    if value > 0.0 {
        return Ok(value);
    }
    Err(format!("attribute {id} of {} is {value}, must be greater than 0", d.id).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blueprints;

    /// The effects of a colour camera with CARLA's attributes, some of them changed.
    fn changed(changes: &[(&str, &str)]) -> Result<EffectsSpec, RpcError> {
        let mut camera = blueprints::definition("sensor.camera.rgb").unwrap().describe();
        for (id, value) in changes {
            let found = camera.attributes.iter_mut().find(|attribute| attribute.id == *id);
            found.expect("an attribute of CARLA's").value = (*value).to_owned();
        }
        effects(&camera)
    }

    #[test]
    fn a_camera_with_the_defaults_of_carla_has_no_effects() {
        assert!(changed(&[]).unwrap().is_none());
        let off = [("enable_postprocess_effects", "False"), ("tint", "0.5")];
        assert!(changed(&off).unwrap().is_none());
    }

    #[test]
    fn a_manual_exposure_at_carla_s_noon_is_that_of_noon() {
        // log2(4² · 128) = 11.
        let noon = [("exposure_mode", "manual"), ("fstop", "4"), ("shutter_speed", "128")];
        let effects = changed(&noon).unwrap();
        assert_eq!(effects.exposure, exposure::MANUAL);
        assert!((effects.manual_ev() - effects.compensation_ev - 15.0).abs() < 1e-4);
        let brighter = changed(&[noon[0], noon[1], noon[2], ("exposure_compensation", "1.5")]);
        assert_eq!(brighter.unwrap().compensation_ev, effects.compensation_ev + 1.5);
    }

    #[test]
    fn each_attribute_changes_its_own_effect() {
        let limits = changed(&[("exposure_min_bright", "6")]).unwrap();
        assert_eq!((limits.exposure, limits.ev_limits), (exposure::AUTOMATIC, [10.0, 16.0]));
        assert_eq!(changed(&[("bloom_intensity", "0.0")]).unwrap().bloom, 0.0);
        let bloom = changed(&[("bloom_intensity", "2.0")]).unwrap().bloom;
        assert!((bloom - 0.265 / 1.265).abs() < 1e-6, "{bloom}");
        let curve = changed(&[("slope", "1.1")]).unwrap();
        assert_eq!((curve.slope, curve.toe, curve.white_clip), (1.1, 0.55, 0.04));
        assert_eq!(changed(&[("gamma", "1.8")]).unwrap().gamma, 1.8);
        let balance = changed(&[("temp", "4000"), ("tint", "-0.3")]).unwrap();
        assert_eq!((balance.temperature_k, balance.tint), (4000.0, -0.3));
        let fringe = changed(&[("chromatic_aberration_intensity", "2")]).unwrap();
        assert!((fringe.chromatic_aberration - 0.0103).abs() < 1e-6);
        let blurred = changed(&[("motion_blur_intensity", "0.6")]).unwrap();
        assert!((blurred.blur_secs - 0.02).abs() < 1e-6, "{}", blurred.blur_secs);
        let near = changed(&[("focal_distance", "250"), ("fstop", "2")]).unwrap();
        assert!((near.focus_m - 2.5).abs() < 1e-6 && (near.aperture_m - 0.006_144).abs() < 1e-6);
    }

    #[test]
    fn an_attribute_out_of_range_is_named() {
        for (wrong, said) in [
            ([("exposure_mode", "manual"), ("shutter_speed", "0")], "shutter_speed"),
            ([("temp", "90"), ("gamma", "2.2")], "temperature_k is 90"),
            ([("slope", "-1"), ("gamma", "2.2")], "slope"),
        ] {
            let error = changed(&wrong).unwrap_err();
            assert!(format!("{error:?}").contains(said), "{error:?}");
        }
    }
}
