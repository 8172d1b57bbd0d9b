//! Two clients in lockstep: one advances the world, the other drives, and each tick waits for it.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example lockstep_agent # in a second terminal
//! ```

use std::{thread, time::Duration};

use omnibus_client_lib::{ActorId, Client, ClientError, Spawn, VehicleControl};

const TICKS: u32 = 40;

fn main() {
    if let Err(why) = run(None) {
        eprintln!("lockstep_agent: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut ticker = Client::connect(instance, "ticker")?;
    let before = ticker.settings();
    ticker.synchronise(Duration::from_millis(50))?;
    let place = ticker.spawn_points()?[0];
    let car = ticker.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    let mut agent = Client::connect(instance, "agent")?;
    agent.join_barrier()?;
    let driving = thread::Builder::new().name("agent".into()).spawn(move || drive(agent, car));
    let driving = driving.expect("a thread can be started");
    for _ in 0..TICKS {
        // Returns when the agent has arrived at this frame.
        ticker.tick()?;
    }
    driving.join().expect("the agent does not panic")?;
    let speed_mps = ticker.world().actor(car).map_or(0.0, |car| car.speed_mps());
    println!("after {TICKS} ticks the car drives {speed_mps:.2} m/s");
    ticker.destroy(car)?;
    ticker.apply_settings(before)
}

fn drive(agent: Client, car: ActorId) -> Result<(), ClientError> {
    // Each half could have a thread of its own.
    let (mut observer, mut controller) = agent.split();
    for _ in 0..TICKS {
        observer.await_frame()?;
        let speed_mps = observer.world().actor(car).map_or(0.0, |car| car.speed_mps());
        let throttle = (0.2 * (8.0 - speed_mps)).clamp(0.0, 0.8);
        controller.control(&[VehicleControl { actor_id: car, throttle, ..Default::default() }])?;
        controller.arrive();
    }
    controller.leave_barrier()
}
