//! The world as it is: actors, their bodies, the colours of its lights.

use std::{collections::BTreeSet, sync::Arc};

use glam::Vec3;
use mesh::ObjectId;
use protocol::{
    ACTORS_MAX, ActorId, ActorState, Command, GivenPoses, HideObjects, LightState, Name, Pose,
    ROUTE_STEPS, RouteCommand, STRIDE, SetWeatherAffectsGrip, Settings, Spawn, Stamp,
    VehicleControl, WalkerLimbs, flag, kind, lamp, light, route_step,
};
use town::{Blueprint, Kind, Layer, Lighting, Town, Visibility};

use crate::{
    hash::StateHash,
    models::{Models, doors_of},
    physics::{Collision, Ground, Physics, PhysicsError, StaticBox},
    saved::{SavedState, StateError},
    standing::{lit, shine},
};
use cast::Cast;

mod bones;
mod cast;
mod outside;
#[cfg(test)]
mod tests;

/// A recorded light is the map's own if it stood where that one stands.
const LIGHT_WITHIN_M: f32 = 0.5;

/// All that an episode's actors are.
pub struct World {
    physics: Physics,
    models: Models,
    actors: Cast,
    last_actor: u32,
    seed: u64,
    place: Arc<Place>,
    visibility: Visibility,
    /// The poses that clients gave walkers.
    poses: GivenPoses,
    /// What street lamps were told.
    lighting: Lighting,
    /// The sky decides how much wheels grip.
    weather_affects_grip: bool,
    /// What they would grip then.
    weather_grip: f32,
}

/// What of a town stays as it is, whatever happens in it.
struct Place {
    ground: Arc<Ground>,
    statics: Vec<StaticBox>,
    /// The object and the layer of each static box.
    solids: Vec<(u32, Layer)>,
    /// The tag of each static box.
    tags: Vec<u8>,
    objects: u32,
    heads: Vec<town::Head>,
    /// The numbers of street lamps.
    lamps: BTreeSet<u32>,
}

impl World {
    /// The world of frame 0: the map's traffic lights and nobody else.
    pub fn new(town: &Town, seed: u64) -> World {
        let statics = town
            .colliders
            .iter()
            .map(|c| StaticBox {
                center: c.center,
                half_extents_m: c.half_extents_m,
                yaw_rad: c.yaw_rad,
            })
            .collect();
        let place = Place {
            ground: Arc::new(Ground::new(&town.mesh)),
            statics,
            solids: town.colliders.iter().map(|c| (c.object, layer(town, c.object))).collect(),
            tags: town.colliders.iter().map(|c| tag(town, c.object)).collect(),
            objects: town.objects.len() as u32,
            heads: town.heads.clone(),
            lamps: town.lamps.iter().map(|lamp| lamp.object + 1).collect(),
        };
        World::on(Arc::new(place), seed)
    }

    /// The world of frame 0 once more.
    pub(crate) fn anew(&self) -> World {
        World::on(Arc::clone(&self.place), self.seed)
    }

    /// Takes over from the world before it what is no part of a world but says how it works.
    pub(crate) fn succeed(&mut self, before: &World) {
        let on = before.weather_affects_grip;
        let _ = self.apply(&Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip {
            on: on.into(),
            reserved: 0,
        }));
    }

    fn on(place: Arc<Place>, seed: u64) -> World {
        let physics = Physics::new(Arc::clone(&place.ground), &place.statics);
        let mut world = World {
            physics,
            models: Models::default(),
            actors: Cast::default(),
            last_actor: 0,
            seed,
            place,
            visibility: Visibility::default(),
            poses: GivenPoses::default(),
            lighting: Lighting::default(),
            weather_affects_grip: false,
            weather_grip: 1.0,
        };
        world.place_lights();
        world
    }

    /// Every lamp box of the map's dynamic signals is an actor, in the map's order.
    fn place_lights(&mut self) {
        let Some((blueprint, _)) = town::blueprint("traffic.traffic_light") else { return };
        for head in &Arc::clone(&self.place).heads {
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

    /// Carries out a command about actors. Says the id concerned, or why not.
    pub fn apply(&mut self, command: &Command) -> Result<u32, String> {
        match command {
            Command::Spawn(spawn) => self.spawn(spawn).map(|id| id.0),
            Command::Destroy(id) => self.destroy(*id).map(|()| id.0),
            Command::Teleport(to) => {
                check_pose(&to.pose)?;
                self.movable(to.actor_id)?;
                self.physics.teleport(to.actor_id, &to.pose).map_err(|e| e.to_string())?;
                self.movable(to.actor_id)?.pose = to.pose;
                Ok(to.actor_id.0)
            }
            Command::SetVelocity(to) => {
                let [linear, turn] =
                    [to.velocity_mps, to.angular_velocity_radps].map(Vec3::from_array);
                self.movable(to.actor_id)?;
                self.physics.set_velocity(to.actor_id, linear, turn).map_err(|e| e.to_string())?;
                Ok(to.actor_id.0)
            }
            Command::Control(control) => {
                check_control(control)?;
                let actor = self.movable(control.actor_id)?;
                if actor.kind != kind::VEHICLE {
                    return Err(format!("{} is no vehicle; it has no pedals", control.actor_id));
                }
                self.steer(control)?;
                Ok(control.actor_id.0)
            }
            Command::Autopilot(to) => {
                let actor = self.movable(to.actor_id)?;
                set(&mut actor.flags, flag::AUTOPILOT, to.on != 0);
                Ok(to.actor_id.0)
            }
            Command::SetPhysics(to) => {
                self.movable(to.actor_id)?;
                self.physics.set_kinematic(to.actor_id, to.on == 0).map_err(|e| e.to_string())?;
                Ok(to.actor_id.0)
            }
            Command::SetVehicleLights(to) => {
                self.vehicle(to.actor_id, "lamps")?.lamps = to.lamps & lamp::ALL;
                Ok(to.actor_id.0)
            }
            Command::SetDoors(to) => {
                let state = self.vehicle(to.actor_id, "doors")?;
                let blueprint = &town::catalogue()[state.blueprint as usize];
                let doors = blueprint.rig().door_count() as u32;
                if to.open >> doors != 0 {
                    return Err(format!(
                        "{} is a {} with {doors} doors that open; {:#b} names another",
                        to.actor_id, blueprint.id, to.open
                    ));
                }
                let boxes = doors_of(blueprint, to.open);
                let open = self.physics.set_doors(to.actor_id, &boxes, false);
                let open = open.map_err(|e| e.to_string())?;
                self.movable(to.actor_id)?.doors = open;
                Ok(to.actor_id.0)
            }
            Command::SetBones(to) => self.set_bones(to),
            Command::BlendPose(to) => self.blend_pose(to),
            Command::SetTrafficLight(to) => {
                let actor = self.actors.get_mut(to.actor_id);
                let light = actor
                    .filter(|a| a.kind == kind::TRAFFIC_LIGHT)
                    .ok_or_else(|| format!("{} is no traffic light", to.actor_id))?;
                if to.phase > light::OFF {
                    return Err(format!("a light has no phase {}; 0 to {}", to.phase, light::OFF));
                }
                set(&mut light.flags, flag::FROZEN, to.hold != 0);
                if to.hold != 0 {
                    light.phase = to.phase;
                }
                Ok(to.actor_id.0)
            }
            Command::HideLayers(to) => {
                let all = Layer::ALL.len() as u32;
                if to.layers >> all != 0 {
                    return Err(format!(
                        "layers are {:#x}; there are {all}, one bit each",
                        to.layers
                    ));
                }
                self.visibility.set_layers(to.layers, to.hidden != 0);
                self.see_to_solids();
                Ok(0)
            }
            Command::SetStreetLights(to) => {
                to.check()?;
                if let Some(other) = to.numbers().find(|number| !self.place.lamps.contains(number))
                {
                    let lamps = self.place.lamps.len();
                    return Err(format!(
                        "thing {other} is none of the town's {lamps} street lamps"
                    ));
                }
                self.lighting.set(to.block, &to.bits, shine(to));
                Ok(0)
            }
            Command::HideObjects(to) => {
                let last = to.bits.iter().rposition(|bits| *bits != 0).map(|word| {
                    let bit = 63 - to.bits[word].leading_zeros();
                    u64::from(to.block) * u64::from(ObjectId::PER_BLOCK)
                        + word as u64 * 64
                        + u64::from(bit)
                });
                if to.block == 0 && to.bits[0] & 1 != 0 {
                    return Err("thing 0 is the ground; it stays".to_owned());
                }
                if last.is_some_and(|last| last > u64::from(self.place.objects)) {
                    return Err(format!(
                        "thing {} is not among the {} of the town",
                        last.unwrap_or_default(),
                        self.place.objects
                    ));
                }
                self.visibility.set_objects(to.block, &to.bits, to.hidden != 0);
                self.see_to_solids();
                Ok(0)
            }
            other => self
                .apply_outside(other)
                .unwrap_or_else(|| Err("this is no command about an actor".to_owned())),
        }
    }

    /// What of the town is switched off.
    pub(crate) fn visibility(&self) -> &Visibility {
        &self.visibility
    }

    /// What street lamps were told.
    pub(crate) fn lighting(&self) -> &Lighting {
        &self.lighting
    }

    /// Nobody runs into what is switched off.
    fn see_to_solids(&mut self) {
        for (index, (object, layer)) in self.place.solids.iter().enumerate() {
            self.physics.set_static(index, !self.visibility.hides(*object, *layer));
        }
    }

    /// Whether [`World::apply`] is for this command; the others concern who looks, and time.
    pub fn is_about_actors(command: &Command) -> bool {
        !matches!(
            command,
            Command::Ask(_)
                | Command::CreateBundle(_)
                | Command::Sensor(_)
                | Command::DestroyBundle(_)
                | Command::SetSettings(_)
                | Command::TrafficParam(_)
                | Command::RouteCommand(_)
                | Command::Transmit(_)
                | Command::Draw(_)
                | Command::EraseShapes(_)
                | Command::StartRecorder(_)
                | Command::StopRecorder(_)
                | Command::SaveState(_)
                | Command::LoadState(_)
                | Command::StartReplay(_)
                | Command::StopReplay(_)
                | Command::LoadMap(_)
        )
    }

    /// The state of somebody who has such parts.
    fn vehicle(&mut self, id: ActorId, parts: &str) -> Result<&mut ActorState, String> {
        let state = self.movable(id)?;
        if state.kind != kind::VEHICLE {
            return Err(format!("{id} is no vehicle; it has no {parts}"));
        }
        Ok(state)
    }

    fn movable(&mut self, id: ActorId) -> Result<&mut ActorState, String> {
        let last = self.last_actor;
        let actor = self.actors.get_mut(id).ok_or_else(|| {
            let was = id.0 > 0 && id.0 <= last;
            format!("{id} {}", if was { "was destroyed" } else { "was never spawned" })
        })?;
        if actor.kind == kind::TRAFFIC_LIGHT {
            return Err(format!("{id} is a traffic light of the map; it stays where it is"));
        }
        Ok(actor)
    }

    fn spawn(&mut self, spawn: &Spawn) -> Result<ActorId, String> {
        if self.actors.len() >= ACTORS_MAX {
            return Err(format!(
                "the world is full: {} actors, ACTORS_MAX is {ACTORS_MAX}; destroy some",
                self.actors.len()
            ));
        }
        check_pose(&spawn.pose)?;
        let name = spawn.blueprint;
        let (index, blueprint) = town::blueprint(name.as_str()).ok_or_else(|| {
            let count = town::catalogue().len();
            format!("blueprint {name:?} is not among the {count} there are (omnibus blueprints)")
        })?;
        let id = ActorId(self.last_actor + 1);
        let is_kinematic = spawn.flags & flag::KINEMATIC != 0;
        let is_ragdoll_on_hit = spawn.flags & flag::RAGDOLL_ON_HIT != 0;
        let kind = kind_of(blueprint)?;
        let pose = self
            .models
            .spawn(
                &mut self.physics,
                id,
                (index, blueprint),
                &spawn.pose,
                (is_kinematic, is_ragdoll_on_hit),
            )
            .map_err(|e| format!("{} at {}: {e}", blueprint.id, spawn.pose.position()))?;
        self.last_actor += 1;
        let state = ActorState {
            actor_id: id,
            blueprint: index,
            kind,
            flags: spawn.flags & (flag::AUTOPILOT | flag::KINEMATIC | flag::RAGDOLL_ON_HIT),
            pose,
            color: if spawn.color == 0 { default_color(blueprint) } else { spawn.color },
            ..ActorState::default()
        };
        self.actors.insert(state, spawn.role);
        Ok(id)
    }

    fn destroy(&mut self, id: ActorId) -> Result<(), String> {
        self.movable(id)?;
        self.actors.remove(id);
        self.poses.follow(&Command::Destroy(id));
        self.physics.destroy(id).map_err(|e| e.to_string())
    }

    fn steer(&mut self, control: &VehicleControl) -> Result<(), String> {
        self.physics.control(control).map_err(|e| e.to_string())
    }

    /// Whether a vehicle can be told this; traffic, which reads it in the journal, does it.
    pub(crate) fn can_be_guided(&mut self, told: &RouteCommand) -> Result<(), String> {
        self.vehicle(told.actor_id, "way")?;
        let count = told.count as usize;
        let steps = told.steps.get(..count).ok_or_else(|| {
            format!(
                "a guide of {count} steps; ROUTE_STEPS is {ROUTE_STEPS}, send the rest after it"
            )
        })?;
        for (nth, step) in steps.iter().enumerate() {
            let words = |why| format!("step {nth}: {why}");
            check_pose(&Pose { position_m: step.position_m, ..Pose::IDENTITY }).map_err(words)?;
            if !(route_step::PLACE..=route_step::LANE_RIGHT).contains(&step.kind) {
                return Err(format!("step {nth} is of kind {}; there are 1 to 6", step.kind));
            }
        }
        Ok(())
    }

    /// What traffic decided. Controls of vehicles that it does not drive are ignored: they may
    /// have been taken back in the meantime.
    pub fn follow_traffic(&mut self, controls: &[VehicleControl], lights: &[LightState]) {
        for control in controls {
            let Some(state) = self.actors.get_mut(control.actor_id) else { continue };
            let drives = state.kind == kind::VEHICLE && state.has(flag::AUTOPILOT);
            if drives && check_control(control).is_ok() {
                if control.lamps & lamp::SWITCHED != 0 {
                    state.lamps = control.lamps & lamp::ALL;
                }
                // It is a vehicle and there: this cannot be refused.
                let _ = self.steer(control);
            }
        }
        for state in lights {
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

    /// Physics.
    pub fn step(&mut self, settings: &Settings) {
        self.step_seen(settings, |_, _| {});
    }

    /// Physics, for one who looks: see [`Physics::step_seen`].
    pub(crate) fn step_seen(&mut self, settings: &Settings, see: impl FnMut(&Physics, f32)) {
        self.physics.step_seen(settings.delta_nanos, settings.substep_max_nanos, see);
        let World { physics, actors, .. } = self;
        actors.renew(physics.stirred(), |state| {
            physics.fill(state);
            if state.has(flag::FALLEN) {
                return physics.limbs_of(state.actor_id);
            }
            if state.kind == kind::WALKER {
                walk_on(state, settings.delta_nanos);
            }
            None
        });
    }

    /// The bodies, for who looks.
    pub(crate) fn physics(&self) -> &Physics {
        &self.physics
    }

    /// The thing of the town that a static box belongs to, as instance images have it, and its
    /// tag.
    pub(crate) fn thing(&self, static_box: u32) -> (u32, u8) {
        let index = static_box as usize;
        let object = self
            .place
            .solids
            .get(index)
            .map_or(0, |(object, _)| ObjectId::from_index(*object).instance());
        (object, self.place.tags.get(index).copied().unwrap_or_default())
    }

    /// How many collisions this frame had.
    pub fn collisions(&self) -> usize {
        self.physics.collisions().len()
    }

    /// Every actor, by id.
    pub fn states(&self) -> &[ActorState] {
        self.actors.states()
    }

    /// The limbs of every fallen walker, by id.
    pub fn limbs(&self) -> &[WalkerLimbs] {
        self.actors.limbs()
    }

    /// One actor.
    pub fn state(&self, id: ActorId) -> Option<&ActorState> {
        self.actors.get(id)
    }

    /// Over everything that decides the future: time, the world, and what traffic decided. The
    /// numbers of the frame and the episode are not part of it: they only count.
    pub fn state_hash(&self, stamp: &Stamp, settings: &Settings, decided_hash: u64) -> u64 {
        let mut hash = StateHash::new();
        hash.word(stamp.sim_time_nanos);
        // Who waits for whom, and whether anybody looks, changes nothing.
        hash.word(settings.delta_nanos);
        hash.word(settings.substep_max_nanos);
        hash.word(decided_hash);
        self.hash(&mut hash);
        hash.value()
    }

    /// Puts a recorded actor into the world, moved by [`World::show`] alone. It keeps its id if
    /// nobody has it, else it gets one after `beyond`.
    pub(crate) fn spawn_shown(
        &mut self,
        recorded: &ActorState,
        beyond: ActorId,
    ) -> Result<ActorId, String> {
        let wanted = recorded.actor_id;
        let is_free = wanted != ActorId::NONE && self.actors.get(wanted).is_none();
        let id = if is_free { wanted } else { ActorId(self.last_actor.max(beyond.0) + 1) };
        let blueprint = town::catalogue().get(recorded.blueprint as usize).ok_or_else(|| {
            format!("{wanted} has blueprint {}, unknown here", recorded.blueprint)
        })?;
        check_pose(&recorded.pose)?;
        // High above everybody: who stands in its place does not keep it from coming.
        let above = Vec3::Z * (5000.0 + 20.0 * (id.0 % 2000) as f32);
        let pose = Pose::new(recorded.pose.position() + above, recorded.pose.rotation());
        self.models
            .spawn(&mut self.physics, id, (recorded.blueprint, blueprint), &pose, (true, false))
            .map_err(|e| e.to_string())?;
        self.last_actor = self.last_actor.max(id.0);
        // It opens them when it is shown.
        let state = ActorState { actor_id: id, doors: 0, ..*recorded };
        self.actors.insert(state, Name::default());
        Ok(id)
    }

    /// Shows an actor as it was recorded: its body stands there too.
    pub(crate) fn show(&mut self, id: ActorId, recorded: &ActorState, limbs: Option<&WalkerLimbs>) {
        let limbs = limbs.map(|limbs| WalkerLimbs { actor_id: id, ..*limbs });
        let Some(actor) = self.actors.get_mut(id) else { return };
        if recorded.kind == kind::TRAFFIC_LIGHT {
            // The map's own, where it stood: another has nothing to do with it.
            let (here, there) = (actor.pose.position(), recorded.pose.position());
            if actor.kind == kind::TRAFFIC_LIGHT && here.distance(there) < LIGHT_WITHIN_M {
                (actor.phase, actor.flags) = (recorded.phase, recorded.flags);
            }
            return;
        }
        let moves_doors = actor.doors != recorded.doors;
        *actor = ActorState { actor_id: id, ..*recorded };
        if moves_doors && let Some(blueprint) = town::catalogue().get(recorded.blueprint as usize) {
            // Of a vehicle: another has none.
            let _ = self.physics.set_doors(id, &doors_of(blueprint, recorded.doors), true);
        }
        self.actors.set_limbs(id, limbs);
        // It has a body: it was spawned for this.
        let _ = self.physics.teleport(id, &recorded.pose);
    }

    /// A shown actor is on its own: vehicles go on under traffic, walkers stop.
    pub(crate) fn let_go(&mut self, id: ActorId) {
        let Some(actor) = self.actors.get_mut(id) else { return };
        let (linear, turn) = (actor.velocity_mps, actor.angular_velocity_radps);
        actor.flags &= !flag::KINEMATIC;
        let is_vehicle = actor.kind == kind::VEHICLE;
        set(&mut actor.flags, flag::AUTOPILOT, is_vehicle);
        let [linear, turn] =
            [linear, turn].map(|v| if is_vehicle { Vec3::from_array(v) } else { Vec3::ZERO });
        // A client may have taken it out: then there is nobody to let go.
        let _ = self.physics.set_kinematic(id, false);
        let _ = self.physics.set_velocity(id, linear, turn);
    }

    /// Writes what decides the future into a state.
    pub fn save_into(&self, state: &mut SavedState) {
        state.last_actor = self.last_actor;
        state.weather_affects_grip = self.weather_affects_grip;
        state.hidden_layers = self.visibility.hidden_layers();
        let hidden = self.visibility.hidden_objects();
        state.hidden_objects =
            hidden.map(|(block, bits)| HideObjects { block, hidden: 1, bits: *bits }).collect();
        state.lamps = lit(&self.lighting);
        state.actors = self.states().to_vec();
        state.roles = self.actors.roles().to_vec();
        state.limbs = self.limbs().to_vec();
        state.set_poses(&self.poses);
        state.physics = self.physics.save();
    }

    /// Goes on from a state; on an error the world is as it was.
    pub fn restore(&mut self, state: &SavedState) -> Result<(), StateError> {
        let damaged = |e: PhysicsError| StateError::Damaged(e.to_string());
        self.physics.restore(&state.physics).map_err(damaged)?;
        self.actors = Cast::default();
        for (actor, role) in state.actors.iter().zip(&state.roles) {
            self.actors.insert(*actor, *role);
        }
        for limbs in &state.limbs {
            self.actors.set_limbs(limbs.actor_id, Some(*limbs));
        }
        self.last_actor = state.last_actor;
        self.poses = GivenPoses::default();
        state.poses().for_each(|command| self.poses.follow(&command));
        self.lighting = Lighting::default();
        for told in &state.lamps {
            self.lighting.set(told.block, &told.bits, shine(told));
        }
        self.visibility = Visibility::default();
        self.visibility.set_layers(state.hidden_layers, true);
        self.weather_affects_grip = state.weather_affects_grip;
        self.weather_grip = state.weather.as_ref().map_or(1.0, outside::grip_under);
        for hide in &state.hidden_objects {
            self.visibility.set_objects(hide.block, &hide.bits, true);
        }
        Ok(())
    }

    /// What actors are called, if anything.
    pub(crate) fn roles(&self) -> Vec<(ActorId, String)> {
        let named = self.states().iter().zip(self.actors.roles());
        let named = named.filter(|(_, role)| **role != Name::default());
        named.map(|(actor, role)| (actor.actor_id, role.to_string())).collect()
    }

    /// Who touched whom during this frame.
    pub(crate) fn touches(&self) -> impl Iterator<Item = &Collision> {
        self.physics.collisions().iter()
    }

    /// Takes in all that decides the future: bodies, drivetrains, flags, roles, ids to come.
    fn hash(&self, hash: &mut StateHash) {
        hash.word(self.seed);
        hash.word(self.last_actor.into());
        hash.word(self.weather_affects_grip.into());
        hash.word(self.visibility.hidden_layers().into());
        for (block, bits) in self.visibility.hidden_objects() {
            hash.word(block.into());
            bits.iter().for_each(|word| hash.word(*word));
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

/// A walker's legs follow the ground that it covers.
fn walk_on(state: &mut ActorState, delta_nanos: u64) {
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

fn check_pose(pose: &Pose) -> Result<(), String> {
    if !pose.is_valid() {
        return Err(format!(
            "pose {:?}, {:?} is not finite, or its rotation not of unit length",
            pose.position_m, pose.rotation
        ));
    }
    let far = pose.position().abs().max_element();
    if far > 1e5 {
        return Err(format!(
            "position {} lies {far} m out; 100000 m is the limit",
            pose.position()
        ));
    }
    Ok(())
}

fn check_control(control: &VehicleControl) -> Result<(), String> {
    let VehicleControl { throttle, brake, steer, .. } = *control;
    for (what, value, low) in
        [("throttle", throttle, 0.0), ("brake", brake, 0.0), ("steer", steer, -1.0)]
    {
        if !(low..=1.0).contains(&value) {
            return Err(format!("{what} of {} is {value}, not {low} to 1", control.actor_id));
        }
    }
    Ok(())
}

fn kind_of(blueprint: &Blueprint) -> Result<u32, String> {
    match blueprint.kind {
        Kind::Vehicle => Ok(kind::VEHICLE),
        Kind::Walker => Ok(kind::WALKER),
        Kind::Prop => Ok(kind::PROP),
        _ => Err(format!("{} is part of the map and cannot be spawned", blueprint.id)),
    }
}

fn default_color(blueprint: &Blueprint) -> u32 {
    let [r, g, b] = blueprint.default_color;
    u32::from_le_bytes([r, g, b, 255])
}
