//! The simulation core: everything that decides the next frame, and nothing else.
//!
//! ```text
//! decision of traffic, commands ──Inputs──▶ Sim::step ──Outputs──▶ stamp, state hash
//!                                            │    ▲
//!                         commands of other groups, observers of physics
//!                                            ▼    │
//!                                           Services
//! ```
//!
//! [`Sim`] does no I/O and reads no clock: the same calls give the same bits. The running host,
//! the re-simulation of a recording, benchmarks of one stage and closed-loop tests all call
//! [`Sim::step`]. Commands that need more than the simulation go to the caller's [`Services`].
//! Every command is matched by its group without a wildcard ([`protocol::CommandGroup`]).

use std::{convert::Infallible, sync::Arc};

use mesh::WordHash;
use protocol::{
    ActorId, ActorState, BundleId, BundleReceipt, Command, CommandGroup, CreateBundle, HideLayers,
    JournalEntry, LoadMap, Name, Outcome, Query, Refusal, Response, SensorCommand, SensorSpec,
    ServiceCommand, Settings, Stamp, StandingCommand, StandingState, TrafficParts, Transmit,
    Weather, WorldCommand,
};
use town::Town;

use crate::{
    physics::{Ground, Physics},
    request::Request,
    saved::{SavedState, StateError, decision_hash},
    world::World,
};

#[cfg(test)]
mod tests;

/// What traffic decided: it acts in the next frame.
#[derive(Clone, Copy, Debug)]
pub struct Decision<'a> {
    /// Controls of vehicles and walkers, and phases of traffic lights.
    pub parts: TrafficParts<'a>,
    /// [`decision_hash`] over the decision and the planner's state.
    pub hash: u64,
}

/// The inputs that decide one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// The newest decision of traffic; `None` before its first.
    pub decision: Option<Decision<'a>>,
    /// The commands of the frame, in the order in which they apply.
    pub requests: &'a [Request],
}

/// The results of one frame. The actors are in [`Sim::states`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// The frame, the simulated time and the episode.
    pub stamp: Stamp,
    /// Simulated time of the frame.
    pub delta_nanos: u64,
    /// The hash over everything that decides the future.
    pub state_hash: u64,
    /// The number of collisions during the frame.
    pub collisions: u32,
}

/// The services that a caller of [`Sim`] provides: the journal, commands that need more than the
/// simulation, and observers. The defaults are those of a simulation that runs alone.
pub trait Services {
    /// An error that ends the run.
    type Error;

    /// Takes an entry of the frame's journal; entries come in the order of commands.
    fn journal(&mut self, _entry: JournalEntry) {}

    /// Creates a sensor bundle and returns its id.
    ///
    /// # Errors
    ///
    /// The cause as a text.
    fn create_bundle(
        &mut self,
        _client: Name,
        _bundle: &CreateBundle,
        _sensors: &[SensorSpec],
        _receipt: BundleReceipt,
    ) -> Result<BundleId, Refusal> {
        Err(Refusal::unsupported("the simulation runs without sensors"))
    }

    /// Removes a sensor bundle.
    fn destroy_bundle(&mut self, bundle: BundleId) -> Result<(), Refusal> {
        Err(Refusal::not_found(format!("there is no bundle {}", bundle.0)))
    }

    /// Removes the bundles on an actor that was destroyed.
    fn actor_destroyed(&mut self, _actor: ActorId) {}

    /// Sends a text from a sensor with the next frame and returns the bundle's id.
    fn transmit(&mut self, _command: &Transmit) -> Result<u32, Refusal> {
        Err(Refusal::unsupported("the simulation runs without sensors"))
    }

    /// Executes a command of the host process, and takes its journal entry.
    fn execute(
        &mut self,
        _sim: &mut Sim,
        request: Request,
        _command: &ServiceCommand,
    ) -> Result<(), Self::Error> {
        let refusal = Refusal::unsupported("the simulation runs without a host process");
        self.journal(request.ended(Outcome::refused(&refusal)));
        Ok(())
    }

    /// Called when the frame's commands are applied, before physics.
    fn commands_applied(&mut self) {}

    /// Called before the first substep of physics with 0, and after each with its length in
    /// seconds.
    fn observe(&mut self, _physics: &Physics, _dt_s: f32) {}

    /// Called after physics, before the state hash: a replay places recorded actors.
    fn physics_stepped(&mut self, _sim: &mut Sim) {}
}

/// The services of a simulation that runs alone: they keep the journal.
#[derive(Clone, Debug, Default)]
pub struct NoServices {
    /// The journal entries so far.
    pub journal: Vec<JournalEntry>,
}

impl Services for NoServices {
    type Error = Infallible;

    fn journal(&mut self, entry: JournalEntry) {
        self.journal.push(entry);
    }
}

/// When commands are applied.
#[derive(Clone, Copy)]
enum When {
    /// As part of a frame, which is the first that shows them.
    InFrame,
    /// Before the next frame, which is the first that shows them.
    BetweenFrames,
}

/// The simulated world of one episode, and its standing state.
pub struct Sim {
    stamp: Stamp,
    world: World,
    standing: StandingState,
    decision_hash: u64,
}

impl Sim {
    /// Creates a simulation at frame 0 of its first episode. The only actors are the traffic lights
    /// of the map.
    pub fn new(town: &Town, seed: u64) -> Sim {
        Sim::of(World::new(town, seed))
    }

    /// As [`Sim::new`], on a ground that exists already: the mesh of the town is not read.
    pub fn on(ground: Arc<Ground>, town: &Town, seed: u64) -> Sim {
        Sim::of(World::on(ground, town, seed))
    }

    /// Creates a simulation at frame 0 of its first episode.
    pub(crate) fn of(world: World) -> Sim {
        Sim {
            stamp: Stamp { episode: 1, ..Stamp::default() },
            world,
            standing: StandingState::default(),
            decision_hash: 0,
        }
    }

    /// Returns a simulation of the same map at frame 0 of its first episode, with another seed.
    pub fn restarted(&self, seed: u64) -> Sim {
        Sim::of(self.world.restarted(seed))
    }

    /// Advances by one frame: the decision of traffic acts, then commands, then physics.
    ///
    /// # Errors
    /// Those of `services`.
    pub fn step<S: Services>(
        &mut self,
        inputs: &Inputs<'_>,
        services: &mut S,
    ) -> Result<Outputs, S::Error> {
        self.stamp = self.coming();
        if let Some(decision) = &inputs.decision {
            self.decision_hash = decision.hash;
            self.world.follow_traffic(&decision.parts);
        }
        self.apply(inputs.requests, When::InFrame, services)?;
        services.commands_applied();
        let settings = self.standing.settings;
        self.world.update_dormant(&self.standing);
        self.world.step(&settings, |physics, dt_s| services.observe(physics, dt_s));
        services.physics_stepped(self);
        self.standing.end_frame(self.stamp);
        Ok(self.outputs())
    }

    /// Applies commands between two frames; the next frame is the first that shows them.
    ///
    /// # Errors
    ///
    /// Those of `services`.
    pub fn apply_between_frames<S: Services>(
        &mut self,
        requests: &[Request],
        services: &mut S,
    ) -> Result<(), S::Error> {
        self.apply(requests, When::BetweenFrames, services)
    }

    /// Returns the stamp of the next frame.
    pub fn coming(&self) -> Stamp {
        let Stamp { frame, sim_time_nanos, .. } = self.stamp;
        let sim_time_nanos = sim_time_nanos + self.standing.settings.delta_nanos;
        Stamp { frame: frame.next(), sim_time_nanos, ..self.stamp }
    }

    fn apply<S: Services>(
        &mut self,
        requests: &[Request],
        when: When,
        services: &mut S,
    ) -> Result<(), S::Error> {
        let mut index = 0;
        while index < requests.len() {
            let request = requests[index];
            index += 1;
            let Some(command) = request.command.decode() else {
                let refusal = Refusal::unsupported("unknown command kind");
                services.journal(request.ended(Outcome::refused(&refusal)));
                continue;
            };
            let first = match when {
                When::InFrame => self.stamp,
                When::BetweenFrames => self.coming(),
            };
            let result = match command.group() {
                CommandGroup::World(command) => {
                    let result = self.apply_world(&command);
                    if let (Ok(_), WorldCommand::Destroy(actor)) = (&result, command) {
                        services.actor_destroyed(actor);
                    }
                    result.map(Outcome::done)
                }
                CommandGroup::Standing(command) => self.apply_standing(&command, first),
                CommandGroup::Sensor(command) => match command {
                    SensorCommand::CreateBundle(bundle) => {
                        let specs = sensors_of(&bundle, request.client, &requests[index..]);
                        let delta_nanos = self.standing.settings.delta_nanos;
                        let receipt = BundleReceipt::new(first.sim_time_nanos, delta_nanos);
                        let result =
                            self.create_bundle(request.client, &bundle, &specs, receipt, services);
                        let outcome = ended(result.map(|id| Outcome::answer(id.0, &receipt)));
                        services.journal(request.ended(outcome));
                        for request in &requests[index..index + specs.len()] {
                            services.journal(request.ended(outcome));
                        }
                        index += specs.len();
                        continue;
                    }
                    SensorCommand::Sensor(spec) => Err(Refusal::out_of_range(format!(
                        "sensor {:?} has no bundle; send CreateBundle before its sensors",
                        spec.name
                    ))),
                    SensorCommand::DestroyBundle(bundle) => {
                        services.destroy_bundle(bundle).map(|()| Outcome::done(bundle.0))
                    }
                    SensorCommand::Transmit(command) => {
                        services.transmit(&command).map(Outcome::done)
                    }
                },
                CommandGroup::Service(command) => {
                    services.execute(self, request, &command)?;
                    continue;
                }
            };
            services.journal(request.ended(ended(result)));
        }
        Ok(())
    }

    fn create_bundle<S: Services>(
        &mut self,
        client: Name,
        bundle: &CreateBundle,
        sensors: &[SensorSpec],
        receipt: BundleReceipt,
        services: &mut S,
    ) -> Result<BundleId, Refusal> {
        if bundle.parent != ActorId::NONE && self.world.state(bundle.parent).is_none() {
            return Err(Refusal::unknown_actor(format!(
                "{} does not exist; a bundle needs an existing parent",
                bundle.parent
            )));
        }
        let id = services.create_bundle(client, bundle, sensors, receipt)?;
        self.world.mark_carrier(bundle.parent);
        Ok(id)
    }

    /// Applies a command about actors and returns the id concerned.
    ///
    /// # Errors
    ///
    /// The cause of the refusal; the world is unchanged.
    pub fn apply_world(&mut self, command: &WorldCommand) -> Result<u32, Refusal> {
        command.check()?;
        let id = self.world.apply(command)?;
        self.standing.apply(&(*command).into(), &Outcome::done(id));
        Ok(id)
    }

    /// Applies a command about the standing state; `first` is the first frame that shows it.
    ///
    /// # Errors
    ///
    /// The cause of the refusal; the state is unchanged.
    pub fn apply_standing(
        &mut self,
        command: &StandingCommand,
        first: Stamp,
    ) -> Result<Outcome, Refusal> {
        command.check()?;
        let outcome = match command {
            StandingCommand::TrafficParam(set) => Outcome::done(set.actor_id.0),
            StandingCommand::HideLayers(to) => {
                World::check_layers(to)?;
                Outcome::done(0)
            }
            StandingCommand::HideObjects(to) => {
                self.world.check_objects(to)?;
                Outcome::done(0)
            }
            StandingCommand::SetStreetLights(to) => {
                self.world.check_street_lights(to)?;
                Outcome::done(0)
            }
            StandingCommand::SetBones(to) => {
                self.world.check_bones(to)?;
                Outcome::done(to.actor_id.0)
            }
            StandingCommand::BlendPose(to) => {
                self.world.check_blend(to)?;
                Outcome::done(to.actor_id.0)
            }
            StandingCommand::Draw(shape) => self.standing.shapes.admit(shape, first)?,
            StandingCommand::SetWeather(_)
            | StandingCommand::SetSettings(_)
            | StandingCommand::SetWeatherAffectsGrip(_)
            | StandingCommand::EraseShapes(_) => Outcome::done(0),
        };
        self.standing.apply(&(*command).into(), &outcome);
        match command {
            StandingCommand::HideLayers(_) | StandingCommand::HideObjects(_) => {
                self.world.hide(&self.standing.hidden);
            }
            StandingCommand::SetWeather(_) | StandingCommand::SetWeatherAffectsGrip(_) => {
                self.update_grip();
            }
            StandingCommand::BlendPose(to) => self.world.set_posed(to.actor_id, to.weight > 0.0),
            StandingCommand::SetSettings(_)
            | StandingCommand::TrafficParam(_)
            | StandingCommand::SetStreetLights(_)
            | StandingCommand::SetBones(_)
            | StandingCommand::Draw(_)
            | StandingCommand::EraseShapes(_) => {}
        }
        Ok(outcome)
    }

    /// Returns the response to a query. It changes nothing.
    pub fn answer(&self, query: &Query) -> Response {
        let response = self.world.answer(&self.standing, query);
        response.unwrap_or_else(|why| Response::refused(&why))
    }

    fn update_grip(&mut self) {
        let StandingState { weather, weather_affects_grip, .. } = &self.standing;
        self.world.set_grip(if *weather_affects_grip { grip_under(weather) } else { 1.0 });
    }

    /// Returns the results of the newest frame.
    pub fn outputs(&self) -> Outputs {
        Outputs {
            stamp: self.stamp,
            delta_nanos: self.standing.settings.delta_nanos,
            state_hash: self.state_hash(),
            collisions: self.world.collisions() as u32,
        }
    }

    /// Returns the frame, the simulated time and the episode.
    pub fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// Returns the hash of the decision of traffic that acted in the newest frame; 0 if none did.
    pub fn decision_hash(&self) -> u64 {
        self.decision_hash
    }

    /// Returns the settings of time and synchronisation.
    pub fn settings(&self) -> &Settings {
        &self.standing.settings
    }

    /// Returns the standing state.
    pub fn standing(&self) -> &StandingState {
        &self.standing
    }

    /// Returns the actors and their bodies.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Returns the actors and their bodies, for a caller that moves actors itself: it is not part of
    /// the journal.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// Returns every actor, by id.
    pub fn states(&self) -> &[ActorState] {
        self.world.states()
    }

    /// Returns the hash of everything that decides the future: time, the world, and the decision of
    /// traffic. The numbers of frame and episode are not part of it.
    pub fn state_hash(&self) -> u64 {
        let Settings { delta_nanos, substep_max_nanos, .. } = self.standing.settings;
        let mut hash = WordHash::new();
        hash.word(self.stamp.sim_time_nanos);
        // The other settings control how a run is driven and observed; they change no result.
        hash.word(delta_nanos);
        hash.word(substep_max_nanos);
        hash.word(self.decision_hash);
        self.world.hash(&mut hash, &self.standing);
        hash.value()
    }

    /// Replaces the world by that of another episode, in a frame of its own.
    pub(crate) fn begin_episode(&mut self, world: World, episode: u32, hidden: &HideLayers) {
        let loaded = Command::LoadMap(LoadMap::default());
        self.standing.apply(&loaded, &Outcome::done(episode));
        self.standing.apply(&Command::HideLayers(*hidden), &Outcome::done(0));
        let frame = self.stamp.frame.next();
        self.stamp = Stamp { frame, sim_time_nanos: 0, episode, ..self.stamp };
        let threads = self.world.physics().threads();
        self.world = world;
        self.world.set_threads(threads);
        self.decision_hash = 0;
        self.world.hide(&self.standing.hidden);
        self.update_grip();
    }

    /// Writes into a state what decides the future, except the decision of traffic and pending
    /// commands.
    pub fn save_into(&self, state: &mut SavedState) {
        state.stamp = self.stamp;
        let is_lasting = |(command, outcome): &(Command, Outcome)| match command {
            Command::Draw(_) => outcome
                .answered::<protocol::ShapeReceipt>()
                .is_ok_and(|receipt| receipt.until_nanos != 0),
            _ => true,
        };
        let standing = self.standing.commands().into_iter().filter(is_lasting);
        state.standing =
            standing.map(|(command, outcome)| Request::of_host(command).ended(outcome)).collect();
        state.last_shape = self.standing.shapes.last_number();
        self.world.save_into(state);
    }

    /// Restores a state exactly.
    ///
    /// # Errors
    ///
    /// The state is inconsistent; the simulation is unchanged.
    pub fn restore(&mut self, state: &SavedState) -> Result<(), StateError> {
        self.world.restore(state)?;
        self.standing = StandingState::default();
        for entry in &state.standing {
            let Some(command) = entry.command.decode() else { continue };
            if let CommandGroup::Standing(standing) = command.group()
                && let Err(why) = standing.check()
            {
                log::warn!("the saved state holds a command that is not applied: {why}");
                continue;
            }
            self.standing.apply(&command, &entry.outcome);
        }
        self.standing.shapes.skip_numbers(state.last_shape);
        self.stamp = state.stamp;
        self.decision_hash =
            state.decision.as_ref().map_or(0, |(_, payload)| decision_hash(payload));
        Ok(())
    }

    /// Loads a state into a run whose numbers of frames, episodes and shapes continue. Of the
    /// settings, only the lengths of frame and substep change.
    ///
    /// # Errors
    ///
    /// The state is inconsistent; the simulation is unchanged.
    pub(crate) fn load(&mut self, state: &SavedState) -> Result<(), StateError> {
        let Stamp { frame, episode, .. } = self.stamp;
        let (settings, last_shape) = (self.standing.settings, self.standing.shapes.last_number());
        self.restore(state)?;
        self.stamp = Stamp { frame, episode, ..self.stamp };
        let Settings { delta_nanos, substep_max_nanos, .. } = self.standing.settings;
        let loaded = Settings { delta_nanos, substep_max_nanos, ..settings };
        self.standing.settings = if loaded.check().is_ok() { loaded } else { settings };
        self.standing.shapes.skip_numbers(last_shape);
        self.standing.shapes.renumber(frame.next());
        Ok(())
    }
}

fn ended(result: Result<Outcome, Refusal>) -> Outcome {
    result.unwrap_or_else(|why| Outcome::refused(&why))
}

/// Returns the sensors that follow a new bundle in the commands of its client, as many as it
/// announces.
fn sensors_of(bundle: &CreateBundle, client: Name, rest: &[Request]) -> Vec<SensorSpec> {
    rest.iter()
        .take(bundle.sensor_count as usize)
        .take_while(|request| request.client == client)
        .map_while(|request| match request.command.decode() {
            Some(Command::Sensor(spec)) => Some(spec),
            _ => None,
        })
        .collect()
}

/// Returns the factor on the friction of the dry ground under a weather.
///
/// Wet asphalt has about 70 % of the friction of dry asphalt, and standing water takes as much
/// again (Wong, Theory of Ground Vehicles, 4th ed., table 1.8).
fn grip_under(weather: &Weather) -> f32 {
    let share = |percent: f32| (percent / 100.0).clamp(0.0, 1.0);
    (1.0 - 0.3 * share(weather.wetness)) * (1.0 - 0.3 * share(weather.precipitation_deposits))
}
