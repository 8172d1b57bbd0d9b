//! The ROS 2 node, received by Eclipse Cyclone DDS: another implementation of DDS, installed from the
//! Python registry. Without it those tests are skipped.

use std::{
    collections::VecDeque,
    fs,
    io::{BufRead, BufReader, Read},
    path::Path,
    process::{Child, Command, Stdio},
};

use client_lib::{ActorId, ActorKind, Client, wire};
use rustix::process::Signal;
use serde_json::Value;

use crate::{
    carla::environment,
    kit::{Scratch, Sim, kill, lives, note_skipped, omnibus, thread},
};

const SENSORS: &str = r#"
[[sensor]]
name = "front"
kind = "camera"
width_px = 400
height_px = 300
position_m = [1.5, 0.0, 2.0]
pitch_deg = 10
outputs = ["color", "depth"]

[[sensor]]
name = "lidar"
kind = "lidar"
channels = 16
columns = 360
position_m = [0.0, 0.0, 2.4]
"#;

/// Discovery without multicast, as in a container that has `lo` only.
const LOOPBACK_ONLY: &str = "<CycloneDDS><Domain>\
    <General><Interfaces><NetworkInterface name='lo'/></Interfaces>\
    <AllowMulticast>false</AllowMulticast></General>\
    <Discovery><ParticipantIndex>auto</ParticipantIndex>\
    <Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>";

/// Frames whose measurements are kept until the subscriber has received one of them.
const KEPT: usize = 100;

/// A domain that other tests do not use, whose ports are below those that the system gives away.
fn domain() -> String {
    (1 + std::process::id() % 100).to_string()
}

/// A running `omnibus ros2`.
struct Node {
    child: Child,
    said: String,
}

impl Node {
    /// Starts a node and waits until it is ready.
    fn start(sim: &Sim, args: &[&str]) -> Node {
        let mut command = omnibus();
        command.args(["ros2", "--name", sim.instance().id(), "--domain", &domain()]).args(args);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut said = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut said).unwrap();
        if !said.contains("publishes") {
            let mut why = String::new();
            child.stderr.as_mut().unwrap().read_to_string(&mut why).unwrap();
            panic!("{said}{why}");
        }
        Node { child, said }
    }

    fn vehicle(&self) -> ActorId {
        ActorId(self.said.split(' ').nth(1).unwrap().parse().unwrap())
    }

    /// Waits for the end and returns whether it was good, and standard error.
    fn wait(mut self) -> (bool, String) {
        let mut why = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut why).unwrap();
        (self.child.wait().unwrap().success(), why)
    }

    fn signal(self, signal: Signal) -> (bool, String) {
        kill(self.child.id(), signal);
        self.wait()
    }
}

/// Runs the node with arguments that are wrong and returns what it says.
fn refusal(args: &[&str]) -> String {
    let output = omnibus().arg("ros2").args(args).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{args:?}");
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

/// What one frame measured.
struct Measured {
    sim_time_nanos: u64,
    /// Blue, green, red, 255.
    color: Vec<u8>,
    depth: Vec<u8>,
    points: Vec<f32>,
    position: [f32; 3],
    speed_mps: f32,
    frame: u64,
}

fn sensors() -> Vec<wire::SensorSpec> {
    use client_lib::{
        Pose,
        glam::{Quat, Vec3},
    };
    let eye = Pose::new(Vec3::new(1.5, 0.0, 2.0), Quat::from_rotation_y(10f32.to_radians()));
    let roof = Pose::new(Vec3::new(0.0, 0.0, 2.4), Quat::IDENTITY);
    let outputs = wire::output::COLOR | wire::output::DEPTH;
    let elevations = [-30.0, 10.0].map(f32::to_radians);
    vec![
        wire::camera("front", eye, 400, 300, 90f32.to_radians(), outputs),
        wire::lidar("lidar", roof, 16, 360, elevations, 100.0),
    ]
}

fn measure(client: &mut Client, bundle: &mut client_lib::SensorBundle, car: ActorId) -> Measured {
    let (frame, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    let measured = measured.pop().flatten().unwrap();
    let car = *client.world().actor(car).unwrap();
    let pixels = measured.color(0).unwrap();
    let hits = measured.point_cloud(1).unwrap();
    let points = hits.hits().flat_map(|(point, intensity)| [point.x, point.y, point.z, intensity]);
    Measured {
        sim_time_nanos: measured.sim_time().as_nanos() as u64,
        color: pixels.iter().flat_map(|[r, g, b, a]| [*b, *g, *r, *a]).collect(),
        depth: measured.data(0, wire::output::DEPTH).unwrap().to_vec(),
        points: points.collect(),
        position: car.position().to_array(),
        speed_mps: car.speed_mps(),
        frame: frame.0,
    }
}

fn numbers(value: &Value, names: &[&str]) -> Vec<f64> {
    names.iter().map(|name| value[name].as_f64().unwrap()).collect()
}

/// Compares what was received with what the simulator gave.
fn compare(folder: &Path, kept: &VecDeque<Measured>) {
    let text = fs::read_to_string(folder.join("received.json")).unwrap();
    let received: Value = serde_json::from_str(&text).unwrap();
    let at = received["at"].as_u64().unwrap();
    let expected = kept.iter().find(|m| m.sim_time_nanos == at).expect("a frame of this time");
    assert_eq!(received["clock_nanos"].as_u64(), Some(at));
    let bytes = |name: &str| fs::read(folder.join(format!("{name}.bin"))).unwrap();
    assert!(bytes("image") == expected.color, "other pixels");
    assert!(bytes("depth") == expected.depth, "other depths");
    let points: Vec<u8> = expected.points.iter().flat_map(|n| n.to_le_bytes()).collect();
    assert!(bytes("lidar") == points && !points.is_empty(), "other points");

    let image = &received["image"];
    assert_eq!(
        [&image["width"], &image["height"], &image["step"], &image["encoding"]],
        [&400.into(), &300.into(), &1600.into(), &Value::from("bgra8")]
    );
    assert_eq!(received["depth"]["encoding"], "32FC1");
    assert_eq!(image["header"]["frame_id"], "ego_vehicle/front");
    let focal_px = received["camera_info"]["k"][0].as_f64().unwrap();
    assert!((focal_px - 200.0).abs() < 1e-4, "{focal_px}");
    assert_eq!(received["camera_info"]["p"][6], 150.0);
    let cloud = &received["lidar"];
    assert_eq!(cloud["width"].as_u64(), Some(expected.points.len() as u64 / 4));
    let fields = cloud["fields"].as_array().unwrap().iter();
    let fields: Vec<_> =
        fields.map(|f| (f["name"].as_str().unwrap(), f["offset"].clone())).collect();
    let names = [("x", 0), ("y", 4), ("z", 8), ("intensity", 12)];
    assert_eq!(fields, names.map(|(name, offset)| (name, offset.into())));

    let odometry = &received["odometry"];
    let position = numbers(&odometry["pose"]["pose"]["position"], &["x", "y", "z"]);
    // Decimal text is read back with an error in the last bit.
    let is_same = |(a, b): (&f64, &f32)| (a - f64::from(*b)).abs() < 1e-9;
    assert!(position.iter().zip(&expected.position).all(is_same), "{position:?}");
    assert_eq!(odometry["header"]["frame_id"], "map");
    assert_eq!(odometry["child_frame_id"], "ego_vehicle");
    let speed = received["vehicle_status"]["velocity"].as_f64().unwrap();
    assert!((speed - f64::from(expected.speed_mps)).abs() < 1e-6);
    // It stands: gravity is all that the accelerometer measures.
    let up = received["imu"]["linear_acceleration"]["z"].as_f64().unwrap();
    assert!((up - 9.81).abs() < 0.5, "{up}");
    assert!(received["gnss"]["latitude"].as_f64().unwrap().abs() > 1.0);
    let last = kept.back().unwrap().frame;
    assert!(received["status"]["frame"].as_u64().unwrap() <= last + 1);
    assert_eq!(received["status"]["synchronous_mode"], true);
    let transforms = received["tf"]["transforms"].as_array().unwrap();
    let of = |child: &str| {
        transforms.iter().find(|transform| transform["child_frame_id"] == child).unwrap()
    };
    assert_eq!(of("ego_vehicle")["header"]["frame_id"], "map");
    assert_eq!(of("ego_vehicle/lidar")["header"]["frame_id"], "ego_vehicle");
    // Optical z is forward and 10 degrees down.
    let turn = numbers(&of("ego_vehicle/front")["transform"]["rotation"], &["x", "y", "z", "w"]);
    let turn = glam::DQuat::from_array(turn.try_into().unwrap());
    let forward = turn * glam::DVec3::Z;
    let (sin, cos) = 10f64.to_radians().sin_cos();
    assert!(forward.abs_diff_eq(glam::DVec3::new(cos, 0.0, -sin), 1e-6), "{forward}");
    assert!((turn * glam::DVec3::X).abs_diff_eq(glam::DVec3::NEG_Y, 1e-6));
}

#[test]
fn another_dds_receives_the_same_bits_and_drives_the_vehicle() {
    let test = "another_dds_receives_the_same_bits_and_drives_the_vehicle";
    let found =
        environment("omnibus-it-cyclonedds-11.0.1", &["cyclonedds==11.0.1"], "import cyclonedds");
    let python = match found {
        Ok(python) => python,
        Err(why) => return note_skipped(test, &format!("cyclonedds is not there: {why}")),
    };
    let scratch = Scratch::new();
    let file = scratch.path().join("sensors.toml");
    fs::write(&file, SENSORS).unwrap();
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let node = Node::start(&sim, &["--barrier", "--sensors", file.to_str().unwrap()]);
    let car = node.vehicle();
    let mut bundle = client.create_bundle("own", car, sensors(), 2).unwrap();

    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/python/ros2_subscriber.py");
    let mut subscriber = Command::new(python);
    subscriber.args([script, &domain(), "ego_vehicle"]).arg(scratch.path());
    subscriber.env("CYCLONEDDS_URI", LOOPBACK_ONLY).stdout(Stdio::piped());
    let mut subscriber = subscriber.spawn().unwrap();
    let lines = BufReader::new(subscriber.stdout.take().unwrap()).lines();
    let said = thread(move || lines.map_while(Result::ok).collect::<Vec<_>>());
    let mut kept = VecDeque::new();
    while !said.is_finished() {
        let is_received = scratch.path().join("received.json").exists();
        if kept.len() == KEPT && !is_received {
            kept.pop_front();
        }
        let measured = measure(&mut client, &mut bundle, car);
        if kept.len() < KEPT {
            kept.push_back(measured);
        }
        // The subscriber, in Python, takes a while for the points of one frame.
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert_eq!(said.join().unwrap(), ["received", "driven"]);
    assert!(subscriber.wait().unwrap().success());
    compare(scratch.path(), &kept);

    drop(bundle);
    let (is_good, why) = node.signal(Signal::INT);
    assert!(is_good && why.is_empty(), "{why}");
    client.tick().unwrap();
    assert!(client.world().actor(car).is_none(), "the node destroys the vehicle that it spawned");
    drop(client);
    sim.end();
}

#[test]
fn a_killed_node_delays_no_frame_and_the_end_of_the_simulator_ends_it() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let node = Node::start(&sim, &["--ego", "killed"]);
    client.tick().unwrap();
    let killed = node.child.id();
    assert!(!node.signal(Signal::KILL).0);
    for _ in 0..5 {
        client.tick().unwrap();
    }
    assert!(!lives(killed));
    let own = client.world().actors().iter().find(|a| a.kind() == ActorKind::Vehicle).unwrap().id();
    let other = Node::start(&sim, &["--ego", "other", "--actor", &own.0.to_string()]);
    assert_eq!(other.vehicle(), own);
    client.tick().unwrap();
    client.destroy(own).unwrap();
    client.tick().unwrap();
    let (is_good, why) = other.wait();
    assert!(!is_good && why.contains("was destroyed at frame"), "{why}");
    let last = Node::start(&sim, &[]);
    drop(client);
    sim.end();
    let (is_good, why) = last.wait();
    assert!(!is_good && why.contains("the host has ended"), "{why}");
}

#[test]
fn wrong_arguments_of_the_node_have_one_error() {
    let sim = Sim::start(&[]);
    let name = sim.instance().id();
    let scratch = Scratch::new();
    let file = scratch.path().join("sensors.toml");
    fs::write(&file, "[[sensor]]\nname = \"a-b\"\nkind = \"lidar\"\n").unwrap();
    let file = file.to_str().unwrap();
    for (args, said) in [
        (&["--name", "nowhere"][..], "nowhere"),
        (&["--name", name, "--actor", "77"], "actor 77 does not exist; vehicles: none"),
        (&["--name", name, "--ego", "a b"], "role \"a b\""),
        (&["--name", name, "--domain", "233"], "domain 233"),
        (&["--name", name, "--spawn-point", "9999"], "spawn point 9999"),
        (&["--name", name, "--vehicle", "vehicle.none"], "vehicle.none"),
        (&["--name", name, "--sensors", "absent.toml"], "absent.toml"),
        (&["--name", name, "--sensors", file], "sensor \"a-b\""),
    ] {
        let why = refusal(args);
        assert!(why.contains(said), "{args:?}: {why}");
    }
    sim.end();
}
