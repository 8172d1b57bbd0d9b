//! Receiver of a radar: the power of each echo by the radar equation, cells of a device's resolution,
//! and ghosts behind walls. The rays are those of [`Radar::grid`](crate::Radar::grid).

use std::{collections::BTreeMap, f32::consts::PI};

use glam::Vec3;
use mesh::Tag;
use protocol::ActorId;

use crate::{
    radar_rays::RadarRays,
    radar_walls::{Wall, walls},
};

/// Receiver of a radar, which adds up what the rays of [`Radar::grid`](crate::Radar::grid) met.
///
/// Each ray stands for the part of a surface that it covers, of area `d² · Ω`, whose cross-section is that
/// area times a number by its semantic tag. The received power is that of the radar equation
/// (M. Skolnik, *Introduction to Radar Systems*, 3rd edition, section 1.2):
///
/// ```text
/// P = P_t · G² · λ² · σ / ((4π)³ · d⁴)
/// ```
///
/// Powers of the rays in a cell of distance, azimuth and range rate add up, and a cell is detected if its
/// power is above the noise by the threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarReceiver {
    /// Carrier frequency, hertz.
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
    /// Whether walls that mirror the beam show ghosts of actors behind them.
    pub has_ghosts: bool,
}

impl Default for RadarReceiver {
    /// A long-range radar of 77 GHz: a car of 10 m² is detected up to 280 m; cells of 0.4 m, 1.6° and
    /// 0.1 m/s; no ghosts.
    fn default() -> RadarReceiver {
        RadarReceiver {
            frequency_hz: 77e9,
            transmit_power_dbm: 12.0,
            antenna_gain_db: 25.0,
            noise_dbm: -120.0,
            snr_min_db: 13.0,
            cell: [0.4, 0.028, 0.1],
            has_ghosts: false,
        }
    }
}

/// A cell that a radar detected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RadarTarget {
    /// Distance of its mean by power, metres.
    pub depth_m: f32,
    /// Angle from the x axis of sensor space in its xy plane, positive to the left, radians.
    pub azimuth_rad: f32,
    /// Angle from the xy plane, positive upwards, radians.
    pub altitude_rad: f32,
    /// Range rate, negative for what comes nearer, metres per second.
    pub velocity_mps: f32,
    /// Received power, decibels above a milliwatt.
    pub power_dbm: f32,
    /// Ratio of signal to noise, decibels.
    pub snr_db: f32,
    /// Cross-section, decibels above a square metre.
    pub cross_section_dbsm: f32,
    /// Instance and tag of the strongest part.
    pub label: [u32; 2],
    /// Whether a wall mirrored it.
    pub is_ghost: bool,
}

/// Sums of one cell.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    /// Milliwatts.
    power: f32,
    /// Of positions in sensor space and range rates, by power.
    moment: Vec3,
    rate_moment: f32,
    /// Of the strongest ray.
    strongest: f32,
    label: [u32; 2],
}

/// Decibels that a wall takes from a wave that it mirrors.
const MIRROR_LOSS_DB: f32 = 6.0;

impl RadarReceiver {
    /// Checks that the numbers are finite, and the frequency and the size of a cell above 0.
    ///
    /// # Errors
    ///
    /// The first field that is out of range, and its limits.
    pub fn check(&self) -> Result<(), String> {
        let [cell_m, cell_rad, cell_mps] = self.cell;
        for (what, value, least, most) in [
            ("frequency_hz", self.frequency_hz, 1e9, 1e12),
            ("transmit_power_dbm", self.transmit_power_dbm, -200.0, 200.0),
            ("antenna_gain_db", self.antenna_gain_db, -100.0, 100.0),
            ("noise_dbm", self.noise_dbm, -300.0, 200.0),
            ("snr_min_db", self.snr_min_db, -100.0, 300.0),
            ("distance of a cell", cell_m, 0.01, 1000.0),
            ("azimuth of a cell", cell_rad, 1e-4, 3.2),
            ("range rate of a cell", cell_mps, 0.001, 1000.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("{what} is {value}, not {least} to {most}"));
            }
        }
        Ok(())
    }

    /// Returns the detections of a frame, in the order of distance, azimuth and range rate; ghosts come
    /// last. `velocity_of` gives the velocity of an actor in world space, and zero for ids that are none;
    /// `carrier` is the actor with the radar, whose own body has no echo.
    #[must_use]
    pub fn targets(
        &self,
        rays: RadarRays<'_>,
        velocity_of: impl Fn(ActorId) -> Vec3,
        carrier: ActorId,
    ) -> Vec<RadarTarget> {
        let sensor_from_world = rays.plane.world_from_sensor.rotation().inverse();
        let own = sensor_from_world * velocity_of(carrier);
        let velocity = |label: [u32; 2]| sensor_from_world * velocity_of(ActorId(label[0]));
        let [columns, rows] = [rays.plane.width.max(1), rays.plane.height.max(2)];
        let per_ray = rays.fov_rad[0] / columns as f32 * rays.fov_rad[1] / (rows - 1) as f32;
        let mut cells: BTreeMap<[i32; 3], Cell> = BTreeMap::new();
        for ([x, y, z, _], label) in rays.points.iter().zip(rays.labels) {
            let to = Vec3::new(*x, *y, *z);
            let depth_m = to.length();
            let is_own = carrier != ActorId::NONE && label[0] == carrier.0;
            if depth_m == 0.0 || is_own {
                continue;
            }
            let level = x.hypot(*y) / depth_m;
            let area_m2 = depth_m * depth_m * per_ray * level;
            let power = self.received(depth_m, area_m2 * decibels(reflectivity_db(label[1])));
            let rate = (velocity(*label) - own).dot(to / depth_m);
            let cell = cells.entry(self.cell_of(to, rate)).or_default();
            cell.power += power;
            cell.moment += to * power;
            cell.rate_moment += rate * power;
            if power > cell.strongest {
                (cell.strongest, cell.label) = (power, *label);
            }
        }
        let mut found: Vec<RadarTarget> =
            cells.values().filter_map(|cell| self.target(cell, false)).collect();
        if self.has_ghosts {
            let walls = walls(&rays);
            let ghosts: Vec<RadarTarget> = cells
                .values()
                .filter(|cell| is_actor(cell.label))
                .flat_map(|cell| walls.iter().map(move |wall| (cell, wall)))
                .filter_map(|(cell, wall)| self.ghost(cell, wall, &rays, velocity(cell.label), own))
                .collect();
            found.extend(ghosts);
        }
        found
    }

    /// Returns the power received from a cross-section at a distance, milliwatts.
    #[must_use]
    pub fn received(&self, depth_m: f32, cross_section_m2: f32) -> f32 {
        let wave_m = 299_792_458.0 / self.frequency_hz;
        let sent = decibels(self.transmit_power_dbm + 2.0 * self.antenna_gain_db);
        sent * wave_m * wave_m * cross_section_m2 / ((4.0 * PI).powi(3) * depth_m.powi(4))
    }

    fn cell_of(&self, at: Vec3, rate: f32) -> [i32; 3] {
        let numbers = [at.length(), at.y.atan2(at.x), rate];
        std::array::from_fn(|axis| (numbers[axis] / self.cell[axis].max(1e-6)).floor() as i32)
    }

    /// Returns a detection; `None` if the power of the cell is below the threshold.
    fn target(&self, cell: &Cell, is_ghost: bool) -> Option<RadarTarget> {
        let power_dbm = 10.0 * cell.power.log10();
        let snr_db = power_dbm - self.noise_dbm;
        if cell.power <= 0.0 || snr_db < self.snr_min_db {
            return None;
        }
        let at = cell.moment / cell.power;
        let depth_m = at.length();
        Some(RadarTarget {
            depth_m,
            azimuth_rad: at.y.atan2(at.x),
            altitude_rad: (at.z / depth_m).clamp(-1.0, 1.0).asin(),
            velocity_mps: cell.rate_moment / cell.power,
            power_dbm,
            snr_db,
            cross_section_dbsm: 10.0 * (cell.power / self.received(depth_m, 1.0)).log10(),
            label: cell.label,
            is_ghost,
        })
    }

    /// Returns the ghost of an actor's cell behind a wall: the wave is mirrored there and back, so that
    /// the echo comes from the mirror image of the actor. `None` if the radar does not see the wall in
    /// that direction, or the echo is too weak.
    fn ghost(
        &self,
        cell: &Cell,
        wall: &Wall,
        rays: &RadarRays<'_>,
        velocity: Vec3,
        own: Vec3,
    ) -> Option<RadarTarget> {
        let at = cell.moment / cell.power;
        let image = wall.mirrored(at)?;
        let direction = image.normalize_or_zero();
        let seen = rays.nearest(direction)?;
        // The ray in the direction of the image ends at this wall, in front of the image.
        let is_mirrored = wall.distance(seen).abs() < 0.3 && seen.length() < image.length();
        if !is_mirrored {
            return None;
        }
        let depth_m = image.length();
        let loss = decibels(-2.0 * MIRROR_LOSS_DB) * (at.length() / depth_m).powi(4);
        let power = cell.power * loss;
        let rate = (wall.turned(velocity) - own).dot(direction);
        let image = Cell {
            power,
            moment: image * power,
            rate_moment: rate * power,
            label: cell.label,
            ..*cell
        };
        self.target(&image, true)
    }
}

fn decibels(db: f32) -> f32 {
    10f32.powf(db / 10.0)
}

/// Returns whether a label is that of an actor, and not of the town.
fn is_actor([id, _]: [u32; 2]) -> bool {
    id != 0 && id < 1 << 31
}

/// Returns the cross-section per square metre of the projected area of what has a tag, decibels.
///
/// The areas are those of the rear: 10 m² of a car on 2.7 m², 100 m² of a truck on 8.8 m², 3 m² of a
/// motorcycle and 1 m² of a bicycle with riders on about 0.8 m², 0.4 m² of a pedestrian on 0.6 m². Roads
/// and soil scatter little of a flat beam back.
fn reflectivity_db(tag: u32) -> f32 {
    const VEHICLE: u32 = Tag::Car as u32;
    const TRUCK: u32 = Tag::Truck as u32;
    const BUS: u32 = Tag::Bus as u32;
    const TRAIN: u32 = Tag::Train as u32;
    const MOTORCYCLE: u32 = Tag::Motorcycle as u32;
    const BICYCLE: u32 = Tag::Bicycle as u32;
    const PEDESTRIAN: u32 = Tag::Pedestrian as u32;
    const RIDER: u32 = Tag::Rider as u32;
    const GUARD_RAIL: u32 = Tag::GuardRail as u32;
    const POLE: u32 = Tag::Pole as u32;
    const SIGN: u32 = Tag::TrafficSign as u32;
    const BUILDING: u32 = Tag::Building as u32;
    const WALL: u32 = Tag::Wall as u32;
    const BRIDGE: u32 = Tag::Bridge as u32;
    const ROADS: u32 = Tag::Roads as u32;
    const ROAD_LINE: u32 = Tag::RoadLine as u32;
    const SIDE_WALKS: u32 = Tag::SideWalks as u32;
    const GROUND: u32 = Tag::Ground as u32;
    const TERRAIN: u32 = Tag::Terrain as u32;
    const WATER: u32 = Tag::Water as u32;
    match tag {
        VEHICLE => 5.7,
        TRUCK | BUS | TRAIN => 10.6,
        MOTORCYCLE => 5.7,
        BICYCLE => 1.0,
        PEDESTRIAN | RIDER => -1.8,
        GUARD_RAIL | POLE | SIGN => 3.0,
        BUILDING | WALL | BRIDGE => 0.0,
        ROADS | ROAD_LINE | SIDE_WALKS | GROUND | WATER => -30.0,
        TERRAIN => -25.0,
        _ => -10.0,
    }
}

#[cfg(test)]
mod tests {
    use protocol::{Plane, Pose};

    use super::*;

    const CAR: [u32; 2] = [7, Tag::Car as u32];
    const WALL: [u32; 2] = [0x8000_0003, Tag::Wall as u32];

    /// Distance along a direction.
    type Surface<'a> = &'a dyn Fn(Vec3) -> Option<f32>;

    /// Points and labels of a grid of rays.
    struct Frame {
        plane: Plane,
        fov_rad: [f32; 2],
        points: Vec<[f32; 4]>,
        labels: Vec<[u32; 2]>,
    }

    impl Frame {
        /// Traces a grid against surfaces that give the distance along a direction, the nearest of which
        /// is met.
        fn trace(
            fov_rad: [f32; 2],
            [width, height]: [u32; 2],
            surfaces: &[(Surface<'_>, [u32; 2])],
        ) -> Frame {
            let plane =
                Plane { width, height, world_from_sensor: Pose::IDENTITY, ..Plane::default() };
            let (mut points, mut labels) = (Vec::new(), Vec::new());
            for column in 0..width {
                for row in 0..height {
                    let azimuth = ((column as f32 + 0.5) / width as f32 - 0.5) * fov_rad[0];
                    let elevation = (0.5 - row as f32 / (height - 1) as f32) * fov_rad[1];
                    let level = elevation.cos();
                    let direction =
                        Vec3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin());
                    let met = surfaces
                        .iter()
                        .filter_map(|(surface, label)| Some((surface(direction)?, *label)));
                    let nearest = met.min_by(|a, b| a.0.total_cmp(&b.0));
                    let (t, label) = nearest.unwrap_or((0.0, [0; 2]));
                    let at = direction * t;
                    points.push([at.x, at.y, at.z, 1.0]);
                    labels.push(label);
                }
            }
            Frame { plane, fov_rad, points, labels }
        }

        fn rays(&self) -> RadarRays<'_> {
            let Frame { plane, fov_rad, points, labels } = self;
            RadarRays { plane, fov_rad: *fov_rad, points, labels }
        }
    }

    /// The rear of a car: 2 m by 1.5 m, at a distance ahead and to the left.
    fn rear(x: f32, y: f32) -> impl Fn(Vec3) -> Option<f32> {
        move |direction: Vec3| {
            let at = direction * (x / direction.x);
            ((at.y - y).abs() < 1.0 && at.z.abs() < 0.75).then_some(at.length())
        }
    }

    fn detected(x: f32) -> Vec<RadarTarget> {
        let car = rear(x, 3.0);
        let frame = Frame::trace([0.5, 0.1], [1600, 401], &[(&car, CAR)]);
        let still = |_| Vec3::ZERO;
        RadarReceiver::default().targets(frame.rays(), still, ActorId(1))
    }

    #[test]
    fn power_falls_with_the_fourth_power_of_the_distance() {
        let receiver = RadarReceiver::default();
        // 12 dBm + 2 · 25 dB + 20 lg 3.893 mm + 10 dB − 30 lg 4π − 40 lg 100.
        let dbm = 10.0 * receiver.received(100.0, 10.0).log10();
        assert!((dbm + 89.17).abs() < 0.02, "{dbm}");
        // The same car at twice the distance: a quarter of the rays, each for four times the area.
        let power = |found: &[RadarTarget]| -> f32 {
            found.iter().map(|one| decibels(one.power_dbm)).sum()
        };
        let [near, far] = [20.0, 40.0].map(detected);
        let ratio = power(&near) / power(&far);
        // Distances are those along the beam.
        let expected = ((1600f32 + 9.0) / (400.0 + 9.0)).powi(2);
        assert!((ratio / expected - 1.0).abs() < 0.04, "{ratio} {expected}");
        let area: f32 = far.iter().map(|one| decibels(one.cross_section_dbsm)).sum();
        assert!((area / (3.0 * decibels(5.7)) - 1.0).abs() < 0.04, "{area} m2");
        assert!(far.iter().all(|one| one.label == CAR && !one.is_ghost));
    }

    #[test]
    fn numbers_of_a_receiver_out_of_range_are_named() {
        let usual = RadarReceiver::default();
        assert_eq!(usual.check(), Ok(()));
        for (wrong, said) in [
            (RadarReceiver { frequency_hz: 0.0, ..usual }, "frequency_hz is 0, not"),
            (RadarReceiver { noise_dbm: f32::NAN, ..usual }, "noise_dbm is NaN"),
            (RadarReceiver { cell: [0.4, 0.0, 0.1], ..usual }, "azimuth of a cell is 0, not"),
        ] {
            let why = wrong.check().unwrap_err();
            assert!(why.contains(said), "{why}");
        }
    }

    #[test]
    fn what_is_too_far_away_is_not_detected() {
        assert!(!detected(200.0).is_empty());
        assert!(detected(330.0).is_empty());
        for one in detected(100.0) {
            assert!((one.depth_m - 100.05).abs() < 0.1 && one.snr_db >= 13.0, "{one:?}");
            assert!((one.snr_db - (one.power_dbm + 120.0)).abs() < 1e-3);
        }
    }

    #[test]
    fn a_ghost_lies_at_the_mirrored_position_and_moves_with_the_mirrored_velocity() {
        let car = rear(30.0, -2.0);
        // A wall on the left, along the way.
        let wall = |direction: Vec3| {
            let t = 6.0 / direction.y;
            (direction.y > 1e-3 && direction.x * t < 60.0).then_some(t)
        };
        let frame = Frame::trace([1.4, 0.2], [800, 81], &[(&car, CAR), (&wall, WALL)]);
        let velocity_of = |id: ActorId| match id.0 {
            1 => Vec3::new(10.0, 0.0, 0.0),
            7 => Vec3::new(6.0, 2.0, 0.0),
            _ => Vec3::ZERO,
        };
        let receiver = RadarReceiver { has_ghosts: true, ..RadarReceiver::default() };
        let found = receiver.targets(frame.rays(), velocity_of, ActorId(1));
        let strongest = |is_ghost: bool| {
            let those = found.iter().filter(|one| one.is_ghost == is_ghost && one.label == CAR);
            *those.max_by(|a, b| a.power_dbm.total_cmp(&b.power_dbm)).unwrap()
        };
        let (real, ghost) = (strongest(false), strongest(true));
        let at = |one: &RadarTarget| {
            Vec3::new(one.azimuth_rad.cos(), one.azimuth_rad.sin(), 0.0)
                * one.depth_m
                * one.altitude_rad.cos()
        };
        let mirrored = Vec3::new(at(&real).x, 12.0 - at(&real).y, 0.0);
        assert!(at(&ghost).distance(mirrored) < 0.05, "{ghost:?} {mirrored}");
        // Relative to the radar the car moves by (−4, 2), its image by (−4, −2).
        let rate = Vec3::new(-4.0, -2.0, 0.0).dot(mirrored.normalize_or_zero());
        assert!((ghost.velocity_mps - rate).abs() < 0.02, "{ghost:?} {rate}");
        let loss = 2.0 * MIRROR_LOSS_DB + 40.0 * (ghost.depth_m / real.depth_m).log10();
        assert!((real.power_dbm - ghost.power_dbm - loss).abs() < 0.05, "{loss}");
        let plain = RadarReceiver::default().targets(frame.rays(), velocity_of, ActorId(1));
        assert!(plain.iter().all(|one| !one.is_ghost));
        assert_eq!(plain[..], found[..plain.len()]);
        // Nothing lies behind the part of the wall that the radar does not see.
        let short = |direction: Vec3| wall(direction).filter(|t| direction.x * t < 11.0);
        let frame = Frame::trace([1.4, 0.2], [800, 81], &[(&car, CAR), (&short, WALL)]);
        let found = receiver.targets(frame.rays(), velocity_of, ActorId(1));
        assert!(found.iter().all(|one| !one.is_ghost));
    }
}
