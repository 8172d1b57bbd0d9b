//! Replays of recordings in the running world.

use protocol::{ActorId, Command, LoadMap, Refusal, StartReplay, WorldCommand, load};

use super::Shell;
use crate::{HostError, replay::Replay, request::Request, saved::map_sum, sim::Sim};

impl Shell {
    /// Executes [`Command::StartReplay`]. If the recording is of another world, that world is
    /// loaded first.
    pub(super) fn start_replay(
        &mut self,
        sim: &mut Sim,
        command: &StartReplay,
    ) -> Result<Result<u32, Refusal>, HostError> {
        let replay = match Replay::of(command) {
            Ok(replay) => replay,
            Err(why) => return Ok(Err(why)),
        };
        let episode = replay.episode();
        if map_sum(episode) == map_sum(&self.config.episode) {
            self.stop_replay(sim, false);
        } else {
            let next = match self.prepare_world(sim, episode.clone()) {
                Ok(next) => next,
                Err(why) => return Ok(Err(why)),
            };
            let line = LoadMap { seed: episode.seed, flags: load::SEED, ..LoadMap::default() };
            self.begin_episode(sim, Request::of_host(Command::LoadMap(line)), next)?;
        }
        self.replay = Some(replay);
        Ok(Ok(0))
    }

    /// Executes [`Command::StopReplay`].
    pub(super) fn stop_replay(&mut self, sim: &mut Sim, keep_actors: bool) {
        let Some(replay) = self.replay.take() else { return };
        for id in replay.into_shown() {
            if keep_actors {
                sim.world_mut().release(id);
            } else {
                self.remove_shown(sim, id);
            }
        }
    }

    fn remove_shown(&mut self, sim: &mut Sim, id: ActorId) {
        // A client may have destroyed the actor.
        if sim.apply_world(&WorldCommand::Destroy(id)).is_ok() {
            self.remove_bundles(self.bundles.on(id));
        }
    }

    /// Places recorded actors; called after physics.
    pub(super) fn show_recorded(&mut self, sim: &mut Sim) {
        let Some(mut replay) = self.replay.take() else { return };
        if replay.is_over() {
            // As in CARLA, actors are released at the end of a replay.
            self.replay = Some(replay);
            self.stop_replay(sim, true);
            return;
        }
        let frame = self.barrier.frame().0;
        match replay.show(sim.world_mut()) {
            Ok(gone) => {
                gone.into_iter().for_each(|id| self.remove_shown(sim, id));
                replay.advance(sim.settings().delta_nanos);
                self.replay = Some(replay);
            }
            Err(why) => {
                log::error!("{frame} the replay ends: {why}");
                self.replay = Some(replay);
                self.stop_replay(sim, true);
            }
        }
    }
}
