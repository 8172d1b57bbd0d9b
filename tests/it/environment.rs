//! A simulation in one process has the frames of one with processes.

use std::sync::Arc;

use client_lib::{Spawn, VehicleControl};
use environment::Simulation;
use protocol::{ActorId, Command, Name, flag};
use road::Network;

use crate::kit::{Sim, small_map};

const SEED: u64 = 5;

#[test]
fn a_simulation_in_one_process_has_the_state_hashes_of_one_with_processes() {
    let sim = Sim::start(&["--seed", &SEED.to_string(), "--device", "null"]);
    let mut client = sim.ticker();
    let network = Arc::new(Network::parse(&std::fs::read_to_string(small_map()).unwrap()).unwrap());
    let town = town::furnish(&network, SEED);
    let mut alone = Simulation::new(network, &town, SEED);
    let places = client.spawn_points().unwrap();
    let mut ego = ActorId::NONE;
    for (index, place) in places.iter().step_by(places.len() / 8).take(8).enumerate() {
        let mut spawn = Spawn::new("vehicle.audi.tt", *place);
        if index > 0 {
            spawn = spawn.autopilot();
        }
        let id = client.spawn(spawn).unwrap();
        let outcome = alone.apply(Command::Spawn(protocol::Spawn {
            blueprint: Name::new("vehicle.audi.tt"),
            pose: *place,
            flags: if index > 0 { flag::AUTOPILOT } else { 0 },
            ..protocol::Spawn::default()
        }));
        assert_eq!(outcome.result(), Ok(id.0));
        ego = if index == 0 { id } else { ego };
    }
    for frame in 0..200 {
        let steer = if frame % 40 < 20 { 0.2 } else { -0.2 };
        let control =
            VehicleControl { actor_id: ego, throttle: 0.5, steer, ..VehicleControl::default() };
        client.control(&[control]).unwrap();
        alone.request(Command::Control(control.into()));
        client.tick().unwrap();
        let outputs = alone.step();
        assert_eq!(client.world().header().state_hash, outputs.state_hash, "frame {frame}");
    }
    drop(client);
    sim.end();
}
