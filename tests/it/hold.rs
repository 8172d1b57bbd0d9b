//! Many actors for minutes: none sinks, flies, overturns without cause, or leaves the map.

use client_lib::{Client, Spawn};
use glam::Vec3;
use protocol::{ActorState, Command, SetVelocity, kind};

use crate::kit::{Sim, is_soak};

/// The largest height above or depth below the road beside an actor, in metres.
const OFF_ROAD_M: f32 = 6.0;
/// Faster than any vehicle of the catalogue on these roads.
const SPEED_MAX_MPS: f32 = 70.0;

/// Returns what is wrong with an actor, if anything.
fn fault(client: &mut Client, actor: &ActorState) -> Option<String> {
    let position = actor.pose.position();
    let who = |what: String| Some(format!("{} at {position}: {what}", actor.actor_id));
    if !position.is_finite() || !actor.velocity().is_finite() {
        return who("is not finite".to_owned());
    }
    if actor.velocity().length() > SPEED_MAX_MPS {
        return who(format!("has {} m/s", actor.velocity().length()));
    }
    let map = client.map().ok()?;
    let at = map.nearest(position.as_dvec3(), road::LaneTypes::DRIVING)?;
    let road = map.place(at).position.as_vec3();
    if (position - road).truncate().length() < 12.0 && (position.z - road.z).abs() > OFF_ROAD_M {
        return who(format!("is {} m above the road", position.z - road.z));
    }
    None
}

fn is_upright(actor: &ActorState) -> bool {
    (actor.pose.rotation() * Vec3::Z).z > 0.5
}

#[test]
fn many_actors_stay_on_their_wheels_and_feet() {
    let (vehicles, walkers, seconds) = if is_soak() { (500, 100, 600) } else { (60, 20, 60) };
    let size = if is_soak() { "1500" } else { "500" };
    let scratch = crate::kit::Scratch::new();
    let map = scratch.path().join("crowd.xodr");
    let plan = mapgen::Plan {
        name: "Crowd".to_owned(),
        seed: 3,
        size_m: size.parse().unwrap(),
        character: mapgen::Character::Grid,
        relief_m: 20.0,
    };
    std::fs::write(&map, mapgen::generate(&plan)).unwrap();
    let sim = Sim::start(&["--map", map.to_str().unwrap()]);
    let mut client = sim.ticker();
    let blueprints: Vec<String> = client.blueprints().iter().map(|b| b.id.clone()).collect();
    let of = |kind: &str| -> Vec<&String> {
        blueprints.iter().filter(|id| id.starts_with(kind)).collect()
    };
    let (cars, people) = (of("vehicle."), of("walker."));
    let mut count = 0;
    for (index, place) in client.spawn_points().unwrap().iter().enumerate() {
        if count < vehicles {
            let blueprint = cars[index % cars.len()];
            count += usize::from(client.spawn(Spawn::new(blueprint, *place).autopilot()).is_ok());
        }
    }
    let mut on_foot = Vec::new();
    for (index, place) in client.spawn_points().unwrap().iter().enumerate() {
        let mut place = *place;
        let left = place.rotation() * Vec3::Y;
        place.position_m = (place.position() - left * 4.5 + Vec3::Z * 0.5).to_array();
        if on_foot.len() < walkers
            && let Ok(id) = client.spawn(Spawn::new(people[index % people.len()], place))
        {
            on_foot.push(id);
        }
    }
    println!("{count} vehicles, {} walkers, {seconds} s", on_foot.len());
    assert!(count * 10 >= vehicles * 9 && on_foot.len() * 10 >= walkers * 9);
    let (mut flipped, mut hit) = (Vec::new(), std::collections::BTreeSet::new());
    for frame in 0..seconds * 20 {
        if frame % 100 == 0 {
            let turn = |index: usize| (frame / 100 * 37 + index * 61) as f32;
            let commands = on_foot.iter().enumerate().map(|(index, id)| {
                let way = Vec3::new(turn(index).cos(), turn(index).sin(), 0.0) * 1.4;
                Command::SetVelocity(SetVelocity {
                    actor_id: *id,
                    velocity_mps: way.to_array(),
                    ..SetVelocity::default()
                })
            });
            client.send(&commands.collect::<Vec<_>>()).unwrap();
        }
        client.tick().unwrap();
        let actors: Vec<_> = client.world().states().to_vec();
        for actor in actors.iter().filter(|a| a.kind != kind::TRAFFIC_LIGHT) {
            if actor.has(protocol::flag::COLLIDING) {
                hit.insert(actor.actor_id);
            }
            if frame % 20 == 0 {
                let fault = fault(&mut client, actor);
                assert!(fault.is_none(), "after {} s: {}", frame / 20, fault.unwrap());
            }
            if !is_upright(actor) && !flipped.contains(&actor.actor_id) {
                flipped.push(actor.actor_id);
                assert!(hit.contains(&actor.actor_id), "{} fell over by itself", actor.actor_id);
            }
        }
    }
    println!("{} were in a collision, {} fell over in one", hit.len(), flipped.len());
    drop(client);
    sim.end();
}
