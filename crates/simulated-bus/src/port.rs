//! Channels on the heap of one thread, with the depth, history and losses of the table of channels.
//!
//! As in the transport between processes, each reader has a queue for every writer, and finds it when
//! it receives. A queue that the reader has found outlives the writer; one that it has not is lost with
//! the writer. A reader or writer of a killed process stays until the host cleans up.

use std::{
    any::Any,
    cell::RefCell,
    collections::{BTreeMap, BTreeSet, VecDeque},
    fmt::Debug,
    marker::PhantomData,
    rc::Rc,
};

use bytemuck::Pod;

use crate::{BusError, Channel, Loss, clock, scheduler};

/// A header of a message: plain old data with a default.
pub trait Header: Pod + Debug + Default {}
impl<T: Pod + Debug + Default> Header for T {}

/// An element of a message's payload: plain old data.
pub trait Element: Pod + Debug {}
impl<T: Pod + Debug> Element for T {}

/// How long a writer waits for a reader that must not lose anything. Nanoseconds.
const SEND_NANOS: u64 = 2_000_000_000;

/// Time between two attempts of a writer that waits. Nanoseconds.
const RETRY_NANOS: u64 = 10_000;

thread_local! {
    static CHANNELS: RefCell<BTreeMap<String, Rc<dyn AnyQueues>>> = RefCell::default();
}

/// Removes all channels.
pub(crate) fn remove_all() {
    CHANNELS.take();
}

type Message<H, T> = Rc<(H, Vec<T>)>;

struct WriterEnd<H, T> {
    id: u64,
    pid: u32,
    history: VecDeque<Message<H, T>>,
}

struct ReaderEnd<H, T> {
    id: u64,
    pid: u32,
    /// Has unlimited queues, and no part in the limits of the channel.
    is_observer: bool,
    /// By writer.
    queues: BTreeMap<u64, VecDeque<Message<H, T>>>,
    /// Writers whose queues the reader has found.
    found: BTreeSet<u64>,
}

impl<H, T> ReaderEnd<H, T> {
    /// Writers are gone.
    fn lose(&mut self, writers: &[u64]) {
        let ReaderEnd { is_observer, queues, found, .. } = self;
        queues.retain(|writer, _| {
            *is_observer || found.contains(writer) || !writers.contains(writer)
        });
    }
}

/// The ends of a channel.
struct Queues<H, T> {
    row: Channel,
    ids: u64,
    writers: Vec<WriterEnd<H, T>>,
    readers: Vec<ReaderEnd<H, T>>,
}

trait AnyQueues: Any {
    /// Removes the ends of processes that have ended and are not spared; returns how many.
    fn clean(&self, spared: &[u32]) -> u64;
    /// The numbers of writers and readers.
    fn ends(&self) -> (usize, usize);
}

impl<H: Header, T: Element> AnyQueues for RefCell<Queues<H, T>> {
    fn clean(&self, spared: &[u32]) -> u64 {
        let Queues { writers, readers, .. } = &mut *self.borrow_mut();
        let count = writers.len() + readers.len();
        let stays = |pid| scheduler::lives(pid) || spared.contains(&pid);
        let gone: Vec<u64> = writers.iter().filter(|w| !stays(w.pid)).map(|w| w.id).collect();
        writers.retain(|writer| !gone.contains(&writer.id));
        readers.iter_mut().for_each(|reader| reader.lose(&gone));
        readers.retain(|reader| reader.is_observer || stays(reader.pid));
        (count - writers.len() - readers.len()) as u64
    }

    fn ends(&self) -> (usize, usize) {
        let queues = self.borrow();
        let readers = queues.readers.iter().filter(|reader| !reader.is_observer).count();
        (queues.writers.len(), readers)
    }
}

/// Why a channel cannot be opened, in the transport's words.
#[derive(Debug)]
enum Refused {
    DoesNotExist,
    IncompatibleTypes,
}

fn find<H: Header, T: Element>(name: &str) -> Result<Rc<RefCell<Queues<H, T>>>, BusError> {
    let found = CHANNELS.with_borrow(|channels| channels.get(name).cloned());
    let found: Rc<dyn Any> = found.ok_or_else(|| BusError::channel(name, Refused::DoesNotExist))?;
    found.downcast().map_err(|_| BusError::channel(name, Refused::IncompatibleTypes))
}

/// A process's connection to the bus, from which ports are made.
#[derive(Debug)]
pub struct BusNode;

impl BusNode {
    /// For the host: removes what dead processes left that are not in `spared`. Returns how many ends
    /// were removed, and 0.
    pub fn clean(&self, spared: &[u32]) -> (u64, u64) {
        if !scheduler::point("clean") {
            return (0, 0);
        }
        let channels: Vec<_> = CHANNELS.with_borrow(|all| all.values().cloned().collect());
        (channels.iter().map(|channel| channel.clean(spared)).sum(), 0)
    }

    pub(crate) fn create<H: Header, T: Element>(
        &self,
        channel: &Channel,
        name: &str,
        _borrowed_max: usize,
    ) -> Result<OwnedService<H, T>, BusError> {
        let queues: Queues<H, T> =
            Queues { row: *channel, ids: 0, writers: Vec::new(), readers: Vec::new() };
        CHANNELS.with_borrow_mut(|channels| {
            let is_new = channels.insert(name.to_owned(), Rc::new(RefCell::new(queues))).is_none();
            assert!(is_new, "channel {name} exists");
        });
        Ok(OwnedService(name.to_owned(), PhantomData))
    }

    pub(crate) fn writer<H: Header, T: Element>(
        &self,
        _channel: &Channel,
        name: &str,
        _elements: usize,
        _grows: bool,
        _loans: usize,
    ) -> Result<Writer<H, T>, BusError> {
        scheduler::point("open writer");
        let shared = find::<H, T>(name)?;
        let mut queues = shared.borrow_mut();
        if queues.writers.len() >= queues.row.writers_max {
            return Err(BusError::port("writer", name, "ExceedsMaxSupportedPublishers"));
        }
        queues.ids += 1;
        let id = queues.ids;
        let pid = scheduler::own_pid();
        queues.writers.push(WriterEnd { id, pid, history: VecDeque::new() });
        drop(queues);
        Ok(Writer { shared, id })
    }

    pub(crate) fn reader<H: Header, T: Element>(
        &self,
        _channel: &Channel,
        name: &str,
    ) -> Result<Reader<H, T>, BusError> {
        scheduler::point("open reader");
        let shared = find::<H, T>(name)?;
        let queues = shared.borrow();
        let count = queues.readers.iter().filter(|reader| !reader.is_observer).count();
        if count >= queues.row.readers_max {
            return Err(BusError::port("reader", name, "ExceedsMaxSupportedSubscribers"));
        }
        drop(queues);
        Ok(Reader::new(shared, false))
    }
}

/// For a test: reads everything that is sent on a channel from now on.
///
/// # Errors
///
/// There is no such channel.
pub fn observer<H: Header, T: Element>(name: &str) -> Result<Reader<H, T>, BusError> {
    Ok(Reader::new(find::<H, T>(name)?, true))
}

/// For a test: the numbers of writers and readers of a channel, observers left out.
pub fn ends(name: &str) -> (usize, usize) {
    CHANNELS.with_borrow(|channels| channels.get(name).map_or((0, 0), |channel| channel.ends()))
}

/// A channel that this process created.
pub(crate) struct OwnedService<H, T>(String, PhantomData<(H, T)>);

impl<H, T> Drop for OwnedService<H, T> {
    fn drop(&mut self) {
        let _ = CHANNELS.try_with(|channels| channels.borrow_mut().remove(&self.0));
    }
}

/// The writing end of a channel.
pub struct Writer<H: Header, T: Element> {
    shared: Rc<RefCell<Queues<H, T>>>,
    id: u64,
}

impl<H: Header, T: Element> Writer<H, T> {
    /// Borrows room for `len` elements.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn loan(&self, len: usize) -> Result<Loan<H, T>, BusError> {
        Ok(Loan { shared: Rc::clone(&self.shared), id: self.id, payload: vec![T::zeroed(); len] })
    }

    /// Sends a copy of `payload`.
    ///
    /// # Errors
    ///
    /// As for [`Loan::send`].
    pub fn send(&self, header: H, payload: &[T]) -> Result<(), BusError> {
        send(&self.shared, self.id, Rc::new((header, payload.to_vec())))
    }

    /// Connects readers that were made since the last call and sends them the channel's history.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn connect_readers(&self) -> Result<(), BusError> {
        if scheduler::point("connect readers") {
            self.shared.borrow_mut().connect(self.id);
        }
        Ok(())
    }
}

impl<H: Header, T: Element> Debug for Writer<H, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer").finish_non_exhaustive()
    }
}

impl<H: Header, T: Element> Drop for Writer<H, T> {
    fn drop(&mut self) {
        if scheduler::point("close writer") {
            let Queues { writers, readers, .. } = &mut *self.shared.borrow_mut();
            writers.retain(|writer| writer.id != self.id);
            readers.iter_mut().for_each(|reader| reader.lose(&[self.id]));
        }
    }
}

impl<H: Header, T: Element> Queues<H, T> {
    fn connect(&mut self, writer: u64) {
        let Some(history) = self.writers.iter().find(|w| w.id == writer).map(|w| &w.history) else {
            return;
        };
        for reader in &mut self.readers {
            reader.queues.entry(writer).or_insert_with(|| history.clone());
        }
    }

    fn has_room(&self, writer: u64) -> bool {
        self.readers
            .iter()
            .filter_map(|reader| reader.queues.get(&writer).filter(|_| !reader.is_observer))
            .all(|queue| queue.len() < self.row.depth)
    }

    fn push(&mut self, writer: u64, message: &Message<H, T>) {
        let Queues { row, writers, readers, .. } = self;
        for reader in readers {
            let queue = reader.queues.entry(writer).or_default();
            if queue.len() == row.depth && !reader.is_observer {
                queue.pop_front();
            }
            queue.push_back(Rc::clone(message));
        }
        if let Some(end) = writers.iter_mut().find(|end| end.id == writer)
            && row.history > 0
        {
            if end.history.len() == row.history {
                end.history.pop_front();
            }
            end.history.push_back(Rc::clone(message));
        }
    }
}

fn send<H: Header, T: Element>(
    shared: &RefCell<Queues<H, T>>,
    writer: u64,
    message: Message<H, T>,
) -> Result<(), BusError> {
    let name = shared.borrow().row.name;
    if !scheduler::point(name) {
        return Ok(());
    }
    shared.borrow_mut().connect(writer);
    if shared.borrow().row.loss == Loss::Never {
        let deadline = clock::now_nanos() + SEND_NANOS;
        while !shared.borrow().has_room(writer) {
            if clock::now_nanos() > deadline {
                return Err(BusError::port("send", name, "UnableToDeliver"));
            }
            scheduler::sleep(RETRY_NANOS);
        }
    }
    shared.borrow_mut().push(writer, &message);
    Ok(())
}

/// A message that is being written.
pub struct Loan<H: Header, T: Element> {
    shared: Rc<RefCell<Queues<H, T>>>,
    id: u64,
    payload: Vec<T>,
}

impl<H: Header, T: Element> Loan<H, T> {
    /// The room for the payload.
    pub fn payload_mut(&mut self) -> &mut [T] {
        &mut self.payload
    }

    /// Sends the message.
    ///
    /// # Errors
    ///
    /// A reader that must not lose anything has no room.
    pub fn send(self, header: H) -> Result<(), BusError> {
        send(&self.shared, self.id, Rc::new((header, self.payload)))
    }
}

/// The reading end of a channel.
pub struct Reader<H: Header, T: Element> {
    shared: Rc<RefCell<Queues<H, T>>>,
    id: u64,
    is_observer: bool,
}

impl<H: Header, T: Element> Reader<H, T> {
    fn new(shared: Rc<RefCell<Queues<H, T>>>, is_observer: bool) -> Reader<H, T> {
        let mut queues = shared.borrow_mut();
        queues.ids += 1;
        let id = queues.ids;
        let pid = scheduler::own_pid();
        queues.readers.push(ReaderEnd {
            id,
            pid,
            is_observer,
            queues: BTreeMap::new(),
            found: BTreeSet::new(),
        });
        drop(queues);
        Reader { shared, id, is_observer }
    }

    /// Returns the oldest message that was not read yet, if there is one. Never blocks.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn receive(&self) -> Result<Option<Sample<H, T>>, BusError> {
        if !self.is_observer && !scheduler::point("receive") {
            return Ok(None);
        }
        let Queues { writers, readers, .. } = &mut *self.shared.borrow_mut();
        let own = readers.iter_mut().find(|reader| reader.id == self.id);
        let Some(own) = own else { return Ok(None) };
        own.found.extend(writers.iter().map(|writer| writer.id));
        Ok(own.queues.values_mut().find_map(VecDeque::pop_front).map(Sample))
    }
}

impl<H: Header, T: Element> Debug for Reader<H, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").finish_non_exhaustive()
    }
}

impl<H: Header, T: Element> Drop for Reader<H, T> {
    fn drop(&mut self) {
        if scheduler::point("close reader") {
            self.shared.borrow_mut().readers.retain(|reader| reader.id != self.id);
        }
    }
}

/// A received message.
pub struct Sample<H: Header, T: Element>(Message<H, T>);

impl<H: Header, T: Element> Sample<H, T> {
    /// The message's header.
    pub fn header(&self) -> &H {
        &self.0.0
    }

    /// The message's payload.
    pub fn payload(&self) -> &[T] {
        &self.0.1
    }
}

impl<H: Header, T: Element> Debug for Sample<H, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sample").field("header", self.header()).finish_non_exhaustive()
    }
}
