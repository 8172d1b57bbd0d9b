//! The threads that encode and write, beside the tick's path.
//!
//! A shot is shared by all tasks of its frame and holds the renderer's own memory; when the last
//! task is done the memory goes back and the frame enters the ledger. How many shots there may be
//! at a time is the only bound, and waiting for one the only back pressure.

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
use crossbeam::channel::{Receiver, Sender, bounded};
use protocol::{ActorId, ActorState, BlueprintInfo, BundleHeader, Plane, SensorSpec, output};

use super::{
    CollectError,
    boxes::{self, CameraView, LidarView},
    encode::{self, Encoder},
    felt::EgoSensors,
    folder::{Folder, write_whole},
    ledger::Ledger,
    record::{Boxes, Ego, FrameLine, SensorPose, hash_text, tracer_name},
    rig::{self, BOXES, Pinhole, Task},
    silhouette::Silhouette,
};

/// Bytes in which the planes of a shot lie.
pub(crate) type Bytes = Box<dyn AsRef<[u8]> + Send + Sync>;

/// Everything of one frame that is to be kept.
pub(crate) struct Shot {
    /// Its place in the ledger.
    pub(crate) place: u64,
    pub(crate) header: BundleHeader,
    pub(crate) planes: Vec<Plane>,
    /// Where the planes' offsets point.
    pub(crate) bytes: Bytes,
    /// Everybody, at that frame.
    pub(crate) actors: Vec<ActorState>,
    /// What the ego felt since the shot before.
    pub(crate) felt: Vec<EgoSensors>,
    pub(crate) tally: Tally,
}

/// What the tasks of a frame found.
#[derive(Default)]
pub(crate) struct Tally {
    done: AtomicU64,
    boxes: AtomicU64,
    points: Mutex<BTreeMap<String, u64>>,
}

impl Shot {
    fn frame(&self) -> u64 {
        self.header.stamp.frame.0
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

/// What every thread of the crew knows.
pub(crate) struct Desk {
    pub(crate) folder: Folder,
    pub(crate) sensors: Vec<SensorSpec>,
    pub(crate) tasks: Vec<Task>,
    pub(crate) ego: ActorId,
    pub(crate) blueprints: Vec<BlueprintInfo>,
}

struct Shared {
    desk: Desk,
    ledger: Mutex<Ledger>,
    failure: OnceLock<CollectError>,
    busy_nanos: AtomicU64,
    bytes: AtomicU64,
    images: AtomicU64,
}

/// The threads, and the way to them.
pub(crate) struct Crew {
    shared: Arc<Shared>,
    jobs: Option<Sender<(Arc<Shot>, usize)>>,
    tickets: (Sender<()>, Receiver<()>),
    threads: Vec<JoinHandle<()>>,
}

/// Leave to hold one shot.
pub(crate) struct Ticket(Sender<()>);

impl Drop for Ticket {
    fn drop(&mut self) {
        let _ = self.0.try_send(());
    }
}

/// What the crew did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Work {
    pub(crate) busy_nanos: u64,
    pub(crate) bytes: u64,
    pub(crate) images: u64,
}

impl Crew {
    /// Starts `threads` threads that hold at most `shots_max` shots.
    pub(crate) fn start(
        desk: Desk,
        ledger: Ledger,
        threads: usize,
        shots_max: usize,
    ) -> Result<Crew, CollectError> {
        let tickets = bounded(shots_max);
        for _ in 0..shots_max {
            let _ = tickets.0.try_send(());
        }
        let (jobs, queue) = bounded(shots_max * desk.tasks.len());
        let shared = Arc::new(Shared {
            desk,
            ledger: Mutex::new(ledger),
            failure: OnceLock::new(),
            busy_nanos: AtomicU64::new(0),
            bytes: AtomicU64::new(0),
            images: AtomicU64::new(0),
        });
        let mut crew =
            Crew { shared: Arc::clone(&shared), jobs: Some(jobs), tickets, threads: Vec::new() };
        for index in 0..threads {
            let (shared, queue) = (Arc::clone(&shared), queue.clone());
            let thread = std::thread::Builder::new()
                .name(format!("encode-{index}"))
                .spawn(move || work(&shared, &queue))
                .map_err(|e| CollectError::io(Path::new("a thread to encode with"), e))?;
            crew.threads.push(thread);
        }
        Ok(crew)
    }

    /// Waits until there is room for one more shot.
    pub(crate) fn ticket(&self) -> Ticket {
        // The other end is ours: it is never gone.
        let _ = self.tickets.1.recv();
        Ticket(self.tickets.0.clone())
    }

    /// Hands over a frame; its bytes must hold its ticket.
    pub(crate) fn keep(&self, shot: Shot) {
        let shot = Arc::new(shot);
        let jobs = self.jobs.as_ref().expect("open until the end");
        for task in 0..self.shared.desk.tasks.len() {
            // There is room for all tasks of all shots, and the threads live as long as this.
            let _ = jobs.send((Arc::clone(&shot), task));
        }
    }

    /// Something could not be written; nothing more will be.
    pub(crate) fn has_failed(&self) -> bool {
        self.shared.failure.get().is_some()
    }

    /// How many frames are complete.
    pub(crate) fn complete(&self) -> u64 {
        self.shared.ledger().complete()
    }

    /// What was done so far.
    pub(crate) fn work(&self) -> Work {
        let read = |word: &AtomicU64| word.load(Ordering::Relaxed);
        let shared = &self.shared;
        Work {
            busy_nanos: read(&shared.busy_nanos),
            bytes: read(&shared.bytes),
            images: read(&shared.images),
        }
    }

    /// Waits for everything that was handed over. Says what was done, how many frames are
    /// complete, and why not all.
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
    fn ledger(&self) -> MutexGuard<'_, Ledger> {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A thread's own tools.
#[derive(Default)]
struct Tools {
    encoder: Encoder,
    points: Vec<u8>,
    labels: Vec<u8>,
    board: Silhouette,
}

fn work(shared: &Shared, queue: &Receiver<(Arc<Shot>, usize)>) {
    let mut tools = Tools::default();
    while let Ok((shot, task)) = queue.recv() {
        if shared.failure.get().is_some() {
            continue;
        }
        let began = clock::now_nanos();
        let attempt = AssertUnwindSafe(|| shared.carry_out(&shot, task, &mut tools));
        let done = catch_unwind(attempt).unwrap_or_else(|_| {
            let why = format!("it panicked at frame {}", shot.frame());
            Err(CollectError::Bug { what: "a thread that encodes", why })
        });
        shared.busy_nanos.fetch_add(clock::now_nanos() - began, Ordering::Relaxed);
        if let Err(failure) = done {
            let _ = shared.failure.set(failure);
        }
    }
}

impl Shared {
    fn carry_out(&self, shot: &Shot, task: usize, tools: &mut Tools) -> Result<(), CollectError> {
        match &self.desk.tasks[task] {
            Task::Image { sensor, output, folder } => {
                self.image(shot, *sensor, *output, folder, &mut tools.encoder)?;
            }
            Task::Points { sensor, points, labels } => {
                self.points(shot, *sensor, [points, labels], tools)?;
            }
            Task::Boxes => self.boxes(shot, tools)?,
        }
        let done = shot.tally.done.fetch_add(1, Ordering::AcqRel) + 1;
        if done == self.desk.tasks.len() as u64 {
            self.ledger().enter(shot.place, &self.line(shot))?;
        }
        Ok(())
    }

    fn write(
        &self,
        shot: &Shot,
        folder: &str,
        kind: &str,
        bytes: &[u8],
    ) -> Result<(), CollectError> {
        write_whole(&self.desk.folder.of_frame(folder, shot.frame(), kind), bytes)?;
        self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(())
    }

    fn image(
        &self,
        shot: &Shot,
        sensor: usize,
        output: u32,
        folder: &str,
        encoder: &mut Encoder,
    ) -> Result<(), CollectError> {
        let (plane, bytes) = shot.plane(sensor, output)?;
        let size = [plane.width, plane.height];
        match output {
            output::COLOR => encoder.color(size, bytes)?,
            output::DEPTH => encoder.depth(size, bytemuck::cast_slice(bytes))?,
            output::TAG => encoder.tag(size, bytes)?,
            _ => encoder.instance(size, bytemuck::cast_slice(bytes))?,
        }
        self.write(shot, folder, "png", &encoder.file)?;
        self.images.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn points(
        &self,
        shot: &Shot,
        sensor: usize,
        [points_folder, labels_folder]: [&str; 2],
        tools: &mut Tools,
    ) -> Result<(), CollectError> {
        let rays = bytemuck::cast_slice(shot.plane(sensor, output::POINTS)?.1);
        let met = bytemuck::cast_slice(shot.plane(sensor, output::LABELS)?.1);
        let count = encode::returns(rays, met, &mut tools.points, &mut tools.labels);
        let name = self.desk.sensors[sensor].name.to_string();
        shot.tally.points.lock().unwrap_or_else(PoisonError::into_inner).insert(name, count);
        self.write(shot, points_folder, "bin", &tools.points)?;
        self.write(shot, labels_folder, "bin", &tools.labels)
    }

    fn boxes(&self, shot: &Shot, tools: &mut Tools) -> Result<(), CollectError> {
        let (mut cameras, mut lidars) = (Vec::new(), Vec::new());
        for (index, spec) in self.desk.sensors.iter().enumerate() {
            if spec.outputs & output::INSTANCE != 0 {
                let (plane, bytes) = shot.plane(index, output::INSTANCE)?;
                let ids = bytemuck::cast_slice(bytes);
                cameras.push(CameraView {
                    name: spec.name.as_str(),
                    camera: Pinhole::of(spec),
                    world_from_sensor: plane.world_from_sensor,
                    seen: boxes::seen(ids, plane.width as usize, &shot.actors),
                });
            }
            if spec.outputs & output::LABELS != 0 {
                let labels = bytemuck::cast_slice(shot.plane(index, output::LABELS)?.1);
                let returns = boxes::returns(labels, &shot.actors);
                lidars.push(LidarView { name: spec.name.as_str(), returns });
            }
        }
        let desk = &self.desk;
        let actors = boxes::boxes(
            &shot.actors,
            desk.ego,
            &desk.blueprints,
            &cameras,
            &lidars,
            &mut tools.board,
        );
        shot.tally.boxes.store(actors.len() as u64, Ordering::Relaxed);
        let boxes = Boxes { frame: shot.frame(), actors };
        let text = serde_json::to_vec(&boxes).expect("plain data has a JSON form");
        self.write(shot, BOXES, "json", &text)
    }

    fn line(&self, shot: &Shot) -> FrameLine {
        let header = &shot.header;
        let ego = shot.actors.iter().find(|a| a.actor_id == self.desk.ego);
        let pose = |(index, spec): (usize, &SensorSpec)| {
            let plane = shot.planes.iter().find(|p| p.sensor as usize == index)?;
            let name = spec.name.to_string();
            Some(SensorPose { name, world_from_sensor: (&plane.world_from_sensor).into() })
        };
        FrameLine {
            frame: shot.frame(),
            sim_time_nanos: header.stamp.sim_time_nanos,
            state_hash: hash_text(header.state_hash),
            tracer: tracer_name(header.tracer).to_owned(),
            ego: Ego::from(ego.unwrap_or(&ActorState::default())),
            sensors: self.desk.sensors.iter().enumerate().filter_map(pose).collect(),
            boxes: shot.tally.boxes.load(Ordering::Relaxed),
            points: shot.tally.points.lock().unwrap_or_else(PoisonError::into_inner).clone(),
            felt: shot.felt.clone(),
        }
    }
}

/// Makes the folders into which the tasks write.
pub(crate) fn make_folders(folder: &Folder, sensors: &[SensorSpec]) -> Result<(), CollectError> {
    for output in rig::outputs(sensors) {
        let path = folder.root().join(output.folder);
        std::fs::create_dir_all(&path).map_err(|e| CollectError::io(&path, e))?;
    }
    Ok(())
}
