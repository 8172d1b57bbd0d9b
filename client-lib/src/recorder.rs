//! Recordings: written and replayed.

use std::path::PathBuf;

use protocol::{Command, Nothing, StartRecorder, StartReplay, StopReplay};

use crate::{
    Client, ClientError, Profile, Replay,
    file::{saved_path, wire_path},
};

impl Client {
    /// Records from the next frame on; returns the path of the file. `name` follows CARLA's rule:
    /// with a `/`, `\\` or `:` it is a path, else a file in the folder for recordings
    /// ([`saved_folder`](crate::saved_folder)).
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if a recording is running or the file cannot be created.
    pub fn start_recorder(&mut self, name: &str, profile: Profile) -> Result<PathBuf, ClientError> {
        let path = saved_path(name)?;
        let path_on_wire = wire_path(&path)?;
        let command = StartRecorder { path: path_on_wire, profile: profile as u32, reserved: 0 };
        self.request_one("start_recorder", Command::StartRecorder(command))?;
        Ok(path)
    }

    /// Closes the recording; returns how many frames it has, 0 if none was running.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the file could not be written.
    pub fn stop_recorder(&mut self) -> Result<u64, ClientError> {
        let command = Command::StopRecorder(Nothing::default());
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
        let nanos = |seconds: f64| (seconds * 1e9) as i64;
        let command = StartReplay {
            path: wire_path(&saved_path(name)?)?,
            from_nanos: nanos(replay.from_s),
            duration_nanos: nanos(replay.duration_s).max(0) as u64,
            time_factor: replay.time_factor,
            ignore_hero: replay.ignore_hero.into(),
        };
        let number = self.episode();
        self.request_world("start_replay", Command::StartReplay(command))?;
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
        let command = StopReplay { keep_actors: keep_actors.into(), reserved: 0 };
        self.request_one("stop_replay", Command::StopReplay(command)).map(drop)
    }
}
