//! What commands have switched and what holds until another command switches it.

use std::collections::BTreeMap;

use crate::{
    ActorId, Command, CommandGroup, DebugShapes, GivenPoses, HiddenObjects, Outcome,
    ServiceCommand, SetWeatherAffectsGrip, Settings, Stamp, StandingCommand, StreetLightState,
    StreetLights, TrafficParam, Weather, WorldCommand, param, status,
};

/// The persistent switches of a world: the sum of all [`StandingCommand`]s that took effect.
///
/// The host, its keyframes and saved states, the renderer and the gateway all fold the journal
/// with [`StandingState::apply`]. A new switch is a field here, an arm in `apply` and a line in
/// [`StandingState::commands`].
#[derive(Clone, Debug, Default)]
pub struct StandingState {
    /// How time passes.
    pub settings: Settings,
    /// Sun, clouds, rain and fog.
    pub weather: Weather,
    /// Whether the weather decides how much wheels grip.
    pub weather_affects_grip: bool,
    /// How traffic drives, by actor and parameter.
    traffic_params: BTreeMap<(ActorId, u32), TrafficParam>,
    /// The layers and objects of the town that are hidden.
    pub hidden: HiddenObjects,
    /// The poses that clients gave walkers.
    pub poses: GivenPoses,
    /// How street lamps shine.
    pub street_lights: StreetLights,
    /// The debug shapes that are drawn.
    pub shapes: DebugShapes,
}

impl StandingState {
    /// Takes in a command and its outcome, as a line of the journal has them. A refused command
    /// changes nothing.
    pub fn apply(&mut self, command: &Command, outcome: &Outcome) {
        if outcome.status != status::DONE {
            return;
        }
        match command.group() {
            CommandGroup::Standing(command) => self.apply_standing(&command, outcome),
            CommandGroup::World(WorldCommand::Destroy(actor)) => {
                self.poses.remove(actor);
                self.traffic_params.retain(|&(of, param), _| !param::ends_with(of, param, actor));
            }
            CommandGroup::Service(ServiceCommand::LoadMap(_)) => {
                let mut shapes = std::mem::take(&mut self.shapes);
                shapes.clear();
                *self = StandingState {
                    settings: self.settings,
                    weather_affects_grip: self.weather_affects_grip,
                    shapes,
                    ..StandingState::default()
                };
            }
            // The lines that follow this one say what was saved.
            CommandGroup::Service(ServiceCommand::LoadState(_)) => {
                let mut shapes = std::mem::take(&mut self.shapes);
                shapes.clear();
                *self =
                    StandingState { settings: self.settings, shapes, ..StandingState::default() };
            }
            CommandGroup::World(_) | CommandGroup::Sensor(_) | CommandGroup::Service(_) => {}
        }
    }

    fn apply_standing(&mut self, command: &StandingCommand, outcome: &Outcome) {
        match command {
            StandingCommand::SetWeather(weather) => self.weather = *weather,
            StandingCommand::SetSettings(settings) => self.settings = *settings,
            StandingCommand::TrafficParam(set) => {
                if let Some(other) = param::displaces(set.param) {
                    self.traffic_params.remove(&(set.actor_id, other));
                }
                if !param::is_once(set.param) {
                    self.traffic_params.insert((set.actor_id, set.param), *set);
                }
            }
            StandingCommand::HideLayers(to) => self.hidden.set_layers(to.layers, to.hidden != 0),
            StandingCommand::HideObjects(to) => {
                self.hidden.set_objects(to.block, &to.bits, to.hidden != 0);
            }
            StandingCommand::SetWeatherAffectsGrip(to) => self.weather_affects_grip = to.on != 0,
            StandingCommand::Draw(shape) => self.shapes.insert(shape, outcome),
            StandingCommand::EraseShapes(erase) => self.shapes.erase(erase),
            StandingCommand::SetBones(set) => self.poses.set_bones(set),
            StandingCommand::BlendPose(blend) => self.poses.blend(blend),
            StandingCommand::SetStreetLights(to) => {
                let state =
                    StreetLightState { mode: to.mode, color: to.color, intensity: to.intensity };
                self.street_lights.set(to.block, &to.bits, state);
            }
        }
    }

    /// Returns the value of a parameter of traffic for one actor, or with [`ActorId::NONE`] for all.
    pub fn traffic_param(&self, actor: ActorId, param: u32) -> Option<f32> {
        self.traffic_params.get(&(actor, param)).map(|set| set.value)
    }

    /// Removes what this frame was the last to show.
    pub fn end_frame(&mut self, stamp: Stamp) {
        self.shapes.end_frame(stamp);
    }

    /// Returns the commands that make the default state into this one, with their outcomes.
    pub fn commands(&self) -> Vec<(Command, Outcome)> {
        let settings =
            (self.settings != Settings::default()).then_some(Command::SetSettings(self.settings));
        let weather =
            (self.weather != Weather::default()).then_some(Command::SetWeather(self.weather));
        let grip = SetWeatherAffectsGrip { on: 1, reserved: 0 };
        let grip = self.weather_affects_grip.then_some(Command::SetWeatherAffectsGrip(grip));
        let params = self.traffic_params.values().copied().map(Command::TrafficParam);
        let plain = (settings.into_iter().chain(weather).chain(grip).chain(params))
            .chain(self.hidden.commands())
            .chain(self.poses.commands())
            .chain(self.street_lights.commands())
            .map(|command| (command, Outcome::done(0)));
        let shapes =
            self.shapes.outcomes().map(|(shape, outcome)| (Command::Draw(*shape), outcome));
        plain.chain(shapes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        BlendPose, EraseShapes, Frame, HideLayers, HideObjects, LoadMap, Refusal, SetBones,
        SetStreetLights, Shape, shape, street_light,
    };

    /// One of each command that changes the default state.
    fn every_switch() -> Vec<(Command, Outcome)> {
        let mut bits = [0; 16];
        bits[3] = 0b101;
        let shape = Shape::new(shape::POINT);
        let drawn = DebugShapes::default().admit(&shape, Stamp::default()).unwrap();
        let actor_id = ActorId(3);
        let commands = [
            Command::SetWeather(Weather { wetness: 50.0, ..Weather::default() }),
            Command::SetSettings(Settings { pipeline: 2, ..Settings::default() }),
            Command::TrafficParam(TrafficParam { actor_id, param: param::GAP_M, value: 2.0 }),
            Command::HideLayers(HideLayers { layers: 5, hidden: 1 }),
            Command::HideObjects(HideObjects { block: 2, hidden: 1, bits }),
            Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on: 1, reserved: 0 }),
            Command::SetBones(SetBones { actor_id, count: 6, ..SetBones::default() }),
            Command::BlendPose(BlendPose { actor_id, weight: 0.5 }),
            Command::SetStreetLights(SetStreetLights {
                block: 1,
                mode: street_light::OFF,
                color: 0,
                intensity: 1.0,
                bits,
            }),
        ];
        let mut all: Vec<_> = commands.map(|command| (command, Outcome::done(0))).into();
        all.push((Command::Draw(shape), drawn));
        all
    }

    fn fold(commands: &[(Command, Outcome)]) -> StandingState {
        let mut state = StandingState::default();
        commands.iter().for_each(|(command, outcome)| state.apply(command, outcome));
        state
    }

    #[test]
    fn the_commands_of_a_state_make_the_same_state() {
        assert_eq!(StandingState::default().commands(), []);
        for one in every_switch() {
            assert_ne!(fold(&[one]).commands(), [], "{:?} is not kept", one.0);
        }
        let state = fold(&every_switch());
        assert_eq!(state.commands().len(), every_switch().len());
        assert_eq!(fold(&state.commands()).commands(), state.commands());
    }

    #[test]
    fn a_refused_command_changes_nothing() {
        let refused = every_switch()
            .into_iter()
            .map(|(command, _)| (command, Outcome::refused(&Refusal::other(""))));
        assert_eq!(fold(&refused.collect::<Vec<_>>()).commands(), []);
    }

    #[test]
    fn another_map_keeps_how_time_passes_and_a_saved_state_brings_its_own() {
        let with = |last: Command| {
            let mut all = every_switch();
            all.push((last, Outcome::done(2)));
            fold(&all).commands().into_iter().map(|(command, _)| command).collect::<Vec<_>>()
        };
        let settings = Command::SetSettings(Settings { pipeline: 2, ..Settings::default() });
        let grip = Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on: 1, reserved: 0 });
        assert_eq!(with(Command::LoadMap(LoadMap::default())), [settings, grip]);
        assert_eq!(with(Command::LoadState(crate::FilePath::default())), [settings]);
    }

    #[test]
    fn what_is_about_an_actor_ends_with_it() {
        let mut state = fold(&every_switch());
        state.apply(&Command::Destroy(ActorId(3)), &Outcome::done(3));
        let is_about_actors = |(command, _): &(Command, Outcome)| {
            use Command::{BlendPose, SetBones, TrafficParam};
            matches!(command, TrafficParam(_) | SetBones(_) | BlendPose(_))
        };
        assert!(!state.commands().iter().any(is_about_actors));
        state.apply(&Command::EraseShapes(EraseShapes::ALL), &Outcome::done(0));
        state.end_frame(Stamp { frame: Frame(9), ..Stamp::default() });
        assert_eq!(state.shapes.shapes().count(), 0);
    }
}
