//! The thread that writes, so that a tick does not.

use std::{thread::JoinHandle, time::Duration};

use bus::clock;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, TrySendError, bounded};

use crate::{Moment, RecordError, RecordingConfig, Writer};

/// Frames that may wait to be written before a tick waits for the disk: 25 s at 20 Hz.
const QUEUE: usize = 512;
/// What is pending is written after this much real time, however little it is.
const PENDING_NANOS: u64 = 1_000_000_000;

/// Takes moments and writes them on its own thread.
pub struct Recorder {
    to: Option<Sender<Moment>>,
    spent: Receiver<Moment>,
    thread: Option<JoinHandle<Result<u64, RecordError>>>,
    waits: u64,
}

impl Recorder {
    /// Makes the file and starts the thread.
    pub fn start(config: &RecordingConfig) -> Result<Recorder, RecordError> {
        let writer = Writer::create(config)?;
        let (to, moments) = bounded(QUEUE);
        let (back, spent) = bounded(QUEUE);
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || write(writer, &moments, &back))
            .map_err(|e| RecordError::file(&config.path, e))?;
        Ok(Recorder { to: Some(to), spent, thread: Some(thread), waits: 0 })
    }

    /// One that was written, to be filled anew.
    pub fn blank(&self) -> Moment {
        self.spent.try_recv().unwrap_or_default()
    }

    /// Hands a frame over. It waits only if [`Recorder`]'s queue is full: a recording has no holes.
    /// True if it waited.
    pub fn put(&mut self, moment: Moment) -> Result<bool, RecordError> {
        let Some(to) = &self.to else { return Ok(false) };
        let (sent, waited) = match to.try_send(moment) {
            Ok(()) => (true, false),
            Err(TrySendError::Full(moment)) => (to.send(moment).is_ok(), true),
            Err(TrySendError::Disconnected(_)) => (false, false),
        };
        self.waits += u64::from(waited);
        if sent { Ok(waited) } else { Err(self.why()) }
    }

    /// How many ticks had to wait for the disk.
    pub fn waits(&self) -> u64 {
        self.waits
    }

    /// Writes the rest and the index; says how many frames there are in all.
    pub fn stop(mut self) -> Result<u64, RecordError> {
        self.join()
    }

    fn join(&mut self) -> Result<u64, RecordError> {
        self.to = None;
        let Some(thread) = self.thread.take() else { return Ok(0) };
        thread.join().unwrap_or_else(|_| Err(RecordError::Ended("its thread panicked".into())))
    }

    fn why(&mut self) -> RecordError {
        match self.join() {
            Err(e) => e,
            Ok(_) => RecordError::Ended("its thread ended".into()),
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Err(e) = self.join() {
            log::warn!("{e}");
        }
    }
}

fn write(
    mut writer: Writer,
    moments: &Receiver<Moment>,
    back: &Sender<Moment>,
) -> Result<u64, RecordError> {
    let mut due_nanos = None;
    loop {
        let moment = match due_nanos {
            None => moments.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(due) => {
                let left = Duration::from_nanos(u64::saturating_sub(due, clock::now_nanos()));
                moments.recv_timeout(left)
            }
        };
        match moment {
            Ok(moment) => writer.put(moment)?,
            Err(RecvTimeoutError::Timeout) => writer.cut()?,
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        }
        due_nanos = match (writer.is_pending(), due_nanos) {
            (false, _) => None,
            (true, None) => Some(clock::now_nanos() + PENDING_NANOS),
            (true, due) => due,
        };
        for spent in writer.spent() {
            // Who has enough of them drops them.
            let _ = back.try_send(spent);
        }
    }
}
