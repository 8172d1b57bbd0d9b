//! Saving the state and going on from a saved one, between two frames.

use std::{fs, path::Path};

use bus::TrafficSample;
use protocol::{ActorId, Block, Command, FilePath, Outcome, Settings, TrafficHeader};

use super::Host;
use crate::{
    journal::Request,
    saved::{SavedState, decision_hash, map_sum},
    standing::{hiding, lit},
};

/// What traffic decided, as it came or as it was saved.
pub(super) enum Decided {
    Received(TrafficSample),
    Restored(TrafficHeader, Vec<Block>),
}

impl Decided {
    pub(super) fn header(&self) -> &TrafficHeader {
        match self {
            Decided::Received(sample) => sample.header(),
            Decided::Restored(header, _) => header,
        }
    }

    pub(super) fn payload(&self) -> &[Block] {
        match self {
            Decided::Received(sample) => sample.payload(),
            Decided::Restored(_, blocks) => blocks,
        }
    }

    /// Header and payload, copied.
    pub(super) fn to_owned(&self) -> (TrafficHeader, Vec<u8>) {
        (*self.header(), bytemuck::cast_slice(self.payload()).to_vec())
    }

    pub(super) fn hash(&self) -> u64 {
        decision_hash(bytemuck::cast_slice(self.payload()))
    }
}

impl Host {
    /// Everything that decides the future.
    pub(super) fn state(&self) -> SavedState {
        let (weather, params) = self.standing.sky_and_dials(self.pen.entries());
        let stamp = self.stamp(self.barrier.frame());
        let mut state = SavedState {
            stamp,
            map: map_sum(&self.config.episode),
            settings: self.settings,
            weather,
            params,
            shapes: self.drawings.save(stamp),
            decision: self.decided.as_ref().map(Decided::to_owned),
            pending: self.inbox.waiting(),
            ..SavedState::default()
        };
        self.world.save_into(&mut state);
        state
    }

    /// See [`Command::SaveState`].
    pub(super) fn save_state(&mut self, file: &FilePath) -> Result<u32, String> {
        self.receive_decided().map_err(|e| e.to_string())?;
        let path = file.path();
        let told = |e| format!("{}: {e}", path.display());
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(told)?;
        }
        // Whoever reads it finds all of it or nothing.
        let part = path.with_added_extension("part");
        fs::write(&part, self.state().to_bytes()).map_err(told)?;
        fs::rename(&part, path).map_err(told)?;
        Ok(0)
    }

    /// See [`Command::LoadState`]; on an error the world is as it was.
    pub(super) fn load_state(&mut self, file: &FilePath) -> Result<u32, String> {
        let path = file.path();
        let state = read(path, map_sum(&self.config.episode))?;
        self.receive_decided().map_err(|e| e.to_string())?;
        self.world.restore(&state).map_err(|e| format!("{}: {e}", path.display()))?;
        // Who was shown is gone with the world that showed them, or is an actor of the state.
        self.replay = None;
        self.sim_time_nanos = state.stamp.sim_time_nanos;
        // Frames go on: what was decided then counts as decided on the newest.
        let stamp = self.stamp(self.barrier.frame());
        self.decided = state.decision.as_ref().map(|(header, payload)| {
            let blocks = bytemuck::pod_collect_to_vec::<u8, Block>(payload);
            Decided::Restored(TrafficHeader { stamp, ..*header }, blocks)
        });
        self.decided_hash = self.decided.as_ref().map_or(0, Decided::hash);
        // A planner of no bytes: begin anew.
        let blank = TrafficHeader { stamp, ..TrafficHeader::default() };
        let (header, payload) =
            self.decided.as_ref().map_or((blank, &[][..]), |d| (*d.header(), d.payload()));
        self.ports.resume.send(header, payload).map_err(|e| e.to_string())?;
        for request in self.inbox.begin_anew(&state.pending) {
            let why = "the world went on from a saved state before this was carried out";
            self.pen.write(request.ended(Outcome::refused(why)));
        }
        self.tell_what_stands(&state);
        self.restart_recording();
        Ok(0)
    }

    /// What others must know beyond the snapshot, as lines of the journal.
    fn tell_what_stands(&mut self, state: &SavedState) {
        // Whether anybody waits, renders or trails is how a world is run, not what it is.
        let settings = Settings {
            delta_nanos: state.settings.delta_nanos,
            substep_max_nanos: state.settings.substep_max_nanos,
            ..self.settings
        };
        let mut commands = Vec::new();
        if self.change_settings(&settings).is_ok() {
            commands.push(Command::SetSettings(settings));
        }
        commands.push(Command::SetWeather(state.weather.unwrap_or_default()));
        commands.extend(hiding(self.world.visibility()));
        commands.extend(lit(self.world.lighting()).into_iter().map(Command::SetStreetLights));
        commands.extend(state.params.iter().copied().map(Command::TrafficParam));
        commands.extend(self.world.poses().commands());
        self.retold
            .extend(commands.into_iter().map(|w| Request::of_host(w).ended(Outcome::done(0))));
        let drawn = self.drawings.restore(&state.shapes, self.coming());
        self.retold.extend(drawn);
        let lost = self.bundles.orphans(|parent: ActorId| self.world.state(parent).is_some());
        self.take_down(lost);
    }
}

fn read(path: &Path, map: u64) -> Result<SavedState, String> {
    let told = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let bytes = fs::read(path).map_err(|e| told(&e))?;
    SavedState::from_bytes(&bytes, map).map_err(|e| told(&e))
}
