//! What a data set has to offer to be shown: frames of files, read when a page shows them.

use std::{collections::BTreeMap, error::Error, time::Duration};

use client_lib::{ActorKind, LightPhase, Pose, Weather};

/// Why a frame cannot be shown.
pub type ReadError = Box<dyn Error + Send + Sync>;

/// A data set, of one scene or of several in a row.
pub trait DataSet: Send + Sync {
    /// Returns the number of frames of all scenes, which is not zero.
    fn frames(&self) -> usize;

    /// Returns the scene of a frame. Frames are counted over all scenes, here and below.
    fn scene_of(&self, index: usize) -> usize;

    /// Returns a scene.
    ///
    /// # Errors
    ///
    /// A file is missing or damaged.
    fn scene(&self, scene: usize) -> Result<StoredScene, ReadError>;

    /// Returns a frame without images and points.
    ///
    /// # Errors
    ///
    /// A file is missing or damaged.
    fn frame(&self, index: usize) -> Result<StoredFrame, ReadError>;

    /// Returns an output of a sensor.
    ///
    /// # Errors
    ///
    /// There is no such sensor or output, or a file is missing or damaged.
    fn measured(&self, index: usize, sensor: &str, output: &str) -> Result<Measured, ReadError>;
}

/// What holds for all frames of a scene.
#[derive(Clone, Debug)]
pub struct StoredScene {
    /// The name of the scene.
    pub name: String,
    /// The name of its map.
    pub map: String,
    /// The OpenDRIVE text of the map.
    pub open_drive: String,
    /// Each sensor with its outputs: `color`, `depth`, `tags` and `instances` of a camera, `lidar`.
    pub sensors: Vec<(String, Vec<&'static str>)>,
    /// Where the ego is in each frame: x, y in world space, metres.
    pub path_m: Vec<[f32; 2]>,
}

/// One frame.
#[derive(Clone, Debug)]
pub struct StoredFrame {
    /// The ordinal of the simulation step.
    pub frame: u64,
    /// Simulated time since the world began.
    pub sim_time: Duration,
    /// The weather.
    pub weather: Weather,
    /// The id of the ego, which is one of the actors.
    pub ego: u32,
    /// The ego and the actors that its sensors saw.
    pub actors: Vec<StoredActor>,
    /// What each camera saw.
    pub boxes: BTreeMap<String, Vec<StoredBox>>,
}

/// An actor in a frame.
#[derive(Clone, Debug)]
pub struct StoredActor {
    /// Its id.
    pub id: u32,
    /// Its kind.
    pub kind: ActorKind,
    /// Its blueprint.
    pub blueprint: String,
    /// The middle of its box, in world space.
    pub pose: Pose,
    /// Half of length and width, metres.
    pub half_extents_m: [f32; 2],
    /// In world space.
    pub velocity_mps: [f32; 3],
    /// What a traffic light shows.
    pub phase: Option<LightPhase>,
}

/// Something in the image of a camera.
#[derive(Clone, Debug)]
pub struct StoredBox {
    /// Its id in instance images.
    pub id: u32,
    /// The code of its semantic tag.
    pub tag: u8,
    /// The name of its semantic tag.
    pub name: String,
    /// Left, top, right, bottom edge of its visible pixels; right and bottom are exclusive.
    pub visible_px: [u32; 4],
}

/// An output of a sensor.
#[derive(Clone, Debug)]
pub enum Measured {
    /// A colour image: a PNG or JPEG file.
    Color(Vec<u8>),
    /// Depths along the optical axis.
    Depth {
        /// Width and height.
        size: [u32; 2],
        /// Metres, by rows; infinite for the sky.
        depths_m: Vec<f32>,
    },
    /// Semantic tags.
    Tags {
        /// Width and height.
        size: [u32; 2],
        /// Codes, by rows.
        codes: Vec<u8>,
    },
    /// Ids of actors and objects.
    Instances {
        /// Width and height.
        size: [u32; 2],
        /// Ids, by rows; 0 for none.
        ids: Vec<u32>,
    },
    /// Returns of a lidar.
    Points {
        /// x, y, z in sensor space, metres, and the intensity.
        points: Vec<[f32; 4]>,
        /// The id and the semantic tag of each.
        labels: Vec<[u32; 2]>,
    },
}
