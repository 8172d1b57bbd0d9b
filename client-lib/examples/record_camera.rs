//! Saves every tenth image of a camera that follows a car.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example record_camera -- pictures
//! ```
//!
//! No pixel is copied on the way: the encoder reads the renderer's own memory.

use std::{env, fs::File, path::Path};

use glam::{Quat, Vec3};
use omnibus_client_lib::{Client, Measurement, Pose, Spawn, camera, output};

const IMAGES: u64 = 10;
const FRAMES_BETWEEN: u64 = 10;
const DELTA_NANOS: u64 = 50_000_000;

type AnyError = Box<dyn std::error::Error>;

fn main() {
    let folder = env::args().nth(1).unwrap_or_else(|| "pictures".to_owned());
    if let Err(why) = record(Path::new(&folder)) {
        eprintln!("record_camera: {why}");
        std::process::exit(1);
    }
}

fn record(folder: &Path) -> Result<(), AnyError> {
    std::fs::create_dir_all(folder)?;
    let mut client = Client::connect(None, "record_camera")?;
    let before = client.settings();
    client.synchronise(DELTA_NANOS)?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    // Behind the car and above it, looking down a little: vehicle_from_sensor.
    let behind = Pose::new(Vec3::new(-7.0, 0.0, 3.5), Quat::from_rotation_y(0.22));
    let mut follower = camera("follower", behind, 800, 600, 1.4, output::COLOR);
    // It rests in between: nobody pays for images that nobody wants.
    follower.period_nanos = FRAMES_BETWEEN * DELTA_NANOS;
    let mut bundle = client.create_bundle("follower", car, &[follower], 1)?;

    for _ in 0..IMAGES * FRAMES_BETWEEN {
        let (frame, mut measured) = client.tick_and_collect(&mut [&mut bundle])?;
        if let Some(measurement) = measured.pop().flatten() {
            let path = folder.join(format!("{:06}.png", frame.0));
            save(&path, &measurement)?;
            println!("{frame}: {}", path.display());
        }
    }
    client.destroy_bundle(bundle)?;
    client.destroy(car)?;
    Ok(client.apply_settings(before)?)
}

fn save(path: &Path, measurement: &Measurement) -> Result<(), AnyError> {
    let plane = measurement.plane(0, output::COLOR).ok_or("the bundle has no colour")?;
    let rgba = measurement.data(0, output::COLOR).ok_or("the bundle has no colour")?;
    let mut encoder = png::Encoder::new(File::create(path)?, plane.width, plane.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fast);
    Ok(encoder.write_header()?.write_image_data(rgba)?)
}
