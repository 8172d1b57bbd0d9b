use std::f64::consts::{PI, TAU};

use glam::{Affine3A, DVec2, Mat3, Quat, Vec3};
use protocol::{LidarSpec, Pose, SensorSpec, Stamp, lidar_flag, output, point_attribute, sensor};

use crate::lidar_echo::Echoes;
use crate::lidar_return::Receiver;

/// Lidar: `columns` azimuth steps of `channels` beams each, with unit directions.
///
/// Sines and cosines are computed here in double precision, so that every tracer casts identical
/// rays.
#[derive(Clone, Debug)]
pub(crate) struct Lidar {
    pub(crate) columns: u32,
    pub(crate) channels: u32,
    /// Position in world space.
    pub(crate) origin: Vec3,
    /// Rotation of `world_from_sensor`.
    pub(crate) axes: Mat3,
    /// Whether the beams of a column share an azimuth, and those of a channel an elevation. Without it
    /// each beam has both of its own.
    pub(crate) is_grid: bool,
    /// Cosine and sine of each column's azimuth; two zeros mean that the laser is off.
    pub(crate) azimuths: Vec<[f32; 2]>,
    /// Cosine and sine of each channel's elevation; channel 0 is the highest.
    pub(crate) elevations: Vec<[f32; 2]>,
    /// Origin and axes of each column, if the sensor moved during the sweep; else empty.
    pub(crate) places: Vec<Place>,
    /// Columns that a group of 16 beams spans, so that it is about as wide as high: 1, 2, 4, 8 or 16.
    pub(crate) group_columns: u32,
    pub(crate) receiver: Receiver,
    /// What a pulse meets besides the first surface on its axis; `None`: nothing.
    pub(crate) echoes: Option<Echoes>,
}

/// Position of the sensor and rotation of `world_from_sensor` at the time of a column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) origin: Vec3,
    pub(crate) axes: Mat3,
}

/// In place of an attenuation: points report the cosine of incidence instead of an intensity.
const COS_INCIDENCE: f32 = -1.0;

impl Lidar {
    pub(crate) fn new(spec: &SensorSpec, pose: &Pose, stamp: Stamp, delta_nanos: u64) -> Lidar {
        let sweep = Sweep::of(spec, stamp, delta_nanos);
        let last = f64::from(spec.height.max(2) - 1);
        let (upper, lower) = (f64::from(spec.upper_rad), f64::from(spec.lower_rad));
        let (azimuths, elevations) = if spec.lidar.has_prisms() {
            prism_beams(spec, stamp, delta_nanos)
        } else {
            let half_fov = f64::from(spec.fov_rad) / 2.0;
            let azimuths = (0..spec.width).map(|column| {
                let azimuth = sweep.first_rad + sweep.step_rad * f64::from(column);
                let from_ahead = (azimuth + PI).rem_euclid(TAU) - PI;
                if spec.rotation_rate_hz > 0.0 && from_ahead.abs() > half_fov {
                    return [0.0; 2];
                }
                [azimuth.cos() as f32, azimuth.sin() as f32]
            });
            let has_table = spec.lidar.has(lidar_flag::ELEVATIONS);
            let elevations = (0..spec.height).map(|channel| {
                let elevation = if has_table {
                    spec.lidar.elevation_rad(channel)
                } else {
                    upper + (lower - upper) * f64::from(channel) / last
                };
                [elevation.cos() as f32, elevation.sin() as f32]
            });
            (azimuths.collect(), elevations.collect())
        };
        let step_up_rad = ((upper - lower) / last).abs().max(1e-9);
        let ratio = (16.0 * step_up_rad / sweep.step_rad.abs().max(1e-9)).sqrt();
        let fit = ratio.log2().round().clamp(0.0, 4.0) as u32;
        Lidar {
            group_columns: (1 << fit).max(16u32.div_ceil(spec.height.next_power_of_two()).min(16)),
            columns: spec.width,
            channels: spec.height,
            origin: pose.position(),
            axes: Mat3::from_quat(pose.rotation()),
            is_grid: !spec.lidar.has_prisms(),
            azimuths,
            elevations,
            places: Vec::new(),
            receiver: Receiver {
                range_m: spec.range_m,
                attenuation_per_m: match spec.point_attribute {
                    point_attribute::COS_INCIDENCE => COS_INCIDENCE,
                    _ => spec.attenuation_per_m,
                },
                noise_m: spec.noise_m,
                dropoff: spec.dropoff,
                seed: noise_seed(spec.seed, stamp.sim_time_nanos),
            },
            echoes: None,
        }
    }

    /// Returns cosine and sine of the azimuth and of the elevation of a beam; `None` if the laser is
    /// off.
    #[inline(always)]
    pub(crate) fn angles(&self, column: u32, channel: u32) -> Option<[[f32; 2]; 2]> {
        let [azimuth, elevation] = if self.is_grid {
            [self.azimuths[column as usize], self.elevations[channel as usize]]
        } else {
            let beam = (column * self.channels + channel) as usize;
            [self.azimuths[beam], self.elevations[beam]]
        };
        (azimuth != [0.0; 2]).then_some([azimuth, elevation])
    }

    /// Returns position and axes at the time of a column.
    #[inline(always)]
    pub(crate) fn place(&self, column: u32) -> Place {
        let now = Place { origin: self.origin, axes: self.axes };
        self.places.get(column as usize).copied().unwrap_or(now)
    }

    /// Lets the columns of a sweep start where the sensor was at their times. `before_from_now` is the
    /// motion of its carrier in world space, back over `delta_nanos`; the carrier is assumed to move and
    /// turn evenly.
    pub(crate) fn follow(
        &mut self,
        spec: &SensorSpec,
        delta_nanos: u64,
        before_from_now: &Affine3A,
    ) {
        if delta_nanos == 0 {
            return;
        }
        let span_nanos = delta_nanos.max(spec.period_nanos) as f64;
        let back = before_from_now.transform_point3(self.origin) - self.origin;
        let turn = Quat::from_mat3a(&before_from_now.matrix3).normalize();
        let (axis, angle) = turn.to_axis_angle();
        let angle =
            if angle > std::f32::consts::PI { angle - std::f32::consts::TAU } else { angle };
        self.places = (0..self.columns)
            .map(|column| {
                let passed = (f64::from(column) + 0.5) / f64::from(self.columns.max(1));
                let frames = ((1.0 - passed) * span_nanos / delta_nanos as f64) as f32;
                Place {
                    origin: self.origin + back * frames,
                    axes: Mat3::from_axis_angle(axis, angle * frames) * self.axes,
                }
            })
            .collect();
        // The rays of a group have one place.
        self.group_columns = 1;
    }
}

/// Returns whether a tracer has to know the motion of the carrier of a sensor.
pub(crate) fn sweeps(spec: &SensorSpec) -> bool {
    spec.kind == sensor::LIDAR && spec.lidar.has(lidar_flag::SWEEP)
}

/// Returns whether pulses of a lidar have several echoes, or an echo of the air.
pub(crate) fn has_echoes(spec: &SensorSpec) -> bool {
    let LidarSpec { divergence_rad, .. } = spec.lidar;
    let has_last = spec.outputs & (output::LAST_POINTS | output::LAST_LABELS) != 0;
    divergence_rad > 0.0 || spec.lidar.has(lidar_flag::WEATHER) || has_last
}

/// Azimuths of the columns of a lidar in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sweep {
    /// Azimuth of column 0, positive to the left.
    first_rad: f64,
    /// Azimuth step from one column to the next, positive to the left.
    step_rad: f64,
}

impl Sweep {
    /// Returns the sweep of one frame. Without rotation, the columns share the field of view,
    /// symmetrically about straight ahead. With rotation, they share the angle that the lidar has
    /// turned since the last frame: the laser points straight ahead at simulated time 0 and turns
    /// to the left.
    fn of(spec: &SensorSpec, stamp: Stamp, delta_nanos: u64) -> Sweep {
        let columns = f64::from(spec.width.max(1));
        if spec.rotation_rate_hz > 0.0 {
            let rate_hz = f64::from(spec.rotation_rate_hz);
            let nanos = delta_nanos.max(spec.period_nanos);
            let step_rad = TAU * rate_hz * nanos as f64 * 1e-9 / columns;
            let begin_nanos = stamp.sim_time_nanos as i128 - i128::from(nanos);
            let begin_turns = (begin_nanos as f64 * 1e-9 * rate_hz).rem_euclid(1.0);
            Sweep { first_rad: TAU * begin_turns + step_rad / 2.0, step_rad }
        } else {
            let fov = f64::from(spec.fov_rad);
            let step_rad = fov / columns;
            Sweep { first_rad: (step_rad - fov) / 2.0, step_rad }
        }
    }
}

/// Returns cosine and sine of the azimuths and of the elevations of the beams of a Risley scanner.
///
/// Each prism turns the beam by a quarter of the field of view towards its own direction of rotation;
/// the deviations add as vectors, by the first-order formula of C. Schwarze, *A New Look at Risley
/// Prisms*, Photonics Spectra, June 2006: a rosette that does not repeat if the rates have no common
/// measure. Beams follow each other at equal times; at simulated time 0 both prisms turn it
/// to the left, and the next quarter of a positive turn is upwards.
fn prism_beams(
    spec: &SensorSpec,
    stamp: Stamp,
    delta_nanos: u64,
) -> (Vec<[f32; 2]>, Vec<[f32; 2]>) {
    let nanos = delta_nanos.max(spec.period_nanos);
    let begin_secs = (stamp.sim_time_nanos as i128 - i128::from(nanos)) as f64 * 1e-9;
    let beams = spec.width * spec.height;
    let step_secs = nanos as f64 * 1e-9 / f64::from(beams.max(1));
    let deviation_rad = f64::from(spec.fov_rad) / 4.0;
    let beam = |beam: u32| {
        let secs = begin_secs + step_secs * (f64::from(beam) + 0.5);
        let of_prism = |hz: f32| DVec2::from_angle(TAU * (secs * f64::from(hz)).rem_euclid(1.0));
        // To the left and upwards.
        let sum = spec.lidar.prism_hz.map(of_prism).into_iter().sum::<DVec2>() * deviation_rad;
        let angle = sum.length();
        let (sin, ahead) = angle.sin_cos();
        let aside = sum.normalize_or_zero() * sin;
        let level = ahead.hypot(aside.x);
        ([(ahead / level) as f32, (aside.x / level) as f32], [level as f32, aside.y as f32])
    };
    (0..beams).map(beam).unzip()
}

/// Returns the azimuth of column 0 of a lidar at this frame; 0 for other sensors, and for lidars without
/// columns of one azimuth.
pub(crate) fn first_azimuth_rad(spec: &SensorSpec, stamp: Stamp, delta_nanos: u64) -> f32 {
    match spec.kind {
        sensor::LIDAR if !spec.lidar.has_prisms() => {
            Sweep::of(spec, stamp, delta_nanos).first_rad as f32
        }
        _ => 0.0,
    }
}

/// Mixes the seed of a sensor with simulated time. Time begins at 0 in every episode, so that two
/// worlds with the same seeds have the same noise; the numbers of frames continue.
pub(crate) fn noise_seed(seed: u64, sim_time_nanos: u64) -> u32 {
    mesh::mix64(seed ^ sim_time_nanos.wrapping_mul(mesh::GOLDEN_GAMMA)) as u32
}
