//! Passing each frame to the recorder.

use protocol::{Frame, JournalEntry, Refusal, SnapshotHeader, StartRecorder};
use record::{Collision, Decision, Profile, RecordedFrame, Recorder, RecordingConfig};

use super::Shell;
use crate::{recording::Recording, sim::Sim};

/// Simulated time between two whole worlds in a recording of inputs.
const WORLD_NANOS: u64 = 60_000_000_000;

impl Shell {
    /// Executes [`protocol::Command::StartRecorder`].
    pub(super) fn start_recorder(
        &mut self,
        sim: &Sim,
        command: &StartRecorder,
    ) -> Result<u32, Refusal> {
        let profile = Profile::by_code(command.profile).ok_or_else(|| {
            Refusal::out_of_range(format!("unknown recording profile {}", command.profile))
        })?;
        // A new recording ends the current one.
        if let Err(why) = self.stop_recorder() {
            log::error!("{} {}", sim.stamp().frame.0, why.reason);
        }
        let config = RecordingConfig {
            path: command.path.path().to_owned(),
            profile,
            episode: self.config.episode.clone(),
            blueprints: town::catalogue().iter().map(|b| b.id.to_owned()).collect(),
            roles: sim.world().roles(),
        };
        let recorder = Recorder::start(&config).map_err(|e| Refusal::file(e.to_string()))?;
        let next_world_nanos = profile.has_inputs().then_some(0);
        self.recording = Some(Recording { recorder, profile, next_world_nanos });
        Ok(0)
    }

    /// Executes [`protocol::Command::StopRecorder`]. Returns the number of recorded frames, or why
    /// the recording ended earlier.
    pub(super) fn stop_recorder(&mut self) -> Result<u32, Refusal> {
        if let Some(why) = self.recording_error.take() {
            return Err(Refusal::file(why));
        }
        let Some(recording) = self.recording.take() else { return Ok(0) };
        recording
            .recorder
            .stop()
            .map(|frames| frames as u32)
            .map_err(|e| Refusal::file(e.to_string()))
    }

    /// Records the whole world again: the next frame does not follow from those recorded.
    pub(super) fn restart_recording(&mut self) {
        if let Some(recording) = &mut self.recording
            && recording.profile.has_inputs()
        {
            recording.next_world_nanos = Some(0);
        }
    }

    /// Passes the newest frame to the recorder. If recording fails, the recording ends and the
    /// simulation continues.
    pub(super) fn record(&mut self, sim: &Sim, header: &SnapshotHeader, journal: &[JournalEntry]) {
        let Some(mut recording) = self.recording.take() else { return };
        let now_nanos = header.stamp.sim_time_nanos;
        let is_due = recording.next_world_nanos.is_some_and(|due| now_nanos >= due);
        let mut recorded_frame = recording.recorder.blank();
        self.fill(sim, &mut recorded_frame, &recording, header, journal);
        recorded_frame.world = is_due.then(|| self.state(sim).to_bytes());
        if is_due {
            // A recording of states is re-simulated from its start, so its frames need no further
            // worlds.
            let again = recording.profile == Profile::Inputs;
            recording.next_world_nanos = again.then_some(now_nanos + WORLD_NANOS);
        }
        self.recorded_decision = recorded_frame.decision.frame;
        let frame = header.stamp.frame.0;
        match recording.recorder.put(recorded_frame) {
            Ok(waited) => {
                if waited && recording.recorder.waits() == 1 {
                    log::warn!(
                        "{frame} the disk of the recording is slower than the simulation; ticks wait for it"
                    );
                }
                self.recording = Some(recording);
            }
            Err(e) => {
                log::error!("{frame} the recording ends: {e}");
                self.recording_error =
                    Some(format!("the recording ended before frame {frame}: {e}"));
            }
        }
    }

    fn fill(
        &self,
        sim: &Sim,
        recorded_frame: &mut RecordedFrame,
        recording: &Recording,
        header: &SnapshotHeader,
        journal: &[JournalEntry],
    ) {
        recorded_frame.stamp = header.stamp;
        recorded_frame.delta_nanos = sim.settings().delta_nanos;
        recorded_frame.substep_max_nanos = sim.settings().substep_max_nanos;
        recorded_frame.state_hash = header.state_hash;
        recorded_frame.early = self.early as u32;
        recorded_frame.actors.clear();
        recorded_frame.limbs.clear();
        recorded_frame.journal.clear();
        recorded_frame.collisions.clear();
        if recording.profile.has_states() {
            recorded_frame.actors.extend(sim.states());
            recorded_frame.limbs.extend(sim.world().limbs());
        }
        if !recording.profile.has_inputs() {
            recorded_frame.decision = Decision::default();
            return;
        }
        recorded_frame.journal.extend_from_slice(journal);
        recorded_frame.collisions.extend(sim.world().frame_collisions().map(|c| Collision {
            actor: c.actor,
            other: c.other,
            impulse_ns: c.impulse_ns.to_array(),
            began: c.began.into(),
        }));
        let frame = self.decided.as_ref().map_or(Frame(0), |d| d.header().stamp.frame);
        let follows = frame == self.recorded_decision || frame == self.recorded_decision.next();
        recorded_frame.decision = Decision {
            frame,
            hash: sim.decision_hash(),
            whole: if follows { None } else { self.decided.as_ref().map(|d| d.to_owned()) },
        };
    }
}
