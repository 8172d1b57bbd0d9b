//! The receiver of a radar, as a file describes it.

use client_lib::RadarReceiver;
use serde::{Deserialize, Serialize};

/// The receiver of a radar; what is not given is that of `RadarReceiver::default`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReceiverEntry {
    frequency_ghz: Option<f32>,
    transmit_power_dbm: Option<f32>,
    antenna_gain_db: Option<f32>,
    noise_dbm: Option<f32>,
    snr_min_db: Option<f32>,
    /// Size of a cell.
    cell_m: Option<f32>,
    cell_deg: Option<f32>,
    cell_mps: Option<f32>,
    #[serde(default)]
    ghosts: bool,
}

impl ReceiverEntry {
    pub(super) fn receiver(&self) -> RadarReceiver {
        let usual = RadarReceiver::default();
        let [cell_m, cell_rad, cell_mps] = usual.cell;
        RadarReceiver {
            frequency_hz: self.frequency_ghz.map_or(usual.frequency_hz, |ghz| ghz * 1e9),
            transmit_power_dbm: self.transmit_power_dbm.unwrap_or(usual.transmit_power_dbm),
            antenna_gain_db: self.antenna_gain_db.unwrap_or(usual.antenna_gain_db),
            noise_dbm: self.noise_dbm.unwrap_or(usual.noise_dbm),
            snr_min_db: self.snr_min_db.unwrap_or(usual.snr_min_db),
            cell: [
                self.cell_m.unwrap_or(cell_m),
                self.cell_deg.map_or(cell_rad, f32::to_radians),
                self.cell_mps.unwrap_or(cell_mps),
            ],
            has_ghosts: self.ghosts,
        }
    }
}
