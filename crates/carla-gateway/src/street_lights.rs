//! Street lights, as CARLA's clients have switched them.

use std::collections::{BTreeMap, BTreeSet};

use client_lib::{StreetLightCommand, wire::Command};

use crate::{
    args::{Args, RpcError},
    msgpack::Pack,
    wire::flip,
};

/// CARLA's group of street lights.
const STREET: u32 = 2;
/// The luminous flux of a light that no client has set. Lumens.
const LUMENS: f32 = 1000.0;
/// The colour of a light that no client has set.
const COLOR: [u8; 3] = [255, 214, 170];

/// The state of one light, as clients have set it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LightState {
    lumens: f32,
    color: [u8; 3],
    group: u32,
    /// `None`: it is on at night.
    active: Option<bool>,
}

impl Default for LightState {
    fn default() -> LightState {
        LightState { lumens: LUMENS, color: COLOR, group: STREET, active: None }
    }
}

/// The street lights, by the ids of their poles.
#[derive(Debug)]
pub(crate) struct StreetLights {
    states: BTreeMap<u32, LightState>,
    /// Lights go on at dusk and off at dawn.
    pub(crate) follows_day: bool,
    pub(crate) is_night: bool,
}

impl Default for StreetLights {
    fn default() -> StreetLights {
        StreetLights { states: BTreeMap::new(), follows_day: true, is_night: false }
    }
}

impl StreetLights {
    /// Writes `[id, location, lumens, group, colour, active]` of every light.
    pub(crate) fn write(&self, lamps: &[town::Lamp], out: &mut Pack) {
        out.list(lamps.len());
        for lamp in lamps {
            let id = lamp.object + 1;
            let state = self.states.get(&id).copied().unwrap_or_default();
            out.list(6).uint(id.into()).vector(flip(lamp.position.to_array()));
            out.f32(state.lumens).uint(state.group.into()).list(3);
            state.color.iter().for_each(|part| {
                out.uint((*part).into());
            });
            out.bool(state.active.unwrap_or(self.is_night));
        }
    }

    /// Applies the states that a client sends, and returns the commands. Unknown ids are ignored.
    ///
    /// # Errors
    ///
    /// Returns an error if a state cannot be read or its flux is out of range.
    pub(crate) fn update(
        &mut self,
        lamps: &[town::Lamp],
        states: &mut Args,
    ) -> Result<Vec<Command>, RpcError> {
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
                return Err(format!(
                    "intensity of street light {id} is {lumens} lm, must be 0 to 100000"
                )
                .into());
            }
            if known.contains(&id) {
                self.states.insert(id, LightState { lumens, color, group, active });
                changed.insert(id);
            }
        }
        Ok(self.commands(changed))
    }

    /// Lets all lights follow the sun, or keeps them as they are, and returns the commands.
    pub(crate) fn follow_sun(&mut self, on: bool, lamps: &[town::Lamp]) -> Vec<Command> {
        self.follows_day = on;
        let ids = lamps.iter().map(|lamp| lamp.object + 1);
        for id in ids.clone() {
            let state = self.states.entry(id).or_default();
            state.active = if on { None } else { state.active.or(Some(self.is_night)) };
        }
        self.commands(ids)
    }

    /// Takes over whether it is night. At dusk and dawn, lights that clients have switched follow
    /// the sun again; returns their commands, or `None` at other times.
    pub(crate) fn set_night(&mut self, is_night: bool) -> Option<Vec<Command>> {
        let changes = std::mem::replace(&mut self.is_night, is_night) != is_night;
        if !changes || !self.follows_day {
            return None;
        }
        let switched: Vec<u32> = self
            .states
            .iter_mut()
            .filter_map(|(id, state)| state.active.take().map(|_| *id))
            .collect();
        Some(self.commands(switched))
    }

    fn commands(&self, ids: impl IntoIterator<Item = u32>) -> Vec<Command> {
        let mut groups: Vec<(LightState, Vec<u32>)> = Vec::new();
        for id in ids {
            let state =
                LightState { group: STREET, ..self.states.get(&id).copied().unwrap_or_default() };
            match groups.iter_mut().find(|(other, _)| *other == state) {
                Some((_, ids)) => ids.push(id),
                None => groups.push((state, vec![id])),
            }
        }
        let of = |(state, ids): (LightState, Vec<u32>)| {
            let command = match state.active {
                None => StreetLightCommand::at_night(),
                Some(true) => StreetLightCommand::on(),
                Some(false) => StreetLightCommand::off(),
            };
            let colored = if state.color == COLOR { command } else { command.color(state.color) };
            colored.intensity(state.lumens / LUMENS).commands(&ids)
        };
        groups.into_iter().flat_map(of).collect()
    }
}
