//! The ends of a channel over one of two transports: shared memory between processes, or the heap of
//! one process. Only this file calls iceoryx2 to move data, and no type of iceoryx2 leaves it.
#![expect(unsafe_code, reason = "a loaned sample is written through plain bytes")]

use std::{
    collections::BTreeSet,
    fmt::{self, Debug},
    mem::MaybeUninit,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use bytemuck::{Pod, TransparentWrapper, Zeroable};
use iceoryx2::{
    node::NodeView as _,
    port::{
        BackpressureAction, ReceiveError, publisher::Publisher, subscriber::Subscriber,
        update_connections::UpdateConnections,
    },
    prelude::*,
    sample::Sample as IoxSample,
    sample_mut_uninit::SampleMutUninit,
};

use crate::{BusError, Channel, Loss, control::SLOTS, shared_memory::expect_room};

type Ipc = ipc_threadsafe::Service;
type Local = local_threadsafe::Service;

/// A header of a message: plain old data with a default.
pub trait Header: Pod + Debug + Default {}
impl<T: Pod + Debug + Default> Header for T {}

/// An element of a message's payload: plain old data.
pub trait Element: Pod + Debug {}
impl<T: Pod + Debug> Element for T {}

/// Removes the dead nodes of other processes.
fn clean<S: Service>(node: &Node<S>, spared: &[u32]) -> (u64, u64) {
    let (mut removed, mut stuck) = (0, 0);
    let listed = Node::<S>::list(node.config(), |state| {
        if let NodeState::Dead(dead) = state
            && !dead.id().pid::<S>().is_ok_and(|pid| spared.contains(&(pid.value() as u32)))
        {
            match dead.blocking_remove_stale_resources(Duration::ZERO) {
                Ok(()) => removed += 1,
                Err(_) => stuck += 1,
            }
        }
        CallbackProgression::Continue
    });
    (removed, stuck + u64::from(listed.is_err()))
}

/// A header or element as iceoryx2 carries it.
#[derive(Clone, Copy, Debug, Default, Zeroable, TransparentWrapper)]
#[repr(transparent)]
struct Wire<T>(T);

// SAFETY: `Wire<T>` is transparent over `T`, which is `Pod`: no pointers, no padding, no drop.
unsafe impl<T: Pod> ZeroCopySend for Wire<T> {}

/// A process's connection to the bus, from which ports are made.
pub struct BusNode(Transport<Node<Ipc>, Node<Local>>);

/// One of the two transports, for each kind of handle.
enum Transport<I, L> {
    /// Shared memory between processes.
    Ipc(I),
    /// The heap of this process, between its threads.
    Local(L),
}

/// Messages of a channel that usually exist at a time.
const MESSAGES_IN_FLIGHT: usize = 4;

/// How long a writer waits for a reader that must not lose anything.
const SEND_DEADLINE: Duration = Duration::from_secs(2);

impl BusNode {
    /// Opens a node named `name`; `config` is the instance's.
    pub(crate) fn new(name: &str, config: &Config, is_local: bool) -> Result<BusNode, BusError> {
        set_log_level(LogLevel::Fatal);
        if !is_local {
            expect_room(&format!("process {name:?} on the bus"), 0)?;
        }
        let builder = NodeBuilder::new()
            .name(&NodeName::new(name).map_err(|e| BusError::port("node", name, e))?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .config(config);
        Ok(BusNode(if is_local {
            Transport::Local(builder.create().map_err(|e| BusError::port("node", name, e))?)
        } else {
            Transport::Ipc(builder.create().map_err(|e| BusError::port("node", name, e))?)
        }))
    }

    /// For the host: removes what dead processes left, except that of the processes in `spared`.
    /// Messages that their readers have not received yet are lost with it. Returns how many nodes were
    /// removed and how many could not be.
    pub fn clean(&self, spared: &[u32]) -> (u64, u64) {
        match &self.0 {
            Transport::Ipc(node) => clean(node, spared),
            Transport::Local(node) => clean(node, spared),
        }
    }

    /// For the host: creates the channel, whose readers may borrow `borrowed_max` messages each. The
    /// channel exists as long as the returned service.
    pub(crate) fn create<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
        borrowed_max: usize,
    ) -> Result<OwnedService<H, T>, BusError> {
        let borrowed_max = Some(borrowed_max);
        Ok(OwnedService(match &self.0 {
            Transport::Ipc(node) => Transport::Ipc(service(node, channel, name, borrowed_max)?),
            Transport::Local(node) => Transport::Local(service(node, channel, name, borrowed_max)?),
        }))
    }

    /// The writing end of a channel that the host has created. `elements` is the first capacity of a
    /// message; with `grows`, later ones may be longer; at most `loans` may be written at a time.
    pub(crate) fn writer<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
        elements: usize,
        grows: bool,
        loans: usize,
    ) -> Result<Writer<H, T>, BusError> {
        let port = match &self.0 {
            Transport::Ipc(node) => {
                expect_room(&format!("channel {name:?}"), 0)?;
                let service = service(node, channel, name, None)?;
                Transport::Ipc(publisher(service, channel, name, elements, grows, loans)?)
            }
            Transport::Local(node) => {
                let service = service(node, channel, name, None)?;
                Transport::Local(publisher(service, channel, name, elements, grows, loans)?)
            }
        };
        // Chunks of a pool that does not grow stay where they are.
        let initialised = if grows { None } else { Some(Mutex::default()) };
        Ok(Writer { port, initialised, longest: AtomicUsize::new(0) })
    }

    /// The reading end of a channel that the host has created.
    pub(crate) fn reader<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
    ) -> Result<Reader<H, T>, BusError> {
        Ok(Reader(match &self.0 {
            Transport::Ipc(node) => {
                Transport::Ipc(subscriber(service(node, channel, name, None)?, name)?)
            }
            Transport::Local(node) => {
                Transport::Local(subscriber(service(node, channel, name, None)?, name)?)
            }
        }))
    }
}

type Factory<S, H, T> =
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<S, [Wire<T>], Wire<H>>;

/// A channel that this process created; it is removed when this and its last port are dropped.
pub(crate) struct OwnedService<H: Header, T: Element>(
    #[expect(dead_code, reason = "held for its drop")]
    Transport<Factory<Ipc, H, T>, Factory<Local, H, T>>,
);

fn service<S: Service, H: Header, T: Element>(
    node: &Node<S>,
    channel: &Channel,
    name: &str,
    create: Option<usize>,
) -> Result<Factory<S, H, T>, BusError> {
    let refuse = |e: &dyn Debug| BusError::channel(name, e);
    let service_name = ServiceName::new(name).map_err(|e| refuse(&e))?;
    let borrowed_max = create.unwrap_or(1);
    let builder = node
        .service_builder(&service_name)
        .publish_subscribe::<[Wire<T>]>()
        .user_header::<Wire<H>>()
        .max_publishers(channel.writers_max)
        .max_subscribers(channel.readers_max)
        .max_nodes(SLOTS * 2 + 8)
        .subscriber_max_buffer_size(channel.depth)
        .subscriber_max_borrowed_samples(borrowed_max)
        .history_size(channel.history)
        .enable_safe_overflow(channel.loss != Loss::Never);
    if create.is_some() {
        builder.create().map_err(|e| refuse(&e))
    } else {
        builder.open().map_err(|e| refuse(&e))
    }
}

fn publisher<S: Service, H: Header, T: Element>(
    factory: Factory<S, H, T>,
    channel: &Channel,
    name: &str,
    elements: usize,
    grows: bool,
    loans: usize,
) -> Result<PublisherOf<S, H, T>, BusError> {
    let strategy = if grows { AllocationStrategy::PowerOfTwo } else { AllocationStrategy::Static };
    let mut builder = factory
        .publisher_builder()
        .initial_max_slice_len(elements.max(1))
        .allocation_strategy(strategy)
        .max_loaned_samples(loans);
    if channel.loss == Loss::Never {
        builder = builder.set_backpressure_handler(|info| {
            if info.elapsed_time > SEND_DEADLINE {
                BackpressureAction::DiscardDataAndFail
            } else {
                BackpressureAction::Retry
            }
        });
    }
    builder.create().map_err(|e| BusError::port("writer", name, e))
}

fn subscriber<S: Service, H: Header, T: Element>(
    factory: Factory<S, H, T>,
    name: &str,
) -> Result<SubscriberOf<S, H, T>, BusError> {
    factory.subscriber_builder().create().map_err(|e| BusError::port("reader", name, e))
}

type PublisherOf<S, H, T> = Publisher<S, [Wire<T>], Wire<H>>;

/// The writing end of a channel.
pub struct Writer<H: Header, T: Element> {
    port: Transport<PublisherOf<Ipc, H, T>, PublisherOf<Local, H, T>>,
    /// The addresses of chunks on the heap that were zeroed once; `None` if chunks may be freed and
    /// allocated again, so that each loan is zeroed.
    initialised: Option<Mutex<BTreeSet<usize>>>,
    /// Elements of the longest message so far, for which there was shared memory.
    longest: AtomicUsize,
}

impl<H: Header, T: Element> Writer<H, T> {
    /// Borrows room for `len` elements in the channel's own memory. The content is unspecified: zeros
    /// or an earlier message.
    pub fn loan(&self, len: usize) -> Result<Loan<H, T>, BusError> {
        Ok(Loan(match &self.port {
            Transport::Ipc(port) => {
                if len > self.longest.load(Ordering::Relaxed) {
                    // The channel grows: later messages of this length find their memory in use.
                    let bytes = (len * size_of::<T>() * MESSAGES_IN_FLIGHT) as u64;
                    let what = || format!("a message of {len} {}", std::any::type_name::<T>());
                    expect_room(&what(), bytes)?;
                    self.longest.store(len, Ordering::Relaxed);
                }
                Transport::Ipc(port.loan_slice_uninit(len).map_err(loan_error)?)
            }
            Transport::Local(port) => {
                let mut sample = port.loan_slice_uninit(len).map_err(loan_error)?;
                self.initialise(sample.payload_mut());
                Transport::Local(sample)
            }
        }))
    }

    /// Zeroes a chunk that comes from the heap, unless this writer has zeroed it before. The memory
    /// of a shared segment needs none of this: the kernel hands it out zeroed.
    fn initialise(&self, room: &mut [MaybeUninit<Wire<T>>]) {
        let is_new = match &self.initialised {
            Some(known) => {
                let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
                // Messages of a pool that does not grow may still differ in length.
                let end = room.as_ptr_range().end as usize;
                !room.is_empty() && known.insert(end)
            }
            None => true,
        };
        if is_new {
            room.fill(MaybeUninit::zeroed());
        }
    }

    /// Sends a copy of `payload`.
    pub fn send(&self, header: H, payload: &[T]) -> Result<(), BusError> {
        let mut loan = self.loan(payload.len())?;
        loan.payload_mut().copy_from_slice(payload);
        loan.send(header)
    }

    /// Connects readers that were made since the last call and sends them the channel's history.
    pub fn connect_readers(&self) -> Result<(), BusError> {
        let connected = match &self.port {
            Transport::Ipc(port) => port.update_connections(),
            Transport::Local(port) => port.update_connections(),
        };
        connected.map_err(|e| BusError::port("connection", "writer", e))
    }
}

impl<H: Header, T: Element> Debug for Writer<H, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Writer").finish_non_exhaustive()
    }
}

type LoanOf<S, H, T> = SampleMutUninit<S, [MaybeUninit<Wire<T>>], Wire<H>>;

/// A message that is being written.
pub struct Loan<H: Header, T: Element>(Transport<LoanOf<Ipc, H, T>, LoanOf<Local, H, T>>);

impl<H: Header, T: Element> Loan<H, T> {
    /// The room for the payload, in the channel's own memory.
    pub fn payload_mut(&mut self) -> &mut [T] {
        let room = match &mut self.0 {
            Transport::Ipc(sample) => sample.payload_mut(),
            Transport::Local(sample) => sample.payload_mut(),
        };
        // SAFETY: `Wire<T>` is transparent over `T`, for which every bit pattern is a value, and the
        // memory is initialised: a shared segment is zeroed by the kernel when it is mapped, a chunk
        // of the heap by `Writer::initialise` before it is handed out; both hold whole messages
        // afterwards.
        unsafe { &mut *(std::ptr::from_mut(room) as *mut [T]) }
    }

    /// Sends the message; its bytes do not move.
    pub fn send(mut self, header: H) -> Result<(), BusError> {
        match &mut self.0 {
            Transport::Ipc(sample) => *sample.user_header_mut() = Wire(header),
            Transport::Local(sample) => *sample.user_header_mut() = Wire(header),
        }
        // SAFETY: the memory is initialised, as in `payload_mut`.
        let sent = unsafe {
            match self.0 {
                Transport::Ipc(sample) => sample.assume_init().send(),
                Transport::Local(sample) => sample.assume_init().send(),
            }
        };
        sent.map(drop).map_err(|e| BusError::port("send", std::any::type_name::<H>(), e))
    }
}

type SubscriberOf<S, H, T> = Subscriber<S, [Wire<T>], Wire<H>>;

/// The reading end of a channel.
pub struct Reader<H: Header, T: Element>(
    Transport<SubscriberOf<Ipc, H, T>, SubscriberOf<Local, H, T>>,
);

impl<H: Header, T: Element> Reader<H, T> {
    /// Returns the oldest message that was not read yet, if there is one. Never blocks.
    pub fn receive(&self) -> Result<Option<Sample<H, T>>, BusError> {
        Ok(match &self.0 {
            Transport::Ipc(port) => {
                port.receive().map_err(receive_error)?.map(Transport::Ipc).map(Sample)
            }
            Transport::Local(port) => {
                port.receive().map_err(receive_error)?.map(Transport::Local).map(Sample)
            }
        })
    }
}

impl<H: Header, T: Element> Debug for Reader<H, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reader").finish_non_exhaustive()
    }
}

fn loan_error(why: impl Debug) -> BusError {
    BusError::Loan { why: format!("{why:?}") }
}

fn receive_error(why: ReceiveError) -> BusError {
    match why {
        ReceiveError::ExceedsMaxBorrows => BusError::TooManyBorrowed,
        other => BusError::port("receive", "", other),
    }
}

type SampleOf<S, H, T> = IoxSample<S, [Wire<T>], Wire<H>>;

/// A received message, in the memory in which it was written; borrowed until dropped.
pub struct Sample<H: Header, T: Element>(Transport<SampleOf<Ipc, H, T>, SampleOf<Local, H, T>>);

impl<H: Header, T: Element> Sample<H, T> {
    /// The message's header.
    pub fn header(&self) -> &H {
        match &self.0 {
            Transport::Ipc(sample) => &sample.user_header().0,
            Transport::Local(sample) => &sample.user_header().0,
        }
    }

    /// The message's payload.
    pub fn payload(&self) -> &[T] {
        Wire::peel_slice(match &self.0 {
            Transport::Ipc(sample) => sample.payload(),
            Transport::Local(sample) => sample.payload(),
        })
    }
}

impl<H: Header, T: Element> Debug for Sample<H, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sample").field("header", self.header()).finish_non_exhaustive()
    }
}

// SAFETY: no process writes a received message again while a reader borrows it: a publisher takes a
// chunk back only after every borrowed sample of it was dropped, with safe overflow too, which
// drops what lies in the queue and never what is borrowed. A shared reference gives plain bytes;
// the reference count changes on drop alone, which needs the sample itself.
unsafe impl<H: Header, T: Element> Sync for Sample<H, T> {}
