//! The standing state: what of the journal still holds, for participants that come later.

use std::collections::{BTreeMap, VecDeque};

use protocol::{
    ActorId, BundleId, Command, Frame, GivenPoses, HideLayers, HideObjects, JournalEntry, Outcome,
    PIPELINE_MAX, SetStreetLights, Stamp, TrafficParam, Weather, param, status,
};
use town::{Lighting, StreetLightState, Visibility};

use crate::{drawings::Drawings, journal::Request};

/// Entries that still hold, by what they are about.
#[derive(Clone, Default)]
struct Sediment {
    bundles: BTreeMap<BundleId, Vec<JournalEntry>>,
    /// The bundle whose sensors are coming.
    open_rig: BundleId,
    /// Which map was loaded last.
    map: Option<JournalEntry>,
    weather: Option<JournalEntry>,
    settings: Option<JournalEntry>,
    params: BTreeMap<(ActorId, u32), JournalEntry>,
    /// What of the town is switched off.
    hidden: Visibility,
    drawings: Drawings,
    /// The poses that clients gave walkers.
    poses: GivenPoses,
    lighting: Lighting,
}

impl Sediment {
    fn settle(&mut self, entry: &JournalEntry) {
        if entry.outcome.status != status::DONE {
            return;
        }
        let command = entry.command.decode();
        command.iter().for_each(|command| self.poses.follow(command));
        match command {
            Some(Command::CreateBundle(_)) => {
                self.open_rig = BundleId(entry.outcome.id);
                self.bundles.insert(self.open_rig, vec![*entry]);
            }
            Some(Command::Sensor(_)) => {
                self.bundles.entry(self.open_rig).or_default().push(*entry);
            }
            Some(Command::DestroyBundle(bundle)) => {
                self.bundles.remove(&bundle);
            }
            Some(Command::SetWeather(_)) => self.weather = Some(*entry),
            Some(Command::SetSettings(_)) => self.settings = Some(*entry),
            Some(Command::TrafficParam(set)) => {
                if let Some(other) = param::displaces(set.param) {
                    self.params.remove(&(set.actor_id, other));
                }
                if !param::is_once(set.param) {
                    self.params.insert((set.actor_id, set.param), *entry);
                }
            }
            Some(Command::HideLayers(hide)) => {
                self.hidden.set_layers(hide.layers, hide.hidden != 0)
            }
            Some(Command::HideObjects(hide)) => {
                self.hidden.set_objects(hide.block, &hide.bits, hide.hidden != 0);
            }
            Some(Command::SetStreetLights(to)) => self.lighting.set(to.block, &to.bits, shine(&to)),
            Some(Command::Draw(shape)) => self.drawings.settle(&shape, &entry.outcome),
            Some(Command::EraseShapes(erase)) => self.drawings.erase(&erase),
            // A new world, in which time passes as before.
            Some(Command::LoadMap(_)) => {
                let settings = self.settings.take();
                *self = Sediment { map: Some(*entry), settings, ..Sediment::default() };
            }
            // What was saved with the state follows.
            Some(Command::LoadState(_)) => {
                self.params.clear();
                self.hidden = Visibility::default();
                self.drawings.clear();
                self.lighting = Lighting::default();
            }
            Some(Command::Destroy(actor)) => {
                self.params.retain(|&(of, param), _| !param::ends_with(of, param, actor));
            }
            _ => {}
        }
    }

    fn entries(&self) -> Vec<JournalEntry> {
        let settings = self.map.iter().chain(&self.settings).chain(&self.weather).copied();
        let params = self.params.values().copied();
        let shown = hiding(&self.hidden).into_iter().chain(self.poses.commands());
        let hidden = shown.map(|command| Request::of_host(command).ended(Outcome::done(0)));
        let lit = lit(&self.lighting).into_iter().map(Command::SetStreetLights);
        let lit = lit.map(|command| Request::of_host(command).ended(Outcome::done(0)));
        let drawn = self.drawings.entries();
        let bundles = self.bundles.values().flatten().copied();
        settings.chain(params).chain(hidden).chain(lit).chain(drawn).chain(bundles).collect()
    }
}

/// The commands that switch off what is switched off.
pub(crate) fn hiding(hidden: &Visibility) -> Vec<Command> {
    let layers = hidden.hidden_layers();
    let objects =
        hidden.hidden_objects().map(|(block, bits)| HideObjects { block, hidden: 1, bits: *bits });
    let layers = (layers != 0).then_some(HideLayers { layers, hidden: 1 });
    layers.into_iter().map(Command::HideLayers).chain(objects.map(Command::HideObjects)).collect()
}

/// How it says lamps are to shine.
pub(crate) fn shine(told: &SetStreetLights) -> StreetLightState {
    StreetLightState { mode: told.mode, color: told.color, intensity: told.intensity }
}

/// What tells street lamps to shine as they do.
pub(crate) fn lit(lighting: &Lighting) -> Vec<SetStreetLights> {
    let told = lighting.settings().into_iter();
    told.map(|(block, bits, StreetLightState { mode, color, intensity })| SetStreetLights {
        block,
        mode,
        color,
        intensity,
        bits,
    })
    .collect()
}

/// A frame and its entries.
type Page = (Frame, Vec<JournalEntry>);

/// The standing state some frames ago, and the journals since: enough to serve anyone whose work
/// ended in between.
#[derive(Default)]
pub(crate) struct Standing {
    base: Sediment,
    base_frame: Frame,
    recent: VecDeque<(Stamp, Vec<JournalEntry>)>,
}

impl Standing {
    /// A frame's journal is complete.
    pub(crate) fn close(&mut self, stamp: Stamp, entries: Vec<JournalEntry>) {
        self.recent.push_back((stamp, entries));
        while self.recent.len() > PIPELINE_MAX as usize + 1 {
            if let Some((stamp, entries)) = self.recent.pop_front() {
                entries.iter().for_each(|entry| self.base.settle(entry));
                self.base.drawings.forget(stamp);
                self.base_frame = stamp.frame;
            }
        }
    }

    /// The sky and traffic's params as they stand, with `coming` lines of the next frame.
    pub(crate) fn sky_and_dials(
        &self,
        coming: &[JournalEntry],
    ) -> (Option<Weather>, Vec<TrafficParam>) {
        let mut sediment = self.base.clone();
        let recent = self.recent.iter().flat_map(|(_, entries)| entries);
        recent.chain(coming).for_each(|entry| sediment.settle(entry));
        let weather = sediment.weather.and_then(|entry| match entry.command.decode() {
            Some(Command::SetWeather(weather)) => Some(weather),
            _ => None,
        });
        let params = sediment.params.values().filter_map(|entry| match entry.command.decode() {
            Some(Command::TrafficParam(param)) => Some(param),
            _ => None,
        });
        (weather, params.collect())
    }

    /// For one whose work is done up to `done`: the frame and entries of a keyframe, and the
    /// journals that follow it.
    pub(crate) fn since(&self, done: Frame) -> (Page, Vec<Page>) {
        let mut sediment = self.base.clone();
        let mut at = self.base_frame;
        let mut after = Vec::new();
        for (stamp, entries) in &self.recent {
            if stamp.frame <= done {
                entries.iter().for_each(|entry| sediment.settle(entry));
                sediment.drawings.forget(*stamp);
                at = stamp.frame;
            } else if !entries.is_empty() {
                after.push((stamp.frame, entries.clone()));
            }
        }
        ((at, sediment.entries()), after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{BlendPose, CreateBundle, Name, Outcome, SensorSpec, SetBones, Shape, shape};

    fn at(frame: u64) -> Stamp {
        Stamp { frame: Frame(frame), sim_time_nanos: frame * 100, ..Stamp::default() }
    }

    fn entry(command: Command, id: u32) -> JournalEntry {
        JournalEntry {
            client: Name::new("tester"),
            sequence: 0,
            command: command.into(),
            outcome: Outcome::done(id),
        }
    }

    fn bundle(id: u32) -> Vec<JournalEntry> {
        vec![
            entry(Command::CreateBundle(CreateBundle::default()), id),
            entry(Command::Sensor(SensorSpec::default()), 0),
        ]
    }

    #[test]
    fn what_was_taken_away_does_not_stand() {
        let mut standing = Standing::default();
        standing.close(at(1), bundle(1));
        standing.close(at(2), bundle(2));
        standing.close(at(3), vec![entry(Command::DestroyBundle(BundleId(1)), 1)]);
        for frame in 4..10 {
            standing.close(at(frame), vec![]);
        }
        let ((at, entries), after) = standing.since(Frame(9));
        assert_eq!((at, entries, after), (Frame(9), bundle(2), vec![]));
    }

    #[test]
    fn poses_stand_until_their_walker_is_gone() {
        let mut standing = Standing::default();
        let set = |first| SetBones { actor_id: ActorId(3), first, count: 6, ..SetBones::default() };
        let blend = Command::BlendPose(BlendPose { actor_id: ActorId(3), weight: 1.0 });
        let commands = [Command::SetBones(set(0)), Command::SetBones(set(6)), blend];
        standing.close(at(1), commands.iter().map(|command| entry(*command, 3)).collect());
        standing.close(at(2), vec![entry(Command::SetBones(set(6)), 3)]);
        let told = |standing: &Standing, frame| {
            let ((_, entries), _) = standing.since(Frame(frame));
            entries.iter().filter_map(|entry| entry.command.decode()).collect::<Vec<_>>()
        };
        assert_eq!(told(&standing, 2), commands);
        standing.close(at(3), vec![entry(Command::Destroy(ActorId(3)), 3)]);
        assert_eq!(told(&standing, 3), []);
    }

    #[test]
    fn one_who_trails_is_served_the_state_at_its_own_frame() {
        let mut standing = Standing::default();
        let mild = entry(Command::SetWeather(Weather::default()), 0);
        standing.close(at(1), vec![mild]);
        let wet = entry(Command::SetWeather(Weather { wetness: 90.0, ..Weather::default() }), 0);
        standing.close(at(2), vec![]);
        standing.close(at(3), vec![wet]);
        let ((at, entries), after) = standing.since(Frame(2));
        assert_eq!((at, entries, after), (Frame(2), vec![mild], vec![(Frame(3), vec![wet])]));
    }

    #[test]
    fn what_is_drawn_stands_as_long_as_it_lives() {
        let mut standing = Standing::default();
        let mut drawings = Drawings::default();
        let mut draw = |life_nanos| {
            let shape = Shape { life_nanos, ..Shape::new(shape::POINT) };
            let outcome = drawings.draw(&shape, at(1)).unwrap();
            JournalEntry { outcome, ..entry(Command::Draw(shape), 0) }
        };
        standing.close(at(1), vec![draw(0), draw(150), draw(1000)]);
        let ids = |done: u64, standing: &Standing| -> Vec<u32> {
            let ((_, entries), _) = standing.since(Frame(done));
            entries.iter().map(|entry| entry.outcome.id).collect()
        };
        assert_eq!(ids(1, &standing), [2, 3]);
        for frame in 2..10 {
            standing.close(at(frame), vec![]);
        }
        assert_eq!(ids(9, &standing), [3]);
        let another = entry(Command::LoadMap(protocol::LoadMap::default()), 2);
        standing.close(at(10), vec![another]);
        assert_eq!(ids(10, &standing), [2], "of the old world, nothing stands");
    }
}
