//! The scenes of a plan, one after the other, each in a process of its own: a scene does not depend on the
//! scenes before it, and one that dies takes nothing along.

use std::{
    ffi::OsString,
    fmt, fs,
    io::{self, BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, bail, ensure};
use crossbeam::channel::{Receiver, RecvTimeoutError, bounded};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use crate::collect::{
    CollectError, Options,
    collection::{PLAN, scene_name},
    folder::Folder,
    metadata::differ,
    options::Shard,
    plan::Plan,
    progress::{Progress, bar, print_json},
};

/// Most continuations of a scene after its process was killed.
const RETRIES: u32 = 2;

/// How often this process looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);

/// What was collected.
pub(crate) struct Collected {
    dir: PathBuf,
    scenes: u64,
    /// Scenes that were complete before.
    complete_before: u64,
    frames: u64,
    images: u64,
    bytes: u64,
    seconds: f64,
}

/// Collects the scenes of a plan that are not complete. `world` holds the options of the simulator.
///
/// # Errors
///
/// The folder holds something else; a scene fails; the run is stopped.
pub(crate) fn collect_scenes(
    options: &Options,
    plan: &Plan,
    world: &[OsString],
    stop: &AtomicBool,
) -> anyhow::Result<Collected> {
    let dir = options.out()?.clone();
    keep_plan(&dir, plan)?;
    let Shard { index, count } = options.shard.unwrap_or(Shard { index: 0, count: 1 });
    let scenes: Vec<_> = (index..plan.scenes).step_by(count as usize).collect();
    let mut collected = Collected {
        dir: dir.clone(),
        scenes: scenes.len() as u64,
        complete_before: 0,
        frames: 0,
        images: 0,
        bytes: 0,
        seconds: 0.0,
    };
    let mut progress = Progress::new(options.json);
    let began = Instant::now();
    for (ordinal, scene) in (0..).zip(scenes) {
        let folder = dir.join(scene_name(scene));
        if is_complete(&folder)? {
            collected.complete_before += 1;
            continue;
        }
        let mut run = SceneRun {
            options,
            plan,
            world,
            stop,
            scene,
            folder: &folder,
            ordinal,
            count: collected.scenes,
            progress: &mut progress,
        };
        let result = run.finish().with_context(|| {
            let complete = ordinal;
            format!(
                "scene {scene}; {complete} of {} scenes are complete in {}, the same command with \
                 --resume continues there",
                collected.scenes,
                dir.display()
            )
        })?;
        let number = |key: &str| result[key].as_u64().unwrap_or(0);
        collected.frames += number("frames");
        collected.images += number("images");
        collected.bytes += number("bytes");
    }
    drop(progress);
    collected.seconds = began.elapsed().as_secs_f64();
    if options.json {
        print_json(&collected.json());
    }
    Ok(collected)
}

/// Writes the plan into the folder of the collection, and returns what a launcher of its own needs.
pub(crate) fn prepare(options: &Options, plan: &Plan) -> anyhow::Result<Value> {
    let dir = options.out()?;
    keep_plan(dir, plan)?;
    let folders: Vec<_> = (0..plan.scenes).map(|scene| dir.join(scene_name(scene))).collect();
    Ok(json!({
        "event": "plan",
        "plan": dir.join(PLAN),
        "scenes": plan.scenes,
        "frames": plan.frames,
        "folders": folders,
    }))
}

fn is_complete(folder: &Path) -> anyhow::Result<bool> {
    Ok(Folder::new(folder).read_metadata()?.is_some_and(|metadata| metadata.complete))
}

/// Writes the plan into the folder, or checks that it is the one that is there. Shards may begin at the
/// same time.
fn keep_plan(dir: &Path, plan: &Plan) -> anyhow::Result<()> {
    fs::create_dir_all(dir).with_context(|| dir.display().to_string())?;
    let path = dir.join(PLAN);
    if !path.exists() {
        let entries = fs::read_dir(dir).with_context(|| dir.display().to_string())?;
        let is_other = |name: &std::ffi::OsStr| !name.to_string_lossy().starts_with(PLAN);
        let count = entries.flatten().filter(|entry| is_other(&entry.file_name())).count();
        ensure!(
            count == 0 || path.exists(),
            "{} is not empty: it holds {count} files or folders and no {PLAN}; choose another --out",
            dir.display()
        );
        let text = toml::to_string(plan).context("the plan has no TOML form")?;
        // Under a name of its own first: the file is whole from the moment at which it is there.
        let own = dir.join(format!("{PLAN}.{}-{}", std::process::id(), bus::clock::now_nanos()));
        let kept = fs::write(&own, &text).and_then(|()| fs::hard_link(&own, &path));
        let _ = fs::remove_file(&own);
        match kept {
            Err(e) if e.kind() != io::ErrorKind::AlreadyExists => {
                return Err(CollectError::io(&path, e).into());
            }
            _ => {}
        }
    }
    let kept = Plan::read(&path)?;
    let value = |plan: &Plan| serde_json::to_value(plan).expect("plain data has a JSON form");
    if let Some((key, kept, now)) = differ("", &value(&kept), &value(plan)) {
        bail!(
            "{} has {key} {kept}, this command has {now}; use the same plan, or choose another --out",
            path.display()
        );
    }
    Ok(())
}

/// The run of one scene.
struct SceneRun<'a> {
    options: &'a Options,
    plan: &'a Plan,
    world: &'a [OsString],
    stop: &'a AtomicBool,
    scene: u64,
    folder: &'a Path,
    /// How many scenes come before.
    ordinal: u64,
    count: u64,
    progress: &'a mut Progress,
}

impl SceneRun<'_> {
    /// Runs the scene until it is complete, and returns its result.
    fn finish(&mut self) -> anyhow::Result<Value> {
        let mut resume = self.options.resume;
        for attempt in 0.. {
            let (status, result, errors) = self.attempt(resume)?;
            if self.stop.load(Ordering::Relaxed) {
                bail!("stopped");
            }
            if status.success() {
                return result.ok_or_else(|| anyhow!("its process ended without a result"));
            }
            let why = errors.last().map_or_else(|| status.to_string(), Clone::clone);
            let why = why.strip_prefix("omnibus: ").unwrap_or(&why).to_owned();
            // An error would come again. A process that was killed may continue.
            ensure!(status.code().is_none() && attempt < RETRIES, "{why}");
            log::warn!("the process of scene {} ended ({status}); it is continued", self.scene);
            resume = true;
        }
        unreachable!("the number of attempts is limited")
    }

    /// Runs the process of the scene once: how it ended, its result, and what it wrote to standard error.
    fn attempt(
        &mut self,
        resume: bool,
    ) -> anyhow::Result<(ExitStatus, Option<Value>, Vec<String>)> {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("collect").arg(self.folder.with_file_name(PLAN));
        command.args(["--scene", &self.scene.to_string(), "--json"]);
        command.args(["--parent", &std::process::id().to_string()]);
        command.args(["--pipeline", &self.options.pipeline.to_string()]);
        command.args(["--writers", &self.options.writers.to_string()]);
        command.arg("--out").arg(self.folder).args(self.world);
        if resume {
            command.arg("--resume");
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().context("its process does not start")?;
        let (lines, errors) = read(&mut child)?;
        let mut result = None;
        let mut is_stopping = false;
        loop {
            match lines.recv_timeout(LOOK) {
                Ok(line) => {
                    let Ok(mut event) = serde_json::from_str::<Value>(&line) else { continue };
                    self.show(&event);
                    if event["event"] == "complete" {
                        result = Some(event.clone());
                    }
                    if self.options.json {
                        event["scene"] = json!(self.scene);
                        if event["event"] == "complete" {
                            event["event"] = json!("scene_complete");
                        }
                        print_json(&event);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if self.stop.load(Ordering::Relaxed) && !is_stopping {
                is_stopping = true;
                let _ = kill_process(Pid::from_child(&child), Signal::TERM);
            }
        }
        let status = child.wait().context("its process")?;
        let errors = errors.join().unwrap_or_default();
        Ok((status, result, errors))
    }

    fn show(&mut self, event: &Value) {
        let (scene, count) = (self.ordinal + 1, self.count);
        let frames = self.plan.frames;
        let done = event["frames_complete"].as_u64().unwrap_or(0);
        let share = (self.ordinal as f64 + done as f64 / frames as f64) / count as f64;
        self.progress.show_text(|| {
            let head = format!("{} scene {scene}/{count}", bar(share));
            if let Some(step) = event["step"].as_str() {
                return format!("{head}, {step}");
            }
            let number = |key: &str| event[key].as_f64().unwrap_or(0.0);
            let rate = number("frames_per_second");
            let left = ((count - self.ordinal) * frames).saturating_sub(done) as f64;
            let stage = event["limiting_stage"].as_str().unwrap_or("starting");
            format!(
                "{head}, {done}/{frames} frames, {rate:.1} frames/s, {:.0} s left, limited by {stage} \
                 ({:.0} % of the time)",
                left / rate.max(1e-3),
                number("limiting_stage_percent")
            )
        });
    }
}

/// Reads what a process prints: its lines, and at its end its errors.
fn read(child: &mut Child) -> anyhow::Result<(Receiver<String>, JoinHandle<Vec<String>>)> {
    let (sender, lines) = bounded(64);
    let out = BufReader::new(child.stdout.take().expect("it is piped"));
    let err = BufReader::new(child.stderr.take().expect("it is piped"));
    std::thread::Builder::new().name("progress".into()).spawn(move || {
        out.lines().map_while(Result::ok).for_each(|line| drop(sender.send(line)));
    })?;
    let errors = std::thread::Builder::new().name("errors".into()).spawn(move || {
        // The newest lines say why it ended.
        let mut kept = Vec::new();
        for line in err.lines().map_while(Result::ok) {
            if kept.len() == 20 {
                kept.remove(0);
            }
            kept.push(line);
        }
        kept
    })?;
    Ok((lines, errors))
}

impl Collected {
    fn json(&self) -> Value {
        json!({
            "event": "complete",
            "dir": self.dir,
            "scenes": self.scenes,
            "scenes_complete_before": self.complete_before,
            "frames": self.frames,
            "images": self.images,
            "bytes": self.bytes,
            "seconds": self.seconds,
        })
    }
}

impl fmt::Display for Collected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Collected { scenes, frames, images, seconds, .. } = self;
        let rate = *frames as f64 / seconds.max(1e-3);
        writeln!(
            f,
            "{scenes} scenes, {frames} frames and {images} images in {seconds:.1} s: {rate:.1} frames/s, \
             {:.1} MB written",
            self.bytes as f64 / 1e6
        )?;
        if self.complete_before > 0 {
            writeln!(f, "{} scenes were complete already", self.complete_before)?;
        }
        write!(f, "data sets: {}", self.dir.join("scene-*").display())
    }
}
