//! CARLA's weather: 14 numbers, angles in degrees, azimuth positive clockwise.

use client_lib::Weather;

use crate::{
    args::{Args, RpcError},
    msgpack::Pack,
};

/// CARLA's weather parameters in CARLA's order: cloudiness, precipitation, precipitation deposits,
/// wind intensity, sun azimuth and altitude, fog density, distance and falloff, wetness, scattering
/// intensity, Mie and Rayleigh scattering scale, dust storm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CarlaWeather([f32; 14]);

impl CarlaWeather {
    /// Returns this weather if it still holds, otherwise CARLA's numbers for the one that holds.
    pub(crate) fn if_it_holds(set: Option<CarlaWeather>, bus: &Weather) -> CarlaWeather {
        set.filter(|set| set.to_bus() == *bus).unwrap_or_else(|| CarlaWeather::of(bus))
    }

    fn of(bus: &Weather) -> CarlaWeather {
        CarlaWeather([
            bus.cloudiness,
            bus.precipitation,
            bus.precipitation_deposits,
            bus.wind_intensity,
            (-bus.sun_azimuth_rad.to_degrees()).rem_euclid(360.0),
            bus.sun_altitude_rad.to_degrees(),
            bus.fog_density,
            bus.fog_distance_m,
            0.1,
            bus.wetness,
            1.0,
            0.03,
            0.0331,
            0.0,
        ])
    }

    pub(crate) fn to_bus(self) -> Weather {
        let w = self.0;
        Weather {
            cloudiness: w[0],
            precipitation: w[1],
            precipitation_deposits: w[2],
            wind_intensity: w[3],
            sun_azimuth_rad: -w[4].to_radians(),
            sun_altitude_rad: w[5].to_radians(),
            fog_density: w[6],
            fog_distance_m: w[7],
            wetness: w[9],
        }
    }

    pub(crate) fn read(args: &mut Args) -> Result<CarlaWeather, RpcError> {
        let mut fields = args.list()?;
        let mut weather = [0.0; 14];
        for value in &mut weather {
            *value = fields.f32()?;
        }
        Ok(CarlaWeather(weather))
    }

    pub(crate) fn write(&self, out: &mut Pack) {
        out.list(14);
        for value in self.0 {
            out.f32(value);
        }
    }
}
