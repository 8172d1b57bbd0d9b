//! `omnibus gallery`: one picture of each place under every light, for people that judge images.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::Ordering,
};

use anyhow::{Context, ensure};
use client_lib::{CameraEffects, ClientError, Exposure, Sensor, SensorBundle};
use glam::{Quat, vec3};
use image_file::Pixels;
use protocol::{Command, Pose, Settings, Weather};

use crate::{
    collect::{
        Cast, EGO, Encoder, Image, RoadUsers, Sheet, TrafficEntry, WeatherEntry, jpeg, mean,
        sun_rad,
    },
    launch::WorldArgs,
    run::{BackgroundHost, stop_on_signals},
};

/// Arguments of `omnibus gallery`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct GalleryArgs {
    /// With --map, the place is of that map; without it, there is one of each named map
    #[command(flatten)]
    world: WorldArgs,
    /// The folder to write; it must not exist
    #[arg(long)]
    out: PathBuf,
    /// Width of the pictures in pixels
    #[arg(long, default_value_t = 1280)]
    width: u32,
    /// Height of the pictures in pixels
    #[arg(long, default_value_t = 720)]
    height: u32,
    /// Frames that traffic drives before the pictures
    #[arg(long, default_value_t = 120)]
    warmup: u32,
}

/// Lights: name, weather, and hour of the day.
const LIGHTS: [(&str, &str, f32); 5] = [
    ("day", "clear", 13.5),
    ("dusk", "cloudy", 17.75),
    ("night", "clear", 22.0),
    ("rain", "rain", 11.0),
    ("fog", "fog", 9.0),
];

/// Seeds under which the ego of a named map stands at a place that shows the map's character.
const SEEDS: [(&str, u64); 8] = [
    ("Millbrook", 1),
    ("Flatford", 1),
    ("Greatmoor", 1),
    ("Altmarkt", 1),
    ("Fernhill", 1),
    ("Swanringway", 1),
    ("Longreach", 1),
    ("Hollowdale", 1),
];

/// Exposure values between which the camera of the pictures exposes: streets at night stay darker than by day.
const EV_LIMITS: [f32; 2] = [14.3, 16.0];

/// Width of a picture on the sheet, in pixels.
const TILE_WIDTH: usize = 320;
const SHEET_QUALITY: u8 = 85;

/// Writes the pictures, `PLACE-LIGHT.png`, and `gallery.jpg` with small versions of all.
pub(crate) fn gallery(args: &GalleryArgs) -> anyhow::Result<()> {
    let GalleryArgs { world, out, width, height, .. } = args;
    for (option, pixels) in [("--width", *width), ("--height", *height)] {
        ensure!((16..=8192).contains(&pixels), "{option} is {pixels}; use 16 to 8192");
    }
    ensure!(!out.exists(), "{} exists; name another folder with --out", out.display());
    let places: Vec<(String, u64)> = match &world.map {
        Some(map) => vec![(map.clone(), world.seed())],
        None => SEEDS.map(|(map, seed)| (map.to_owned(), world.seed.unwrap_or(seed))).to_vec(),
    };
    let stop = stop_on_signals()?;
    fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let tile = [TILE_WIDTH, (TILE_WIDTH * *height as usize / *width as usize).max(1)];
    let mut sheet = Sheet::new(LIGHTS.len(), places.len(), tile);
    for (row, (map, seed)) in places.iter().enumerate() {
        let world = WorldArgs { map: Some(map.clone()), seed: Some(*seed), ..world.clone() };
        let place =
            Path::new(map).file_stem().map_or(map.clone(), |stem| stem.to_string_lossy().into());
        let mut street = Street::open(&world, args)?;
        for (column, (light, preset, hour)) in LIGHTS.into_iter().enumerate() {
            ensure!(!stop.load(Ordering::Acquire), "stopped before {place} at {light}");
            let picture = street.picture(&weather(preset, hour)?)?;
            let path = out.join(format!("{place}-{light}.png"));
            let mut encoder = Encoder::default();
            encoder.picture([*width, *height], &picture.bytes)?;
            fs::write(&path, &encoder.file).with_context(|| path.display().to_string())?;
            let scale = *width as f32 / TILE_WIDTH as f32;
            sheet.draw(column, row, |x, y| mean(&picture, [x, y], scale));
            print_line!("{}", path.display());
        }
        street.end()?;
    }
    let path = out.join("gallery.jpg");
    let mut file = Vec::new();
    let size = [sheet.width, sheet.height].map(|pixels| pixels as u32);
    jpeg(size, Pixels::Rgb(&sheet.pixels), SHEET_QUALITY, &mut file)?;
    fs::write(&path, &file).with_context(|| path.display().to_string())?;
    print_line!("{}", path.display());
    Ok(())
}

fn weather(preset: &str, hour: f32) -> anyhow::Result<Weather> {
    let [sun_altitude_rad, sun_azimuth_rad] = sun_rad(hour);
    Ok(Weather { sun_altitude_rad, sun_azimuth_rad, ..WeatherEntry::preset(preset).weather()? })
}

/// Returns the effects of an ordinary camera.
fn effects() -> CameraEffects {
    let [ev_min, ev_max] = EV_LIMITS;
    CameraEffects::NONE
        .exposure(Exposure::Automatic { ev_min, ev_max })
        .compensation_ev(0.4)
        .vignette(0.35)
        .bloom(0.03)
        .bloom_radius(0.008)
        .chromatic_aberration(0.0002)
        .white_electrons(Some(14_000.0))
        .read_electrons(5.0)
}

/// A car in a populated street, and the camera behind its windscreen.
struct Street {
    host: BackgroundHost,
    client: client_lib::Client,
    bundle: SensorBundle,
    size: [usize; 2],
}

impl Street {
    fn open(world: &WorldArgs, args: &GalleryArgs) -> anyhow::Result<Street> {
        let settings = Settings { no_rendering: 1, ..Settings::default() };
        let host = BackgroundHost::start(world, settings)?;
        let mut client = host.connect("gallery")?;
        client.synchronise(std::time::Duration::from_millis(50))?;
        let map = client.instance().episode().map_err(ClientError::from)?.map;
        let (position, turn) = (vec3(1.5, 0.0, 1.6), Quat::from_rotation_y(0.03));
        let camera =
            Sensor::camera("windscreen", Pose::new(position, turn), args.width, args.height, 1.3)
                .effects(effects());
        let sensors = [protocol::SensorSpec::from(camera)];
        let cast = Cast {
            map: &map,
            seed: world.seed(),
            ego_blueprint: EGO,
            route: &[],
            traffic: TrafficEntry {
                vehicles: 80,
                vehicles_near: 50,
                walkers: 60,
                ..TrafficEntry::default()
            },
            sensors: &sensors,
        };
        let (mut road_users, _) = RoadUsers::assemble(&mut client, &cast)?;
        let bundle = client.create_bundle("gallery", road_users.ego(), sensors, 1)?;
        for _ in 0..args.warmup {
            let commands = road_users.advance(&mut client)?;
            if !commands.is_empty() {
                client.send(&commands)?;
            }
            client.tick()?;
        }
        let settings = Settings { no_rendering: 0, ..client.wire_settings() };
        client.apply_wire_settings(settings)?;
        Ok(Street { host, client, bundle, size: [args.width as usize, args.height as usize] })
    }

    /// Returns the picture of the second frame under this weather: the lamps of vehicles follow the weather
    /// one frame later.
    fn picture(&mut self, weather: &Weather) -> anyhow::Result<Image> {
        self.client.request("weather", &[Command::SetWeather(*weather)])?;
        self.client.tick()?;
        let (frame, measured) = self.client.tick_and_collect(&mut [&mut self.bundle])?;
        let measured = measured.into_iter().flatten().next();
        let measured = measured.with_context(|| format!("{frame} has no image"))?;
        let colors = measured.color(0).with_context(|| format!("{frame} has no colour image"))?;
        let bytes = colors.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
        let [width, height] = self.size;
        Ok(Image { width, height, bytes })
    }

    fn end(self) -> anyhow::Result<()> {
        let Street { host, client, bundle, .. } = self;
        drop((bundle, client));
        host.end().map(drop)
    }
}
