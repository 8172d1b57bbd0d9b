//! Walkers and vehicles on autopilot for minutes, with physics: no vehicle touches a walker.

use std::sync::Arc;

use glam::{Quat, Vec3};
use mesh::RandomStream;
use protocol::{ActorId, Name, Pose, Spawn, WorldCommand, flag, kind};
use road::{LaneType, LaneTypes, Network};
use sim_host::{Decision, Inputs, NoServices, Sim};
use traffic::Planner;

use crate::kit::is_soak;

const DELTA_NANOS: u64 = 50_000_000;
const SEED: u64 = 5;

/// Spawns an actor on autopilot; `None` where there is no room.
fn spawn(sim: &mut Sim, blueprint: &str, pose: Pose) -> Option<ActorId> {
    let spawn =
        Spawn { blueprint: Name::new(blueprint), flags: flag::AUTOPILOT, pose, ..Spawn::default() };
    sim.apply_world(&WorldCommand::Spawn(spawn)).ok().map(ActorId)
}

fn shuffled<T>(mut all: Vec<T>, random: &mut RandomStream) -> Vec<T> {
    for last in (1..all.len()).rev() {
        all.swap(last, random.below(last + 1));
    }
    all
}

#[test]
fn no_vehicle_touches_a_walker() {
    let seconds = if is_soak() { 1800 } else { 180 };
    let text = mapgen::named("Flatford").unwrap();
    let network = Arc::new(Network::parse(&text).unwrap());
    let mut sim = Sim::new(&town::furnish(&network, SEED), SEED);
    let mut planner = Planner::new(Arc::clone(&network), SEED);
    let mut random = RandomStream::from_state(SEED);
    let of_kind = |wanted: &[&str]| -> Vec<&str> {
        let all = town::catalogue().iter();
        all.filter(|b| wanted.contains(&b.base_type)).map(|b| b.id).collect()
    };
    let fleet: Vec<&str> = of_kind(&["car", "van", "truck", "bus", "motorcycle", "bicycle"]);
    let people: Vec<&str> = {
        let all = town::catalogue().iter().map(|b| b.id);
        all.filter(|id| id.starts_with("walker.")).collect()
    };
    let mut vehicles = 0;
    for at in shuffled(network.spawn_points(), &mut random) {
        let place = network.place(at);
        let position = place.position.as_vec3() + Vec3::Z * 0.5;
        let pose = Pose::new(position, place.rotation().as_quat());
        if vehicles < 60 && spawn(&mut sim, fleet[random.below(fleet.len())], pose).is_some() {
            vehicles += 1;
        }
    }
    let mut walkers = Vec::new();
    let sidewalks = network.waypoints(2.5, LaneTypes::only(LaneType::Sidewalk));
    for at in shuffled(sidewalks, &mut random) {
        let pose = Pose::new(network.place(at).position.as_vec3() + Vec3::Z, Quat::IDENTITY);
        if walkers.len() < 300 {
            walkers.extend(spawn(&mut sim, people[random.below(people.len())], pose));
        }
    }
    assert_eq!((vehicles, walkers.len()), (60, 300));
    let position = |sim: &Sim, id: ActorId| sim.world().state(id).unwrap().pose.position();
    let mut before: Vec<Vec3> = walkers.iter().map(|id| position(&sim, *id)).collect();
    let mut walked_m = vec![0.0; walkers.len()];
    let mut contacts = Vec::new();
    for frame in 0..seconds * 20 {
        planner.plan(DELTA_NANOS, sim.states(), &[]);
        let decision = Some(Decision { parts: planner.parts(&[]), hash: 0 });
        let inputs = Inputs { decision, requests: &[] };
        let Ok(_) = sim.step(&inputs, &mut NoServices::default());
        for collision in sim.world().physics().collisions() {
            let of = |id: ActorId| sim.world().state(id).map_or(0, |state| state.kind);
            let mut kinds = [of(collision.actor), of(collision.other)];
            kinds.sort_unstable();
            if kinds == [kind::VEHICLE, kind::WALKER] {
                contacts.push((frame, collision.actor, collision.other));
            }
        }
        for (index, id) in walkers.iter().enumerate() {
            let now = position(&sim, *id);
            walked_m[index] += now.distance(before[index]);
            before[index] = now;
        }
    }
    let fallen = sim.states().iter().filter(|state| state.has(flag::FALLEN)).count();
    walked_m.sort_by(f32::total_cmp);
    println!(
        "{} contacts, {fallen} fallen; walked {:.0} m, least {:.0} m",
        contacts.len(),
        walked_m[150],
        walked_m[0]
    );
    assert_eq!((contacts, fallen), (vec![], 0));
    assert!(walked_m[150] > 0.8 * seconds as f32, "half of the walkers walked {} m", walked_m[150]);
}
