//! Sensors as TOML files describe them: the sets of `--sensors`, and the plans of collections.

mod effects;
mod lidar;
mod radar;
mod receiver;

use std::{path::Path, str::FromStr};

use anyhow::{Context, anyhow, ensure};
use glam::{EulerRot, Quat, Vec3};
use protocol::{EffectsSpec, LensSpec, Pose, Projection, SensorSpec, lens_model, output, quality};
use sensor_render::Quality;
use serde::{Deserialize, Serialize};

use effects::EffectsEntry;

/// The file: a list of `[[sensor]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorsFile {
    sensor: Vec<SensorEntry>,
}

/// A `[[sensor]]`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorEntry {
    name: String,
    kind: Kind,
    /// In vehicle space: x forward, y left, z up.
    #[serde(default)]
    position_m: [f32; 3],
    /// Positive to the left.
    #[serde(default)]
    yaw_deg: f32,
    /// Positive downwards.
    #[serde(default)]
    pitch_deg: f32,
    /// Positive: the left side up.
    #[serde(default)]
    roll_deg: f32,
    /// Measurements per second of simulated time. A sensor without it measures in every frame; in a plan, in
    /// one of `every`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rate_hz: Option<f64>,
    /// Of noise and dropped returns.
    #[serde(default)]
    seed: u64,
    #[serde(default = "default_width")]
    width_px: u32,
    #[serde(default = "default_height")]
    height_px: u32,
    /// From the left to the right edge of the image; without effect if `intrinsics_px` are given.
    #[serde(default = "default_fov")]
    fov_deg: f32,
    /// Focal lengths and principal point: fx, fy, cx, cy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    intrinsics_px: Option<[f32; 4]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lens: Option<LensEntry>,
    /// Rays per pixel of the colour image: low, standard or epic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    quality: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    effects: Option<EffectsEntry>,
    #[serde(default = "default_outputs")]
    outputs: Vec<String>,
    /// A lidar of a maker; the numbers below replace those of its data sheet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    channels: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    columns: Option<u32>,
    /// Of the lowest and the highest channel; or of each channel, the highest first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    elevations_deg: Option<Vec<f32>>,
    /// 100 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range_m: Option<f32>,
    /// Turns per second of the two prisms of a lidar that draws a rosette.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    prism_hz: Option<[f32; 2]>,
    /// Each column of a lidar starts where the sensor was at its time.
    #[serde(default, skip_serializing_if = "is_false")]
    sweep: bool,
    /// Full angle of the cone of a beam of a lidar.
    #[serde(default, skip_serializing_if = "is_zero")]
    divergence_mrad: f32,
    /// Fog, rain and spray attenuate pulses of a lidar and reflect them.
    #[serde(default, skip_serializing_if = "is_false")]
    weather: bool,
    /// The intensity falls as exp(-attenuation * distance).
    #[serde(default = "default_attenuation")]
    attenuation_per_m: f32,
    /// Standard deviation of the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    noise_m: Option<f32>,
    /// Fraction of the returns that are dropped, 0 to 1.
    #[serde(default)]
    dropoff: f32,
    /// Revolutions per second; 0: the whole turn at one instant in every frame.
    #[serde(default)]
    rotation_rate_hz: f32,
    #[serde(default = "default_radar_fov")]
    horizontal_fov_deg: f32,
    #[serde(default = "default_radar_fov")]
    vertical_fov_deg: f32,
    #[serde(default = "default_points_per_second")]
    points_per_second: f32,
    /// A radar whose detections are cells with powers, instead of random directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    receiver: Option<receiver::ReceiverEntry>,
}

/// The lens of a camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct LensEntry {
    model: LensModel,
    /// In OpenCV's order; those that are not given are 0.
    #[serde(default)]
    coefficients: Vec<f32>,
    /// Fisheye: largest angle between ray and optical axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_angle_deg: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
enum LensModel {
    BrownConrady,
    Fisheye,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Camera,
    Lidar,
    Radar,
}

fn default_width() -> u32 {
    800
}
fn default_height() -> u32 {
    600
}
fn default_fov() -> f32 {
    90.0
}
fn default_outputs() -> Vec<String> {
    vec!["color".to_owned()]
}
fn default_attenuation() -> f32 {
    0.004
}

fn is_false(on: &bool) -> bool {
    !on
}
fn is_zero(number: &f32) -> bool {
    *number == 0.0
}

fn default_radar_fov() -> f32 {
    30.0
}
fn default_points_per_second() -> f32 {
    1500.0
}

const OUTPUTS: [(&str, u32); 6] = [
    ("color", output::COLOR),
    ("depth", output::DEPTH),
    ("tag", output::TAG),
    ("instance", output::INSTANCE),
    ("normal", output::NORMAL),
    ("flow", output::FLOW),
];

/// Reads the sensors of a file.
pub(crate) fn sensors_of(path: &Path) -> anyhow::Result<Vec<SensorSpec>> {
    specs(&entries_of(path)?).with_context(|| path.display().to_string())
}

/// Reads the entries of a text with `[[sensor]]` alone.
pub(crate) fn parse_entries(text: &str) -> anyhow::Result<Vec<SensorEntry>> {
    Ok(toml::from_str::<SensorsFile>(text)?.sensor)
}

/// Reads the entries of a file.
pub(crate) fn entries_of(path: &Path) -> anyhow::Result<Vec<SensorEntry>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    parse_entries(&text).with_context(|| path.display().to_string())
}

/// Returns the sensors of entries.
///
/// # Errors
///
/// There is none, two have one name, or a value is out of range.
pub(crate) fn specs(entries: &[SensorEntry]) -> anyhow::Result<Vec<SensorSpec>> {
    ensure!(!entries.is_empty(), "no [[sensor]]; name at least one");
    for (index, entry) in entries.iter().enumerate() {
        ensure!(
            entries[..index].iter().all(|other| other.name != entry.name),
            "two sensors are named {:?}; give each its own name",
            entry.name
        );
    }
    entries.iter().map(SensorEntry::spec).collect()
}

impl SensorEntry {
    /// Sets the quality of a camera: `given`, or standard where it names none.
    pub(crate) fn set_quality(&mut self, given: Option<Quality>) {
        if self.kind == Kind::Camera {
            let level = || Quality::Standard.name().to_owned();
            self.quality = given
                .map(|given| given.to_string())
                .or(self.quality.take())
                .or_else(|| Some(level()));
        }
    }

    /// Scales the image of a camera to this size; other sensors stay as they are.
    pub(crate) fn resize(&mut self, width_px: Option<u32>, height_px: Option<u32>) {
        if self.kind == Kind::Camera {
            let before = [self.width_px, self.height_px];
            self.width_px = width_px.unwrap_or(self.width_px);
            self.height_px = height_px.unwrap_or(self.height_px);
            if let Some([fx, fy, cx, cy]) = &mut self.intrinsics_px {
                let across = self.width_px as f32 / before[0].max(1) as f32;
                let down = self.height_px as f32 / before[1].max(1) as f32;
                (*fx, *cx, *fy, *cy) = (*fx * across, *cx * across, *fy * down, *cy * down);
            }
        }
    }

    /// Returns the lens of a camera in the protocol's layout.
    fn lens(&self) -> anyhow::Result<LensSpec> {
        let mut lens = LensSpec::default();
        if let Some([fx, fy, cx, cy]) = self.intrinsics_px {
            (lens.focal_px, lens.center_px) = ([fx, fy], [cx, cy]);
            ensure!(
                fx > 0.0 && fy > 0.0,
                "sensor {:?}: intrinsics_px are fx, fy, cx, cy, but fx is {fx} and fy is {fy}; use more \
                 than 0",
                self.name
            );
        }
        let Some(LensEntry { model, coefficients, max_angle_deg }) = &self.lens else {
            return Ok(lens);
        };
        let most = match model {
            LensModel::BrownConrady => 5,
            LensModel::Fisheye => 4,
        };
        ensure!(
            coefficients.len() <= most,
            "sensor {:?}: its lens has {} coefficients; this model has at most {most}",
            self.name,
            coefficients.len()
        );
        lens.coefficients[..coefficients.len()].copy_from_slice(coefficients);
        lens.model = match model {
            LensModel::BrownConrady => lens_model::BROWN_CONRADY,
            LensModel::Fisheye => lens_model::FISHEYE,
        };
        lens.max_angle_rad = max_angle_deg.unwrap_or(0.0).to_radians();
        Ok(lens)
    }

    fn spec(&self) -> anyhow::Result<SensorSpec> {
        let name = &self.name;
        let is_folder = !name.is_empty()
            && name.len() <= 32
            && name.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-".contains(&b));
        ensure!(
            is_folder,
            "sensor {name:?}: a name has 1 to 32 letters, digits, _ and -; it names a folder of files"
        );
        let turn = Quat::from_euler(
            EulerRot::ZYX,
            self.yaw_deg.to_radians(),
            self.pitch_deg.to_radians(),
            self.roll_deg.to_radians(),
        );
        let position = Vec3::from_array(self.position_m);
        ensure!(
            position.is_finite() && turn.is_finite(),
            "sensor {name:?}: its pose is not finite"
        );
        let pose = Pose::new(position, turn);
        if let Some(rate_hz) = self.rate_hz {
            ensure!(
                (0.001..=1000.0).contains(&rate_hz),
                "sensor {name:?}: rate_hz is {rate_hz}; use 0.001 to 1000"
            );
        }
        let period_nanos = self.rate_hz.map_or(0, |rate_hz| (1e9 / rate_hz).round() as u64);
        let spec = match self.kind {
            Kind::Camera => {
                for (what, pixels) in [("width_px", self.width_px), ("height_px", self.height_px)] {
                    ensure!(
                        (1..=8192).contains(&pixels),
                        "sensor {name:?}: {what} is {pixels}; use 1 to 8192"
                    );
                }
                let is_fisheye =
                    self.lens.as_ref().is_some_and(|lens| lens.model == LensModel::Fisheye);
                let most = if is_fisheye { 360.0 } else { 180.0 };
                ensure!(
                    self.fov_deg > 0.0 && self.fov_deg < most,
                    "sensor {name:?}: fov_deg is {}; use more than 0 and less than {most}",
                    self.fov_deg
                );
                let bit = |wanted: &String| {
                    let known = OUTPUTS.iter().find(|(name, _)| name == wanted);
                    known.map(|(_, bit)| *bit).ok_or_else(|| {
                        let all = OUTPUTS.map(|(name, _)| name).join(", ");
                        anyhow!("sensor {name:?}: unknown output {wanted:?}; use {all}")
                    })
                };
                let outputs: u32 = self
                    .outputs
                    .iter()
                    .map(bit)
                    .try_fold(0, |sum, bit| bit.map(|bit| sum | bit))?;
                ensure!(outputs != 0, "sensor {name:?}: no outputs");
                let fov_rad = self.fov_deg.to_radians();
                let quality = match self.quality.as_deref().map(Quality::from_str) {
                    Some(level) => level.map_err(|why| anyhow!("sensor {name:?}: {why}"))?.code(),
                    None => quality::DEFAULT,
                };
                let [width, height] = [self.width_px, self.height_px];
                let spec = client_lib::wire::camera(name, pose, width, height, fov_rad, outputs);
                let effects =
                    self.effects.as_ref().map_or_else(EffectsSpec::default, EffectsEntry::spec);
                let spec = SensorSpec { quality, lens: self.lens()?, effects, ..spec };
                Projection::check(&spec)
                    .and_then(|()| effects.check())
                    .map_err(|why| anyhow!("sensor {name:?}: {why}"))?;
                spec
            }
            Kind::Lidar => self.lidar(pose)?,
            Kind::Radar => self.radar_grid(pose)?,
        };
        Ok(SensorSpec { period_nanos, ..spec })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_have_defaults_and_errors_name_the_sensor() {
        let text = "[[sensor]]\nname = \"a\"\nkind = \"camera\"\noutputs = [\"color\", \"depth\"]\n\
                    [[sensor]]\nname = \"b\"\nkind = \"lidar\"\nchannels = 64\n";
        let parse = |text: &str| parse_entries(text).and_then(|entries| specs(&entries));
        let sensors = parse(text).unwrap();
        assert_eq!((sensors[0].width, sensors[0].outputs), (800, output::COLOR | output::DEPTH));
        assert_eq!((sensors[1].height, sensors[1].width), (64, 1800));
        for (wrong, said) in [
            ("", "sensor"),
            ("[[sensor]]\nname = \"a\"\nkind = \"sonar\"\n", "sonar"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\noutputs = [\"heat\"]\n", "heat"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\nfov_deg = 180\n", "fov_deg"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\nwidth = 4\n", "width"),
            (
                "[[sensor]]\nname = \"a\"\nkind = \"camera\"\nlens = { model = \"fisheye\", \
                 coefficients = [1, 2, 3, 4, 5] }\n",
                "sensor \"a\": its lens has 5 coefficients; this model has at most 4",
            ),
            (
                "[[sensor]]\nname = \"a\"\nkind = \"camera\"\nlens = { model = \"brown-conrady\", \
                 coefficients = [-2.0] }\n",
                "sensor \"a\": its polynomial falls from",
            ),
            (
                "[[sensor]]\nname = \"a\"\nkind = \"camera\"\neffects = { exposure = \"manual\" }\n",
                "sensor \"a\": iso is 0, not 1 to 1000000",
            ),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\neffects = { glow = 1.0 }\n", "glow"),
            (
                "[[sensor]]\nname = \"a\"\nkind = \"camera\"\nquality = \"high\"\n",
                "sensor \"a\": quality is \"high\"; use low, standard or epic",
            ),
        ] {
            let why = format!("{:#}", parse(wrong).unwrap_err());
            assert!(why.contains(said), "{why}");
        }
    }

    #[test]
    fn a_calibrated_lens_is_scaled_with_the_image() {
        let text = "[[sensor]]\nname = \"a\"\nkind = \"camera\"\nwidth_px = 640\nheight_px = 480\n\
                    intrinsics_px = [300.0, 310.0, 322.5, 238.0]\n\
                    lens = { model = \"brown-conrady\", coefficients = [-0.2, 0.05, 0.001, 0.002] }\n";
        let mut entries = parse_entries(text).unwrap();
        let lens = specs(&entries).unwrap()[0].lens;
        assert_eq!((lens.focal_px, lens.center_px), ([300.0, 310.0], [322.5, 238.0]));
        assert_eq!(lens.coefficients, [-0.2, 0.05, 0.001, 0.002, 0.0]);
        entries[0].resize(Some(320), Some(240));
        let lens = specs(&entries).unwrap()[0].lens;
        assert_eq!((lens.focal_px, lens.center_px), ([150.0, 155.0], [161.25, 119.0]));
    }
}
