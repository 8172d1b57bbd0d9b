//! Plane walls that mirror the beam of a radar.

use glam::Vec3;
use mesh::Tag;

use crate::radar_rays::RadarRays;

/// A plane in sensor space: `normal · p = offset_m`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wall {
    normal: Vec3,
    offset_m: f32,
    /// Rays that met it.
    rays: u32,
}

/// Most walls of a frame, the largest ones.
const WALLS_MAX: usize = 8;

/// Least number of rays on a wall.
const RAYS_MIN: u32 = 24;

/// Returns the upright planes of walls, buildings and guard rails that the rays met.
pub(crate) fn walls(rays: &RadarRays<'_>) -> Vec<Wall> {
    let rows = rays.plane.height as usize;
    let mut found: Vec<Wall> = Vec::new();
    let point = |ray: usize| {
        let is_wall = rays.labels.get(ray).is_some_and(|[_, tag]| mirrors(*tag));
        let [x, y, z, _] = *rays.points.get(ray)?;
        Some(Vec3::new(x, y, z)).filter(|_| is_wall)
    };
    for ray in 0..rays.points.len() {
        // A neighbour below and one to the left, which is one column on.
        if rows == 0 || ray % rows + 1 == rows {
            continue;
        }
        let (Some(at), Some(below), Some(left)) = (point(ray), point(ray + 1), point(ray + rows))
        else {
            continue;
        };
        let normal = (below - at).cross(left - at).normalize_or_zero();
        let normal = if normal.dot(at) > 0.0 { -normal } else { normal };
        if normal.z.abs() > 0.2 || normal == Vec3::ZERO {
            continue;
        }
        let same =
            |wall: &&mut Wall| wall.normal.dot(normal) > 0.996 && wall.distance(at).abs() < 0.2;
        match found.iter_mut().find(same) {
            Some(wall) => wall.rays += 1,
            None => found.push(Wall { normal, offset_m: normal.dot(at), rays: 1 }),
        }
    }
    found.retain(|wall| wall.rays >= RAYS_MIN);
    found.sort_by_key(|wall| std::cmp::Reverse(wall.rays));
    found.truncate(WALLS_MAX);
    found
}

fn mirrors(tag: u32) -> bool {
    [Tag::Building, Tag::Wall, Tag::GuardRail, Tag::Bridge].iter().any(|one| *one as u32 == tag)
}

impl Wall {
    /// Returns the distance of a point, positive on the side of the radar, metres.
    pub(crate) fn distance(&self, at: Vec3) -> f32 {
        self.normal.dot(at) - self.offset_m
    }

    /// Returns the mirror image of a point; `None` if it is not on the side of the radar.
    pub(crate) fn mirrored(&self, at: Vec3) -> Option<Vec3> {
        let distance_m = self.distance(at);
        (distance_m > 0.0).then(|| at - self.normal * (2.0 * distance_m))
    }

    /// Returns the mirror image of a direction.
    pub(crate) fn turned(&self, direction: Vec3) -> Vec3 {
        direction - self.normal * (2.0 * self.normal.dot(direction))
    }
}
