//! Radios between vehicles, in CARLA's layouts: C structs of words of eight bytes, whose C++
//! vectors are sent as zeros.

use client_lib::wire::{CamReading, CamSpec, MessageReading, MessageSpec, RadioSpec, lamp, radio};

use crate::{
    args::RpcError,
    wire::{Bytes, Description},
};

/// Bytes of one cooperative awareness message, and of one text message.
pub(crate) const CAM_BYTES: usize = 464;
pub(crate) const TEXT_BYTES: usize = 136;

/// The values that ETSI TS 102 894-2 defines for "unavailable".
mod unknown {
    pub(super) const SEMI_AXIS: i64 = 4095;
    pub(super) const HEADING: i64 = 3601;
    pub(super) const ALTITUDE_CONFIDENCE: i64 = 15;
    pub(super) const LENGTH_CONFIDENCE: i64 = 4;
    pub(super) const ACCELERATION: i64 = 161;
    pub(super) const ACCELERATION_CONFIDENCE: i64 = 102;
    pub(super) const CURVATURE: i64 = 1023;
    pub(super) const CURVATURE_CONFIDENCE: i64 = 7;
    pub(super) const YAW_RATE: i64 = 32_767;
    pub(super) const YAW_RATE_CONFIDENCE: i64 = 8;
}

const PROTOCOL_VERSION: i64 = 2;
const CAM: i64 = 2;
const CUSTOM: i64 = 0;
/// The vertical acceleration in CARLA's messages includes gravity.
const GRAVITY_MPS2: f32 = 9.81;
const SPEED_MAX_CMPS: f32 = 16_382.0;

/// Returns how a radio with these attributes sends and receives.
fn radio_of(d: &Description) -> Result<RadioSpec, RpcError> {
    let number = |id: &str, otherwise: f32| d.number(id, otherwise);
    let bit = |id: &str, otherwise: bool, bit: u32| {
        let is_on = if d.get(id).is_some() { d.flag(id) } else { otherwise };
        if is_on { bit } else { 0 }
    };
    let is_geometric = d.get("path_loss_model") == Some("geometric");
    Ok(RadioSpec {
        frequency_ghz: number("frequency_ghz", 5.9)?,
        transmit_power_dbm: number("transmit_power", 21.5)?,
        sensitivity_dbm: number("receiver_sensitivity", -99.0)?,
        antenna_gain_db: number("combined_antenna_gain", 10.0)?,
        path_loss_exponent: number("path_loss_exponent", 2.7)?,
        reference_m: number("d_ref", 1.0)?,
        range_m: number("filter_distance", 500.0)?,
        fading_stddev_db: number("custom_fading_stddev", 0.0)?.abs(),
        scenario: match d.get("scenario") {
            Some("rural") => radio::RURAL,
            Some("urban") => radio::URBAN,
            _ => radio::HIGHWAY,
        },
        flags: bit("use_etsi_fading", true, radio::ETSI_FADING)
            | bit("fixed_rate", false, radio::FIXED_RATE)
            | if is_geometric { radio::GEOMETRIC } else { 0 }
            | radio::AS_CARLA,
    })
}

/// Returns the specification of a station that sends cooperative awareness messages.
pub(crate) fn cam_spec(d: &Description) -> Result<CamSpec, RpcError> {
    let number = |id: &str| d.number(id, 0.0);
    let deviation = |id: &str| d.number(id, 0.0).map(f32::abs);
    Ok(CamSpec {
        radio: radio_of(d)?,
        interval_min_secs: d.number("gen_cam_min", 0.1)?,
        interval_max_secs: d.number("gen_cam_max", 1.0)?,
        latitude_stddev_deg: deviation("noise_lat_stddev")?,
        latitude_bias_deg: number("noise_lat_bias")?,
        longitude_stddev_deg: deviation("noise_lon_stddev")?,
        longitude_bias_deg: number("noise_lon_bias")?,
        altitude_stddev_m: deviation("noise_alt_stddev")?,
        altitude_bias_m: number("noise_alt_bias")?,
        heading_stddev_rad: deviation("noise_head_stddev")?.to_radians(),
        heading_bias_rad: number("noise_head_bias")?.to_radians(),
        acceleration_stddev_mps2: [
            deviation("noise_accel_stddev_x")?,
            deviation("noise_accel_stddev_y")?,
            deviation("noise_accel_stddev_z")?,
        ],
        yaw_rate_stddev_radps: deviation("noise_yawrate_stddev")?,
        // CARLA's yaw rate is positive clockwise.
        yaw_rate_bias_radps: -number("noise_yawrate_bias")?,
        speed_stddev_mps: deviation("noise_vel_stddev_x")?,
    })
}

/// Returns the specification of a station that sends text messages.
pub(crate) fn text_spec(d: &Description) -> Result<MessageSpec, RpcError> {
    Ok(MessageSpec { radio: radio_of(d)? })
}

/// Appends all awareness messages that were received in a frame.
pub(crate) fn cams(mut bytes: Bytes, readings: &[CamReading]) -> Bytes {
    for reading in readings {
        let at = bytes.0.len();
        bytes.0.resize(at + CAM_BYTES, 0);
        write_cam(&mut bytes.0[at..], reading);
    }
    bytes
}

/// Appends all text messages that were received in a frame.
pub(crate) fn texts(mut bytes: Bytes, readings: &[MessageReading]) -> Bytes {
    for reading in readings {
        let at = bytes.0.len();
        bytes.0.resize(at + TEXT_BYTES, 0);
        let out = &mut bytes.0[at..];
        out[..4].copy_from_slice(&reading.power_dbm.to_le_bytes());
        for (at, word) in [(8, PROTOCOL_VERSION), (16, CUSTOM), (24, reading.station_id.into())] {
            out[at..at + 8].copy_from_slice(&word.to_le_bytes());
        }
        // The last byte stays zero: clients read up to a zero byte.
        out[32..131].copy_from_slice(&reading.text[..99]);
    }
    bytes
}

#[rustfmt::skip]
fn write_cam(out: &mut [u8], cam: &CamReading) {
    let mut put = |at: usize, word: i64| out[at..at + 8].copy_from_slice(&word.to_le_bytes());
    let tenth = |mps2: f32| {
        let value = (mps2 * 10.0).round();
        if (-160.0..=161.0).contains(&value) { value as i64 } else { unknown::ACCELERATION }
    };
    put(8, PROTOCOL_VERSION);
    put(16, CAM);
    put(24, cam.station_id.into());
    put(32, cam.generation_delta_ms.into());
    // Station type and reference position: tenths of a microdegree, centimetres.
    put(40, cam.station_type.into());
    put(48, (cam.latitude_deg * 1e6).round() as i64 * 10);
    put(56, (cam.longitude_deg * 1e6).round() as i64 * 10);
    put(64, unknown::SEMI_AXIS);
    put(72, unknown::SEMI_AXIS);
    put(80, unknown::HEADING);
    put(88, (cam.altitude_m * 100.0).round() as i64);
    put(96, unknown::ALTITUDE_CONFIDENCE);
    if cam.station_type == ROADSIDE_UNIT {
        put(104, 2);
        out[..4].copy_from_slice(&cam.power_dbm.to_le_bytes());
        return;
    }
    // High-frequency container: motion.
    put(104, 1);
    put(112, (cam.heading_rad.to_degrees() * 10.0).round() as i64);
    put(120, 10);
    put(128, (cam.speed_mps * 100.0).round().min(SPEED_MAX_CMPS) as i64);
    put(136, 3);
    put(144, cam.drive_direction.into());
    put(152, (cam.length_m * 10.0).round() as i64);
    put(160, unknown::LENGTH_CONFIDENCE);
    put(168, (cam.width_m * 10.0).round() as i64);
    let [ahead, left, up] = cam.acceleration_mps2;
    put(176, tenth(ahead));
    put(184, unknown::ACCELERATION_CONFIDENCE);
    put(192, unknown::CURVATURE);
    put(200, unknown::CURVATURE_CONFIDENCE);
    // CARLA's axes are left-handed: y to the right, yaw positive clockwise.
    let yaw_rate = (-cam.yaw_rate_radps.to_degrees() * 100.0).round();
    put(216, if yaw_rate.abs() <= 32_766.0 { yaw_rate as i64 } else { unknown::YAW_RATE });
    put(224, unknown::YAW_RATE_CONFIDENCE);
    put(280, tenth(-left));
    put(288, unknown::ACCELERATION_CONFIDENCE);
    put(304, tenth(up + GRAVITY_MPS2));
    put(312, unknown::ACCELERATION_CONFIDENCE);
    if cam.has_low_frequency != 0 {
        put(408, 1);
        put(416, cam.role.into());
        out[424] = exterior_lights(cam.lamps);
    }
    // Lateral and vertical acceleration are present.
    (out[272], out[296]) = (1, 1);
    out[..4].copy_from_slice(&cam.power_dbm.to_le_bytes());
}

const ROADSIDE_UNIT: u32 = 15;

/// Returns ETSI's `ExteriorLights`, whose first bit is the highest.
fn exterior_lights(lamps: u32) -> u8 {
    let bits = [
        (lamp::LOW_BEAM, 0),
        (lamp::HIGH_BEAM, 1),
        (lamp::LEFT_BLINKER, 2),
        (lamp::RIGHT_BLINKER, 3),
        (lamp::REVERSE, 5),
        (lamp::FOG, 6),
        (lamp::POSITION, 7),
    ];
    let on = bits.into_iter().filter(|(lamp, _)| lamps & lamp != 0);
    on.fold(0, |byte, (_, bit)| byte | 0x80 >> bit)
}
