//! Every reader of arguments that needs no world, on one request: an entry for fuzzing.

use client_lib::{Pose, wire::sensor as sensor_kind};

use crate::{
    args::Args,
    calls::read_control,
    friction::Trigger,
    msgpack::Value,
    physics_control::PhysicsControl,
    sensor::Sensor,
    settings::EpisodeSettings,
    weather::CarlaWeather,
    wire::{Description, location, transform},
};

/// The deepest list whose values are read as arguments: batches hold commands in lists of lists.
const DEPTH_MAX: usize = 4;

/// Reads the values of a request as the arguments of every call, from each position on.
///
/// # Panics
/// A number that was accepted is not finite.
#[doc(hidden)]
pub fn read_arguments(request: &Value) {
    read_within(request, 0);
}

fn read_within(value: &Value, depth: usize) {
    let Value::List(values) = value else { return };
    for from in 0..values.len().min(8) {
        read_from(&values[from..]);
    }
    if depth < DEPTH_MAX {
        values.iter().take(8).for_each(|value| read_within(value, depth + 1));
    }
}

fn read_from(values: &[Value]) {
    let args = || Args::new(values);
    if let Ok(pose) = transform(&mut args()) {
        assert!(pose.is_valid(), "{pose:?}");
    }
    if let Ok(place) = location(&mut args()) {
        assert!(place.is_finite(), "{place}");
    }
    if let Ok(control) = read_control(1, &mut args()) {
        assert_eq!(control.check(), Ok(()));
    }
    if let Ok(weather) = CarlaWeather::read(&mut args()) {
        let weather = weather.to_bus();
        let numbers = [weather.sun_altitude_rad, weather.sun_azimuth_rad, weather.wetness];
        assert!(numbers.iter().all(|x| x.is_finite()), "{weather:?}");
    }
    if let Ok(settings) = EpisodeSettings::read(&mut args())
        && let Ok(settings) = settings.to_bus(&client_lib::wire::Settings::default())
    {
        assert_eq!(settings.check(), Ok(()));
    }
    let _ = PhysicsControl::read(&mut args());
    if let Ok(description) = Description::read(&mut args()) {
        let _ = Trigger::new(Pose::IDENTITY, &description);
        let sensor = Sensor::new(description, 1);
        if let Ok(Ok(Some(spec))) =
            sensor.map(|sensor| sensor.spec(Pose::IDENTITY, 50_000_000, 9.81))
        {
            let numbers = [spec.fov_rad, spec.upper_rad, spec.lower_rad, spec.range_m];
            let is_physics = sensor_kind::is_physics_sensor(spec.kind);
            assert!(is_physics || numbers.iter().all(|x| x.is_finite()), "{spec:?}");
        }
    }
}
