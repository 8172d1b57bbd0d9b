//! A set of sensors from a TOML file.

use std::path::Path;

use anyhow::{Context, anyhow, ensure};
use glam::{EulerRot, Quat, Vec3};
use protocol::{Pose, SensorSpec, output};
use serde::Deserialize;

/// The file: a list of `[[sensor]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorsFile {
    sensor: Vec<Entry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
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
    #[serde(default = "default_width")]
    width_px: u32,
    #[serde(default = "default_height")]
    height_px: u32,
    #[serde(default = "default_fov")]
    fov_deg: f32,
    #[serde(default = "default_outputs")]
    outputs: Vec<String>,
    #[serde(default = "default_channels")]
    channels: u32,
    #[serde(default = "default_columns")]
    columns: u32,
    #[serde(default = "default_elevations")]
    elevations_deg: [f32; 2],
    #[serde(default = "default_range")]
    range_m: f32,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Camera,
    Lidar,
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
fn default_channels() -> u32 {
    32
}
fn default_columns() -> u32 {
    1800
}
fn default_elevations() -> [f32; 2] {
    [-30.0, 10.0]
}
fn default_range() -> f32 {
    100.0
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
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    parse(&text).with_context(|| path.display().to_string())
}

fn parse(text: &str) -> anyhow::Result<Vec<SensorSpec>> {
    let file: SensorsFile = toml::from_str(text)?;
    ensure!(!file.sensor.is_empty(), "no [[sensor]]; name at least one");
    file.sensor.iter().map(Entry::spec).collect()
}

impl Entry {
    fn spec(&self) -> anyhow::Result<SensorSpec> {
        let name = &self.name;
        let turn = Quat::from_euler(
            EulerRot::ZYX,
            self.yaw_deg.to_radians(),
            self.pitch_deg.to_radians(),
            0.0,
        );
        let position = Vec3::from_array(self.position_m);
        ensure!(
            position.is_finite() && turn.is_finite(),
            "sensor {name:?}: its pose is not finite"
        );
        let pose = Pose::new(position, turn);
        match self.kind {
            Kind::Camera => {
                for (what, pixels) in [("width_px", self.width_px), ("height_px", self.height_px)] {
                    ensure!(
                        (1..=8192).contains(&pixels),
                        "sensor {name:?}: {what} is {pixels}; use 1 to 8192"
                    );
                }
                ensure!(
                    self.fov_deg > 0.0 && self.fov_deg < 180.0,
                    "sensor {name:?}: fov_deg is {}; use more than 0 and less than 180",
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
                Ok(client_lib::wire::camera(
                    name,
                    pose,
                    self.width_px,
                    self.height_px,
                    fov_rad,
                    outputs,
                ))
            }
            Kind::Lidar => {
                ensure!(
                    (1..=512).contains(&self.channels) && (1..=65_536).contains(&self.columns),
                    "sensor {name:?}: {} channels of {} columns; use 1 to 512 of 1 to 65536",
                    self.channels,
                    self.columns
                );
                let [lower, upper] = self.elevations_deg.map(f32::to_radians);
                ensure!(
                    lower <= upper && self.range_m > 0.0 && self.range_m.is_finite(),
                    "sensor {name:?}: elevations_deg must rise and range_m be above 0"
                );
                Ok(client_lib::wire::lidar(
                    name,
                    pose,
                    self.channels,
                    self.columns,
                    [lower, upper],
                    self.range_m,
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_have_defaults_and_errors_name_the_sensor() {
        let text = "[[sensor]]\nname = \"a\"\nkind = \"camera\"\noutputs = [\"color\", \"depth\"]\n\
                    [[sensor]]\nname = \"b\"\nkind = \"lidar\"\nchannels = 64\n";
        let sensors = parse(text).unwrap();
        assert_eq!((sensors[0].width, sensors[0].outputs), (800, output::COLOR | output::DEPTH));
        assert_eq!((sensors[1].height, sensors[1].width), (64, 1800));
        for (wrong, said) in [
            ("", "sensor"),
            ("[[sensor]]\nname = \"a\"\nkind = \"sonar\"\n", "sonar"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\noutputs = [\"heat\"]\n", "heat"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\nfov_deg = 180\n", "fov_deg"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\nwidth = 4\n", "width"),
        ] {
            let why = format!("{:#}", parse(wrong).unwrap_err());
            assert!(why.contains(said), "{why}");
        }
    }
}
