//! Radios between vehicles: how they send and receive, and what they say.

use bytemuck::{Pod, Zeroable};

use crate::{BundleId, physics_sensor::fault_of, vehicle::within};

/// How a radio sends and receives.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RadioSpec {
    /// Carrier frequency.
    pub frequency_ghz: f32,
    /// What it sends with.
    pub transmit_power_dbm: f32,
    /// What is weaker is not received.
    pub sensitivity_dbm: f32,
    /// Of the receiver's and the sender's antennas together.
    pub antenna_gain_db: f32,
    /// How fast power falls behind houses, in the geometric model.
    pub path_loss_exponent: f32,
    /// Where that fall begins.
    pub reference_m: f32,
    /// Nothing farther is received.
    pub range_m: f32,
    /// Standard deviation of the shadow fading, without [`radio::ETSI_FADING`].
    pub fading_stddev_db: f32,
    /// One of [`radio`]'s scenarios.
    pub scenario: u32,
    /// [`radio::ETSI_FADING`], [`radio::GEOMETRIC`], [`radio::FIXED_RATE`],
    /// [`radio::AS_CARLA`].
    pub flags: u32,
}

/// Values of [`RadioSpec::scenario`] and bits of [`RadioSpec::flags`].
pub mod radio {
    /// A wide road without houses.
    pub const HIGHWAY: u32 = 0;
    /// Open country.
    pub const RURAL: u32 = 1;
    /// Streets.
    pub const URBAN: u32 = 2;

    /// Shadow fading by ETSI's table.
    pub const ETSI_FADING: u32 = 1 << 0;
    /// Two rays, knife edges and a log-distance law in the place of WINNER's formulas.
    pub const GEOMETRIC: u32 = 1 << 1;
    /// A message each least interval, whatever happens.
    pub const FIXED_RATE: u32 = 1 << 2;
    /// As CARLA has it: latitude and longitude as [`crate::geodesy::CARLA`], and the heights of
    /// vehicles in the way counted from the ground, not from the line of sight.
    pub const AS_CARLA: u32 = 1 << 3;
}

impl Default for RadioSpec {
    /// CARLA's.
    fn default() -> Self {
        RadioSpec {
            frequency_ghz: 5.9,
            transmit_power_dbm: 21.5,
            sensitivity_dbm: -99.0,
            antenna_gain_db: 10.0,
            path_loss_exponent: 2.7,
            reference_m: 1.0,
            range_m: 500.0,
            fading_stddev_db: 0.0,
            scenario: radio::HIGHWAY,
            flags: radio::ETSI_FADING,
        }
    }
}

/// A station that sends and receives cooperative awareness messages.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CamSpec {
    /// How it sends and receives.
    pub radio: RadioSpec,
    /// The least time between two messages.
    pub interval_min_secs: f32,
    /// The most.
    pub interval_max_secs: f32,
    /// Standard deviation of what it says of itself.
    pub latitude_stddev_deg: f32,
    /// Added to what it says of itself.
    pub latitude_bias_deg: f32,
    /// Standard deviation.
    pub longitude_stddev_deg: f32,
    /// Added.
    pub longitude_bias_deg: f32,
    /// Standard deviation.
    pub altitude_stddev_m: f32,
    /// Added.
    pub altitude_bias_m: f32,
    /// Standard deviation.
    pub heading_stddev_rad: f32,
    /// Added.
    pub heading_bias_rad: f32,
    /// Standard deviation, ahead, left, up.
    pub acceleration_stddev_mps2: [f32; 3],
    /// Standard deviation.
    pub yaw_rate_stddev_radps: f32,
    /// Added.
    pub yaw_rate_bias_radps: f32,
    /// Standard deviation.
    pub speed_stddev_mps: f32,
}

impl Default for CamSpec {
    /// CARLA's.
    fn default() -> Self {
        CamSpec {
            radio: RadioSpec::default(),
            interval_min_secs: 0.1,
            interval_max_secs: 1.0,
            ..CamSpec::zeroed()
        }
    }
}

/// A station that sends and receives texts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MessageSpec {
    /// How it sends and receives.
    pub radio: RadioSpec,
}

/// A cooperative awareness message, as ETSI EN 302 637-2 has it, that was received in this frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CamReading {
    /// With what power it was received.
    pub power_dbm: f32,
    /// Who sent it: the carrier's id.
    pub station_id: u32,
    /// ETSI's number of what the sender is: 5 a car, 6 a bus, 7 a truck, 1 a pedestrian, 15 a
    /// roadside unit.
    pub station_type: u32,
    /// Milliseconds of simulated time, modulo 65536.
    pub generation_delta_ms: u32,
    /// Northwards.
    pub latitude_deg: f64,
    /// Eastwards.
    pub longitude_deg: f64,
    /// Above the map's zero.
    pub altitude_m: f64,
    /// Clockwise from north, 0 to 2π.
    pub heading_rad: f32,
    /// Along the vehicle's x; never negative.
    pub speed_mps: f32,
    /// 0 forwards, 1 backwards.
    pub drive_direction: u32,
    /// Of its box.
    pub length_m: f32,
    /// Of its box.
    pub width_m: f32,
    /// Ahead, left, up; gravity not felt.
    pub acceleration_mps2: [f32; 3],
    /// To the left.
    pub yaw_rate_radps: f32,
    /// 1: role and lights are told, which is so twice a second; 0: they are not.
    pub has_low_frequency: u32,
    /// ETSI's number: 0 default, 1 public transport, 6 emergency.
    pub role: u32,
    /// Its lamps: bits of [`crate::lamp`].
    pub lamps: u32,
}

/// A text that was received in this frame.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MessageReading {
    /// With what power it was received.
    pub power_dbm: f32,
    /// Who sent it: the carrier's id.
    pub station_id: u32,
    /// What was sent, padded with zeros.
    pub text: [u8; TEXT_BYTES],
}

/// The most bytes of one text; CARLA's clients read no more.
pub const TEXT_BYTES: usize = 100;

impl MessageReading {
    /// What was sent, up to the first zero, as far as it is UTF-8.
    pub fn text(&self) -> &str {
        let end = self.text.iter().position(|byte| *byte == 0).unwrap_or(TEXT_BYTES);
        let bytes = &self.text[..end];
        std::str::from_utf8(bytes)
            .unwrap_or_else(|e| std::str::from_utf8(&bytes[..e.valid_up_to()]).unwrap_or_default())
    }
}

/// See [`crate::Command::Transmit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Transmit {
    /// On which bundle.
    pub bundle: BundleId,
    /// Which of its sensors.
    pub sensor: u32,
    /// What is sent, padded with zeros.
    pub text: [u8; TEXT_BYTES],
}

impl RadioSpec {
    fn fault(&self) -> Result<(), String> {
        within("frequency_ghz", self.frequency_ghz, 0.001, 1000.0)?;
        within("transmit_power_dbm", self.transmit_power_dbm, -200.0, 200.0)?;
        within("sensitivity_dbm", self.sensitivity_dbm, -1000.0, 1000.0)?;
        within("antenna_gain_db", self.antenna_gain_db, -1000.0, 1000.0)?;
        within("path_loss_exponent", self.path_loss_exponent, 0.0, 100.0)?;
        within("reference_m", self.reference_m, 0.001, 1e5)?;
        within("range_m", self.range_m, 0.0, 1e5)?;
        within("fading_stddev_db", self.fading_stddev_db, 0.0, 1000.0)?;
        if self.scenario > radio::URBAN {
            return Err(format!("scenario is {}, not 0 to {}", self.scenario, radio::URBAN));
        }
        Ok(())
    }
}

impl CamSpec {
    pub(crate) fn fault(&self) -> Result<(), String> {
        self.radio.fault()?;
        within("interval_min_secs", self.interval_min_secs, 0.0, 1000.0)?;
        within("interval_max_secs", self.interval_max_secs, 0.0, 1000.0)?;
        let errors: [f32; 14] = bytemuck::cast_slice(&[*self])[12..26].try_into().expect("14 are");
        fault_of("what it says of itself", &errors, 1e6)
    }
}

impl MessageSpec {
    pub(crate) fn fault(&self) -> Result<(), String> {
        self.radio.fault()
    }
}
