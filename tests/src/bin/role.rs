//! The program that the tests start: `omnibus` with its fault points armed, a client that dies, or one
//! that observes.

use client_lib::{
    Client, ClientError, Pose, RefusalCode, Spawn,
    wire::{camera, output},
};
use protocol::flag;

fn main() -> std::process::ExitCode {
    bus::fault::arm_from_environment();
    let args: Vec<String> = std::env::args().collect();
    if args.get(1).is_some_and(|verb| verb == "client") {
        return match client(&args[2], args[3].parse().unwrap_or(10)) {
            Ok(()) => std::process::ExitCode::SUCCESS,
            Err(e) => {
                eprintln!("client: {e}");
                std::process::ExitCode::FAILURE
            }
        };
    }
    if args.get(1).is_some_and(|verb| verb == "observe") {
        return match observe(&args[2]) {
            Ok(()) => std::process::ExitCode::SUCCESS,
            Err(e) => {
                eprintln!("observer: {e}");
                std::process::ExitCode::FAILURE
            }
        };
    }
    omnibus::main()
}

/// Watches a world with a camera of this client, until the host ends.
fn observe(instance: &str) -> Result<(), ClientError> {
    let mut client = Client::connect(Some(instance), "observer")?;
    let at = Pose::new(glam::Vec3::Z * 40.0, glam::Quat::IDENTITY);
    let spec = camera("above", at, 32, 24, 1.5, output::DEPTH);
    let _bundle = loop {
        match client.create_bundle("observer", protocol::ActorId::NONE, [spec], 2) {
            // Another client has loaded the map again.
            Err(ClientError::Refused { code: RefusalCode::NotFound, .. }) => {}
            created => break created?,
        }
    };
    loop {
        match client.await_frame() {
            Ok(_) | Err(ClientError::Timeout { .. }) => {}
            Err(ClientError::HostEnded { .. }) => return Ok(()),
            Err(e) => return Err(e),
        }
    }
}

/// Ticks a world that holds a car and a camera of this client.
fn client(instance: &str, ticks: u64) -> Result<(), ClientError> {
    let mut client = Client::connect(Some(instance), "mortal")?;
    client.synchronise(std::time::Duration::from_nanos(50_000_000))?;
    // Clients that died before left their cars at the first spawn points.
    let mut places = client.spawn_points()?.into_iter();
    let car = loop {
        let place = places.next().expect("a free place");
        if let Ok(car) = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot()) {
            break car;
        }
    };
    let roof = Pose::new(glam::Vec3::Z * 2.0, glam::Quat::IDENTITY);
    let spec = camera("front", roof, 64, 48, 1.5, output::DEPTH);
    let mut bundle = client.create_bundle("mortal", car, [spec], 2)?;
    for _ in 0..ticks {
        let (_, measured) = client.tick_and_collect(&mut [&mut bundle])?;
        assert!(
            measured[0].is_some()
                && client.world().state(car).is_some_and(|a| a.has(flag::AUTOPILOT))
        );
    }
    client.destroy(car)
}
