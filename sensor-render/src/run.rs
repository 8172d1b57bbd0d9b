//! The renderer's process: a snapshot in, a bundle for every bundle that is due, out.

use std::{path::PathBuf, sync::Arc};

use bake::{Cache, MapError};
use bus::{
    Event, Instance, Interrupted, Participant, RenderPorts, Role, Snapshot, Writer, clock, fault,
};
use protocol::{
    ActorState, BundleHeader, BundleId, Command, Episode, Frame, GivenPoses, JournalEntry, Name,
    Page, SensorSpec, SnapshotHeader, Weather, layout, sensor, status,
};
use town::{Lighting, StreetLightState, Visibility};

use crate::{
    BundleJob, Device, MeshList, Scene, Tracer, World,
    baked::{cached_scene, keep_scene},
    bundles::{Bundles, Due},
    gallery::Gallery,
    pose_planes,
    scene::Replaced,
};

/// How the renderer is started.
#[derive(Clone, Debug, Default)]
pub struct RenderConfig {
    /// What traces the rays.
    pub device: Device,
    /// Trace nothing: bundles hold their table and whatever was in memory.
    pub null: bool,
    /// Threads of the CPU tracer; 0: one for each core.
    pub threads: usize,
    /// A list of files that replace meshes.
    pub meshes: Option<PathBuf>,
}

/// Why the renderer ended before its host did.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] bus::BusError),
    /// The tracer.
    #[error(transparent)]
    Trace(#[from] crate::TraceError),
    /// The list of files that replace meshes.
    #[error(transparent)]
    Meshes(#[from] crate::MeshListError),
    /// The map, which the host could read.
    #[error("{0}")]
    Map(String),
}

/// Renders for the host of `instance` until it ends.
pub fn run(
    instance: &Instance,
    slot: usize,
    within: bool,
    config: RenderConfig,
) -> Result<(), RenderError> {
    let name = Name::new(Role::Render.name());
    let participant = Participant::join(instance, Role::Render, name, Some(slot), within)?;
    fault::joining(Role::Render);
    let (number, episode) = instance.numbered_episode()?;
    let cache = Cache::from_environment();
    let replaced = match &config.meshes {
        None => Vec::new(),
        Some(list) => MeshList::read(list)?.load(),
    };
    let is_replaced = config.meshes.is_some();
    let scene = Arc::new(scene_for(&cache, &episode, is_replaced.then_some(&replaced))?);
    let tracer =
        if config.null { Tracer::Null } else { Tracer::open(config.device, config.threads)? };
    let mut ports = RenderPorts::open(participant.node()?)?;
    ports.journal.await_keyframe();
    participant.ready()?;
    let done = participant.words().ack();
    let first = done.next();
    let mut renderer = Renderer {
        tracer,
        participant,
        ports,
        scene,
        world: World::new(),
        weather: Weather::default(),
        cache,
        number,
        episode,
        hidden: Visibility::default(),
        hidden_in_scene: Visibility::default(),
        is_replaced,
        replaced,
        bundles: Bundles::default(),
        gallery: Gallery::default(),
        lighting: Lighting::default(),
        before: Vec::new(),
        is_rendering: true,
        done,
        first,
    };
    renderer.import_payloads();
    loop {
        match renderer.participant.next_frame(renderer.done, None) {
            Ok(newest) => renderer.work_up_to(newest)?,
            Err(Interrupted::HostEnds | Interrupted::Deadline) => return Ok(()),
        }
    }
}

struct Renderer {
    /// Dropped before the memory that it may have imported.
    tracer: Tracer,
    participant: Participant,
    ports: RenderPorts,
    scene: Arc<Scene>,
    world: World,
    weather: Weather,
    cache: Cache,
    /// Which of its host's worlds is shown.
    number: u32,
    episode: Episode,
    /// What of the town is switched off, and what was when the scene was built.
    hidden: Visibility,
    hidden_in_scene: Visibility,
    /// Looks out of files, if a list of them was given.
    is_replaced: bool,
    replaced: Vec<Replaced>,
    bundles: Bundles,
    /// What is drawn over the world.
    gallery: Gallery,
    /// What street lamps were told.
    lighting: Lighting,
    /// The actors of the frame before, while anybody asks how they move.
    before: Vec<ActorState>,
    is_rendering: bool,
    /// Everything up to here is measured.
    done: Frame,
    /// The first frame of this life.
    first: Frame,
}

impl Renderer {
    /// Payloads are written where their readers find them, where the device can.
    fn import_payloads(&mut self) {
        #[expect(unsafe_code, reason = "a promise about the memory of bundles")]
        // SAFETY: a bundle's bundles lie in one pool of static allocation, which stays mapped as long
        // as its writer lives; before a writer goes (`remove`), and before `self` does, all
        // imports are forgotten.
        unsafe {
            self.tracer.import_payloads();
        }
    }

    fn remove(&mut self, bundle: BundleId) {
        self.tracer.forget_imports();
        self.bundles.remove(bundle);
        self.import_payloads();
    }

    /// Measures every frame that has come; in asynchronous mode only the newest.
    fn work_up_to(&mut self, newest: Frame) -> Result<(), RenderError> {
        let every = self.participant.control().is_synchronous();
        let mut latest = None;
        while self.done < newest {
            let Some(snapshot) = self.ports.snapshot.receive()? else { break };
            let frame = snapshot.header().stamp.frame;
            if frame <= self.done {
                // A predecessor measured it.
                self.remember(&snapshot);
                // What was given then is not known; most likely it is what stands now.
                self.world.poses_before = None;
                continue;
            }
            if every {
                self.measure(&snapshot)?;
            } else {
                self.participant.words().add_missed(latest.is_some().into());
                latest = Some(snapshot);
            }
        }
        if let Some(snapshot) = latest {
            self.measure(&snapshot)?;
        }
        // What was overrun before we could read it is not to come.
        if self.done < newest {
            self.participant.words().add_missed(newest.0 - self.done.0);
            self.arrive(newest);
        }
        Ok(())
    }

    fn arrive(&mut self, frame: Frame) {
        self.done = frame;
        self.participant.arrive(frame);
    }

    fn measure(&mut self, snapshot: &Snapshot) -> Result<(), RenderError> {
        let header = snapshot.header();
        let frame = header.stamp.frame;
        self.participant.begin();
        let begin_nanos = clock::now_nanos();
        fault::delay(Role::Render, frame);
        self.follow_journal(frame)?;
        self.gallery.begin(header.stamp);
        if self.is_rendering {
            self.measure_rigs(snapshot, begin_nanos)?;
            if self.bundles.ask_for_flow() {
                self.remember(snapshot);
            }
        }
        fault::point(Role::Render, "sent", frame, self.first);
        self.arrive(frame);
        fault::point(Role::Render, "acked", frame, self.first);
        Ok(())
    }

    fn remember(&mut self, snapshot: &Snapshot) {
        self.before.clear();
        self.before.extend_from_slice(snapshot.actors());
        self.world.limbs_before.clear();
        self.world.limbs_before.extend_from_slice(snapshot.limbs());
        self.world.poses_before = Some(self.world.poses.clone());
    }

    fn measure_rigs(&mut self, snapshot: &Snapshot, begin_nanos: u64) -> Result<(), RenderError> {
        let header = snapshot.header();
        let mut due = self.bundles.due(header, snapshot.actors());
        if due.is_empty() {
            return Ok(());
        }
        if self.hidden != self.hidden_in_scene {
            self.build_scene()?;
        }
        self.world.limbs.clear();
        self.world.limbs.extend_from_slice(snapshot.limbs());
        self.world.place(
            &self.scene,
            header.stamp,
            header.delta_nanos,
            &self.weather,
            snapshot.actors(),
            |actor| {
                let [r, g, b, _] = actor.color.to_le_bytes();
                [r, g, b]
            },
        );
        if self.bundles.ask_for_flow() {
            self.world.follow(&self.scene, &self.before, snapshot.actors());
        }
        self.world.draw(self.gallery.overlay());
        let mut loans = Vec::with_capacity(due.len());
        for bundle in &due {
            let writer = self.bundles.writer(bundle.id);
            loans.push(writer.loan(bundle.byte_len.div_ceil(4096) as usize)?);
        }
        let mut jobs: Vec<BundleJob> = due
            .iter_mut()
            .zip(&mut loans)
            .map(|(bundle, loan)| {
                let sensors: &[SensorSpec] = self.bundles.sensors(bundle.id);
                pose_planes(&mut bundle.planes, sensors, &bundle.world_from_parent);
                let out = bytemuck::cast_slice_mut(loan.payload_mut());
                BundleJob { parent: bundle.parent, sensors, planes: &bundle.planes, out }
            })
            .collect();
        self.tracer.measure(&self.scene, &self.world, &mut jobs)?;
        drop(jobs);
        fault::point(Role::Render, "loan_held", header.stamp.frame, self.first);
        for (bundle, loan) in due.iter().zip(loans) {
            loan.send(self.bundle_header(header, bundle, begin_nanos))?;
        }
        Ok(())
    }

    /// Another world was loaded; the bundles of the old one were taken away before.
    fn begin_episode(&mut self, number: u32) -> Result<(), RenderError> {
        self.weather = Weather::default();
        self.hidden = Visibility::default();
        self.gallery.clear();
        self.relight(Lighting::default());
        self.before.clear();
        // One that was started since then has read the map already.
        if number == self.number {
            return Ok(());
        }
        let (number, episode) = self.participant.instance().numbered_episode()?;
        if episode != self.episode {
            let replaced = self.is_replaced.then_some(&self.replaced[..]);
            self.scene = Arc::new(scene_for(&self.cache, &episode, replaced)?);
            self.hidden_in_scene = Visibility::default();
        }
        (self.number, self.episode) = (number, episode);
        Ok(())
    }

    /// The scene without what is switched off.
    fn build_scene(&mut self) -> Result<(), RenderError> {
        let Episode { map, open_drive, seed } = &self.episode;
        let town = self.cache.town(map, open_drive, *seed).map_err(map_error)?;
        let town = town.visible(&self.hidden);
        // What blueprints look like has not changed.
        let scene = self.scene.refurnished(&town);
        let scene = scene.unwrap_or_else(|| Scene::furnished(&town, &self.replaced));
        self.scene = Arc::new(scene);
        self.hidden_in_scene = self.hidden.clone();
        Ok(())
    }

    fn bundle_header(
        &self,
        header: &SnapshotHeader,
        bundle: &Due,
        begin_nanos: u64,
    ) -> BundleHeader {
        BundleHeader {
            stamp: header.stamp,
            bundle: bundle.id,
            plane_count: bundle.planes.len() as u32,
            byte_len: bundle.byte_len,
            state_hash: header.state_hash,
            world_from_parent: bundle.world_from_parent,
            parent: bundle.parent,
            tracer: self.tracer.code(&bundle.planes),
            reserved: 0,
            begin_nanos,
            end_nanos: clock::now_nanos(),
        }
    }

    /// Takes in what was requested up to `frame`. If parts were missed, asks for the standing state.
    fn follow_journal(&mut self, frame: Frame) -> Result<(), RenderError> {
        if self.ports.journal.poll()? {
            self.participant.words().request_keyframe();
            self.participant.control().host.ring();
            while self.ports.journal.poll()? && !self.participant.is_over() {
                std::thread::sleep(std::time::Duration::from_micros(200));
            }
        }
        for event in self.ports.journal.until(frame) {
            match event {
                Event::Anew => {
                    self.bundles.begin_anew();
                    self.weather = Weather::default();
                    self.hidden = Visibility::default();
                    self.gallery.clear();
                    self.world.poses = GivenPoses::default();
                    self.relight(Lighting::default());
                }
                Event::Entry(_, entry) if entry.outcome.status == status::DONE => {
                    self.obey(&entry)?;
                }
                Event::Entry(..) => {}
            }
        }
        Ok(())
    }

    fn relight(&mut self, lighting: Lighting) {
        self.world.light(&lighting);
        self.lighting = lighting;
    }

    fn obey(&mut self, entry: &JournalEntry) -> Result<(), RenderError> {
        let id = BundleId(entry.outcome.id);
        let command = entry.command.decode();
        command.iter().for_each(|command| self.world.poses.follow(command));
        match command {
            Some(Command::CreateBundle(bundle)) => {
                self.bundles.announce(id, bundle.parent, bundle.sensor_count)
            }
            // The host measures these itself.
            Some(Command::Sensor(spec)) if sensor::is_physics_sensor(spec.kind) => {
                self.bundles.remove(id)
            }
            Some(Command::Sensor(spec)) => {
                if let Some(sensors) = self.bundles.add(id, spec) {
                    let (planes, byte_len) = layout(sensors);
                    let writer = match self.bundles.take_writer(id) {
                        Some(writer) => writer,
                        None => match self.ports.bundle(id, byte_len) {
                            Ok(writer) => writer,
                            // Taken away before its first frame: a line that says so follows.
                            Err(e) if e.is_missing_channel() => return Ok(()),
                            Err(e) => return Err(e.into()),
                        },
                    };
                    self.bundles.mount(id, planes, byte_len, writer);
                }
            }
            Some(Command::DestroyBundle(bundle)) => self.remove(bundle),
            Some(Command::LoadMap(_)) => self.begin_episode(entry.outcome.id)?,
            Some(Command::SetWeather(weather)) => self.weather = weather,
            Some(Command::HideLayers(to)) => self.hidden.set_layers(to.layers, to.hidden != 0),
            Some(Command::HideObjects(to)) => {
                self.hidden.set_objects(to.block, &to.bits, to.hidden != 0);
            }
            // What was saved with the state follows.
            Some(Command::LoadState(_)) => {
                self.hidden = Visibility::default();
                self.gallery.clear();
                self.relight(Lighting::default());
            }
            Some(Command::SetStreetLights(to)) => {
                let mut lighting = std::mem::take(&mut self.lighting);
                let shine =
                    StreetLightState { mode: to.mode, color: to.color, share: to.intensity };
                lighting.set(to.block, &to.bits, shine);
                self.relight(lighting);
            }
            Some(Command::Draw(shape)) => self.gallery.draw(&shape, entry),
            Some(Command::EraseShapes(erase)) => self.gallery.erase(&erase),
            Some(Command::SetSettings(settings)) => self.is_rendering = settings.no_rendering == 0,
            _ => {}
        }
        Ok(())
    }
}

/// The scene of a world, out of the cache where it is there; `replaced`: with looks out of files.
fn scene_for(
    cache: &Cache,
    episode: &Episode,
    replaced: Option<&[Replaced]>,
) -> Result<Scene, RenderError> {
    if let Some(replaced) = replaced {
        let Episode { map, open_drive, seed } = episode;
        let town = cache.town(map, open_drive, *seed).map_err(map_error)?;
        return Ok(Scene::furnished(&town, replaced));
    }
    let (scene, is_new) = cached_scene(cache, episode).map_err(map_error)?;
    if is_new {
        // At once: who is stopped a second later has not built it in vain.
        keep_scene(cache, episode, &scene);
    }
    Ok(scene)
}

fn map_error(error: MapError) -> RenderError {
    RenderError::Map(error.to_string())
}

/// A bundle's writing end.
pub(crate) type RigWriter = Writer<BundleHeader, Page>;
