use bus::BusError;
use protocol::{BundleId, Frame};

/// Why a command of a client's was not granted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClientError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The host refused a command.
    #[error("{what}: {why}")]
    Refused {
        /// Which command.
        what: &'static str,
        /// The host's words.
        why: String,
    },
    /// Another client holds the tick.
    #[error("client {holder:?} holds the tick; it must hand it over (Client::hand_tick_to) or end")]
    TickTaken {
        /// Who.
        holder: String,
    },
    /// The world is not in synchronous mode.
    #[error("the world runs on its own clock; set Settings::synchronous to tick it")]
    Asynchronous,
    /// A frame ended without somebody.
    #[error("{frame} ended {how}: {who}")]
    Incomplete {
        /// Which frame.
        frame: Frame,
        /// `late` or `degraded`.
        how: &'static str,
        /// Who was missing.
        who: String,
    },
    /// The host has ended.
    #[error("the host has ended; the last frame seen is {last}")]
    HostEnded {
        /// The last frame that this client saw.
        last: Frame,
    },
    /// Something did not come in time.
    #[error("{what} did not come within {secs} s; is the host stopped?")]
    Timeout {
        /// What.
        what: String,
        /// After how many seconds.
        secs: u64,
    },
    /// This client was too slow to read the journal.
    #[error(
        "this client did not read the journal for too long; what became of its commands is lost"
    )]
    JournalOverrun,
    /// A bundle is gone with its world.
    #[error(
        "bundle {} went with its world: another was loaded in its place, number {standing}; make a \
         new bundle there", bundle.0
    )]
    WorldGone {
        /// Which bundle.
        bundle: BundleId,
        /// The number of the world that stands.
        standing: u32,
    },
    /// The map cannot be read.
    #[error("{0}")]
    Map(String),
}
