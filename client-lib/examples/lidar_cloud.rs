//! Mounts a lidar on a vehicle and prints what its points hit.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example lidar_cloud    # in a second terminal
//! ```

use std::time::Duration;

use omnibus_client_lib::{
    Client, ClientError, LidarOptions, Pose, Sensor, Spawn,
    glam::{Quat, Vec3},
};

fn main() {
    if let Err(why) = run(None) {
        eprintln!("lidar_cloud: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "lidar_cloud")?;
    let before = client.settings();
    client.synchronise(Duration::from_millis(100))?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
    // vehicle_from_sensor: on the roof. 32 channels between -25 and 10 degrees, 360 columns.
    let roof = Pose::new(Vec3::new(0.0, 0.0, 2.0), Quat::IDENTITY);
    let lidar = Sensor::lidar("roof", roof, LidarOptions::new(32, 360, [-0.436, 0.175], 80.0));
    let mut bundle = client.create_bundle("roof", car, [lidar], 1)?;
    for _ in 0..10 {
        let (frame, mut measured) = client.tick_and_collect(&mut [&mut bundle])?;
        let Some(measurement) = measured.pop().flatten() else { continue };
        let Some(cloud) = measurement.point_cloud(0) else { continue };
        let world_from_sensor = cloud.world_from_sensor.affine();
        let lowest = cloud
            .hits()
            .map(|(point, _)| world_from_sensor.transform_point3(point).z)
            .fold(f32::INFINITY, f32::min);
        let (hits, rays) = (cloud.hits().count(), cloud.points.len());
        println!("{frame}: {hits} of {rays} rays hit; the lowest point lies at {lowest:.2} m");
    }
    client.destroy_bundle(bundle)?;
    client.destroy(car)?;
    client.apply_settings(before)
}
