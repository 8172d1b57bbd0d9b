//! Lidars of makers, by the figures of their data sheets.

use std::{fmt, str::FromStr, time::Duration};

use crate::{Elevations, LidarOptions};

/// A lidar of a maker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LidarModel {
    /// Velodyne VLP-16: 16 channels from −15° to 15°, 1800 columns in a turn.
    Vlp16,
    /// Velodyne HDL-64E: 32 channels from 2° down to −8.33° in steps of a third of a degree, and 32 from
    /// −8.83° down to −24.33° in steps of half a degree; 2083 columns in a turn.
    Hdl64e,
    /// Ouster OS1-128: 128 channels from −22.5° to 22.5°, 1024 columns in a turn.
    Os1With128,
    /// Livox Mid-40: a rosette of 38.4°, drawn by two prisms; 100 000 beams a second.
    LivoxMid40,
}

/// Turns of a spinning lidar per second.
const TURNS_HZ: f32 = 10.0;

/// Channels of the HDL-64E, the highest first.
static HDL_64E_RAD: [f32; 64] = {
    let mut table = [0.0; 64];
    let mut channel = 0;
    while channel < 32 {
        table[channel] = (2.0 - channel as f32 / 3.0).to_radians();
        table[channel + 32] = (-8.83 - channel as f32 / 2.0).to_radians();
        channel += 1;
    }
    table
};

impl LidarModel {
    /// All models.
    pub const ALL: [LidarModel; 4] =
        [LidarModel::Vlp16, LidarModel::Hdl64e, LidarModel::Os1With128, LidarModel::LivoxMid40];

    /// Returns the name in files and in Python: `vlp-16`, `hdl-64e`, `os1-128` or `livox-mid-40`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            LidarModel::Vlp16 => "vlp-16",
            LidarModel::Hdl64e => "hdl-64e",
            LidarModel::Os1With128 => "os1-128",
            LidarModel::LivoxMid40 => "livox-mid-40",
        }
    }

    /// Returns the elevations of the channels, the highest first, radians; `None` if they are spaced
    /// equally, or there are none.
    #[must_use]
    pub fn elevations_rad(self) -> Option<&'static [f32]> {
        (self == LidarModel::Hdl64e).then_some(&HDL_64E_RAD)
    }

    /// Returns the parameters of a lidar of this model that measures once in `period`: with as many
    /// columns as it fires in that time, at 10 turns per second if it spins. The period is that of its
    /// [`Sensor`](crate::Sensor), or without one the time step of the world.
    pub fn options(self, period: Duration) -> LidarOptions {
        let (channels, columns_hz, between_deg, range_m, noise_m) = match self {
            LidarModel::Vlp16 => (16, 18_000.0, [-15.0, 15.0], 100.0, 0.03),
            LidarModel::Hdl64e => (64, 20_830.0, [-24.33f32, 2.0], 120.0, 0.02),
            LidarModel::Os1With128 => (128, 10_240.0, [-22.5, 22.5], 120.0, 0.015),
            // Four beams in a column, so that a tenth of a second fits into the longest row.
            LidarModel::LivoxMid40 => (4, 25_000.0, [0.0; 2], 130.0, 0.02),
        };
        let columns = (period.as_secs_f64() * columns_hz).round().clamp(1.0, 8192.0) as u32;
        let between = between_deg.map(f32::to_radians);
        let options = LidarOptions::new(channels, columns, between, range_m).noise_m(noise_m);
        match self {
            // 7294 and −4664 turns per minute.
            LidarModel::LivoxMid40 => options
                .fov_rad(38.4f32.to_radians())
                .prism_hz(Some([7294.0 / 60.0, -4664.0 / 60.0])),
            _ => options
                .elevations(self.elevations_rad().map(Elevations::from))
                .rotation_rate_hz(Some(TURNS_HZ)),
        }
    }

    /// Returns the time of a turn: the `period` with which [`LidarModel::options`] measures a whole turn.
    #[must_use]
    pub fn turn() -> Duration {
        Duration::from_secs_f32(1.0 / TURNS_HZ)
    }
}

/// Error of a name that is no [`LidarModel`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownLidarModel(String);

impl fmt::Display for UnknownLidarModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = LidarModel::ALL.map(LidarModel::name).join(", ");
        write!(f, "unknown model of a lidar {:?}; use one of {names}", self.0)
    }
}

impl std::error::Error for UnknownLidarModel {}

impl FromStr for LidarModel {
    type Err = UnknownLidarModel;

    fn from_str(name: &str) -> Result<LidarModel, UnknownLidarModel> {
        let found = LidarModel::ALL.into_iter().find(|model| model.name() == name);
        found.ok_or_else(|| UnknownLidarModel(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use protocol::SensorSpec;

    use super::*;
    use crate::{Pose, Sensor};

    #[test]
    fn models_have_the_channels_and_beams_of_their_data_sheets() {
        let spec = |model: LidarModel, period| {
            let sensor = Sensor::lidar("roof", Pose::IDENTITY, model.options(period));
            SensorSpec::from(sensor)
        };
        for (model, channels, beams_per_second) in [
            (LidarModel::Vlp16, 16, 300_000.0),
            (LidarModel::Hdl64e, 64, 1_333_000.0),
            (LidarModel::Os1With128, 128, 1_310_720.0),
            (LidarModel::LivoxMid40, 4, 100_000.0),
        ] {
            let name: Result<LidarModel, _> = model.name().parse();
            assert_eq!(name, Ok(model));
            for period in [LidarModel::turn(), Duration::from_millis(50)] {
                let spec = spec(model, period);
                assert_eq!((spec.height, spec.check_beams()), (channels, Ok(())));
                let beams = f64::from(spec.width * spec.height) / period.as_secs_f64();
                assert!((beams / beams_per_second - 1.0).abs() < 0.05, "{model:?}: {beams}");
                assert!(spec.width <= 8192);
            }
        }
        let hdl = spec(LidarModel::Hdl64e, LidarModel::turn()).lidar;
        let deg = |channel: u32| hdl.elevation_rad(channel).to_degrees();
        for (channel, due) in [(0, 2.0), (3, 1.0), (31, -8.333), (32, -8.83), (63, -24.33)] {
            assert!((deg(channel) - due).abs() < 0.003, "channel {channel}: {}", deg(channel));
        }
        let unknown = "hdl-65".parse::<LidarModel>().unwrap_err().to_string();
        let named = "unknown model of a lidar \"hdl-65\"; use one of vlp-16, hdl-64e, os1-128, livox-mid-40";
        assert_eq!(unknown, named);
    }
}
