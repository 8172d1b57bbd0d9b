//! What page and server say to each other: JSON text, and binary messages with a header of 16 bytes.

use serde::{Deserialize, Serialize};

/// What a page requests.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Request {
    /// Replaces the tiles of the page; the channel of a tile is its place in the list.
    Tiles { tiles: Vec<Tile> },
    /// Replaces the tiles of a page of a data set.
    Sensors { tiles: Vec<SensorTile> },
    /// A message of this channel was drawn.
    Ack { channel: u32 },
    /// Shows the details of an actor with each state.
    Select { id: Option<u32> },
    /// Pedals and wheel of the page's own vehicle; the latest hold.
    Drive(Pedals),
    /// Spawns a vehicle near a point of the map, or where there is room.
    Spawn(SpawnRequest),
    /// Destroys an actor.
    Destroy { id: u32 },
    /// Hands the page's own vehicle to traffic, or takes it back.
    Autopilot { on: bool },
    /// Sets the weather.
    Weather(Sky),
    /// Stops time.
    Pause {},
    /// Computes one frame, and stops time before it if it passes.
    Step {},
    /// Lets time pass.
    Play {},
    /// Shows another part of a recording (seconds since its start) or of a data set (the index of a
    /// frame).
    Seek { to: f64 },
}

impl Request {
    /// The name in replies.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Request::Tiles { .. } => "tiles",
            Request::Sensors { .. } => "sensors",
            Request::Ack { .. } => "ack",
            Request::Select { .. } => "select",
            Request::Drive(_) => "drive",
            Request::Spawn(_) => "spawn",
            Request::Destroy { .. } => "destroy",
            Request::Autopilot { .. } => "autopilot",
            Request::Weather(_) => "weather",
            Request::Pause {} => "pause",
            Request::Step {} => "step",
            Request::Play {} => "play",
            Request::Seek { .. } => "seek",
        }
    }
}

/// One picture of a page.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tile {
    pub(crate) output: Output,
    /// The actor that carries the sensor; `None`: it stands in the world.
    pub(crate) on: Option<u32>,
    /// Position in the space of the actor or the world, metres.
    pub(crate) position_m: [f32; 3],
    /// Rotation about z, from x towards y.
    pub(crate) yaw_rad: f32,
    /// Rotation about the left-pointing y: positive looks down.
    pub(crate) pitch_rad: f32,
    /// Size of the image, pixels; of a lidar: columns and channels.
    pub(crate) size: [u32; 2],
    /// Horizontal field of view of a camera.
    pub(crate) fov_rad: f32,
}

/// One picture of a page of a data set.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTile {
    pub(crate) output: Output,
    pub(crate) sensor: String,
}

/// What a tile shows.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Output {
    Color,
    Depth,
    Tags,
    Instances,
    Lidar,
}

impl Output {
    /// Returns the name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Output::Color => "color",
            Output::Depth => "depth",
            Output::Tags => "tags",
            Output::Instances => "instances",
            Output::Lidar => "lidar",
        }
    }
}

/// Pedals and wheel.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Pedals {
    /// 0 to 1.
    pub(crate) throttle: f32,
    /// 0 to 1.
    pub(crate) brake: f32,
    /// −1 (full right) to 1 (full left).
    pub(crate) steer: f32,
    #[serde(default)]
    pub(crate) handbrake: bool,
    #[serde(default)]
    pub(crate) reverse: bool,
}

/// A vehicle to be spawned.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpawnRequest {
    pub(crate) blueprint: String,
    /// The free spawn point that is nearest to this one; without it, the first that is free.
    pub(crate) near_m: Option<[f32; 2]>,
    /// Whether traffic drives it.
    #[serde(default)]
    pub(crate) autopilot: bool,
    /// Whether the page drives it; it is destroyed with the page, and in place of the one before.
    #[serde(default)]
    pub(crate) ego: bool,
}

/// Weather and sun, in the units of `client_lib::Weather`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sky {
    pub(crate) cloudiness: f32,
    pub(crate) precipitation: f32,
    pub(crate) precipitation_deposits: f32,
    pub(crate) wind_intensity: f32,
    pub(crate) sun_azimuth_rad: f32,
    pub(crate) sun_altitude_rad: f32,
    pub(crate) fog_density: f32,
    pub(crate) fog_distance_m: f32,
    pub(crate) wetness: f32,
}

impl From<Sky> for client_lib::Weather {
    fn from(sky: Sky) -> client_lib::Weather {
        client_lib::Weather {
            cloudiness: sky.cloudiness,
            precipitation: sky.precipitation,
            precipitation_deposits: sky.precipitation_deposits,
            wind_intensity: sky.wind_intensity,
            sun_azimuth_rad: sky.sun_azimuth_rad,
            sun_altitude_rad: sky.sun_altitude_rad,
            fog_density: sky.fog_density,
            fog_distance_m: sky.fog_distance_m,
            wetness: sky.wetness,
        }
    }
}

impl From<client_lib::Weather> for Sky {
    fn from(weather: client_lib::Weather) -> Sky {
        Sky {
            cloudiness: weather.cloudiness,
            precipitation: weather.precipitation,
            precipitation_deposits: weather.precipitation_deposits,
            wind_intensity: weather.wind_intensity,
            sun_azimuth_rad: weather.sun_azimuth_rad,
            sun_altitude_rad: weather.sun_altitude_rad,
            fog_density: weather.fog_density,
            fog_distance_m: weather.fog_distance_m,
            wetness: weather.wetness,
        }
    }
}

/// What the server says in text, beside states.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum Reply<'a> {
    /// What is shown: first of all, and after another map was loaded.
    Hello {
        /// `simulator`, `recording` or `data_set`.
        source: &'a str,
        /// The name of the simulator, of the recording or of the scene.
        name: &'a str,
        map: &'a str,
        /// Id and half extents of the bounding box, metres.
        blueprints: Vec<(&'a str, [f32; 3])>,
        /// Colours of semantic tags by code, sRGB.
        tag_colors: Vec<[u8; 3]>,
        /// Sensors of a data set, with their outputs.
        sensors: &'a [(String, Vec<&'static str>)],
    },
    /// Where the ego of a scene is in each frame: x, y, metres.
    Path { points_m: &'a [[f32; 2]] },
    /// What the image of a tile that follows shows.
    Boxes { channel: u32, frame: u64, boxes: Vec<BoxLine<'a>> },
    /// A request was carried out.
    Done { request: &'static str, id: Option<u32> },
    /// A request was not carried out.
    Error { request: &'static str, message: String },
    /// Nothing follows.
    Ended { message: String },
}

/// Id, semantic tag, its name, and left, top, right, bottom edge in pixels.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct BoxLine<'a>(
    pub(crate) u32,
    pub(crate) u8,
    pub(crate) &'a str,
    pub(crate) [u32; 4],
);

/// The channel of states, in acknowledgements.
pub(crate) const STATE_CHANNEL: u32 = 255;

/// Kinds of binary messages.
pub(crate) mod kind {
    /// A JPEG file, or a PNG file of a data set.
    pub(crate) const IMAGE: u32 = 1;
    /// Points of a lidar: 8 bytes each.
    pub(crate) const POINTS: u32 = 2;
    /// The lanes of the map.
    pub(crate) const MAP: u32 = 3;
}

/// Returns a binary message that holds its header only: kind, channel, frame, little-endian.
pub(crate) fn binary(kind: u32, channel: u32, frame: u64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(64 << 10);
    bytes.extend(kind.to_le_bytes());
    bytes.extend(channel.to_le_bytes());
    bytes.extend(frame.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_read_and_a_wrong_one_names_its_fault() {
        let text = r#"{"type":"drive","throttle":1,"brake":0,"steer":-0.5}"#;
        let request: Request = serde_json::from_str(text).unwrap();
        assert!(matches!(request, Request::Drive(Pedals { steer: -0.5, handbrake: false, .. })));
        for (text, fault) in [
            (r#"{"type":"fly"}"#, "unknown variant `fly`"),
            (r#"{"type":"drive","throttle":1}"#, "missing field `brake`"),
            (r#"{"type":"step","frames":2}"#, "unknown field `frames`"),
        ] {
            let why = serde_json::from_str::<Request>(text).unwrap_err().to_string();
            assert!(why.contains(fault), "{why}");
        }
    }
}
