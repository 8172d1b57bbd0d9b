//! The ego and the road users around it: where they start, how pedestrians walk, and what replaces those
//! that fall behind. Everything follows from the seed and the frames, so that a resumed run repeats it.

use std::sync::Arc;

use client_lib::Client;
use glam::{DVec3, Vec3, Vec3A};
use mesh::RandomStream;
use protocol::{
    ActorId, ActorState, Command, Name, Pose, RouteCommand, RouteStep, SensorSpec, SetVelocity,
    Spawn, flag, kind, sensor, status,
};
use road::{LaneType, LaneTypes, Network};

use crate::collect::{
    CollectError,
    actors::{shuffled, vehicle},
    events::Crossing,
    format::SpawnedActors,
    plan::TrafficEntry,
    sensors::{Pinhole, sensor_from_optical},
};

/// Frames between two corrections of the direction of walking.
pub(crate) const CORRECTION_FRAMES: u64 = 10;
/// Frames between two replacements of road users that have fallen behind.
const REPLACEMENT_FRAMES: u64 = 20;
/// Most road users of a kind that are replaced at a time.
const REPLACED_MAX: usize = 4;
/// Distance of the point on the sidewalk's centre that a pedestrian walks towards.
const LOOKAHEAD_M: f64 = 2.0;
/// Distance between two pedestrians where they start, at least.
const SPACING_M: f64 = 2.5;
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
    walking: Vec<Walking>,
    /// How many vehicles are to be near the ego.
    near: u32,
    /// The cameras on the ego.
    cameras: Vec<(Pinhole, Pose)>,
    /// Road users in view, summed over the frames since the last replacement.
    in_view: f32,
}

struct Walking {
    actor: ActorId,
    speed_mps: f32,
    way: Way,
}

/// Where a pedestrian walks.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// Along its sidewalk; `is_reversed`: against the direction in which the lane is described.
    Sidewalk { is_reversed: bool },
    /// In one direction.
    Straight(Vec3),
}

impl RoadUsers {
    /// Spawns the ego, vehicles and pedestrians. Places where the host refuses one are skipped.
    pub(crate) fn assemble(
        client: &mut Client,
        cast: &Cast,
    ) -> Result<(RoadUsers, SpawnedActors), CollectError> {
        let network = client.map()?;
        let places = client.spawn_points()?;
        let mut order = shuffled(places.clone(), cast.seed);
        let (ego, ego_pose, mut spawned) = spawn_ego(client, cast, &network, &mut order)?;
        let sidewalks = sidewalks(&network);
        let is_camera = |spec: &&SensorSpec| spec.kind == sensor::CAMERA;
        let cameras = cast.sensors.iter().filter(is_camera);
        let mut users = RoadUsers {
            network,
            ego,
            traffic: cast.traffic,
            random: RandomStream::from_state(cast.seed ^ 0x7ca4_fe11_0b5e_55ed),
            places,
            sidewalks,
            vehicles: Vec::new(),
            walking: Vec::new(),
            near: cast.traffic.vehicles_near.min(cast.traffic.vehicles),
            cameras: cameras.map(|spec| (Pinhole::of(spec), spec.parent_from_sensor)).collect(),
            in_view: 0.0,
        };
        // The last place of the order comes first.
        let radius_m = users.traffic.radius_m;
        let is_near = |place: &Pose| place.position().distance(ego_pose.position()) < radius_m;
        let (mut near, mut far): (Vec<_>, Vec<_>) = order.into_iter().partition(is_near);
        let total = cast.traffic.vehicles;
        spawned.spawns_refused += users.fill(client, &mut near, users.near)?;
        spawned.spawns_refused += users.fill(client, &mut far, total)?;
        spawned.spawns_refused += users.fill(client, &mut near, total)?;
        spawned.vehicles_spawned = users.vehicles.len() as u32;
        let reach_m = users.walkers_reach_m();
        let mut places = users.sidewalks.clone();
        places.retain(|place| place.position().distance(ego_pose.position()) < reach_m);
        while users.walking.len() < cast.traffic.walkers as usize && !places.is_empty() {
            let place = places.swap_remove(users.random.below(places.len()));
            users.spawn_walker(client, place)?;
        }
        Ok((users, spawned))
    }

    /// Spawns vehicles and pedestrians anywhere on the map, around no ego.
    pub(crate) fn anywhere(
        client: &mut Client,
        seed: u64,
        traffic: TrafficEntry,
    ) -> Result<RoadUsers, CollectError> {
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
            near: 0,
            cameras: Vec::new(),
            in_view: 0.0,
        };
        users.fill(client, &mut order, traffic.vehicles)?;
        while users.walking.len() < traffic.walkers as usize && !sidewalks.is_empty() {
            let place = sidewalks.swap_remove(users.random.below(sidewalks.len()));
            users.spawn_walker(client, place)?;
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

    fn spawn_walker(&mut self, client: &mut Client, place: Pose) -> Result<(), CollectError> {
        let actor = spawn_pedestrian(client, place, &mut self.random)?;
        let speed_mps = 1.0 + self.random.below(60) as f32 / 100.0;
        let way = Way::Sidewalk { is_reversed: self.random.below(2) == 1 };
        self.walking.extend(actor.map(|actor| Walking { actor, speed_mps, way }));
        Ok(())
    }

    fn walkers_reach_m(&self) -> f32 {
        self.traffic.radius_m * 0.5
    }

    /// Prepares the next frame: replaces road users that have fallen behind, and returns the commands that
    /// destroy those and lead the pedestrians.
    pub(crate) fn advance(&mut self, client: &mut Client) -> Result<Vec<Command>, CollectError> {
        let frame = client.frame().0;
        let mut commands = Vec::new();
        if let Some(ego) = client.world().state(self.ego).copied() {
            commands.extend(self.accompany(client, frame, &ego)?);
        }
        if frame.is_multiple_of(CORRECTION_FRAMES) {
            commands.extend(self.lead(client));
        }
        Ok(commands)
    }

    /// Replaces what has fallen behind the ego, and returns the commands that destroy it.
    fn accompany(
        &mut self,
        client: &mut Client,
        frame: u64,
        ego: &ActorState,
    ) -> Result<Vec<Command>, CollectError> {
        let mut commands = Vec::new();
        self.in_view += self.count_in_view(client.world().states(), ego);
        if frame.is_multiple_of(REPLACEMENT_FRAMES) {
            if std::mem::take(&mut self.in_view) < self.traffic.in_view * REPLACEMENT_FRAMES as f32
            {
                self.near = (self.near + 1).min(self.traffic.vehicles);
            }
            let states = client.world().states().to_vec();
            commands.extend(self.replace_vehicles(client, &states, ego)?);
            commands.extend(self.replace_walkers(client, &states, ego)?);
        }
        Ok(commands)
    }

    /// Returns the commands that lead the pedestrians for the next [`CORRECTION_FRAMES`].
    pub(crate) fn lead(&self, client: &Client) -> Vec<Command> {
        let steps = self.walking.iter().filter_map(|one| self.step(client, one));
        steps.map(Command::SetVelocity).collect()
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
        let missing = (self.near as usize).saturating_sub(near).min(REPLACED_MAX).min(far.len());
        if missing == 0 {
            return Ok(Vec::new());
        }
        let places = self.places_ahead(&self.places, states, ego, radius_m);
        let count = self.vehicles.len();
        let places = self.choose(places, missing);
        self.spawn_vehicles(client, places)?;
        let replaced = self.vehicles.len() - count;
        let gone: Vec<_> = far.into_iter().rev().take(replaced).collect();
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
        self.walking.retain(|one| position(one.actor).is_some());
        let is_far = |one: &Walking| {
            position(one.actor).is_some_and(|at| at.distance(ego.pose.position()) > 1.2 * reach_m)
        };
        let far: Vec<_> =
            self.walking.iter().filter(|one| is_far(one)).map(|one| one.actor).collect();
        let places = self.places_ahead(&self.sidewalks, &[], ego, reach_m);
        let mut places = self.choose(places, far.len().min(REPLACED_MAX));
        let mut commands = Vec::new();
        for actor in far {
            let Some(place) = places.pop() else { break };
            let count = self.walking.len();
            self.spawn_walker(client, place)?;
            if self.walking.len() > count {
                self.walking.retain(|one| one.actor != actor);
                commands.push(Command::Destroy(actor));
            }
        }
        Ok(commands)
    }

    /// Takes up to `count` of the places at random.
    fn choose(&mut self, mut places: Vec<Pose>, count: usize) -> Vec<Pose> {
        let count = count.min(places.len());
        (0..count).map(|_| places.swap_remove(self.random.below(places.len()))).collect()
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

    /// How many road users are inside an image and at least [`IN_VIEW_PX`] high; what stands before them
    /// does not count.
    fn count_in_view(&self, states: &[ActorState], ego: &ActorState) -> f32 {
        let eyes: Vec<_> = self
            .cameras
            .iter()
            .map(|(camera, vehicle_from_sensor)| {
                let world_from_sensor = ego.pose.then(vehicle_from_sensor).affine();
                (camera, (world_from_sensor * sensor_from_optical()).inverse())
            })
            .collect();
        let is_in_view = |state: &&ActorState| {
            let is_road_user = matches!(state.kind, kind::VEHICLE | kind::WALKER);
            let Some(blueprint) = town::catalogue().get(state.blueprint as usize) else {
                return false;
            };
            let height_m = 2.0 * blueprint.half_extents_m.z;
            is_road_user
                && state.actor_id != self.ego
                && eyes.iter().any(|(camera, optical_from_world)| {
                    let at =
                        optical_from_world.transform_point3a(Vec3A::from(state.pose.position()));
                    if at.z < 0.5 || camera.focal_px * height_m / at.z < IN_VIEW_PX {
                        return false;
                    }
                    let [u, v] = camera.project(at);
                    (0.0..camera.width as f32).contains(&u)
                        && (0.0..camera.height as f32).contains(&v)
                })
        };
        states.iter().filter(is_in_view).count() as f32
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
        let actor = spawn_pedestrian(client, place, &mut self.random)?;
        let (speed_mps, way) = (crossing.speed_mps, Way::Straight(left));
        self.walking.extend(actor.map(|actor| Walking { actor, speed_mps, way }));
        Ok(())
    }

    fn step(&self, client: &Client, one: &Walking) -> Option<SetVelocity> {
        let position = client.world().state(one.actor)?.pose.position().as_dvec3();
        let direction = match one.way {
            Way::Straight(direction) => direction,
            Way::Sidewalk { is_reversed } => {
                let sidewalks = LaneTypes::only(LaneType::Sidewalk);
                let here = self.network.place(self.network.nearest(position, sidewalks)?);
                let forward = DVec3::new(here.heading_rad.cos(), here.heading_rad.sin(), 0.0);
                let along = if is_reversed { -forward } else { forward };
                let target = here.position + along * LOOKAHEAD_M;
                (target - position).with_z(0.0).as_vec3().normalize_or_zero()
            }
        };
        Some(SetVelocity {
            actor_id: one.actor,
            velocity_mps: (direction * one.speed_mps).to_array(),
            angular_velocity_radps: [0.0; 3],
        })
    }
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
    random: &mut RandomStream,
) -> Result<Option<ActorId>, CollectError> {
    let blueprints: Vec<_> =
        town::catalogue().iter().filter(|b| b.id.starts_with("walker.")).collect();
    let spawn = Spawn {
        blueprint: Name::new(random.choose(&blueprints).id),
        pose,
        role: Name::new("pedestrian"),
        ..Spawn::default()
    };
    let outcome = client.try_wire_request("spawn", &[Command::Spawn(spawn)])?[0].outcome;
    let is_done = outcome.status == status::DONE;
    Ok(outcome.result().ok().filter(|_| is_done).map(ActorId))
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
