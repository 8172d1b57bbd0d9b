//! Pause, step and play: the page as the client that ticks.

use std::time::{Duration, Instant};

use client_lib::{Client, ClientError, Pace, Settings};

/// How a page lets time pass.
#[derive(Debug, Default)]
pub(crate) struct TimeControl {
    /// The settings that a pause of this page has replaced: those of a world with its own clock.
    replaced: Option<Settings>,
    /// When the next tick is due; `None`: the page does not tick.
    due: Option<Instant>,
}

impl TimeControl {
    /// Whether time passes by this page's ticks.
    pub(crate) fn plays(&self) -> bool {
        self.due.is_some()
    }

    /// Returns the time until the next tick, if the page ticks.
    pub(crate) fn until_due(&self, now: Instant) -> Option<Duration> {
        self.due.map(|due| due.saturating_duration_since(now))
    }

    /// Stops time: takes the tick, and replaces the world's own clock.
    pub(crate) fn pause(&mut self, client: &mut Client) -> Result<(), ClientError> {
        self.due = None;
        client.take_tick()?;
        let settings = client.settings();
        if settings.pace != Pace::Synchronous {
            let done = client.apply_settings(settings.with_pace(Pace::Synchronous));
            if done.is_err() {
                client.leave_tick();
            }
            done?;
            self.replaced = Some(settings);
        }
        Ok(())
    }

    /// Computes one frame.
    pub(crate) fn step(&mut self, client: &mut Client) -> Result<(), ClientError> {
        self.pause(client)?;
        client.tick().map(drop)
    }

    /// Lets time pass: by the world's own clock if a pause has replaced it, else by ticks of this page
    /// at the pace of real time.
    pub(crate) fn play(&mut self, client: &mut Client) -> Result<(), ClientError> {
        if self.replaced.is_some() {
            return self.release(client);
        }
        if client.settings().pace == Pace::Synchronous {
            client.take_tick()?;
            self.due.get_or_insert_with(Instant::now);
        }
        Ok(())
    }

    /// Ticks if that is due, and returns whether it was. After an error the page ticks no more.
    pub(crate) fn tick_if_due(&mut self, client: &mut Client) -> Result<bool, ClientError> {
        let Some(due) = self.due.filter(|due| *due <= Instant::now()) else { return Ok(false) };
        self.due = None;
        client.tick()?;
        // A late tick is not made up for: time would run faster than it should.
        self.due = Some((due + client.settings().delta).max(Instant::now()));
        Ok(true)
    }

    /// Leaves time to others, as it was before the first pause.
    pub(crate) fn release(&mut self, client: &mut Client) -> Result<(), ClientError> {
        self.due = None;
        let restored = match self.replaced.take() {
            Some(settings) if client.holds_tick() => client.apply_settings(settings),
            _ => Ok(()),
        };
        client.leave_tick();
        restored
    }
}
