//! The run: ticks, matches each bundle with its snapshot, and queues both for the encoders.

use std::{
    collections::{BTreeMap, VecDeque},
    fmt,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
};

use bus::{ControlPageMapping, Role, clock};
use client_lib::{Client, ClientError, Measurement, SensorBundle, bundle_commands, wire::Settings};
use protocol::{
    ActorState, BundleId, BundleReceipt, Command, Episode, Frame, SnapshotHeader, WalkerLimbs,
    Weather,
};

use serde_json::{Value, json};

use crate::collect::{
    CollectError, Job, contact_sheet,
    departures::Departures,
    ego_sensors::{EgoSensors, ego_sensor_specs},
    encoders::{Bytes, DataSetContext, EncoderPool, FrameCounts, FrameData, Permit, make_folders},
    events::Event,
    folder::{Folder, write_atomically},
    format::{DataSetSettings, SpawnedActors, hash_text, tracer_name},
    map_lines::{LANES, LaneLines, LaneMap},
    metadata::{self, difference},
    objects::StaticObjects,
    plan::Plan,
    progress::Progress,
    road_users::{Cast, RoadUsers},
    sensors::{self, PlannedSensor},
    stages::Stages,
    tracks::{TRACKS, Tracks},
};

/// Frames that the encoders hold or that wait for them. A reader may hold 8.
const FRAMES_IN_FLIGHT_MAX: usize = 6;

/// The result of a run.
#[derive(Clone, Debug)]
pub(crate) struct Summary {
    /// The folder of the data set.
    pub(crate) dir: PathBuf,
    /// Frames of the whole data set.
    pub(crate) frames: u64,
    /// Images that this run wrote.
    pub(crate) images: u64,
    /// Bytes that this run wrote.
    pub(crate) bytes: u64,
    /// Where the time of this run went.
    pub(crate) stages: Stages,
    /// The actors at the start.
    pub(crate) spawned: SpawnedActors,
    /// The number of requested vehicles.
    pub(crate) vehicles: u32,
    /// What traced the rays.
    pub(crate) tracers: Vec<String>,
    /// The path of the contact sheet.
    pub(crate) contact_sheet: PathBuf,
}

impl Summary {
    /// Returns the last line of `--json`.
    pub(crate) fn json(&self) -> Value {
        let (limiting_stage, percent) = self.stages.bound();
        json!({
            "event": "complete",
            "dir": self.dir,
            "frames": self.frames,
            "frames_of_this_run": self.stages.frames,
            "images": self.images,
            "bytes": self.bytes,
            "seconds": self.stages.wall_nanos as f64 / 1e9,
            "frames_per_second": self.stages.rate_hz(),
            "limiting_stage": limiting_stage,
            "limiting_stage_percent": percent,
            "vehicles": self.spawned.vehicles_spawned,
            "tracers": self.tracers,
        })
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Summary { stages, spawned, .. } = self;
        let secs = stages.wall_nanos as f64 / 1e9;
        let megabytes = self.bytes as f64 / 1e6;
        let per_sec = |amount: f64| if secs > 0.0 { amount / secs } else { 0.0 };
        if stages.frames == 0 {
            writeln!(f, "all {} frames were complete already", self.frames)?;
            writeln!(f, "data set: {}", self.dir.display())?;
            return write!(f, "picture:  {}", self.contact_sheet.display());
        }
        writeln!(
            f,
            "{} frames in {secs:.1} s: {:.1} frames/s, {:.1} images/s, {megabytes:.1} MB written \
             ({:.1} MB/s)",
            stages.frames,
            stages.rate_hz(),
            per_sec(self.images as f64),
            per_sec(megabytes),
        )?;
        let (bound, share) = stages.bound();
        writeln!(f, "bound by {bound} ({share:.0} % of the time): {stages}")?;
        if self.frames != stages.frames {
            writeln!(f, "{} frames in total, including earlier runs", self.frames)?;
        }
        if spawned.vehicles_spawned < self.vehicles {
            let (stand, requested) = (spawned.vehicles_spawned, self.vehicles);
            writeln!(f, "the map has spawn points for {stand} of {requested} vehicles")?;
        }
        if let [first, .., last] = &self.tracers[..] {
            writeln!(
                f,
                "the tracer changed during the run, from {first} to {last}: see frames.jsonl"
            )?;
        }
        writeln!(f, "data set: {}", self.dir.display())?;
        write!(f, "picture:  {}", self.contact_sheet.display())
    }
}

/// Collects a data set from a synchronous world that this client ticks. `stop` ends the run early,
/// with complete files.
pub(crate) fn collect(
    job: Job,
    client: &mut Client,
    stop: &AtomicBool,
) -> Result<Summary, CollectError> {
    let Job {
        plan,
        scene,
        sensors,
        departures,
        folder,
        frame_list,
        lines,
        before,
        lock: _lock,
        ..
    } = job;
    let (pipeline, threads) = (job.pipeline, job.threads);
    let mut progress = Progress::new(job.json);
    progress.show_step("placing the road users");
    let delta_nanos = plan.delta_nanos();
    client.synchronise(std::time::Duration::from_nanos(delta_nanos))?;
    let still = Settings { pipeline, no_rendering: 1, ..client.wire_settings() };
    client.apply_wire_settings(still)?;

    let specs: Vec<_> = sensors.iter().map(|sensor| sensor.spec).collect();
    let ego_sensors: Vec<_> = ego_sensor_specs().into_iter().map(PlannedSensor::from).collect();
    let episode = client.instance().episode().map_err(ClientError::from)?;
    let settings = DataSetSettings {
        map: episode.map.clone(),
        map_fnv1a64: hash_text(mesh::fnv1a64(episode.open_drive.as_bytes())),
        seed: episode.seed,
        fixed_delta_nanos: delta_nanos,
        warmup_frames: plan.warmup,
        every_frames: plan.every,
        scene: scene.index,
        scene_seed: scene.seed,
        vehicles_requested: plan.traffic.vehicles,
        vehicles_near: plan.traffic.vehicles_near,
        driver_spread: Some(plan.traffic.driver_spread).filter(|spread| *spread != 1.0),
        hybrid_radius_m: plan.traffic.hybrid_radius_m,
        routes_fnv1a64: plan.demand.routes.as_deref().map(hash_file).transpose()?,
        routes_begin_secs: plan.demand.routes.is_some().then_some(plan.demand.begin_secs),
        vehicles_per_km: plan.traffic.vehicles_per_km,
        walkers_per_km: plan.traffic.walkers_per_km,
        walkers_requested: plan.traffic.walkers,
        traffic_radius_m: plan.traffic.radius_m,
        in_view: plan.traffic.in_view,
        weather: scene.weather.map(Into::into),
        sun_altitudes_deg: plan.sun_altitudes_deg.clone(),
        events: plan.events.clone(),
        ego_blueprint: plan.ego.blueprint.clone(),
        ego_route: scene.route.clone(),
        images: plan.images,
        labels: plan.labels,
        sensors: sensors.iter().chain(&ego_sensors).map(sensors::describe).collect(),
    };
    if let Some(before) = &before
        && let Some((key, recorded, requested)) = difference(&before.settings, &settings)
    {
        let dir = folder.root().to_owned();
        return Err(CollectError::OtherSettings { dir, key, recorded, requested });
    }

    let origin = client.frame();
    let weather = scene.weather.unwrap_or_default();
    client.request("weather", &[Command::SetWeather(weather)])?;
    let cast = Cast {
        map: &episode.map,
        seed: scene.seed,
        ego_blueprint: &plan.ego.blueprint,
        route: &scene.route,
        traffic: plan.traffic,
        sensors: &specs,
    };
    let (road_users, spawned) = RoadUsers::assemble(client, &cast)?;
    let ego = road_users.ego();
    let commands = bundle_commands("collect", ego, &specs, FRAMES_IN_FLIGHT_MAX as u32);
    let outcome = client.try_request("bundle", &commands)?[0];
    let bundle = client.open_bundle(BundleId(outcome.id()?), &specs)?;
    let receipt =
        outcome.into_entry().outcome.answered::<BundleReceipt>().expect("the bundle was created");
    let physics_sensors = client.create_bundle("ego_sensors", ego, ego_sensor_specs(), 1)?;

    // The metadata comes first: a run that is killed from here on can be resumed.
    let mut metadata = metadata::of(settings, spawned, &sensors, plan.frames);
    metadata.frames_complete = lines.len() as u64;
    folder.write_metadata(&metadata)?;
    make_folders(&folder, &metadata.outputs)?;
    folder.remove_partial_files(metadata.outputs.iter().map(|o| o.folder.as_str()))?;
    write_map(&folder, &episode)?;
    let objects = StaticObjects::load(client, &episode)?;
    let network = client.map()?;
    let lanes = LaneMap::new(&network, objects.traffic_light_heads(), client.world().states());
    lanes.write(&folder)?;

    let context = DataSetContext {
        folder: folder.clone(),
        tasks: sensors::tasks(&sensors),
        sensors,
        ego,
        blueprints: client.blueprints().to_vec(),
        objects,
        lanes: LaneLines::new(lanes),
        images: plan.images,
        labels: plan.labels,
    };
    let encoders = EncoderPool::start(context, frame_list, threads, FRAMES_IN_FLIGHT_MAX)?;
    let control = client.instance().control().map_err(ClientError::from)?;
    let mut run = Run {
        traffic: (0..bus::SLOTS).find(|i| control.slot(*i).role() == Some(Role::Traffic)),
        control,
        bundle,
        physics_sensors,
        ego_sensors: Vec::new(),
        encoders,
        awaited: VecDeque::new(),
        index: lines.len() as u64,
        wanted: plan.frames,
        first_kept: Frame(origin.0 + plan.warmup),
        kept: 0,
        road_users,
        departures,
        weather,
        sun_altitude_rad: None,
        events: plan.events.clone(),
        pipeline: pipeline as usize,
        receipt,
        plan: plan.clone(),
        stages: Stages { writers: threads as u32, ..Stages::default() },
        tracers: lines.iter().map(|line| line.tracer.clone()).collect(),
        progress,
        stop,
    };
    run.tracers.dedup();
    let recorded: BTreeMap<_, _> =
        lines.iter().map(|line| (line.frame, line.state_hash.as_str())).collect();
    let from = lines.last().map_or(origin.0 + plan.warmup, |line| line.frame);
    let ended = run
        .resimulate_to(client, Frame(from), &recorded)
        .map_err(|diverged| match diverged {
            ResumeError::At { frame, recorded, now } => {
                CollectError::Diverged { dir: folder.root().to_owned(), frame, recorded, now }
            }
            ResumeError::Error(error) => error,
        })
        .and_then(|()| run.measure(client, Settings { no_rendering: 0, ..still }));

    let Run { encoders, mut stages, tracers, progress, .. } = run;
    let (work, complete, written) = encoders.finish();
    drop(progress);
    stages.writing_nanos = work.busy_nanos;
    metadata.frames_complete = complete;
    metadata.tracers = tracers;
    // A failed write is the cause of any other error.
    if let Err(why) = written.and(ended) {
        let _ = folder.write_metadata(&metadata);
        let (why, dir) = (Box::new(why), folder.root().to_owned());
        return Err(match *why {
            CollectError::Diverged { .. } => *why,
            _ => CollectError::CutShort { why, dir, complete, wanted: plan.frames },
        });
    }
    let contact_sheet = contact_sheet::make(&folder, &metadata)?;
    let (lines, _) = super::frame_list::read(&folder.frames())?;
    Tracks::read(&folder, &lines)?.write(&folder)?;
    for name in ["frames.jsonl", MAP, LANES, TRACKS, contact_sheet::NAME] {
        let path = folder.root().join(name);
        let bytes = std::fs::read(&path).map_err(|e| CollectError::io(&path, e))?;
        metadata.files_crc32.insert(name.to_owned(), crc32fast::hash(&bytes));
    }
    metadata.complete = true;
    folder.write_metadata(&metadata)?;
    Ok(Summary {
        dir: folder.root().to_owned(),
        frames: complete,
        images: work.images,
        bytes: work.bytes,
        stages,
        spawned: metadata.spawned_actors,
        vehicles: plan.traffic.vehicles,
        tracers: metadata.tracers,
        contact_sheet,
    })
}

const MAP: &str = "map.xodr";

fn hash_file(path: &Path) -> Result<String, CollectError> {
    let bytes = std::fs::read(path).map_err(|e| CollectError::io(path, e))?;
    Ok(hash_text(mesh::fnv1a64(&bytes)))
}

fn write_map(folder: &Folder, episode: &Episode) -> Result<(), CollectError> {
    write_atomically(&folder.root().join(MAP), episode.open_drive.as_bytes())
}

/// A snapshot whose bundle has not arrived.
struct Awaited {
    header: SnapshotHeader,
    actors: Vec<ActorState>,
    limbs: Vec<WalkerLimbs>,
    weather: Weather,
    ego_sensors: Vec<EgoSensors>,
}

/// A measurement and the permit to hold it, dropped in this order.
struct HeldMeasurement {
    measurement: Measurement,
    _permit: Permit,
}

impl AsRef<[u8]> for HeldMeasurement {
    fn as_ref(&self) -> &[u8] {
        self.measurement.bytes()
    }
}

enum ResumeError {
    At { frame: u64, recorded: String, now: String },
    Error(CollectError),
}

impl<E: Into<CollectError>> From<E> for ResumeError {
    fn from(error: E) -> ResumeError {
        ResumeError::Error(error.into())
    }
}

struct Run<'a> {
    control: ControlPageMapping,
    traffic: Option<usize>,
    bundle: SensorBundle,
    physics_sensors: SensorBundle,
    /// Readings since the last frame that was kept.
    ego_sensors: Vec<EgoSensors>,
    encoders: EncoderPool,
    awaited: VecDeque<Awaited>,
    index: u64,
    wanted: u64,
    /// Frames after this one are kept, if a sensor measures.
    first_kept: Frame,
    /// Frames that were kept up to here, in this run or before.
    kept: u64,
    road_users: RoadUsers,
    departures: Option<Departures>,
    /// The weather of the next frame.
    weather: Weather,
    /// Events that are to come.
    events: Vec<Event>,
    /// The altitude that the sun was last set to.
    sun_altitude_rad: Option<f32>,
    pipeline: usize,
    receipt: BundleReceipt,
    plan: Plan,
    stages: Stages,
    tracers: Vec<String>,
    progress: Progress,
    stop: &'a AtomicBool,
}

impl Run<'_> {
    /// Simulates up to `frame` without rendering and compares the state hashes with the recorded
    /// ones.
    fn resimulate_to(
        &mut self,
        client: &mut Client,
        frame: Frame,
        recorded: &BTreeMap<u64, &str>,
    ) -> Result<(), ResumeError> {
        while client.frame() < frame {
            self.check_stop()?;
            self.send_commands(client)?;
            let here = client.tick()?;
            self.receive_ego_sensors()?;
            self.ego_sensors.clear();
            self.kept += u64::from(self.is_kept(client.world().header()));
            let now = hash_text(client.world().header().state_hash);
            if let Some(then) = recorded.get(&here.0)
                && *then != now
            {
                return Err(ResumeError::At { frame: here.0, recorded: (*then).to_owned(), now });
            }
            let what =
                if recorded.is_empty() { "warming up" } else { "simulating up to where it ended" };
            self.progress.show_frames(what, here.0, frame.0);
        }
        Ok(())
    }

    /// Keeps frames until there are as many as requested.
    fn measure(&mut self, client: &mut Client, settings: Settings) -> Result<(), CollectError> {
        if self.index >= self.wanted {
            return Ok(());
        }
        client.apply_wire_settings(settings)?;
        let began = clock::now_nanos();
        while self.index + (self.awaited.len() as u64) < self.wanted {
            self.check_stop()?;
            self.send_commands(client)?;
            client.tick()?;
            self.receive_ego_sensors()?;
            self.queue_snapshot(client);
            self.receive_bundles()?;
            if self.awaited.len() > self.pipeline {
                return Err(self.wrong_frame("nothing"));
            }
            self.show_progress(began);
        }
        while !self.awaited.is_empty() {
            self.check_stop()?;
            let permit = self.permit();
            let measurement = client.await_measurement(&mut self.bundle)?;
            self.submit(measurement, permit)?;
        }
        while self.encoders.complete() < self.wanted && !self.encoders.has_failed() {
            // Each of the last frames in flight returns a permit.
            let permits: Vec<_> = (0..FRAMES_IN_FLIGHT_MAX).map(|_| self.permit()).collect();
            self.show_progress(began);
            drop(permits);
        }
        self.stages.wall_nanos = clock::now_nanos() - began;
        Ok(())
    }

    /// Sends the commands of the next frame: weather, events, departures, and those that lead and replace
    /// road users.
    fn send_commands(&mut self, client: &mut Client) -> Result<(), CollectError> {
        let mut commands = self.road_users.advance(client)?;
        if let Some(departures) = &mut self.departures {
            departures.advance(client)?;
        }
        let after = client.frame().0.saturating_sub(self.first_kept.0);
        let before = self.weather;
        if let Some(sun_altitude_rad) = self.plan.sun_altitude_rad(self.kept)
            && self.sun_altitude_rad != Some(sun_altitude_rad)
        {
            self.weather.sun_altitude_rad = sun_altitude_rad;
            self.sun_altitude_rad = Some(sun_altitude_rad);
        }
        let elapsed_secs = after as f64 * self.plan.fixed_delta_secs;
        let is_due =
            |event: &mut Event| client.frame() >= self.first_kept && event.at_secs <= elapsed_secs;
        let due: Vec<_> = self.events.extract_if(.., is_due).collect();
        for event in due {
            if let Some(entry) = &event.weather {
                let weather = entry.weather_after(&self.weather);
                self.weather = weather.map_err(|why| CollectError::Argument(why.to_string()))?;
            }
            if let Some(crossing) = event.crossing {
                self.road_users.cross(client, crossing)?;
            }
        }
        if self.weather != before {
            commands.push(Command::SetWeather(self.weather));
        }
        if !commands.is_empty() {
            client.send(&commands)?;
        }
        Ok(())
    }

    fn check_stop(&self) -> Result<(), CollectError> {
        // The encoders report the error when they finish.
        let must_stop = self.stop.load(Ordering::Relaxed) || self.encoders.has_failed();
        if must_stop { Err(CollectError::Stopped) } else { Ok(()) }
    }

    /// Receives the readings of the ego's physics sensors.
    fn receive_ego_sensors(&mut self) -> Result<(), CollectError> {
        while let Some(measured) = self.physics_sensors.receive()? {
            self.ego_sensors.extend(EgoSensors::of(&measured));
        }
        Ok(())
    }

    /// Queues the snapshot of a frame that is kept.
    fn queue_snapshot(&mut self, client: &Client) {
        let header = *client.world().header();
        self.stages.add_snapshot(&header);
        if let Some(slot) = self.traffic {
            let (begin, end) = self.control.slot(slot).work_nanos();
            self.stages.planning_nanos += end.saturating_sub(begin);
        }
        if self.is_kept(&header) {
            self.kept += 1;
            let world = client.world();
            self.awaited.push_back(Awaited {
                header,
                actors: world.states().to_vec(),
                limbs: world.limbs().to_vec(),
                weather: self.weather,
                ego_sensors: std::mem::take(&mut self.ego_sensors),
            });
        }
    }

    /// Returns whether a frame is kept: one after the warm-up in which a sensor measures.
    fn is_kept(&self, header: &SnapshotHeader) -> bool {
        let mut sensors = self.bundle.sensors().iter();
        header.stamp.frame > self.first_kept
            && sensors.any(|spec| self.receipt.is_due(spec, header))
    }

    /// Receives every bundle that has arrived.
    fn receive_bundles(&mut self) -> Result<(), CollectError> {
        while !self.awaited.is_empty() {
            let permit = self.permit();
            let Some(measurement) = self.bundle.receive()? else { break };
            self.submit(measurement, permit)?;
        }
        Ok(())
    }

    fn permit(&mut self) -> Permit {
        let began = clock::now_nanos();
        let permit = self.encoders.permit();
        self.stages.waiting_nanos += clock::now_nanos() - began;
        permit
    }

    /// Queues a bundle and its snapshot for the encoders. Both must be of the same frame and state.
    fn submit(&mut self, measurement: Measurement, permit: Permit) -> Result<(), CollectError> {
        let header = *measurement.header();
        let due = self.awaited.front().expect("only what is awaited is taken in").header;
        if (header.stamp.frame, header.state_hash) != (due.stamp.frame, due.state_hash) {
            let hash = hash_text(header.state_hash);
            return Err(self.wrong_frame(&format!("{} (state hash {hash})", header.stamp.frame)));
        }
        let planes = measurement.planes().to_vec();
        for (index, spec) in self.bundle.sensors().iter().enumerate() {
            let measured = planes.iter().any(|plane| plane.sensor as usize == index);
            if measured != self.receipt.is_due(spec, &due) {
                let (frame, name) = (due.stamp.frame, spec.name.as_str());
                let why = format!("{frame}: sensor {name:?} is due: {}", !measured);
                return Err(CollectError::Bug { what: "measuring at a rate", why });
            }
        }
        let Awaited { actors, limbs, weather, ego_sensors, .. } =
            self.awaited.pop_front().expect("it is there");
        self.stages.add_bundle(&header);
        self.stages.frames += 1;
        let tracer = tracer_name(header.tracer);
        if self.tracers.last().is_none_or(|last| last != tracer) {
            self.tracers.push(tracer.to_owned());
        }
        let bytes: Bytes = Box::new(HeldMeasurement { measurement, _permit: permit });
        let counts = FrameCounts::default();
        self.encoders.submit(FrameData {
            index: self.index,
            header,
            planes,
            bytes,
            actors,
            limbs,
            weather,
            ego_sensors,
            counts,
        });
        self.index += 1;
        Ok(())
    }

    fn wrong_frame(&self, measured: &str) -> CollectError {
        let due = self.awaited.front().map_or_else(SnapshotHeader::default, |a| a.header);
        CollectError::WrongFrame {
            frame: due.stamp.frame.0,
            hash: hash_text(due.state_hash),
            measured: measured.to_owned(),
        }
    }

    fn show_progress(&mut self, began: u64) {
        self.stages.wall_nanos = clock::now_nanos() - began;
        self.stages.writing_nanos = self.encoders.work().busy_nanos;
        self.progress.show(self.encoders.complete(), self.wanted, &self.stages);
    }
}
