//! Every sensor shows exactly its frame, judged by the measured values and not by the header.

use bus::Role;
use client_lib::{
    Client, Frame, Measurement, Pose, SensorBundle, Spawn,
    wire::{SensorSpec, Settings, camera, lidar},
};
use glam::{Quat, Vec2, Vec3};
use mesh::WordHash;
use protocol::{ActorId, Command, Teleport, output};
use rustix::process::Signal;

use crate::kit::{DELTA_NANOS, Sim, is_soak, kill};

/// High above every roof, where only the marker is in view.
const MIDDLE: Vec3 = Vec3::new(0.0, 0.0, 150.0);
const RANGE_M: f32 = 60.0;
const CAMERAS: usize = 4;
const MARKER: &str = "static.prop.container";

/// Four cameras that look inwards from the corners of a square, and a lidar beside its centre.
fn sensors() -> Vec<SensorSpec> {
    let mut all = Vec::new();
    for index in 0..CAMERAS {
        let turn = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2 * index as f32 + 0.3);
        let at = MIDDLE - turn * Vec3::X * 25.0 + Vec3::Z * index as f32;
        let outputs = output::DEPTH | output::TAG | output::INSTANCE;
        all.push(camera(&format!("c{index}"), Pose::new(at, turn), 320, 240, 1.4, outputs));
    }
    let beside = Pose::new(MIDDLE + Vec3::new(1.0, -14.0, 0.5), Quat::from_rotation_z(0.7));
    all.push(lidar("lidar", beside, 16, 720, [-0.2, 0.2], RANGE_M));
    all
}

/// Pose of the marker at a frame: it moves by about a metre and some degrees per frame.
fn place(frame: u64) -> Pose {
    let phase = frame as f32 * 0.13;
    let at = MIDDLE + Vec3::new(7.0 * phase.sin(), 7.0 * (1.7 * phase).cos(), (0.9 * phase).sin());
    Pose::new(at, Quat::from_rotation_z(0.9 * phase))
}

/// How far rounding may move an outline: a tenth of the promised accuracy.
const SLACK_PX: f32 = 0.05;

/// Where a pixel is probed: at its centre, and around it.
const PROBES: [Vec2; 5] = [
    Vec2::ZERO,
    Vec2::new(SLACK_PX, 0.0),
    Vec2::new(-SLACK_PX, 0.0),
    Vec2::new(0.0, SLACK_PX),
    Vec2::new(0.0, -SLACK_PX),
];

/// Returns the probes of each pixel that the marker covers, a bit each, and its least depth, by the
/// pinhole formula alone.
fn projected(spec: &SensorSpec, pose: &Pose) -> (Vec<u8>, f32) {
    let (_, blueprint) = town::blueprint(MARKER).unwrap();
    let [width, height] = [spec.width as f32, spec.height as f32];
    let focal = width * 0.5 / (spec.fov_rad * 0.5).tan();
    let sensor_from_marker = spec.parent_from_sensor.affine().inverse() * pose.affine();
    let mut near = f32::MAX;
    let mut pixels = Vec::new();
    for position in &blueprint.mesh().positions {
        let p = sensor_from_marker.transform_point3(Vec3::from_array(*position));
        pixels.push(Vec2::new(width * 0.5 - p.y / p.x * focal, height * 0.5 - p.z / p.x * focal));
        near = near.min(p.x);
    }
    let mut covered = vec![0; (spec.width * spec.height) as usize];
    for triangle in &blueprint.mesh().triangles {
        let [a, b, c] = triangle.map(|corner| pixels[corner as usize]);
        let low = a.min(b).min(c).max(Vec2::ZERO).floor();
        let high = a.max(b).max(c).min(Vec2::new(width, height)).ceil();
        for v in low.y as usize..high.y as usize {
            for u in low.x as usize..high.x as usize {
                let pixel = &mut covered[v * spec.width as usize + u];
                for (bit, probe) in PROBES.iter().enumerate() {
                    let at = Vec2::new(u as f32 + 0.5, v as f32 + 0.5) + probe;
                    let side = |from: Vec2, to: Vec2| (to - from).perp_dot(at - from);
                    let sides = [side(a, b), side(b, c), side(c, a)];
                    let is_in = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
                    *pixel |= u8::from(is_in) << bit;
                }
            }
        }
    }
    (covered, near)
}

/// Returns the distance from a point to the nearest triangle.
fn distance(mesh: &mesh::Mesh, point: Vec3) -> f32 {
    let corners = |triangle: &[u32; 3]| {
        triangle.map(|corner| Vec3::from_array(mesh.positions[corner as usize]))
    };
    let nearest = mesh.triangles.iter().map(corners).map(|[a, b, c]| {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let is_within = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| (to - from).cross(point - from).dot(normal) >= 0.0);
        if is_within {
            return normal.dot(point - a).abs();
        }
        let to_edge = |from: Vec3, to: Vec3| {
            let along = (point - from).dot(to - from) / (to - from).length_squared().max(1e-12);
            (from + (to - from) * along.clamp(0.0, 1.0)).distance(point)
        };
        to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
    });
    nearest.fold(f32::MAX, f32::min)
}

/// Returns what is wrong with a measurement if the marker was at `pose`.
fn disagreement(measured: &Measurement, marker: ActorId, pose: &Pose) -> Option<String> {
    let specs = sensors();
    for (index, spec) in specs.iter().enumerate().take(CAMERAS) {
        let ids = measured.instances(index)?;
        let depths = measured.depth(index)?;
        let (covered, due_near) = projected(spec, pose);
        let mut near = f32::MAX;
        let mut wrong = 0;
        for ((id, depth), covered) in ids.iter().zip(depths).zip(&covered) {
            let is_seen = *id == marker.0;
            wrong += u32::from(is_seen && *covered == 0 || !is_seen && *covered == 0b11111);
            if is_seen {
                near = near.min(*depth);
            }
        }
        if wrong > 0 {
            return Some(format!(
                "camera {index}: {wrong} pixels on the wrong side of its outline"
            ));
        }
        // The nearest pixel lies on the marker, within the size of a pixel there.
        if !(-1e-3..=0.25).contains(&(near - due_near)) {
            return Some(format!("camera {index}: nearest {near} m, due {due_near} m"));
        }
    }
    let lidar = &specs[CAMERAS];
    let world_from_sensor = lidar.parent_from_sensor.affine();
    let marker_from_world = pose.affine().inverse();
    let (_, blueprint) = town::blueprint(MARKER)?;
    let mut returns = 0;
    for (point, label) in measured.points(CAMERAS)?.iter().zip(measured.labels(CAMERAS)?) {
        if label[0] == marker.0 {
            let [x, y, z, _] = *point;
            let local = marker_from_world
                .transform_point3(world_from_sensor.transform_point3(Vec3::new(x, y, z)));
            let off_m = distance(blueprint.mesh(), local);
            if off_m > 0.02 {
                return Some(format!("a return lies {off_m} m off the marker"));
            }
            returns += 1;
        }
    }
    (returns == 0).then(|| "the lidar met nothing".to_owned())
}

struct Stage {
    client: Client,
    bundle: SensorBundle,
    marker: ActorId,
}

impl Stage {
    fn set(sim: &Sim, pipeline: u32) -> Stage {
        let mut client = sim.ticker();
        let settings = Settings { pipeline, ..client.wire_settings() };
        client.apply_wire_settings(settings).unwrap();
        let marker = client.spawn(Spawn::new(MARKER, place(0)).kinematic()).unwrap();
        let bundle = client.create_bundle("square", ActorId::NONE, sensors(), 4).unwrap();
        Stage { client, bundle, marker }
    }

    fn tick(&mut self) -> Frame {
        let next = Frame(self.client.frame().0 + 1);
        let teleport = Teleport { actor_id: self.marker, pose: place(next.0) };
        self.client.send(&[Command::Teleport(teleport)]).unwrap();
        let frame = self.client.tick().unwrap();
        assert_eq!(frame, next, "no frame was left out");
        let stands = self.client.world().state(self.marker).unwrap().pose;
        let due = place(frame.0);
        let same = stands.position_m == due.position_m
            && stands.rotation().abs_diff_eq(due.rotation(), 1e-6);
        assert!(same, "{frame}: the snapshot shows {stands:?}, it was put at {due:?}");
        frame
    }
}

fn digest(measured: &Measurement) -> u64 {
    let mut digest = WordHash::new();
    for plane in measured.planes() {
        digest.bytes(measured.data(plane.sensor as usize, plane.output).unwrap());
    }
    digest.value()
}

#[test]
fn every_sensor_shows_exactly_its_frame_even_with_a_delayed_renderer() {
    let frames = if is_soak() { 5000 } else { 1000 };
    let sim = Sim::start_with(&[], &[("OMNIBUS_DELAY", "sensor-render:3000")]);
    let mut stage = Stage::set(&sim, 0);
    let mut strict = Vec::new();
    for _ in 0..frames {
        let frame = stage.tick();
        let measured = stage.bundle.receive().unwrap().expect("it is there when the tick returns");
        assert_eq!(measured.frame(), frame);
        assert_eq!(measured.header().state_hash, stage.client.world().header().state_hash);
        if let Some(wrong) = disagreement(&measured, stage.marker, &place(frame.0)) {
            panic!("{frame}: {wrong}");
        }
        // The comparison distinguishes one frame from the next; without that the above would prove
        // nothing.
        assert!(disagreement(&measured, stage.marker, &place(frame.0 - 1)).is_some(), "{frame}");
        assert!(stage.bundle.receive().unwrap().is_none(), "none comes twice");
        strict.push(digest(&measured));
    }
    assert_eq!(stage.bundle.missed(), 0);
    drop(stage);
    sim.end();

    // Pipelined, the same frames come out, with the same bytes.
    let sim = Sim::start_with(&[], &[("OMNIBUS_DELAY", "sensor-render:3000")]);
    let mut stage = Stage::set(&sim, 3);
    let mut pipelined = Vec::new();
    for _ in 0..frames {
        let newest = stage.tick();
        while let Some(measured) = stage.bundle.receive().unwrap() {
            assert!(newest.0 - measured.frame().0 <= 3, "{} is too late", measured.frame());
            pipelined.push(digest(&measured));
        }
    }
    while pipelined.len() < frames {
        let measured = stage.client.await_measurement(&mut stage.bundle).unwrap();
        pipelined.push(digest(&measured));
    }
    assert_eq!(stage.bundle.missed(), 0);
    let other = pipelined.iter().zip(&strict).position(|(a, b)| a != b);
    assert_eq!((other, pipelined.len()), (None, strict.len()), "pipelined, other bytes came out");
    drop(stage);
    sim.end();
}

#[test]
fn a_view_of_a_measurement_lies_in_the_renderers_own_memory() {
    let sim = Sim::start(&[]);
    let mut stage = Stage::set(&sim, 0);
    stage.tick();
    let measured = stage.bundle.receive().unwrap().unwrap();
    let at = measured.data(0, output::DEPTH).unwrap().as_ptr() as usize;
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let row = maps.lines().find(|row| {
        let range = row.split(' ').next().unwrap();
        let (from, to) = range.split_once('-').unwrap();
        let hex = |text| usize::from_str_radix(text, 16).unwrap();
        (hex(from)..hex(to)).contains(&at)
    });
    let row = row.expect("it is mapped");
    assert!(row.contains("/dev/shm/") && row.contains(sim.instance().id()), "{row}");
    // Written by the renderer, which has the same file open.
    let file = row.split_whitespace().last().unwrap().to_owned();
    let renderer = sim.pid(bus::Role::Render).unwrap();
    let theirs = std::fs::read_to_string(format!("/proc/{renderer}/maps")).unwrap();
    assert!(theirs.contains(&file), "the renderer has not mapped {file}");
    drop((measured, stage));
    sim.end();
}

#[test]
fn a_graphics_processor_writes_exact_frames_into_shared_memory() {
    let test = "a_graphics_processor_writes_exact_frames_into_shared_memory";
    let Some(sim) = Sim::start_on_gpu(test) else { return };
    let mut stage = Stage::set(&sim, 0);
    // Bundles come and go: memory that the device writes into is released in time.
    for life in 0..3 {
        for _ in 0..8 {
            let frame = stage.tick();
            let measured = stage.bundle.receive().unwrap().expect("it is there");
            assert_eq!(
                (measured.frame(), measured.header().tracer),
                (frame, protocol::tracer::GPU)
            );
            if let Some(wrong) = disagreement(&measured, stage.marker, &place(frame.0)) {
                panic!("life {life}, {frame}: {wrong}");
            }
        }
        let next = stage.client.create_bundle("next", ActorId::NONE, sensors(), 4).unwrap();
        stage.client.destroy_bundle(std::mem::replace(&mut stage.bundle, next)).unwrap();
    }
    drop(stage);
    sim.end();
}

#[test]
fn a_sensor_measures_at_its_first_frame_and_then_at_its_period() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    // The phase is that of the bundle, not of simulated time.
    while client.frame().0 % 4 != 2 {
        client.tick().unwrap();
    }
    let mut slow = camera("slow", Pose::new(MIDDLE, Quat::IDENTITY), 32, 24, 1.5, output::DEPTH);
    slow.period_nanos = 4 * DELTA_NANOS;
    let mut bundle = client.create_bundle("slow", ActorId::NONE, [slow], 2).unwrap();
    let created = client.frame();
    let mut measured = Vec::new();
    for round in 0..40 {
        // A restarted renderer measures at the same frames.
        if round == 14 || round == 25 {
            kill(sim.pid(Role::Render).expect("it lives between ticks"), Signal::KILL);
        }
        let (frame, found) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        measured.extend(found.iter().flatten().map(|m| (m.frame(), frame)));
    }
    assert_eq!(measured[0].0.0, created.0 + 1);
    assert_eq!(measured.len(), 10);
    for pair in measured.windows(2) {
        assert_eq!(pair[1].0.0 - pair[0].0.0, 4);
    }
    assert!(measured.iter().all(|(of, at)| of == at));
    drop((client, bundle));
    sim.end();
}

#[test]
fn noise_is_the_same_in_two_worlds_with_the_same_seeds() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut noisy = lidar("noisy", Pose::new(MIDDLE, Quat::IDENTITY), 8, 90, [-1.5, -0.5], 400.0);
    (noisy.noise_m, noisy.dropoff, noisy.seed) = (0.5, 0.2, 7);
    let measure = |client: &mut Client| {
        let mut bundle = client.create_bundle("noisy", ActorId::NONE, [noisy], 2).unwrap();
        let mut measured = Vec::new();
        for _ in 0..5 {
            let (_, found) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
            let points = found[0].as_ref().unwrap().points(0);
            measured.push(points.unwrap().to_vec());
        }
        measured
    };
    let first = measure(&mut client);
    assert_ne!(first[0], first[1], "the noise of a frame is its own");
    client.reload_map().unwrap();
    assert!(client.frame().0 > 5, "frame numbers continue");
    assert!(measure(&mut client) == first, "the noise differs in the second world");
    drop(client);
    sim.end();
}
