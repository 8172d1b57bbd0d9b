//! Vehicles and their spawn points, chosen by the seed.

use mesh::RandomStream;
use protocol::{Name, Pose, Spawn, flag};

/// The blueprint of the ego.
pub(crate) const EGO: &str = "vehicle.tesla.model3";

/// Returns the spawn points in the order in which vehicles take them, for a run without a host.
pub(crate) fn places(network: &road::Network, seed: u64) -> Vec<Pose> {
    let mut places = shuffled(client_lib::spawn_poses(network), seed);
    places.reverse();
    places
}

/// Returns the points in an order by the seed.
pub(crate) fn shuffled(mut points: Vec<Pose>, seed: u64) -> Vec<Pose> {
    let mut random = RandomStream::from_state(seed);
    for last in (1..points.len()).rev() {
        points.swap(last, random.below(last + 1));
    }
    points
}

/// Returns one of the other vehicles: mostly cars, in common paints.
pub(crate) fn vehicle(pose: Pose, random: &mut RandomStream) -> Spawn {
    let kind = match random.below(100) {
        0..86 => &["car", "van"][..],
        86..94 => &["truck", "bus"],
        _ => &["motorcycle", "bicycle"],
    };
    let choice: Vec<_> = town::catalogue().iter().filter(|b| kind.contains(&b.base_type)).collect();
    let blueprint = random.choose(&choice);
    vehicle_of(blueprint, pose, random)
}

/// Returns a vehicle of this model, in a common paint.
pub(crate) fn vehicle_of(
    blueprint: &town::Blueprint,
    pose: Pose,
    random: &mut RandomStream,
) -> Spawn {
    let paint = blueprint.random_paint(random);
    let color = paint.map_or(0, |[r, g, b]| u32::from_le_bytes([r, g, b, 255]));
    Spawn {
        blueprint: Name::new(blueprint.id),
        flags: flag::AUTOPILOT,
        pose,
        color,
        role: Name::new("autopilot"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn points() -> Vec<Pose> {
        (0..40).map(|x| Pose::level(Vec3::new(x as f32, 0.0, 0.0), 0.0)).collect()
    }

    #[test]
    fn the_seed_decides_the_order_of_spawn_points() {
        let once = shuffled(points(), 7);
        assert_eq!(once, shuffled(points(), 7));
        assert_ne!(once, shuffled(points(), 8));
        let mut xs: Vec<_> = once.iter().map(|p| p.position_m[0] as u32).collect();
        assert_ne!(xs, (0..40).collect::<Vec<_>>());
        xs.sort();
        assert_eq!(xs, (0..40).collect::<Vec<_>>(), "each place once");
    }

    #[test]
    fn most_vehicles_are_cars_of_many_kinds_and_paints() {
        let mut random = RandomStream::from_state(1);
        let all: Vec<_> = (0..1000).map(|_| vehicle(Pose::IDENTITY, &mut random)).collect();
        let base = |s: &Spawn| town::blueprint(s.blueprint.as_str()).unwrap().1.base_type;
        let cars = all.iter().filter(|s| matches!(base(s), "car" | "van")).count();
        assert!((820..900).contains(&cars), "{cars}");
        let mut kinds: Vec<_> = all.iter().map(|s| s.blueprint).collect();
        kinds.sort();
        kinds.dedup();
        assert!(kinds.len() > 30, "{}", kinds.len());
        let police = all.iter().find(|s| s.blueprint.as_str().contains("police")).unwrap();
        assert_eq!(police.color, 0, "it keeps its livery");
    }
}
