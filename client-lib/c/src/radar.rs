//! Radars, and what they detected.
#![expect(unsafe_code, reason = "names of C functions")]

use std::{
    ffi::c_char,
    mem::{MaybeUninit, offset_of},
};

use client_lib::{ActorId, Radar, RadarReceiver, RadarTarget, Sensor, glam::Vec3};

use crate::{
    argument::{fill, place, text},
    bundle::{OmnibusBundle, OmnibusMeasurement, create},
    client::{OmnibusClient, enter},
    radar_model::RadarModel,
    status::{Fault, OmnibusStatus, call},
    world::OmnibusPose,
};

/// The receiver of a radar, which adds up the echoes of each cell by the radar equation; docs/sensors.md
/// has the formulas. omnibus_radar_receiver() sets all fields.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct OmnibusRadarReceiver {
    /// Carrier frequency, hertz. 0: the radar has no receiver.
    pub frequency_hz: f32,
    /// Transmitted power, decibels above a milliwatt.
    pub transmit_power_dbm: f32,
    /// Gain of each of the two antennas, decibels.
    pub antenna_gain_db: f32,
    /// Noise of a cell, with the losses and after integration, decibels above a milliwatt.
    pub noise_dbm: f32,
    /// Least ratio of signal to noise of a detection, decibels.
    pub snr_min_db: f32,
    /// Size of a cell: distance in metres, azimuth in radians, range rate in metres per second.
    pub cell: [f32; 3],
    /// Not 0: walls that mirror the beam show ghosts of actors behind them.
    pub has_ghosts: u32,
}

impl OmnibusRadarReceiver {
    fn checked(&self) -> Result<Option<RadarReceiver>, Fault> {
        if self.frequency_hz == 0.0 {
            return Ok(None);
        }
        let receiver = RadarReceiver {
            frequency_hz: self.frequency_hz,
            transmit_power_dbm: self.transmit_power_dbm,
            antenna_gain_db: self.antenna_gain_db,
            noise_dbm: self.noise_dbm,
            snr_min_db: self.snr_min_db,
            cell: self.cell,
            has_ghosts: self.has_ghosts != 0,
        };
        receiver.check().map_err(|why| Fault::argument(format!("receiver: {why}")))?;
        Ok(Some(receiver))
    }
}

/// A radar.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct OmnibusRadar {
    /// parent_from_sensor: in the space of the actor that carries it. Sensor space is x forward,
    /// y left, z up.
    pub pose: OmnibusPose,
    /// Horizontal and vertical field of view, radians, 1 to 170 degrees.
    pub fov_rad: [f32; 2],
    /// The distance up to which it detects, metres.
    pub range_m: f32,
    /// Directions of omnibus_radar_detections(); those that meet nothing give no detection.
    pub points: u32,
    /// Seed of the directions.
    pub seed: u64,
    /// How many measurements may be held at a time, 1 to OMNIBUS_HELD_MAX.
    pub held_max: u32,
    /// Receiver, for omnibus_radar_targets(); all 0: none.
    pub receiver: OmnibusRadarReceiver,
}

/// What a radar met in one direction.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct OmnibusRadarDetection {
    /// Range rate, negative for what comes nearer, m/s.
    pub velocity_mps: f32,
    /// Angle from the x axis of sensor space in its xy plane, positive to the left, radians.
    pub azimuth_rad: f32,
    /// Angle from the xy plane, positive upwards, radians.
    pub altitude_rad: f32,
    /// Distance, metres.
    pub depth_m: f32,
    /// The actor's id, or that of a static object with the top bit set.
    pub instance: u32,
    /// The semantic tag.
    pub tag: u32,
}

/// A cell that the receiver of a radar detected.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct OmnibusRadarTarget {
    /// Mean of the cell by power, and the actor or object of its strongest part.
    pub detection: OmnibusRadarDetection,
    /// Received power, decibels above a milliwatt.
    pub power_dbm: f32,
    /// Ratio of signal to noise, decibels.
    pub snr_db: f32,
    /// Cross-section, decibels above a square metre.
    pub cross_section_dbsm: f32,
    /// Not 0: a wall mirrored it.
    pub is_ghost: u32,
}

/// C compilers lay them out without padding.
const _: () = {
    assert!(size_of::<OmnibusRadarDetection>() == 24 && size_of::<OmnibusRadarTarget>() == 40);
    assert!(offset_of!(OmnibusRadarTarget, power_dbm) == 24);
};

impl From<&RadarTarget> for OmnibusRadarTarget {
    fn from(one: &RadarTarget) -> OmnibusRadarTarget {
        OmnibusRadarTarget {
            detection: OmnibusRadarDetection {
                velocity_mps: one.velocity_mps,
                azimuth_rad: one.azimuth_rad,
                altitude_rad: one.altitude_rad,
                depth_m: one.depth_m,
                instance: one.label[0],
                tag: one.label[1],
            },
            power_dbm: one.power_dbm,
            snr_db: one.snr_db,
            cross_section_dbsm: one.cross_section_dbsm,
            is_ghost: one.is_ghost.into(),
        }
    }
}

/// Sets a receiver to that of a long-range radar of 77 GHz, which detects a car of 10 square metres up to
/// 280 m; cells of 0.4 m, 1.6 degrees and 0.1 m/s; no ghosts.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_radar_receiver(
    receiver: Option<&mut MaybeUninit<OmnibusRadarReceiver>>,
) -> OmnibusStatus {
    call("omnibus_radar_receiver", || {
        let usual = RadarReceiver::default();
        place(receiver, "receiver")?.write(OmnibusRadarReceiver {
            frequency_hz: usual.frequency_hz,
            transmit_power_dbm: usual.transmit_power_dbm,
            antenna_gain_db: usual.antenna_gain_db,
            noise_dbm: usual.noise_dbm,
            snr_min_db: usual.snr_min_db,
            cell: usual.cell,
            has_ghosts: usual.has_ghosts.into(),
        });
        Ok(())
    })
}

/// Mounts a radar: as omnibus_create_camera(). Its rays are those of a lidar: omnibus_data() has
/// OMNIBUS_OUTPUT_POINTS and OMNIBUS_OUTPUT_LABELS of its measurements.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_create_radar(
    client: Option<&OmnibusClient>,
    name: *const c_char,
    parent: u32,
    radar: Option<&OmnibusRadar>,
    bundle: Option<&mut MaybeUninit<Box<OmnibusBundle>>>,
) -> OmnibusStatus {
    call("omnibus_create_radar", || {
        let OmnibusRadar { pose, fov_rad, range_m, points, seed, held_max, receiver } =
            *radar.ok_or_else(|| Fault::null("radar"))?;
        let radar = Radar { fov_rad, range_m, points: points as usize, seed };
        radar.check().map_err(Fault::argument)?;
        let model = RadarModel { radar, receiver: receiver.checked()? };
        let sensor = Sensor::lidar(text(name, "name")?, pose.checked("pose")?, radar.lidar());
        create(client, parent, sensor, held_max, Some(model), bundle)
    })
}

/// Calls `work` with the radar of a measurement and the velocities of the actors at its frame.
fn with_met<T>(
    client: Option<&OmnibusClient>,
    measurement: Option<&OmnibusMeasurement>,
    work: impl FnOnce(
        &RadarModel,
        &client_lib::Measurement,
        &dyn Fn(ActorId) -> Vec3,
    ) -> Result<T, Fault>,
) -> Result<T, Fault> {
    let measurement = measurement.ok_or_else(|| Fault::null("measurement"))?;
    let model = measurement.radar.as_ref();
    let model = model.ok_or_else(|| Fault::argument("the measurement is not that of a radar"))?;
    let measured = &measurement.measured;
    let client = enter(client)?;
    let world = client.world();
    if world.header().stamp != measured.header().stamp {
        return Err(Fault::argument(format!(
            "the client has taken in frame {}, the measurement is of frame {}; take detections before \
             the next tick",
            world.frame().0,
            measured.frame().0
        )));
    }
    let velocity_of = |id: ActorId| world.state(id).map_or(Vec3::ZERO, |state| state.velocity());
    work(model, measured, &velocity_of)
}

fn nothing_measured() -> Fault {
    Fault::argument("the radar did not measure at this frame")
}

/// Writes up to `capacity` detections of a radar to `detections`, one for each of its random directions
/// that met something, and the number of all to `*count`; at most OmnibusRadar.points. The client must have
/// taken in the frame of the measurement, whose velocities are used. With a capacity of 0, `detections` may
/// be NULL.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_radar_detections(
    client: Option<&OmnibusClient>,
    measurement: Option<&OmnibusMeasurement>,
    detections: *mut MaybeUninit<OmnibusRadarDetection>,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> OmnibusStatus {
    call("omnibus_radar_detections", || {
        let place = place(count, "count")?;
        let found: Vec<_> = with_met(client, measurement, |model, measured, velocity_of| {
            let rays = model.radar.rays(measured, 0).ok_or_else(nothing_measured)?;
            let nanos = measured.header().stamp.sim_time_nanos;
            let carrier = measured.header().parent;
            let found = model.radar.detections(
                nanos,
                rays.plane,
                rays.points,
                rays.labels,
                velocity_of,
                carrier,
            );
            let detection = |(one, [instance, tag]): (client_lib::RadarDetection, [u32; 2])| {
                OmnibusRadarDetection {
                    velocity_mps: one.velocity_mps,
                    azimuth_rad: one.azimuth_rad,
                    altitude_rad: one.altitude_rad,
                    depth_m: one.depth_m,
                    instance,
                    tag,
                }
            };
            Ok(found.map(detection).collect())
        })?;
        fill(detections, "detections", capacity, &found)?;
        place.write(found.len());
        Ok(())
    })
}

/// Writes up to `capacity` cells that the receiver of a radar detected to `targets`, in the order of
/// distance, azimuth and range rate, ghosts last, and the number of all to `*count`. Otherwise as
/// omnibus_radar_detections().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_radar_targets(
    client: Option<&OmnibusClient>,
    measurement: Option<&OmnibusMeasurement>,
    targets: *mut MaybeUninit<OmnibusRadarTarget>,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> OmnibusStatus {
    call("omnibus_radar_targets", || {
        let place = place(count, "count")?;
        let found: Vec<_> = with_met(client, measurement, |model, measured, velocity_of| {
            let receiver = model.receiver.ok_or_else(|| {
                Fault::argument("the radar has no receiver; set it when the radar is created")
            })?;
            let rays = model.radar.rays(measured, 0).ok_or_else(nothing_measured)?;
            let found = receiver.targets(rays, velocity_of, measured.header().parent);
            Ok(found.iter().map(OmnibusRadarTarget::from).collect())
        })?;
        fill(targets, "targets", capacity, &found)?;
        place.write(found.len());
        Ok(())
    })
}
