//! CARLA's recorder and replayer. The host records and replays; the texts are CARLA's.

use std::path::{Path, PathBuf};

use client_lib::{Command, Profile, Replay};
use glam::{Quat, vec3};
use record::Recording;

use crate::{
    args::RpcError,
    calls::call::Call,
    carla_log::{self, Source},
    replay::{Follow, SPECTATOR_BACK_M, SPECTATOR_UP_M},
    tables,
    wire::transform,
};

/// Most bytes of a table that a client receives.
const TABLE_MAX: usize = 256 << 20;

pub(super) fn start(call: &mut Call) -> Result<(), RpcError> {
    let path = call.recordings.path(call.args.text()?)?;
    let path = path.to_string_lossy();
    // A recording always contains CARLA's additional data.
    let command = Command::start_recorder(&path, Profile::State)?;
    let deadline = call.bridge.client.deadlines().answer;
    call.bridge.request_first("start_recorder", command, deadline)?;
    call.out.text(&path);
    Ok(())
}

pub(super) fn stop(call: &mut Call) -> Result<(), RpcError> {
    let deadline = call.bridge.client.deadlines().answer;
    call.bridge.request_first("stop_recorder", Command::stop_recorder(), deadline).map(drop)
}

/// Writes a table of a recording, or CARLA's message that the file does not exist.
///
/// The recording is read without the lock of the bridge: it may be long.
fn write(
    call: &mut Call,
    name: &str,
    table: impl FnOnce(&mut Source) -> anyhow::Result<String>,
) -> Result<(), RpcError> {
    let path = call.recordings.path(name)?;
    let text = if path.exists() {
        let read = || table(&mut Source::open(&path)?);
        call.bridge.unlocked(read).map_err(rpc_error)?
    } else {
        format!("File {name} not found on server\n")
    };
    call.out.text(&text);
    Ok(())
}

fn rpc_error(why: anyhow::Error) -> RpcError {
    RpcError::from(format!("{why:#}"))
}

pub(super) fn file_info(call: &mut Call) -> Result<(), RpcError> {
    let (name, all) = (call.args.text()?, call.args.bool()?);
    write(call, name, |recording| tables::file_info(recording, all, TABLE_MAX))
}

pub(super) fn collisions(call: &mut Call) -> Result<(), RpcError> {
    let name = call.args.text()?;
    let mut kind = || {
        let code = call.args.u32()?;
        char::from_u32(code).ok_or_else(|| RpcError::from(format!("{code} is not a character")))
    };
    let kinds = [kind()?, kind()?];
    write(call, name, |recording| Ok(tables::collisions(recording, kinds)?.text()))
}

pub(super) fn blocked(call: &mut Call) -> Result<(), RpcError> {
    let (name, time_s, distance_cm) = (call.args.text()?, call.args.f64()?, call.args.f64()?);
    write(call, name, |recording| Ok(tables::blocked(recording, time_s, distance_cm)?.text()))
}

pub(super) fn replay(call: &mut Call) -> Result<(), RpcError> {
    let name = call.args.text()?;
    let (from_s, duration_s) = (call.args.f64()?, call.args.f64()?);
    let follow = call.args.u32()?;
    // Sensors are not recorded and therefore not replayed.
    call.args.bool()?;
    let usual = || {
        let down = Quat::from_rotation_y(25f32.to_radians());
        client_lib::Pose::new(vec3(-SPECTATOR_BACK_M, 0.0, SPECTATOR_UP_M), down)
    };
    let offset = if call.args.len() > 0 { transform(&mut call.args)? } else { usual() };
    let path = call.recordings.path(name)?;
    if !path.exists() {
        call.out.text(&format!("Replaying File: {name}\nFile {name} not found on server\n"));
        return Ok(());
    }
    let temporary = if carla_log::is_log(&path) { Some(recording_of(call, &path)?) } else { None };
    let shown = temporary.as_ref().map_or(&path, |temporary| &temporary.0);
    let error = |e: record::RecordError| RpcError::from(e.to_string());
    let duration = || Recording::open(shown)?.duration_nanos();
    let total_s = call.bridge.unlocked(duration).map_err(error)? as f64 / 1e9;
    let replayer = &call.bridge.episode.replayer;
    let (time_factor, ignore_hero) = (replayer.time_factor, replayer.ignore_hero);
    let replay = Replay { from_s, duration_s, time_factor, ignore_hero };
    call.bridge.start_replay(Command::start_replay(&shown.to_string_lossy(), replay)?)?;
    let from_s = if from_s < 0.0 { (total_s + from_s).max(0.0) } else { from_s.min(total_s) };
    let until_s = if duration_s > 0.0 { (from_s + duration_s).min(total_s) } else { total_s };
    let lasts_s = (until_s - from_s) / f64::from(time_factor.max(1e-6));
    let now_nanos = call.bridge.client.world().header().stamp.sim_time_nanos;
    call.bridge.episode.replayer.follow = (follow != 0).then_some(Follow {
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

/// A file that is removed when this is dropped.
struct TemporaryFile(PathBuf);

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Converts a log of CARLA to a recording, and loads its map if another one is loaded.
fn recording_of(call: &mut Call, path: &Path) -> Result<TemporaryFile, RpcError> {
    let header = || Ok(carla_log::open(path)?.header().map.clone());
    let map: String = call.bridge.unlocked(header).map_err(rpc_error)?;
    let map = map.rsplit('/').next().unwrap_or_default().trim_end_matches(".xodr");
    if map != call.bridge.statics.map_name() {
        call.bridge.load_world(map, 0, None)?;
    }
    let temporary =
        TemporaryFile(path.with_added_extension(format!("{}.mcap", std::process::id())));
    let episode = call.bridge.statics.episode.clone();
    let import = || carla_log::import(path, &temporary.0, episode);
    for blueprint in call.bridge.unlocked(import).map_err(rpc_error)? {
        log::warn!(
            "unknown blueprint {blueprint:?} in {}: its actors are not replayed",
            path.display()
        );
    }
    Ok(temporary)
}

pub(super) fn stop_replay(call: &mut Call) -> Result<(), RpcError> {
    let keep_actors = call.args.bool()?;
    call.bridge.episode.replayer.follow = None;
    let deadline = call.bridge.client.deadlines().answer;
    call.bridge.request_first("stop_replay", Command::stop_replay(keep_actors), deadline).map(drop)
}

pub(super) fn time_factor(call: &mut Call) -> Result<(), RpcError> {
    let factor = call.args.f32()?;
    if !(factor > 0.0 && factor.is_finite()) {
        return Err(format!("time factor of a replay is {factor}, must be greater than 0").into());
    }
    call.bridge.episode.replayer.time_factor = factor;
    Ok(())
}

pub(super) fn ignore_hero(call: &mut Call) -> Result<(), RpcError> {
    call.bridge.episode.replayer.ignore_hero = call.args.bool()?;
    Ok(())
}

/// A recording never contains the spectator, so this call has no effect.
pub(super) fn ignore_spectator(call: &mut Call) -> Result<(), RpcError> {
    call.args.bool().map(drop)
}
