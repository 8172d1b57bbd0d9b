//! Boxes that block walkers and may knock them down, found by place.

use glam::{Mat3, Vec2, Vec3};

use super::walker_model::WalkerModel;

/// Width of the stripes along x that obstacles are sorted into.
const STRIPE_M: f32 = 16.0;
/// Covers the rounding of the distances that are compared.
const SLACK_M: f32 = 0.01;

/// A box that blocks walkers and may knock them down.
pub(super) struct Obstacle {
    /// The id of the actor.
    pub actor: u32,
    pub center_m: Vec3,
    /// `world_from_box`, rotation only.
    pub axes: Mat3,
    pub half_m: Vec3,
    pub velocity_mps: Vec3,
}

impl Obstacle {
    /// Whether the box cannot touch a walker after `way_m` of relative motion: a cheap test.
    pub(super) fn is_far(&self, middle_m: Vec3, model: &WalkerModel, way_m: f32) -> bool {
        let near_m = self.half_m.length() + model.height_m + way_m;
        (middle_m - self.center_m).length_squared() > near_m * near_m
    }

    /// Returns the distance from the box to the side of a walker, negative inside, and the
    /// direction from the box to the walker in world space.
    pub(super) fn gap(&self, middle_m: Vec3, model: &WalkerModel) -> (f32, Vec3) {
        let local = self.axes.transpose() * (middle_m - self.center_m);
        if local.z.abs() > self.half_m.z + model.height_m / 2.0 {
            return (f32::MAX, Vec3::ZERO);
        }
        let beyond = Vec2::new(local.x.abs(), local.y.abs()) - self.half_m.truncate();
        let outside = beyond.max(Vec2::ZERO);
        let gap = outside.length() + beyond.max_element().min(0.0) - model.radius_m;
        let sign = Vec2::new(local.x.signum(), local.y.signum());
        let direction = if outside == Vec2::ZERO {
            if beyond.x > beyond.y { Vec2::X } else { Vec2::Y }
        } else {
            outside.normalize_or_zero()
        };
        (gap, self.axes * (direction * sign).extend(0.0))
    }
}

/// The obstacles of one substep.
#[derive(Default)]
pub(super) struct Obstacles {
    all: Vec<Obstacle>,
    /// Stripe and x of the centre of each, and its number; sorted.
    places: Vec<(i32, f32, usize)>,
    /// Largest distance from the centre of an obstacle at which it may touch something within the substep.
    reach_m: f32,
}

impl Obstacles {
    /// Sorts the obstacles of a substep of `dt` seconds.
    pub(super) fn new(all: Vec<Obstacle>, dt: f32) -> Obstacles {
        let reach =
            |obstacle: &Obstacle| obstacle.half_m.length() + obstacle.velocity_mps.length() * dt;
        let reach_m = all.iter().map(reach).fold(0.0, f32::max);
        let place = |(number, obstacle): (usize, &Obstacle)| {
            (stripe(obstacle.center_m.y), obstacle.center_m.x, number)
        };
        let mut places: Vec<_> = all.iter().enumerate().map(place).collect();
        places.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        Obstacles { all, places, reach_m }
    }

    /// Returns the obstacles, in the order of the actors, that may come within `reach_m` of a point during the
    /// substep, and others.
    pub(super) fn near(&self, point_m: Vec3, reach_m: f32) -> Vec<&Obstacle> {
        let reach_m = self.reach_m + reach_m + SLACK_M;
        let (low, high) = (point_m - reach_m, point_m + reach_m);
        let mut numbers = Vec::new();
        let mut places = self.places.as_slice();
        places = &places[places.partition_point(|place| place.0 < stripe(low.y))..];
        while let Some(&(stripe, ..)) = places.first().filter(|place| place.0 <= stripe(high.y)) {
            let begin = places.partition_point(|place| (place.0, place.1) < (stripe, low.x));
            let end = places.partition_point(|place| (place.0, place.1) <= (stripe, high.x));
            numbers.extend(places[begin..end].iter().map(|place| place.2));
            places = &places[places.partition_point(|place| place.0 == stripe)..];
        }
        numbers.sort_unstable();
        numbers.into_iter().map(|number| &self.all[number]).collect()
    }
}

fn stripe(y: f32) -> i32 {
    (y / STRIPE_M).floor() as i32
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Vec3};
    use mesh::RandomStream;

    use super::{Obstacle, Obstacles};

    /// Those that are near are found, in their order, and few others.
    #[test]
    fn every_near_obstacle_is_found() {
        let mut random = RandomStream::from_state(7);
        let mut within = |low: f32, high: f32| random.between(low, high);
        let dt = 0.02;
        let all: Vec<Obstacle> = (0..2000)
            .map(|actor| Obstacle {
                actor,
                center_m: Vec3::new(within(-400.0, 400.0), within(-300.0, 300.0), within(0.0, 8.0)),
                axes: Mat3::IDENTITY,
                half_m: Vec3::new(within(0.3, 6.0), within(0.3, 1.3), within(0.5, 2.0)),
                velocity_mps: Vec3::new(within(-40.0, 40.0), within(-40.0, 40.0), 0.0),
            })
            .collect();
        let points: Vec<Vec3> = (0..300)
            .map(|_| Vec3::new(within(-420.0, 420.0), within(-320.0, 320.0), 1.0))
            .collect();
        let expected = |point: Vec3| -> Vec<u32> {
            let is_near = |o: &&Obstacle| {
                o.center_m.distance(point) <= o.half_m.length() + o.velocity_mps.length() * dt + 1.8
            };
            all.iter().filter(is_near).map(|o| o.actor).collect()
        };
        let expected: Vec<_> = points.iter().map(|point| expected(*point)).collect();
        let (mut found, mut near) = (0, 0);
        let obstacles = Obstacles::new(all, dt);
        for (point, expected) in points.iter().zip(expected) {
            let all_found: Vec<u32> = obstacles.near(*point, 1.8).iter().map(|o| o.actor).collect();
            assert!(all_found.is_sorted());
            assert!(expected.iter().all(|actor| all_found.contains(actor)), "{point}");
            found += all_found.len();
            near += expected.len();
        }
        assert!(near > 50 && found < 300 * 2000 / 100, "{found} found for {near}");
    }

    #[test]
    fn nothing_is_near_where_there_is_nothing() {
        assert!(Obstacles::default().near(Vec3::ZERO, 2.0).is_empty());
    }
}
