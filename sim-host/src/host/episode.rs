//! Another world in the place of the one that runs: destroyed, and built anew from a map.
//!
//! It stands between two frames and makes a frame of its own, the new world as it was loaded. Its
//! journal has the line by which every stage begins anew, and the load is over when all of them
//! have arrived at it. What can be wrong with a map is found before anything is destroyed.

use bake::{LoadedTown, TownSource};
use bus::{Role, clock};
use protocol::{Command, Episode, Frame, HideLayers, LoadMap, Outcome, SnapshotHeader, load};
use town::Town;

use super::{Host, START_NANOS, ending};
use crate::{HostError, barrier::Verdict, journal::Request, standing::hiding, world::World};

/// Where maps come from: only the composition root knows files and names.
pub trait Maps: Send {
    /// The name under which it runs, and its text, or why there is none.
    fn find(&self, name: &str) -> Result<(String, String), String>;

    /// Every name that it knows.
    fn names(&self) -> Vec<String>;
}

/// A world that could be built, before the old one goes.
pub(super) struct Next {
    episode: Episode,
    world: World,
    /// To be kept for the next time.
    town: Option<Town>,
}

impl Host {
    /// See [`Command::LoadMap`]; on a refusal the world is as it was.
    pub(super) fn load_map(
        &mut self,
        request: Request,
        command: &LoadMap,
    ) -> Result<(), HostError> {
        match self.prepare(command) {
            Ok(next) => self.begin_episode(request, next),
            Err(why) => {
                self.pen.write(request.ended(Outcome::refused(&why)));
                Ok(())
            }
        }
    }

    fn prepare(&self, command: &LoadMap) -> Result<Next, String> {
        let now = &self.config.episode;
        let name = command.map.path().to_string_lossy();
        let mut episode = now.clone();
        if !name.is_empty() {
            (episode.map, episode.open_drive) = self.config.maps.find(&name)?;
        }
        if command.flags & load::SEED != 0 {
            episode.seed = command.seed;
        }
        let mut next = self.prepare_world(episode)?;
        let hidden = HideLayers { layers: command.hidden_layers, hidden: 1 };
        next.world.apply(&Command::HideLayers(hidden))?;
        Ok(next)
    }

    /// The world of an episode as it is loaded.
    pub(super) fn prepare_world(&self, episode: Episode) -> Result<Next, String> {
        let now = &self.config.episode;
        let is_same = episode.seed == now.seed && episode.open_drive == now.open_drive;
        let (world, town) = if is_same {
            (self.world.anew(), None)
        } else {
            let Episode { map, open_drive, seed } = &episode;
            let source = self.cache.town_source(map, open_drive, *seed);
            build_world(source.and_then(TownSource::load).map_err(|e| e.to_string())?, *seed)
        };
        Ok(Next { episode, world, town })
    }

    pub(super) fn begin_episode(&mut self, request: Request, next: Next) -> Result<(), HostError> {
        self.end_what_goes_on()?;
        let Next { episode, mut world, town } = next;
        world.succeed(&self.world);
        if let Some(town) = town {
            // Before the renderer looks for it.
            self.cache.keep_town(&episode.open_drive, episode.seed, &town);
        }
        self.number += 1;
        self.owned_instance.instance().write_episode(self.number, &episode)?;
        self.control.set_episode(self.number);
        self.config.episode = episode;
        self.world = world;
        self.sim_time_nanos = 0;
        self.decided = None;
        self.decided_hash = 0;
        self.recorded_decision = Frame(0);
        self.take_down(self.bundles.all());
        self.physics_sensors.begin_episode();
        self.drawings.clear();
        for pending in self.inbox.begin_anew(&[]) {
            let why = "another world was loaded before this was carried out";
            self.pen.write(pending.ended(Outcome::refused(why)));
        }
        self.pen.write(request.ended(Outcome::done(self.number)));
        for command in hiding(self.world.visibility()) {
            self.pen.write(Request::of_host(command).ended(Outcome::done(0)));
        }
        let begin_nanos = clock::now_nanos();
        let frame = self.barrier.advance();
        self.publish(SnapshotHeader {
            stamp: self.stamp(frame),
            begin_nanos,
            applied_nanos: begin_nanos,
            stepped_nanos: begin_nanos,
            ..SnapshotHeader::default()
        })?;
        let verdict = self.await_stages_at(frame)?;
        self.control.close(frame, ending(&verdict));
        self.set_lags(|host, role| host.lag(role));
        Ok(())
    }

    /// A recording is of one world; who was shown, and whoever trails, belongs to the old one.
    fn end_what_goes_on(&mut self) -> Result<(), HostError> {
        let frame = self.barrier.frame();
        if self.recording.is_some() {
            match self.stop_recorder() {
                Ok(_) => log::info!("{} the recording ends with its world", frame.0),
                Err(why) => log::error!("{} the recording ends: {why}", frame.0),
            }
        }
        self.replay = None;
        self.await_stages_at(frame)?;
        self.receive_decided()
    }

    /// However time passes: stages have arrived at this frame when this returns.
    fn await_stages_at(&mut self, frame: Frame) -> Result<Verdict, HostError> {
        self.set_lags(|_, _| 0);
        let stages = self.roles.keys().fold(0, |mask, slot| mask | 1 << slot);
        let patience = self.config.deadline_nanos.map(|nanos| nanos.max(START_NANOS));
        self.await_all(frame, patience, stages)
    }

    pub(super) fn set_lags(&mut self, lag: impl Fn(&Host, Role) -> u64) {
        for (slot, role) in self.roles.clone() {
            let lag = lag(self, role);
            self.control.slot(slot).set_lag(lag);
            self.barrier.set_lag(slot, lag);
        }
    }
}

/// The world of frame 0, and its town if the town is not in the cache yet.
pub(super) fn build_world(loaded: LoadedTown, seed: u64) -> (World, Option<Town>) {
    let LoadedTown { town, is_new } = loaded;
    (World::new(&town, seed), is_new.then_some(town))
}
