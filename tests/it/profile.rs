//! The stage clock.

use client_lib::{CameraOutputs, Client, Pose, Spawn, VehicleControl, wire::camera};
use glam::{Quat, Vec3};
use protocol::ActorId;

use crate::kit::Sim;

/// Spawns an ego and two vehicles in traffic; returns the ego.
fn populate(client: &mut Client) -> ActorId {
    let places = client.spawn_points().unwrap();
    for place in &places[1..3] {
        client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot()).unwrap();
    }
    client.spawn(Spawn::new("vehicle.tesla.model3", places[0])).unwrap()
}

#[test]
fn the_stage_clock_has_every_instant_of_each_frame_in_causal_order() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let ego = populate(&mut client);
    let above = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", above, 64, 48, 1.5, CameraOutputs::COLOR);
    let mut bundle = client.create_bundle("above", ActorId::NONE, [spec], 2).unwrap();
    client.tick().unwrap();
    let mut before = None;
    for _ in 0..100 {
        let (frame, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        assert!(measured[0].is_some());
        let pedals = VehicleControl { actor_id: ego, throttle: 0.3, ..Default::default() };
        client.control(&[pedals]).unwrap();
        // The controls sent on a frame act in the next one.
        let Some(done) = before.replace(frame) else { continue };
        let clock = client.stage_clock(done);
        assert_eq!(clock.frame, done);
        let chain = [
            ("requested", clock.requested_nanos),
            ("begun", clock.begun_nanos),
            ("physics begun", clock.physics_begun_nanos),
            ("physics ended", clock.physics_ended_nanos),
            ("published", clock.published_nanos),
            ("trace begun", clock.trace_begun_nanos),
            ("traced", clock.traced_nanos),
            ("delivered", clock.delivered_nanos),
            ("read", clock.read_nanos),
            ("control sent", clock.control_sent_nanos),
            ("control applied", clock.control_applied_nanos),
        ];
        let plan = [
            ("published", clock.published_nanos),
            ("plan begun", clock.plan_begun_nanos),
            ("planned", clock.planned_nanos),
            ("plan delivered", clock.plan_delivered_nanos),
            ("read", clock.read_nanos),
        ];
        let close = [("delivered", clock.delivered_nanos), ("closed", clock.closed_nanos)];
        for chain in [&chain[..], &plan, &close] {
            for (name, nanos) in chain {
                assert!(nanos.is_some(), "{done} has no instant {name:?}: {clock:?}");
            }
            for pair in chain.windows(2) {
                assert!(pair[0].1 <= pair[1].1, "{done}: {:?} after {:?}", pair[0], pair[1]);
            }
        }
        let next = client.stage_clock(frame);
        assert_eq!(clock.control_applied_nanos, next.physics_begun_nanos, "{clock:?} {next:?}");
        assert_eq!(next.control_applied_nanos, None, "no frame has applied them: {next:?}");
    }
    let old = client.stage_clock(protocol::Frame(2));
    assert_eq!((old.published_nanos, old.read_nanos), (None, None), "overwritten: {old:?}");
    drop((client, bundle));
    sim.end();
}
