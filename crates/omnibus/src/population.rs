//! What `omnibus run` puts into a new world: weather, vehicles, pedestrians.

use std::thread::JoinHandle;

use anyhow::{Context, ensure};
use bus::Instance;
use client_lib::{ActorId, Client, TrafficParam};
use protocol::{Command, Weather};

use crate::collect::{RoadUsers, TrafficEntry, WeatherEntry, sun_rad};

/// Arguments of `omnibus run` for the new world.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct PopulationArgs {
    /// Vehicles that traffic drives
    #[arg(long, default_value_t = 0)]
    vehicles: u32,
    /// Pedestrians that traffic leads over sidewalks and crosswalks
    #[arg(long, default_value_t = 0)]
    walkers: u32,
    /// Fraction of pedestrians that cross quiet streets away from crosswalks, 0 to 1
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    cross_factor: f32,
    /// By how much drivers of --vehicles differ: 0 not at all, 1 as in the field, at most 3
    #[arg(long, value_name = "SPREAD", default_value_t = 1.0)]
    driver_spread: f32,
    /// The weather: clear, cloudy, overcast, wet, drizzle, rain, storm or fog
    #[arg(long, value_name = "NAME")]
    weather: Option<String>,
    /// The hour of the day, 0 to 24
    #[arg(long, value_name = "HOUR")]
    time: Option<f32>,
}

impl PopulationArgs {
    /// Returns the weather; `None`: that of a new world.
    pub(crate) fn weather(&self) -> anyhow::Result<Option<Weather>> {
        let named = self.weather.as_deref().map(|name| WeatherEntry::preset(name).weather());
        let mut weather = named.transpose()?;
        if let Some(hour) = self.time {
            ensure!((0.0..=24.0).contains(&hour), "--time is {hour}; use 0 to 24");
            let under = weather.get_or_insert_default();
            [under.sun_altitude_rad, under.sun_azimuth_rad] = sun_rad(hour);
        }
        Ok(weather)
    }

    /// Puts everything into the world of a host that is about to run, by a client in a thread of its own.
    /// `None` if there is nothing to put.
    pub(crate) fn start(
        &self,
        instance: &Instance,
        in_process: bool,
        seed: u64,
        weather: Option<Weather>,
    ) -> anyhow::Result<Option<JoinHandle<()>>> {
        let spread = self.driver_spread;
        ensure!((0.0..=3.0).contains(&spread), "--driver-spread is {spread}; use 0 to 3");
        let factor = self.cross_factor;
        ensure!((0.0..=1.0).contains(&factor), "--cross-factor is {factor}; use 0 to 1");
        if weather.is_none() && self.vehicles == 0 && self.walkers == 0 {
            return Ok(None);
        }
        let (args, instance) = (self.clone(), instance.clone());
        let populate = move || {
            if let Err(why) = args.populate(&instance, in_process, seed, weather) {
                log::error!("the road users of --vehicles and --walkers: {why:#}");
            }
        };
        let thread = std::thread::Builder::new().name("population".into());
        Ok(Some(thread.spawn(populate).context("population")?))
    }

    fn populate(
        &self,
        instance: &Instance,
        in_process: bool,
        seed: u64,
        weather: Option<Weather>,
    ) -> anyhow::Result<()> {
        const NAME: &str = "population";
        let mut client = if in_process {
            Client::connect_in_process(instance, NAME)?
        } else {
            Client::connect(Some(instance.id()), NAME)?
        };
        if let Some(weather) = weather {
            client.request("weather", &[Command::SetWeather(weather)])?;
        }
        let traffic = TrafficEntry {
            vehicles: self.vehicles,
            walkers: self.walkers,
            driver_spread: self.driver_spread,
            ..TrafficEntry::default()
        };
        if self.cross_factor > 0.0 {
            let factor = TrafficParam::CrossFactor(self.cross_factor);
            client.set_traffic_param(ActorId::NONE, factor)?;
        }
        let users = RoadUsers::anywhere(&mut client, seed, traffic)?;
        let [vehicles, walkers] = users.counts();
        if self.vehicles + self.walkers > 0 {
            print_line!("{vehicles} vehicles and {walkers} pedestrians are in the world");
        }
        if (vehicles, walkers) != (self.vehicles as usize, self.walkers as usize) {
            log::warn!(
                "{} vehicles and {} pedestrians were requested; the map has no more room",
                self.vehicles,
                self.walkers
            );
        }
        Ok(())
    }
}
