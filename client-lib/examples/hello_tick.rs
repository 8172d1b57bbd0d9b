//! Ticks a running simulator and prints what each frame says of itself.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example hello_tick     # in a second terminal
//! ```

use omnibus_client_lib::{Client, ClientError, Spawn};

/// One tick.
const DELTA_NANOS: u64 = 50_000_000;

fn main() {
    if let Err(why) = hello() {
        eprintln!("hello_tick: {why}");
        std::process::exit(1);
    }
}

fn hello() -> Result<(), ClientError> {
    let mut client = Client::connect(None, "hello_tick")?;
    let before = client.settings();
    client.synchronise(DELTA_NANOS)?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    for _ in 0..40 {
        let frame = client.tick()?;
        // The world of that very frame, read where the host wrote it.
        let world = client.world();
        let state = world.actor(car).expect("it was spawned");
        let [x, y, z] = state.pose.position_m;
        println!(
            "{frame}, {:.2} s: the car is at ({x:.2}, {y:.2}, {z:.2}) m and drives {:.2} m/s; state {:016x}",
            world.header().stamp.sim_time_nanos as f64 * 1e-9,
            state.velocity().length(),
            world.header().state_hash,
        );
    }
    client.destroy(car)?;
    // The world goes on as it did before.
    client.apply_settings(before)
}
