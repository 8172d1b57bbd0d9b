//! The replay of a recording beside the actors of the running world.
//!
//! Recorded actors are placed after physics has moved the others, so that a snapshot shows them as
//! recorded. Actors that are not in the recording continue.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Quat, Vec3};
use protocol::{
    ActorId, ActorState, Command, Episode, Refusal, StartReplay, WalkerLimbs, kind, status,
};
use record::{RecordError, RecordedFrame};

use crate::world::World;

/// Above this time factor, states are shown without interpolation.
const SMOOTH_FACTOR_MAX: f32 = 2.0;

/// A replay in progress.
pub(crate) struct Replay {
    recording: record::Recording,
    /// Recorded time that the next frame shows.
    at_nanos: u64,
    until_nanos: u64,
    time_factor: f32,
    /// Recorded ids of actors that are not shown.
    ignored: BTreeSet<ActorId>,
    /// The highest id at the end of the recording; later ids replace those that are in use.
    beyond: ActorId,
    /// The id in the world of each recorded id.
    shown: BTreeMap<ActorId, ActorId>,
}

impl Replay {
    /// Returns the recorded episode.
    pub(crate) fn episode(&self) -> &Episode {
        &self.recording.info().episode
    }

    /// Whether the requested part of the recording has been shown.
    pub(crate) fn is_over(&self) -> bool {
        self.at_nanos >= self.until_nanos
    }

    /// Advances by one frame of `delta_nanos`.
    pub(crate) fn advance(&mut self, delta_nanos: u64) {
        self.at_nanos += (delta_nanos as f64 * f64::from(self.time_factor)) as u64;
    }

    /// Returns the ids of the actors that showed recorded ones.
    pub(crate) fn into_shown(self) -> impl Iterator<Item = ActorId> {
        self.shown.into_values()
    }

    /// Opens the recording of a command.
    ///
    /// # Errors
    ///
    /// The recording cannot be read, or lacks what is requested.
    pub(crate) fn of(command: &StartReplay) -> Result<Replay, Refusal> {
        let mut recording = record::Recording::open(command.path.path())
            .map_err(|e| Refusal::file(e.to_string()))?;
        let name = recording.path().display().to_string();
        if !recording.info().profile.has_states() {
            return Err(Refusal::file(format!(
                "{name} holds inputs and no states; use omnibus replay --resimulate"
            )));
        }
        if recording.segments() == 0 {
            return Err(Refusal::file(format!("{name} holds no frames to replay")));
        }
        let time_factor = command.time_factor;
        if !(0.01..=1000.0).contains(&time_factor) {
            return Err(Refusal::out_of_range(format!(
                "time_factor is {time_factor}, not 0.01 to 1000"
            )));
        }
        let whole = recording.duration_nanos().map_err(|e| Refusal::file(e.to_string()))?;
        let from = command.from_nanos;
        let at_nanos =
            if from < 0 { whole.saturating_sub(from.unsigned_abs()) } else { from.unsigned_abs() };
        if at_nanos >= whole {
            return Err(Refusal::out_of_range(format!(
                "{name} is {:.2} s long; start earlier",
                whole as f64 / 1e9
            )));
        }
        let until_nanos = match command.duration_nanos {
            0 => whole,
            duration => at_nanos.saturating_add(duration).min(whole),
        };
        let last = recording.segments() - 1;
        let last = recording.recorded_frames(last).map_err(|e| Refusal::file(e.to_string()))?;
        let ids = last.iter().flat_map(|m| &m.actors).map(|a| a.actor_id);
        let beyond = ids.max().unwrap_or_default();
        let ignored = if command.ignore_hero != 0 {
            heroes(&mut recording).map_err(|e| Refusal::file(e.to_string()))?
        } else {
            BTreeSet::new()
        };
        let shown = BTreeMap::new();
        Ok(Replay { recording, at_nanos, until_nanos, time_factor, ignored, beyond, shown })
    }

    /// Shows the recorded frame that is due. Returns the shown actors that the recording no longer
    /// has.
    pub(crate) fn show(&mut self, world: &mut World) -> Result<Vec<ActorId>, Refusal> {
        let (actors, limbs) = self.actors().map_err(|e| Refusal::file(e.to_string()))?;
        let mut there = BTreeSet::new();
        for recorded in &actors {
            let id = recorded.actor_id;
            let limbs_of = WalkerLimbs::find(&limbs, id);
            if !recorded.is_valid() || limbs_of.is_some_and(|limbs| !limbs.is_valid()) {
                return Err(Refusal::file(format!(
                    "the recording is damaged: the state of {id} at {:.2} s holds a number that is \
                     not finite, or beyond 1e10",
                    self.at_nanos as f64 / 1e9
                )));
            }
            if self.ignored.contains(&id) {
                continue;
            }
            if recorded.kind == kind::TRAFFIC_LIGHT {
                // A traffic light of the map has the same id in every world of this map.
                world.show(id, recorded, None);
                continue;
            }
            there.insert(id);
            let own = match self.shown.get(&id) {
                Some(own) => *own,
                None => {
                    let own = world.spawn_shown(recorded, self.beyond)?;
                    self.shown.insert(id, own);
                    own
                }
            };
            world.show(own, recorded, limbs_of);
        }
        let gone: Vec<_> = self.shown.keys().filter(|id| !there.contains(id)).copied().collect();
        Ok(gone.iter().filter_map(|id| self.shown.remove(id)).collect())
    }

    /// Returns the actors at the recorded time that is due.
    fn actors(&mut self) -> Result<(Vec<ActorState>, Vec<WalkerLimbs>), RecordError> {
        let segment = self.recording.segment_at(self.at_nanos);
        let start = self.recording.start_nanos(segment);
        let segments = self.recording.segments();
        let recorded_frames = self.recording.recorded_frames(segment)?;
        let (index, past_nanos) = place(recorded_frames, self.at_nanos - start);
        let now = recorded_frames[index].actors.clone();
        let limbs = recorded_frames[index].limbs.clone();
        if past_nanos == 0 || self.time_factor > SMOOTH_FACTOR_MAX {
            return Ok((now, limbs));
        }
        let next = match recorded_frames.get(index + 1) {
            Some(next) => next,
            None if segment + 1 < segments => &self.recording.recorded_frames(segment + 1)?[0],
            None => return Ok((now, limbs)),
        };
        let share = past_nanos as f32 / next.delta_nanos.max(1) as f32;
        Ok((between(now, &next.actors, share.min(1.0)), limbs))
    }
}

/// Returns the frame that is shown at a time of a segment, and the time since it began.
fn place(recorded_frames: &[RecordedFrame], at_nanos: u64) -> (usize, u64) {
    let mut begins = 0;
    for (index, next) in recorded_frames.iter().enumerate().skip(1) {
        // A frame is shown until the next one is complete.
        if at_nanos < begins + next.delta_nanos {
            return (index - 1, at_nanos - begins);
        }
        begins += next.delta_nanos;
    }
    (recorded_frames.len() - 1, at_nanos - begins)
}

/// Interpolates poses between two frames; all else is that of the earlier one.
fn between(mut now: Vec<ActorState>, next: &[ActorState], share: f32) -> Vec<ActorState> {
    for state in &mut now {
        let Ok(at) = next.binary_search_by_key(&state.actor_id, |s| s.actor_id) else { continue };
        let to = &next[at].pose;
        let place: Vec3 = state.pose.position().lerp(to.position(), share);
        let turn: Quat = state.pose.rotation().slerp(to.rotation(), share);
        state.pose = protocol::Pose::new(place, turn.normalize());
    }
    now
}

/// Returns the recorded actors of the role `hero`.
fn heroes(recording: &mut record::Recording) -> Result<BTreeSet<ActorId>, RecordError> {
    let roles = recording.info().roles.iter();
    let mut heroes: BTreeSet<_> =
        roles.filter(|(_, role)| role == "hero").map(|(id, _)| *id).collect();
    for segment in 0..recording.segments() {
        for entry in recording.frames(segment)?.iter().flat_map(|m| &m.journal) {
            if let Some(Command::Spawn(spawn)) = entry.command.decode()
                && entry.outcome.status == status::DONE
                && spawn.role.as_str() == "hero"
            {
                heroes.insert(ActorId(entry.outcome.id));
            }
        }
    }
    Ok(heroes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_shows_until_the_next_is_done() {
        let recorded_frame =
            |delta_nanos| RecordedFrame { delta_nanos, ..RecordedFrame::default() };
        let recorded_frames = [recorded_frame(50), recorded_frame(50), recorded_frame(20)];
        for (at, expected) in
            [(0, (0, 0)), (49, (0, 49)), (50, (1, 0)), (69, (1, 19)), (70, (2, 0))]
        {
            assert_eq!(place(&recorded_frames, at), expected);
        }
    }
}
