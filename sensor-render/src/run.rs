//! Process of the renderer: receives snapshots and sends one sample for every bundle that is due.

use std::{path::PathBuf, sync::Arc};

use bake::Cache;
use bus::{
    BusError, DeviceInstant, Event, Instance, Participant, RenderPorts, Role, SlotInstant,
    Snapshot, clock, fault,
};
use protocol::{
    ActorState, BundleHeader, BundleId, BundleReceipt, Command, CommandGroup, Episode, Frame,
    HiddenObjects, JournalEntry, Name, SensorSpec, SnapshotHeader, StandingState, WorldCommand,
    layout, sensor, status,
};

use crate::{
    baked::scene_from,
    bundles::{Bundles, DueBundle},
    device::Device,
    job::BundleJob,
    meshes::MeshList,
    overlay::Overlay,
    quality::Quality,
    rays::pose_planes,
    run_error::RenderError,
    scene::{Replaced, Scene},
    tracer::Tracer,
    world::World,
};

/// Start-up options of the renderer.
#[derive(Clone, Debug, Default)]
pub struct RenderConfig {
    /// Device that traces the rays.
    pub device: Device,
    /// Trace nothing: samples hold the table of planes, and their other bytes are unspecified.
    pub null: bool,
    /// Number of threads of the CPU tracer; 0 means one per core.
    pub threads: usize,
    /// Rays per pixel of the colour images of cameras that ask for no quality.
    pub quality: Quality,
    /// TOML list of glTF files that replace the meshes of blueprints.
    pub meshes: Option<PathBuf>,
}

/// Renders for the host of `instance` until the host ends.
///
/// `slot` is the slot on the control page that the host reserved. With `within`, the renderer is a
/// thread of the process of the host.
///
/// # Errors
/// [`RenderError`] if the bus, the map, the mesh list or the tracer fails.
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
    let ports = RenderPorts::open(participant.node()?)?;
    participant.ready()?;
    let done = participant.words().ack();
    let first = done.next();
    let mut world = World::new();
    world.set_quality(config.quality);
    let mut renderer = Renderer {
        tracer,
        participant,
        ports,
        scene,
        world,
        standing: StandingState::default(),
        cache,
        number,
        episode,
        hidden_in_scene: HiddenObjects::default(),
        is_replaced,
        replaced,
        bundles: Bundles::default(),
        drawn_revision: 0,
        before: Vec::new(),
        done,
        first,
    };
    renderer.import_payloads();
    loop {
        match renderer.work_on_next() {
            Err(RenderError::Bus(BusError::HostEnds)) => return Ok(()),
            worked => worked?,
        }
    }
}

struct Renderer {
    /// Declared before `bundles`, so that it is dropped before the memory that it may have
    /// imported.
    tracer: Tracer,
    participant: Participant,
    ports: RenderPorts,
    scene: Arc<Scene>,
    world: World,
    /// The persistent switches, as the journal sets them.
    standing: StandingState,
    cache: Cache,
    /// Number of the episode that is rendered.
    number: u32,
    episode: Episode,
    /// Layers and objects that are hidden in `scene`.
    hidden_in_scene: HiddenObjects,
    /// Whether a mesh list was given, and the geometry that was loaded from it.
    is_replaced: bool,
    replaced: Vec<Replaced>,
    bundles: Bundles,
    /// [`protocol::DebugShapes::revision`] of the shapes that the tracer draws.
    drawn_revision: u64,
    /// Actors of the previous frame; kept while a sensor depends on their motion.
    before: Vec<ActorState>,
    /// Last frame that was measured.
    done: Frame,
    /// First frame after this process joined.
    first: Frame,
}

impl Renderer {
    /// Lets the device write into the payloads themselves, if it can import host memory.
    fn import_payloads(&mut self) {
        #[expect(unsafe_code, reason = "a promise about the memory of bundles")]
        // SAFETY: the samples of a bundle lie in one pool of static allocation, which stays mapped
        // as long as its writer lives. Imports are forgotten before a writer is dropped (`remove`)
        // and before `self` is.
        unsafe {
            self.tracer.import_payloads();
        }
    }

    fn remove(&mut self, bundle: BundleId) {
        self.tracer.forget_imports();
        self.bundles.remove(bundle);
        self.import_payloads();
    }

    /// Waits for a frame and measures it.
    fn work_on_next(&mut self) -> Result<(), RenderError> {
        let Renderer { participant, ports, done, .. } = &mut *self;
        let newest = participant.next_stage_frame(*done, &mut ports.journal)?;
        self.work_up_to(newest)
    }

    /// Measures every published frame up to `newest`; in asynchronous mode only the newest.
    fn work_up_to(&mut self, newest: Frame) -> Result<(), RenderError> {
        while self.done < newest {
            let Renderer { participant, ports, done, before, world, .. } = &mut *self;
            let due = participant.next_snapshot(&ports.snapshot, *done, |measured| {
                // A previous renderer process has measured this frame.
                remember_actors(before, world, measured);
                // The poses given at that frame are unknown; the current ones are the best
                // estimate.
                world.poses_before = None;
            })?;
            if let Some(snapshot) = due {
                self.measure(&snapshot)?;
            } else {
                participant.arrive_without(*done, newest);
                *done = newest;
            }
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
        self.participant.begin(frame);
        let begin_nanos = clock::now_nanos();
        fault::delay(Role::Render, frame);
        self.apply_journal(header)?;
        self.standing.shapes.begin_frame(header.stamp);
        if self.standing.settings.no_rendering == 0 {
            self.measure_bundles(snapshot, begin_nanos)?;
            if self.bundles.needs_motion() {
                remember_actors(&mut self.before, &mut self.world, snapshot);
            }
        }
        fault::point(Role::Render, "sent", frame, self.first);
        self.arrive(frame);
        fault::point(Role::Render, "acked", frame, self.first);
        Ok(())
    }

    fn measure_bundles(
        &mut self,
        snapshot: &Snapshot,
        begin_nanos: u64,
    ) -> Result<(), RenderError> {
        let header = snapshot.header();
        let mut due = self.bundles.due(header, snapshot.actors());
        if due.is_empty() {
            return Ok(());
        }
        if self.standing.hidden != self.hidden_in_scene {
            self.build_scene()?;
        }
        self.world.limbs.clear();
        self.world.limbs.extend_from_slice(snapshot.limbs());
        self.world.place(
            &self.scene,
            header.stamp,
            header.delta_nanos,
            &self.standing.weather,
            snapshot.actors(),
            paint,
        );
        if self.bundles.needs_motion() {
            self.world.track_motion(&self.scene, &self.before, snapshot.actors());
            let sensors = due.iter().flat_map(|bundle| self.bundles.sensors(bundle.id));
            let actors = snapshot.actors();
            self.world.place_slices(&self.scene, &self.before, actors, sensors, paint);
        }
        let shapes = &self.standing.shapes;
        if self.drawn_revision != shapes.revision() {
            self.drawn_revision = shapes.revision();
            self.world.set_overlay(Arc::new(Overlay::new(shapes.shapes())));
        }
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
        let frame = header.stamp.frame;
        if let Some(times) = self.tracer.device_times() {
            self.participant.mark_device(DeviceInstant::Begun, frame, times.begun_nanos);
            self.participant.mark_device(DeviceInstant::Traced, frame, times.traced_nanos);
            self.participant.mark_device(DeviceInstant::Copied, frame, times.copied_nanos);
        }
        self.participant.mark(SlotInstant::Worked, frame);
        fault::point(Role::Render, "loan_held", frame, self.first);
        for (bundle, loan) in due.iter().zip(loans) {
            loan.send(self.bundle_header(header, bundle, begin_nanos))?;
        }
        Ok(())
    }

    /// Starts episode `number`. The bundles of the previous episode were destroyed before.
    fn begin_episode(&mut self, number: u32) -> Result<(), RenderError> {
        self.before.clear();
        // A renderer that started after the map was loaded has read the map already.
        if number == self.number {
            return Ok(());
        }
        let (number, episode) = self.participant.instance().numbered_episode()?;
        if episode != self.episode {
            let replaced = self.is_replaced.then_some(&self.replaced[..]);
            self.scene = Arc::new(scene_for(&self.cache, &episode, replaced)?);
            self.hidden_in_scene = HiddenObjects::default();
        }
        (self.number, self.episode) = (number, episode);
        Ok(())
    }

    /// Rebuilds the scene without the hidden layers and objects.
    fn build_scene(&mut self) -> Result<(), RenderError> {
        let Episode { map, open_drive, seed } = &self.episode;
        let town = self.cache.town(map, open_drive, *seed)?;
        let hidden = &self.standing.hidden;
        let town = town.visible(|number, layer| hidden.hides(number, layer.bit()));
        // The geometry of the blueprints is unchanged and is reused.
        let scene = match self.scene.with_town(&town)? {
            Some(scene) => scene,
            None => Scene::of_town_with(&town, &self.replaced)?,
        };
        self.scene = Arc::new(scene);
        self.hidden_in_scene = self.standing.hidden.clone();
        Ok(())
    }

    fn bundle_header(
        &self,
        header: &SnapshotHeader,
        bundle: &DueBundle,
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
            tracer: self.tracer.code(),
            reserved: 0,
            begin_nanos,
            end_nanos: clock::now_nanos(),
        }
    }

    /// Applies the journal up to the frame of a snapshot.
    fn apply_journal(&mut self, snapshot: &SnapshotHeader) -> Result<(), RenderError> {
        let Renderer { participant, ports, .. } = self;
        participant.receive_journal(&mut ports.journal, snapshot.journal_serial)?;
        for event in self.ports.journal.until(snapshot.stamp.frame) {
            match event {
                Event::Reset => {
                    self.bundles.reset();
                    self.standing = StandingState::default();
                    self.drawn_revision = u64::MAX;
                    self.show_standing();
                }
                Event::Entry(_, entry) if entry.outcome.status == status::DONE => {
                    self.apply(&entry)?;
                }
                Event::Entry(..) => {}
            }
        }
        Ok(())
    }

    /// Gives the world what it shows of the persistent switches.
    fn show_standing(&mut self) {
        self.world.set_street_lights(&self.standing.street_lights);
        self.world.poses = self.standing.poses.clone();
    }

    fn apply(&mut self, entry: &JournalEntry) -> Result<(), RenderError> {
        let id = BundleId(entry.outcome.id);
        let command = entry.command.decode();
        if let Some(command) = &command {
            self.standing.apply(command, &entry.outcome);
            match command.group() {
                CommandGroup::Standing(_)
                | CommandGroup::Service(_)
                | CommandGroup::World(WorldCommand::Destroy(_)) => self.show_standing(),
                CommandGroup::World(_) | CommandGroup::Sensor(_) => {}
            }
        }
        match command {
            Some(Command::CreateBundle(bundle)) => {
                let receipt = entry.outcome.answered::<BundleReceipt>().unwrap_or_default();
                self.bundles.create(id, &bundle, receipt);
            }
            // The host measures physics sensors.
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
                            // The bundle was destroyed before its first frame; a later entry says
                            // so.
                            Err(e) if e.is_missing_channel() => return Ok(()),
                            Err(e) => return Err(e.into()),
                        },
                    };
                    self.bundles.activate(id, planes, byte_len, writer);
                }
            }
            Some(Command::DestroyBundle(bundle)) => self.remove(bundle),
            Some(Command::LoadMap(_)) => self.begin_episode(entry.outcome.id)?,
            _ => {}
        }
        Ok(())
    }
}

/// Returns the colour of an actor: red, green and blue.
fn paint(actor: &ActorState) -> [u8; 3] {
    let [red, green, blue, _] = actor.color.to_le_bytes();
    [red, green, blue]
}

/// Keeps what the next frame needs to know of this one, to know its motion.
fn remember_actors(before: &mut Vec<ActorState>, world: &mut World, snapshot: &Snapshot) {
    before.clear();
    before.extend_from_slice(snapshot.actors());
    world.limbs_before.clear();
    world.limbs_before.extend_from_slice(snapshot.limbs());
    world.poses_before = Some(world.poses.clone());
}

/// Returns the scene of an episode, from the cache if possible. With `replaced`, builds it with the
/// geometry of the mesh list.
fn scene_for(
    cache: &Cache,
    episode: &Episode,
    replaced: Option<&[Replaced]>,
) -> Result<Scene, RenderError> {
    if let Some(replaced) = replaced {
        let Episode { map, open_drive, seed } = episode;
        let town = cache.town(map, open_drive, *seed)?;
        return Ok(Scene::of_town_with(&town, replaced)?);
    }
    scene_from(cache, episode)
}
