//! `omnibus view`: the page, its WebSocket, and the tick beside pages that read and that do not.
//!
//! The client here speaks HTTP and WebSocket as a browser does. `tests/python/view.py` looks at the page
//! itself, in Chromium; without it that test is skipped.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use client_lib::{ActorKind, Client, Pace};
use rustix::process::Signal;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, client::IntoClientRequest, http::HeaderValue};

use crate::kit::{
    Scratch, Sim, eventually, is_soak, kill, note_skipped, omnibus, resident_bytes, small_map,
    thread,
};

/// The channel of states.
const STATE: u64 = 255;
const IMAGE: u32 = 1;
const POINTS: u32 = 2;
const MAP: u32 = 3;

/// A running `omnibus view`.
pub(crate) struct Viewer {
    child: Child,
    /// `127.0.0.1:PORT`.
    host: String,
}

impl Viewer {
    pub(crate) fn start(sim: &Sim) -> Viewer {
        Viewer::of(&["--name", sim.instance().id()])
    }

    /// Starts the viewer of a recording or a data set.
    pub(crate) fn of(args: &[&str]) -> Viewer {
        let mut command = omnibus();
        command.args(["view", "--port", "0", "--no-open"]).args(args);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut said = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut said).unwrap();
        let Some(host) = said.split("http://").nth(1).and_then(|rest| rest.split('/').next())
        else {
            let mut why = String::new();
            child.stderr.as_mut().unwrap().read_to_string(&mut why).unwrap();
            panic!("{said}{why}");
        };
        Viewer { host: host.to_owned(), child }
    }

    /// Sends one request and returns the whole response.
    fn get(&self, path: &str, headers: &[&str]) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        let headers: String = headers.iter().map(|header| format!("{header}\r\n")).collect();
        write!(stream, "GET {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").unwrap();
        let mut response = String::new();
        stream.read_to_string(&mut response).unwrap();
        response
    }

    fn own_host(&self) -> String {
        format!("Host: {}", self.host)
    }

    /// Opens the WebSocket as a page of `origin` does.
    fn socket(&self, origin: &str) -> Result<WebSocket<TcpStream>, String> {
        let mut request = format!("ws://{}/socket", self.host).into_client_request().unwrap();
        request.headers_mut().insert("Origin", HeaderValue::from_str(origin).unwrap());
        let stream = TcpStream::connect(&self.host).unwrap();
        let opened = tungstenite::client(request, stream).map_err(|e| e.to_string());
        opened.map(|(socket, _)| socket)
    }

    /// Returns `127.0.0.1:PORT`.
    pub(crate) fn host(&self) -> &str {
        &self.host
    }

    /// Returns the id of the process.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn page(&self) -> Page {
        let socket = self.socket(&format!("http://{}", self.host)).unwrap();
        Page { socket, state: Value::Null, newest: (0, Vec::new()) }
    }

    /// Waits for the end and returns whether it was good, and what was said.
    fn wait(mut self) -> (bool, String) {
        let mut said = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut said).unwrap();
        self.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        (self.child.wait().unwrap().success(), said)
    }

    pub(crate) fn end(self) {
        kill(self.child.id(), Signal::INT);
        let (is_good, said) = self.wait();
        assert!(is_good && said.is_empty(), "{said}");
    }
}

/// An open page that acknowledges what it receives.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    /// The newest state.
    state: Value,
    /// Frame and content of the newest image.
    newest: (u64, Vec<u8>),
}

/// What a page receives.
#[derive(Debug)]
enum Received {
    /// A text that is no state, or a state.
    Text(Value),
    /// Kind and content.
    Binary(u32, Vec<u8>),
}

impl Page {
    fn send(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    fn receive(&mut self) -> Received {
        loop {
            match self.socket.read().unwrap() {
                Message::Text(text) => {
                    let text: Value = serde_json::from_str(&text).unwrap();
                    if text["type"] == "state" {
                        self.send(&json!({"type": "ack", "channel": STATE}));
                        self.state = text.clone();
                    }
                    return Received::Text(text);
                }
                Message::Binary(bytes) => {
                    let word = |at| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                    let (kind, channel) = (word(0), word(4));
                    if kind != MAP {
                        self.send(&json!({"type": "ack", "channel": channel}));
                    }
                    let frame = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
                    if kind == IMAGE {
                        self.newest = (frame, bytes[16..].to_vec());
                    }
                    return Received::Binary(kind, bytes[16..].to_vec());
                }
                other => assert!(!other.is_close(), "the socket was closed"),
            }
        }
    }

    /// Receives until a text or a state is as `is_it` says.
    fn text(&mut self, is_it: impl Fn(&Value) -> bool) -> Value {
        loop {
            if let Received::Text(text) = self.receive()
                && is_it(&text)
            {
                return text;
            }
        }
    }

    /// Sends a request and returns the reply.
    fn request(&mut self, message: &Value) -> Value {
        self.send(message);
        let name = message["type"].clone();
        self.text(|text| text["request"] == name)
    }

    /// Sends a request that is carried out; returns the actor that it made.
    pub(crate) fn done(&mut self, message: &Value) -> Value {
        let reply = self.request(message);
        assert_eq!(reply["type"], "done", "{reply}");
        reply["id"].clone()
    }

    /// Returns the frame and the content of the newest image, of this frame or a later one.
    fn image(&mut self, frame: u64) -> (u64, Vec<u8>) {
        self.until(|page| page.newest.0 >= frame);
        self.newest.clone()
    }

    /// Receives until the page is as `is_so` says.
    fn until(&mut self, is_so: impl Fn(&Page) -> bool) {
        while !is_so(self) {
            self.receive();
        }
    }

    /// Returns position and speed of an actor in the newest state.
    fn motion(&self, id: &Value) -> Option<[f64; 3]> {
        let actor = self.state["actors"].as_array()?.iter().find(|actor| actor[0] == *id)?;
        Some([3, 4, 7].map(|at| actor[at].as_f64().unwrap()))
    }
}

/// A camera behind an actor.
fn camera(on: &Value, output: &str) -> Value {
    json!({
        "output": output, "on": on, "position_m": [-6.0, 0.0, 3.0], "yaw_rad": 0.0, "pitch_rad": 0.2,
        "size": [160, 90], "fov_rad": 1.5
    })
}

#[test]
fn a_page_shows_other_images_of_later_frames_and_its_keys_move_the_car() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let page = viewer.get("/", &[&viewer.own_host()]);
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("/view.js"), "{page}");
    for file in page.split("\"/").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        let file = viewer.get(&format!("/{file}"), &[&viewer.own_host()]);
        assert!(file.starts_with("HTTP/1.1 200"), "{file}");
    }
    assert!(viewer.get("/absent", &[&viewer.own_host()]).starts_with("HTTP/1.1 404"));

    let mut other = sim.client("other");
    let fog = client_lib::Weather { fog_density: 33.0, ..client_lib::Weather::default() };
    other.set_weather(fog).unwrap();
    assert_eq!(other.weather().unwrap(), fog);
    drop(other);

    let mut page = viewer.page();
    let hello = page.text(|text| text["type"] == "hello");
    assert_eq!(
        (&hello["source"], &hello["name"]),
        (&json!("simulator"), &json!(sim.instance().id()))
    );
    let Received::Binary(MAP, lanes) = page.receive() else { panic!("no map") };
    assert!(lanes.len() > 10_000, "{}", lanes.len());
    page.until(|page| page.state["weather"]["fog_density"] == 33.0);

    // Nothing ticks: the page does.
    let car =
        page.done(&json!({"type": "spawn", "blueprint": "vehicle.tesla.model3", "ego": true}));
    page.done(&json!({"type": "tiles", "tiles": [camera(&car, "color")]}));
    page.done(&json!({"type": "step"}));
    let (first, image) = page.image(1);
    page.until(|page| page.state["frame"] == first);
    let before = page.motion(&car).unwrap();
    page.send(&json!({"type": "drive", "throttle": 1.0, "brake": 0.0, "steer": 0.0}));
    for _ in 0..40 {
        page.done(&json!({"type": "step"}));
    }
    let (last, other) = page.image(first + 40);
    for jpeg in [&image, &other] {
        assert!(jpeg.starts_with(&[0xff, 0xd8]) && jpeg.ends_with(&[0xff, 0xd9]), "no JPEG");
    }
    assert!(image != other, "the same image");
    page.until(|page| page.state["frame"] == last);
    let after = page.motion(&car).unwrap();
    assert!(after[2] > 2.0, "{after:?} m/s");
    let way = (after[0] - before[0]).hypot(after[1] - before[1]);
    assert!(way > 2.0, "{before:?} to {after:?}");
    let timeline = page.state["timeline"]["parts"].as_array().unwrap();
    for part in ["physics", "plans", "traces"] {
        assert!(timeline.iter().any(|line| line[1] == part), "no {part}: {timeline:?}");
    }

    let weather = json!({"type": "weather", "cloudiness": 90.0, "precipitation": 80.0,
        "precipitation_deposits": 60.0, "wind_intensity": 40.0, "sun_azimuth_rad": 1.0,
        "sun_altitude_rad": 0.2, "fog_density": 30.0, "fog_distance_m": 1.0, "wetness": 50.0});
    page.done(&weather);
    page.until(|page| page.state["weather"]["precipitation"] == 80.0);
    page.done(&json!({"type": "select", "id": car}));
    page.until(|page| page.state["selected"]["vehicle"]["throttle"] == 1.0);
    // The lanes ahead begin at the car and reach further than it can see.
    let ahead = page.state["ahead_m"].clone();
    let at = |point: &Value| [0, 1].map(|axis| point[axis].as_f64().unwrap());
    let now = page.motion(&car).unwrap();
    let distance = |point: &Value| (at(point)[0] - now[0]).hypot(at(point)[1] - now[1]);
    assert!(distance(&ahead[0][0]) < 4.0, "{now:?} {ahead}");
    let farthest = ahead.as_array().unwrap().iter().flat_map(|line| line.as_array().unwrap());
    let farthest = farthest.map(distance).fold(0.0, f64::max);
    assert!((30.0..90.0).contains(&farthest), "{farthest} m: {ahead}");
    for output in ["depth", "tags", "instances"] {
        let before = page.newest.clone();
        page.done(&json!({"type": "tiles", "tiles": [camera(&car, output)]}));
        page.done(&json!({"type": "step"}));
        let image = page.image(before.0 + 1).1;
        assert!(image.starts_with(&[0xff, 0xd8]) && image != before.1, "no image of {output}");
    }
    page.done(&json!({"type": "play"}));
    let at = page.state["frame"].as_u64().unwrap();
    page.until(|page| page.state["frame"].as_u64() > Some(at + 5));
    drop(page);

    // The vehicle that nothing drives any longer, and the tick, are given back.
    let mut client = sim.client("after");
    eventually("a free tick", || client.take_tick().is_ok());
    eventually("an end of the vehicle", || {
        client.tick().unwrap();
        !client.world().actors().iter().any(|actor| actor.kind() == ActorKind::Vehicle)
    });
    drop(client);
    viewer.end();
    sim.end();
}

#[test]
fn a_page_of_another_site_is_refused() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let own = viewer.own_host();
    for headers in [
        &["Host: evil.example"][..],
        &["Host: localhost.evil.example:80"],
        &[&own, "Origin: http://evil.example"],
        &[&own, "Origin: http://localhost:3000"],
        &[&own, "Origin: null"],
    ] {
        for path in ["/", "/view.js", "/socket"] {
            let response = viewer.get(path, headers);
            assert!(response.starts_with("HTTP/1.1 403"), "{headers:?} {path}: {response}");
            assert!(response.contains("is refused"), "{response}");
        }
    }
    let why = viewer.socket("http://evil.example").unwrap_err();
    assert!(why.contains("403"), "{why}");
    assert!(viewer.socket(&format!("http://{}", viewer.host)).is_ok());
    viewer.end();
    sim.end();
}

/// Ticks until a number of frames have passed, and returns how many there were.
fn tick(client: &mut Client, frames: u64) -> u64 {
    let first = client.frame().0;
    for _ in 0..frames {
        client.tick().unwrap();
    }
    client.frame().0 - first
}

#[test]
fn a_page_that_never_reads_neither_holds_up_a_frame_nor_another_page() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut client = sim.ticker();
    let mut stalled = viewer.page();
    let car = {
        stalled.send(&json!({"type": "spawn", "blueprint": "vehicle.tesla.model3", "ego": true}));
        let mut car = None;
        while car.is_none() {
            client.tick().unwrap();
            let actors = client.world().actors();
            car = actors.iter().find(|a| a.kind() == ActorKind::Vehicle).map(|a| a.id().0);
        }
        json!(car)
    };
    let mut large = camera(&car, "color");
    large["size"] = json!([640, 360]);
    stalled.send(&json!({"type": "tiles", "tiles": [large.clone(), large.clone(), large]}));
    // From here on it reads nothing.
    assert_eq!(tick(&mut client, 60), 60);

    let mut reader = viewer.page();
    let is_seen = Arc::new(AtomicBool::new(false));
    let ticking = {
        let is_seen = Arc::clone(&is_seen);
        thread(move || {
            let (first, mut requested) = (client.frame().0, 0);
            while !is_seen.load(Ordering::Acquire) {
                client.tick().unwrap();
                requested += 1;
            }
            assert_eq!(client.frame().0 - first, requested);
            client
        })
    };
    reader.send(&json!({"type": "tiles", "tiles": [camera(&car, "color")]}));
    let mut frames: Vec<u64> = Vec::new();
    while frames.len() < 5 {
        frames.push(reader.image(frames.last().map_or(1, |last| last + 1)).0);
    }
    is_seen.store(true, Ordering::Release);
    let client = ticking.join().unwrap();
    assert!(frames.is_sorted_by(|a, b| a < b), "{frames:?}");
    // What was sent to the page that does not read: two of each channel, not one for each frame.
    stalled.socket.get_ref().set_nonblocking(true).unwrap();
    let mut unread = 0;
    while let Ok(message) = stalled.socket.read() {
        unread += usize::from(message.is_binary());
    }
    assert!((1..=8).contains(&unread), "{unread} messages");
    drop((client, reader, stalled));
    viewer.end();
    sim.end();
}

/// Frames for which a page is open, and by how much the viewer's memory may grow meanwhile: a fraction of
/// what it would keep if it kept each image of about 6 kB.
const OPEN_FRAMES: u64 = 2100;
const OPEN_FRAMES_SOAK: u64 = 100_000;
const GROWTH_MAX: u64 = 6 << 20;

#[test]
fn the_viewer_s_memory_does_not_grow_while_a_page_is_open() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut page = viewer.page();
    let car =
        page.done(&json!({"type": "spawn", "blueprint": "vehicle.tesla.model3", "ego": true}));
    page.done(&json!({"type": "tiles", "tiles": [camera(&car, "color")]}));
    // Another page is open and reads nothing.
    let mut stalled = viewer.page();
    stalled.done(&json!({"type": "tiles", "tiles": [camera(&car, "color")]}));
    let mut bytes = 0;
    let mut show = |page: &mut Page, frames: u64| {
        for _ in 0..frames {
            page.done(&json!({"type": "step"}));
            bytes += page.newest.1.len() as u64;
        }
        resident_bytes(viewer.child.id())
    };
    let begin = show(&mut page, OPEN_FRAMES / 3);
    let frames = if is_soak() { OPEN_FRAMES_SOAK } else { OPEN_FRAMES };
    let grown = show(&mut page, frames).saturating_sub(begin);
    println!("{frames} frames, {} MB of images: {} kB more", bytes >> 20, grown >> 10);
    assert!(bytes > 2 * GROWTH_MAX, "only {bytes} bytes of images");
    assert!(grown < GROWTH_MAX, "{grown} bytes more than {begin} after {frames} frames");
    drop((page, stalled));
    viewer.end();
    sim.end();
}

#[test]
fn a_page_stops_the_world_s_own_clock_and_lets_it_run_on() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut other = sim.client("other");
    crate::kit::run_asynchronously(&mut other);
    let pace = other.settings().pace;
    let mut page = viewer.page();
    page.done(&json!({"type": "pause"}));
    page.until(|page| page.state["holds_tick"] == true && page.state["pace"] == "synchronous");
    let stands = sim.frame();
    page.done(&json!({"type": "step"}));
    assert_eq!(sim.frame(), stands + 1);
    page.done(&json!({"type": "play"}));
    page.until(|page| page.state["frame"].as_u64() > Some(stands + 5));
    assert_eq!(other.settings().pace, pace);

    // A page that is closed does not leave the world standing.
    page.done(&json!({"type": "pause"}));
    drop(page);
    eventually("the world's own clock", || other.settings().pace == pace);

    // Another client holds the tick: one clear message.
    let mut ticker = sim.ticker();
    let mut page = viewer.page();
    for what in ["pause", "step", "play"] {
        let reply = page.request(&json!({"type": what}));
        let why = reply["message"].as_str().unwrap();
        assert!(why.contains("client \"ticker\" holds the tick"), "{reply}");
    }
    assert_eq!(tick(&mut ticker, 5), 5);
    assert_eq!(ticker.settings().pace, Pace::Synchronous);
    drop((other, ticker, page));
    viewer.end();
    sim.end();
}

/// Records a few vehicles for three seconds.
pub(crate) fn recorded(scratch: &Scratch, profile: &str) -> String {
    let file = scratch.path().join(format!("{profile}.mcap")).to_str().unwrap().to_owned();
    let args =
        ["record", "--map", small_map(), "--vehicles", "6", "--frames", "60", "--out", &file];
    let output = omnibus().args(args).args(["--profile", profile]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    file
}

/// Ids of the recorded vehicles with x, y and speed, by frame of 0.05 s.
fn vehicles_of(file: &str) -> Vec<Vec<(u32, [f32; 3])>> {
    let mut recording = record::Recording::open(Path::new(file)).unwrap();
    let mut frames = Vec::new();
    for segment in 0..recording.segments() {
        for frame in recording.recorded_frames(segment).unwrap() {
            let vehicles =
                frame.actors.iter().filter(|actor| actor.kind == protocol::kind::VEHICLE);
            let line = |actor: &protocol::ActorState| {
                let ([x, y, _], v) = (actor.pose.position_m, actor.velocity_mps);
                (actor.actor_id.0, [x, y, v.map(|v| v * v).iter().sum::<f32>().sqrt()])
            };
            frames.push(vehicles.map(line).collect());
        }
    }
    frames
}

#[test]
fn a_recording_is_shown_where_the_page_wants_it() {
    let scratch = Scratch::new();
    let file = recorded(&scratch, "state");
    let frames = vehicles_of(&file);
    assert!(frames.len() == 60 && frames[59].len() == 6, "{} frames", frames.len());
    let viewer = Viewer::of(&[&file, "--device", "cpu"]);
    let mut page = viewer.page();
    let hello = page.text(|text| text["type"] == "hello");
    assert_eq!((&hello["source"], &hello["name"]), (&json!("recording"), &json!("state.mcap")));
    assert_eq!(hello["map"], "hamlet");
    let shows = |page: &mut Page, index: usize| {
        let at = index as f64 * 0.05;
        page.until(|page| {
            (page.state["playback"]["at"].as_f64().unwrap_or(-1.0) - at).abs() < 1e-6
        });
        assert_eq!(page.state["playback"]["last"], 59.0 * 0.05);
        for (id, recorded) in &frames[index] {
            let shown = page.motion(&json!(id)).unwrap_or_else(|| panic!("no actor {id}"));
            for (shown, recorded) in shown.iter().zip(recorded) {
                assert!((shown - f64::from(*recorded)).abs() < 0.006, "{index} {id}: {shown}");
            }
        }
    };
    // The first recorded frame spawns the actors.
    shows(&mut page, 1);
    let (car, _) = frames[0][0];
    page.done(&json!({"type": "tiles", "tiles": [camera(&json!(car), "color")]}));
    // Time stands, and the image comes nevertheless.
    let mut before = page.image(1).1;
    for index in [50, 10, 31] {
        page.done(&json!({"type": "seek", "to": index as f64 * 0.05}));
        shows(&mut page, index);
        for next in [0, 1] {
            shows(&mut page, index + next);
            let frame = page.state["frame"].as_u64().unwrap();
            let image = page.image(frame).1;
            assert!(image != before, "the image at {index} is the one before");
            before = image;
            if next == 0 {
                page.done(&json!({"type": "step"}));
            }
        }
    }
    page.done(&json!({"type": "seek", "to": 1e9}));
    shows(&mut page, 59);
    let reply = page.request(&json!({"type": "step"}));
    assert!(reply["message"].as_str().unwrap().contains("the last frame"), "{reply}");
    // From the end it plays the whole recording, and stops there; another page shows that too.
    let mut other = viewer.page();
    page.done(&json!({"type": "play"}));
    other.until(|page| page.state["plays"] == true && page.state["playback"]["at"] != 2.95);
    shows(&mut page, 59);
    page.until(|page| page.state["plays"] == false);
    shows(&mut page, 59);
    drop((page, other));
    viewer.end();
}

/// Collects two scenes of three frames.
pub(crate) fn collected(scratch: &Scratch) -> PathBuf {
    let dir = scratch.path().join("scenes");
    for (scene, seed) in [("scene-0000", "1"), ("scene-0001", "2")] {
        let output = omnibus()
            .args(["collect", "--map", small_map(), "--device", "cpu", "--frames", "3"])
            .args(["--vehicles", "4", "--seed", seed, "--out", dir.join(scene).to_str().unwrap()])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    dir
}

/// Reads a JSON file of a data set.
fn json_of(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_data_set_is_shown_from_its_files() {
    let scratch = Scratch::new();
    let dir = collected(&scratch);
    let viewer = Viewer::of(&[dir.to_str().unwrap()]);
    let mut page = viewer.page();
    let mut scenes = Vec::new();
    for (scene, index) in [("scene-0000", 0), ("scene-0001", 4), ("scene-0000", 2)] {
        page.send(&json!({"type": "seek", "to": index}));
        let hello = page.text(|text| text["type"] == "hello" && text["name"] == scene);
        assert_eq!(hello["source"], "data_set");
        scenes.push(hello["sensors"].clone());
        let folder = dir.join(scene);
        let lines = std::fs::read_to_string(folder.join("frames.jsonl")).unwrap();
        let lines: Vec<Value> =
            lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let line = &lines[index % 3];
        let frame = line["frame"].as_u64().unwrap();
        let path = page.text(|text| text["type"] == "path");
        assert_eq!(path["points_m"].as_array().unwrap().len(), 3);
        let [at, ego] =
            [&path["points_m"][index % 3], &line["ego"]["world_from_vehicle"]["position_m"]];
        assert_eq!((&at[0], &at[1]), (&ego[0], &ego[1]));

        page.until(|page| page.state["frame"] == frame);
        let state = page.state.clone();
        assert_eq!(state["weather"], line["weather"]);
        let boxes = json_of(&folder.join(format!("boxes/{frame:06}.json")));
        let actors = boxes["actors"].as_array().unwrap();
        assert!(state["actors"].as_array().unwrap().len() > actors.len(), "the ego is one more");
        for actor in actors {
            let shown = page.motion(&actor["actor_id"]).unwrap();
            for (axis, shown) in shown[..2].iter().enumerate() {
                let stored = actor["world_from_box"]["position_m"][axis].as_f64().unwrap();
                assert!((shown - stored).abs() < 0.006, "{actor}");
            }
        }

        // The colour image is the file, its boxes are those of the camera, the points are the returns.
        page.newest = (0, Vec::new());
        let tiles =
            json!([{"sensor": "front", "output": "color"}, {"sensor": "lidar", "output": "lidar"}]);
        page.send(&json!({"type": "sensors", "tiles": tiles}));
        let shown = page.text(|text| text["type"] == "boxes" && text["channel"] == 0);
        let seen = |list: &str| {
            let list = boxes[list].as_array().unwrap().iter();
            list.filter(|seen| seen["cameras"]["front"].is_object()).count()
        };
        assert_eq!(shown["boxes"].as_array().unwrap().len(), seen("actors") + seen("objects"));
        let (of, image) = page.image(frame);
        let file = std::fs::read(folder.join(format!("front/color/{frame:06}.png"))).unwrap();
        assert!(of == frame && image == file, "another image");
        let points = loop {
            if let Received::Binary(POINTS, points) = page.receive() {
                break points;
            }
        };
        assert_eq!(Some(points.len() as u64 / 8), line["point_counts"]["lidar"].as_u64());
        for output in ["depth", "tags", "instances"] {
            let tiles = json!([{"sensor": "front", "output": output}]);
            page.newest = (0, Vec::new());
            page.done(&json!({"type": "sensors", "tiles": tiles}));
            assert!(page.image(frame).1.starts_with(&[0xff, 0xd8]), "no image of {output}");
        }
    }
    assert!(scenes[0] == scenes[1] && scenes[0][0][0] == "front", "{}", scenes[0]);

    page.done(&json!({"type": "play"}));
    page.until(|page| page.state["playback"]["at"] == 5.0 && page.state["plays"] == false);
    for (request, said) in [
        (json!({"type": "step"}), "the last frame"),
        (json!({"type": "spawn", "blueprint": "vehicle.tesla.model3"}), "no simulator"),
    ] {
        let reply = page.request(&request);
        assert!(reply["message"].as_str().unwrap().contains(said), "{reply}");
    }
    // What a tile names and the scene lacks, and what was damaged since, is said once.
    for (tile, said) in [
        (json!({"sensor": "rear", "output": "color"}), "no sensor \"rear\""),
        (json!({"sensor": "front", "output": "lidar"}), "no output \"lidar\""),
    ] {
        page.send(&json!({"type": "sensors", "tiles": [tile]}));
        let error = page.text(|text| text["type"] == "error");
        assert!(error["message"].as_str().unwrap().contains(said), "{error}");
    }
    std::fs::write(dir.join("scene-0000/boxes").join(first_file(&dir)), "damaged").unwrap();
    let reply = page.request(&json!({"type": "seek", "to": 0}));
    assert!(reply["message"].as_str().unwrap().contains("boxes/"), "{reply}");
    drop(page);
    viewer.end();
}

/// Returns the name of the file of boxes of the first frame.
fn first_file(dir: &Path) -> String {
    let files = std::fs::read_dir(dir.join("scene-0000/boxes")).unwrap();
    files.map(|file| file.unwrap().file_name().into_string().unwrap()).min().unwrap()
}

#[test]
fn what_is_neither_a_recording_with_states_nor_a_data_set_has_one_error() {
    let scratch = Scratch::new();
    let inputs = recorded(&scratch, "inputs");
    let text = scratch.path().join("text.mcap");
    std::fs::write(&text, "no recording").unwrap();
    let missing = scratch.path().join("missing.mcap");
    for (file, said) in [
        (inputs.as_str(), "keeps no states to show"),
        (text.to_str().unwrap(), "text.mcap"),
        (missing.to_str().unwrap(), "missing.mcap"),
        (scratch.path().to_str().unwrap(), "is it a data set"),
    ] {
        let output = omnibus().args(["view", "--no-open", "--port", "0", file]).output().unwrap();
        let why = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), why.lines().count()), (Some(1), 1), "{why}");
        assert!(why.contains(said), "{why}");
    }
}

#[test]
fn wrong_requests_have_one_error_and_the_end_of_the_simulator_is_said() {
    let mut sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut page = viewer.page();
    let mut tile = camera(&json!(99), "color");
    for (request, said) in [
        (json!({"type": "fly"}), "unknown variant `fly`"),
        (json!({"type": "drive", "throttle": 1}), "missing field `brake`"),
        (json!({"type": "drive", "throttle": 1, "brake": 0, "steer": 0}), "spawn one"),
        (json!({"type": "spawn", "blueprint": "vehicle.none"}), "vehicle.none"),
        (json!({"type": "destroy", "id": 4_000_000}), "4000000"),
        (json!({"type": "seek", "to": 1.0}), "no other part"),
        (json!({"type": "tiles", "tiles": [tile.clone()]}), "99"),
        (json!({"type": "tiles", "tiles": vec![tile.clone(); 9]}), "at most 8"),
        (
            {
                tile["size"] = json!([0, 9]);
                json!({"type": "tiles", "tiles": [tile]})
            },
            "0 by 9",
        ),
    ] {
        page.send(&request);
        let error = page.text(|text| text["type"] == "error");
        let why = error["message"].as_str().unwrap();
        assert!(why.contains(said) && !why.contains('\n'), "{request}: {why}");
    }
    let pages: Vec<Page> = (0..3).map(|_| viewer.page()).collect();
    let why = viewer.socket(&format!("http://{}", viewer.host)).unwrap_err();
    assert!(why.contains("503"), "{why}");
    drop(pages);
    kill(sim.host_pid(), Signal::INT);
    let (status, log) = sim.wait();
    assert!(status.success(), "{log}");
    let ended = page.text(|text| text["type"] == "ended");
    assert!(ended["message"].as_str().unwrap().contains("the host has ended"), "{ended}");
    let (is_good, said) = viewer.wait();
    assert!(is_good && said.contains("has ended"), "{said}");
    // Clients of the closed pages may have left during the end of the host, each with its own files.
    assert_eq!(sim.shared_memory(), []);
}

#[test]
fn wrong_arguments_of_the_viewer_have_one_error() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let port = viewer.host.rsplit(':').next().unwrap();
    let name = sim.instance().id();
    for (args, said) in [
        (&["--name", "nowhere"][..], "nowhere"),
        (&["--name", name, "--port", port], "Address already in use"),
    ] {
        let output = omnibus().args(["view", "--no-open"]).args(args).output().unwrap();
        let why = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), why.lines().count()), (Some(1), 1), "{why}");
        assert!(why.contains(said), "{why}");
    }
    viewer.end();
    sim.end();
}

/// The names of Chromium's program.
const CHROMIUM: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

#[test]
fn the_page_works_in_chromium() {
    let sim = Sim::start(&[]);
    run_in_real_time(&sim);
    look("the_page_works_in_chromium", "simulator", Viewer::start(&sim));
    sim.end();
}

#[test]
fn a_recording_and_a_data_set_work_in_chromium() {
    let test = "a_recording_and_a_data_set_work_in_chromium";
    let scratch = Scratch::new();
    let file = recorded(&scratch, "state");
    look(test, "recording", Viewer::of(&[&file, "--device", "cpu"]));
    look(test, "data_set", Viewer::of(&[collected(&scratch).to_str().unwrap()]));
}

/// Opens the page in Chromium and does what `tests/python/view.py` does there.
fn look(test: &str, source: &str, viewer: Viewer) {
    let runs = |name: &&&str| Command::new(name).arg("--version").output().is_ok();
    let Some(chromium) = CHROMIUM.iter().find(runs) else {
        viewer.end();
        return note_skipped(test, "chromium is not installed");
    };
    let scratch = Scratch::new();
    let picture = scratch.path().join("page.png");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/python/view.py");
    let url = format!("http://{}/", viewer.host);
    let mut command = Command::new("python3");
    let command = command.args([script, chromium, &url]).arg(&picture).arg(source);
    match command.output() {
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            assert_eq!(said, "seen\n", "{}", String::from_utf8_lossy(&output.stderr));
            assert!(Path::new(&picture).metadata().unwrap().len() > 20_000);
        }
        Err(e) => note_skipped(test, &format!("python3 is not there: {e}")),
    }
    viewer.end();
}

#[test]
fn measurements_that_arrive_while_the_viewer_stands_still_are_no_error() {
    let sim = Sim::start(&[]);
    let viewer = Viewer::start(&sim);
    let mut page = viewer.page();
    let car =
        page.done(&json!({"type": "spawn", "blueprint": "vehicle.tesla.model3", "ego": true}));
    page.done(&json!({"type": "tiles", "tiles": [camera(&car, "color")]}));
    run_in_real_time(&sim);
    let await_image = |page: &mut Page, frames: u64| {
        let frame = page.newest.0 + frames;
        while page.newest.0 < frame {
            if let Received::Text(text) = page.receive() {
                assert_ne!(text["type"], "error", "{text}");
            }
        }
    };
    for _ in 0..10 {
        await_image(&mut page, 2);
        let mut client = sim.client("watch");
        kill(viewer.child.id(), Signal::STOP);
        for _ in 0..4 {
            client.await_frame().unwrap();
        }
        kill(viewer.child.id(), Signal::CONT);
    }
    await_image(&mut page, 5);
    viewer.end();
}

fn run_in_real_time(sim: &Sim) {
    let mut client = sim.client("pace");
    let settings = client.settings().with_pace(Pace::RealTime(1.0));
    client.apply_settings(settings).unwrap();
}
