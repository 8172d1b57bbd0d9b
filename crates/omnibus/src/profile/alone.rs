//! One stage alone, fed from a recording at full speed.
//!
//! The recording is simulated again in this thread: physics and traffic are measured as they do so,
//! and the frames that they make are the input of the renderer, the recorder and the bus.

mod bus_stage;
mod input;
mod render;

use std::path::Path;

use ::record::{Profile, Recording, RecordingConfig, Writer};
use anyhow::{Context, ensure};
use bus::clock;
use serde_json::{Value, json};

use input::{RecordedInput, series};

use super::{
    args::{AloneStage, ProfileArgs},
    report::{HEAD, Series},
};
use crate::{
    resimulate::{StepNanos, resimulate_watched},
    saved::existing_recording,
    stage::memory::peak_mb,
};

/// The result of one stage.
pub(crate) struct AloneReport {
    stage: AloneStage,
    file: String,
    map: String,
    actors: usize,
    /// The whole stage first, then its inner steps.
    series: Vec<Series>,
    peak_mb: f64,
    notes: Vec<String>,
}

/// Runs the stage.
pub(crate) fn alone(
    args: &ProfileArgs,
    stage: AloneStage,
    input: &Path,
) -> anyhow::Result<AloneReport> {
    args.world.expect_no_simulator("a stage alone")?;
    ensure!(args.world.map.is_none(), "--map has no effect: the recording names its map");
    let file = existing_recording(input)?;
    let mut recording = Recording::open(&file)?;
    let map = recording.info().episode.map.clone();
    let mut report = AloneReport {
        stage,
        file: file.display().to_string(),
        map,
        actors: 0,
        series: Vec::new(),
        peak_mb: 0.0,
        notes: Vec::new(),
    };
    match stage {
        AloneStage::Physics | AloneStage::Traffic => {
            let mut steps: Vec<StepNanos> = Vec::new();
            each_frame(&mut recording, args.frames, |_, step| {
                steps.push(*step);
                Ok(())
            })
            .map(|actors| report.actors = actors)?;
            report.series = match stage {
                AloneStage::Physics => physics_series(&steps),
                _ => traffic_series(&steps),
            };
        }
        AloneStage::Record => {
            let frames = recorded_frames(&mut recording, args.frames)?;
            report.actors = frames.iter().map(|frame| frame.actors.len()).max().unwrap_or(0);
            report.series = write_again(&recording, frames)?;
        }
        AloneStage::Render => {
            let inputs = inputs(&mut recording, args.frames)?;
            report.actors = inputs.iter().map(|input| input.actors.len()).max().unwrap_or(0);
            let measured = render::measure(args, &recording.info().episode, &inputs)?;
            (report.series, report.notes) = (measured.series, measured.notes);
        }
        AloneStage::Bus => {
            let inputs = inputs(&mut recording, args.frames)?;
            report.actors = inputs.iter().map(|input| input.actors.len()).max().unwrap_or(0);
            report.series = bus_stage::measure(&inputs)?;
        }
    }
    ensure!(
        report.series.first().is_some_and(|series| !series.nanos.is_empty()),
        "{} holds no frame that {} works on",
        report.file,
        stage.name()
    );
    report.peak_mb = peak_mb();
    Ok(report)
}

impl AloneReport {
    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "{} alone, from {}, {}, {} actors; at most {:.0} MB of memory\n{HEAD}",
            self.stage.name(),
            self.file,
            self.map,
            self.actors,
            self.peak_mb
        );
        for (index, series) in self.series.iter().enumerate() {
            let indent = if index == 0 { "" } else { "  " };
            text.push_str(&series.line(indent));
        }
        let nanos = &self.series[0].nanos;
        let rate_hz = nanos.len() as f64 * 1e9 / nanos.iter().sum::<u64>().max(1) as f64;
        text.push_str(&format!("{rate_hz:.1} frames/s at full speed"));
        for note in &self.notes {
            text.push('\n');
            text.push_str(note);
        }
        text
    }

    pub(crate) fn json(&self) -> Value {
        let parts: serde_json::Map<String, Value> =
            self.series.iter().map(|series| (series.name.clone(), series.json())).collect();
        json!({ "kind": "alone", "stage": self.stage.name(), "input": self.file, "map": self.map,
            "omnibus_version": env!("CARGO_PKG_VERSION"), "actors": self.actors,
            "parts": parts, "peak_mb": self.peak_mb, "notes": self.notes })
    }
}

fn physics_series(steps: &[StepNanos]) -> Vec<Series> {
    let of = |name, part: fn(&StepNanos) -> u64| series(name, steps.iter().map(part));
    vec![
        of("physics", |step| step.commands + step.physics + step.state_hash),
        of("commands", |step| step.commands),
        of("physics step", |step| step.physics),
        of("state hash", |step| step.state_hash),
    ]
}

fn traffic_series(steps: &[StepNanos]) -> Vec<Series> {
    let planned = || steps.iter().filter_map(|step| step.plan);
    vec![
        series("traffic", planned().map(|(plan, save)| plan + save)),
        series("plan", planned().map(|(plan, _)| plan)),
        series("save state", planned().map(|(_, save)| save)),
    ]
}

/// Simulates the recording again and calls `see` with each frame; returns the most actors.
fn each_frame(
    recording: &mut Recording,
    frames: u64,
    mut see: impl FnMut(RecordedInput, &StepNanos) -> anyhow::Result<()>,
) -> anyhow::Result<usize> {
    let (mut left, mut actors_max) = (frames, 0);
    let done = resimulate_watched(recording, &mut |sim, moment, step| {
        actors_max = actors_max.max(sim.states().len());
        see(
            RecordedInput {
                stamp: moment.stamp,
                delta_nanos: moment.delta_nanos,
                actors: sim.states().to_vec(),
                limbs: sim.world().limbs().to_vec(),
                standing: sim.standing().clone(),
            },
            step,
        )?;
        left -= 1;
        Ok(left > 0)
    })?;
    if let Some(difference) = done.difference {
        log::warn!("the recording was made by another build: {difference}");
    }
    Ok(actors_max)
}

fn inputs(recording: &mut Recording, frames: u64) -> anyhow::Result<Vec<RecordedInput>> {
    let mut inputs = Vec::new();
    each_frame(recording, frames, |input, _| {
        inputs.push(input);
        Ok(())
    })?;
    Ok(inputs)
}

/// Returns the first frames of a recording, as they were recorded.
fn recorded_frames(
    recording: &mut Recording,
    frames: u64,
) -> anyhow::Result<Vec<::record::RecordedFrame>> {
    let mut all = Vec::new();
    for segment in 0..recording.segments() {
        all.extend_from_slice(recording.recorded_frames(segment)?);
        if all.len() as u64 >= frames {
            break;
        }
    }
    all.truncate(frames as usize);
    Ok(all)
}

/// Writes frames to another file, and returns the times.
fn write_again(
    recording: &Recording,
    frames: Vec<::record::RecordedFrame>,
) -> anyhow::Result<Vec<Series>> {
    let info = recording.info();
    // A recording of positions has no exact states to write.
    let profile = if info.profile == Profile::Compact { Profile::Compact } else { info.profile };
    let path = std::env::temp_dir().join(format!("omnibus-profile-{}.mcap", std::process::id()));
    let config = RecordingConfig {
        path: path.clone(),
        profile,
        episode: info.episode.clone(),
        blueprints: info.blueprints.clone(),
        roles: info.roles.clone(),
    };
    let written = || -> anyhow::Result<Vec<Series>> {
        let mut writer = Writer::create(&config)?;
        let (mut all, mut kept, mut segments) = (Vec::new(), Vec::new(), Vec::new());
        for frame in frames {
            let begin = clock::now_nanos();
            let before = writer.frames();
            writer.put(frame)?;
            let nanos = clock::now_nanos() - begin;
            all.push(nanos);
            // The frame that fills a segment writes all of it.
            if writer.frames() > before {
                segments.push(nanos)
            } else {
                kept.push(nanos)
            }
            writer.spent().for_each(drop);
        }
        let begin = clock::now_nanos();
        writer.finish().context("the last segment")?;
        let end = clock::now_nanos() - begin;
        Ok(vec![
            Series { name: "record".to_owned(), nanos: all },
            Series { name: "frame kept".to_owned(), nanos: kept },
            Series { name: "segment written".to_owned(), nanos: segments },
            Series { name: "file closed".to_owned(), nanos: vec![end] },
        ])
    };
    let result = written();
    let _ = std::fs::remove_file(&path);
    result
}
