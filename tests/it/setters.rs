//! Every command with a number, with invalid numbers and unknown actors: each is refused by name,
//! and the world goes on unchanged.

use client_lib::{
    Client, Pose, Spawn,
    wire::{camera, lidar},
};
use glam::{Quat, Vec3};
use protocol::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Autopilot, Command, Curve,
    EffectsSpec, Gear, HideLayers, HideObjects, LidarSpec, SensorSpec, SetDoors, SetPhysics,
    SetTrafficLight, SetVehicleLights, SetVelocity, Settings, StartReplay, Switch, Teleport,
    TrafficParam, VehicleControl, Weather,
};

use crate::kit::Sim;

const BAD: [f32; 5] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30];

/// A number in a struct, and its name.
type Number<T> = (&'static str, fn(&mut T) -> &mut f32);

/// A command that must be refused, and its subject.
struct Bad {
    what: String,
    commands: Vec<Command>,
}

/// Returns all of them.
#[derive(Default)]
struct List(Vec<Bad>);

impl List {
    /// Returns the valid struct with each number in turn made invalid.
    fn numbers<T: Copy>(
        &mut self,
        name: &str,
        command: fn(T) -> Command,
        good: T,
        numbers: &[Number<T>],
    ) {
        for (field, number) in numbers {
            for bad in BAD {
                let mut body = good;
                *number(&mut body) = bad;
                let what = format!("{name}.{field} = {bad}");
                self.0.push(Bad { what, commands: vec![command(body)] });
            }
        }
    }

    fn one(&mut self, what: &str, command: Command) {
        self.0.push(Bad { what: what.to_owned(), commands: vec![command] });
    }
}

macro_rules! fields {
    ($($field:ident $([$index:literal])*),*) => {
        &[$((
            concat!(stringify!($field) $(, "[", $index, "]")*),
            |body| &mut body.$field$([$index])*,
        )),*]
    };
}

fn bad_numbers(client: &mut Client, car: ActorId) -> List {
    let mut list = List::default();
    let actor_id = car;
    let near = Pose::level(Vec3::new(1.0, 2.0, 3.0), 0.0);
    for (index, axis) in ["x", "y", "z"].into_iter().enumerate() {
        for bad in BAD {
            let mut pose = near;
            pose.position_m[index] = bad;
            let name = protocol::Name::new("vehicle.audi.tt");
            let spawn = protocol::Spawn { blueprint: name, pose, ..Default::default() };
            list.one(&format!("Spawn.{axis} = {bad}"), Command::Spawn(spawn));
            let to = Teleport { actor_id, pose };
            list.one(&format!("Teleport.{axis} = {bad}"), Command::Teleport(to));
        }
    }
    for bad in BAD {
        let pose = Pose { rotation: [bad, 0.0, 0.0, 1.0], ..near };
        list.one(
            &format!("Teleport turned by {bad}"),
            Command::Teleport(Teleport { actor_id, pose }),
        );
    }
    let velocity = SetVelocity { actor_id, ..Default::default() };
    list.numbers(
        "SetVelocity",
        Command::SetVelocity,
        velocity,
        fields!(velocity_mps[0], velocity_mps[2], angular_velocity_radps[1]),
    );
    let control = VehicleControl { actor_id, ..Default::default() };
    list.numbers("Control", Command::Control, control, fields!(throttle, brake, steer));
    list.numbers(
        "SetWeather",
        Command::SetWeather,
        Weather::default(),
        fields!(
            cloudiness,
            precipitation,
            precipitation_deposits,
            wind_intensity,
            sun_azimuth_rad,
            sun_altitude_rad,
            fog_density,
            fog_distance_m,
            wetness
        ),
    );
    let param = TrafficParam { param: protocol::param::GAP_M, ..Default::default() };
    list.numbers("TrafficParam", Command::TrafficParam, param, fields!(value));
    let guide = protocol::RouteCommand { actor_id, count: 1, ..Default::default() };
    for bad in BAD {
        let steps = [protocol::RouteStep::place(Vec3::new(0.0, bad, 0.0)); protocol::ROUTE_STEPS];
        list.one(
            &format!("RouteCommand to {bad}"),
            Command::RouteCommand(protocol::RouteCommand { steps, ..guide }),
        );
    }
    list.one("RouteCommand of no kind", Command::RouteCommand(guide));
    list.one(
        "RouteCommand of 12",
        Command::RouteCommand(protocol::RouteCommand { count: 12, ..guide }),
    );
    let push = ApplyForce { actor_id, has_point: 1, ..Default::default() };
    list.numbers("ApplyForce", Command::ApplyForce, push, fields!(linear[0], angular[2], at_m[1]));
    let ackermann = AckermannControl { actor_id, ..Default::default() };
    list.numbers(
        "Ackermann",
        Command::Ackermann,
        ackermann,
        fields!(steer_rad, steer_radps, speed_mps, acceleration_mps2, jerk_mps3),
    );
    let gains = AckermannSettings { actor_id, ..Default::default() };
    list.numbers("SetAckermann", Command::SetAckermann, gains, fields!(speed[0], acceleration[2]));

    let built = client.vehicle_physics(car).unwrap();
    let body = protocol::VehicleBody { actor_id, ..built.body };
    list.numbers(
        "SetBody",
        Command::SetBody,
        body,
        fields!(mass_kg, drag_coefficient, center_of_mass_m[0], center_of_mass_m[2]),
    );
    let engine = protocol::VehicleEngine { actor_id, ..built.engine };
    list.numbers(
        "SetEngine",
        Command::SetEngine,
        engine,
        fields!(
            max_rpm,
            inertia_kgm2,
            damping_full_nmsprad,
            damping_geared_nmsprad,
            damping_neutral_nmsprad
        ),
    );
    let gearbox = protocol::VehicleGearbox { actor_id, ..built.gearbox };
    list.numbers(
        "SetGearbox",
        Command::SetGearbox,
        gearbox,
        fields!(shift_s, clutch_nm, final_drive),
    );
    for bad in BAD {
        let curve = Curve::new(&[[0.0, bad]]).unwrap();
        let torque = Command::SetEngine(protocol::VehicleEngine { torque: curve, ..engine });
        list.one(&format!("a torque of {bad}"), torque);
        let steering = protocol::VehicleSteering { actor_id, share: curve };
        list.one(&format!("a steering share of {bad}"), Command::SetSteering(steering));
        let gear = Gear { ratio: bad, down: 0.3, up: 0.6 };
        let gears = gearbox.with_gears(&[gear]).unwrap();
        list.one(&format!("a gear of {bad}"), Command::SetGearbox(gears));
    }
    let wheel = protocol::VehicleWheel { actor_id, ..built.wheels[0] };
    list.numbers(
        "SetWheel",
        Command::SetWheel,
        wheel,
        fields!(
            grip,
            damping_nmsprad,
            steer_max_rad,
            radius_m,
            brake_torque_nm,
            handbrake_torque_nm,
            stiff_load,
            stiffness_y,
            stiffness_x
        ),
    );
    list.one(
        "no curve",
        Command::SetEngine(protocol::VehicleEngine { torque: Curve::default(), ..engine }),
    );
    list.one("a fifth wheel", Command::SetWheel(protocol::VehicleWheel { index: 4, ..wheel }));
    list.one("three wheels", Command::SetBody(protocol::VehicleBody { wheels: 3, ..body }));

    for (delta_nanos, substep_max_nanos) in [(0, 1), (u64::MAX, 1), (50_000_000, 0)] {
        let settings = Settings { delta_nanos, substep_max_nanos, ..client.wire_settings() };
        list.one(&format!("a delta of {delta_nanos}"), Command::SetSettings(settings));
    }
    let light = ActorId(1);
    list.one(
        "phase 9",
        Command::SetTrafficLight(SetTrafficLight { actor_id: light, hold: 1, phase: 9 }),
    );
    list.one("layer 31", Command::HideLayers(HideLayers { layers: 1 << 31, hidden: 1 }));
    let hide = HideObjects { block: u32::MAX, hidden: 1, bits: [u64::MAX; 16] };
    list.one("thing 4 billion", Command::HideObjects(hide));
    list.one("door 31", Command::SetDoors(SetDoors { actor_id, open: 1 << 31 }));
    let replay = StartReplay { time_factor: f32::NAN, ..bytemuck::Zeroable::zeroed() };
    list.one("a replay of nothing", Command::StartReplay(replay));
    list
}

/// Returns every command that names an actor, with an unknown actor.
fn of_unknown(actor_id: ActorId, list: &mut List) {
    let mut dead =
        |what: &str, command: Command| list.one(&format!("{what} of {actor_id}"), command);
    let velocity = SetVelocity { actor_id, ..Default::default() };
    dead("Destroy", Command::Destroy(actor_id));
    dead("Teleport", Command::Teleport(Teleport { actor_id, pose: Pose::IDENTITY }));
    dead("Control", Command::Control(VehicleControl { actor_id, ..Default::default() }));
    dead("Autopilot", Command::Autopilot(Autopilot { actor_id, on: 1 }));
    dead("SetVelocity", Command::SetVelocity(velocity));
    dead(
        "SetTrafficLight",
        Command::SetTrafficLight(SetTrafficLight { actor_id, hold: 1, phase: 0 }),
    );
    dead("SetPhysics", Command::SetPhysics(SetPhysics { actor_id, on: 1 }));
    dead("SetVehicleLights", Command::SetVehicleLights(SetVehicleLights { actor_id, lamps: 1 }));
    let to = protocol::RouteCommand { actor_id, replace: 1, ..Default::default() };
    dead("RouteCommand", Command::RouteCommand(to));
    dead("SetDoors", Command::SetDoors(SetDoors { actor_id, open: 0 }));
    dead(
        "SetBones",
        Command::SetBones(protocol::SetBones { actor_id, count: 1, ..Default::default() }),
    );
    dead("BlendPose", Command::BlendPose(protocol::BlendPose { actor_id, weight: 0.5 }));
    dead("SetBody", Command::SetBody(protocol::VehicleBody { actor_id, ..Default::default() }));
    dead(
        "SetEngine",
        Command::SetEngine(protocol::VehicleEngine { actor_id, ..Default::default() }),
    );
    dead(
        "SetGearbox",
        Command::SetGearbox(protocol::VehicleGearbox { actor_id, ..Default::default() }),
    );
    dead(
        "SetSteering",
        Command::SetSteering(protocol::VehicleSteering { actor_id, ..Default::default() }),
    );
    dead("SetWheel", Command::SetWheel(protocol::VehicleWheel { actor_id, ..Default::default() }));
    dead("ApplyForce", Command::ApplyForce(ApplyForce { actor_id, ..Default::default() }));
    dead("SetGravity", Command::SetGravity(Switch { actor_id, on: 1 }));
    dead("SetCollisions", Command::SetCollisions(Switch { actor_id, on: 1 }));
    dead("Ackermann", Command::Ackermann(AckermannControl { actor_id, ..Default::default() }));
    let gains = AckermannSettings { actor_id, ..Default::default() };
    dead("SetAckermann", Command::SetAckermann(gains));
}

fn bad_sensors(client: &mut Client, car: ActorId) {
    let seat = Pose::new(Vec3::Z * 2.0, Quat::IDENTITY);
    let eye = camera("eye", seat, 64, 48, 1.5, protocol::output::COLOR);
    let scan = lidar("scan", seat, 8, 90, [-0.4, 0.1], 60.0);
    let with_beams = |beams| {
        let mut spec = scan;
        spec.lidar = beams;
        spec
    };
    for bad in BAD {
        let mut turned = seat;
        turned.rotation[1] = bad;
        let mut away = seat;
        away.position_m[0] = bad;
        for (what, spec) in [
            ("fov_rad", SensorSpec { fov_rad: bad, ..eye }),
            ("bloom", SensorSpec { effects: EffectsSpec { bloom: bad, ..eye.effects }, ..eye }),
            ("turned", SensorSpec { parent_from_sensor: turned, ..eye }),
            ("away", SensorSpec { parent_from_sensor: away, ..eye }),
            ("range_m", SensorSpec { range_m: bad, ..scan }),
            ("lower_rad", SensorSpec { lower_rad: bad, ..scan }),
            ("upper_rad", SensorSpec { upper_rad: bad, ..scan }),
            ("divergence_rad", with_beams(LidarSpec { divergence_rad: bad, ..scan.lidar })),
            ("prism_hz", with_beams(LidarSpec { prism_hz: [1.0, bad], ..scan.lidar })),
        ] {
            let made = client.create_bundle("bad", car, [spec], 2);
            assert!(made.is_err(), "a sensor of {what} = {bad} was granted");
        }
    }
}

/// Returns the hashes of twenty frames, with or without the invalid commands in between.
fn play(with_commands: bool) -> Vec<u64> {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let places = client.spawn_points().unwrap();
    let blueprint = "vehicle.tesla.model3";
    let cars: Vec<_> = places
        .iter()
        .take(4)
        .map(|place| client.spawn(Spawn::new(blueprint, *place).autopilot()).unwrap())
        .collect();
    let gone = client.spawn(Spawn::new(blueprint, places[6])).unwrap();
    client.tick().unwrap();
    client.destroy(gone).unwrap();
    let mut list = List::default();
    if with_commands {
        list = bad_numbers(&mut client, cars[0]);
        for unknown in [ActorId::NONE, gone, ActorId(99_999), ActorId(u32::MAX)] {
            of_unknown(unknown, &mut list);
        }
        bad_sensors(&mut client, cars[0]);
    }
    println!("{} commands", list.0.len());
    let mut hashes = Vec::new();
    let mut granted = Vec::new();
    for chunk in 0..20 {
        let share = list.0.len().div_ceil(20);
        for bad in list.0.iter().skip(chunk * share).take(share) {
            match client.request("nonsense", &bad.commands) {
                Ok(_) => granted.push(bad.what.clone()),
                Err(said) => {
                    let words = said.to_string().trim_start_matches("nonsense").len();
                    assert!(words > 20, "{}: {said} says nothing", bad.what);
                }
            }
        }
        client.tick().unwrap();
        hashes.push(client.world().header().state_hash);
    }
    assert!(granted.is_empty(), "granted: {}", granted.join("\n"));
    drop(client);
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
    hashes
}

#[test]
fn every_command_with_an_invalid_number_is_refused_and_changes_nothing() {
    assert_eq!(play(true), play(false));
}
