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
    /// A stage died and the host was told not to bring it back.
    #[error("{who} died at {frame} and is not restarted; {done} frames are complete")]
    Died {
        /// Who.
        who: String,
        /// During which frame.
        frame: bus::Frame,
        /// How many frames were finished.
        done: u64,
    },
    /// The machine.
    #[error("{0}")]
    System(#[from] std::io::Error),
}
