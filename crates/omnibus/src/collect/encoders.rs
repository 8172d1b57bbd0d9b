//! The threads that encode and write files, so that a tick does not wait for them.
//!
//! All tasks of a frame share its data, which holds the renderer's memory. The last task releases
//! the memory and appends the frame to the list. The number of frames in flight is the only bound,
//! and waiting for a permit the only back pressure.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, OnceLock, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread::JoinHandle,
};

use bus::clock;
use client_lib::{RadarDetection, RadarRays};
use crossbeam::channel::{Receiver, Sender, bounded};
use glam::Vec3;
use protocol::{
    ActorId, ActorState, BlueprintInfo, BundleHeader, Plane, WalkerLimbs, Weather, output, sensor,
};

use crate::collect::{
    CollectError,
    boxes::{self, Boxed, CameraView, LidarView, Views},
    camera_model::CameraModel,
    ego_sensors::EgoSensors,
    encode::{self, Encoder},
    folder::{Folder, write_atomically},
    format::{Boxes, Ego, FrameLine, Output, SensorPose, hash_text, tracer_name},
    frame_list::FrameList,
    image_storage::ImageStorage,
    label_settings::LabelSettings,
    map_lines::{FrameLanes, LaneLines},
    objects::StaticObjects,
    sensors::{BOXES, LANES, PlannedSensor, Task, sensor_from_optical},
    silhouette::Silhouette,
};

/// The bytes that hold the planes of a frame.
pub(crate) type Bytes = Box<dyn AsRef<[u8]> + Send + Sync>;

/// Everything that is kept of one frame.
pub(crate) struct FrameData {
    /// Position of the frame in the list.
    pub(crate) index: u64,
    pub(crate) header: BundleHeader,
    pub(crate) planes: Vec<Plane>,
    /// The bytes that the offsets of the planes refer to.
    pub(crate) bytes: Bytes,
    /// All actors at that frame, sorted by id.
    pub(crate) actors: Vec<ActorState>,
    /// The limbs of fallen walkers at that frame, sorted by id.
    pub(crate) limbs: Vec<WalkerLimbs>,
    pub(crate) weather: Weather,
    /// Readings of the physics sensors since the frame before that was kept.
    pub(crate) ego_sensors: Vec<EgoSensors>,
    pub(crate) counts: FrameCounts,
}

/// What the tasks of a frame counted.
#[derive(Default)]
pub(crate) struct FrameCounts {
    done: AtomicU64,
    boxes: AtomicU64,
    points: Mutex<BTreeMap<String, u64>>,
    files_crc32: Mutex<BTreeMap<String, u32>>,
}

impl FrameData {
    fn frame(&self) -> u64 {
        self.header.stamp.frame.0
    }

    /// Returns whether a sensor measured in this frame.
    fn measures(&self, sensor: usize) -> bool {
        self.planes.iter().any(|plane| plane.sensor as usize == sensor)
    }

    /// Returns the detections of a radar, each with the id and tag of what it met; `None` for other
    /// sensors.
    fn detections(
        &self,
        sensor: usize,
        context: &DataSetContext,
    ) -> Result<Option<Detections>, CollectError> {
        let PlannedSensor { radar: Some(radar), receiver, .. } = &context.sensors[sensor] else {
            return Ok(None);
        };
        let velocity_of = |id: ActorId| match self.actors.binary_search_by_key(&id, |a| a.actor_id)
        {
            Ok(index) => self.actors[index].velocity(),
            Err(_) => Vec3::ZERO,
        };
        let (plane, points) = self.plane(sensor, output::POINTS)?;
        let labels = self.plane(sensor, output::LABELS)?.1;
        let (points, labels) = (bytemuck::cast_slice(points), bytemuck::cast_slice(labels));
        let Some(receiver) = receiver else {
            let nanos = self.header.stamp.sim_time_nanos;
            let found = radar.detections(nanos, plane, points, labels, velocity_of, context.ego);
            return Ok(Some(Detections { rows: found.collect(), powers: Vec::new() }));
        };
        let rays = RadarRays { plane, fov_rad: radar.fov_rad, points, labels };
        let mut found = Detections::default();
        for target in receiver.targets(rays, velocity_of, context.ego) {
            let detection = RadarDetection {
                velocity_mps: target.velocity_mps,
                azimuth_rad: target.azimuth_rad,
                altitude_rad: target.altitude_rad,
                depth_m: target.depth_m,
            };
            found.rows.push((detection, target.label));
            found.powers.push([target.power_dbm, target.snr_db, target.cross_section_dbsm]);
        }
        Ok(Some(found))
    }

    fn plane(&self, sensor: usize, output: u32) -> Result<(&Plane, &[u8]), CollectError> {
        let found = self.planes.iter().find(|p| p.sensor as usize == sensor && p.output == output);
        let bytes: &[u8] = (*self.bytes).as_ref();
        let within =
            |plane: &Plane| bytes.get(plane.offset as usize..)?.get(..plane.byte_len as usize);
        match found.and_then(|plane| Some((plane, within(plane)?))) {
            Some(found) => Ok(found),
            None => Err(CollectError::Bug {
                what: "reading a bundle",
                why: format!("frame {} has no output {output} of sensor {sensor}", self.frame()),
            }),
        }
    }
}

/// Detections of a radar in one frame.
#[derive(Default)]
struct Detections {
    /// Each with the id and tag of what it met.
    rows: Vec<(RadarDetection, [u32; 2])>,
    /// Power, ratio of signal to noise and cross-section of each; empty without a receiver.
    powers: Vec<[f32; 3]>,
}

/// What all encoder threads share.
pub(crate) struct DataSetContext {
    pub(crate) folder: Folder,
    pub(crate) sensors: Vec<PlannedSensor>,
    pub(crate) tasks: Vec<Task>,
    pub(crate) ego: ActorId,
    pub(crate) blueprints: Vec<BlueprintInfo>,
    pub(crate) objects: StaticObjects,
    pub(crate) lanes: LaneLines,
    pub(crate) images: ImageStorage,
    pub(crate) labels: LabelSettings,
}

struct Shared {
    context: DataSetContext,
    frame_list: Mutex<FrameList>,
    failure: OnceLock<CollectError>,
    busy_nanos: AtomicU64,
    bytes: AtomicU64,
    images: AtomicU64,
}

/// The encoder threads and their queue.
pub(crate) struct EncoderPool {
    shared: Arc<Shared>,
    jobs: Option<Sender<(Arc<FrameData>, usize)>>,
    permits: (Sender<()>, Receiver<()>),
    threads: Vec<JoinHandle<()>>,
}

/// Permission to hold the memory of one frame; dropping it frees the place.
pub(crate) struct Permit(Sender<()>);

impl Drop for Permit {
    fn drop(&mut self) {
        let _ = self.0.try_send(());
    }
}

/// The work of the encoders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Work {
    pub(crate) busy_nanos: u64,
    pub(crate) bytes: u64,
    pub(crate) images: u64,
}

impl EncoderPool {
    /// Starts `threads` threads; at most `frames_max` frames are in flight.
    pub(crate) fn start(
        context: DataSetContext,
        frame_list: FrameList,
        threads: usize,
        frames_max: usize,
    ) -> Result<EncoderPool, CollectError> {
        let permits = bounded(frames_max);
        for _ in 0..frames_max {
            let _ = permits.0.try_send(());
        }
        let (jobs, queue) = bounded(frames_max * context.tasks.len());
        let shared = Arc::new(Shared {
            context,
            frame_list: Mutex::new(frame_list),
            failure: OnceLock::new(),
            busy_nanos: AtomicU64::new(0),
            bytes: AtomicU64::new(0),
            images: AtomicU64::new(0),
        });
        let mut encoders = EncoderPool {
            shared: Arc::clone(&shared),
            jobs: Some(jobs),
            permits,
            threads: Vec::new(),
        };
        for index in 0..threads {
            let (shared, queue) = (Arc::clone(&shared), queue.clone());
            let thread = std::thread::Builder::new()
                .name(format!("encode-{index}"))
                .spawn(move || work(&shared, &queue))
                .map_err(|e| CollectError::io(Path::new("a thread to encode with"), e))?;
            encoders.threads.push(thread);
        }
        Ok(encoders)
    }

    /// Waits until one more frame may be in flight.
    pub(crate) fn permit(&self) -> Permit {
        // This pool owns the other end, so the channel is open.
        let _ = self.permits.1.recv();
        Permit(self.permits.0.clone())
    }

    /// Queues the tasks of a frame; the frame's bytes must hold its permit.
    pub(crate) fn submit(&self, data: FrameData) {
        let data = Arc::new(data);
        let jobs = self.jobs.as_ref().expect("open until the end");
        for task in 0..self.shared.context.tasks.len() {
            // The queue has room for all tasks of all frames, and the threads live as long as the
            // pool.
            let _ = jobs.send((Arc::clone(&data), task));
        }
    }

    /// Returns whether a task failed; nothing more is written then.
    pub(crate) fn has_failed(&self) -> bool {
        self.shared.failure.get().is_some()
    }

    /// Returns the number of complete frames.
    pub(crate) fn complete(&self) -> u64 {
        self.shared.frame_list().complete()
    }

    /// Returns the work so far.
    pub(crate) fn work(&self) -> Work {
        let read = |word: &AtomicU64| word.load(Ordering::Relaxed);
        let shared = &self.shared;
        Work {
            busy_nanos: read(&shared.busy_nanos),
            bytes: read(&shared.bytes),
            images: read(&shared.images),
        }
    }

    /// Waits for all queued tasks. Returns the work, the number of complete frames, and the first
    /// error.
    pub(crate) fn finish(mut self) -> (Work, u64, Result<(), CollectError>) {
        self.jobs = None;
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
        let (work, complete) = (self.work(), self.complete());
        let shared = Arc::try_unwrap(self.shared);
        let failure = shared.ok().and_then(|shared| shared.failure.into_inner());
        (work, complete, failure.map_or(Ok(()), Err))
    }
}

impl Shared {
    fn frame_list(&self) -> MutexGuard<'_, FrameList> {
        lock(&self.frame_list)
    }
}

/// Nothing that a panic could leave half done is kept under these locks.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Memory that a thread reuses.
#[derive(Default)]
struct WorkerBuffers {
    encoder: Encoder,
    points: Vec<u8>,
    labels: Vec<u8>,
    raster: Silhouette,
}

fn work(shared: &Shared, queue: &Receiver<(Arc<FrameData>, usize)>) {
    let mut buffers = WorkerBuffers::default();
    while let Ok((data, task)) = queue.recv() {
        if shared.failure.get().is_some() {
            continue;
        }
        let began = clock::now_nanos();
        let attempt = AssertUnwindSafe(|| shared.run_task(&data, task, &mut buffers));
        let done = catch_unwind(attempt).unwrap_or_else(|_| {
            let why = format!("it panicked at frame {}", data.frame());
            Err(CollectError::Bug { what: "a thread that encodes", why })
        });
        shared.busy_nanos.fetch_add(clock::now_nanos() - began, Ordering::Relaxed);
        if let Err(failure) = done {
            let _ = shared.failure.set(failure);
        }
    }
}

impl Shared {
    fn run_task(
        &self,
        data: &FrameData,
        task: usize,
        buffers: &mut WorkerBuffers,
    ) -> Result<(), CollectError> {
        match &self.context.tasks[task] {
            Task::Image { sensor, .. } | Task::Points { sensor, .. } if !data.measures(*sensor) => {
            }
            Task::Image { sensor, output, folder } => {
                self.image(data, *sensor, *output, folder, &mut buffers.encoder)?;
            }
            Task::Points { sensor, points, labels, powers } => {
                self.points(data, *sensor, [points, labels], powers.as_deref(), buffers)?;
            }
            Task::Boxes => self.boxes(data, buffers)?,
            Task::Lanes => self.lanes(data)?,
        }
        let done = data.counts.done.fetch_add(1, Ordering::AcqRel) + 1;
        if done == self.context.tasks.len() as u64 {
            self.frame_list().append(data.index, &self.line(data))?;
        }
        Ok(())
    }

    fn write(
        &self,
        data: &FrameData,
        folder: &str,
        kind: &str,
        bytes: &[u8],
    ) -> Result<(), CollectError> {
        write_atomically(&self.context.folder.frame_file(folder, data.frame(), kind), bytes)?;
        lock(&data.counts.files_crc32).insert(folder.to_owned(), crc32fast::hash(bytes));
        self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(())
    }

    fn image(
        &self,
        data: &FrameData,
        sensor: usize,
        output: u32,
        folder: &str,
        encoder: &mut Encoder,
    ) -> Result<(), CollectError> {
        let (plane, bytes) = data.plane(sensor, output)?;
        let size = [plane.width, plane.height];
        let storage = self.context.images;
        encoder.image(storage, output, size, bytes)?;
        self.write(data, folder, storage.format.extension(output), &encoder.file)?;
        self.images.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn points(
        &self,
        data: &FrameData,
        sensor: usize,
        [points_folder, labels_folder]: [&str; 2],
        powers_folder: Option<&str>,
        buffers: &mut WorkerBuffers,
    ) -> Result<(), CollectError> {
        let (points, labels) = (&mut buffers.points, &mut buffers.labels);
        let mut powers = Vec::new();
        let count = match data.detections(sensor, &self.context)? {
            Some(found) => {
                powers = found.powers;
                encode::detections(found.rows.into_iter(), points, labels)
            }
            None => {
                let rays = bytemuck::cast_slice(data.plane(sensor, output::POINTS)?.1);
                let met = bytemuck::cast_slice(data.plane(sensor, output::LABELS)?.1);
                encode::returns(rays, met, points, labels)
            }
        };
        let name = self.context.sensors[sensor].spec.name.to_string();
        lock(&data.counts.points).insert(name, count);
        self.write(data, points_folder, "bin", &buffers.points)?;
        if let Some(folder) = powers_folder {
            let numbers = powers.as_flattened().iter();
            let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
            self.write(data, folder, "bin", &bytes)?;
        }
        self.write(data, labels_folder, "bin", &buffers.labels)
    }

    fn boxes(&self, data: &FrameData, buffers: &mut WorkerBuffers) -> Result<(), CollectError> {
        let context = &self.context;
        let boxed = Boxed { actors: &data.actors, limbs: &data.limbs, objects: &context.objects };
        let mut views = Views {
            cameras: Vec::new(),
            lidars: Vec::new(),
            radars: Vec::new(),
            labels: context.labels,
        };
        let sensors = context.sensors.iter().enumerate();
        for (index, PlannedSensor { spec, .. }) in
            sensors.filter(|(index, _)| data.measures(*index))
        {
            if spec.outputs & output::INSTANCE != 0 {
                let (plane, bytes) = data.plane(index, output::INSTANCE)?;
                let ids = bytemuck::cast_slice(bytes);
                let has_depth = spec.outputs & output::DEPTH != 0;
                let depth = has_depth.then(|| data.plane(index, output::DEPTH)).transpose()?;
                views.cameras.push(CameraView {
                    name: spec.name.as_str(),
                    camera: CameraModel::of(spec),
                    world_from_sensor: plane.world_from_sensor,
                    seen: boxes::seen(ids, plane.width as usize, boxed),
                    ids,
                    depth: depth.map(|(_, bytes)| bytemuck::cast_slice(bytes)),
                });
            }
            if let Some(detections) = data.detections(index, context)? {
                let labels: Vec<_> = detections.rows.iter().map(|(_, label)| *label).collect();
                let returns = boxes::returns(&labels, boxed);
                views.radars.push(LidarView { name: spec.name.as_str(), returns });
            } else if spec.outputs & output::LABELS != 0 {
                let labels = bytemuck::cast_slice(data.plane(index, output::LABELS)?.1);
                let returns = boxes::returns(labels, boxed);
                views.lidars.push(LidarView { name: spec.name.as_str(), returns });
            }
        }
        let actors = boxes::actor_boxes(
            boxed,
            context.ego,
            &context.blueprints,
            &views,
            &mut buffers.raster,
        );
        let objects = boxes::object_boxes(boxed, &views, &mut buffers.raster);
        let boxes = Boxes { frame: data.frame(), actors, objects };
        data.counts.boxes.store(boxes.count(), Ordering::Relaxed);
        let text = serde_json::to_vec(&boxes).expect("plain data has a JSON form");
        self.write(data, BOXES, "json", &text)
    }

    fn lanes(&self, data: &FrameData) -> Result<(), CollectError> {
        let mut cameras = BTreeMap::new();
        for (index, PlannedSensor { spec, .. }) in self.context.sensors.iter().enumerate() {
            if spec.kind != sensor::CAMERA {
                continue;
            }
            let Some(plane) = data.planes.iter().find(|p| p.sensor as usize == index) else {
                continue;
            };
            let world_from_optical = plane.world_from_sensor.affine() * sensor_from_optical();
            let lines =
                self.context.lanes.in_image(&world_from_optical.inverse(), &CameraModel::of(spec));
            cameras.insert(spec.name.to_string(), lines);
        }
        let lanes = FrameLanes { frame: data.frame(), cameras };
        let text = serde_json::to_vec(&lanes).expect("plain data has a JSON form");
        self.write(data, LANES, "json", &text)
    }

    fn line(&self, data: &FrameData) -> FrameLine {
        let header = &data.header;
        let ego = data.actors.iter().find(|a| a.actor_id == self.context.ego);
        let pose = |(index, PlannedSensor { spec, .. }): (usize, &PlannedSensor)| {
            let plane = data.planes.iter().find(|p| p.sensor as usize == index)?;
            let name = spec.name.to_string();
            Some(SensorPose { name, world_from_sensor: (&plane.world_from_sensor).into() })
        };
        FrameLine {
            frame: data.frame(),
            sim_time_nanos: header.stamp.sim_time_nanos,
            state_hash: hash_text(header.state_hash),
            tracer: tracer_name(header.tracer).to_owned(),
            ego: Ego::from(ego.unwrap_or(&ActorState::default())),
            weather: data.weather.into(),
            sensors: self.context.sensors.iter().enumerate().filter_map(pose).collect(),
            box_count: data.counts.boxes.load(Ordering::Relaxed),
            point_counts: lock(&data.counts.points).clone(),
            ego_sensors: data.ego_sensors.clone(),
            files_crc32: lock(&data.counts.files_crc32).clone(),
        }
    }
}

/// Creates the folders that the tasks write to.
pub(crate) fn make_folders(folder: &Folder, outputs: &[Output]) -> Result<(), CollectError> {
    for output in outputs {
        let path = folder.root().join(&output.folder);
        std::fs::create_dir_all(&path).map_err(|e| CollectError::io(&path, e))?;
    }
    Ok(())
}
