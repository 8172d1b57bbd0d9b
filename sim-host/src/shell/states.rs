//! Saving states, and continuing from saved ones, between two frames.

use std::{fs, path::Path};

use protocol::{
    ActorId, Block, Command, FilePath, Outcome, Refusal, Settings, StandingState, TrafficHeader,
    Weather,
};

use super::Shell;
use crate::{
    HostError,
    decision::Decided,
    request::Request,
    saved::{SavedState, map_sum},
    sim::Sim,
};

impl Shell {
    /// Returns everything that decides the future.
    pub(super) fn state(&self, sim: &Sim) -> SavedState {
        let mut state = SavedState {
            map: map_sum(&self.config.episode),
            decision: self.decided.as_ref().map(Decided::to_owned),
            pending: self.inbox.waiting(),
            ..SavedState::default()
        };
        sim.save_into(&mut state);
        state
    }

    /// Executes [`Command::SaveState`].
    pub(super) fn save_state(&mut self, sim: &Sim, file: &FilePath) -> Result<u32, Refusal> {
        self.receive_decided().map_err(|e| Refusal::other(e.to_string()))?;
        let path = file.path();
        let with_path = |e| Refusal::file(format!("{}: {e}", path.display()));
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(with_path)?;
        }
        // A rename is atomic, so that a reader never finds part of a state.
        let part = path.with_added_extension("part");
        fs::write(&part, self.state(sim).to_bytes()).map_err(with_path)?;
        fs::rename(&part, path).map_err(with_path)?;
        Ok(0)
    }

    /// Executes [`Command::LoadState`]; if it is refused, the world is unchanged.
    pub(super) fn load_state(
        &mut self,
        sim: &mut Sim,
        request: Request,
        file: &FilePath,
    ) -> Result<(), HostError> {
        match self.load_file(sim, file.path()) {
            Ok(()) => {
                let orphans =
                    self.bundles.orphans(|parent: ActorId| sim.world().state(parent).is_some());
                self.remove_bundles(orphans);
                self.journal.write(request.ended(Outcome::done(0)));
                self.write_standing(sim.standing());
                self.restart_recording();
            }
            Err(why) => self.journal.write(request.ended(Outcome::refused(&why))),
        }
        Ok(())
    }

    fn load_file(&mut self, sim: &mut Sim, path: &Path) -> Result<(), Refusal> {
        let state = read(path, map_sum(&self.config.episode))?;
        self.receive_decided().map_err(|e| Refusal::other(e.to_string()))?;
        sim.load(&state).map_err(|e| Refusal::file(format!("{}: {e}", path.display())))?;
        // The actors that a replay showed are gone, or are actors of the state.
        self.replay = None;
        // Frame numbers continue, so the saved decision is stamped with the newest frame.
        let stamp = sim.stamp();
        self.decided = state.decision.as_ref().map(|(header, payload)| {
            let blocks = bytemuck::pod_collect_to_vec::<u8, Block>(payload);
            Decided::Restored(TrafficHeader { stamp, ..*header }, blocks)
        });
        // An empty state of the planner resets it.
        let blank = TrafficHeader { stamp, ..TrafficHeader::default() };
        let (header, payload) =
            self.decided.as_ref().map_or((blank, &[][..]), |d| (*d.header(), d.payload()));
        self.ports.resume.send(header, payload).map_err(|e| Refusal::other(e.to_string()))?;
        for request in self.inbox.replace(&state.pending) {
            let reason = "a saved state was loaded before the command was applied";
            let refusal = Refusal::world_replaced(reason);
            self.journal.write(request.ended(Outcome::refused(&refusal)));
        }
        Ok(())
    }

    /// Writes the journal entries from which other participants learn the loaded standing state.
    fn write_standing(&mut self, standing: &StandingState) {
        let mut commands = standing.commands();
        // Readers keep these over a load, so that defaults are written as well.
        if standing.weather == Weather::default() {
            commands.push((Command::SetWeather(standing.weather), Outcome::done(0)));
        }
        if standing.settings == Settings::default() {
            commands.push((Command::SetSettings(standing.settings), Outcome::done(0)));
        }
        for (command, outcome) in commands {
            self.journal.write(Request::of_host(command).ended(outcome));
        }
    }
}

/// Most bytes of a saved state.
const STATE_MAX: u64 = 1 << 30;

fn read(path: &Path, map: u64) -> Result<SavedState, Refusal> {
    let with_path = |e: &dyn std::fmt::Display| Refusal::file(format!("{}: {e}", path.display()));
    let bytes = bus::read_regular(path, STATE_MAX).map_err(|e| with_path(&e))?;
    SavedState::from_bytes(&bytes, map).map_err(|e| with_path(&e))
}
