//! An agent that is slower than the world: it takes only the newest image, and knows how many it
//! missed.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example latest_wins    # in a second terminal
//! ```

use std::{thread::sleep, time::Duration};

use glam::{Quat, Vec3};
use omnibus_client_lib::{Client, ClientError, Frame, Pose, Settings, Spawn, camera, output};

/// How long the agent thinks about one image: three to four frames of 50 ms go by.
const THINKING: Duration = Duration::from_millis(170);

fn main() {
    if let Err(why) = think() {
        eprintln!("latest_wins: {why}");
        std::process::exit(1);
    }
}

fn think() -> Result<(), ClientError> {
    let mut client = Client::connect(None, "latest_wins")?;
    // The world runs on its own clock and waits for nobody.
    client.apply_settings(Settings { synchronous: 0, ..client.settings() })?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    let windscreen = Pose::new(Vec3::new(1.5, 0.0, 2.0), Quat::IDENTITY);
    let eye = camera("eye", windscreen, 320, 240, 1.5, output::DEPTH);
    // One image is held while the next is looked for.
    let mut bundle = client.create_bundle("eye", car, &[eye], 2)?;

    let mut last: Option<Frame> = None;
    let mut missed = 0;
    for _ in 0..20 {
        let mut newest = client.await_measurement(&mut bundle)?;
        while let Some(newer) = bundle.receive()? {
            newest = newer;
        }
        let frame = newest.frame();
        let went_by = last.map_or(0, |last| frame.0 - last.0 - 1);
        missed += went_by;
        last = Some(frame);
        let nearest = newest.depth(0).into_iter().flatten().copied().fold(f32::MAX, f32::min);
        println!(
            "{frame}: the nearest thing is {nearest:.2} m away; {went_by} frames went by unseen"
        );
        sleep(THINKING);
    }
    println!("{missed} frames missed in all");
    client.destroy_bundle(bundle)?;
    client.destroy(car)
}
