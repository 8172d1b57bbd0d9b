//! Sends a vehicle on autopilot to a place, over a route that turns right first.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example follow_route   # in a second terminal
//! ```

use std::time::Duration;

use omnibus_client_lib::{Client, ClientError, Draw, RouteStep, Spawn};

fn main() {
    if let Err(why) = run(None) {
        eprintln!("follow_route: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "follow_route")?;
    let before = client.settings();
    client.synchronise(Duration::from_millis(50))?;
    let places = client.spawn_points()?;
    let (start, goal) = (places[0], places[places.len() / 2].position());
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", start).autopilot())?;
    client.set_route(car, &[RouteStep::Right, RouteStep::Place(goal)])?;
    client.draw(&[Draw::point(goal).color([255, 0, 0]).secs(30.0)])?;
    for tick in 1..=200 {
        client.tick()?;
        let Some(state) = client.world().actor(car) else { break };
        if tick % 40 == 0 {
            let left_m = state.position().distance(goal);
            println!("{left_m:.1} m from the goal at {:.1} m/s", state.speed_mps());
        }
    }
    client.erase()?;
    client.destroy(car)?;
    client.apply_settings(before)
}
