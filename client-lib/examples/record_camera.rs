//! Saves every tenth image of a camera that follows a car.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example record_camera -- pictures
//! ```
//!
//! No pixel is copied on the way: the encoder reads the renderer's own memory.

use std::{env, fs::File, path::Path, time::Duration};

use omnibus_client_lib::{
    Client, Image, Pose, Sensor, Spawn,
    glam::{Quat, Vec3},
};

const IMAGES: u64 = 10;
const FRAMES_BETWEEN: u64 = 10;
const DELTA: Duration = Duration::from_millis(50);

type AnyError = Box<dyn std::error::Error>;

fn main() {
    let folder = env::args().nth(1).unwrap_or_else(|| "pictures".to_owned());
    if let Err(why) = run(None, Path::new(&folder)) {
        eprintln!("record_camera: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>, folder: &Path) -> Result<(), AnyError> {
    std::fs::create_dir_all(folder)?;
    let mut client = Client::connect(instance, "record_camera")?;
    let before = client.settings();
    client.synchronise(DELTA)?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    // Behind the car and above it, looking down a little: vehicle_from_sensor.
    let behind = Pose::new(Vec3::new(-7.0, 0.0, 3.5), Quat::from_rotation_y(0.22));
    // It measures only the images that are saved: the frames in between cost nothing.
    let follower =
        Sensor::camera("follower", behind, 800, 600, 1.4).period(DELTA * FRAMES_BETWEEN as u32);
    let mut bundle = client.create_bundle("follower", car, [follower], 1)?;

    for _ in 0..IMAGES * FRAMES_BETWEEN {
        let (frame, mut measured) = client.tick_and_collect(&mut [&mut bundle])?;
        if let Some(measurement) = measured.pop().flatten() {
            let path = folder.join(format!("{:06}.png", frame.0));
            save(&path, &measurement.color_image(0).ok_or("the bundle has no colour")?)?;
            println!("{frame}: {}", path.display());
        }
    }
    client.destroy_bundle(bundle)?;
    client.destroy(car)?;
    Ok(client.apply_settings(before)?)
}

fn save(path: &Path, image: &Image<[u8; 4]>) -> Result<(), AnyError> {
    let mut encoder = png::Encoder::new(File::create(path)?, image.width, image.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fast);
    Ok(encoder.write_header()?.write_image_data(image.data.as_flattened())?)
}
