//! A radar, made of the rays of a lidar and the velocities of what they hit.
//!
//! As in CARLA, each measurement draws random points in an elliptic cone, denser in its middle. The
//! rays are those of a grid that are nearest to these points.

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use mesh::RandomStream;
use protocol::{ActorId, Plane, Pose, SensorSpec, output};

use crate::{LidarOptions, Measurement, Sensor, radar_rays::RadarRays};

/// Angle between the rays of the grid: a quarter of a degree. Radians.
const STEP_RAD: f32 = 0.25 * TAU / 360.0;

/// Most directions of a measurement.
const POINTS_MAX: usize = 1_000_000;

/// The parameters of a radar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radar {
    /// Horizontal and vertical field of view, less than half a turn each. Radians.
    pub fov_rad: [f32; 2],
    /// The distance up to which it detects. Metres.
    pub range_m: f32,
    /// Directions that a measurement looks in; those that hit nothing give no detection.
    pub points: usize,
    /// Seed of the directions: each measurement has others, and each run the same ones.
    pub seed: u64,
}

/// What a radar detected in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RadarDetection {
    /// Range rate: how fast the distance grows, negative for what comes nearer. Metres per second.
    pub velocity_mps: f32,
    /// Angle from the x axis of sensor space in its xy plane, positive to the left. Radians.
    pub azimuth_rad: f32,
    /// Angle from the xy plane, positive upwards. Radians.
    pub altitude_rad: f32,
    /// Distance. Metres.
    pub depth_m: f32,
}

impl Radar {
    /// Checks that the fields of view are 1° to 170°, the range 1 m to 10 km, and the points at most a
    /// million.
    ///
    /// # Errors
    ///
    /// The first field that is out of range, and its limits.
    pub fn check(&self) -> Result<(), String> {
        let [horizontal, vertical] = self.fov_rad;
        for (what, value, least, most) in [
            ("horizontal field of view", horizontal, 0.0174, 2.968),
            ("vertical field of view", vertical, 0.0174, 2.968),
            ("range_m", self.range_m, 1.0, 1e4),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("{what} is {value}, not {least} to {most}"));
            }
        }
        if self.points > POINTS_MAX {
            return Err(format!("points are {}, more than {POINTS_MAX}", self.points));
        }
        Ok(())
    }

    /// Returns the parameters of the lidar that measures the grid of rays: those of [`Radar::grid`].
    pub fn lidar(&self) -> LidarOptions {
        let [horizontal, vertical] = self.fov_rad;
        let lines = |fov: f32| ((fov / STEP_RAD) as u32).clamp(16, 1024);
        let between = [-vertical / 2.0, vertical / 2.0];
        LidarOptions::new(lines(vertical), lines(horizontal), between, self.range_m)
            .fov_rad(horizontal)
    }

    /// Returns the lidar that measures the grid of rays.
    #[must_use]
    pub fn grid(&self, name: &str, parent_from_sensor: Pose) -> SensorSpec {
        SensorSpec::from(&Sensor::lidar(name, parent_from_sensor, self.lidar()))
    }

    /// Returns what the rays of sensor `sensor` of a bundle, a [`Radar::grid`], met; `None` if it did not
    /// measure.
    #[must_use]
    pub fn rays<'a>(&self, measured: &'a Measurement, sensor: usize) -> Option<RadarRays<'a>> {
        Some(RadarRays {
            plane: measured.plane(sensor, output::POINTS)?,
            fov_rad: self.fov_rad,
            points: measured.points(sensor)?,
            labels: measured.labels(sensor)?,
        })
    }

    /// Returns the detections of a measurement of [`Radar::grid`] at a simulated time: its plane of
    /// points, their x, y, z, and the id and tag of what each hit, which come with its detections.
    /// `velocity_of` gives the velocity of an actor in world space, and zero for ids that are none;
    /// `carrier` is the actor with the radar.
    pub fn detections<'a>(
        &'a self,
        time_nanos: u64,
        plane: &'a Plane,
        points: &'a [[f32; 4]],
        labels: &'a [[u32; 2]],
        velocity_of: impl Fn(ActorId) -> Vec3 + 'a,
        carrier: ActorId,
    ) -> impl Iterator<Item = (RadarDetection, [u32; 2])> + 'a {
        let own = velocity_of(carrier);
        let world_from_sensor = plane.world_from_sensor.rotation();
        let grid = [plane.width, plane.height];
        let state = self.seed.wrapping_mul(0xd134_2543_de82_ef95) ^ time_nanos;
        let mut random = RandomStream::from_state(state);
        (0..self.points).filter_map(move |_| {
            let [radius, turn] = [random.unit(), random.unit()];
            let ray = ray_nearest_to(radius, turn * TAU, self.fov_rad, grid);
            let ([x, y, z, _], label) = (*points.get(ray)?, *labels.get(ray)?);
            let to = Vec3::new(x, y, z);
            let depth_m = to.length();
            if depth_m == 0.0 {
                return None;
            }
            let direction = world_from_sensor * (to / depth_m);
            let detection = RadarDetection {
                velocity_mps: (velocity_of(ActorId(label[0])) - own).dot(direction),
                azimuth_rad: y.atan2(x),
                altitude_rad: (z / depth_m).clamp(-1.0, 1.0).asin(),
                depth_m,
            };
            Some((detection, label))
        })
    }
}

/// Returns the ray of a grid of columns and rows nearest to a point of the cone's section, where a
/// `radius` of 1 is the edge.
fn ray_nearest_to(
    radius: f32,
    turn_rad: f32,
    fov_rad: [f32; 2],
    [columns, rows]: [u32; 2],
) -> usize {
    let [half_h, half_v] = fov_rad.map(|fov| fov / 2.0);
    let left = half_h.tan() * radius * turn_rad.cos();
    let up = half_v.tan() * radius * turn_rad.sin();
    let azimuth = left.atan();
    let elevation = up.atan2((1.0 + left * left).sqrt());
    let column = ((azimuth / half_h + 1.0) / 2.0 * columns as f32) as u32;
    let row = ((1.0 - elevation / half_v) / 2.0 * (rows - 1) as f32).round() as u32;
    (column.min(columns - 1) * rows + row.min(rows - 1)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Converts a ray back to its direction by the formula of the lidar.
    #[test]
    fn the_ray_of_a_radar_lies_within_a_step_of_its_point() {
        let (fov_rad, grid) = ([0.6f32, 0.4], [137u32, 92]);
        let mut random = RandomStream::from_state(0xd134_2543_de82_ef95 ^ 2);
        let mut inner = 0;
        for _ in 0..4000 {
            let (radius, turn) = (random.unit(), random.unit() * TAU);
            let ray = ray_nearest_to(radius, turn, fov_rad, grid) as u32;
            let (column, row) = (ray / grid[1], ray % grid[1]);
            let azimuth = (column as f32 + 0.5) * fov_rad[0] / grid[0] as f32 - fov_rad[0] / 2.0;
            let elevation = fov_rad[1] / 2.0 - fov_rad[1] * row as f32 / (grid[1] - 1) as f32;
            let left = 0.3f32.tan() * radius * turn.cos();
            let up = 0.2f32.tan() * radius * turn.sin();
            assert!((azimuth.tan() - left).abs() < 0.004, "{azimuth} {left}");
            let height = elevation.tan() * (1.0 + left * left).sqrt();
            assert!((height - up).abs() < 0.004, "{elevation} {up}");
            inner += u32::from(radius < 0.5);
        }
        // Half of the points lie within a quarter of the section.
        assert!((1850..2150).contains(&inner), "{inner}");
    }

    #[test]
    fn the_grid_is_a_lidar_and_numbers_out_of_range_are_named() {
        let radar = Radar { fov_rad: [0.6, 0.2], range_m: 100.0, points: 500, seed: 3 };
        assert_eq!(radar.check(), Ok(()));
        let spec = radar.grid("radar", Pose::IDENTITY);
        assert_eq!((spec.width, spec.height, spec.fov_rad), (137, 45, 0.6));
        assert_eq!([spec.lower_rad, spec.upper_rad, spec.range_m], [-0.1, 0.1, 100.0]);
        for (wrong, said) in [
            (Radar { fov_rad: [0.6, 3.0], ..radar }, "vertical field of view is 3, not"),
            (Radar { fov_rad: [f32::NAN, 0.2], ..radar }, "horizontal field of view is NaN"),
            (Radar { range_m: 0.0, ..radar }, "range_m is 0, not 1 to 10000"),
            (Radar { points: 2_000_000, ..radar }, "points are 2000000, more than 1000000"),
        ] {
            let why = wrong.check().unwrap_err();
            assert!(why.contains(said), "{why}");
        }
    }

    /// Measures a wall across the road, 40 m ahead, of which the middle is the rear of a vehicle.
    #[test]
    fn range_rates_are_those_of_a_vehicle_ahead_and_of_a_wall_at_rest() {
        let radar = Radar { fov_rad: [0.6, 0.2], range_m: 100.0, points: 500, seed: 3 };
        let spec = radar.grid("radar", Pose::IDENTITY);
        let heading = 0.7f32;
        let (mut points, mut labels) = (Vec::new(), Vec::new());
        for column in 0..spec.width {
            for row in 0..spec.height {
                let azimuth = (column as f32 + 0.5) * 0.6 / spec.width as f32 - 0.3;
                let elevation = 0.1 - 0.2 * row as f32 / (spec.height - 1) as f32;
                let y = 40.0 * azimuth.tan();
                let z = 40.0 / azimuth.cos() * elevation.tan();
                points.push([40.0, y, z, 1.0]);
                labels.push(if y.abs() < 2.0 { [7, 14] } else { [0, 3] });
            }
        }
        let plane = Plane {
            width: spec.width,
            height: spec.height,
            world_from_sensor: Pose::level(Vec3::new(5.0, 6.0, 1.0), heading),
            ..Plane::default()
        };
        let forward = Vec3::new(heading.cos(), heading.sin(), 0.0);
        let velocity_of = |id: ActorId| match id.0 {
            1 => forward * 12.0,
            7 => forward * 9.0,
            _ => Vec3::ZERO,
        };
        let found: Vec<_> =
            radar.detections(5, &plane, &points, &labels, velocity_of, ActorId(1)).collect();
        assert_eq!(found.len(), 500, "every direction hits");
        let (mut vehicle, mut left) = (0, 0);
        for (one, [id, _]) in &found {
            let RadarDetection { velocity_mps, azimuth_rad, altitude_rad, depth_m } = *one;
            let cosine = azimuth_rad.cos() * altitude_rad.cos();
            assert!((depth_m * cosine - 40.0).abs() < 1e-3, "{one:?}");
            let is_vehicle = (40.0 * azimuth_rad.tan()).abs() < 2.0;
            assert_eq!(*id, if is_vehicle { 7 } else { 0 }, "{one:?}");
            let closing = if is_vehicle { 3.0 } else { 12.0 };
            assert!((velocity_mps + closing * cosine).abs() < 1e-3, "{one:?}");
            vehicle += u32::from(is_vehicle);
            left += u32::from(azimuth_rad > 0.0);
        }
        assert!((50..300).contains(&vehicle) && (200..300).contains(&left), "{vehicle} {left}");
        let again = radar.detections(6, &plane, &points, &labels, velocity_of, ActorId(1));
        assert!(again.zip(&found).any(|(a, b)| a != *b), "each measurement has its own directions");
    }
}
