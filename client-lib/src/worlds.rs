//! Maps, settings and saved states: what a world is and how its time passes.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use protocol::Frame;

use crate::{
    Client, ClientError, Command, Layers, Pace, Settings,
    file::{absolute, file_error, read, wire_path},
};

impl Client {
    /// The names of the maps that can be loaded.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`].
    pub fn available_maps(&self) -> Result<Vec<String>, ClientError> {
        Ok(self.instance().maps()?)
    }

    /// Destroys the world and loads a map in its place: a name (see `omnibus maps`), or a path. All
    /// actors and bundles are destroyed; frames count on, simulated time starts at 0, settings
    /// stay. When this returns, `world()` shows the new world as it was loaded, bit for bit that of
    /// a simulator started with this map and seed.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the map cannot be loaded: the old world stays.
    /// [`ClientError::Timeout`] after [`Deadlines::world`](crate::Deadlines::world).
    pub fn load_map(&mut self, name: &str) -> Result<Frame, ClientError> {
        self.load_world(name, None, Layers::empty())
    }

    /// Loads the running map again.
    ///
    /// # Errors
    ///
    /// As for [`Client::load_map`].
    pub fn reload_map(&mut self) -> Result<Frame, ClientError> {
        self.load_world("", None, Layers::empty())
    }

    /// As [`Client::load_map`], an empty name for the running map; with another seed, or without
    /// layers of the town.
    ///
    /// # Errors
    ///
    /// As for [`Client::load_map`].
    pub fn load_world(
        &mut self,
        name: &str,
        seed: Option<u64>,
        hidden_layers: Layers,
    ) -> Result<Frame, ClientError> {
        let Command(command) = Command::load_world(name, seed, hidden_layers)?;
        let number = self.request_world("load_map", command)?;
        self.await_world(number)
    }

    /// Waits for world `number`: its first frame is complete when every stage has built it.
    pub(crate) fn await_world(&mut self, number: u32) -> Result<Frame, ClientError> {
        let participant = &self.connection().participant;
        let frame = Frame(participant.control().tick.get());
        participant.await_complete(frame, None).map_err(|_| self.connection().host_ended())?;
        while self.world().header().stamp.episode < number {
            self.await_frame()?;
        }
        Ok(self.frame())
    }

    /// Sets how time passes; it holds when this returns.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if a value is out of range.
    pub fn apply_settings(&mut self, settings: Settings) -> Result<(), ClientError> {
        let permille = self.wire_settings().real_time_permille;
        self.apply_wire_settings(settings.to_wire(permille))
    }

    /// Takes the tick and makes the world wait for it; each tick is `delta` of simulated time long.
    ///
    /// # Errors
    ///
    /// As for [`Client::take_tick`] and [`Client::apply_settings`].
    pub fn synchronise(&mut self, delta: Duration) -> Result<(), ClientError> {
        self.take_tick()?;
        let settings = self.settings().with_pace(Pace::Synchronous);
        self.apply_settings(settings.with_delta(delta))
    }

    /// Returns everything that decides the future, between two frames: actors, traffic, and the
    /// commands that were not carried out yet. It can be loaded where map, seed and build are the
    /// same.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`]; [`ClientError::File`].
    pub fn save_state(&mut self) -> Result<Vec<u8>, ClientError> {
        let path = self.scratch("state");
        let saved = self.save_state_to(&path).and_then(|()| read(&path));
        let _ = fs::remove_file(&path);
        saved
    }

    /// Writes the same into a file.
    ///
    /// # Errors
    ///
    /// As for [`Client::save_state`].
    pub fn save_state_to(&mut self, path: &Path) -> Result<(), ClientError> {
        let file = wire_path(&absolute(path)?)?;
        self.request_one("save_state", protocol::Command::SaveState(file)).map(drop)
    }

    /// Continues from a saved state: from the next frame on everything happens as it did, or would
    /// have happened, after it was saved. Frames count on; simulated time and ids are those of the
    /// state.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the state is of another map, seed or build, or damaged.
    pub fn load_state(&mut self, state: &[u8]) -> Result<(), ClientError> {
        let path = self.scratch("state");
        fs::write(&path, state).map_err(|e| file_error(&path, e))?;
        let loaded = self.load_state_from(&path);
        let _ = fs::remove_file(&path);
        loaded
    }

    /// Continues from a saved state in a file.
    ///
    /// # Errors
    ///
    /// As for [`Client::load_state`].
    pub fn load_state_from(&mut self, path: &Path) -> Result<(), ClientError> {
        let file = wire_path(&absolute(path)?)?;
        self.request_one("load_state", protocol::Command::LoadState(file)).map(drop)
    }

    /// A file in the instance's own folder, which is removed with it.
    fn scratch(&self, what: &str) -> PathBuf {
        let slot = self.connection().participant.slot();
        self.instance().root().join(format!("{what}-{slot}"))
    }
}
