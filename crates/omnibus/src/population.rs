//! What `omnibus run` puts into a new world: weather, vehicles, pedestrians.

use std::{path::PathBuf, sync::Arc, thread::JoinHandle};

use anyhow::{Context, ensure};
use bus::Instance;
use client_lib::{ActorId, Client, ClientError, Pace, TrafficParam};
use protocol::{Command, Weather};

use crate::{
    collect::{Departures, RoadUsers, TrafficEntry, WeatherEntry, check_hybrid_radius, sun_rad},
    launch::WorldArgs,
};

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
    /// Switches hybrid physics on: vehicles that traffic drives move by a kinematic model while they
    /// are farther than this from every hero, every actor with sensors and every vehicle that a client
    /// drives, in metres
    #[arg(long, value_name = "METRES")]
    hybrid_radius: Option<f32>,
    /// Vehicles that depart at their times, take their routes and are removed where they arrive: a route
    /// file of SUMO, on a net that netconvert made from this map's OpenDRIVE file
    #[arg(long, value_name = "FILE.rou.xml")]
    routes: Option<PathBuf>,
    /// The time of --routes at which the world begins, in seconds; vehicles that depart earlier are left
    /// out
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, requires = "routes")]
    routes_begin: f64,
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

    /// Returns the vehicles of --routes.
    pub(crate) fn departures(&self, world: &WorldArgs) -> anyhow::Result<Option<Departures>> {
        let Some(path) = &self.routes else { return Ok(None) };
        let network = Arc::new(world.network()?);
        let departures = Departures::read(path, self.routes_begin, network, world.seed())?;
        print_line!("{} vehicles of {} depart", departures.waiting(), path.display());
        Ok(Some(departures))
    }

    /// Puts everything into the world of a host that is about to run, by a client in a thread of its own,
    /// and calls `announce` when it is there: a client that begins to tick then finds the same road users
    /// in every run. `None` if there is nothing to put.
    pub(crate) fn start(
        &self,
        instance: &Instance,
        in_process: bool,
        seed: u64,
        weather: Option<Weather>,
        departures: Option<Departures>,
        announce: impl FnOnce() + Send + 'static,
    ) -> anyhow::Result<Option<JoinHandle<()>>> {
        let spread = self.driver_spread;
        ensure!((0.0..=3.0).contains(&spread), "--driver-spread is {spread}; use 0 to 3");
        let factor = self.cross_factor;
        ensure!((0.0..=1.0).contains(&factor), "--cross-factor is {factor}; use 0 to 1");
        check_hybrid_radius("--hybrid-radius", self.hybrid_radius)?;
        let has_users = self.vehicles > 0 || self.walkers > 0 || departures.is_some();
        if weather.is_none() && !has_users && self.hybrid_radius.is_none() {
            announce();
            return Ok(None);
        }
        let (args, instance) = (self.clone(), instance.clone());
        let populate = move || {
            let populated = connect(&instance, in_process).and_then(|mut client| {
                let counts = args.populate(&mut client, seed, weather)?;
                Ok((client, counts))
            });
            announce();
            let departed = populated.and_then(|(mut client, counts)| {
                args.report(counts);
                match departures {
                    Some(departures) => let_depart(departures, &mut client),
                    None => Ok(()),
                }
            });
            if let Err(why) = departed {
                log::error!("the road users of --vehicles, --walkers and --routes: {why:#}");
            }
        };
        let thread = std::thread::Builder::new().name("population".into());
        Ok(Some(thread.spawn(populate).context("population")?))
    }

    /// Returns how many vehicles and pedestrians there are then.
    fn populate(
        &self,
        client: &mut Client,
        seed: u64,
        weather: Option<Weather>,
    ) -> anyhow::Result<[usize; 2]> {
        if let Some(weather) = weather {
            client.request("weather", &[Command::SetWeather(weather)])?;
        }
        let traffic = TrafficEntry {
            vehicles: self.vehicles,
            walkers: self.walkers,
            driver_spread: self.driver_spread,
            hybrid_radius_m: self.hybrid_radius,
            ..TrafficEntry::default()
        };
        if self.cross_factor > 0.0 {
            let factor = TrafficParam::CrossFactor(self.cross_factor);
            client.set_traffic_param(ActorId::NONE, factor)?;
        }
        Ok(RoadUsers::anywhere(client, seed, traffic)?.counts())
    }

    fn report(&self, [vehicles, walkers]: [usize; 2]) {
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
    }
}

fn connect(instance: &Instance, in_process: bool) -> anyhow::Result<Client> {
    const NAME: &str = "population";
    let client = if in_process {
        Client::connect_in_process(instance, NAME)
    } else {
        Client::connect(Some(instance.id()), NAME)
    };
    Ok(client?)
}

/// Lets vehicles depart in the world of a client until the host ends, or all have arrived.
fn let_depart(mut departures: Departures, client: &mut Client) -> anyhow::Result<()> {
    let episode = client.world().episode();
    let mut in_barrier = false;
    let all = departures.waiting();
    loop {
        let ended = |why: &ClientError| matches!(why, ClientError::HostEnded { .. });
        match frame(&mut departures, client, &mut in_barrier) {
            Err(why) if ended(&why) => return Ok(()),
            Err(ClientError::Timeout { .. }) => {}
            done => done.context("vehicles of --routes")?,
        }
        if client.world().episode() != episode {
            log::warn!("another map was loaded: no more vehicles of --routes depart");
            break;
        }
        if departures.are_done() {
            print_line!("all {all} vehicles of --routes have arrived");
            break;
        }
    }
    if in_barrier {
        client.leave_barrier()?;
    }
    Ok(())
}

/// Does what is to be done in a frame, and waits for the next. In synchronous mode, ticks wait for that,
/// so that the frames of the departures do not depend on the speed of this process.
fn frame(
    departures: &mut Departures,
    client: &mut Client,
    in_barrier: &mut bool,
) -> Result<(), ClientError> {
    let is_synchronous = matches!(client.settings().pace, Pace::Synchronous);
    if is_synchronous != *in_barrier {
        if is_synchronous {
            client.join_barrier()?;
        } else {
            client.leave_barrier()?;
        }
        *in_barrier = is_synchronous;
    }
    departures.advance(client)?;
    if *in_barrier {
        client.arrive();
    }
    client.await_frame().map(drop)
}
