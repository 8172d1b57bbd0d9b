use bus::BusError;

/// Why a host cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The map.
    #[error("{0}")]
    Map(String),
    /// A stage could not be started.
    #[error("{role} does not start: {why}")]
    Start {
        /// Which.
        role: &'static str,
        /// Why.
        why: String,
    },
    /// A stage died and is not brought back: the host was told not to, or it dies again and again.
    #[error(
        "{who} died in {frame} ({deaths} times there) and is not restarted: {why}; all frames \
         before are complete"
    )]
    Died {
        /// Who.
        who: String,
        /// Its last words, or how the process ended.
        why: String,
        /// How often, in this frame.
        deaths: u32,
        /// During which frame.
        frame: protocol::Frame,
    },
    /// Too little shared memory, before anything was made in it.
    #[error(
        "/dev/shm has {} MB free, a simulator needs {} MB and more for its sensors; enlarge it \
         (mount -o remount,size=2G /dev/shm, or docker run --shm-size 2g)",
        free >> 20,
        needed >> 20
    )]
    SharedMemory {
        /// Bytes that are free.
        free: u64,
        /// Bytes that are needed.
        needed: u64,
    },
    /// The machine.
    #[error("{0}")]
    System(#[from] std::io::Error),
}
