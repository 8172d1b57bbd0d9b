//! An agent in an event loop: it sleeps in epoll until a frame or an outcome comes, and never blocks
//! in this library.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example epoll_agent    # in a second terminal
//! ```

use std::mem::MaybeUninit;

use omnibus_client_lib::{Client, Event, Pace, Spawn, Ticket, VehicleControl};
use rustix::event::epoll;

type AnyError = Box<dyn std::error::Error>;

const FRAME: u64 = 1;
const OUTCOME: u64 = 2;

fn main() {
    if let Err(why) = run(None) {
        eprintln!("epoll_agent: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), AnyError> {
    let mut client = Client::connect(instance, "epoll_agent")?;
    let before = client.settings();
    client.apply_settings(before.with_pace(Pace::RealTime(1.0)))?;
    let place = client.spawn_points()?[0];
    let (mut observer, mut controller) = client.split();
    observer.follow_events()?;
    let (frames, outcomes) = (observer.frame_fd()?, controller.outcome_fd()?);
    let poll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
    for (fd, token) in [(&frames, FRAME), (&outcomes, OUTCOME)] {
        epoll::add(&poll, fd, epoll::EventData::new_u64(token), epoll::EventFlags::IN)?;
    }
    let spawn = Spawn::new("vehicle.tesla.model3", place);
    let mut ticket: Option<Ticket> = Some(controller.submit("spawn", &[spawn])?);
    let (mut car, mut seen) = (None, 0);
    while seen < 40 {
        let mut ready = [MaybeUninit::uninit(); 4];
        let (ready, _) = epoll::wait(&poll, &mut ready, None)?;
        for event in ready {
            if event.data.u64() == OUTCOME {
                outcomes.clear();
                if let Some(done) =
                    ticket.as_ref().map(|t| controller.poll(t)).transpose()?.flatten()
                {
                    car = Some(done[0].actor()?);
                    ticket = None;
                }
                continue;
            }
            frames.clear();
            observer.refresh()?;
            seen += 1;
            if let Some(actor_id) = car {
                let control = VehicleControl { actor_id, throttle: 0.4, ..Default::default() };
                controller.control(&[control])?;
            }
            while let Some(event) = observer.next_event()? {
                if let Event::Spawned { frame, actor_id } = event {
                    println!("{frame}: {actor_id} was spawned");
                }
            }
        }
    }
    let actor_id = car.ok_or("the car was not spawned")?;
    let speed_mps = observer.world().actor(actor_id).map_or(0.0, |car| car.speed_mps());
    println!("after {seen} frames the car drives {speed_mps:.2} m/s");
    controller.send(&[omnibus_client_lib::Command::destroy(actor_id)])?;
    Ok(())
}
