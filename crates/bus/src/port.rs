//! The ends of a channel, over either transport: shared memory between processes, or the heap of
//! one. This is the only file that calls iceoryx2 to move data.
#![expect(unsafe_code, reason = "a loaned sample is written through plain bytes")]

use std::{fmt::Debug, mem::MaybeUninit};

use bytemuck::{Pod, Zeroable};
use iceoryx2::{
    port::{
        BackpressureAction, publisher::Publisher, subscriber::Subscriber,
        update_connections::UpdateConnections,
    },
    prelude::*,
    sample::Sample as IoxSample,
    sample_mut_uninit::SampleMutUninit,
};

use crate::{BusError, Channel, Loss, control::SLOTS};

type Ipc = ipc_threadsafe::Service;
type Local = local_threadsafe::Service;

/// What a header must be.
pub trait Header: Pod + ZeroCopySend + Debug + Default {}
impl<T: Pod + ZeroCopySend + Debug + Default> Header for T {}

/// What a payload's element must be.
pub trait Element: Pod + ZeroCopySend + Debug {}
impl<T: Pod + ZeroCopySend + Debug> Element for T {}

/// 64 bytes of payload at a 64-byte edge.
#[derive(Clone, Copy, Debug, Pod, Zeroable, ZeroCopySend)]
#[type_name("Block")]
#[repr(C)]
#[repr(align(64))]
pub struct Block(pub [u8; 64]);

/// 4096 bytes of payload at a page's edge, so that a graphics card can write them.
#[derive(Clone, Copy, Debug, Pod, Zeroable, ZeroCopySend)]
#[type_name("Page")]
#[repr(C)]
#[repr(align(4096))]
pub struct Page(pub [u8; 4096]);

/// A process's place on the bus; every port hangs on one.
pub enum BusNode {
    /// Ipc processes.
    Ipc(Node<Ipc>),
    /// Ipc threads of this process.
    Local(Node<Local>),
}

/// How long a writer waits for a reader that must not lose anything.
const SEND_DEADLINE: std::time::Duration = std::time::Duration::from_secs(2);

impl BusNode {
    /// Opens a place; `config` is the instance's.
    pub(crate) fn new(name: &str, config: &Config, within: bool) -> Result<BusNode, BusError> {
        set_log_level(LogLevel::Fatal);
        let builder = NodeBuilder::new()
            .name(&NodeName::new(name).map_err(|e| BusError::port("node", name, e))?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .config(config);
        Ok(if within {
            BusNode::Local(builder.create().map_err(|e| BusError::port("node", name, e))?)
        } else {
            BusNode::Ipc(builder.create().map_err(|e| BusError::port("node", name, e))?)
        })
    }

    /// For the host: removes what dead processes left. Returns (removed, stuck).
    pub fn clean(&self) -> (u64, u64) {
        let state = match self {
            BusNode::Ipc(node) => node.try_cleanup_dead_nodes(),
            BusNode::Local(node) => node.try_cleanup_dead_nodes(),
        };
        (state.cleanups, state.failed_cleanups)
    }

    /// For the host: makes the channel, whose readers may hold `held` messages each. It exists as
    /// long as the answer lives.
    pub(crate) fn found<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
        held: usize,
    ) -> Result<OwnedService<H, T>, BusError> {
        Ok(match self {
            BusNode::Ipc(node) => OwnedService::Ipc(service(node, channel, name, Some(held))?),
            BusNode::Local(node) => OwnedService::Local(service(node, channel, name, Some(held))?),
        })
    }

    /// The writing end of a channel that the host has made. `elements` is how many a message holds
    /// at first; `grows` lets later ones be longer; `loans` is how many may be written at a time.
    pub(crate) fn writer<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
        elements: usize,
        grows: bool,
        loans: usize,
    ) -> Result<Writer<H, T>, BusError> {
        Ok(match self {
            BusNode::Ipc(node) => Writer::Ipc(publisher(
                service(node, channel, name, None)?,
                channel,
                name,
                elements,
                grows,
                loans,
            )?),
            BusNode::Local(node) => Writer::Local(publisher(
                service(node, channel, name, None)?,
                channel,
                name,
                elements,
                grows,
                loans,
            )?),
        })
    }

    /// The reading end of a channel that the host has made.
    pub(crate) fn reader<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
    ) -> Result<Reader<H, T>, BusError> {
        Ok(match self {
            BusNode::Ipc(node) => {
                Reader::Ipc(subscriber(service(node, channel, name, None)?, name)?)
            }
            BusNode::Local(node) => {
                Reader::Local(subscriber(service(node, channel, name, None)?, name)?)
            }
        })
    }
}

type Factory<S, H, T> = iceoryx2::service::port_factory::publish_subscribe::PortFactory<S, [T], H>;

/// A channel that the host made.
pub enum OwnedService<H: Header, T: Element> {
    /// Ipc processes.
    Ipc(Factory<Ipc, H, T>),
    /// Ipc threads.
    Local(Factory<Local, H, T>),
}

fn service<S: Service, H: Header, T: Element>(
    node: &Node<S>,
    channel: &Channel,
    name: &str,
    create: Option<usize>,
) -> Result<Factory<S, H, T>, BusError> {
    let refuse = |e: &dyn Debug| BusError::Channel { name: name.to_owned(), why: format!("{e:?}") };
    let service_name = ServiceName::new(name).map_err(|e| refuse(&e))?;
    let held = create.unwrap_or(1);
    let builder = node
        .service_builder(&service_name)
        .publish_subscribe::<[T]>()
        .user_header::<H>()
        .max_publishers(channel.writers_max)
        .max_subscribers(channel.readers_max)
        .max_nodes(SLOTS * 2 + 8)
        .subscriber_max_buffer_size(channel.depth)
        .subscriber_max_borrowed_samples(held)
        .history_size(channel.history)
        .enable_safe_overflow(channel.loss == Loss::OldestGoes);
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
) -> Result<Publisher<S, [T], H>, BusError> {
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
) -> Result<Subscriber<S, [T], H>, BusError> {
    factory.subscriber_builder().create().map_err(|e| BusError::port("reader", name, e))
}

/// The writing end of a channel.
pub enum Writer<H: Header, T: Element> {
    /// Ipc processes.
    Ipc(Publisher<Ipc, [T], H>),
    /// Ipc threads.
    Local(Publisher<Local, [T], H>),
}

impl<H: Header, T: Element> Writer<H, T> {
    /// Borrows room for `len` elements in the channel's own memory. Its bytes are whatever was
    /// there before.
    pub fn loan(&self, len: usize) -> Result<Loan<H, T>, BusError> {
        Ok(match self {
            Writer::Ipc(port) => Loan::Ipc(port.loan_slice_uninit(len).map_err(BusError::loan)?),
            Writer::Local(port) => {
                Loan::Local(port.loan_slice_uninit(len).map_err(BusError::loan)?)
            }
        })
    }

    /// Sends a copy of `payload`.
    pub fn send(&self, header: H, payload: &[T]) -> Result<(), BusError> {
        let mut loan = self.loan(payload.len())?;
        loan.payload_mut().copy_from_slice(payload);
        loan.send(header)
    }

    /// Lets newcomers in and gives them the history.
    pub fn welcome(&self) -> Result<(), BusError> {
        let welcomed = match self {
            Writer::Ipc(port) => port.update_connections(),
            Writer::Local(port) => port.update_connections(),
        };
        welcomed.map_err(|e| BusError::port("connection", "writer", e))
    }
}

/// A message that is being written.
pub enum Loan<H: Header, T: Element> {
    /// Ipc processes.
    Ipc(SampleMutUninit<Ipc, [MaybeUninit<T>], H>),
    /// Ipc threads.
    Local(SampleMutUninit<Local, [MaybeUninit<T>], H>),
}

impl<H: Header, T: Element> Loan<H, T> {
    /// The room, in the channel's own memory.
    pub fn payload_mut(&mut self) -> &mut [T] {
        let room = match self {
            Loan::Ipc(sample) => sample.payload_mut(),
            Loan::Local(sample) => sample.payload_mut(),
        };
        // SAFETY: `T` is `Pod`: every bit pattern is a value. The segment's memory was zeroed when
        // it was mapped and holds earlier messages since, so it is initialised.
        unsafe { &mut *(std::ptr::from_mut(room) as *mut [T]) }
    }

    /// Sends it. The bytes do not move.
    pub fn send(mut self, header: H) -> Result<(), BusError> {
        match &mut self {
            Loan::Ipc(sample) => *sample.user_header_mut() = header,
            Loan::Local(sample) => *sample.user_header_mut() = header,
        }
        // SAFETY: as in `payload_mut`, every bit pattern is a value.
        let sent = unsafe {
            match self {
                Loan::Ipc(sample) => sample.assume_init().send(),
                Loan::Local(sample) => sample.assume_init().send(),
            }
        };
        sent.map(drop).map_err(|e| BusError::port("send", std::any::type_name::<H>(), e))
    }
}

/// The reading end of a channel.
pub enum Reader<H: Header, T: Element> {
    /// Ipc processes.
    Ipc(Subscriber<Ipc, [T], H>),
    /// Ipc threads.
    Local(Subscriber<Local, [T], H>),
}

impl<H: Header, T: Element> Reader<H, T> {
    /// The oldest message that was not read yet, if there is one. Never blocks.
    pub fn receive(&self) -> Result<Option<Sample<H, T>>, BusError> {
        Ok(match self {
            Reader::Ipc(port) => port.receive().map_err(BusError::receive)?.map(Sample::Ipc),
            Reader::Local(port) => port.receive().map_err(BusError::receive)?.map(Sample::Local),
        })
    }
}

/// A received message, in the memory in which it was written. Held until dropped.
pub enum Sample<H: Header, T: Element> {
    /// Ipc processes.
    Ipc(IoxSample<Ipc, [T], H>),
    /// Ipc threads.
    Local(IoxSample<Local, [T], H>),
}

impl<H: Header, T: Element> Sample<H, T> {
    /// What it is.
    pub fn header(&self) -> &H {
        match self {
            Sample::Ipc(sample) => sample.user_header(),
            Sample::Local(sample) => sample.user_header(),
        }
    }

    /// What it holds.
    pub fn payload(&self) -> &[T] {
        match self {
            Sample::Ipc(sample) => sample.payload(),
            Sample::Local(sample) => sample.payload(),
        }
    }
}

// SAFETY: a received message is never written again, by nobody; what a shared reference gives is
// plain bytes of it. Reference counting happens on drop alone, which needs the sample itself.
unsafe impl<H: Header, T: Element> Sync for Sample<H, T> {}
