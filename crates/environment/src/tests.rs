use std::{f32::consts::TAU, sync::Arc};

use glam::{Vec2, Vec3};
use mesh::RandomStream;
use road::Network;

use crate::{
    lidar::{BoxGrid, Lidar, UprightBox, entry},
    *,
};

fn map() -> Arc<EnvironmentMap> {
    let text = mapgen::default_map().1;
    let network = Arc::new(Network::parse(&text).unwrap());
    let town = town::furnish(&network, 3);
    Arc::new(EnvironmentMap::new(network, &town, 3))
}

/// Follows the point of the route 6 m ahead at 5 m/s.
fn follow(environment: &Environment) -> [f32; 2] {
    let state = environment.state();
    let (x, y) = (state[10], state[11]);
    let speed_mps = state[0] * 30.0;
    [(2.0 * y.atan2(x)).clamp(-1.0, 1.0), (0.5 * (5.0 - speed_mps)).clamp(-1.0, 1.0)]
}

#[test]
fn a_follower_of_the_route_arrives_and_its_progress_is_the_length() {
    let config = Config { vehicles: 0, route_m: 120.0, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    let (begin_m, length_m) = environment.progress_m();
    for seed in 1..6 {
        environment.reset(seed).unwrap();
        let (mut progress, mut speed) = (0.0, 0.0f32);
        let ending = loop {
            let step = environment.step(follow(&environment)).unwrap();
            speed = speed.max(environment.state()[0] * 30.0);
            progress += step.reward;
            if step.ending.is_some() {
                break step.ending;
            }
        };
        assert_eq!(ending, Some(Ending::Arrival), "seed {seed}: {:?}", environment.progress_m());
        // Progress, at most 0.1 for the speed of each step, and the arrival.
        let most = length_m + 10.0 + 0.1 * 1000.0;
        assert!((length_m - begin_m + 8.0..most).contains(&progress), "{progress}");
        assert!((4.0..6.0).contains(&speed), "{speed}");
    }
}

#[test]
fn full_throttle_ends_beside_the_route_or_in_something_and_then_nothing_happens() {
    let mut environment = Environment::new(map(), Config::default(), 5).unwrap();
    let mut endings = Vec::new();
    for seed in 0..8 {
        environment.reset(seed).unwrap();
        let step = loop {
            let step = environment.step([0.3, 1.0]).unwrap();
            if step.ending.is_some() {
                break step;
            }
        };
        assert!(step.reward < 0.0, "{step:?}");
        endings.push(step.ending.unwrap());
        let hash = environment.simulation().sim().state_hash();
        assert_eq!(environment.step([0.0, 0.0]).unwrap(), Step { reward: 0.0, ..step });
        assert_eq!(environment.simulation().sim().state_hash(), hash);
    }
    assert!(endings.iter().all(|e| matches!(e, Ending::OffRoute | Ending::Collision)));
}

#[test]
fn an_episode_that_begins_again_is_the_same_and_another_seed_is_another() {
    let map = map();
    let mut one = Environment::new(Arc::clone(&map), Config::default(), 7).unwrap();
    let hashes = |environment: &mut Environment| -> Vec<u64> {
        let drive = |_| {
            environment.step(follow(environment)).unwrap();
            environment.simulation().sim().state_hash()
        };
        (0..50).map(drive).collect()
    };
    let first = hashes(&mut one);
    one.reset(8).unwrap();
    assert_ne!(hashes(&mut one), first);
    one.reset(7).unwrap();
    assert_eq!(hashes(&mut one), first);
    let mut two = Environment::new(map, Config::default(), 7).unwrap();
    assert_eq!(hashes(&mut two), first);
}

#[test]
fn what_is_out_of_range_is_refused_by_name() {
    let map = map();
    let refused = |config: Config| {
        Environment::new(Arc::clone(&map), config, 1).map(drop).unwrap_err().to_string()
    };
    let default = Config::default();
    let vehicles = refused(Config { vehicles: 900, ..default.clone() });
    assert!(vehicles.contains("of 900 vehicles find a place"), "{vehicles}");
    let frame = refused(Config { frame_s: f32::NAN, ..default.clone() });
    assert_eq!(frame, "frame_s is NaN, must be 0.005 to 0.1");
    let route = refused(Config { route_m: 1.0, ..default.clone() });
    assert_eq!(route, "route_m is 1, must be 10 to 10000");
    let mut environment = Environment::new(map, default, 1).unwrap();
    let hash = environment.simulation().sim().state_hash();
    for bad in [[f32::NAN, 0.0], [0.0, 1.5]] {
        let why = environment.step(bad).unwrap_err().to_string();
        assert!(why.contains("both must be -1 to 1"), "{why}");
    }
    assert_eq!(environment.simulation().sim().state_hash(), hash);
}

#[test]
fn a_truncated_episode_ends_after_its_steps() {
    let config = Config { steps_max: 3, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    assert_eq!(environment.simulation().sim().settings().delta_nanos, 50_000_000);
    let endings: Vec<_> = (0..3).map(|_| environment.step([0.0, -1.0]).unwrap().ending).collect();
    assert_eq!(endings, [None, None, Some(Ending::Steps)]);
}

#[test]
fn the_lidar_measures_what_every_ray_against_every_box_does() {
    let mut random = RandomStream::from_state(5);
    let boxes: Vec<UprightBox> = (0..400)
        .map(|_| UprightBox {
            center: Vec3::new(random.between(-150.0, 150.0), random.between(-90.0, 90.0), 0.5),
            half_extents_m: Vec3::new(random.between(0.1, 9.0), random.between(0.1, 3.0), 1.0),
            axis: Vec2::from_angle(random.between(0.0, TAU)),
        })
        .collect();
    let grid = BoxGrid::new(&boxes);
    for _ in 0..200 {
        let origin = Vec3::new(random.between(-200.0, 200.0), random.between(-120.0, 120.0), 0.0);
        let forward = Vec2::from_angle(random.between(0.0, TAU));
        let lidar = Lidar { origin, forward, range_m: 50.0 };
        let mut measured = vec![50.0; 240];
        grid.for_each_near(origin.truncate(), 50.0, |b| lidar.meet(b, &mut measured));
        for (ray, measured) in measured.into_iter().enumerate() {
            let direction = Vec2::from_angle(ray as f32 / 240.0 * TAU).rotate(forward);
            let nearest = boxes
                .iter()
                .filter_map(|b| {
                    let turned = |v: Vec2| Vec2::new(b.axis.dot(v), b.axis.perp_dot(v));
                    let offset = turned((origin - b.center).truncate());
                    entry(offset, turned(direction), b.half_extents_m.truncate())
                })
                .fold(50.0, f32::min);
            // A ray along an edge may meet the box or not.
            let is_edge = (measured - nearest).abs() > 1e-3 && {
                let near = |turn: f32| {
                    let direction = Vec2::from_angle(turn).rotate(direction);
                    boxes.iter().any(|b| {
                        let turned = |v: Vec2| Vec2::new(b.axis.dot(v), b.axis.perp_dot(v));
                        let offset = turned((origin - b.center).truncate());
                        let m = entry(offset, turned(direction), b.half_extents_m.truncate());
                        m.is_some_and(|m| (m - measured.min(nearest)).abs() < 0.1)
                    })
                };
                !(near(1e-5) && near(-1e-5))
            };
            assert!((measured - nearest).abs() <= 1e-3 || is_edge, "{measured} {nearest}");
        }
    }
}
