use std::{f32::consts::TAU, sync::Arc};

use glam::{Vec2, Vec3};
use mesh::RandomStream;
use protocol::{ActorId, flag, kind};
use road::Network;

use crate::{
    birds_eye::{ACTORS, Canvas},
    lidar::{BoxGrid, Lidar, UprightBox, entry},
    road_raster::{ROAD, RoadRaster},
    *,
};

fn map() -> Arc<EnvironmentMap> {
    let text = mapgen::default_map().1;
    let network = Arc::new(Network::parse(&text).unwrap());
    let town = Arc::new(town::furnish(&network, 3));
    Arc::new(EnvironmentMap::new(network, town, 3))
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
    let straight = EnvironmentMap::new(Arc::clone(&network), town::furnish(&network, 3).into(), 3);
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

/// Returns the mean speed of the other vehicles in 300 frames, and the hash of the last frame.
fn traffic_alone(environment: &mut Environment) -> (f32, u64) {
    let (mut sum_mps, mut count) = (0.0, 0.0);
    for _ in 0..150 {
        step(environment, pedals(0.0, -1.0));
        let ego = environment.egos()[0].id();
        let states = environment.simulation().sim().states().iter();
        for other in states.filter(|s| s.kind == kind::VEHICLE && s.actor_id != ego) {
            sum_mps += other.velocity().truncate().length();
            count += 1.0;
        }
    }
    (sum_mps / count, environment.simulation().sim().state_hash())
}

#[test]
fn kinematic_vehicles_drive_on_roads_as_fast_as_those_with_physics() {
    let map = map();
    let world = |physics| {
        let config = Config { physics, ..Config::default() };
        Environment::new(Arc::clone(&map), config, 2).unwrap()
    };
    let (mut all, mut kinematic) = (world(Physics::All), world(Physics::Ego));
    let (all_mps, _) = traffic_alone(&mut all);
    let (kinematic_mps, hash) = traffic_alone(&mut kinematic);
    let ratio = kinematic_mps / all_mps;
    assert!(all_mps > 2.0 && (0.8..1.25).contains(&ratio), "{kinematic_mps} {all_mps}");
    let roads = map.roads(0.5);
    let ground = Arc::clone(kinematic.simulation().sim().world().physics().ground());
    let states = kinematic.simulation().sim().states();
    let others: Vec<_> =
        states.iter().filter(|s| s.has(flag::KINEMATIC | flag::AUTOPILOT)).collect();
    assert_eq!(others.len(), 12);
    for state in others {
        let place = state.pose.position();
        assert!(roads.at(place.truncate()) & ROAD != 0, "{place} is beside the road");
        let height_m = ground.below(place.x, place.y, place.z + 0.5).height_m;
        assert!((place.z - height_m).abs() < 0.1, "{place} is not on the ground at {height_m}");
    }
    let mut again = world(Physics::Ego);
    assert_eq!(traffic_alone(&mut again), (kinematic_mps, hash), "the same seed");
}

#[test]
fn an_ego_vehicle_collides_with_kinematic_vehicles() {
    let config = Config { physics: Physics::Ego, off_route_m: 1000.0, ..Config::default() };
    let mut environment = Environment::new(map(), config, 1).unwrap();
    let mut hit = 0;
    for seed in 0..12 {
        environment.reset(seed).unwrap();
        let drive = Action::Waypoint { left_m: 0.0, speed_mps: 25.0 };
        while step(&mut environment, drive).ending.is_none() {}
        let collisions = environment.simulation().sim().world().physics().collisions();
        hit += collisions.iter().filter(|c| c.other != ActorId::NONE).count();
    }
    assert!(hit > 0);
}

/// Returns the rows and columns of a channel that are set, as ranges, and the number of its pixels.
fn extent(pixels: &[u8], size: usize, channel: usize) -> ([usize; 4], usize) {
    let (mut extent, mut count) = ([size, 0, size, 0], 0);
    for (at, pixel) in pixels[channel * size * size..][..size * size].iter().enumerate() {
        if *pixel != 0 {
            let (row, column) = (at / size, at % size);
            extent = [
                extent[0].min(row),
                extent[1].max(row + 1),
                extent[2].min(column),
                extent[3].max(column + 1),
            ];
            count += 1;
        }
    }
    (extent, count)
}

#[test]
fn a_box_and_a_road_at_known_places_set_known_pixels() {
    let of = BirdsEye::default();
    // Northwards, that is up, along a road 8 m wide with a line 0.1 m wide on its left half.
    let (origin, forward) = (Vec2::new(100.0, -20.0), Vec2::Y);
    let mut mesh = mesh::Mesh::default();
    let mut strip = |west: f32, east: f32, tag| {
        let face = mesh::Face::new(tag, mesh::Material::Asphalt, 0);
        let at = |x: f32, y: f32| [origin.x + x, origin.y + y, 0.0];
        mesh.quad([at(west, -60.0), at(east, -60.0), at(east, 60.0), at(west, 60.0)], face);
    };
    strip(-4.0, 4.0, mesh::Tag::Roads);
    strip(-2.05, -1.95, mesh::Tag::RoadLine);
    let raster = RoadRaster::new(&mesh, of.pixel_m);
    let mut pixels = Vec::new();
    let mut canvas = Canvas::new(&of, origin, forward, &mut pixels);
    canvas.roads(&raster);
    // Five metres ahead and two to the left, two metres long and one wide.
    let b = UprightBox {
        center: Vec3::new(98.0, -15.0, 0.7),
        half_extents_m: Vec3::new(1.0, 0.5, 0.7),
        axis: Vec2::Y,
    };
    canvas.upright_box(ACTORS, &b);
    canvas.route(origin, origin + 10.0 * forward, 1.5);
    assert_eq!(pixels.len(), BIRDS_EYE_CHANNELS * 84 * 84);
    assert_eq!(extent(&pixels, 84, ACTORS), ([30, 34, 37, 39], 8));
    assert_eq!(extent(&pixels, 84, 0), ([0, 84, 34, 50], 84 * 16));
    let ([top, bottom, left, right], count) = extent(&pixels, 84, 1);
    assert_eq!((top, bottom), (0, 84));
    assert!(left <= 38 && right >= 38 && right - left <= 2 && count >= 84, "{left} {right}");
    assert_eq!(extent(&pixels, 84, 2), ([22, 42, 39, 45], 20 * 6));
    assert_eq!(extent(&pixels, 84, 4).1 + extent(&pixels, 84, 5).1, 0);
}

#[test]
fn the_raster_of_an_environment_shows_the_ego_vehicle_on_its_route() {
    let mut environment = Environment::new(map(), Config::default(), 4).unwrap();
    let mut pixels = Vec::new();
    for index in 0..30 {
        step(&mut environment, IN_LANE);
        environment.birds_eye(0, &mut pixels);
        if index < 10 {
            // The middle pixel lies behind the vehicle's origin, before the beginning of the route.
            continue;
        }
        let middle = |channel: usize| pixels[channel * 84 * 84 + 42 * 84 + 42];
        // Road, route and the vehicle itself, and neither another nor something solid.
        assert_eq!([0, 2, 3, 4, 5].map(middle), [255, 255, 0, 0, 255]);
    }
    let own = extent(&pixels, 84, 5).1 as f32 * 0.25;
    // A Model 3 is 4.7 m long and 1.9 m wide.
    assert!((6.0..13.0).contains(&own), "{own} square metres");
    let refused = |birds_eye| {
        let config = Config { birds_eye, ..Config::default() };
        Environment::new(map(), config, 1).map(drop).unwrap_err().to_string()
    };
    let why = refused(BirdsEye { size_px: 4, pixel_m: 0.5 });
    assert_eq!(why, "birds_eye.size_px is 4, must be 8 to 512");
    let why = refused(BirdsEye { size_px: 84, pixel_m: f32::NAN });
    assert_eq!(why, "birds_eye.pixel_m is NaN, must be 0.1 to 4");
}

#[test]
fn the_camera_shows_the_newest_frame_of_each_episode() {
    let camera = Camera { output: CameraOutput::Depth, ..Camera::default() };
    let config = Config { egos: 2, vehicles: 2, camera, ..Config::default() };
    let mut environment = Environment::new(map(), config, 4).unwrap();
    let image = |environment: &mut Environment, ego| {
        let mut depths = Vec::new();
        environment.camera(ego, &mut depths).unwrap();
        assert_eq!(depths.len(), 84 * 84 * CameraOutput::Depth.pixel_bytes());
        depths
    };
    let first = image(&mut environment, 0);
    assert!(image(&mut environment, 1) != first, "each has its own");
    environment.step(&[IN_LANE; 2]).unwrap();
    assert!(image(&mut environment, 0) != first, "another frame");
    environment.reset(5).unwrap();
    assert!(image(&mut environment, 0) != first, "another episode");
    environment.reset(4).unwrap();
    assert!(image(&mut environment, 0) == first, "the same episode");
    let refused = |camera| {
        let config = Config { camera, ..Config::default() };
        Environment::new(map(), config, 1).map(drop).unwrap_err().to_string()
    };
    let why = refused(Camera { height_px: 4000, ..camera });
    assert_eq!(why, "camera.height_px is 4000, must be 8 to 2048");
    let why = refused(Camera { fov_rad: f32::NAN, ..camera });
    assert_eq!(why, "camera.fov_rad is NaN, must be 0.1 to 3");
    let mount = protocol::Pose { rotation: [0.0, 0.0, 0.0, 2.0], ..camera.mount };
    let why = refused(Camera { mount, ..camera });
    assert!(why.starts_with("camera.mount has position [1.5, 0.0, 2.0] m and rotation"), "{why}");
}

#[test]
fn a_map_from_the_cache_has_the_frames_of_one_that_was_built() {
    let folder = std::env::temp_dir().join(format!("omnibus-environment-{}", std::process::id()));
    let (name, text) = mapgen::default_map();
    let hash = |cache: &Cache| {
        let map = Arc::new(EnvironmentMap::load(cache, name, &text, 3).unwrap());
        let mut environment = Environment::new(map, Config::default(), 7).unwrap();
        for _ in 0..100 {
            step(&mut environment, IN_LANE);
        }
        environment.simulation().sim().state_hash()
    };
    let built = hash(&Cache::disabled());
    let cache = Cache::in_folder(&folder);
    assert_eq!(hash(&cache), built, "the first load fills the cache");
    assert_eq!(hash(&cache), built, "from the cache");
    std::fs::remove_dir_all(&folder).unwrap();
}
