//! Night and rain, street lights, vehicle lights, open doors, and a traffic light that stays red.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example weather_lights # in a second terminal
//! ```

use std::time::Duration;

use omnibus_client_lib::{
    Actor, Client, ClientError, Doors, LightPhase, Spawn, StreetLightCommand, VehicleLights,
    Weather, glam::Vec3,
};

fn main() {
    if let Err(why) = run(None) {
        eprintln!("weather_lights: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "weather_lights")?;
    let before = client.settings();
    client.synchronise(Duration::from_millis(50))?;
    client.set_weather(Weather {
        sun_altitude_rad: -0.3,
        precipitation: 60.0,
        wetness: 80.0,
        ..Weather::default()
    })?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    client.set_vehicle_lights(car, VehicleLights::LOW_BEAM | VehicleLights::FOG)?;
    client.set_doors(car, Doors::FRONT_LEFT)?;
    let street_lights = client.street_lights()?;
    let near: Vec<u32> = street_lights
        .iter()
        .filter(|light| light.position.distance(place.position()) < 60.0)
        .map(|light| light.id)
        .collect();
    client.switch_street_lights(&near, StreetLightCommand::on().color([255, 120, 40]))?;
    println!("{} of {} street lights are orange", near.len(), street_lights.len());
    let first = client.traffic_lights().next().map(Actor::id);
    if let Some(light) = first {
        let group = client.light_group(light)?;
        for light in &group {
            client.hold_light(*light, LightPhase::Red)?;
        }
        println!("{} traffic lights stay red", group.len());
        client.tick()?;
        for light in group {
            client.release_light(light)?;
        }
    }
    client.tick()?;
    let state = client.world().actor(car).and_then(Actor::vehicle);
    println!("lights and doors: {:?}", state.map(|vehicle| (vehicle.lights, vehicle.doors)));
    let above = place.position() + Vec3::Z * 20.0;
    let hits = client.cast_ray(above, place.position() - Vec3::Z * 20.0)?;
    println!("a ray down onto the car hits {} surfaces", hits.len());
    let objects = client.map_objects()?.len();
    println!(
        "the town has {objects} objects; the car {} parts",
        client.bone_transforms(car)?.len()
    );
    client.set_weather(Weather::default())?;
    client.switch_street_lights(&near, StreetLightCommand::at_night())?;
    client.destroy(car)?;
    client.apply_settings(before)
}
