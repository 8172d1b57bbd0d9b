//! Records a few seconds, then replays them beside the actors that exist.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example record_replay  # in a second terminal
//! ```

use std::{env, fs, time::Duration};

use omnibus_client_lib::{Client, ClientError, Profile, Replay, Spawn};

fn main() {
    if let Err(why) = run(None) {
        eprintln!("record_replay: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "record_replay")?;
    let before = client.settings();
    client.synchronise(Duration::from_millis(50))?;
    let file = env::temp_dir().join(format!("record-replay-{}.mcap", std::process::id()));
    let name = file.to_string_lossy();
    client.start_recorder(&name, Profile::State)?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    for _ in 0..40 {
        client.tick()?;
    }
    client.destroy(car)?;
    println!("{} frames were recorded into {name}", client.stop_recorder()?);
    let actors = client.world().actors().len();
    client.start_replay(&name, Replay { time_factor: 2.0, ..Replay::default() })?;
    for _ in 0..10 {
        client.tick()?;
    }
    let shown = client.world().actors().len();
    println!("{actors} actors before, {shown} while the recording is replayed");
    client.stop_replay(false)?;
    let _ = fs::remove_file(&file);
    client.apply_settings(before)
}
