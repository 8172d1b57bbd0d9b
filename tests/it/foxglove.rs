//! The Foxglove WebSocket of `omnibus view`: what a client receives, decoded with Foxglove's own schemas,
//! beside the simulator; wrong messages, clients that read nothing, and clients that leave.
//!
//! The client that decodes is `tests/python/foxglove.py`; without Python or the registry that test is
//! skipped.

use std::{
    collections::BTreeMap,
    net::TcpStream,
    path::PathBuf,
    process::{Command, Stdio},
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use client_lib::{
    CameraOutputs, Client, LidarOptions, Pose, Sensor, Spawn,
    glam::{Quat, Vec3},
};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, client::IntoClientRequest, http::HeaderValue};

use crate::{
    carla::environment,
    kit::{Scratch, Sim, eventually, note_skipped, open_files, resident_bytes, thread},
    view::{Viewer, collected, recorded},
};

const SDK: &str = "foxglove.sdk.v1";
const OLDER: &str = "foxglove.websocket.v1";

fn python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let packages = ["websockets==15.0.1", "pillow", "protobuf", "foxglove-schemas-protobuf==0.4.0"];
    let check = "import PIL, foxglove_schemas_protobuf.SceneUpdate_pb2, websockets.sync.client";
    FOUND.get_or_init(|| environment("omnibus-it-foxglove", &packages, check)).clone()
}

/// What the simulator has at one frame.
struct Truth {
    /// Origin and centre of the bounding box of the ego, metres.
    ego: [Vec3; 2],
    actors: usize,
    /// Rays of the lidar that hit something, and the first of these points.
    hits: (usize, [f32; 4]),
    /// Mean colour of the image.
    mean: [f64; 3],
}

/// Runs the decoding client while `pass` lets time pass; returns its lines.
fn received(
    test: &str,
    viewer: &Viewer,
    subprotocol: &str,
    mut pass: impl FnMut(),
) -> Option<Vec<Value>> {
    let python = match python() {
        Ok(python) => python,
        Err(why) => {
            note_skipped(test, &format!("no Python environment: {why}"));
            return None;
        }
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/python/foxglove.py");
    let mut command = Command::new(python);
    command.args([script, &format!("ws://{}/foxglove", viewer.host()), subprotocol, "4"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let reader = thread(move || child.wait_with_output().unwrap());
    while !reader.is_finished() {
        pass();
    }
    let output = reader.join().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}\n{said}", String::from_utf8_lossy(&output.stderr));
    Some(said.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn assert_near(shown: &Value, expected: Vec3, tolerance: f64) {
    let expected = expected.as_dvec3().to_array();
    for (shown, expected) in numbers(shown).into_iter().zip(expected) {
        assert!((shown - expected).abs() <= tolerance, "{shown} is not {expected}");
    }
}

#[test]
fn foxglove_s_own_schemas_read_what_the_simulator_has() {
    let test = "foxglove_s_own_schemas_read_what_the_simulator_has";
    let sim = Sim::start(&["--device", "cpu"]);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    let ego = client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    client.tick().unwrap();
    let blueprint = client.blueprints()[client.world().actor(ego).unwrap().blueprint()].clone();
    let [center, half] = [blueprint.center_m, blueprint.half_extents_m].map(Vec3::from_array);
    // The sensors that the documentation promises, as this client's own.
    let roof = center + Vec3::Z * half.z;
    let at = |x, z| Pose::new(roof + Vec3::new(x, 0.0, z), Quat::IDENTITY);
    let fov_rad = std::f32::consts::FRAC_PI_2;
    let camera = Sensor::camera("camera", at(0.5 * half.x, 0.1), 640, 360, fov_rad);
    let elevations = [-30.0f32, 10.0].map(f32::to_radians);
    let lidar = Sensor::lidar("lidar", at(0.0, 0.4), LidarOptions::new(32, 720, elevations, 100.0));
    let sensors = [camera.outputs(CameraOutputs::COLOR), lidar];
    let mut bundle = client.create_bundle("own", ego, sensors, 2).unwrap();
    let viewer = Viewer::start(&sim);
    for subprotocol in [SDK, OLDER] {
        let mut truths = BTreeMap::new();
        let lines = received(test, &viewer, subprotocol, || {
            let frame = client.tick().unwrap();
            let measured = bundle.receive_at(frame).unwrap().unwrap();
            let actor = client.world().actor(ego).unwrap();
            let origin = actor.position();
            let hits = measured.points(1).unwrap().iter().filter(|p| p[..3] != [0.0; 3]);
            let color = measured.color(0).unwrap();
            let mean = [0, 1, 2].map(|channel| {
                let sum: f64 = color.iter().map(|pixel| f64::from(pixel[channel])).sum();
                sum / color.len() as f64
            });
            let truth = Truth {
                ego: [origin, origin + actor.pose().rotation() * center],
                actors: client.world().actors().len(),
                hits: (hits.clone().count(), *hits.clone().next().unwrap()),
                mean,
            };
            truths.insert(client.world().sim_time().as_nanos() as u64, truth);
            // So that time passes for the ego too.
            let control = client_lib::VehicleControl {
                actor_id: ego,
                throttle: 0.4,
                brake: 0.0,
                steer: 0.0,
                handbrake: false,
                reverse: false,
                gear: None,
            };
            client.control(&[control]).unwrap();
        });
        let Some(lines) = lines else { return };
        let mut compared = BTreeMap::<String, usize>::new();
        for line in &lines {
            let (topic, facts) = (line["topic"].as_str().unwrap(), &line["facts"]);
            if topic == "status" {
                // This client decodes while frames pass as fast as they can.
                assert_eq!(facts["id"], "dropped", "{line}");
                continue;
            }
            let Some(truth) = truths.get(&line["time"].as_u64().unwrap()) else {
                // The world as it was before this client ticked.
                continue;
            };
            *compared.entry(topic.to_owned()).or_default() += 1;
            match topic {
                "/tf" => {
                    let edges = &facts["edges"];
                    for space in ["ego".to_owned(), format!("actor/{}", ego.0)] {
                        assert_eq!(edges[&space][0], "world", "{edges}");
                        assert_near(&edges[&space][1], truth.ego[0], 1e-4);
                    }
                    let at = [("front", 0.5 * half.x, 0.1), ("lidar", 0.0, 0.4)];
                    for (space, x, z) in at {
                        assert_eq!(edges[space][0], "ego");
                        assert_near(&edges[space][1], roof + Vec3::new(x, 0.0, z), 1e-5);
                    }
                    assert_eq!(edges["front_optical"][1], edges["front"][1]);
                }
                "/actors" => {
                    assert_eq!(facts["entities"], truth.actors);
                    let shown = &facts["boxes"][ego.0.to_string()];
                    assert_near(&shown[0], truth.ego[1], 1e-4);
                    assert_near(&shown[1], 2.0 * half, 1e-5);
                }
                "/ego/pose" => assert_near(&facts["position"], truth.ego[0], 1e-4),
                "/front/image" => {
                    assert_eq!(
                        (&facts["size"], &facts["space"]),
                        (&json!([640, 360]), &json!("front_optical"))
                    );
                    for (shown, expected) in numbers(&facts["mean"]).into_iter().zip(truth.mean) {
                        assert!((shown - expected).abs() < 1.0, "{facts} {:?}", truth.mean);
                    }
                }
                "/front/calibration" => {
                    assert_eq!(facts["size"], json!([640, 360]));
                    let k = numbers(&facts["k"]);
                    let expected = [320.0, 0.0, 319.5, 0.0, 320.0, 179.5, 0.0, 0.0, 1.0];
                    for (shown, expected) in k.iter().zip(expected) {
                        assert!((shown - expected).abs() < 1e-3, "{k:?}");
                    }
                }
                "/lidar/points" => {
                    assert_eq!(
                        (&facts["points"], &facts["space"]),
                        (&json!(truth.hits.0), &json!("lidar"))
                    );
                    let first = truth.hits.1.map(f64::from);
                    for (shown, expected) in numbers(&facts["first"]).into_iter().zip(first) {
                        assert!((shown - expected).abs() < 1e-6, "{facts} {first:?}");
                    }
                }
                "/map" => assert!(facts["lines"].as_u64() > Some(20), "{facts}"),
                "/stages" => assert!(facts["host"]["physics_ms"].as_f64() > Some(0.0), "{facts}"),
                other => panic!("unknown topic {other}"),
            }
        }
        for topic in [
            "/tf",
            "/actors",
            "/ego/pose",
            "/front/image",
            "/front/calibration",
            "/lidar/points",
            "/stages",
        ] {
            assert!(compared.get(topic) > Some(&2), "{topic}: {compared:?}");
        }
    }
    drop((client, bundle));
    viewer.end();
    sim.end();
}

#[test]
fn a_recording_that_a_page_plays_is_sent_to_foxglove() {
    let scratch = Scratch::new();
    let viewer = Viewer::of(&[&recorded(&scratch, "state"), "--device", "cpu"]);
    let mut page = viewer.page();
    let test = "a_recording_that_a_page_plays_is_sent_to_foxglove";
    let lines = received(test, &viewer, SDK, || {
        page.done(&json!({"type": "play"}));
    });
    for line in lines.iter().flatten().filter(|line| line["topic"] == "/actors") {
        // Between two parts there may be none.
        assert!(line["facts"]["boxes"].as_object().unwrap().len() <= 6 + 40, "{line}");
    }
    drop(page);
    viewer.end();
}

/// A client that sends and reads as it is told.
struct Socket(WebSocket<TcpStream>);

impl Socket {
    fn open(viewer: &Viewer, headers: &[(&'static str, &str)]) -> Result<Socket, String> {
        let url = format!("ws://{}/foxglove", viewer.host());
        let mut request = url.into_client_request().unwrap();
        for (name, value) in headers {
            request.headers_mut().insert(*name, HeaderValue::from_str(value).unwrap());
        }
        let stream = TcpStream::connect(viewer.host()).unwrap();
        let opened = tungstenite::client(request, stream);
        opened.map(|(socket, _)| Socket(socket)).map_err(|e| e.to_string())
    }

    fn of(viewer: &Viewer) -> Socket {
        Socket::open(viewer, &[("Sec-WebSocket-Protocol", SDK)]).unwrap()
    }

    fn send(&mut self, message: Message) {
        self.0.send(message).unwrap();
    }

    /// Subscribes to each channel under its own number.
    fn subscribe(&mut self, channels: &[u32]) {
        let list: Vec<Value> =
            channels.iter().map(|id| json!({"id": id, "channelId": id})).collect();
        self.send(Message::text(json!({"op": "subscribe", "subscriptions": list}).to_string()));
    }

    /// Receives until a text has this operation, and returns it and how many bytes came before.
    fn until(&mut self, op: &str) -> (Value, u64) {
        let mut bytes = 0;
        loop {
            match self.0.read().unwrap() {
                Message::Text(text) => {
                    let text: Value = serde_json::from_str(&text).unwrap();
                    if text["op"] == op {
                        return (text, bytes);
                    }
                }
                Message::Binary(data) => bytes += data.len() as u64,
                other => assert!(!other.is_close(), "the socket was closed"),
            }
        }
    }

    /// Receives until a message of a channel, which is the number of its subscription too.
    fn message_of(&mut self, channel: u32) -> Vec<u8> {
        loop {
            if let Message::Binary(data) = self.0.read().unwrap()
                && data[0] == 1
                && data[1..5] == channel.to_le_bytes()
            {
                return data[13..].to_vec();
            }
        }
    }
}

const TRANSFORMS: u32 = 1;
const IMAGE: u32 = 5;
const POINTS: u32 = 7;

#[test]
fn wrong_messages_of_a_foxglove_client_have_one_status_each() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let why = Socket::open(&viewer, &[]).err().unwrap();
    assert!(why.contains("400"), "{why}");
    let headers = [("Sec-WebSocket-Protocol", "chat, foxglove.websocket.v1")];
    assert!(Socket::open(&viewer, &headers).is_ok());
    for (origin, is_served) in [
        ("https://app.foxglove.dev", true),
        ("file://", true),
        ("http://localhost:8080", true),
        ("https://evil.example", false),
        ("null", false),
    ] {
        let opened = Socket::open(&viewer, &[("Sec-WebSocket-Protocol", SDK), ("Origin", origin)]);
        assert_eq!(opened.is_ok(), is_served, "{origin}: {:?}", opened.err());
    }
    eventually("a free place", || Socket::open(&viewer, &headers).is_ok());

    let mut socket = Socket::of(&viewer);
    let advertised = socket.until("advertise").0;
    assert_eq!(advertised["channels"].as_array().unwrap().len(), 8);
    let text = |text: &str| Message::text(text.to_owned());
    for (message, said) in [
        (text("{"), "EOF"),
        (text("[1, 2]"), "wrong request"),
        (text(r#"{"op":"fly"}"#), "unknown variant `fly`"),
        (text(r#"{"op":"getParameters","parameterNames":[]}"#), "unknown variant `getParameters`"),
        (text(r#"{"op":"subscribe","subscriptions":[{"id":1}]}"#), "missing field `channelId`"),
        (
            text(r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}"#),
            "unknown channel 99",
        ),
        (
            text(r#"{"op":"unsubscribe","subscriptionIds":[3, 4, 5]}"#),
            "unknown subscription 3; and 2 more",
        ),
        (Message::binary(vec![1, 0, 0, 0, 0]), "clientPublish"),
        (Message::binary(Vec::new()), "clientPublish"),
    ] {
        socket.send(message.clone());
        let status = socket.until("status").0;
        let why = status["message"].as_str().unwrap();
        assert!(why.contains(said) && !why.contains('\n'), "{message}: {why}");
        assert_eq!(status["level"], 2);
    }
    // There is no vehicle; one that is spawned takes the warning back.
    socket.subscribe(&[TRANSFORMS, IMAGE]);
    let status = socket.until("status").0;
    assert!(status["message"].as_str().unwrap().contains("no vehicle"), "{status}");
    socket.subscribe(&[TRANSFORMS]);
    let status = socket.until("status").0;
    assert!(status["message"].as_str().unwrap().contains("subscription 1 exists"), "{status}");
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    let ticking = ticking(client);
    assert_eq!(socket.until("removeStatus").0["statusIds"], json!(["sensors"]));
    assert!(!socket.message_of(IMAGE).is_empty());
    drop(ticking.end());
    viewer.end();
    sim.end();
}

/// A client that ticks on a thread of its own.
struct Ticking {
    is_over: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<Client>,
}

fn ticking(mut client: Client) -> Ticking {
    let is_over = Arc::new(AtomicBool::new(false));
    let until = Arc::clone(&is_over);
    let thread = thread(move || {
        while !until.load(Ordering::Acquire) {
            client.tick().unwrap();
        }
        client
    });
    Ticking { is_over, thread }
}

impl Ticking {
    fn end(self) -> Client {
        self.is_over.store(true, Ordering::Release);
        self.thread.join().unwrap()
    }
}

/// For how long a client reads nothing: more than the two seconds after which it is stalled.
const UNREAD: Duration = Duration::from_secs(5);
/// By how much the viewer's memory may grow then: four messages of each channel are about 3 MB.
const GROWTH_MAX: u64 = 12 << 20;

#[test]
fn a_foxglove_client_that_reads_nothing_holds_up_no_frame_and_is_told_what_it_missed() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    client.tick().unwrap();
    let mut socket = Socket::of(&viewer);
    socket.subscribe(&[TRANSFORMS, IMAGE, POINTS]);
    let begin = Instant::now();
    let (first, mut requested, mut resident) = (client.frame().0, 0, None);
    while begin.elapsed() < UNREAD {
        client.tick().unwrap();
        requested += 1;
        if begin.elapsed() > UNREAD / 5 {
            resident.get_or_insert_with(|| resident_bytes(viewer.pid()));
        }
    }
    assert_eq!(client.frame().0 - first, requested);
    let grown = resident_bytes(viewer.pid()).saturating_sub(resident.unwrap());
    println!("{requested} frames: {} kB more", grown >> 10);
    assert!(grown < GROWTH_MAX, "{grown} bytes more");
    // Beside it another client is served.
    let mut other = Socket::of(&viewer);
    other.subscribe(&[TRANSFORMS]);
    client.tick().unwrap();
    assert!(!other.message_of(TRANSFORMS).is_empty());
    // It reads again: it is told how many were dropped, and new images come.
    let ticking = ticking(client);
    let (status, bytes) = socket.until("status");
    let why = status["message"].as_str().unwrap();
    assert!(why.contains("messages were dropped") && status["id"] == "dropped", "{status}");
    assert!(bytes > 0);
    for _ in 0..3 {
        assert!(!socket.message_of(IMAGE).is_empty());
    }
    drop((ticking.end(), other, socket));
    viewer.end();
    sim.end();
}

/// Returns how many threads of a process have a name.
fn count_of(pid: u32, name: &str) -> usize {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).unwrap();
    let comm = |task: std::io::Result<std::fs::DirEntry>| {
        std::fs::read_to_string(task.ok()?.path().join("comm")).ok()
    };
    tasks.filter_map(comm).filter(|own| own.trim_end() == name).count()
}

#[test]
fn a_foxglove_client_that_leaves_frees_its_thread_its_files_and_its_sensors() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    let ticking = ticking(client);
    let mut before = None;
    for round in 0..6 {
        let mut socket = Socket::of(&viewer);
        socket.subscribe(&[IMAGE, POINTS]);
        assert!(!socket.message_of(POINTS).is_empty());
        if round % 2 == 0 {
            // Without a farewell, else with one.
            drop(socket);
        } else {
            socket.0.close(None).unwrap();
        }
        eventually("an end of the thread", || count_of(viewer.pid(), "view-foxglove") == 0);
        // The first round opens what stays open.
        let files = || open_files(viewer.pid());
        let most = *before.get_or_insert_with(files);
        eventually("a close of its files", || files() <= most);
    }
    let mut client = ticking.end();
    client.tick().unwrap();
    drop(client);
    viewer.end();
    sim.end();
}

#[test]
fn a_data_set_is_refused_to_foxglove_with_the_command_that_exports_it() {
    let scratch = Scratch::new();
    let viewer = Viewer::of(&[collected(&scratch).to_str().unwrap()]);
    let mut socket = Socket::of(&viewer);
    let status = socket.until("status").0;
    assert!(status["message"].as_str().unwrap().contains("omnibus export"), "{status}");
    assert!(socket.0.read().unwrap().is_close());
    drop(socket);
    viewer.end();
}
