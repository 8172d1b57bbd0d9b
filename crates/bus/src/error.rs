use std::fmt::Debug;

/// Why the bus did not do what it should.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusError {
    /// A channel could not be made or opened.
    #[error("channel {name:?} cannot be opened: {why}; is this program of the host's build?")]
    Channel {
        /// Which.
        name: String,
        /// The transport's own word for it.
        why: String,
    },
    /// An end of a channel could not be made or used.
    #[error("{what} {name:?}: {why}")]
    Port {
        /// Which end.
        what: &'static str,
        /// Of which channel.
        name: String,
        /// The transport's own word for it.
        why: String,
    },
    /// No room to write a message.
    #[error(
        "no room to write a message: {why}; a reader holds too many, or the message is longer than its channel allows"
    )]
    Loan {
        /// The transport's own word for it.
        why: String,
    },
    /// The reader holds as many messages as it may.
    #[error("this reader holds as many messages as it may; drop one before receiving the next")]
    HoldsTooMany,
    /// The control page is not usable.
    #[error(transparent)]
    Page(#[from] crate::control::PageError),
    /// The host ended while this process joined.
    #[error("the host ended while this process joined")]
    HostEnds,
    /// An instance could not be made, found or joined.
    #[error("{0}")]
    Instance(String),
}

impl BusError {
    /// Whether it is that there is no such channel.
    pub fn is_missing_channel(&self) -> bool {
        matches!(self, BusError::Channel { why, .. } if why == "DoesNotExist")
    }

    pub(crate) fn port(what: &'static str, name: &str, why: impl Debug) -> BusError {
        BusError::Port { what, name: name.to_owned(), why: format!("{why:?}") }
    }

    pub(crate) fn loan(why: impl Debug) -> BusError {
        BusError::Loan { why: format!("{why:?}") }
    }

    pub(crate) fn receive(why: iceoryx2::port::ReceiveError) -> BusError {
        match why {
            iceoryx2::port::ReceiveError::ExceedsMaxBorrows => BusError::HoldsTooMany,
            other => BusError::port("receive", "", other),
        }
    }
}
