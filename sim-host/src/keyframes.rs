//! Keyframes of the journal: what still holds, for late participants.

use std::collections::{BTreeMap, VecDeque};

use protocol::{
    BundleId, Command, Frame, JournalEntry, PIPELINE_MAX, Stamp, StandingState, status,
};

use crate::request::Request;

/// The part of the journal that still holds: the standing state, the map and the bundles.
#[derive(Clone, Default)]
struct Holding {
    standing: StandingState,
    bundles: BTreeMap<BundleId, Vec<JournalEntry>>,
    /// The bundle whose sensors follow.
    open_bundle: BundleId,
    /// The entry that loaded the map, if it is not the first map.
    map: Option<JournalEntry>,
}

impl Holding {
    fn apply(&mut self, entry: &JournalEntry) {
        let Some(command) = entry.command.decode() else { return };
        self.standing.apply(&command, &entry.outcome);
        if entry.outcome.status != status::DONE {
            return;
        }
        match command {
            Command::CreateBundle(_) => {
                self.open_bundle = BundleId(entry.outcome.id);
                self.bundles.insert(self.open_bundle, vec![*entry]);
            }
            Command::Sensor(_) => {
                self.bundles.entry(self.open_bundle).or_default().push(*entry);
            }
            Command::DestroyBundle(bundle) => {
                self.bundles.remove(&bundle);
            }
            // The bundles of the old world were removed before.
            Command::LoadMap(_) => {
                self.map = Some(*entry);
                self.bundles.clear();
            }
            _ => {}
        }
    }

    fn entries(&self) -> Vec<JournalEntry> {
        let standing = self.standing.commands().into_iter();
        let standing = standing.map(|(command, outcome)| Request::of_host(command).ended(outcome));
        let bundles = self.bundles.values().flatten().copied();
        self.map.into_iter().chain(standing).chain(bundles).collect()
    }
}

/// A frame and its entries.
type FrameEntries = (Frame, Vec<JournalEntry>);

/// A keyframe some frames ago and the journals since: enough for any participant whose work ended
/// in between.
#[derive(Default)]
pub(crate) struct Keyframes {
    base: Holding,
    base_frame: Frame,
    recent: VecDeque<(Stamp, Vec<JournalEntry>)>,
}

impl Keyframes {
    /// Adds the complete journal of a frame. Keeps the journals of the frames after `planned`, from
    /// which a restarted planner continues.
    pub(crate) fn close(&mut self, stamp: Stamp, entries: Vec<JournalEntry>, planned: Frame) {
        self.recent.push_back((stamp, entries));
        while self.recent.len() > PIPELINE_MAX as usize + 1
            && self.recent.front().is_some_and(|(oldest, _)| oldest.frame <= planned)
        {
            if let Some((stamp, entries)) = self.recent.pop_front() {
                entries.iter().for_each(|entry| self.base.apply(entry));
                self.base.standing.end_frame(stamp);
                self.base_frame = stamp.frame;
            }
        }
    }

    /// Returns the number of frames whose journals are kept.
    #[cfg(test)]
    pub(crate) fn recent_len(&self) -> usize {
        self.recent.len()
    }

    /// Returns the frame and entries of a keyframe, and the journals that follow it, for a
    /// participant whose work is done up to `done`.
    pub(crate) fn since(&self, done: Frame) -> (FrameEntries, Vec<FrameEntries>) {
        let mut holding = self.base.clone();
        let mut at = self.base_frame;
        let mut after = Vec::new();
        for (stamp, entries) in &self.recent {
            if stamp.frame <= done {
                entries.iter().for_each(|entry| holding.apply(entry));
                holding.standing.end_frame(*stamp);
                at = stamp.frame;
            } else if !entries.is_empty() {
                after.push((stamp.frame, entries.clone()));
            }
        }
        ((at, holding.entries()), after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{
        ActorId, BlendPose, CreateBundle, DebugShapes, Outcome, SensorSpec, SetBones, Shape,
        Weather, shape,
    };

    fn at(frame: u64) -> Stamp {
        Stamp { frame: Frame(frame), sim_time_nanos: frame * 100, ..Stamp::default() }
    }

    fn entry(command: Command, id: u32) -> JournalEntry {
        Request::of_host(command).ended(Outcome::done(id))
    }

    fn bundle(id: u32) -> Vec<JournalEntry> {
        vec![
            entry(Command::CreateBundle(CreateBundle::default()), id),
            entry(Command::Sensor(SensorSpec::default()), 0),
        ]
    }

    #[test]
    fn a_destroyed_bundle_is_in_no_keyframe() {
        let mut keyframes = Keyframes::default();
        keyframes.close(at(1), bundle(1), Frame(1));
        keyframes.close(at(2), bundle(2), Frame(2));
        keyframes.close(at(3), vec![entry(Command::DestroyBundle(BundleId(1)), 1)], Frame(3));
        for frame in 4..10 {
            keyframes.close(at(frame), vec![], Frame(frame));
        }
        let ((at, entries), after) = keyframes.since(Frame(9));
        assert_eq!((at, entries, after), (Frame(9), bundle(2), vec![]));
    }

    #[test]
    fn a_pose_holds_until_its_walker_is_destroyed() {
        let mut keyframes = Keyframes::default();
        let set = |first| SetBones { actor_id: ActorId(3), first, count: 6, ..SetBones::default() };
        let blend = Command::BlendPose(BlendPose { actor_id: ActorId(3), weight: 1.0 });
        let commands = [Command::SetBones(set(0)), Command::SetBones(set(6)), blend];
        keyframes.close(
            at(1),
            commands.iter().map(|command| entry(*command, 3)).collect(),
            Frame(1),
        );
        keyframes.close(at(2), vec![entry(Command::SetBones(set(6)), 3)], Frame(2));
        let poses_at = |keyframes: &Keyframes, frame| {
            let ((_, entries), _) = keyframes.since(Frame(frame));
            entries.iter().filter_map(|entry| entry.command.decode()).collect::<Vec<_>>()
        };
        assert_eq!(poses_at(&keyframes, 2), commands);
        keyframes.close(at(3), vec![entry(Command::Destroy(ActorId(3)), 3)], Frame(3));
        assert_eq!(poses_at(&keyframes, 3), []);
    }

    #[test]
    fn a_trailing_participant_is_served_the_state_at_its_own_frame() {
        let mut keyframes = Keyframes::default();
        let mild = entry(Command::SetWeather(Weather { wetness: 10.0, ..Weather::default() }), 0);
        keyframes.close(at(1), vec![mild], Frame(1));
        let wet = entry(Command::SetWeather(Weather { wetness: 90.0, ..Weather::default() }), 0);
        keyframes.close(at(2), vec![], Frame(2));
        keyframes.close(at(3), vec![wet], Frame(3));
        let ((at, entries), after) = keyframes.since(Frame(2));
        assert_eq!((at, entries, after), (Frame(2), vec![mild], vec![(Frame(3), vec![wet])]));
    }

    #[test]
    fn what_the_planner_has_not_seen_is_not_folded() {
        let mut keyframes = Keyframes::default();
        let wet = entry(Command::SetWeather(Weather { wetness: 90.0, ..Weather::default() }), 0);
        for frame in 1..20 {
            keyframes.close(at(frame), vec![wet], Frame(3));
        }
        let ((at, entries), after) = keyframes.since(Frame(3));
        assert_eq!((at, entries, after.len()), (Frame(3), vec![wet], 16));
    }

    #[test]
    fn a_shape_holds_until_its_life_ends() {
        let mut keyframes = Keyframes::default();
        let mut shapes = DebugShapes::default();
        let mut draw = |life_nanos| {
            let shape = Shape { life_nanos, ..Shape::new(shape::POINT) };
            let outcome = shapes.admit(&shape, at(1)).unwrap();
            shapes.insert(&shape, &outcome);
            JournalEntry { outcome, ..entry(Command::Draw(shape), 0) }
        };
        keyframes.close(at(1), vec![draw(0), draw(150), draw(1000)], Frame(1));
        let ids = |done: u64, keyframes: &Keyframes| -> Vec<u32> {
            let ((_, entries), _) = keyframes.since(Frame(done));
            entries.iter().map(|entry| entry.outcome.id).collect()
        };
        assert_eq!(ids(1, &keyframes), [2, 3]);
        for frame in 2..10 {
            keyframes.close(at(frame), vec![], Frame(frame));
        }
        assert_eq!(ids(9, &keyframes), [3]);
        let another = entry(Command::LoadMap(protocol::LoadMap::default()), 2);
        keyframes.close(at(10), vec![another], Frame(10));
        assert_eq!(ids(10, &keyframes), [2], "nothing of the old world holds");
    }
}
