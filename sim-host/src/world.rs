//! The actors of an episode with their bodies, and the phases of traffic lights.

use std::{collections::BTreeSet, sync::Arc};

use glam::{Vec2, Vec3};
use mesh::{ObjectId, WordHash};
use protocol::{
    ACTORS_MAX, ActorId, ActorState, BODY_LIFE_NANOS, Name, Pose, ROUTE_STEPS, Refusal,
    RouteCommand, STRIDE, SetDead, Settings, Spawn, StandingState, TrafficParts, VehicleControl,
    WalkerLimbs, WorldCommand, flag, kind, lamp, light, route_step,
};
use town::{Blueprint, Kind, Layer, Town};

use crate::{
    models::{Models, doors_of},
    physics::{Collision, Ground, Physics, PhysicsError, StaticBox, StaticBoxes},
    saved::{SavedState, StateError},
};
use actors::ActorTable;

mod actors;
mod bones;
mod hybrid;
mod hybrid_radius;
mod objects;
mod physics_commands;
mod queries;
mod replayed;
mod vehicle_physics;

/// The actors of an episode and their bodies, in world space.
pub struct World {
    physics: Physics,
    models: Models,
    actors: ActorTable,
    /// The id of the actor spawned last.
    last_actor: u32,
    seed: u64,
    /// Whether a vehicle may be dormant.
    has_dormant: bool,
    map: Arc<MapState>,
}

/// The constant part of a map.
struct MapState {
    ground: Arc<Ground>,
    statics: StaticBoxes,
    /// The object and the layer of each static box.
    solids: Vec<(u32, Layer)>,
    /// The semantic tag of each static box.
    tags: Vec<u8>,
    objects: u32,
    heads: Vec<town::Head>,
    /// The ids of street lights.
    lamps: BTreeSet<u32>,
}

impl World {
    /// Creates the world of frame 0, in which the only actors are the traffic lights of the map.
    pub fn new(town: &Town, seed: u64) -> World {
        World::on(Arc::new(Ground::new(&town.mesh)), town, seed)
    }

    /// As [`World::new`], on a ground that exists already: the mesh of the town is not read.
    pub(crate) fn on(ground: Arc<Ground>, town: &Town, seed: u64) -> World {
        let statics: Vec<StaticBox> = town
            .colliders
            .iter()
            .map(|c| StaticBox {
                center: c.center,
                half_extents_m: c.half_extents_m,
                yaw_rad: c.yaw_rad,
            })
            .collect();
        let map = MapState {
            ground,
            statics: StaticBoxes::new(&statics),
            solids: town.colliders.iter().map(|c| (c.object, layer(town, c.object))).collect(),
            tags: town.colliders.iter().map(|c| tag(town, c.object)).collect(),
            objects: town.objects.len() as u32,
            heads: town.heads.clone(),
            lamps: town.lamps.iter().map(|lamp| lamp.object + 1).collect(),
        };
        World::of_map(Arc::new(map), seed)
    }

    /// Returns the world of the same map and seed at frame 0.
    pub(crate) fn at_start(&self) -> World {
        self.restarted(self.seed)
    }

    /// Returns the world of the same map with another seed at frame 0.
    pub(crate) fn restarted(&self, seed: u64) -> World {
        World::of_map(Arc::clone(&self.map), seed)
    }

    fn of_map(map: Arc<MapState>, seed: u64) -> World {
        let physics = Physics::among(Arc::clone(&map.ground), map.statics.clone());
        let mut world = World {
            physics,
            models: Models::default(),
            actors: ActorTable::default(),
            last_actor: 0,
            seed,
            has_dormant: false,
            map,
        };
        world.place_lights();
        world
    }

    /// Creates an actor for every lamp box of the map's dynamic signals, in the map's order.
    fn place_lights(&mut self) {
        let Some((blueprint, _)) = town::blueprint("traffic.traffic_light") else { return };
        for head in &Arc::clone(&self.map).heads {
            let actor_id = self.next_id();
            let state = ActorState {
                actor_id,
                blueprint,
                kind: kind::TRAFFIC_LIGHT,
                flags: flag::KINEMATIC,
                pose: Pose::level(head.position, head.yaw_rad),
                phase: light::RED,
                signal: head.signal,
                ..ActorState::default()
            };
            self.actors.insert(state, Name::default());
        }
    }

    fn next_id(&mut self) -> ActorId {
        self.last_actor += 1;
        ActorId(self.last_actor)
    }

    /// Applies a command about actors and returns the id concerned.
    ///
    /// # Errors
    ///
    /// The cause of the refusal; the world is unchanged.
    pub(crate) fn apply(&mut self, command: &WorldCommand) -> Result<u32, Refusal> {
        match command {
            WorldCommand::Spawn(spawn) => self.spawn(spawn).map(|id| id.0),
            WorldCommand::Destroy(id) => self.destroy(*id).map(|()| id.0),
            WorldCommand::Teleport(to) => {
                self.movable(to.actor_id)?;
                self.physics.teleport(to.actor_id, &to.pose)?;
                self.movable(to.actor_id)?.pose = to.pose;
                Ok(to.actor_id.0)
            }
            WorldCommand::SetVelocity(to) => {
                let [linear, turn] =
                    [to.velocity_mps, to.angular_velocity_radps].map(Vec3::from_array);
                self.movable(to.actor_id)?;
                self.physics.set_velocity(to.actor_id, linear, turn)?;
                Ok(to.actor_id.0)
            }
            WorldCommand::Control(control) => {
                let actor = self.movable(control.actor_id)?;
                if actor.kind != kind::VEHICLE {
                    return Err(Refusal::wrong_kind(format!(
                        "{} is not a vehicle; it has no pedals",
                        control.actor_id
                    )));
                }
                self.steer(control)?;
                self.physics.mark_driven(control.actor_id, true);
                Ok(control.actor_id.0)
            }
            WorldCommand::Autopilot(to) => {
                self.check_alive(to.actor_id)?;
                let actor = self.movable(to.actor_id)?;
                let stops = actor.kind == kind::WALKER && to.on == 0 && actor.has(flag::AUTOPILOT);
                set(&mut actor.flags, flag::AUTOPILOT, to.on != 0);
                self.physics.mark_driven(to.actor_id, false);
                if stops {
                    // A fallen walker has no velocity to set.
                    let _ = self.physics.set_velocity(to.actor_id, Vec3::ZERO, Vec3::ZERO);
                }
                Ok(to.actor_id.0)
            }
            WorldCommand::SetPhysics(to) => {
                self.movable(to.actor_id)?;
                self.physics.set_kinematic(to.actor_id, to.on == 0)?;
                Ok(to.actor_id.0)
            }
            WorldCommand::SetVehicleLights(to) => {
                self.vehicle(to.actor_id, "lamps")?.lamps = to.lamps & lamp::ALL;
                Ok(to.actor_id.0)
            }
            WorldCommand::SetDoors(to) => {
                let state = self.vehicle(to.actor_id, "doors")?;
                let blueprint = &town::catalogue()[state.blueprint as usize];
                let doors = blueprint.rig().door_count() as u32;
                if to.open >> doors != 0 {
                    return Err(Refusal::not_found(format!(
                        "{} is a {} with {doors} doors that open; {:#b} names more",
                        to.actor_id, blueprint.id, to.open
                    )));
                }
                let boxes = doors_of(blueprint, to.open);
                let open = self.physics.set_doors(to.actor_id, &boxes, false)?;
                self.movable(to.actor_id)?.doors = open;
                Ok(to.actor_id.0)
            }
            WorldCommand::SetTrafficLight(to) => {
                let reason = format!("{} is not a traffic light", to.actor_id);
                let Some(light) = self.actors.get_mut(to.actor_id) else {
                    return Err(Refusal::unknown_actor(reason));
                };
                if light.kind != kind::TRAFFIC_LIGHT {
                    return Err(Refusal::wrong_kind(reason));
                }
                if to.phase > light::OFF {
                    return Err(Refusal::out_of_range(format!(
                        "unknown traffic light phase {}, not 0 to {}",
                        to.phase,
                        light::OFF
                    )));
                }
                set(&mut light.flags, flag::FROZEN, to.hold != 0);
                if to.hold != 0 {
                    light.phase = to.phase;
                }
                Ok(to.actor_id.0)
            }
            WorldCommand::SetBody(to) => {
                self.change_physics(to.actor_id, |physics| vehicle_physics::with_body(physics, to))
            }
            WorldCommand::SetEngine(to) => self.change_physics(to.actor_id, |physics| {
                physics.engine = *to;
                Ok(())
            }),
            WorldCommand::SetGearbox(to) => self.change_physics(to.actor_id, |physics| {
                physics.gearbox = *to;
                Ok(())
            }),
            WorldCommand::SetSteering(to) => self.change_physics(to.actor_id, |physics| {
                physics.steering = *to;
                Ok(())
            }),
            WorldCommand::SetWheel(to) => {
                self.change_physics(to.actor_id, |physics| vehicle_physics::with_wheel(physics, to))
            }
            WorldCommand::ApplyForce(force) => self.apply_force(force),
            WorldCommand::SetGravity(to) => {
                self.movable(to.actor_id)?;
                self.physics.set_gravity(to.actor_id, to.on != 0)?;
                Ok(to.actor_id.0)
            }
            WorldCommand::SetCollisions(to) => {
                self.movable(to.actor_id)?;
                self.physics.set_collisions(to.actor_id, to.on != 0)?;
                Ok(to.actor_id.0)
            }
            WorldCommand::Jump(id) => {
                self.movable(*id)?;
                self.physics.jump(*id)?;
                Ok(id.0)
            }
            WorldCommand::Ackermann(control) => {
                self.vehicle(control.actor_id, "engine")?;
                self.check_alive(control.actor_id)?;
                self.physics.ackermann(control)?;
                self.physics.mark_driven(control.actor_id, true);
                Ok(control.actor_id.0)
            }
            WorldCommand::SetAckermann(settings) => {
                self.vehicle(settings.actor_id, "engine")?;
                self.physics.set_ackermann(settings)?;
                Ok(settings.actor_id.0)
            }
            WorldCommand::SetDead(to) => self.set_dead(to),
            WorldCommand::RouteCommand(route) => {
                self.check_route(route)?;
                Ok(route.actor_id.0)
            }
        }
    }

    /// Sets the factor on the friction of the dry ground under wheels.
    pub(crate) fn set_grip(&mut self, share: f32) {
        self.physics.set_grip(share);
    }

    /// Returns the state of a vehicle for a change; `parts` names what other actors lack.
    fn vehicle(&mut self, id: ActorId, parts: &str) -> Result<&mut ActorState, Refusal> {
        self.check_vehicle(id, parts)?;
        self.movable(id)
    }

    /// Checks that an actor is a vehicle; `parts` names what other actors lack.
    fn check_vehicle(&self, id: ActorId, parts: &str) -> Result<(), Refusal> {
        if self.actor(id)?.kind != kind::VEHICLE {
            return Err(Refusal::wrong_kind(format!("{id} is not a vehicle; it has no {parts}")));
        }
        Ok(())
    }

    /// Checks that the engine of a vehicle was not stopped for good.
    fn check_alive(&self, id: ActorId) -> Result<(), Refusal> {
        if self.actor(id)?.has(flag::DEAD) {
            return Err(Refusal::wrong_kind(format!("{id} is dead; its engine has stopped")));
        }
        Ok(())
    }

    /// Returns the state of an actor other than a traffic light, for a change.
    fn movable(&mut self, id: ActorId) -> Result<&mut ActorState, Refusal> {
        self.actor(id)?;
        self.actors.get_mut(id).ok_or_else(|| Refusal::unknown_actor(format!("{id} was destroyed")))
    }

    /// Returns the state of an actor other than a traffic light.
    fn actor(&self, id: ActorId) -> Result<&ActorState, Refusal> {
        let actor = self.actors.get(id).ok_or_else(|| {
            let was = id.0 > 0 && id.0 <= self.last_actor;
            let fate = if was { "was destroyed" } else { "was never spawned" };
            Refusal::unknown_actor(format!("{id} {fate}"))
        })?;
        if actor.kind == kind::TRAFFIC_LIGHT {
            return Err(Refusal::wrong_kind(format!(
                "{id} is a traffic light of the map and cannot be moved"
            )));
        }
        Ok(actor)
    }

    fn spawn(&mut self, spawn: &Spawn) -> Result<ActorId, Refusal> {
        if self.actors.len() >= ACTORS_MAX {
            return Err(Refusal::full(format!(
                "the world is full: {} actors, ACTORS_MAX is {ACTORS_MAX}; destroy some",
                self.actors.len()
            )));
        }
        let name = spawn.blueprint;
        let (index, blueprint) = town::blueprint(name.as_str()).ok_or_else(|| {
            let count = town::catalogue().len();
            Refusal::unknown_blueprint(format!("blueprint {name:?} is not one of the {count} blueprints (list them with omnibus blueprints)"))
        })?;
        let id = ActorId(self.last_actor + 1);
        let kind = kind_of(blueprint)?;
        let pose = self
            .models
            .spawn(&mut self.physics, id, (index, blueprint), &spawn.pose, spawn.flags)
            .map_err(|e| {
                let place = format!("{} at {}", blueprint.id, spawn.pose.position());
                Refusal::from(e).about(place)
            })?;
        self.last_actor += 1;
        let state = ActorState {
            actor_id: id,
            blueprint: index,
            kind,
            flags: spawn.flags
                & (flag::AUTOPILOT
                    | flag::KINEMATIC
                    | flag::RAGDOLL_ON_HIT
                    | flag::REMOVED_AFTER_FALL
                    | flag::GETS_UP_AFTER_FALL
                    | flag::RELEASED_ON_HIT),
            pose,
            color: if spawn.color == 0 { default_color(blueprint) } else { spawn.color },
            ..ActorState::default()
        };
        self.actors.insert(state, spawn.role);
        Ok(id)
    }

    fn destroy(&mut self, id: ActorId) -> Result<(), Refusal> {
        self.movable(id)?;
        self.actors.remove(id);
        Ok(self.physics.destroy(id)?)
    }

    /// Applies pedals and steering. A dead vehicle has no engine: it brakes and steers in neutral.
    fn steer(&mut self, control: &VehicleControl) -> Result<(), Refusal> {
        let is_dead = self.state(control.actor_id).is_some_and(|state| state.has(flag::DEAD));
        if is_dead {
            let flags = control.flags & !flag::REVERSE;
            let dead = VehicleControl { throttle: 0.0, gear: 0, manual_gear: 1, flags, ..*control };
            return Ok(self.physics.control(&dead)?);
        }
        Ok(self.physics.control(control)?)
    }

    /// Lets a walker fall, or stops the engine of a vehicle.
    fn set_dead(&mut self, command: &SetDead) -> Result<u32, Refusal> {
        let id = command.actor_id;
        let actor = self.movable(id)?;
        match actor.kind {
            kind::WALKER => {
                if command.removes_body != 0 {
                    actor.flags |= flag::REMOVED_AFTER_FALL;
                }
                actor.flags &= !flag::GETS_UP_AFTER_FALL;
                self.physics.fall_for_good(id)?;
            }
            kind::VEHICLE => {
                actor.flags = actor.flags & !flag::AUTOPILOT | flag::DEAD;
                self.steer(&VehicleControl { actor_id: id, ..VehicleControl::default() })?;
            }
            _ => {
                return Err(Refusal::wrong_kind(format!(
                    "{id} is neither a walker nor a vehicle; it cannot die"
                )));
            }
        }
        Ok(id.0)
    }

    /// Returns the walkers whose bodies are to be removed before the next frame, by id.
    pub(crate) fn bodies_to_remove(&self) -> impl Iterator<Item = ActorId> + '_ {
        let is_over = |id: &ActorId| {
            let fallen_nanos = self.physics.fallen_nanos(*id);
            fallen_nanos.is_some_and(|nanos| nanos >= BODY_LIFE_NANOS)
        };
        let fallen =
            self.limbs().iter().map(|limbs| limbs.actor_id).filter(|id| {
                self.state(*id).is_some_and(|state| state.has(flag::REMOVED_AFTER_FALL))
            });
        fallen.filter(is_over)
    }

    /// Checks a route of a vehicle or a walker. Traffic reads the command in the journal and follows
    /// it.
    fn check_route(&mut self, route: &RouteCommand) -> Result<(), Refusal> {
        if self.movable(route.actor_id)?.kind == kind::WALKER {
            let steps = route.steps.iter().take(route.count as usize);
            if let Some(turn) = steps.map(|step| step.kind).find(|kind| *kind != route_step::PLACE)
            {
                return Err(Refusal::wrong_kind(format!(
                    "{} is a walker, whose route has places only; step {turn} is a turn",
                    route.actor_id
                )));
            }
        } else {
            self.vehicle(route.actor_id, "route")?;
        }
        if route.count as usize > ROUTE_STEPS {
            return Err(Refusal::out_of_range(format!(
                "route of {} steps, ROUTE_STEPS is {ROUTE_STEPS}; send the rest in another command",
                route.count
            )));
        }
        Ok(())
    }

    /// Applies a decision of traffic. Controls of vehicles and walkers that are not on autopilot are
    /// ignored: it may have been switched off since.
    pub fn follow_traffic(&mut self, decided: &TrafficParts<'_>) {
        for control in decided.walkers {
            let leads =
                |state: &ActorState| state.kind == kind::WALKER && state.has(flag::AUTOPILOT);
            if self.state(control.actor_id).is_some_and(leads) {
                let velocity = Vec2::from(control.direction) * control.speed_mps;
                // A walker that has fallen does not walk.
                let _ =
                    self.physics.set_velocity(control.actor_id, velocity.extend(0.0), Vec3::ZERO);
            }
        }
        for control in decided.controls {
            let Some(state) = self.actors.get_mut(control.actor_id) else { continue };
            let drives = state.kind == kind::VEHICLE && state.has(flag::AUTOPILOT);
            if drives && control.check().is_ok() {
                if control.lamps & lamp::SWITCHED != 0 {
                    state.lamps = control.lamps & lamp::ALL;
                }
                // The actor is an existing vehicle, so this cannot be refused.
                let _ = self.steer(control);
            }
        }
        for state in decided.lights {
            let changes = |a: &ActorState| {
                a.kind == kind::TRAFFIC_LIGHT && !a.has(flag::FROZEN) && a.phase != state.phase
            };
            if self.actors.get(state.actor_id).is_some_and(changes)
                && let Some(actor) = self.actors.get_mut(state.actor_id)
            {
                actor.phase = state.phase;
            }
        }
    }

    /// Advances physics by one frame; `observe` as in [`Physics::step_observed`].
    pub(crate) fn step(&mut self, settings: &Settings, observe: impl FnMut(&Physics, f32)) {
        self.physics.step_observed(settings.delta_nanos, settings.substep_max_nanos, observe);
        let World { physics, actors, .. } = self;
        actors.update_active(physics.active(), |state| {
            physics.write_state(state);
            if state.has(flag::FALLEN) {
                return physics.limbs(state.actor_id);
            }
            if state.kind == kind::WALKER {
                advance_stride(state, settings.delta_nanos);
            }
            None
        });
    }

    /// Sets the number of threads on which vehicles move: [`Physics::set_threads`].
    pub fn set_threads(&mut self, threads: usize) {
        self.physics.set_threads(threads);
    }

    /// Lets kinematic vehicles far from others move once a frame: [`Physics::set_far`].
    pub fn set_far(&mut self, far_m: f32) {
        self.physics.set_far(far_m);
    }

    /// Sets the velocity of a kinematic actor as [`Physics::set_velocity`] does.
    ///
    /// # Errors
    ///
    /// Those of [`Physics::set_velocity`].
    pub fn drive_kinematic(
        &mut self,
        id: ActorId,
        velocity_mps: Vec3,
        spin_radps: Vec3,
    ) -> Result<(), PhysicsError> {
        self.physics.set_velocity(id, velocity_mps, spin_radps)
    }

    /// Returns the rigid-body world.
    pub fn physics(&self) -> &Physics {
        &self.physics
    }

    /// Returns the object id of a static box, as instance images show it, and its semantic tag.
    pub(crate) fn object_of(&self, static_box: u32) -> (u32, u8) {
        let index = static_box as usize;
        let object = self
            .map
            .solids
            .get(index)
            .map_or(0, |(object, _)| ObjectId::from_index(*object).instance());
        (object, self.map.tags.get(index).copied().unwrap_or_default())
    }

    /// Returns the number of collisions during the newest frame.
    pub fn collisions(&self) -> usize {
        self.physics.collisions().len()
    }

    /// Returns every actor, by id.
    pub fn states(&self) -> &[ActorState] {
        self.actors.states()
    }

    /// Returns the limbs of every fallen walker, by id.
    pub fn limbs(&self) -> &[WalkerLimbs] {
        self.actors.limbs()
    }

    /// Returns the state of an actor.
    pub fn state(&self, id: ActorId) -> Option<&ActorState> {
        self.actors.get(id)
    }

    /// Writes the actors and their bodies into a state.
    pub(crate) fn save_into(&self, state: &mut SavedState) {
        state.last_actor = self.last_actor;
        state.actors = self.states().to_vec();
        state.roles = self.actors.roles().to_vec();
        state.limbs = self.limbs().to_vec();
        state.physics = self.physics.save();
    }

    /// Restores a state; on an error the world is unchanged.
    pub(crate) fn restore(&mut self, state: &SavedState) -> Result<(), StateError> {
        let damaged = |e: PhysicsError| StateError::Damaged(e.to_string());
        let wrong = (state.actors.iter().find(|actor| !actor.is_valid()).map(|a| a.actor_id))
            .or(state.limbs.iter().find(|limbs| !limbs.is_valid()).map(|limbs| limbs.actor_id));
        if let Some(id) = wrong {
            return Err(StateError::Damaged(format!(
                "the state of {id} holds a number that is not finite, or beyond 1e10"
            )));
        }
        self.physics.restore(&state.physics).map_err(damaged)?;
        self.actors = ActorTable::default();
        for (actor, role) in state.actors.iter().zip(&state.roles) {
            self.actors.insert(*actor, *role);
        }
        for limbs in &state.limbs {
            self.actors.set_limbs(limbs.actor_id, Some(*limbs));
        }
        self.last_actor = state.last_actor;
        self.has_dormant = true;
        Ok(())
    }

    /// Returns the role names of actors that have one.
    pub(crate) fn roles(&self) -> Vec<(ActorId, String)> {
        let named = self.states().iter().zip(self.actors.roles());
        let named = named.filter(|(_, role)| **role != Name::default());
        named.map(|(actor, role)| (actor.actor_id, role.to_string())).collect()
    }

    /// Returns the collisions of the newest frame.
    pub(crate) fn frame_collisions(&self) -> impl Iterator<Item = &Collision> {
        self.physics.collisions().iter()
    }

    /// Appends everything that decides the future: bodies, drivetrains, flags, roles, the next id,
    /// and the standing state that affects physics.
    pub(crate) fn hash(&self, hash: &mut WordHash, standing: &StandingState) {
        hash.word(self.seed);
        hash.word(self.last_actor.into());
        hash.word(standing.weather_affects_grip.into());
        hash.word(standing.hidden.hidden_layers().into());
        for (block, bits) in standing.hidden.hidden_objects() {
            hash.word(block.into());
            bits.iter().for_each(|word| hash.word(*word));
        }
        if let Some(radius_m) = hybrid_radius::radius_m(standing) {
            hash.word(radius_m.to_bits().into());
        }
        self.actors.hash(hash);
        hash.word(self.physics.hash());
    }
}

fn tag(town: &Town, object: u32) -> u8 {
    town.objects[object as usize].tag as u8
}

fn layer(town: &Town, object: u32) -> Layer {
    town.objects[object as usize].layer
}

/// Advances the stride of a walker by the distance over ground.
fn advance_stride(state: &mut ActorState, delta_nanos: u64) {
    let speed = state.velocity().truncate().length();
    let blueprint = &town::catalogue()[state.blueprint as usize];
    let stride_m = town::stride_m(2.0 * blueprint.half_extents_m.z, speed);
    let share = speed * (delta_nanos as f32 * 1e-9) / stride_m;
    let steps = (share.min(1.0) * STRIDE as f32) as u32;
    state.phase = (state.phase + steps) % STRIDE;
}

fn set(flags: &mut u32, bit: u32, on: bool) {
    if on { *flags |= bit } else { *flags &= !bit }
}

fn kind_of(blueprint: &Blueprint) -> Result<u32, Refusal> {
    match blueprint.kind {
        Kind::Vehicle => Ok(kind::VEHICLE),
        Kind::Walker => Ok(kind::WALKER),
        Kind::Prop => Ok(kind::PROP),
        _ => Err(Refusal::wrong_kind(format!(
            "{} is part of the map and cannot be spawned",
            blueprint.id
        ))),
    }
}

fn default_color(blueprint: &Blueprint) -> u32 {
    let [r, g, b] = blueprint.default_color;
    u32::from_le_bytes([r, g, b, 255])
}
