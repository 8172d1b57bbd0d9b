//! Lidars of a file: by a model of a maker, or by their numbers.

use std::time::Duration;

use anyhow::{anyhow, ensure};
use client_lib::{Elevations, LidarModel, LidarOptions, Sensor};
use protocol::{Pose, SensorSpec};

use super::SensorEntry;

/// Time between two measurements of a lidar with prisms that states no rate.
const FRAME: Duration = Duration::from_millis(50);

impl SensorEntry {
    /// Returns the parameters of the model, or those of a lidar without one.
    fn of_model(&self) -> anyhow::Result<LidarOptions> {
        let name = &self.name;
        let Some(model) = &self.model else {
            let between = [-30f32, 10.0].map(f32::to_radians);
            return Ok(LidarOptions::new(32, 1800, between, 100.0));
        };
        let model: LidarModel = model.parse().map_err(|why| anyhow!("sensor {name:?}: {why}"))?;
        let period = self.rate_hz.map(|rate_hz| Duration::from_secs_f64(1.0 / rate_hz));
        let turn = model.options(LidarModel::turn());
        if turn.prism_hz.is_some() {
            return Ok(model.options(period.unwrap_or(FRAME)));
        }
        if self.rotation_rate_hz == 0.0 || self.columns.is_some() {
            return Ok(turn);
        }
        let Some(period) = period else {
            return Err(anyhow!(
                "sensor {name:?}: with rotation_rate_hz a measurement is a part of a turn; give rate_hz or \
                 columns"
            ));
        };
        let turns = f64::from(self.rotation_rate_hz) * period.as_secs_f64();
        Ok(turn.columns((f64::from(turn.columns) * turns).round().max(1.0) as u32))
    }

    /// Returns a lidar in the protocol's layout.
    pub(super) fn lidar(&self, pose: Pose) -> anyhow::Result<SensorSpec> {
        let name = &self.name;
        let mut options = self.of_model()?;
        let is_table = self.elevations_deg.as_ref().is_some_and(|all| all.len() > 2);
        match self.elevations_deg.as_deref() {
            None => {}
            Some([lower, upper]) => {
                ensure!(lower <= upper, "sensor {name:?}: elevations_deg must rise");
                let [lower, upper] = [lower, upper].map(|deg| deg.to_radians());
                options = options.lower_rad(lower).upper_rad(upper).elevations(None);
            }
            Some(all) => {
                ensure!(
                    is_table,
                    "sensor {name:?}: elevations_deg has {} numbers; use the lowest and the highest, or one \
                     for each channel",
                    all.len()
                );
                let all: Vec<f32> = all.iter().map(|deg| deg.to_radians()).collect();
                options = options.elevations(Some(Elevations::from(&all[..])));
            }
        }
        if let (Some(channels), Some(table)) = (self.channels, &options.elevations) {
            ensure!(
                table.count() == channels as usize,
                "sensor {name:?}: {channels} channels, but {} elevations",
                table.count()
            );
        }
        options.channels = self.channels.unwrap_or(options.channels);
        options.columns = self.columns.unwrap_or(options.columns);
        options.range_m = self.range_m.unwrap_or(options.range_m);
        options.noise_m = self.noise_m.unwrap_or(options.noise_m);
        options.prism_hz = self.prism_hz.or(options.prism_hz);
        options = options
            .rotation_rate_hz(Some(self.rotation_rate_hz).filter(|hz| *hz != 0.0))
            .attenuation_per_m(self.attenuation_per_m)
            .dropoff(self.dropoff)
            .sweep(self.sweep)
            .divergence_rad(self.divergence_mrad * 1e-3)
            .weather(self.weather);
        let spec = SensorSpec::from(Sensor::lidar(name, pose, options).seed(self.seed));
        ensure!(
            (1..=512).contains(&spec.height) && (1..=65_536).contains(&spec.width),
            "sensor {name:?}: {} channels of {} columns; use 1 to 512 of 1 to 65536",
            spec.height,
            spec.width
        );
        ensure!(
            spec.range_m > 0.0 && spec.range_m.is_finite(),
            "sensor {name:?}: range_m is {}; use more than 0",
            spec.range_m
        );
        for (what, value, most) in [
            ("attenuation_per_m", spec.attenuation_per_m, 10.0),
            ("noise_m", spec.noise_m, 100.0),
            ("dropoff", spec.dropoff, 1.0),
            ("rotation_rate_hz", spec.rotation_rate_hz, 1000.0),
        ] {
            ensure!(
                (0.0..=most).contains(&value),
                "sensor {name:?}: {what} is {value}; use 0 to {most}"
            );
        }
        spec.check_beams().map_err(|why| anyhow!("sensor {name:?}: {why}"))?;
        Ok(spec)
    }
}

#[cfg(test)]
mod tests {
    use protocol::lidar_flag;

    use super::super::{parse_entries, specs};

    fn lidar(fields: &str) -> anyhow::Result<protocol::SensorSpec> {
        let text = format!("[[sensor]]\nname = \"a\"\nkind = \"lidar\"\n{fields}");
        Ok(specs(&parse_entries(&text)?)?[0])
    }

    #[test]
    fn a_lidar_of_a_model_has_its_data_sheet_and_the_numbers_given() {
        let hdl = lidar("model = \"hdl-64e\"\nrange_m = 80.0\n").unwrap();
        assert_eq!([hdl.height, hdl.width], [64, 2083]);
        assert!((hdl.lidar.elevation_rad(32).to_degrees() + 8.83).abs() < 0.003);
        assert_eq!((hdl.range_m, hdl.noise_m, hdl.rotation_rate_hz), (80.0, 0.02, 0.0));
        let spinning =
            "model = \"vlp-16\"\nrotation_rate_hz = 10.0\nrate_hz = 20.0\nsweep = true\n";
        let vlp = lidar(spinning).unwrap();
        assert_eq!([vlp.height, vlp.width, vlp.lidar.flags], [16, 900, lidar_flag::SWEEP]);
        let livox = lidar("model = \"livox-mid-40\"\nrate_hz = 10.0\nweather = true\n").unwrap();
        assert_eq!(livox.height * livox.width, 10_000);
        assert_eq!((livox.lidar.has_prisms(), livox.lidar.flags), (true, lidar_flag::WEATHER));
        let own = lidar("elevations_deg = [3.0, 0.0, -5.0]\ndivergence_mrad = 3.0\n").unwrap();
        assert_eq!((own.height, own.lidar.divergence_rad), (3, 0.003));
        assert!((own.lidar.elevation_rad(2).to_degrees() + 5.0).abs() < 0.003);
        let plain = lidar("").unwrap();
        assert_eq!(
            plain,
            client_lib::wire::lidar(
                "a",
                protocol::Pose::IDENTITY,
                32,
                1800,
                [-30f32, 10.0].map(f32::to_radians),
                100.0
            )
        );
    }

    #[test]
    fn numbers_that_disagree_are_refused() {
        for (fields, said) in [
            (
                "model = \"vlp-17\"\n",
                "sensor \"a\": unknown model of a lidar \"vlp-17\"; use one of vlp-16",
            ),
            ("elevations_deg = [3.0]\n", "elevations_deg has 1 numbers"),
            ("elevations_deg = [3.0, 1.0]\n", "elevations_deg must rise"),
            ("elevations_deg = [3.0, 5.0, 1.0]\n", "give the highest first"),
            ("elevations_deg = [3.0, 2.0, 1.0]\nchannels = 4\n", "4 channels, but 3 elevations"),
            ("sweep = true\n", "sweep is on, but rotation_rate_hz and prism_hz are 0"),
            ("model = \"vlp-16\"\nrotation_rate_hz = 10.0\n", "give rate_hz or columns"),
            ("divergence_mrad = 200.0\n", "divergence_rad is 0.2, not 0 to 0.1"),
        ] {
            let why = format!("{:#}", lidar(fields).unwrap_err());
            assert!(why.contains(said), "{fields}: {why}");
        }
    }
}
