//! The vehicles of a route file in a running world: each departs at its time, takes its route, and is
//! removed where it arrives.

use std::{collections::VecDeque, path::Path, sync::Arc};

use anyhow::{Context, ensure};
use client_lib::{Client, ClientError, RefusalCode, Ticket, TrafficParam};
use demand::{Demand, DepartPosition, DepartSpeed, Departure, VehicleClass};
use glam::{DVec3, Vec3};
use mesh::RandomStream;
use protocol::{ActorId, Command, Pose, RouteCommand, RouteStep, Spawn};
use road::{LanePoint, Network};
use town::Blueprint;

use crate::collect::actors::vehicle_of;

/// Frames after which the departure of a vehicle whose place was occupied is repeated.
const RETRY_FRAMES: u64 = 10;
/// Most vehicles that depart in one frame.
const AT_ONCE: usize = 64;
/// Height of a start above the lane, as at spawn points.
const START_CLEARANCE_M: f64 = 0.5;
/// Distance between the rear of a vehicle and the begin of its lane.
const BASE_M: f64 = 0.5;
/// Distance to the end of its route at which a vehicle has arrived.
const ARRIVED_M: f32 = 8.0;
/// A vehicle that has been this near to the end of its route has arrived when it drives away from it.
const PASSED_M: f32 = 25.0;

/// The vehicles of a route file.
pub(crate) struct Departures {
    network: Arc<Network>,
    /// Vehicles that have not departed, ascending by time.
    waiting: VecDeque<Departure>,
    /// Vehicles whose place was occupied, and the frame of their next request.
    blocked: Vec<Departure>,
    retry_at: u64,
    /// Vehicles that the host is asked to create.
    asked: Option<(Ticket, Vec<Departure>)>,
    driving: Vec<Driving>,
    random: RandomStream,
    arrived: usize,
}

/// A vehicle on its route.
struct Driving {
    actor: ActorId,
    goal: Vec3,
    nearest_m: f32,
}

impl Departures {
    /// Reads a route file, and notes the elements that have no meaning here. Vehicles that depart before
    /// `begin_s` are left out, and the others depart by so much earlier; `seed` decides on their models
    /// and paints.
    pub(crate) fn read(
        path: &Path,
        begin_s: f64,
        network: Arc<Network>,
        seed: u64,
    ) -> anyhow::Result<Departures> {
        ensure!((0.0..=1e9).contains(&begin_s), "routes begin at {begin_s} s; use 0 to 1e9");
        let shown = path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(|| shown.clone())?;
        let Demand { departures, skipped } = Demand::read(&text, &shown, &network, seed)?;
        for (name, count) in &skipped {
            log::warn!("{shown}: {count} <{name}> are skipped");
        }
        let all = departures.len();
        let later = departures.into_iter().filter(|departure| departure.at_s >= begin_s);
        let waiting: VecDeque<Departure> = later
            .map(|departure| Departure { at_s: departure.at_s - begin_s, ..departure })
            .collect();
        ensure!(
            !waiting.is_empty() || all == 0,
            "{shown}: none of its {all} vehicles departs at {begin_s} s or later; use a smaller begin"
        );
        Ok(Departures {
            network,
            waiting,
            blocked: Vec::new(),
            retry_at: 0,
            asked: None,
            driving: Vec::new(),
            random: RandomStream::from_state(seed ^ 0x0dd_ba11_5ca1_ab1e),
            arrived: 0,
        })
    }

    /// Returns how many vehicles have not departed.
    pub(crate) fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Returns whether all vehicles have arrived.
    pub(crate) fn are_done(&self) -> bool {
        self.waiting.is_empty()
            && self.blocked.is_empty()
            && self.asked.is_none()
            && self.driving.is_empty()
    }

    /// Takes the vehicles of the frame that the client has taken in: sends the commands for those that
    /// depart and for those that have arrived. Does not wait.
    pub(crate) fn advance(&mut self, client: &mut Client) -> Result<(), ClientError> {
        let mut commands = self.created(client)?;
        self.remove_arrived(client, &mut commands);
        if !commands.is_empty() {
            client.send(&commands)?;
        }
        if self.asked.is_none() {
            self.depart(client)?;
        }
        Ok(())
    }

    /// Takes the answers of the host, and returns the commands for the new vehicles.
    fn created(&mut self, client: &mut Client) -> Result<Vec<client_lib::Command>, ClientError> {
        let mut commands = Vec::new();
        let Some((ticket, _)) = &self.asked else { return Ok(commands) };
        let Some(outcomes) = client.poll(ticket)? else { return Ok(commands) };
        let (_, departures) = self.asked.take().expect("it was there");
        for (outcome, departure) in outcomes.into_iter().zip(departures) {
            match outcome.actor() {
                Ok(actor) => {
                    commands.extend(self.first_commands(actor, &departure));
                    let goal = departure.places.last().copied().unwrap_or_default();
                    self.driving.push(Driving { actor, goal, nearest_m: f32::INFINITY });
                }
                Err(why) if why.refusal() == Some(RefusalCode::SpawnCollision) => {
                    self.blocked.push(departure);
                    self.retry_at = client.frame().0 + RETRY_FRAMES;
                }
                Err(why) => log::warn!("vehicle {} does not depart: {why}", departure.id),
            }
        }
        Ok(commands)
    }

    fn first_commands(&self, actor: ActorId, departure: &Departure) -> Vec<client_lib::Command> {
        let lane = self.network.lane(departure.lane);
        let speed_mps = match departure.speed {
            DepartSpeed::Fixed(mps) => mps,
            DepartSpeed::Limit => lane.speed_limit_mps.unwrap_or(50.0 / 3.6),
        };
        let param = |param: TrafficParam| client_lib::Command::set_traffic_param(actor, param);
        let mut commands = Vec::new();
        if speed_mps > 0.0 {
            let heading = self.pose(departure, None).rotation() * Vec3::X;
            let velocity = heading * speed_mps as f32;
            commands.push(client_lib::Command::set_velocity(actor, velocity, Vec3::ZERO));
        }
        if let Some(factor) = departure.kind.speed_factor {
            commands.push(param(TrafficParam::SpeedReduction(1.0 - factor)));
        }
        if let Some(gap_m) = departure.kind.gap_m {
            commands.push(param(TrafficParam::GapM(gap_m)));
        }
        let steps: Vec<RouteStep> =
            departure.places.iter().map(|place| RouteStep::place(*place)).collect();
        let parts = RouteCommand::route(actor, &steps).into_iter();
        commands.extend(parts.map(|part| client_lib::Command::from(Command::RouteCommand(part))));
        commands
    }

    /// Requests the vehicles that are due.
    fn depart(&mut self, client: &mut Client) -> Result<(), ClientError> {
        let now_s = client.world().sim_time().as_secs_f64();
        let mut due = Vec::new();
        if client.frame().0 >= self.retry_at {
            due.append(&mut self.blocked);
        }
        while due.len() < AT_ONCE && self.waiting.front().is_some_and(|next| next.at_s <= now_s) {
            due.extend(self.waiting.pop_front());
        }
        if due.is_empty() {
            return Ok(());
        }
        let spawns: Vec<Command> = due
            .iter()
            .map(|departure| {
                let blueprint = choose(departure.kind.class, &mut self.random);
                let pose = self.pose(departure, Some(blueprint));
                Command::Spawn(Spawn {
                    role: protocol::Name::new("routed"),
                    ..vehicle_of(blueprint, pose, &mut self.random)
                })
            })
            .collect();
        self.asked = Some((client.submit("depart", &spawns)?, due));
        Ok(())
    }

    /// Returns where a vehicle departs.
    fn pose(&self, departure: &Departure, blueprint: Option<&Blueprint>) -> Pose {
        let length_m = self.network.lane(departure.lane).length_m;
        let (front_m, rear_m) = blueprint.map_or((2.5, 2.5), |blueprint| {
            let (half_m, middle_m) = (blueprint.half_extents_m.x, blueprint.center_m.x);
            (f64::from(half_m + middle_m), f64::from(half_m - middle_m))
        });
        let (low_m, high_m) = (rear_m + BASE_M, length_m - front_m);
        let along_m = match departure.position {
            DepartPosition::Base => low_m,
            DepartPosition::Front(at_m) => at_m - front_m,
            DepartPosition::Fraction(part) => low_m + (high_m - low_m).max(0.0) * part,
        };
        let along_m = along_m.min(high_m).max(low_m).min(length_m);
        let at = self.network.place(LanePoint { lane: departure.lane, along_m });
        let position = at.position + DVec3::Z * START_CLEARANCE_M;
        Pose::level(position.as_vec3(), at.heading_rad as f32)
    }

    /// Adds commands that destroy the vehicles that have arrived.
    fn remove_arrived(&mut self, client: &Client, commands: &mut Vec<client_lib::Command>) {
        let before = self.driving.len();
        self.driving.retain_mut(|vehicle| {
            let Some(state) = client.world().state(vehicle.actor) else {
                // A new vehicle is in the next frame; others were destroyed by another client.
                return vehicle.nearest_m == f32::INFINITY;
            };
            let away_m = state.pose.position().truncate().distance(vehicle.goal.truncate());
            let passed = vehicle.nearest_m < PASSED_M && away_m > vehicle.nearest_m + PASSED_M;
            vehicle.nearest_m = vehicle.nearest_m.min(away_m);
            let arrived = away_m < ARRIVED_M || passed;
            if arrived {
                commands.push(client_lib::Command::destroy(vehicle.actor));
            }
            !arrived
        });
        self.arrived += before - self.driving.len();
    }
}

/// Returns one of the models of a class.
fn choose(class: VehicleClass, random: &mut RandomStream) -> &'static Blueprint {
    let suits = |blueprint: &&Blueprint| {
        let (base, special) = (blueprint.base_type, blueprint.special_type);
        let is_plain = !matches!(special, "emergency" | "taxi");
        match class {
            VehicleClass::Car => base == "car" && is_plain,
            VehicleClass::Van => base == "van" && is_plain,
            VehicleClass::Truck => base == "truck" && is_plain,
            VehicleClass::Bus => base == "bus",
            VehicleClass::Motorcycle => base == "motorcycle",
            VehicleClass::Bicycle => base == "bicycle",
            VehicleClass::Emergency => special == "emergency",
            VehicleClass::Taxi => special == "taxi",
        }
    };
    let choice: Vec<_> = town::catalogue().iter().filter(suits).collect();
    choice[random.below(choice.len())]
}
