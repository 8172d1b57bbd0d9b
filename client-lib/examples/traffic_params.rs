//! Twenty vehicles on autopilot: all drive slowly, one ignores the speed limit.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example traffic_params # in a second terminal
//! ```

use std::time::Duration;

use omnibus_client_lib::{ActorId, Client, ClientError, Spawn, TrafficParam};

fn main() {
    if let Err(why) = run(None) {
        eprintln!("traffic_params: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "traffic_params")?;
    let before = client.settings();
    client.synchronise(Duration::from_millis(50))?;
    client.set_traffic_param(ActorId::NONE, TrafficParam::SpeedReduction(0.5))?;
    client.set_traffic_param(ActorId::NONE, TrafficParam::GapM(4.0))?;
    let places = client.spawn_points()?;
    let spawns: Vec<Spawn> = places
        .iter()
        .step_by(4)
        .take(20)
        .map(|place| Spawn::new("vehicle.audi.tt", *place).autopilot())
        .collect();
    // One batch; an occupied place is that command's own outcome.
    let outcomes = client.try_request("spawn", &spawns)?;
    let cars: Vec<ActorId> = outcomes.iter().filter_map(|outcome| outcome.actor().ok()).collect();
    if let Some(hasty) = cars.first() {
        client.set_traffic_param(*hasty, TrafficParam::SpeedMps(15.0))?;
        client.set_traffic_param(*hasty, TrafficParam::IgnoreLights(1.0))?;
    }
    for _ in 0..100 {
        client.tick()?;
    }
    let speeds = cars.iter().filter_map(|car| client.world().actor(*car));
    let speeds: Vec<String> = speeds.map(|car| format!("{:.1}", car.speed_mps())).collect();
    println!("m/s after 5 s: {}", speeds.join(" "));
    for car in cars {
        client.destroy(car)?;
    }
    client.set_traffic_param(ActorId::NONE, TrafficParam::SpeedReduction(0.0))?;
    client.apply_settings(before)
}
