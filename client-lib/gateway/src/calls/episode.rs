//! The world as a whole: its map, its settings, its weather, its streams.

use client_lib::Wish;

use super::Call;
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
    let name = call.bridge.statics.map_name();
    call.out.list(1).text(&format!("/Game/{FOLDER}{name}"));
    Ok(())
}

/// The same map anew: whatever clients spawned is gone, time goes on.
pub(super) fn load(call: &mut Call) -> Result<(), Refusal> {
    let wanted = call.args.text()?;
    let reset_settings = call.args.bool().unwrap_or(true);
    let name = call.bridge.statics.map_name().to_owned();
    let plain = wanted.rsplit('/').next().unwrap_or_default();
    if !plain.is_empty() && plain != name {
        return Err(format!(
            "map {plain:?} is not the one that runs, which is {name:?}; start the simulator with --map {plain}"
        )
        .into());
    }
    call.bridge.destroy_everybody()?;
    if reset_settings {
        let now = call.bridge.client.settings();
        let settings = client_lib::Settings { synchronous: 0, ..now };
        change(call, EpisodeSettings::of(&settings))?;
    }
    call.bridge.begin_episode();
    call.bridge.show_state();
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
        call.bridge.request_one("settings", Wish::SetSettings(settings))?;
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
    call.bridge.wish(Wish::SetWeather(weather.to_bus()));
    call.bridge.weather = weather;
    Ok(())
}

/// Where the traffic manager is: at the address under which this client found us.
pub(super) fn manager(call: &mut Call) -> Result<(), Refusal> {
    call.out.list(2).text(&call.peer.local.ip().to_string()).uint(call.ports.manager.into());
    Ok(())
}
