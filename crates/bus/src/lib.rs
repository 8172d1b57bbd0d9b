//! The bus: what is said, where, and by whom.
//!
//! This crate is the contract between processes. It holds plain data, the table of channels and
//! their ports, and the words of the tick barrier; it makes no decisions.
//!
//! Everything is SI and radians, right-handed, z up; names carry their units.

mod atoms;
mod channel;
pub mod clock;
mod control;
mod episode;
mod error;
pub mod fault;
mod instance;
mod journal;
mod map;
mod participant;
mod port;
mod ports;
pub mod process;
mod snapshot;
mod versioned;
mod wait;

pub use channel::{CHANNELS, Channel, Loss, channel};
pub use control::{ControlPage, Ending, PROTOCOL, PageError, Role, SLOTS, Slot, SlotState};
pub use error::BusError;
pub use instance::{Instance, OwnedInstance, free_bytes};
pub use journal::{Event, Journal};
pub use map::{CONTROL_LEN, ControlPageMapping};
pub use participant::{ADMISSION_SECS, Interrupted, Participant, Watch};
pub use port::{BusNode, Element, Header, Loan, Reader, Sample, Writer};
pub use ports::{
    BundleReaders, BundleSample, ClientPorts, HostPorts, RenderPorts, TrafficPorts, TrafficSample,
};
pub use snapshot::{Snapshot, SnapshotLoan, SnapshotReader, SnapshotWriter};
pub use wait::{Notify, SequenceEvent, Strategy};

#[cfg(test)]
mod loom_tests;
