//! Recordings: written and replayed.

use std::path::PathBuf;

use crate::{Client, ClientError, Command, Profile, Replay, file::saved_path};

impl Client {
    /// Records from the next frame on; returns the path of the file. `name` follows CARLA's rule:
    /// with a `/`, `\\` or `:` it is a path, else a file in the folder for recordings
    /// ([`saved_folder`](crate::saved_folder)).
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if a recording is running or the file cannot be created.
    pub fn start_recorder(&mut self, name: &str, profile: Profile) -> Result<PathBuf, ClientError> {
        let Command(command) = Command::start_recorder(name, profile)?;
        self.request_one("start_recorder", command)?;
        saved_path(name)
    }

    /// Closes the recording; returns how many frames it has, 0 if none was running.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the file could not be written.
    pub fn stop_recorder(&mut self) -> Result<u64, ClientError> {
        let Command(command) = Command::stop_recorder();
        self.request_one("stop_recorder", command).map(u64::from)
    }

    /// Replays a recording beside the actors that exist; names as for [`Client::start_recorder`].
    /// The first of its frames is shown by the next tick. If it was recorded in another world, that
    /// world is loaded first, as by [`Client::load_world`].
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the file is no recording, or damaged.
    pub fn start_replay(&mut self, name: &str, replay: Replay) -> Result<(), ClientError> {
        let Command(command) = Command::start_replay(name, replay)?;
        let number = self.episode();
        self.request_world("start_replay", command)?;
        if self.episode() != number {
            self.await_world(self.episode())?;
        }
        Ok(())
    }

    /// Ends the replay. The actors that it showed stay, vehicles on autopilot, or are destroyed.
    ///
    /// # Errors
    ///
    /// As for [`Controller::try_request`](crate::Controller::try_request).
    pub fn stop_replay(&mut self, keep_actors: bool) -> Result<(), ClientError> {
        let Command(command) = Command::stop_replay(keep_actors);
        self.request_one("stop_replay", command).map(drop)
    }
}
