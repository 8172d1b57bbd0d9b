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

fn pedals(steer: f32, pedal: f32) -> Action {
    Action::Pedals { steer, pedal }
}

/// Advances an environment of one ego vehicle.
fn step(environment: &mut Environment, action: Action) -> Step {
    environment.step(&[action]).unwrap()[0]
}

/// Follows the point of the route 6 m ahead at 5 m/s.
fn follow(ego: &Ego) -> Action {
    let state = ego.state();
    let (x, y) = (state[10], state[11]);
    let speed_mps = state[0] * 30.0;
    pedals((2.0 * y.atan2(x)).clamp(-1.0, 1.0), (0.5 * (5.0 - speed_mps)).clamp(-1.0, 1.0))
}

/// Drives in the middle of the lane at 8 m/s.
const IN_LANE: Action = Action::Waypoint { left_m: 0.0, speed_mps: 8.0 };

/// Drives until each ego vehicle has an ending; returns the sums of rewards.
fn drive_all(environment: &mut Environment, action: Action) -> Vec<f32> {
    let mut sums = vec![0.0; environment.egos().len()];
    while environment.egos().iter().any(|ego| ego.ending().is_none()) {
        let actions = vec![action; sums.len()];
        let steps = environment.step(&actions).unwrap();
        sums.iter_mut().zip(steps).for_each(|(sum, step)| *sum += step.reward);
    }
    sums
}

#[test]
fn a_follower_of_the_route_arrives_and_its_progress_is_the_length() {
    let config = Config { vehicles: 0, route_m: 120.0, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    let (begin_m, length_m) = environment.egos()[0].progress_m();
    for seed in 1..6 {
        environment.reset(seed).unwrap();
        let (mut progress, mut speed) = (0.0, 0.0f32);
        let ending = loop {
            let action = follow(&environment.egos()[0]);
            let step = step(&mut environment, action);
            speed = speed.max(environment.egos()[0].forward_mps());
            progress += step.reward;
            if step.ending.is_some() {
                break step.ending;
            }
        };
        assert_eq!(ending, Some(Ending::Arrival), "seed {seed}: {:?}", environment.egos());
        // Progress and the arrival, and for each step at most 0.1 for speed, −0.3 for the rest.
        let (least, most) = (length_m - begin_m - 22.0, length_m + 40.0);
        assert!((least..most).contains(&progress), "{progress}");
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
            let step = step(&mut environment, pedals(0.3, 1.0));
            if step.ending.is_some() {
                break step;
            }
        };
        assert!(step.reward < 0.0, "{step:?}");
        endings.push(step.ending.unwrap());
        let hash = environment.simulation().sim().state_hash();
        let ended = Step { reward: 0.0, ..step };
        assert_eq!(environment.step(&[pedals(0.0, 0.0)]).unwrap(), [ended]);
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
            step(environment, follow(&environment.egos()[0]));
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
    let why = environment.step(&[pedals(f32::NAN, 0.0)]).unwrap_err().to_string();
    assert_eq!(why, "steer in the action of ego vehicle 0 is NaN, must be -1 to 1");
    let fast = Action::Waypoint { left_m: 0.0, speed_mps: 61.0 };
    let why = environment.step(&[fast]).unwrap_err().to_string();
    assert_eq!(why, "speed_mps in the action of ego vehicle 0 is 61, must be 0 to 60");
    let why = environment.step(&[]).unwrap_err().to_string();
    assert_eq!(why, "0 actions for 1 ego vehicles; give one to each");
    assert_eq!(environment.simulation().sim().state_hash(), hash);
}

#[test]
fn a_waypoint_is_reached_beside_the_middle_of_the_lane_at_its_speed() {
    let config = Config { vehicles: 0, route_m: 150.0, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    for (seed, left_m, speed_mps) in [(1, 0.0, 8.0), (2, 0.6, 6.0), (3, -0.6, 7.0)] {
        environment.reset(seed).unwrap();
        let action = Action::Waypoint { left_m, speed_mps };
        let mut beside = Vec::new();
        while step(&mut environment, action).ending.is_none() {
            let ego = &environment.egos()[0];
            if ego.progress_m().0 > 30.0 {
                assert!((ego.forward_mps() - speed_mps).abs() < 1.0, "{}", ego.forward_mps());
                beside.push(ego.left_m());
            }
        }
        assert_eq!(environment.egos()[0].ending(), Some(Ending::Arrival), "{seed}");
        beside.sort_by(f32::total_cmp);
        let median = beside[beside.len() / 2];
        assert!((median - left_m).abs() < 0.15, "{median} {left_m}");
    }
}

#[test]
fn each_ego_vehicle_has_its_own_route_and_ending_and_is_removed_after_it() {
    let config = Config { egos: 4, vehicles: 4, route_m: 100.0, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    let starts: Vec<Vec3> =
        environment.egos().iter().map(|ego| ego.actor().pose.position()).collect();
    for (index, start) in starts.iter().enumerate() {
        assert!(starts[..index].iter().all(|other| other.distance(*start) > 11.0));
    }
    let hashes = |environment: &mut Environment| {
        environment.reset(3).unwrap();
        let mut endings = vec![None; 4];
        let mut hashes = Vec::new();
        while endings.iter().any(Option::is_none) {
            // One leaves its route, one stands.
            let actions = [pedals(0.4, 0.6), pedals(0.0, -1.0), IN_LANE, IN_LANE];
            let before = endings.clone();
            let steps = environment.step(&actions).unwrap().to_vec();
            endings = steps.iter().map(|step| step.ending).collect();
            let world = environment.simulation().sim().world();
            for (index, ego) in environment.egos().iter().enumerate() {
                // It is there at its ending, for the last observation.
                assert_eq!(world.state(ego.id()).is_some(), before[index].is_none());
                assert!(before[index].is_none() || steps[index].reward == 0.0);
                assert!(before[index].is_none() || endings[index] == before[index]);
                assert!(ego.state().iter().all(|value| value.is_finite()));
                environment.lidar(index, &mut Vec::new());
            }
            hashes.push(environment.simulation().sim().state_hash());
        }
        (endings, hashes)
    };
    let first = hashes(&mut environment);
    assert_eq!(first.0[0], Some(Ending::OffRoute));
    assert_eq!(first.0[1], Some(Ending::Steps));
    assert!(first.0[2..].contains(&Some(Ending::Arrival)), "{:?}", first.0);
    assert_eq!(hashes(&mut environment), first);
}

/// A road of 200 m with one lane.
const STRAIGHT: &str = r#"<OpenDRIVE><header revMajor="1" revMinor="4"/>
<road name="" length="200" id="1" junction="-1"><link/>
<planView><geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"#;

#[test]
fn ego_vehicles_collide_with_each_other_and_too_many_find_no_start() {
    let map = map();
    let config = Config { egos: 8, vehicles: 0, route_m: 150.0, ..Config::default() };
    let mut environment = Environment::new(Arc::clone(&map), config.clone(), 1).unwrap();
    let mut collisions = 0;
    for seed in 0..6 {
        environment.reset(seed).unwrap();
        drive_all(&mut environment, IN_LANE);
        let ended = |ego: &&Ego| ego.ending() == Some(Ending::Collision);
        collisions += environment.egos().iter().filter(ended).count();
    }
    assert!(collisions > 1, "{collisions}");
    let network = Arc::new(Network::parse(STRAIGHT).unwrap());
    let straight = EnvironmentMap::new(Arc::clone(&network), &town::furnish(&network, 3), 3);
    let many = Config { egos: 64, route_m: 40.0, ..config };
    let why = Environment::new(Arc::new(straight), many, 1).map(drop).unwrap_err().to_string();
    assert!(why.contains("of 64 ego vehicles find a start of a route of 40 m"), "{why}");
}

#[test]
fn each_part_of_the_reward_counts_what_it_names() {
    let nothing = Reward {
        per_metre: 0.0,
        speed: 0.0,
        speeding: 0.0,
        off_centre: 0.0,
        steering: 0.0,
        arrival: 0.0,
        collision: 0.0,
        off_route: 0.0,
    };
    let map = map();
    let sum_of = |reward: Reward, action: Action| {
        let config = Config { vehicles: 0, off_route_m: 500.0, reward, ..Config::default() };
        let mut environment = Environment::new(Arc::clone(&map), config, 2).unwrap();
        (0..40).map(|_| step(&mut environment, action).reward).sum::<f32>()
    };
    let waypoint = |left_m, speed_mps| Action::Waypoint { left_m, speed_mps };
    let speeding = Reward { speeding: -1.0, ..nothing };
    assert_eq!(sum_of(speeding, waypoint(0.0, 5.0)), 0.0);
    assert!(sum_of(speeding, waypoint(0.0, 50.0)) < -0.1);
    let off_centre = Reward { off_centre: -1.0, ..nothing };
    let (middle, beside) =
        (sum_of(off_centre, waypoint(0.0, 5.0)), sum_of(off_centre, waypoint(0.8, 5.0)));
    assert!(beside < middle - 5.0, "{beside} {middle}");
    let steering = Reward { steering: -1.0, ..nothing };
    // Full lock once.
    assert_eq!(sum_of(steering, pedals(1.0, -1.0)), -1.0);
    assert_eq!(sum_of(nothing, waypoint(0.0, 5.0)), 0.0);
}

#[test]
fn a_truncated_episode_ends_after_its_steps() {
    let config = Config { steps_max: 3, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    assert_eq!(environment.simulation().sim().settings().delta_nanos, 50_000_000);
    let endings: Vec<_> =
        (0..3).map(|_| step(&mut environment, pedals(0.0, -1.0)).ending).collect();
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
