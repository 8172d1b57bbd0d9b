//! Ticks a running simulator and prints the state of a vehicle at each frame.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example hello_tick     # in a second terminal
//! ```

use std::time::Duration;

use omnibus_client_lib::{Client, ClientError, Spawn};

/// One tick.
const DELTA: Duration = Duration::from_millis(50);

fn main() {
    if let Err(why) = run(None) {
        eprintln!("hello_tick: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "hello_tick")?;
    let before = client.settings();
    client.synchronise(DELTA)?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    for _ in 0..40 {
        let frame = client.tick()?;
        // The world of that frame, read in the host's memory.
        let world = client.world();
        let state = world.actor(car).expect("it was spawned");
        let [x, y, z] = state.position().to_array();
        println!(
            "{frame}, {:.2} s: the car is at ({x:.2}, {y:.2}, {z:.2}) m and drives {:.2} m/s; state {:016x}",
            world.sim_time().as_secs_f64(),
            state.speed_mps(),
            world.state_hash(),
        );
    }
    client.destroy(car)?;
    // Other clients find the settings as they were.
    client.apply_settings(before)
}
