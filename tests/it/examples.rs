//! Every example of the client library, executed against a simulator of its own.

use crate::kit::{Scratch, Sim};

#[allow(dead_code, reason = "the example's main() is not called here")]
#[path = "../../client-lib/examples/branch_state.rs"]
mod branch_state;
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
