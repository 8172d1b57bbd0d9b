//! The ego and the road users around it: where they start, which pedestrians go together, and what replaces
//! those that fall behind. Everything follows from the seed and the frames, so that a resumed run repeats it.

use std::sync::Arc;

use client_lib::{Client, TrafficParam};
use glam::{DVec3, Quat, Vec3};
use mesh::RandomStream;
use protocol::{
    ActorId, ActorState, Command, Name, Pose, RouteCommand, RouteStep, SensorSpec, SetVelocity,
    Spawn, flag, kind, status,
};
use road::{LanePoint, LaneType, LaneTypes, Network};

use crate::collect::{
    CollectError,
    actors::{shuffled, vehicle},
    events::Crossing,
    format::SpawnedActors,
    plan::TrafficEntry,
    visibility::{EgoCameras, Target},
};

/// Frames between two replacements of road users that have fallen behind.
const REPLACEMENT_FRAMES: u64 = 20;
/// Most road users of a kind that are replaced at a time.
const REPLACED_MAX: usize = 4;
/// Distance between two pedestrians where they start, at least.
const SPACING_M: f64 = 2.5;
/// Distance between pedestrians that go together, where they start.
const ABREAST_M: f32 = 0.8;
/// Height of a pedestrian's centre above the ground at the start.
const START_HEIGHT_M: f32 = 1.0;
/// Height of a vehicle's start above the lane, as at spawn points.
const START_CLEARANCE_M: f32 = 0.5;
/// Distance of a replacement from the nearest vehicle.
const ROOM_M: f32 = 12.0;
/// Distance from the ego's path at which a crossing pedestrian starts.
const CROSSING_FROM_M: f32 = 6.0;
/// Height in the image from which a road user counts as in view.
const IN_VIEW_PX: f32 = 25.0;
/// Frames between two counts of the road users in view.
const COUNT_FRAMES: u64 = 5;
/// Height in the image below which a road user may appear and disappear in view.
const UNSEEN_PX: f32 = 6.0;
/// How far beyond the edges of an image it may not, as a fraction of the image's size: it moves until the
/// next frame that is kept.
const MARGIN: f32 = 0.1;
/// Half the size of what may appear at a place: a van, and a pedestrian with the steps that it may take at
/// once.
const NEW_VEHICLE_M: Vec3 = Vec3::new(2.6, 1.1, 1.1);
const NEW_WALKER_M: Vec3 = Vec3::new(1.5, 0.3, 0.95);
/// Distance between the points by which lanes are measured.
const LANE_STEP_M: f64 = 10.0;

/// What [`RoadUsers::assemble`] places.
pub(crate) struct Cast<'a> {
    pub(crate) map: &'a str,
    pub(crate) seed: u64,
    pub(crate) ego_blueprint: &'a str,
    /// Where the ego drives; empty: from a spawn point, with turns at random.
    pub(crate) route: &'a [[f32; 2]],
    pub(crate) traffic: TrafficEntry,
    pub(crate) sensors: &'a [SensorSpec],
}

/// The ego and the other road users.
pub(crate) struct RoadUsers {
    network: Arc<Network>,
    ego: ActorId,
    traffic: TrafficEntry,
    random: RandomStream,
    /// Where vehicles may start.
    places: Vec<Pose>,
    /// Where pedestrians may start.
    sidewalks: Vec<Pose>,
    vehicles: Vec<ActorId>,
    walking: Vec<ActorId>,
    /// Points on driving lanes, [`LANE_STEP_M`] apart.
    lanes: Vec<Vec3>,
    /// How many more vehicles are to be near the ego than the plan has there.
    more: u32,
    cameras: EgoCameras,
    /// Counts of the road users in view since the last replacement.
    in_view: Vec<u32>,
}

/// Sets by how much drivers differ and whether physics is hybrid, unless that is what holds anyway.
fn set_drivers(client: &mut Client, traffic: &TrafficEntry) -> Result<(), CollectError> {
    let spread = traffic.driver_spread;
    if spread != TrafficEntry::default().driver_spread {
        client.set_traffic_param(ActorId::NONE, TrafficParam::DriverSpread(spread))?;
    }
    if let Some(radius_m) = traffic.hybrid_radius_m {
        client.set_traffic_param(ActorId::NONE, TrafficParam::HybridRadiusM(radius_m))?;
        client.set_traffic_param(ActorId::NONE, TrafficParam::HybridPhysics(true))?;
    }
    Ok(())
}

impl RoadUsers {
    /// Spawns the ego, vehicles and pedestrians. Places where the host refuses one are skipped.
    pub(crate) fn assemble(
        client: &mut Client,
        cast: &Cast,
    ) -> Result<(RoadUsers, SpawnedActors), CollectError> {
        set_drivers(client, &cast.traffic)?;
        client.set_traffic_param(ActorId::NONE, TrafficParam::AutomaticLights(true))?;
        let network = client.map()?;
        let places = client.spawn_points()?;
        let mut order = shuffled(places.clone(), cast.seed);
        let (ego, ego_pose, mut spawned) = spawn_ego(client, cast, &network, &mut order)?;
        let sidewalks = sidewalks(&network);
        let mut users = RoadUsers {
            lanes: lanes(&network),
            network,
            ego,
            traffic: cast.traffic,
            random: RandomStream::from_state(cast.seed ^ 0x7ca4_fe11_0b5e_55ed),
            places,
            sidewalks,
            vehicles: Vec::new(),
            walking: Vec::new(),
            more: 0,
            cameras: EgoCameras::new(cast.sensors),
            in_view: Vec::new(),
        };
        // The last place of the order comes first.
        let radius_m = users.traffic.radius_m;
        let is_near = |place: &Pose| place.position().distance(ego_pose.position()) < radius_m;
        let (mut near, mut far): (Vec<_>, Vec<_>) = order.into_iter().partition(is_near);
        let wanted_near = users.wanted_near(ego_pose.position());
        let total = cast.traffic.vehicles.max(wanted_near);
        spawned.spawns_refused += users.fill(client, &mut near, wanted_near)?;
        spawned.spawns_refused += users.fill(client, &mut far, total)?;
        spawned.spawns_refused += users.fill(client, &mut near, total)?;
        spawned.vehicles_spawned = users.vehicles.len() as u32;
        let reach_m = users.walkers_reach_m();
        let mut places = users.sidewalks.clone();
        places.retain(|place| place.position().distance(ego_pose.position()) < reach_m);
        let wanted = users.wanted_walkers(ego_pose.position());
        while users.walking.len() < wanted && !places.is_empty() {
            let place = places.swap_remove(users.random.below(places.len()));
            users.spawn_walkers(client, place, wanted - users.walking.len() - 1)?;
        }
        Ok((users, spawned))
    }

    /// Spawns vehicles and pedestrians anywhere on the map, around no ego. Traffic drives and leads them
    /// from then on.
    pub(crate) fn anywhere(
        client: &mut Client,
        seed: u64,
        traffic: TrafficEntry,
    ) -> Result<RoadUsers, CollectError> {
        set_drivers(client, &traffic)?;
        let network = client.map()?;
        let mut order = shuffled(client.spawn_points()?, seed);
        let mut sidewalks = sidewalks(&network);
        let mut users = RoadUsers {
            network,
            ego: ActorId::NONE,
            traffic,
            random: RandomStream::from_state(seed ^ 0x7ca4_fe11_0b5e_55ed),
            places: Vec::new(),
            sidewalks: Vec::new(),
            vehicles: Vec::new(),
            walking: Vec::new(),
            lanes: Vec::new(),
            more: 0,
            cameras: EgoCameras::new(&[]),
            in_view: Vec::new(),
        };
        users.fill(client, &mut order, traffic.vehicles)?;
        let wanted = traffic.walkers as usize;
        while users.walking.len() < wanted && !sidewalks.is_empty() {
            let place = sidewalks.swap_remove(users.random.below(sidewalks.len()));
            users.spawn_walkers(client, place, wanted - users.walking.len() - 1)?;
        }
        Ok(users)
    }

    /// How many vehicles and pedestrians there are.
    pub(crate) fn counts(&self) -> [usize; 2] {
        [self.vehicles.len(), self.walking.len()]
    }

    /// Returns the id of the ego.
    pub(crate) fn ego(&self) -> ActorId {
        self.ego
    }

    /// Spawns vehicles at the last of `places` until there are `wanted`; returns how many were refused.
    fn fill(
        &mut self,
        client: &mut Client,
        places: &mut Vec<Pose>,
        wanted: u32,
    ) -> Result<u32, CollectError> {
        let mut refused = 0;
        while (self.vehicles.len() as u32) < wanted && !places.is_empty() {
            let missing = wanted as usize - self.vehicles.len();
            let batch: Vec<_> =
                places.drain(places.len().saturating_sub(missing)..).rev().collect();
            refused += self.spawn_vehicles(client, batch)?;
        }
        Ok(refused)
    }

    /// Spawns a vehicle at each place; returns how many were refused.
    fn spawn_vehicles(
        &mut self,
        client: &mut Client,
        places: Vec<Pose>,
    ) -> Result<u32, CollectError> {
        let spawns: Vec<_> =
            places.into_iter().map(|at| Command::Spawn(vehicle(at, &mut self.random))).collect();
        let mut refused = 0;
        for entry in client.try_wire_request("spawn", &spawns)? {
            match entry.outcome.result() {
                Ok(id) => self.vehicles.push(ActorId(id)),
                Err(_) => refused += 1,
            }
        }
        Ok(refused)
    }

    /// Spawns a pedestrian, and up to `room` others beside it that go with it.
    fn spawn_walkers(
        &mut self,
        client: &mut Client,
        place: Pose,
        room: usize,
    ) -> Result<(), CollectError> {
        let companions = companions(&mut self.random).min(room);
        let Some(first) = spawn_pedestrian(client, place, flag::AUTOPILOT, &mut self.random)?
        else {
            return Ok(());
        };
        self.walking.push(first);
        let left = place.rotation() * Vec3::Y;
        for nth in 0..companions {
            let side = if nth.is_multiple_of(2) { -ABREAST_M } else { ABREAST_M };
            let beside = Pose { position_m: (place.position() + left * side).to_array(), ..place };
            let flags = flag::AUTOPILOT;
            if let Some(other) = spawn_pedestrian(client, beside, flags, &mut self.random)? {
                client.set_traffic_param(other, TrafficParam::WalksWith(first))?;
                self.walking.push(other);
            }
        }
        Ok(())
    }

    fn walkers_reach_m(&self) -> f32 {
        self.traffic.radius_m * 0.5
    }

    /// How many vehicles are to be near the ego: the number or the density of the plan, and those that were
    /// added since because too few were in view.
    fn wanted_near(&self, ego: Vec3) -> u32 {
        let TrafficEntry { vehicles, vehicles_near, vehicles_per_km, radius_m, .. } = self.traffic;
        let planned = match vehicles_per_km {
            None => vehicles_near.min(vehicles),
            Some(density) => {
                let near = self.lanes.iter().filter(|point| point.distance(ego) < radius_m);
                (density * near.count() as f32 * LANE_STEP_M as f32 * 1e-3).round() as u32
            }
        };
        planned + self.more
    }

    /// How many pedestrians are to be near the ego.
    fn wanted_walkers(&self, ego: Vec3) -> usize {
        let Some(density) = self.traffic.walkers_per_km else {
            return self.traffic.walkers as usize;
        };
        let reach_m = self.walkers_reach_m();
        let near = self.sidewalks.iter().filter(|place| place.position().distance(ego) < reach_m);
        (density * near.count() as f32 * SPACING_M as f32 * 1e-3).round() as usize
    }

    /// Prepares the next frame: replaces road users that have fallen behind, and returns the commands that
    /// destroy those.
    pub(crate) fn advance(&mut self, client: &mut Client) -> Result<Vec<Command>, CollectError> {
        let frame = client.frame().0;
        match client.world().state(self.ego).copied() {
            Some(ego) => self.accompany(client, frame, &ego),
            None => Ok(Vec::new()),
        }
    }

    /// Replaces what has fallen behind the ego, and returns the commands that destroy it.
    fn accompany(
        &mut self,
        client: &mut Client,
        frame: u64,
        ego: &ActorState,
    ) -> Result<Vec<Command>, CollectError> {
        let mut commands = Vec::new();
        if frame.is_multiple_of(COUNT_FRAMES) && self.traffic.in_view > 0.0 {
            self.in_view.push(self.count_in_view(client, ego)?);
        }
        if frame.is_multiple_of(REPLACEMENT_FRAMES) {
            let counts = std::mem::take(&mut self.in_view);
            let wanted = self.traffic.in_view * counts.len() as f32;
            let near = self.wanted_near(ego.pose.position());
            if (counts.iter().sum::<u32>() as f32) < wanted && near < self.traffic.vehicles {
                self.more += 1;
            }
            let states = client.world().states().to_vec();
            commands.extend(self.replace_vehicles(client, &states, ego)?);
            commands.extend(self.replace_walkers(client, &states, ego)?);
        }
        Ok(commands)
    }

    /// Spawns vehicles ahead of the ego while too few are near it, and returns the commands that destroy as
    /// many of the farthest.
    fn replace_vehicles(
        &mut self,
        client: &mut Client,
        states: &[ActorState],
        ego: &ActorState,
    ) -> Result<Vec<Command>, CollectError> {
        let radius_m = self.traffic.radius_m;
        let distance = |actor: &ActorId| {
            let at = states.binary_search_by_key(actor, |state| state.actor_id).ok()?;
            Some(states[at].pose.position().distance(ego.pose.position()))
        };
        // What another client destroyed is no longer there.
        self.vehicles.retain(|actor| distance(actor).is_some());
        let mut far = self.vehicles.clone();
        far.retain(|actor| distance(actor).is_some_and(|m| m > radius_m));
        far.sort_by(|a, b| distance(a).partial_cmp(&distance(b)).expect("positions are finite"));
        let near = self.vehicles.len() - far.len();
        let wanted = self.wanted_near(ego.pose.position()) as usize;
        let missing = wanted.saturating_sub(near).min(REPLACED_MAX);
        // A density may need more vehicles than there are.
        let more = wanted.saturating_sub(self.vehicles.len()).min(missing);
        let unseen = self.unseen(client, &far, ego)?;
        let missing = missing.min(unseen.len() + more);
        if missing == 0 {
            return Ok(Vec::new());
        }
        let places = self.places_ahead(&self.places, states, ego, radius_m);
        let count = self.vehicles.len();
        let places = self.choose(client, ego, places, NEW_VEHICLE_M, missing)?;
        self.spawn_vehicles(client, places)?;
        let replaced = (self.vehicles.len() - count).saturating_sub(more);
        let gone: Vec<_> = unseen.into_iter().rev().take(replaced).collect();
        self.vehicles.retain(|actor| !gone.contains(actor));
        Ok(gone.into_iter().map(Command::Destroy).collect())
    }

    /// Spawns a pedestrian ahead of the ego for each that has fallen behind, and returns the commands that
    /// destroy those.
    fn replace_walkers(
        &mut self,
        client: &mut Client,
        states: &[ActorState],
        ego: &ActorState,
    ) -> Result<Vec<Command>, CollectError> {
        let reach_m = self.walkers_reach_m();
        let position = |actor: ActorId| {
            let at = states.binary_search_by_key(&actor, |state| state.actor_id).ok()?;
            Some(states[at].pose.position())
        };
        self.walking.retain(|actor| position(*actor).is_some());
        let is_far = |actor: &&ActorId| {
            position(**actor).is_some_and(|at| at.distance(ego.pose.position()) > 1.2 * reach_m)
        };
        let far: Vec<_> = self.walking.iter().filter(is_far).copied().collect();
        let wanted = self.wanted_walkers(ego.pose.position());
        let missing = (wanted + far.len()).saturating_sub(self.walking.len()).min(REPLACED_MAX);
        let mut unseen = self.unseen(client, &far, ego)?;
        let places = self.places_ahead(&self.sidewalks, &[], ego, reach_m);
        let mut commands = Vec::new();
        for place in self.choose(client, ego, places, NEW_WALKER_M, missing)? {
            let has_room = self.walking.len() < wanted;
            if !has_room && unseen.is_empty() {
                break;
            }
            let count = self.walking.len();
            let room = (wanted + unseen.len()).saturating_sub(count + 1);
            self.spawn_walkers(client, place, room)?;
            while self.walking.len() > wanted.max(count)
                && let Some(actor) = unseen.pop()
            {
                self.walking.retain(|one| *one != actor);
                commands.push(Command::Destroy(actor));
            }
        }
        Ok(commands)
    }

    /// Takes up to `count` of the places at random, where no camera shows what appears there.
    fn choose(
        &mut self,
        client: &Client,
        ego: &ActorState,
        mut places: Vec<Pose>,
        half_extents_m: Vec3,
        count: usize,
    ) -> Result<Vec<Pose>, CollectError> {
        let mut chosen = Vec::new();
        let cameras = self.cameras.at(client, ego);
        while chosen.len() < count && !places.is_empty() {
            let pose = places.swap_remove(self.random.below(places.len()));
            // Places of both lie above the ground; the box of a pedestrian is centred at its place.
            let target = Target { actor: None, pose, half_extents_m };
            if !cameras.show(&target, UNSEEN_PX, MARGIN)? {
                chosen.push(pose);
            }
        }
        Ok(chosen)
    }

    /// Returns those of the actors that no camera shows.
    fn unseen(
        &self,
        client: &Client,
        actors: &[ActorId],
        ego: &ActorState,
    ) -> Result<Vec<ActorId>, CollectError> {
        let cameras = self.cameras.at(client, ego);
        let mut unseen = Vec::new();
        for actor in actors {
            let Some(target) = client.world().state(*actor).and_then(target_of) else { continue };
            if !cameras.show(&target, UNSEEN_PX, 0.0)? {
                unseen.push(*actor);
            }
        }
        Ok(unseen)
    }

    /// Places ahead of the ego in the outer part of a circle, with room.
    fn places_ahead(
        &self,
        places: &[Pose],
        states: &[ActorState],
        ego: &ActorState,
        radius_m: f32,
    ) -> Vec<Pose> {
        let forward = ego.pose.rotation() * Vec3::X;
        let is_vehicle = |state: &&ActorState| state.kind == kind::VEHICLE;
        let taken: Vec<_> =
            states.iter().filter(is_vehicle).map(|state| state.pose.position()).collect();
        let mut ahead = places.to_vec();
        ahead.retain(|place| {
            let from_ego = place.position() - ego.pose.position();
            (0.5 * radius_m..radius_m).contains(&from_ego.length())
                && from_ego.dot(forward) > 0.0
                && taken.iter().all(|other| other.distance(place.position()) > ROOM_M)
        });
        ahead
    }

    /// How many road users a camera shows at least [`IN_VIEW_PX`] high.
    fn count_in_view(&self, client: &Client, ego: &ActorState) -> Result<u32, CollectError> {
        let cameras = self.cameras.at(client, ego);
        let mut count = 0;
        for state in client.world().states() {
            let is_road_user = matches!(state.kind, kind::VEHICLE | kind::WALKER);
            if is_road_user
                && state.actor_id != self.ego
                && let Some(target) = target_of(state)
                && cameras.show(&target, IN_VIEW_PX, 0.0)?
            {
                count += 1;
            }
        }
        Ok(count)
    }

    /// Lets a pedestrian cross the road ahead of the ego, from right to left.
    pub(crate) fn cross(
        &mut self,
        client: &mut Client,
        crossing: Crossing,
    ) -> Result<(), CollectError> {
        let Some(ego) = client.world().state(self.ego).copied() else { return Ok(()) };
        let rotation = ego.pose.rotation();
        let flat = |axis: Vec3| (rotation * axis).with_z(0.0).normalize_or(axis);
        let (forward, left) = (flat(Vec3::X), flat(Vec3::Y));
        let from = ego.pose.position() + forward * crossing.ahead_m - left * CROSSING_FROM_M;
        let ground = self.network.nearest(from.as_dvec3(), LaneTypes::ANY);
        let ground_m = ground.map_or(from.z, |at| self.network.place(at).position.z as f32);
        let place = Pose::level(from.with_z(ground_m + START_HEIGHT_M), left.y.atan2(left.x));
        if let Some(actor) = spawn_pedestrian(client, place, 0, &mut self.random)? {
            client.send(&[Command::SetVelocity(SetVelocity {
                actor_id: actor,
                velocity_mps: (left * crossing.speed_mps).to_array(),
                angular_velocity_radps: [0.0; 3],
            })])?;
            self.walking.push(actor);
        }
        Ok(())
    }
}

/// Returns the box of an actor.
fn target_of(state: &ActorState) -> Option<Target> {
    let blueprint = town::catalogue().get(state.blueprint as usize)?;
    let centre = Pose::new(blueprint.center_m, Quat::IDENTITY);
    Some(Target {
        actor: Some(state.actor_id),
        pose: state.pose.then(&centre),
        half_extents_m: blueprint.half_extents_m,
    })
}

/// Returns points on the driving lanes outside of junctions, [`LANE_STEP_M`] apart.
fn lanes(network: &Network) -> Vec<Vec3> {
    let points = network.waypoints(LANE_STEP_M, LaneTypes::DRIVING).into_iter();
    let is_outside = |point: &LanePoint| {
        let road = network.lanes()[point.lane.0 as usize].road;
        network.roads()[road as usize].junction.is_none()
    };
    points.filter(is_outside).map(|point| network.place(point).position.as_vec3()).collect()
}

/// Spawns the ego: at the start of its route, or at the last of `places` that has room.
fn spawn_ego(
    client: &mut Client,
    cast: &Cast,
    network: &Network,
    places: &mut Vec<Pose>,
) -> Result<(ActorId, Pose, SpawnedActors), CollectError> {
    let lane_of = |[x, y]: &[f32; 2]| {
        let at = network.nearest(DVec3::new((*x).into(), (*y).into(), 0.0), LaneTypes::DRIVING)?;
        let place = network.place(at);
        let position = place.position.as_vec3() + Vec3::Z * START_CLEARANCE_M;
        Some(Pose::new(position, place.rotation().as_quat()))
    };
    let on_route: Option<Vec<Pose>> = cast.route.iter().map(lane_of).collect();
    let mut starts = match on_route.as_deref() {
        Some([first, ..]) => vec![*first],
        _ => std::mem::take(places),
    };
    let count = starts.len();
    let mut why = "no driving lane has room for a vehicle".to_owned();
    let mut spawned = SpawnedActors::default();
    while let Some(pose) = starts.pop() {
        let spawn = Spawn {
            blueprint: Name::new(cast.ego_blueprint),
            flags: flag::AUTOPILOT,
            pose,
            role: Name::new("hero"),
            ..Spawn::default()
        };
        match client.try_wire_request("spawn", &[Command::Spawn(spawn)])?[0].outcome.result() {
            Err(refusal) => {
                spawned.spawns_refused += 1;
                why = format!("{count} places were tried, the last was refused: {refusal}");
            }
            Ok(id) => {
                let ego = ActorId(id);
                spawned.ego_actor_id = id;
                if places.is_empty() {
                    *places = starts;
                }
                let steps: Vec<_> = on_route.unwrap_or_default();
                let steps: Vec<_> =
                    steps.iter().skip(1).map(|at| RouteStep::place(at.position())).collect();
                if !steps.is_empty() {
                    let route = RouteCommand::route(ego, &steps).into_iter();
                    let commands: Vec<_> = route.map(Command::RouteCommand).collect();
                    client.request("route", &commands)?;
                }
                return Ok((ego, pose, spawned));
            }
        }
    }
    Err(CollectError::NoSpawnPoint { map: cast.map.to_owned(), why })
}

/// Spawns a pedestrian; `None` where the host refuses it.
fn spawn_pedestrian(
    client: &mut Client,
    pose: Pose,
    flags: u32,
    random: &mut RandomStream,
) -> Result<Option<ActorId>, CollectError> {
    let blueprints: Vec<_> =
        town::catalogue().iter().filter(|b| b.id.starts_with("walker.")).collect();
    let spawn = Spawn {
        blueprint: Name::new(random.choose(&blueprints).id),
        flags,
        pose,
        role: Name::new("pedestrian"),
        ..Spawn::default()
    };
    let outcome = client.try_wire_request("spawn", &[Command::Spawn(spawn)])?[0].outcome;
    let is_done = outcome.status == status::DONE;
    Ok(outcome.result().ok().filter(|_| is_done).map(ActorId))
}

/// Draws how many go with a pedestrian: about half of all walk in pairs or threes.
fn companions(random: &mut RandomStream) -> usize {
    match random.below(100) {
        0..70 => 0,
        70..93 => 1,
        _ => 2,
    }
}

/// Places on all sidewalks, with distance between them.
fn sidewalks(network: &Network) -> Vec<Pose> {
    let points = network.waypoints(SPACING_M, LaneTypes::only(LaneType::Sidewalk)).into_iter();
    let placed = points.map(|point| network.place(point));
    placed
        .map(|place| {
            let position = place.position.as_vec3() + Vec3::Z * START_HEIGHT_M;
            Pose::level(position, place.heading_rad as f32)
        })
        .collect()
}
