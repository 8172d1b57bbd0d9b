//! `omnibus replay`: a recording shown again, or simulated again.

use std::path::PathBuf;

use ::record::Recording;
use anyhow::{anyhow, ensure};
use bus::clock;
use client_lib::saved_path;

use crate::resimulate::resimulate;

/// What `omnibus replay` takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ReplayArgs {
    /// The recording; a name without a folder is sought in the folder for recordings
    file: PathBuf,
    /// Seconds to skip at its start; below 0: counted from its end
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    from: f64,
    /// Seconds to play; 0: to its end
    #[arg(long, default_value_t = 0.0)]
    duration: f64,
    /// Simulate the recorded inputs again instead of showing the recorded states
    #[arg(long)]
    resimulate: bool,
    /// Check every frame against the recorded hashes
    #[arg(long)]
    verify: bool,
}

impl ReplayArgs {
    /// The recorded time that is meant.
    fn span(&self, recording: &mut Recording) -> anyhow::Result<(u64, u64)> {
        ensure!(
            self.from.is_finite() && (0.0..=1e9).contains(&self.duration),
            "--from {} --duration {}: seconds, and no negative duration",
            self.from,
            self.duration
        );
        let whole = recording.duration_nanos()?;
        let nanos = |seconds: f64| (seconds.abs() * 1e9) as u64;
        let from = match self.from < 0.0 {
            true => whole.saturating_sub(nanos(self.from)),
            false => nanos(self.from),
        };
        ensure!(
            from < whole,
            "--from is {} s, the recording is {:.2} s long",
            self.from,
            whole as f64 / 1e9
        );
        let until =
            if self.duration > 0.0 { from.saturating_add(nanos(self.duration)) } else { whole };
        Ok((from, until.min(whole)))
    }
}

/// Plays it.
pub(crate) fn replay(args: &ReplayArgs) -> anyhow::Result<()> {
    let mut recording = Recording::open(&saved_path(&args.file.to_string_lossy())?)?;
    let (from, until) = args.span(&mut recording)?;
    if args.resimulate {
        return again(&mut recording, from, until);
    }
    if args.verify {
        return verify(&mut recording, from, until);
    }
    Err(anyhow!("say --verify or --resimulate"))
}

fn again(recording: &mut Recording, from: u64, until: u64) -> anyhow::Result<()> {
    let begin = clock::now_nanos();
    let told = resimulate(recording, from, until)?;
    let seconds = (clock::now_nanos() - begin) as f64 / 1e9;
    if let Some(difference) = told.difference {
        return Err(anyhow!("{}: {difference}", recording.path().display()));
    }
    say!(
        "{} frames simulated again, every state hash as recorded; {:.1} s in {seconds:.1} s",
        told.frames,
        told.sim_nanos as f64 / 1e9,
    );
    Ok(())
}

/// Reads every frame and checks its sum.
fn verify(recording: &mut Recording, from: u64, until: u64) -> anyhow::Result<()> {
    let path = recording.path().display().to_string();
    let profile = recording.told().profile;
    ensure!(
        profile == ::record::Profile::State,
        "{path} is a recording of profile {}; only `state` keeps sums of what was shown{}",
        profile.name(),
        if profile.has_inputs() { "; use --resimulate" } else { "" }
    );
    let begin = clock::now_nanos();
    let (mut frames, mut sim_nanos) = (0u64, 0);
    for segment in recording.segment_at(from)..recording.segments() {
        if recording.start_nanos(segment) >= until {
            break;
        }
        for moment in recording.moments(segment)? {
            let frame = moment.stamp.frame;
            ensure!(moment.is_as_shown(), "{path}: {frame} is not as it was shown");
            frames += 1;
            sim_nanos += moment.delta_nanos;
        }
    }
    let seconds = (clock::now_nanos() - begin) as f64 / 1e9;
    say!(
        "{frames} frames read, every one as it was shown; {:.1} s in {seconds:.3} s, {:.0} times real time",
        sim_nanos as f64 / 1e9,
        sim_nanos as f64 / 1e9 / seconds,
    );
    Ok(())
}
