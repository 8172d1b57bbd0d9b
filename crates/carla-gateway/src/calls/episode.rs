//! The episode: its map, settings, weather and streams.

use std::path::PathBuf;

use client_lib::wire::Command;

use crate::{
    args::RpcError,
    calls::{
        call::Call,
        map::FOLDER,
        surroundings::{layers_from_carla, queue_light_commands},
    },
    settings::EpisodeSettings,
    stream::{WORLD, token as token_of},
    street_lights::is_night,
    weather::CarlaWeather,
};

pub(super) fn info(call: &mut Call) -> Result<(), RpcError> {
    let token = token_of(WORLD, call.ports.streams);
    call.out.list(2).uint(call.bridge.episode.number).list(1).bin(&token);
    Ok(())
}

/// Returns the token of a stream. The client is about to connect, so the sensor measures from the
/// next frame on.
pub(super) fn token(call: &mut Call) -> Result<(), RpcError> {
    let stream = call.args.u32()?;
    if let Some(sensor) = call.bridge.episode.actors.sensor_of(stream) {
        call.bridge.create_bundle(sensor)?;
        call.bridge.streams.expect(stream);
    } else if stream == WORLD {
        call.bridge.end_load(call.peer);
        call.bridge.streams.expect(stream);
    }
    call.out.list(1).bin(&token_of(stream, call.ports.streams));
    Ok(())
}

pub(super) fn available_maps(call: &mut Call) -> Result<(), RpcError> {
    let names = call.bridge.client.available_maps()?;
    call.out.list(names.len());
    for name in names {
        call.out.text(&format!("/Game/{FOLDER}{name}"));
    }
    Ok(())
}

/// The name by which CARLA's clients load the map that they have sent.
const SENT_MAP: &str = "OpenDriveMap";

/// Stores the text of a map, which the next call loads. The parameters of CARLA's mesh generation
/// are ignored.
pub(super) fn receive_open_drive(call: &mut Call) -> Result<(), RpcError> {
    let text = call.args.text()?;
    let path = sent_file(call);
    let error = |e| RpcError::from(format!("{}: {e}", path.display()));
    call.bridge.unlocked(|| std::fs::write(&path, text)).map_err(error)
}

fn sent_file(call: &Call) -> PathBuf {
    call.bridge.client.instance().root().join(format!("{SENT_MAP}.xodr"))
}

/// Loads another world, or the same map again.
pub(super) fn load(call: &mut Call) -> Result<(), RpcError> {
    let wanted = call.args.text()?;
    let reset_settings = call.args.bool().unwrap_or(true);
    let hidden_layers = layers_from_carla(!call.args.u32().unwrap_or(u32::MAX));
    let sent = sent_file(call);
    // To load the same map again, the client sends the name of the current map.
    let running = format!("{FOLDER}{}", call.bridge.statics.map_name());
    let name = match wanted.strip_prefix("/Game/").unwrap_or(wanted) {
        SENT_MAP => sent.to_str().unwrap_or(SENT_MAP),
        same if same == running || same.is_empty() => "",
        other => map_name(other)?,
    };
    call.bridge.load_world(name, hidden_layers, Some(call.peer))?;
    if reset_settings {
        change(call, EpisodeSettings::of(&client_lib::wire::Settings::default()))?;
    }
    Ok(())
}

/// Returns the plain name of a map: clients load maps by name only, not any file of the user.
fn map_name(wanted: &str) -> Result<&str, RpcError> {
    let name = wanted.strip_prefix(FOLDER).unwrap_or(wanted);
    let stem = name.len().checked_sub(5).and_then(|at| name.split_at_checked(at));
    let name = match stem {
        Some((stem, extension)) if extension.eq_ignore_ascii_case(".xodr") => stem,
        _ => name,
    };
    if name.is_empty() || name.contains(['/', '\\', '\0']) {
        return Err(format!(
            "{wanted:?} is not the name of a map; clients load maps by name (see \
             get_available_maps), those of files too: omnibus run --maps DIR"
        )
        .into());
    }
    Ok(name)
}

pub(super) fn settings(call: &mut Call) -> Result<(), RpcError> {
    let bus = call.bridge.client.wire_settings();
    call.bridge.settings.follow(&bus);
    call.bridge.settings.write(call.out);
    Ok(())
}

pub(super) fn set_settings(call: &mut Call) -> Result<(), RpcError> {
    let wanted = EpisodeSettings::read(&mut call.args)?;
    change(call, wanted)?;
    call.out.uint(call.bridge.published_frame());
    Ok(())
}

fn change(call: &mut Call, wanted: EpisodeSettings) -> Result<(), RpcError> {
    let now = call.bridge.client.wire_settings();
    let settings = wanted.to_bus(&now)?;
    if settings != now {
        if wanted.is_synchronous {
            call.bridge.client.take_tick()?;
        }
        call.bridge.request_one("settings", Command::SetSettings(settings))?;
    }
    call.bridge.settings = wanted;
    Ok(())
}

pub(super) fn weather(call: &mut Call) -> Result<(), RpcError> {
    let episode = &call.bridge.episode;
    CarlaWeather::if_it_holds(episode.weather, &episode.standing.weather).write(call.out);
    Ok(())
}

pub(super) fn set_weather(call: &mut Call) -> Result<(), RpcError> {
    let weather = CarlaWeather::read(&mut call.args)?;
    let was_night = is_night(&call.bridge.episode.standing);
    call.bridge.command(Command::SetWeather(weather.to_bus()));
    let episode = &mut call.bridge.episode;
    episode.weather = Some(weather);
    if let Some(commands) = episode.street_lights.at_dusk_or_dawn(was_night, &episode.standing) {
        queue_light_commands(call, commands);
    }
    Ok(())
}
