//! The thread that writes a recording, so that a tick does not wait for the disk.

use std::{thread::JoinHandle, time::Duration};

use bus::clock;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, TrySendError, bounded};

use crate::{RecordError, RecordedFrame, RecordingConfig, Writer};

/// Frames that may wait to be written before a tick waits for the disk: 25 s at 20 Hz.
const QUEUE: usize = 512;
/// Pending frames are written after this much real time, even if the segment is not full.
const PENDING_NANOS: u64 = 1_000_000_000;

/// Takes recorded_frames and writes them on a thread of its own.
pub struct Recorder {
    to: Option<Sender<RecordedFrame>>,
    spent: Receiver<RecordedFrame>,
    thread: Option<JoinHandle<Result<u64, RecordError>>>,
    waits: u64,
}

impl Recorder {
    /// Creates the file and starts the thread.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be written or the thread cannot be started.
    pub fn start(config: &RecordingConfig) -> Result<Recorder, RecordError> {
        let path = config.path.clone();
        let writer = Writer::create(config).map_err(|e| e.at(&path))?;
        let (to, recorded_frames) = bounded(QUEUE);
        let (back, spent) = bounded(QUEUE);
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn(move || write(writer, &recorded_frames, &back).map_err(|e| e.at(&path)))
            .map_err(|e| RecordError::file(&config.path, e))?;
        Ok(Recorder { to: Some(to), spent, thread: Some(thread), waits: 0 })
    }

    /// Returns an empty recorded_frame, or a written one whose memory is to be reused.
    pub fn blank(&self) -> RecordedFrame {
        self.spent.try_recv().unwrap_or_default()
    }

    /// Queues a frame. Blocks if the queue is full, because a recording has no holes, and returns
    /// whether it blocked.
    ///
    /// # Errors
    ///
    /// Returns the reason if the writer has ended.
    pub fn put(&mut self, recorded_frame: RecordedFrame) -> Result<bool, RecordError> {
        let Some(to) = &self.to else { return Ok(false) };
        let (sent, waited) = match to.try_send(recorded_frame) {
            Ok(()) => (true, false),
            Err(TrySendError::Full(recorded_frame)) => (to.send(recorded_frame).is_ok(), true),
            Err(TrySendError::Disconnected(_)) => (false, false),
        };
        self.waits += u64::from(waited);
        if sent { Ok(waited) } else { Err(self.why()) }
    }

    /// Returns the number of frames that wait to be written.
    pub fn queued(&self) -> usize {
        self.to.as_ref().map_or(0, Sender::len)
    }

    /// Returns how often a tick waited for the disk.
    pub fn waits(&self) -> u64 {
        self.waits
    }

    /// Writes the remaining frames and the index, and returns the number of recorded frames.
    ///
    /// # Errors
    ///
    /// Returns the reason if the writer has ended early.
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
    recorded_frames: &Receiver<RecordedFrame>,
    back: &Sender<RecordedFrame>,
) -> Result<u64, RecordError> {
    let mut due_nanos = None;
    loop {
        let recorded_frame = match due_nanos {
            None => recorded_frames.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(due) => {
                let left = Duration::from_nanos(u64::saturating_sub(due, clock::now_nanos()));
                recorded_frames.recv_timeout(left)
            }
        };
        match recorded_frame {
            Ok(recorded_frame) => writer.put(recorded_frame)?,
            Err(RecvTimeoutError::Timeout) => writer.cut()?,
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        }
        due_nanos = match (writer.is_pending(), due_nanos) {
            (false, _) => None,
            (true, None) => Some(clock::now_nanos() + PENDING_NANOS),
            (true, due) => due,
        };
        for spent in writer.spent() {
            // A full channel has enough recorded_frames to reuse.
            let _ = back.try_send(spent);
        }
    }
}
