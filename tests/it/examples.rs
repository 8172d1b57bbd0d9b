//! Every example of the client library, executed against a simulator of its own.

use crate::kit::{Scratch, Sim};

#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/branch_state.rs"]
mod branch_state;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/camera_follower.rs"]
mod camera_follower;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/drive_ego.rs"]
mod drive_ego;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/epoll_agent.rs"]
mod epoll_agent;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/follow_route.rs"]
mod follow_route;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/hello_tick.rs"]
mod hello_tick;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/latest_wins.rs"]
mod latest_wins;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/lidar_cloud.rs"]
mod lidar_cloud;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/lidar_follower.rs"]
mod lidar_follower;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/lockstep_agent.rs"]
mod lockstep_agent;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/record_camera.rs"]
mod record_camera;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/record_replay.rs"]
mod record_replay;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/traffic_params.rs"]
mod traffic_params;
#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/weather_lights.rs"]
mod weather_lights;

#[test]
fn the_example_hello_tick_runs() {
    let sim = Sim::start(&[]);
    hello_tick::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_latest_wins_runs() {
    let sim = Sim::start(&[]);
    latest_wins::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_drive_ego_runs() {
    let sim = Sim::start(&[]);
    drive_ego::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_record_camera_runs() {
    let sim = Sim::start(&[]);
    let folder = Scratch::new();
    record_camera::run(Some(sim.instance().id()), folder.path()).unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 10);
    sim.end();
}

#[test]
fn the_example_lidar_cloud_runs() {
    let sim = Sim::start(&[]);
    lidar_cloud::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_lockstep_agent_runs() {
    let sim = Sim::start(&[]);
    lockstep_agent::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_branch_state_runs() {
    let sim = Sim::start(&[]);
    branch_state::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_follow_route_runs() {
    let sim = Sim::start(&[]);
    follow_route::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_record_replay_runs() {
    let sim = Sim::start(&[]);
    record_replay::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_weather_lights_runs() {
    let sim = Sim::start(&[]);
    weather_lights::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_traffic_params_runs() {
    let sim = Sim::start(&[]);
    traffic_params::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

#[test]
fn the_example_epoll_agent_runs() {
    let sim = Sim::start(&[]);
    epoll_agent::run(Some(sim.instance().id())).unwrap();
    sim.end();
}

const OVAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../client-lib/examples/oval.xodr");

/// A car of 1.85 m is in its lane of 3.5 m while its middle is nearer to the lane's centre than this.
const IN_LANE_M: f32 = 0.8;

#[test]
fn the_camera_follower_keeps_its_lane_through_a_bend() {
    let sim = Sim::start(&["--map", OVAL]);
    let samples = camera_follower::run(Some(sim.instance().id())).unwrap();
    let most = |value: fn(&camera_follower::Sample) -> f32| {
        samples.iter().map(value).fold(f32::NEG_INFINITY, f32::max)
    };
    assert_eq!(samples.len(), 800);
    assert!(samples.iter().all(|s| !s.collides), "it touched something");
    let deviation_m = most(|s| s.deviation_m.abs());
    assert!(deviation_m < IN_LANE_M, "{deviation_m} m beside the lane's centre");
    // After it has started, it neither stops nor speeds.
    let driven_m: f32 = samples.iter().map(|s| s.speed_mps * 0.05).sum();
    assert!(driven_m > 250.0, "it drove {driven_m} m in 40 s");
    assert!(most(|s| s.speed_mps) < 9.0);
    sim.end();
}

#[test]
fn the_lidar_follower_keeps_its_gap_and_its_lane() {
    let sim = Sim::start(&["--map", OVAL]);
    let samples = lidar_follower::run(Some(sim.instance().id())).unwrap();
    assert_eq!(samples.len(), 800);
    assert!(samples.iter().all(|s| !s.collides), "it touched something");
    for s in &samples {
        assert!(s.deviation_m.abs() < IN_LANE_M, "{s:?}");
        assert!((3.0..20.0).contains(&s.gap_m), "{s:?}");
    }
    // When both have started, the gap is the wanted one, and the agent measures it.
    for s in &samples[300..] {
        let wanted_m = 4.0 + 0.8 * s.speed_mps;
        assert!((s.gap_m - wanted_m).abs() < 2.5, "{s:?}");
        assert!((s.gap_m - s.measured_m).abs() < 0.7, "{s:?}");
    }
    let driven_m: f32 = samples.iter().map(|s| s.speed_mps * 0.05).sum();
    assert!(driven_m > 200.0, "it drove {driven_m} m in 40 s");
    sim.end();
}
