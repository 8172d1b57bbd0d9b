//! Parameters of V2X radios.

use std::time::Duration;

use bitflags::bitflags;
use glam::Vec3;
use protocol::{CamSpec, RadioSpec, radio};

use crate::options::options;

/// The surroundings for which a radio's path loss and fading are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
#[non_exhaustive]
pub enum V2xScenario {
    /// A motorway without buildings.
    #[default]
    Highway = radio::HIGHWAY,
    /// Open country.
    Rural = radio::RURAL,
    /// Streets between buildings.
    Urban = radio::URBAN,
}

bitflags! {
    /// Models that a radio uses.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct V2xRadioFlags: u32 {
        /// Shadow fading with the standard deviation of ETSI TR 103 257-1, table 6.
        const ETSI_FADING = radio::ETSI_FADING;
        /// Two-ray ground reflection, knife edges and a log-distance law instead of the WINNER
        /// formulas.
        const GEOMETRIC = radio::GEOMETRIC;
        /// An awareness message after each minimum interval, whatever the motion.
        const FIXED_RATE = radio::FIXED_RATE;
        /// Conventions of CARLA: latitude and longitude as in
        /// [`Geodesy::Carla`](crate::Geodesy::Carla), and the height of obstructing vehicles above
        /// the ground instead of above the line of sight.
        const AS_CARLA = radio::AS_CARLA;
    }
}

options! {
    /// Parameters of a V2X radio. The default is CARLA's: 5.9 GHz, 21.5 dBm, a highway with ETSI
    /// fading.
    pub struct V2xRadioOptions {
        /// Carrier frequency, GHz.
        frequency_ghz: f32,
        /// Transmit power, dBm.
        transmit_power_dbm: f32,
        /// Weakest power that is received, dBm.
        sensitivity_dbm: f32,
        /// Combined gain of both antennas, dB.
        antenna_gain_db: f32,
        /// Path loss exponent behind buildings, in the geometric model.
        path_loss_exponent: f32,
        /// Reference distance of the path loss law, metres.
        reference_m: f32,
        /// Largest range, metres.
        range_m: f32,
        /// Standard deviation of the shadow fading without [`V2xRadioFlags::ETSI_FADING`], dB.
        fading_stddev_db: f32,
        /// Surroundings.
        scenario: V2xScenario,
        /// Models that it uses.
        flags: V2xRadioFlags,
    }
}

impl Default for V2xRadioOptions {
    fn default() -> V2xRadioOptions {
        V2xRadioOptions {
            frequency_ghz: 5.9,
            transmit_power_dbm: 21.5,
            sensitivity_dbm: -99.0,
            antenna_gain_db: 10.0,
            path_loss_exponent: 2.7,
            reference_m: 1.0,
            range_m: 500.0,
            fading_stddev_db: 0.0,
            scenario: V2xScenario::Highway,
            flags: V2xRadioFlags::ETSI_FADING,
        }
    }
}

impl V2xRadioOptions {
    pub(crate) fn wire(&self) -> RadioSpec {
        RadioSpec {
            frequency_ghz: self.frequency_ghz,
            transmit_power_dbm: self.transmit_power_dbm,
            sensitivity_dbm: self.sensitivity_dbm,
            antenna_gain_db: self.antenna_gain_db,
            path_loss_exponent: self.path_loss_exponent,
            reference_m: self.reference_m,
            range_m: self.range_m,
            fading_stddev_db: self.fading_stddev_db,
            scenario: self.scenario as u32,
            flags: self.flags.bits(),
        }
    }
}

options! {
    /// Parameters of a station that sends and receives cooperative awareness messages, with the
    /// errors of what it sends. The default is CARLA's: 0.1 s to 1 s between messages, no errors.
    pub struct V2xAwarenessOptions {
        /// The radio.
        radio: V2xRadioOptions,
        /// Shortest time between two messages, simulated time.
        interval_min: Duration,
        /// Longest time between two messages, simulated time.
        interval_max: Duration,
        /// Standard deviation of the transmitted latitude, degrees.
        latitude_stddev_deg: f32,
        /// Bias of the transmitted latitude, degrees.
        latitude_bias_deg: f32,
        /// Standard deviation of the transmitted longitude, degrees.
        longitude_stddev_deg: f32,
        /// Bias of the transmitted longitude, degrees.
        longitude_bias_deg: f32,
        /// Standard deviation of the transmitted altitude, metres.
        altitude_stddev_m: f32,
        /// Bias of the transmitted altitude, metres.
        altitude_bias_m: f32,
        /// Standard deviation of the transmitted heading, radians.
        heading_stddev_rad: f32,
        /// Bias of the transmitted heading, radians.
        heading_bias_rad: f32,
        /// Standard deviation of the transmitted acceleration: forward, left, up, m/s².
        acceleration_stddev: Vec3,
        /// Standard deviation of the transmitted yaw rate, rad/s.
        yaw_rate_stddev_radps: f32,
        /// Bias of the transmitted yaw rate, rad/s.
        yaw_rate_bias_radps: f32,
        /// Standard deviation of the transmitted speed, m/s.
        speed_stddev_mps: f32,
    }
}

impl Default for V2xAwarenessOptions {
    fn default() -> V2xAwarenessOptions {
        V2xAwarenessOptions {
            radio: V2xRadioOptions::default(),
            interval_min: Duration::from_millis(100),
            interval_max: Duration::from_secs(1),
            latitude_stddev_deg: 0.0,
            latitude_bias_deg: 0.0,
            longitude_stddev_deg: 0.0,
            longitude_bias_deg: 0.0,
            altitude_stddev_m: 0.0,
            altitude_bias_m: 0.0,
            heading_stddev_rad: 0.0,
            heading_bias_rad: 0.0,
            acceleration_stddev: Vec3::ZERO,
            yaw_rate_stddev_radps: 0.0,
            yaw_rate_bias_radps: 0.0,
            speed_stddev_mps: 0.0,
        }
    }
}

impl V2xAwarenessOptions {
    pub(crate) fn wire(&self) -> CamSpec {
        CamSpec {
            radio: self.radio.wire(),
            interval_min_secs: self.interval_min.as_secs_f32(),
            interval_max_secs: self.interval_max.as_secs_f32(),
            latitude_stddev_deg: self.latitude_stddev_deg,
            latitude_bias_deg: self.latitude_bias_deg,
            longitude_stddev_deg: self.longitude_stddev_deg,
            longitude_bias_deg: self.longitude_bias_deg,
            altitude_stddev_m: self.altitude_stddev_m,
            altitude_bias_m: self.altitude_bias_m,
            heading_stddev_rad: self.heading_stddev_rad,
            heading_bias_rad: self.heading_bias_rad,
            acceleration_stddev_mps2: self.acceleration_stddev.to_array(),
            yaw_rate_stddev_radps: self.yaw_rate_stddev_radps,
            yaw_rate_bias_radps: self.yaw_rate_bias_radps,
            speed_stddev_mps: self.speed_stddev_mps,
        }
    }
}
