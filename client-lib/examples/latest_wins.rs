//! An agent that is slower than the world: it takes only the newest image, and knows how many it
//! missed.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example latest_wins    # in a second terminal
//! ```

use std::{thread::sleep, time::Duration};

use omnibus_client_lib::{
    CameraOutputs, Client, ClientError, Frame, Pace, Pose, Sensor, Spawn,
    glam::{Quat, Vec3},
};

/// How long the agent works on one image: three to four frames of 50 ms pass.
const WORK: Duration = Duration::from_millis(170);

fn main() {
    if let Err(why) = run(None) {
        eprintln!("latest_wins: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "latest_wins")?;
    // The world runs on its own clock and does not wait for clients.
    client.apply_settings(client.settings().with_pace(Pace::RealTime(1.0)))?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    let windscreen = Pose::new(Vec3::new(1.5, 0.0, 2.0), Quat::IDENTITY);
    let eye = Sensor::camera("eye", windscreen, 320, 240, 1.5).outputs(CameraOutputs::DEPTH);
    // One image is held while the next is looked for.
    let mut bundle = client.create_bundle("eye", car, [eye], 2)?;

    let mut last: Option<Frame> = None;
    let mut missed = 0;
    for _ in 0..20 {
        let mut newest = client.await_measurement(&mut bundle)?;
        while let Some(newer) = bundle.receive()? {
            newest = newer;
        }
        let frame = newest.frame();
        let passed = last.map_or(0, |last| frame.0 - last.0 - 1);
        missed += passed;
        last = Some(frame);
        let nearest = newest.depth(0).into_iter().flatten().copied().fold(f32::MAX, f32::min);
        println!(
            "{frame}: the nearest thing is {nearest:.2} m away; {passed} frames passed unseen"
        );
        sleep(WORK);
    }
    println!("{missed} frames missed in all");
    client.destroy_bundle(bundle)?;
    client.destroy(car)
}
