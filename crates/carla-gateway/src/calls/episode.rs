//! The world as a whole: its map, its settings, its weather, its streams.

use std::path::PathBuf;

use client_lib::Command;

use super::{
    Call,
    surroundings::{light_up, our_layers},
};
use crate::{
    args::Refusal,
    settings::EpisodeSettings,
    stream::{WORLD, token as token_of},
    weather::CarlaWeather,
    wire::write_transform,
};

/// Where CARLA keeps its maps.
const FOLDER: &str = "Carla/Maps/";

pub(super) fn info(call: &mut Call) -> Result<(), Refusal> {
    let token = token_of(WORLD, call.ports.streams);
    call.out.list(2).uint(call.bridge.episode).list(1).bin(&token);
    Ok(())
}

/// The way to a stream. Who asks will come: what it listens to is measured from the next frame on.
pub(super) fn token(call: &mut Call) -> Result<(), Refusal> {
    let stream = call.args.u32()?;
    if let Some(sensor) = call.bridge.cast.sensor_of(stream) {
        call.bridge.make_rig(sensor)?;
        call.bridge.streams.expect(stream);
    } else if stream == WORLD {
        call.bridge.streams.expect(stream);
    }
    call.out.list(1).bin(&token_of(stream, call.ports.streams));
    Ok(())
}

pub(super) fn map_info(call: &mut Call) -> Result<(), Refusal> {
    let points = call.bridge.client.spawn_points()?;
    let name = call.bridge.statics.map_name();
    call.out.list(2).text(&format!("{FOLDER}{name}")).list(points.len());
    points.iter().for_each(|pose| write_transform(pose, call.out));
    Ok(())
}

pub(super) fn map_data(call: &mut Call) -> Result<(), Refusal> {
    call.out.text(&call.bridge.statics.episode.open_drive);
    Ok(())
}

pub(super) fn available_maps(call: &mut Call) -> Result<(), Refusal> {
    let names = call.bridge.client.available_maps()?;
    call.out.list(names.len());
    for name in names {
        call.out.text(&format!("/Game/{FOLDER}{name}"));
    }
    Ok(())
}

/// What clients keep on their own disk: where people walk.
pub(super) fn files(call: &mut Call) -> Result<(), Refusal> {
    let folder = call.args.text()?;
    match call.bridge.statics.walks().filter(|_| folder.contains("Nav")) {
        Some(walks) => call.out.list(1).text(&walks.name),
        None => call.out.list(0),
    };
    Ok(())
}

pub(super) fn file(call: &mut Call) -> Result<(), Refusal> {
    let name = call.args.text()?;
    let statics = &call.bridge.statics;
    let walks = statics.walks().filter(|walks| walks.name.ends_with(name) && !name.is_empty());
    let walks = walks.ok_or_else(|| Refusal::from(format!("there is no file {name:?}")))?;
    call.out.bin(&walks.file);
    Ok(())
}

pub(super) fn navigation_mesh(call: &mut Call) -> Result<(), Refusal> {
    call.out.bin(call.bridge.statics.walks().map_or(&[], |walks| &walks.file));
    Ok(())
}

/// Under this name CARLA's clients load the text that they sent.
const SENT: &str = "OpenDriveMap";

/// A map's text, for the load that follows. What the road's mesh is to be like is ours to say.
pub(super) fn take_open_drive(call: &mut Call) -> Result<(), Refusal> {
    let text = call.args.text()?;
    let path = sent_file(call);
    let told = |e| Refusal::from(format!("{}: {e}", path.display()));
    std::fs::write(&path, text).map_err(told)
}

fn sent_file(call: &Call) -> PathBuf {
    call.bridge.client.instance().root().join(format!("{SENT}.xodr"))
}

/// Another world in the place of this one, or the same anew.
pub(super) fn load(call: &mut Call) -> Result<(), Refusal> {
    let wanted = call.args.text()?;
    let reset_settings = call.args.bool().unwrap_or(true);
    let hidden_layers = our_layers(!call.args.u32().unwrap_or(u32::MAX));
    let sent = sent_file(call);
    // The client says the name under which the map runs when it wants the same anew.
    let running = format!("{FOLDER}{}", call.bridge.statics.map_name());
    let name = match wanted.strip_prefix("/Game/").unwrap_or(wanted) {
        SENT => sent.to_str().unwrap_or(SENT),
        same if same == running => "",
        _ => wanted,
    };
    call.bridge.load_world(name, hidden_layers)?;
    if reset_settings {
        change(call, EpisodeSettings::of(&client_lib::Settings::default()))?;
    }
    Ok(())
}

pub(super) fn settings(call: &mut Call) -> Result<(), Refusal> {
    let bus = call.bridge.client.settings();
    call.bridge.settings.follow(&bus);
    call.bridge.settings.write(call.out);
    Ok(())
}

pub(super) fn set_settings(call: &mut Call) -> Result<(), Refusal> {
    let wanted = EpisodeSettings::read(&mut call.args)?;
    change(call, wanted)?;
    call.out.uint(call.bridge.shown());
    Ok(())
}

fn change(call: &mut Call, wanted: EpisodeSettings) -> Result<(), Refusal> {
    let now = call.bridge.client.settings();
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

pub(super) fn weather(call: &mut Call) -> Result<(), Refusal> {
    call.bridge.weather.write(call.out);
    Ok(())
}

pub(super) fn set_weather(call: &mut Call) -> Result<(), Refusal> {
    let weather = CarlaWeather::read(&mut call.args)?;
    let bus = weather.to_bus();
    call.bridge.command(Command::SetWeather(bus));
    if let Some(commands) = call.bridge.street.see(bus.sun_altitude_rad < 0.0) {
        light_up(call, commands);
    }
    call.bridge.weather = weather;
    Ok(())
}

/// Where the traffic manager is: at the address under which this client found us.
pub(super) fn manager(call: &mut Call) -> Result<(), Refusal> {
    call.out.list(2).text(&call.peer.local.ip().to_string()).uint(call.ports.manager.into());
    Ok(())
}
