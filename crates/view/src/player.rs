//! The time of a recording: which part of it the simulator shows.

use std::{
    path::PathBuf,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use client_lib::{Client, ClientError, Replay};

use crate::{ViewError, state::Playback, time_control::TimeControl};

/// How long pages have to create their sensors on the actors that a replay has spawned.
const SETTLING: Duration = Duration::from_millis(50);

/// A recording, and the simulator of its world that shows it.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The name of the simulator. It is synchronous, its time step is that of the recording, and no
    /// other client ticks.
    pub instance: String,
    /// The file, which has states.
    pub file: PathBuf,
    /// What the page calls it, and its map.
    pub title: [String; 2],
    /// The duration of the recording, which is not zero.
    pub length: Duration,
}

/// Shows a recording for all pages: the client that ticks. It has no thread; the pages' threads call it.
pub(crate) struct Player {
    client: Client,
    time: TimeControl,
    file: String,
    title: [String; 2],
    length: Duration,
    /// The recorded time that is shown.
    at: Duration,
    /// How many times another part was looked for; the sensors on replayed actors end with each.
    seeks: u64,
    /// What was looked for, and since when the frame before it is shown.
    aim: Option<(Duration, Instant)>,
}

impl Player {
    /// Shows the beginning.
    ///
    /// # Errors
    ///
    /// [`ViewError::Client`] if the recording cannot be replayed.
    pub(crate) fn start(mut client: Client, recording: &Recording) -> Result<Player, ViewError> {
        let mut time = TimeControl::default();
        time.pause(&mut client)?;
        let file = recording.file.to_string_lossy().into_owned();
        let Recording { title, length, .. } = recording.clone();
        let at = Duration::ZERO;
        let mut player = Player { client, time, file, title, length, at, seeks: 0, aim: None };
        player.show(Duration::ZERO)?;
        Ok(player)
    }

    /// Returns what the page calls the recording, and its map.
    pub(crate) fn title(&self) -> [String; 2] {
        self.title.clone()
    }

    /// How many times another part was looked for.
    pub(crate) fn seeks(&self) -> u64 {
        self.seeks
    }

    /// Whether time passes.
    pub(crate) fn plays(&self) -> bool {
        self.time.plays()
    }

    /// Returns the time until the next tick, if time passes.
    pub(crate) fn until_due(&self, now: Instant) -> Option<Duration> {
        self.time.until_due(now)
    }

    /// Returns what is shown, in seconds.
    pub(crate) fn playback(&self) -> Playback {
        Playback {
            at: self.at.as_secs_f64(),
            last: self.last().as_secs_f64(),
            step: self.delta().as_secs_f64(),
            unit: "s",
        }
    }

    /// Stops time.
    pub(crate) fn pause(&mut self) -> Result<(), ClientError> {
        self.time.pause(&mut self.client)
    }

    /// Shows the next frame.
    pub(crate) fn step(&mut self) -> Result<(), ViewError> {
        self.pause()?;
        if let Some((at, _)) = self.aim.take() {
            self.advance()?;
            self.at = at;
        }
        if self.at >= self.last() {
            return Err(ViewError::LastFrame);
        }
        Ok(self.advance()?)
    }

    /// Lets time pass, at the end from the beginning.
    pub(crate) fn play(&mut self) -> Result<(), ViewError> {
        if self.at >= self.last() {
            self.show(Duration::ZERO)?;
        }
        Ok(self.time.play(&mut self.client)?)
    }

    /// Shows another part.
    pub(crate) fn seek(&mut self, to_s: f64) -> Result<(), ViewError> {
        self.show(Duration::try_from_secs_f64(to_s.max(0.0)).unwrap_or(Duration::MAX))
    }

    /// Shows the same part again if time stands: sensors measure when time passes, and a new one
    /// would show nothing.
    pub(crate) fn refresh(&mut self) -> Result<(), ViewError> {
        if self.plays() || self.aim.is_some() { Ok(()) } else { self.show(self.at) }
    }

    /// Shows what was looked for, or the next frame if time passes and it is due; at the end time stops.
    pub(crate) fn tick_if_due(&mut self) -> Result<(), ClientError> {
        if let Some((at, since)) = self.aim {
            if since.elapsed() >= SETTLING {
                self.aim = None;
                self.advance()?;
                self.at = at;
            }
            return Ok(());
        }
        if self.plays() && self.at >= self.last() {
            return self.pause();
        }
        if self.time.tick_if_due(&mut self.client)? {
            self.at += self.delta();
        }
        Ok(())
    }

    /// The replay ends, and its actors go, with the frame after this one.
    fn last(&self) -> Duration {
        self.length.saturating_sub(self.delta())
    }

    fn delta(&self) -> Duration {
        self.client.settings().delta
    }

    fn advance(&mut self) -> Result<(), ClientError> {
        self.client.tick()?;
        self.at += self.delta();
        Ok(())
    }

    /// Shows the frame before `at`, which spawns the actors, and soon afterwards that at `at`: the
    /// sensors of the pages then measure it. For the first frame that is the second one.
    fn show(&mut self, at: Duration) -> Result<(), ViewError> {
        let at = at.max(self.delta()).min(self.last());
        let before = at.saturating_sub(self.delta());
        let replay = Replay { from_s: before.as_secs_f64(), ..Replay::default() };
        self.client.start_replay(&self.file, replay)?;
        self.client.tick()?;
        (self.at, self.seeks) = (before, self.seeks + 1);
        self.aim = (before < at).then(|| (at, Instant::now()));
        Ok(())
    }
}

/// Returns the player: a thread that has panicked leaves one that can be used.
pub(crate) fn locked(player: &Mutex<Player>) -> MutexGuard<'_, Player> {
    player.lock().unwrap_or_else(PoisonError::into_inner)
}
