//! CARLA's recorder and replayer: what is written and shown is the host's, the words are CARLA's.

use std::path::{Path, PathBuf};

use client_lib::{Profile, Replay, saved_path};
use glam::{Quat, vec3};
use record::Recording;

use super::Call;
use crate::{
    args::Refusal,
    log::{self, Source},
    replay::{Follow, SPECTATOR_BACK_M, SPECTATOR_UP_M},
    tables,
    wire::transform,
};

pub(super) fn start(call: &mut Call) -> Result<(), Refusal> {
    let name = call.args.text()?;
    // All additional data is kept anyway.
    let path = call.bridge.client.start_recorder(name, Profile::State)?;
    call.out.text(&path.display().to_string());
    Ok(())
}

pub(super) fn stop(call: &mut Call) -> Result<(), Refusal> {
    call.bridge.client.stop_recorder()?;
    Ok(())
}

/// What a recording says, or in CARLA's words that there is none.
fn tell(
    call: &mut Call,
    table: impl FnOnce(&mut Source, &mut Call) -> Result<String, Refusal>,
) -> Result<(), Refusal> {
    let name = call.args.text()?;
    let path = saved_path(name)?;
    let text = if path.exists() {
        let mut source = Source::open(&path).map_err(refusal)?;
        table(&mut source, call)?
    } else {
        format!("File {name} not found on server\n")
    };
    call.out.text(&text);
    Ok(())
}

fn refusal(why: anyhow::Error) -> Refusal {
    Refusal::from(format!("{why:#}"))
}

pub(super) fn file_info(call: &mut Call) -> Result<(), Refusal> {
    tell(call, |recording, call| {
        let all = call.args.bool()?;
        tables::file_info(recording, all).map_err(refusal)
    })
}

pub(super) fn collisions(call: &mut Call) -> Result<(), Refusal> {
    tell(call, |recording, call| {
        let mut kind = || {
            let code = call.args.u32()?;
            char::from_u32(code).ok_or_else(|| Refusal::from(format!("{code} is no letter")))
        };
        let kinds = [kind()?, kind()?];
        Ok(tables::collisions(recording, kinds).map_err(refusal)?.text())
    })
}

pub(super) fn blocked(call: &mut Call) -> Result<(), Refusal> {
    tell(call, |recording, call| {
        let (time_s, distance_cm) = (call.args.f64()?, call.args.f64()?);
        Ok(tables::blocked(recording, time_s, distance_cm).map_err(refusal)?.text())
    })
}

pub(super) fn replay(call: &mut Call) -> Result<(), Refusal> {
    let name = call.args.text()?;
    let (from_s, duration_s) = (call.args.f64()?, call.args.f64()?);
    let follow = call.args.u32()?;
    // Sensors are not recorded: there are none to replay.
    call.args.bool()?;
    let usual = || {
        let down = Quat::from_rotation_y(25f32.to_radians());
        client_lib::Pose::new(vec3(-SPECTATOR_BACK_M, 0.0, SPECTATOR_UP_M), down)
    };
    let offset = if call.args.len() > 0 { transform(&mut call.args)? } else { usual() };
    let path = saved_path(name)?;
    if !path.exists() {
        call.out.text(&format!("Replaying File: {name}\nFile {name} not found on server\n"));
        return Ok(());
    }
    let passing = if log::is_log(&path) { Some(recording_of(call, &path)?) } else { None };
    let shown = passing.as_ref().map_or(&path, |passing| &passing.0);
    let told = |e: record::RecordError| Refusal::from(e.to_string());
    let total_s =
        Recording::open(shown).map_err(told)?.duration_nanos().map_err(told)? as f64 / 1e9;
    let replayer = &call.bridge.replayer;
    let (time_factor, ignore_hero) = (replayer.time_factor, replayer.ignore_hero);
    let replay = Replay { from_s, duration_s, time_factor, ignore_hero };
    // The host has the file open when this returns.
    call.bridge.client.start_replay(&shown.to_string_lossy(), replay)?;
    // It may be another world by now.
    call.bridge.show();
    let from_s = if from_s < 0.0 { (total_s + from_s).max(0.0) } else { from_s.min(total_s) };
    let until_s = if duration_s > 0.0 { (from_s + duration_s).min(total_s) } else { total_s };
    let lasts_s = (until_s - from_s) / f64::from(time_factor.max(1e-6));
    let now_nanos = call.bridge.client.world().header().stamp.sim_time_nanos;
    call.bridge.replayer.follow = (follow != 0).then_some(Follow {
        actor: follow,
        offset,
        until_nanos: now_nanos + (lasts_s * 1e9) as u64,
    });
    call.out.text(&format!(
        "Replaying File: {}\nTotal time recorded: {total_s}\nReplaying from {from_s} s - \
         {until_s} s ({total_s} s) at {time_factor:.1}x\n",
        path.display()
    ));
    Ok(())
}

/// A file that is there while the host opens it.
struct Passing(PathBuf);

impl Drop for Passing {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// What a log of CARLA's shows, as a recording in the world of its map, which is loaded if another
/// one runs.
fn recording_of(call: &mut Call, path: &Path) -> Result<Passing, Refusal> {
    let map = log::open(path).map_err(refusal)?.head().map.clone();
    let map = map.rsplit('/').next().unwrap_or_default().trim_end_matches(".xodr");
    if map != call.bridge.statics.map_name() {
        call.bridge.load_world(map, 0)?;
    }
    let passing = Passing(path.with_added_extension(format!("{}.mcap", std::process::id())));
    let episode = call.bridge.statics.episode.clone();
    for blueprint in log::import(path, &passing.0, episode).map_err(refusal)? {
        ::log::warn!("nothing here looks like {blueprint:?}; a replay leaves it out");
    }
    Ok(passing)
}

pub(super) fn stop_replay(call: &mut Call) -> Result<(), Refusal> {
    let keep_actors = call.args.bool()?;
    call.bridge.replayer.follow = None;
    call.bridge.client.stop_replay(keep_actors)?;
    Ok(())
}

pub(super) fn time_factor(call: &mut Call) -> Result<(), Refusal> {
    let factor = call.args.f32()?;
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(format!("a replay's time factor is {factor}, not above 0").into());
    }
    call.bridge.replayer.time_factor = factor;
    Ok(())
}

pub(super) fn ignore_hero(call: &mut Call) -> Result<(), Refusal> {
    call.bridge.replayer.ignore_hero = call.args.bool()?;
    Ok(())
}

/// The spectator is never part of a recording here: it is ignored already.
pub(super) fn ignore_spectator(call: &mut Call) -> Result<(), Refusal> {
    call.args.bool().map(drop)
}
