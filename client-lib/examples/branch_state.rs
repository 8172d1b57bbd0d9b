//! Saves the state of the world, tries two manoeuvres from it, and compares them.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example branch_state   # in a second terminal
//! ```

use std::time::Duration;

use omnibus_client_lib::{ActorId, Client, ClientError, Spawn, VehicleControl, glam::Vec3};

fn main() {
    if let Err(why) = run(None) {
        eprintln!("branch_state: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "branch_state")?;
    let before = client.settings();
    client.synchronise(Duration::from_millis(50))?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    client.tick()?;
    let fork = client.save_state()?;
    println!("the state has {} bytes", fork.len());
    for (name, throttle) in [("gently", 0.3), ("hard", 0.9), ("gently again", 0.3)] {
        client.load_state(&fork)?;
        let end = accelerate(&mut client, car, throttle)?;
        println!("{name}: at {end:.3}; state {:016x}", client.world().state_hash());
    }
    client.destroy(car)?;
    client.apply_settings(before)
}

fn accelerate(client: &mut Client, car: ActorId, throttle: f32) -> Result<Vec3, ClientError> {
    for _ in 0..40 {
        client.control(&[VehicleControl { actor_id: car, throttle, ..Default::default() }])?;
        client.tick()?;
    }
    Ok(client.world().actor(car).map_or(Vec3::ZERO, |car| car.position()))
}
