//! Loading a map: the world is destroyed and built from a map.
//!
//! A load happens between two frames and has a frame of its own, the new world as it is loaded. The
//! journal of that frame has the `LoadMap` entry, at which every stage starts over, and the load is
//! complete when all stages have arrived at that frame. The map is checked before anything is
//! destroyed.

use bus::clock;
use protocol::{Episode, Frame, HideLayers, LoadMap, Outcome, Refusal, load};
use town::Town;

use super::{START_NANOS, Shell, TickTimes};
use crate::{
    HostError,
    barrier::Verdict,
    maps::{find_map, load_world},
    request::Request,
    sim::{Outputs, Sim},
    world::World,
};

/// A world that is built before the old one is destroyed.
pub(super) struct PreparedEpisode {
    episode: Episode,
    world: World,
    hidden: HideLayers,
    /// The town, if it is new to the cache.
    town: Option<Town>,
}

impl Shell {
    /// Executes [`protocol::Command::LoadMap`]; if it is refused, the world is unchanged.
    pub(super) fn load_map(
        &mut self,
        sim: &mut Sim,
        request: Request,
        command: &LoadMap,
    ) -> Result<(), HostError> {
        match self.prepare(sim, command) {
            Ok(next) => self.begin_episode(sim, request, next),
            Err(why) => {
                self.journal.write(request.ended(Outcome::refused(&why)));
                Ok(())
            }
        }
    }

    fn prepare(&self, sim: &Sim, command: &LoadMap) -> Result<PreparedEpisode, Refusal> {
        let now = &self.config.episode;
        let name = command.map.path().to_string_lossy();
        let mut episode = now.clone();
        if !name.is_empty() {
            (episode.map, episode.open_drive) =
                find_map(&self.config.maps, &name, || self.is_stopped())?;
        }
        if command.flags & load::SEED != 0 {
            episode.seed = command.seed;
        }
        let mut next = self.prepare_world(sim, episode)?;
        next.hidden = HideLayers { layers: command.hidden_layers, hidden: 1 };
        World::check_layers(&next.hidden)?;
        Ok(next)
    }

    /// Builds the world of an episode as it is loaded.
    pub(super) fn prepare_world(
        &self,
        sim: &Sim,
        episode: Episode,
    ) -> Result<PreparedEpisode, Refusal> {
        let now = &self.config.episode;
        let is_same = episode.seed == now.seed && episode.open_drive == now.open_drive;
        let (world, town) = if is_same {
            (sim.world().at_start(), None)
        } else {
            load_world(&self.cache, &episode, || self.is_stopped())?
        };
        Ok(PreparedEpisode { episode, world, hidden: HideLayers { layers: 0, hidden: 1 }, town })
    }

    pub(super) fn begin_episode(
        &mut self,
        sim: &mut Sim,
        request: Request,
        next: PreparedEpisode,
    ) -> Result<(), HostError> {
        self.end_recording_and_replay()?;
        let PreparedEpisode { episode, world, hidden, town } = next;
        if let Some(town) = town {
            // The renderer looks for the town in the cache.
            self.cache.keep_town(&episode.open_drive, episode.seed, &town);
        }
        self.episode_number += 1;
        self.owned_instance.instance().write_episode(self.episode_number, &episode)?;
        self.control.set_episode(self.episode_number);
        self.config.episode = episode;
        self.decided = None;
        self.recorded_decision = Frame(0);
        self.remove_bundles(self.bundles.all());
        self.physics_sensors.begin_episode();
        for pending in self.inbox.replace(&[]) {
            let reason = "another world was loaded before the command was applied";
            let refusal = Refusal::world_replaced(reason);
            self.journal.write(pending.ended(Outcome::refused(&refusal)));
        }
        let frame = self.barrier.advance();
        sim.begin_episode(world, self.episode_number, &hidden);
        self.journal.write(request.ended(Outcome::done(self.episode_number)));
        for command in sim.standing().hidden.commands() {
            self.journal.write(Request::of_host(command).ended(Outcome::done(0)));
        }
        let now = clock::now_nanos();
        self.tick = TickTimes { begin_nanos: now, applied_nanos: now, stepped_nanos: now };
        self.publish(sim, &Outputs { delta_nanos: 0, ..sim.outputs() })?;
        let verdict = self.await_stages_at(frame)?;
        self.close(frame, &verdict);
        self.set_lags(|shell, role| shell.lag(role));
        Ok(())
    }

    /// Ends the recording, which belongs to one world, and the replay, and waits for trailing
    /// stages.
    fn end_recording_and_replay(&mut self) -> Result<(), HostError> {
        let frame = self.barrier.frame();
        if self.recording.is_some() {
            match self.stop_recorder() {
                Ok(_) => {
                    log::info!("{} the recording ends because another world is loaded", frame.0)
                }
                Err(why) => log::error!("{} the recording ends: {why}", frame.0),
            }
        }
        self.replay = None;
        self.await_stages_at(frame)?;
        self.receive_decided()
    }

    /// Waits until all stages have arrived at this frame, in asynchronous mode as well.
    fn await_stages_at(&mut self, frame: Frame) -> Result<Verdict, HostError> {
        self.set_lags(|_, _| 0);
        let stages = self.roles.keys().fold(0, |mask, slot| mask | 1 << slot);
        let timeout = self.config.deadline_nanos.map(|nanos| nanos.max(START_NANOS));
        self.await_all(frame, timeout, stages, |_| Ok(()))
    }
}
