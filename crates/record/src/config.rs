//! What is recorded, and where.

use std::path::PathBuf;

use protocol::{ActorId, Episode};

use crate::Profile;

/// What a recording is made from, and where it is written.
#[derive(Clone, Debug)]
pub struct RecordingConfig {
    /// The file to write.
    pub path: PathBuf,
    /// How much of each frame is kept.
    pub profile: Profile,
    /// The episode that is recorded: map and seed.
    pub episode: Episode,
    /// The ids of the blueprint catalogue, by their index.
    pub blueprints: Vec<String>,
    /// The roles of the actors that exist at the start and have one.
    pub roles: Vec<(ActorId, String)>,
}
