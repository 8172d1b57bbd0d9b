//! Street lamps, as CARLA's clients believe them to be.

use std::collections::{BTreeMap, BTreeSet};

use client_lib::{StreetLightCommand, wire::Command};

use crate::{
    args::{Args, Refusal},
    msgpack::Pack,
    wire::flip,
};

/// CARLA's group of street lamps.
const STREET: u32 = 2;
/// What a lamp sheds that was told nothing.
const LUMENS: f32 = 1000.0;
/// What it looks like then.
const COLOR: [u8; 3] = [255, 214, 170];

/// What one lamp was told.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Told {
    lumens: f32,
    color: [u8; 3],
    group: u32,
    /// Nothing: it shines by night.
    active: Option<bool>,
}

impl Default for Told {
    fn default() -> Told {
        Told { lumens: LUMENS, color: COLOR, group: STREET, active: None }
    }
}

/// Lamps by the numbers of their poles, which are their ids.
#[derive(Debug)]
pub(crate) struct Street {
    told: BTreeMap<u32, Told>,
    /// Lamps go on at dusk and off at dawn.
    pub(crate) follows_day: bool,
    pub(crate) is_night: bool,
}

impl Default for Street {
    fn default() -> Street {
        Street { told: BTreeMap::new(), follows_day: true, is_night: false }
    }
}

impl Street {
    /// `[id, location, lumens, group, colour, active]` of every lamp.
    pub(crate) fn write(&self, lamps: &[town::Lamp], out: &mut Pack) {
        out.list(lamps.len());
        for lamp in lamps {
            let id = lamp.object + 1;
            let told = self.told.get(&id).copied().unwrap_or_default();
            out.list(6).uint(id.into()).vector(flip(lamp.position.to_array()));
            out.f32(told.lumens).uint(told.group.into()).list(3);
            told.color.iter().for_each(|part| {
                out.uint((*part).into());
            });
            out.bool(told.active.unwrap_or(self.is_night));
        }
    }

    /// Takes in what a client tells of lamps; unknown ones are passed over.
    pub(crate) fn take(
        &mut self,
        lamps: &[town::Lamp],
        states: &mut Args,
    ) -> Result<Vec<Command>, Refusal> {
        let known: BTreeSet<u32> = lamps.iter().map(|lamp| lamp.object + 1).collect();
        let mut changed = BTreeSet::new();
        while states.len() > 0 {
            let mut state = states.list()?;
            let id = state.u32()?;
            state.next()?;
            let (lumens, group) = (state.f32()?, state.u32()?);
            let mut color = state.list()?;
            let color = [color.u32()? as u8, color.u32()? as u8, color.u32()? as u8];
            let active = Some(state.bool()?);
            if !(0.0..=LUMENS * 100.0).contains(&lumens) {
                return Err(format!("lamp {id} is to shed {lumens} lm, not 0 to 100000").into());
            }
            if known.contains(&id) {
                self.told.insert(id, Told { lumens, color, group, active });
                changed.insert(id);
            }
        }
        Ok(self.commands(changed))
    }

    /// Lamps shine by night from now on, all of them, or stay as they are.
    pub(crate) fn follow_day(&mut self, on: bool, lamps: &[town::Lamp]) -> Vec<Command> {
        self.follows_day = on;
        let ids = lamps.iter().map(|lamp| lamp.object + 1);
        for id in ids.clone() {
            let told = self.told.entry(id).or_default();
            told.active = if on { None } else { told.active.or(Some(self.is_night)) };
        }
        self.commands(ids)
    }

    /// What the sky says; at dusk and dawn, what was switched by hand is so no more. Says whether
    /// it is one.
    pub(crate) fn see(&mut self, is_night: bool) -> Option<Vec<Command>> {
        let changes = std::mem::replace(&mut self.is_night, is_night) != is_night;
        if !changes || !self.follows_day {
            return None;
        }
        let switched: Vec<u32> =
            self.told.iter_mut().filter_map(|(id, told)| told.active.take().map(|_| *id)).collect();
        Some(self.commands(switched))
    }

    fn commands(&self, ids: impl IntoIterator<Item = u32>) -> Vec<Command> {
        let mut alike: Vec<(Told, Vec<u32>)> = Vec::new();
        for id in ids {
            let told = Told { group: STREET, ..self.told.get(&id).copied().unwrap_or_default() };
            match alike.iter_mut().find(|(other, _)| *other == told) {
                Some((_, ids)) => ids.push(id),
                None => alike.push((told, vec![id])),
            }
        }
        let of = |(told, ids): (Told, Vec<u32>)| {
            let shining = match told.active {
                None => StreetLightCommand::at_night(),
                Some(true) => StreetLightCommand::on(),
                Some(false) => StreetLightCommand::off(),
            };
            let painted = if told.color == COLOR { shining } else { shining.color(told.color) };
            painted.intensity(told.lumens / LUMENS).commands(&ids)
        };
        alike.into_iter().flat_map(of).collect()
    }
}
