//! The standing state: what of the journal still holds, for participants that come later.

use std::collections::{BTreeMap, VecDeque};

use bus::{
    ActorId, Frame, GivenPoses, HideLayers, HideObjects, JournalEntry, Outcome, PIPELINE_MAX,
    RigId, Stamp, SwitchLamps, TrafficDial, Weather, Wish, dial, status,
};
use town::{Lighting, Shine, Visibility};

use crate::{drawings::Drawings, journal::Request};

/// Entries that still hold, by what they are about.
#[derive(Clone, Default)]
struct Sediment {
    rigs: BTreeMap<RigId, Vec<JournalEntry>>,
    /// The rig whose sensors are coming.
    open_rig: RigId,
    /// Which map was loaded last.
    map: Option<JournalEntry>,
    weather: Option<JournalEntry>,
    settings: Option<JournalEntry>,
    dials: BTreeMap<(ActorId, u32), JournalEntry>,
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
        let wish = entry.command.wish();
        wish.iter().for_each(|wish| self.poses.follow(wish));
        match wish {
            Some(Wish::CreateRig(_)) => {
                self.open_rig = RigId(entry.outcome.id);
                self.rigs.insert(self.open_rig, vec![*entry]);
            }
            Some(Wish::Sensor(_)) => {
                self.rigs.entry(self.open_rig).or_default().push(*entry);
            }
            Some(Wish::DestroyRig(rig)) => {
                self.rigs.remove(&rig);
            }
            Some(Wish::SetWeather(_)) => self.weather = Some(*entry),
            Some(Wish::SetSettings(_)) => self.settings = Some(*entry),
            Some(Wish::TrafficDial(set)) => {
                if let Some(other) = dial::displaces(set.dial) {
                    self.dials.remove(&(set.actor_id, other));
                }
                if !dial::is_once(set.dial) {
                    self.dials.insert((set.actor_id, set.dial), *entry);
                }
            }
            Some(Wish::HideLayers(hide)) => self.hidden.set_layers(hide.layers, hide.hidden != 0),
            Some(Wish::HideObjects(hide)) => {
                self.hidden.set_objects(hide.block, &hide.bits, hide.hidden != 0);
            }
            Some(Wish::SwitchLamps(to)) => self.lighting.set(to.block, &to.bits, shine(&to)),
            Some(Wish::Draw(shape)) => self.drawings.settle(&shape, &entry.outcome),
            Some(Wish::Erase(erase)) => self.drawings.erase(&erase),
            // A new world, in which time passes as before.
            Some(Wish::LoadMap(_)) => {
                let settings = self.settings.take();
                *self = Sediment { map: Some(*entry), settings, ..Sediment::default() };
            }
            // What was saved with the state follows.
            Some(Wish::LoadState(_)) => {
                self.dials.clear();
                self.hidden = Visibility::default();
                self.drawings.clear();
                self.lighting = Lighting::default();
            }
            Some(Wish::Destroy(actor)) => {
                self.dials.retain(|&(of, dial), _| !dial::ends_with(of, dial, actor));
            }
            _ => {}
        }
    }

    fn entries(&self) -> Vec<JournalEntry> {
        let settings = self.map.iter().chain(&self.settings).chain(&self.weather).copied();
        let dials = self.dials.values().copied();
        let shown = hiding(&self.hidden).into_iter().chain(self.poses.wishes());
        let hidden = shown.map(|wish| Request::of_host(wish).ended(Outcome::done(0)));
        let lit = lit(&self.lighting).into_iter().map(Wish::SwitchLamps);
        let lit = lit.map(|wish| Request::of_host(wish).ended(Outcome::done(0)));
        let drawn = self.drawings.entries();
        let rigs = self.rigs.values().flatten().copied();
        settings.chain(dials).chain(hidden).chain(lit).chain(drawn).chain(rigs).collect()
    }
}

/// The wishes that switch off what is switched off.
pub(crate) fn hiding(hidden: &Visibility) -> Vec<Wish> {
    let layers = hidden.hidden_layers();
    let objects =
        hidden.hidden_objects().map(|(block, bits)| HideObjects { block, hidden: 1, bits: *bits });
    let layers = (layers != 0).then_some(HideLayers { layers, hidden: 1 });
    layers.into_iter().map(Wish::HideLayers).chain(objects.map(Wish::HideObjects)).collect()
}

/// How it says lamps are to shine.
pub(crate) fn shine(told: &SwitchLamps) -> Shine {
    Shine { mode: told.mode, color: told.color, share: told.share }
}

/// What tells street lamps to shine as they do.
pub(crate) fn lit(lighting: &Lighting) -> Vec<SwitchLamps> {
    let told = lighting.told().into_iter();
    told.map(|(block, bits, Shine { mode, color, share })| SwitchLamps {
        block,
        mode,
        color,
        share,
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

    /// The sky and traffic's dials as they stand, with `coming` lines of the next frame.
    pub(crate) fn sky_and_dials(
        &self,
        coming: &[JournalEntry],
    ) -> (Option<Weather>, Vec<TrafficDial>) {
        let mut sediment = self.base.clone();
        let recent = self.recent.iter().flat_map(|(_, entries)| entries);
        recent.chain(coming).for_each(|entry| sediment.settle(entry));
        let weather = sediment.weather.and_then(|entry| match entry.command.wish() {
            Some(Wish::SetWeather(weather)) => Some(weather),
            _ => None,
        });
        let dials = sediment.dials.values().filter_map(|entry| match entry.command.wish() {
            Some(Wish::TrafficDial(dial)) => Some(dial),
            _ => None,
        });
        (weather, dials.collect())
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
    use bus::{BlendPose, CreateRig, Name, Outcome, SensorSpec, SetBones, Shape, shape};

    fn at(frame: u64) -> Stamp {
        Stamp { frame: Frame(frame), sim_time_nanos: frame * 100, ..Stamp::default() }
    }

    fn entry(wish: Wish, id: u32) -> JournalEntry {
        JournalEntry {
            client: Name::new("tester"),
            sequence: 0,
            command: wish.into(),
            outcome: Outcome::done(id),
        }
    }

    fn rig(id: u32) -> Vec<JournalEntry> {
        vec![
            entry(Wish::CreateRig(CreateRig::default()), id),
            entry(Wish::Sensor(SensorSpec::default()), 0),
        ]
    }

    #[test]
    fn what_was_taken_away_does_not_stand() {
        let mut standing = Standing::default();
        standing.close(at(1), rig(1));
        standing.close(at(2), rig(2));
        standing.close(at(3), vec![entry(Wish::DestroyRig(RigId(1)), 1)]);
        for frame in 4..10 {
            standing.close(at(frame), vec![]);
        }
        let ((at, entries), after) = standing.since(Frame(9));
        assert_eq!((at, entries, after), (Frame(9), rig(2), vec![]));
    }

    #[test]
    fn poses_stand_until_their_walker_is_gone() {
        let mut standing = Standing::default();
        let set = |first| SetBones { actor_id: ActorId(3), first, count: 6, ..SetBones::default() };
        let blend = Wish::BlendPose(BlendPose { actor_id: ActorId(3), share: 1.0 });
        let wishes = [Wish::SetBones(set(0)), Wish::SetBones(set(6)), blend];
        standing.close(at(1), wishes.iter().map(|wish| entry(*wish, 3)).collect());
        standing.close(at(2), vec![entry(Wish::SetBones(set(6)), 3)]);
        let told = |standing: &Standing, frame| {
            let ((_, entries), _) = standing.since(Frame(frame));
            entries.iter().filter_map(|entry| entry.command.wish()).collect::<Vec<_>>()
        };
        assert_eq!(told(&standing, 2), wishes);
        standing.close(at(3), vec![entry(Wish::Destroy(ActorId(3)), 3)]);
        assert_eq!(told(&standing, 3), []);
    }

    #[test]
    fn one_who_trails_is_served_the_state_at_its_own_frame() {
        let mut standing = Standing::default();
        let mild = entry(Wish::SetWeather(Weather::default()), 0);
        standing.close(at(1), vec![mild]);
        let wet = entry(Wish::SetWeather(Weather { wetness: 90.0, ..Weather::default() }), 0);
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
            JournalEntry { outcome, ..entry(Wish::Draw(shape), 0) }
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
        let another = entry(Wish::LoadMap(bus::LoadMap::default()), 2);
        standing.close(at(10), vec![another]);
        assert_eq!(ids(10, &standing), [2], "of the old world, nothing stands");
    }
}
