//! The transport between processes: channels, ports and the tick barrier.
//!
//! [`CHANNELS`] lists every channel; [`HostPorts`], [`TrafficPorts`], [`RenderPorts`] and
//! [`ClientPorts`] give each role its ends of them; [`ControlPage`] holds the words of the tick barrier
//! and [`SequenceEvent`] and [`Notify`] are the ways to wait for them. The messages themselves are those
//! of the `protocol` crate.

mod atoms;
mod channel;
pub mod clock;
mod control;
mod episode;
mod error;
pub mod fault;
mod instance;
mod journal;
mod latency;
mod map;
mod marks;
mod participant;
mod port;
mod ports;
pub mod process;
mod regular_file;
mod shared_memory;
mod snapshot;
mod stage_clock;
mod versioned;
mod wait;

pub use channel::{CHANNELS, Channel, Loss, channel};
pub use control::{ControlPage, Ending, PROTOCOL, PageError, Queues, Role, SLOTS, Slot, SlotState};
pub use error::BusError;
pub use instance::{Instance, OwnedInstance};
pub use journal::{Event, Journal, Outcomes};
pub use latency::prefer_latency;
pub use map::{CONTROL_LEN, ControlPageMapping};
pub use participant::{ADMISSION_SECS, Interrupted, Participant, Watch};
pub use port::{BusNode, Element, Header, Loan, Reader, Sample, Writer};
pub use ports::{
    BundleReaders, BundleSample, ClientPorts, HostPorts, RenderPorts, TrafficPorts, TrafficSample,
};
pub use regular_file::{create_regular, open_regular, read_regular};
pub use shared_memory::free_bytes;
pub use snapshot::{Snapshot, SnapshotLoan, SnapshotReader, SnapshotWriter};
pub use stage_clock::{CLOCK_FRAMES, DeviceInstant, HostInstant, SlotInstant, StageClock};
pub use wait::{Notify, SequenceEvent, Spin, Strategy};

#[cfg(test)]
mod loom_tests;
