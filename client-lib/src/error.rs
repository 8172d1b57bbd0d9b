use std::{io, path::PathBuf, time::Duration};

use bake::MapError;
use bus::BusError;
use protocol::{ActorId, BundleId, Frame, Refusal, RefusalCode};

/// Why a frame ended before every participant had done its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Incompleteness {
    /// The host's deadline passed.
    Late,
    /// A participant's process ended and was not restarted.
    Degraded,
}

impl std::fmt::Display for Incompleteness {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Incompleteness::Late => "late",
            Incompleteness::Degraded => "degraded",
        })
    }
}

/// Why a call of this library failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClientError {
    /// The simulator cannot be found or joined, or a channel cannot be used.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The host refused a command or a query; the world is as it was.
    #[error("{command}: {reason}")]
    #[non_exhaustive]
    Refused {
        /// The call that sent the command.
        command: &'static str,
        /// The cause, to be matched.
        code: RefusalCode,
        /// The reason, for people.
        reason: String,
    },
    /// An argument that no host could accept.
    #[error("{call}: {reason}")]
    #[non_exhaustive]
    BadArgument {
        /// The call.
        call: &'static str,
        /// The reason, for people.
        reason: String,
    },
    /// A file cannot be read or written.
    #[error("file: {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// Another client holds the tick.
    #[error("client {holder:?} holds the tick; it must hand it over (Client::hand_tick_to) or end")]
    TickTaken {
        /// Its name; empty if it gave the tick back just now.
        holder: String,
    },
    /// This client holds the tick, so no tick can wait for it.
    #[error(
        "join_barrier: this client holds the tick, so no tick waits for it; call leave_tick first"
    )]
    HoldsTick,
    /// No client of this name is connected.
    #[error("hand_tick_to: no client is named {name:?}")]
    NoSuchClient {
        /// The name.
        name: String,
    },
    /// No actor has this id at the frame that was taken in last.
    #[error("{actor_id} does not exist at the frame that was taken in last")]
    NoSuchActor {
        /// The id.
        actor_id: ActorId,
    },
    /// The world is not in synchronous mode.
    #[error("the world runs on its own clock; call Client::synchronise to tick it")]
    Asynchronous,
    /// A frame ended without a participant.
    #[error("{frame} ended {cause}: {missing}")]
    #[non_exhaustive]
    Incomplete {
        /// The frame.
        frame: Frame,
        /// Why it ended without them.
        cause: Incompleteness,
        /// The names of the missing participants.
        missing: String,
    },
    /// The host has ended.
    #[error("the host has ended; the last frame seen is {last}")]
    HostEnded {
        /// The last frame that this client took in.
        last: Frame,
    },
    /// Something did not come within its deadline.
    #[error("timeout: {what} did not come within {} s; is the host stopped?", waited.as_secs_f64())]
    Timeout {
        /// What was waited for.
        what: String,
        /// For how long.
        waited: Duration,
    },
    /// Entries of the journal were overwritten before this client read them.
    #[error(
        "this client did not poll the journal for too long; the outcomes of its commands are lost"
    )]
    JournalOverrun,
    /// A bundle was destroyed with its world.
    #[error(
        "bundle {} was destroyed with its world: world {standing} was loaded in its place; create \
         the bundle again", bundle.0
    )]
    WorldGone {
        /// The bundle.
        bundle: BundleId,
        /// The number of the world that is running.
        standing: u32,
    },
    /// A descriptor for epoll cannot be made.
    #[error("eventfd: {source}")]
    EventFd {
        /// The reason.
        source: io::Error,
    },
    /// The map cannot be parsed.
    #[error(transparent)]
    Map(#[from] MapError),
}

impl ClientError {
    pub(crate) fn refused(command: &'static str, Refusal { code, reason }: Refusal) -> ClientError {
        ClientError::Refused { command, code, reason }
    }

    pub(crate) fn bad_argument(call: &'static str, reason: impl Into<String>) -> ClientError {
        ClientError::BadArgument { call, reason: reason.into() }
    }

    /// Returns the cause of a refusal; `None` for every other error.
    ///
    /// ```
    /// # use omnibus_client_lib::{ActorId, Client, ClientError, RefusalCode, Spawn};
    /// /// Spawns at the first of these places that is free.
    /// fn spawn_at_any(client: &mut Client, spawns: &[Spawn]) -> Result<Option<ActorId>, ClientError> {
    ///     for spawn in spawns {
    ///         match client.spawn(*spawn) {
    ///             Err(e) if e.refusal() == Some(RefusalCode::SpawnCollision) => {}
    ///             spawned => return spawned.map(Some),
    ///         }
    ///     }
    ///     Ok(None)
    /// }
    /// ```
    #[must_use]
    pub fn refusal(&self) -> Option<RefusalCode> {
        match self {
            ClientError::Refused { code, .. } => Some(*code),
            _ => None,
        }
    }
}
