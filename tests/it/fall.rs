//! A walker that is hit falls as a jointed body; snapshots, recordings and saved states hold its
//! limbs to the bit.

use client_lib::{
    ActorId, Client, Pose, Profile, Replay, SensorBundle, Spawn,
    wire::{Command, SetVelocity, VehicleControl, camera},
};
use glam::{Quat, Vec3};
use mesh::WordHash;
use protocol::{ActorState, WalkerLimbs, flag, output};

use crate::{
    kit::{Scratch, Sim},
    record::seen,
};

/// A walker in the path of a car at 40 km/h, and a static camera beside them.
fn scene(client: &mut Client) -> (ActorId, ActorId) {
    let place = client.spawn_points().unwrap()[0];
    let ahead = place.then(&Pose::new(Vec3::X * 9.0, Quat::from_rotation_z(1.0)));
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    let walker =
        client.spawn(Spawn::new("walker.pedestrian.0002", ahead).ragdoll_on_hit()).unwrap();
    for _ in 0..10 {
        client.tick().unwrap();
    }
    let velocity_mps = (place.rotation() * Vec3::X * 11.0).to_array();
    let go = SetVelocity { actor_id: car, velocity_mps, ..SetVelocity::default() };
    client.request("velocity", &[Command::SetVelocity(go)]).unwrap();
    client.control(&[VehicleControl { actor_id: car, brake: 0.5, ..Default::default() }]).unwrap();
    (walker, car)
}

fn beside(client: &mut Client) -> SensorBundle {
    let place = client.spawn_points().unwrap()[0];
    let view = Pose::new(Vec3::new(13.0, -7.0, 1.5), Quat::from_rotation_z(1.57));
    let sensors = [camera("beside", place.then(&view), 160, 100, 1.5, output::INSTANCE)];
    client.create_bundle("beside", ActorId::NONE, sensors, 2).unwrap()
}

fn look(client: &mut Client, bundle: &mut SensorBundle) -> WordHash {
    let (_, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    let measured = measured.pop().flatten().expect("a measurement of this frame");
    let mut digest = WordHash::new();
    digest.bytes(bytemuck::cast_slice(measured.instances(0).unwrap()));
    digest
}

fn lies(client: &Client, walker: ActorId) -> ActorState {
    *client.world().state(walker).expect("it is there")
}

fn limbs(client: &Client, walker: ActorId) -> Option<WalkerLimbs> {
    WalkerLimbs::find(client.world().limbs(), walker).copied()
}

#[test]
fn a_fall_is_replayed_exactly_and_continues_from_a_saved_state() {
    let scratch = Scratch::new();
    let (path, saved) = (scratch.path().join("fall.mcap"), scratch.path().join("state"));
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (walker, _) = scene(&mut client);
    let mut bundle = beside(&mut client);
    client.start_recorder(path.to_str().unwrap(), Profile::State).unwrap();
    let mut looks = Vec::new();
    let mut states = Vec::new();
    let mut hashes = Vec::new();
    for frame in 0..100 {
        if frame == 22 {
            client.save_state_to(&saved).unwrap();
        }
        looks.push(look(&mut client, &mut bundle));
        states.push((lies(&client, walker), limbs(&client, walker)));
        hashes.push(seen(&client));
    }
    client.stop_recorder().unwrap();
    assert!(
        !states[0].0.has(flag::FALLEN) && states[22].0.has(flag::FALLEN),
        "it falls in between"
    );
    assert!(states.iter().all(|(state, limbs)| state.has(flag::FALLEN) == limbs.is_some()));
    let unused = |state: &ActorState| (state.throttle, state.engine_rpm, state.lamps, state.signal);
    assert_eq!(unused(&states[99].0), (0.0, 0.0, 0, 0), "fields of vehicles are 0 for a walker");
    let bent = |limbs: &Option<WalkerLimbs>| {
        let turns = limbs.expect("it lies").rotations();
        turns.iter().filter(|turn| turn.angle_between(Quat::IDENTITY) > 0.1).count()
    };
    assert!(bent(&states[99].1) >= 4, "{:?}", states[99].1);
    assert_eq!(states[99].0.pose, states[95].0.pose, "it has come to rest");
    assert!(looks[20..40].windows(2).filter(|two| two[0] != two[1]).count() > 10);

    // After loading a state saved during the fall, the fall repeats exactly.
    client.load_state_from(&saved).unwrap();
    for frame in 22..100 {
        let again = look(&mut client, &mut bundle);
        assert!(seen(&client) == hashes[frame], "frame {frame}");
        assert_eq!(again, looks[frame], "frame {frame}");
    }
    drop((bundle, client));
    sim.end();

    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bundle = beside(&mut client);
    client.start_replay(path.to_str().unwrap(), Replay::default()).unwrap();
    for (frame, (state, wanted)) in states.iter().zip(&looks).enumerate() {
        let shown = look(&mut client, &mut bundle);
        assert_eq!(limbs(&client, walker), state.1, "frame {frame}");
        assert_eq!(shown, *wanted, "frame {frame} of the replay looks otherwise");
    }
    drop((bundle, client));
    sim.end();
}

#[test]
fn the_body_of_a_dead_walker_is_removed_after_ten_seconds() {
    let scratch = Scratch::new();
    let (path, saved) = (scratch.path().join("dead.mcap"), scratch.path().join("state"));
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (hit, car) = scene(&mut client);
    let beside = client.spawn_points().unwrap()[0].then(&Pose::new(Vec3::Y * 4.0, Quat::IDENTITY));
    let spawn = Spawn::new("walker.pedestrian.0003", beside);
    let dies = client.spawn(spawn.removed_after_fall()).unwrap();
    client.start_recorder(path.to_str().unwrap(), Profile::Inputs).unwrap();
    for _ in 0..20 {
        client.tick().unwrap();
    }
    client.set_dead(dies).unwrap();
    let fell = client.frame().0 + 1;
    let mut hashes = Vec::new();
    for _ in 0..205 {
        let frame = client.tick().unwrap().0;
        let is_there = client.world().state(dies).is_some();
        assert_eq!(is_there, frame < fell + 200, "{} frames after the fall", frame - fell);
        if is_there {
            assert!(lies(&client, dies).has(flag::FALLEN));
        }
        if frame == fell + 150 {
            client.save_state_to(&saved).unwrap();
        }
        if frame > fell + 150 {
            hashes.push(seen(&client));
        }
    }
    assert!(lies(&client, hit).has(flag::FALLEN), "only a walker with the flag is removed");
    assert_eq!(limbs(&client, dies), None);
    client.stop_recorder().unwrap();

    // A saved state and a re-simulation of the inputs remove the body in the same frame.
    client.load_state_from(&saved).unwrap();
    for (nth, wanted) in hashes.iter().enumerate() {
        client.tick().unwrap();
        assert!(seen(&client) == *wanted, "frame {nth} after the saved state");
    }

    // A dead vehicle has no engine.
    client.set_dead(car).unwrap();
    let pedals = VehicleControl { actor_id: car, throttle: 1.0, ..VehicleControl::default() };
    for _ in 0..60 {
        client.control(&[pedals]).unwrap();
        client.tick().unwrap();
    }
    let car = lies(&client, car);
    assert!(car.has(flag::DEAD) && car.throttle == 0.0 && car.velocity().length() < 0.05);
    drop(client);
    sim.end();

    let mut recording = ::record::Recording::open(&path).unwrap();
    let again = omnibus::resimulate(&mut recording, 0, u64::MAX).unwrap();
    assert_eq!(again.difference, None);
}
