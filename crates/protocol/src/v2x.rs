//! V2X radios: parameters and messages.

use bytemuck::{Pod, Zeroable};

use crate::{
    BundleId,
    range::{each, within},
};

/// Parameters of a radio.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RadioSpec {
    /// Carrier frequency.
    pub frequency_ghz: f32,
    /// Transmit power.
    pub transmit_power_dbm: f32,
    /// Weakest power that is received.
    pub sensitivity_dbm: f32,
    /// Combined gain of both antennas.
    pub antenna_gain_db: f32,
    /// Path loss exponent behind buildings, in the geometric model.
    pub path_loss_exponent: f32,
    /// Reference distance of the path loss law.
    pub reference_m: f32,
    /// Largest range.
    pub range_m: f32,
    /// Standard deviation of the shadow fading, without [`radio::ETSI_FADING`].
    pub fading_stddev_db: f32,
    /// Scenario: one of [`radio`].
    pub scenario: u32,
    /// Bits: [`radio::ETSI_FADING`], [`radio::GEOMETRIC`], [`radio::FIXED_RATE`],
    /// [`radio::AS_CARLA`].
    pub flags: u32,
}

/// Values of [`RadioSpec::scenario`] and bits of [`RadioSpec::flags`].
pub mod radio {
    /// A motorway without buildings.
    pub const HIGHWAY: u32 = 0;
    /// Open country.
    pub const RURAL: u32 = 1;
    /// Streets between buildings.
    pub const URBAN: u32 = 2;

    /// Shadow fading by the table of ETSI.
    pub const ETSI_FADING: u32 = 1 << 0;
    /// Two-ray ground reflection, knife edges and a log-distance law instead of the WINNER formulas.
    pub const GEOMETRIC: u32 = 1 << 1;
    /// A message after each minimum interval, whatever the motion.
    pub const FIXED_RATE: u32 = 1 << 2;
    /// Conventions of CARLA: latitude and longitude as in [`crate::geodesy::CARLA`], and the height of
    /// obstructing vehicles above the ground instead of above the line of sight.
    pub const AS_CARLA: u32 = 1 << 3;
}

impl Default for RadioSpec {
    /// The defaults of CARLA.
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

/// Parameters of a station for cooperative awareness messages.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CamSpec {
    /// The radio.
    pub radio: RadioSpec,
    /// Shortest time between two messages.
    pub interval_min_secs: f32,
    /// Longest time between two messages.
    pub interval_max_secs: f32,
    /// Standard deviation of the transmitted latitude.
    pub latitude_stddev_deg: f32,
    /// Bias of the transmitted latitude.
    pub latitude_bias_deg: f32,
    /// Standard deviation of the transmitted longitude.
    pub longitude_stddev_deg: f32,
    /// Bias of the transmitted longitude.
    pub longitude_bias_deg: f32,
    /// Standard deviation of the transmitted altitude.
    pub altitude_stddev_m: f32,
    /// Bias of the transmitted altitude.
    pub altitude_bias_m: f32,
    /// Standard deviation of the transmitted heading.
    pub heading_stddev_rad: f32,
    /// Bias of the transmitted heading.
    pub heading_bias_rad: f32,
    /// Standard deviation of the transmitted acceleration: forward, left, up.
    pub acceleration_stddev_mps2: [f32; 3],
    /// Standard deviation of the transmitted yaw rate.
    pub yaw_rate_stddev_radps: f32,
    /// Bias of the transmitted yaw rate.
    pub yaw_rate_bias_radps: f32,
    /// Standard deviation of the transmitted speed.
    pub speed_stddev_mps: f32,
}

impl Default for CamSpec {
    /// The defaults of CARLA.
    fn default() -> Self {
        CamSpec {
            radio: RadioSpec::default(),
            interval_min_secs: 0.1,
            interval_max_secs: 1.0,
            ..CamSpec::zeroed()
        }
    }
}

/// Parameters of a station for texts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MessageSpec {
    /// The radio.
    pub radio: RadioSpec,
}

/// A cooperative awareness message (ETSI EN 302 637-2) received in this frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CamReading {
    /// Received power.
    pub power_dbm: f32,
    /// Id of the actor that carries the sender.
    pub station_id: u32,
    /// ETSI station type: 1 pedestrian, 5 passenger car, 6 bus, 7 truck, 15 roadside unit.
    pub station_type: u32,
    /// Generation time: milliseconds of simulated time, modulo 65536.
    pub generation_delta_ms: u32,
    /// Latitude, positive to the north.
    pub latitude_deg: f64,
    /// Longitude, positive to the east.
    pub longitude_deg: f64,
    /// Altitude above the map's zero.
    pub altitude_m: f64,
    /// Heading clockwise from north, 0 to 2π.
    pub heading_rad: f32,
    /// Speed along the vehicle's x axis, never negative.
    pub speed_mps: f32,
    /// Drive direction: 0 forwards, 1 backwards.
    pub drive_direction: u32,
    /// Length of the bounding box.
    pub length_m: f32,
    /// Width of the bounding box.
    pub width_m: f32,
    /// Coordinate acceleration: forward, left, up.
    pub acceleration_mps2: [f32; 3],
    /// Yaw rate, positive to the left.
    pub yaw_rate_radps: f32,
    /// 1: the low-frequency container with role and lights is present (twice a second); 0: it is not.
    pub has_low_frequency: u32,
    /// ETSI vehicle role: 0 default, 1 public transport, 6 emergency.
    pub role: u32,
    /// Exterior lights: bits of [`crate::lamp`].
    pub lamps: u32,
}

/// A text received in this frame.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MessageReading {
    /// Received power.
    pub power_dbm: f32,
    /// Id of the actor that carries the sender.
    pub station_id: u32,
    /// The text, padded with zeros.
    pub text: [u8; TEXT_BYTES],
}

/// The most bytes of one text; CARLA's clients read no more.
pub const TEXT_BYTES: usize = 100;

impl MessageReading {
    /// The text up to the first zero, as far as it is UTF-8.
    pub fn text(&self) -> &str {
        let end = self.text.iter().position(|byte| *byte == 0).unwrap_or(TEXT_BYTES);
        let bytes = &self.text[..end];
        std::str::from_utf8(bytes)
            .unwrap_or_else(|e| std::str::from_utf8(&bytes[..e.valid_up_to()]).unwrap_or_default())
    }
}

/// Parameters of [`crate::Command::Transmit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Transmit {
    /// The bundle that the radio belongs to.
    pub bundle: BundleId,
    /// Index of the radio in the bundle.
    pub sensor: u32,
    /// The text, padded with zeros.
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
        each("what it says of itself", &errors, -1e6, 1e6)
    }
}

impl MessageSpec {
    pub(crate) fn fault(&self) -> Result<(), String> {
        self.radio.fault()
    }
}
