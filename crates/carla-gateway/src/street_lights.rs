//! Street lights in CARLA's terms. Their states are those of the world's standing state.

use std::collections::{BTreeMap, BTreeSet};

use client_lib::{
    StreetLightCommand,
    wire::{Command, StandingState, StreetLightState, street_light},
};

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

/// The state of one light.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LightState {
    lumens: f32,
    color: [u8; 3],
    /// `None`: it is on at night.
    active: Option<bool>,
}

impl LightState {
    fn of(state: &StreetLightState) -> LightState {
        let [r, g, b, _] = state.color.to_le_bytes();
        LightState {
            lumens: state.intensity * LUMENS,
            color: if state.color == 0 { COLOR } else { [r, g, b] },
            active: match state.mode {
                street_light::OFF => Some(false),
                street_light::ON => Some(true),
                _ => None,
            },
        }
    }
}

/// The properties of street lights that exist in CARLA only. Lights are identified by their poles.
#[derive(Debug)]
pub(crate) struct StreetLights {
    /// The group of each light that a client has moved to another one.
    groups: BTreeMap<u32, u32>,
    /// Lights go on at dusk and off at dawn.
    follows_day: bool,
}

impl Default for StreetLights {
    fn default() -> StreetLights {
        StreetLights { groups: BTreeMap::new(), follows_day: true }
    }
}

/// Returns whether the sun is below the horizon.
pub(crate) fn is_night(standing: &StandingState) -> bool {
    standing.weather.sun_altitude_rad < 0.0
}

/// Returns the state of each light that is not in its default state.
fn states(standing: &StandingState) -> BTreeMap<u32, LightState> {
    standing.street_lights.lamps().map(|(id, state)| (id, LightState::of(state))).collect()
}

impl StreetLights {
    /// Writes `[id, location, lumens, group, colour, active]` of every light.
    pub(crate) fn write(&self, lamps: &[town::Lamp], standing: &StandingState, out: &mut Pack) {
        let states = states(standing);
        let own = LightState::of(&StreetLightState::OWN);
        let is_night = is_night(standing);
        out.list(lamps.len());
        for lamp in lamps {
            let id = lamp.object + 1;
            let state = states.get(&id).unwrap_or(&own);
            let group = self.groups.get(&id).copied().unwrap_or(STREET);
            out.list(6).uint(id.into()).vector(flip(lamp.position.to_array()));
            out.f32(state.lumens).uint(group.into()).list(3);
            state.color.iter().for_each(|part| {
                out.uint((*part).into());
            });
            out.bool(state.active.unwrap_or(is_night));
        }
    }

    /// Reads the states that a client sends, and returns the commands that set them. Unknown ids
    /// are ignored.
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
        let mut changed = BTreeMap::new();
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
                self.groups.insert(id, group);
                changed.insert(id, LightState { lumens, color, active });
            }
        }
        Ok(commands(changed))
    }

    /// Lets all lights follow the sun, or keeps them as they are, and returns the commands.
    pub(crate) fn follow_sun(
        &mut self,
        on: bool,
        lamps: &[town::Lamp],
        standing: &StandingState,
    ) -> Vec<Command> {
        self.follows_day = on;
        let states = states(standing);
        let own = LightState::of(&StreetLightState::OWN);
        let is_night = is_night(standing);
        commands(lamps.iter().map(|lamp| {
            let id = lamp.object + 1;
            let state = states.get(&id).copied().unwrap_or(own);
            let active = if on { None } else { state.active.or(Some(is_night)) };
            (id, LightState { active, ..state })
        }))
    }

    /// Returns the commands at dusk and dawn, when lights that were switched follow the sun again;
    /// `None` at other times.
    pub(crate) fn at_dusk_or_dawn(
        &self,
        was_night: bool,
        standing: &StandingState,
    ) -> Option<Vec<Command>> {
        if is_night(standing) == was_night || !self.follows_day {
            return None;
        }
        let switched = states(standing).into_iter().filter(|(_, state)| state.active.is_some());
        Some(commands(switched.map(|(id, state)| (id, LightState { active: None, ..state }))))
    }
}

/// Returns the commands that set lights to these states.
fn commands(states: impl IntoIterator<Item = (u32, LightState)>) -> Vec<Command> {
    let mut groups: Vec<(LightState, Vec<u32>)> = Vec::new();
    for (id, state) in states {
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
