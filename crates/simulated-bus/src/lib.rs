//! The bus over simulated processes: the source of the `bus` crate, compiled over other atomics, another
//! clock and channels on the heap of one thread.
//!
//! A test that names this crate instead of `bus` runs the code of every process as a coroutine of one
//! thread. A scheduler switches between them at any access to the control page, at any message and in
//! any wait, as a seed decides; the same seed gives the same schedule. Processes may be killed and
//! stopped at each of these points, and time passes only as they run or while all of them sleep.
//! Accesses are sequentially consistent: `bus::loom_tests` checks the memory ordering.

#[path = "../../bus/src/channel.rs"]
mod channel;
#[path = "../../bus/src/control.rs"]
mod control;
#[path = "../../bus/src/error.rs"]
mod error;
#[path = "../../bus/src/journal.rs"]
mod journal;
#[path = "../../bus/src/marks.rs"]
mod marks;
#[path = "../../bus/src/participant.rs"]
mod participant;
#[path = "../../bus/src/ports.rs"]
mod ports;
#[path = "../../bus/src/regular_file.rs"]
mod regular_file;
#[path = "../../bus/src/snapshot.rs"]
mod snapshot;
#[path = "../../bus/src/stage_clock.rs"]
mod stage_clock;
#[path = "../../bus/src/versioned.rs"]
mod versioned;
#[path = "../../bus/src/wait.rs"]
mod wait;

mod atoms;
pub mod clock;
mod coroutine;
mod instance;
mod map;
mod port;
pub mod process;
pub mod scheduler;

pub use channel::{CHANNELS, Channel, Loss, channel};
pub use control::{ControlPage, Ending, PROTOCOL, PageError, Queues, Role, SLOTS, Slot, SlotState};
pub use error::BusError;
pub use instance::{Instance, OwnedInstance};
pub use journal::{Event, Journal, Outcomes};
pub use map::ControlPageMapping;
pub use participant::{ADMISSION_SECS, Interrupted, Participant, Watch};
pub use port::{BusNode, Element, Header, Loan, Reader, Sample, Writer, ends, observer};
pub use ports::{
    BundleReaders, BundleSample, ClientPorts, HostPorts, RenderPorts, TrafficPorts, TrafficSample,
};
pub use regular_file::{create_regular, open_regular, read_regular};
pub use snapshot::{Snapshot, SnapshotLoan, SnapshotReader, SnapshotWriter};
pub use stage_clock::{CLOCK_FRAMES, DeviceInstant, HostInstant, SlotInstant, StageClock};
pub use wait::{Notify, SequenceEvent, Spin, Strategy};

/// Free bytes of shared memory: enough.
///
/// # Errors
///
/// Never.
pub fn free_bytes() -> std::io::Result<u64> {
    Ok(1 << 40)
}

/// Changes nothing: the scheduler alone decides which process runs.
pub fn prefer_latency(_is_preferred: bool) {}
