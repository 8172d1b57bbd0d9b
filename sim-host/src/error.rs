use bus::BusError;

use crate::maps::Unbuilt;

/// The cause why a host cannot start or continue.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The map cannot be loaded.
    #[error("{0}")]
    Map(String),
    /// The host was stopped before its world was built.
    #[error("stopped while the map was loaded")]
    Stopped,
    /// A stage could not be started.
    #[error("{role} does not start: {why}")]
    Start {
        /// The role of the stage.
        role: &'static str,
        /// The cause.
        why: String,
    },
    /// A stage died and is not restarted, because restarts are disabled or it dies repeatedly.
    #[error(
        "{participant} died in {frame} ({deaths} times in this frame) and is not restarted: {why}; all frames \
         before are complete"
    )]
    Died {
        /// The role of the stage.
        participant: String,
        /// Its exit message, or how the process ended.
        why: String,
        /// Number of deaths in this frame.
        deaths: u32,
        /// The frame.
        frame: protocol::Frame,
    },
    /// There is too little shared memory; nothing was created.
    #[error(
        "/dev/shm has {} MB free, a simulator needs {} MB and more for its sensors; enlarge it \
         (mount -o remount,size=2G /dev/shm, or docker run --shm-size 2g)",
        free >> 20,
        needed >> 20
    )]
    SharedMemory {
        /// Free bytes.
        free: u64,
        /// Required bytes.
        needed: u64,
    },
    /// An operation of the system failed.
    #[error("{0}")]
    System(#[from] std::io::Error),
}

impl From<Unbuilt> for HostError {
    fn from(unbuilt: Unbuilt) -> HostError {
        match unbuilt {
            Unbuilt::Stopped => HostError::Stopped,
            Unbuilt::Failed(why) => HostError::Map(why),
        }
    }
}
