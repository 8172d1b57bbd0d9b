//! The cameras and lidars of a page: one bundle for each actor that carries some.

use std::time::Instant;

use client_lib::{
    ActorId, CameraOutputs, Client, ClientError, Frame, LidarOptions, Measurement, Pose, Sensor,
    SensorBundle,
    glam::{EulerRot, Quat, Vec3},
};

use crate::{
    ViewError, encode,
    flow::Flow,
    message::{Output, Tile},
};

/// Tiles of one page, at most.
pub(crate) const TILES_MAX: usize = 8;
/// Sizes of an image in pixels, and of a lidar in columns and channels.
const SIZE_MAX: [u32; 2] = [1920, 1080];
const LIDAR_SIZE_MAX: [u32; 2] = [2048, 128];
/// Elevations of the lidar's lowest and highest channel, degrees, and its range in metres: those of
/// the lidar of `omnibus collect`.
pub(crate) const LIDAR_ELEVATIONS_DEG: [f32; 2] = [-30.0, 10.0];
pub(crate) const LIDAR_RANGE_M: f32 = 100.0;
/// Measurements that are held at a time: the newest, the one that takes its place, and a still newer one
/// that has arrived meanwhile.
const BORROWED_MAX: u32 = 3;

/// The tiles of a page.
#[derive(Debug, Default)]
pub(crate) struct Tiles {
    tiles: Vec<Shown>,
    carriers: Vec<Carrier>,
}

/// A tile, and what the page has of it.
#[derive(Debug)]
struct Shown {
    tile: Tile,
    flow: Flow,
    /// The frame that was sent last.
    sent: Frame,
}

/// The sensors on one actor, or in the world.
#[derive(Debug)]
struct Carrier {
    actor: ActorId,
    /// The channels of the tiles, in the order of the sensors.
    channels: Vec<usize>,
    bundle: SensorBundle,
    newest: Option<Measurement>,
    /// Whether the actor was in a snapshot: a new one is in the next.
    is_seen: bool,
}

impl Tiles {
    /// Replaces the tiles.
    ///
    /// # Errors
    ///
    /// [`ViewError`] if they are too many or too large, or the host refuses them; there are no tiles
    /// then.
    pub(crate) fn replace(&mut self, client: &mut Client, tiles: &[Tile]) -> Result<(), ViewError> {
        *self = Tiles::default();
        if tiles.len() > TILES_MAX {
            return Err(ViewError::Tiles { count: tiles.len(), most: TILES_MAX });
        }
        tiles.iter().try_for_each(check)?;
        let shown = |tile: &Tile| Shown { tile: *tile, flow: Flow::default(), sent: Frame(0) };
        self.tiles = tiles.iter().map(shown).collect();
        Ok(self.mount(client).inspect_err(|_| *self = Tiles::default())?)
    }

    /// Creates the bundles.
    fn mount(&mut self, client: &mut Client) -> Result<(), ClientError> {
        let actor = |shown: &Shown| shown.tile.on.map_or(ActorId::NONE, ActorId);
        let mut actors: Vec<ActorId> = self.tiles.iter().map(actor).collect();
        actors.sort_unstable();
        actors.dedup();
        for carrier in actors {
            let channels: Vec<usize> =
                (0..self.tiles.len()).filter(|i| actor(&self.tiles[*i]) == carrier).collect();
            let sensors =
                channels.iter().map(|channel| sensor(*channel, &self.tiles[*channel].tile));
            let bundle = client.create_bundle("view", carrier, sensors, BORROWED_MAX)?;
            let is_seen = false;
            self.carriers.push(Carrier { actor: carrier, channels, bundle, newest: None, is_seen });
        }
        Ok(())
    }

    /// Notes that the page has drawn a message of a tile.
    pub(crate) fn acknowledge(&mut self, channel: u32) {
        if let Some(shown) = self.tiles.get_mut(channel as usize) {
            shown.flow.acknowledge(Instant::now());
        }
    }

    /// Takes measurements in and sends the newest of each tile that may be sent. Sensors of a page
    /// that has stalled are destroyed, and created again when it goes on.
    ///
    /// # Errors
    ///
    /// [`ClientError`] if the bundles cannot be created again.
    pub(crate) fn send(
        &mut self,
        client: &mut Client,
        mut send: impl FnMut(Vec<u8>) -> bool,
    ) -> Result<(), ClientError> {
        let now = Instant::now();
        if self.tiles.iter().any(|shown| shown.flow.is_stalled(now)) {
            self.carriers.clear();
            return Ok(());
        }
        if self.carriers.is_empty() && !self.tiles.is_empty() {
            self.mount(client).inspect_err(|_| *self = Tiles::default())?;
        }
        for carrier in &mut self.carriers {
            if let Some(newest) = carrier.bundle.latest()? {
                carrier.newest = Some(newest);
            }
            let Some(newest) = &carrier.newest else { continue };
            for (sensor, channel) in carrier.channels.iter().enumerate() {
                let Shown { tile, flow, sent } = &mut self.tiles[*channel];
                if newest.frame() <= *sent || !flow.is_open(now) {
                    continue;
                }
                match encode::message(newest, sensor, tile.output, *channel as u32) {
                    Ok(Some(message)) => {
                        if send(message) {
                            flow.send(now);
                            *sent = newest.frame();
                        }
                    }
                    Ok(None) => {}
                    Err(e) => log::warn!("{} tile {channel} was not encoded: {e}", newest.frame()),
                }
            }
        }
        Ok(())
    }

    /// Creates the sensors anew: those on replayed actors end when another part is shown.
    pub(crate) fn remount(&mut self) {
        self.carriers.clear();
    }

    /// Drops tiles whose actors were destroyed; returns one of these actors.
    pub(crate) fn drop_orphans(&mut self, client: &Client) -> Option<ActorId> {
        let world = client.world();
        let mut gone = None;
        for carrier in &mut self.carriers {
            let is_there = carrier.actor == ActorId::NONE || world.actor(carrier.actor).is_some();
            if carrier.is_seen && !is_there {
                gone = Some(carrier.actor);
            }
            carrier.is_seen |= is_there;
        }
        if gone.is_some() {
            *self = Tiles::default();
        }
        gone
    }
}

fn check(tile: &Tile) -> Result<(), ViewError> {
    let most = if tile.output == Output::Lidar { LIDAR_SIZE_MAX } else { SIZE_MAX };
    let [width, height] = tile.size;
    if (1..=most[0]).contains(&width) && (1..=most[1]).contains(&height) {
        return Ok(());
    }
    Err(ViewError::TileSize { size: tile.size, most })
}

fn sensor(channel: usize, tile: &Tile) -> Sensor {
    let rotation = Quat::from_euler(EulerRot::ZYX, tile.yaw_rad, tile.pitch_rad, 0.0);
    let pose = Pose::new(Vec3::from_array(tile.position_m), rotation);
    let name = format!("tile{channel}");
    let [width, height] = tile.size;
    let outputs = match tile.output {
        Output::Color => CameraOutputs::COLOR,
        Output::Depth => CameraOutputs::DEPTH,
        Output::Tags => CameraOutputs::TAG,
        Output::Instances => CameraOutputs::INSTANCE,
        Output::Lidar => {
            let elevations = LIDAR_ELEVATIONS_DEG.map(f32::to_radians);
            let options = LidarOptions::new(height, width, elevations, LIDAR_RANGE_M);
            return Sensor::lidar(&name, pose, options);
        }
    };
    Sensor::camera(&name, pose, width, height, tile.fov_rad).outputs(outputs)
}
