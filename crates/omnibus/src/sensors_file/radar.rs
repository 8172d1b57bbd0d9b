//! Radars of a file.

use anyhow::ensure;
use client_lib::{Radar, RadarReceiver};
use protocol::{Pose, SensorSpec};

use super::{Kind, SensorEntry};

impl SensorEntry {
    /// Returns what a radar makes of its rays, with the points of one period; `None` for other sensors.
    pub(crate) fn radar(&self, period_nanos: u64) -> Option<Radar> {
        (self.kind == Kind::Radar).then(|| Radar {
            fov_rad: [self.horizontal_fov_deg, self.vertical_fov_deg].map(f32::to_radians),
            range_m: self.radar_range_m(),
            points: (f64::from(self.points_per_second) * period_nanos as f64 * 1e-9).round()
                as usize,
            seed: self.seed,
        })
    }

    fn radar_range_m(&self) -> f32 {
        self.range_m.unwrap_or(100.0)
    }

    /// Returns the receiver of a radar that has one.
    pub(crate) fn receiver(&self) -> Option<RadarReceiver> {
        let given = self.receiver.as_ref().filter(|_| self.kind == Kind::Radar)?;
        Some(given.receiver())
    }

    /// Returns the rays of a radar in the protocol's layout.
    pub(super) fn radar_grid(&self, pose: Pose) -> anyhow::Result<SensorSpec> {
        let name = &self.name;
        for (what, value, most) in [
            ("horizontal_fov_deg", self.horizontal_fov_deg, 170.0),
            ("vertical_fov_deg", self.vertical_fov_deg, 170.0),
            ("range_m", self.radar_range_m(), 1e4),
            ("points_per_second", self.points_per_second, 1e6),
        ] {
            ensure!(
                (1.0..=most).contains(&value),
                "sensor {name:?}: {what} is {value}; use 1 to {most}"
            );
        }
        let radar = self.radar(0).expect("this is one");
        let Some(receiver) = self.receiver() else { return Ok(radar.grid(name, pose)) };
        let [cell_m, cell_rad, cell_mps] = receiver.cell;
        for (what, value, least, most) in [
            ("frequency_ghz", receiver.frequency_hz / 1e9, 1.0, 1000.0),
            ("transmit_power_dbm", receiver.transmit_power_dbm, -200.0, 200.0),
            ("antenna_gain_db", receiver.antenna_gain_db, -100.0, 100.0),
            ("noise_dbm", receiver.noise_dbm, -300.0, 200.0),
            ("snr_min_db", receiver.snr_min_db, -100.0, 300.0),
            ("cell_m", cell_m, 0.01, 1000.0),
            ("cell_deg", cell_rad.to_degrees(), 0.01, 180.0),
            ("cell_mps", cell_mps, 0.001, 1000.0),
        ] {
            ensure!(
                (least..=most).contains(&value),
                "sensor {name:?}: {what} of its receiver is {value}; use {least} to {most}"
            );
        }
        Ok(radar.grid(name, pose))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{parse_entries, specs};

    #[test]
    fn a_receiver_has_defaults_and_its_numbers_are_checked() {
        let parse = |receiver: &str| {
            let text = format!(
                "[[sensor]]\nname = \"a\"\nkind = \"radar\"\nreceiver = {{ {receiver} }}\n"
            );
            let entries = parse_entries(&text)?;
            specs(&entries).map(|_| entries[0].receiver())
        };
        let receiver = parse("ghosts = true, cell_deg = 2.0").unwrap().unwrap();
        assert!((receiver.cell[1] - 2f32.to_radians()).abs() < 1e-6 && receiver.has_ghosts);
        assert_eq!((receiver.frequency_hz, receiver.snr_min_db), (77e9, 13.0));
        let why = format!("{:#}", parse("cell_m = 0.0").unwrap_err());
        assert!(why.contains("cell_m of its receiver is 0; use 0.01 to 1000"), "{why}");
        let why = format!("{:#}", parse("noise_dbm = nan").unwrap_err());
        assert!(why.contains("noise_dbm of its receiver is NaN"), "{why}");
    }
}
