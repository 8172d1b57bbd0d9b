//! A writer of a topic: what it has sent and which readers lack it. It performs no input or output;
//! datagrams go to the function `send`.

use std::{
    collections::{BTreeMap, VecDeque},
    net::SocketAddrV4,
    sync::Arc,
    time::{SystemTime, UNIX_EPOCH},
};

use crate::{
    discovery::{EndpointData, Quality},
    guid::{Guid, GuidPrefix},
    submessage::{Datagram, NumberSet},
};

/// Bytes of a sample that fit into one datagram, whose limit is 65 507; longer samples are sent in
/// fragments of this size.
pub(crate) const FRAGMENT_BYTES: usize = 60_000;

/// Sends one datagram.
pub(crate) type Send<'a> = &'a dyn Fn(SocketAddrV4, &[u8]);

/// The message of one publication, with its encapsulation.
pub(crate) type Sample = Arc<Vec<u8>>;

/// A writer and its matched readers.
#[derive(Debug)]
pub(crate) struct Writer {
    pub(crate) data: EndpointData,
    /// Samples that are kept for readers that lack them, at most.
    depth: usize,
    samples: VecDeque<(u64, Sample)>,
    /// The number of the next sample, from 1.
    next: u64,
    readers: BTreeMap<Guid, MatchedReader>,
    heartbeats: u32,
}

#[derive(Debug)]
struct MatchedReader {
    address: SocketAddrV4,
    is_reliable: bool,
    /// All samples up to this one have arrived, or need not.
    acknowledged: u64,
}

/// A sample on its way: it is sent without the writer, which may be locked.
pub(crate) struct Departure {
    writer: Guid,
    number: u64,
    sample: Sample,
    /// One address of each participant with matched readers, and whether one of them is reliable.
    receivers: BTreeMap<GuidPrefix, (SocketAddrV4, bool)>,
    first: u64,
    heartbeat: u32,
}

impl Departure {
    /// Sends the sample to every participant with matched readers.
    pub(crate) fn send(&self, send: Send<'_>) {
        for (prefix, (address, is_reliable)) in &self.receivers {
            let heartbeat = is_reliable.then_some(([self.first, self.number], self.heartbeat));
            let (writer, number) = (self.writer, self.number);
            send_sample(writer, prefix, *address, number, &self.sample, None, heartbeat, send);
        }
    }
}

impl Writer {
    pub(crate) fn new(data: EndpointData, depth: usize) -> Writer {
        let (samples, readers) = (VecDeque::new(), BTreeMap::new());
        Writer { data, depth, samples, next: 1, readers, heartbeats: 0 }
    }

    /// Returns whether a reader would receive what is added.
    pub(crate) fn has_readers(&self) -> bool {
        !self.readers.is_empty()
    }

    /// Adds a sample and returns it for sending. The oldest one is forgotten if more are kept than
    /// the depth.
    pub(crate) fn add(&mut self, sample: Sample) -> Departure {
        let number = self.next;
        self.next += 1;
        self.samples.push_back((number, Arc::clone(&sample)));
        if self.samples.len() > self.depth {
            self.samples.pop_front();
        }
        let mut receivers = BTreeMap::new();
        for (guid, reader) in &self.readers {
            let (_, is_reliable) = receivers.entry(guid.prefix).or_insert((reader.address, false));
            *is_reliable |= reader.is_reliable;
        }
        self.heartbeats += 1;
        let (writer, heartbeat) = (self.data.guid, self.heartbeats);
        Departure { writer, number, sample, receivers, first: self.first(), heartbeat }
    }

    /// The number of the oldest sample that is kept; that of the next if there is none.
    fn first(&self) -> u64 {
        self.samples.front().map_or(self.next, |(number, _)| *number)
    }

    /// Begins to send to a reader, unless the writer cannot give the quality that it requests.
    pub(crate) fn match_reader(
        &mut self,
        reader: Guid,
        address: SocketAddrV4,
        requested: Quality,
        send: Send<'_>,
    ) -> bool {
        let offered = self.data.quality;
        if (requested.is_reliable && !offered.is_reliable)
            || (requested.is_kept && !offered.is_kept)
        {
            return false;
        }
        // What was sent before concerns only those that request it.
        let acknowledged = if requested.is_kept { self.first() - 1 } else { self.next - 1 };
        let matched = MatchedReader { address, is_reliable: requested.is_reliable, acknowledged };
        // An announcement may come twice.
        if self.readers.contains_key(&reader) {
            return true;
        }
        self.readers.insert(reader, matched);
        if requested.is_reliable {
            self.heartbeats += 1;
            let range = [acknowledged + 1, self.next - 1];
            let mut datagram = Datagram::new(&self.data.guid.prefix, Some(&reader.prefix));
            datagram.heartbeat(self.data.guid.entity, range, self.heartbeats, false);
            send(address, datagram.bytes());
        }
        true
    }

    /// Forgets the readers that `is_gone` names.
    pub(crate) fn forget(&mut self, is_gone: impl Fn(&Guid) -> bool) {
        self.readers.retain(|guid, _| !is_gone(guid));
    }

    /// Asks the readers that have not acknowledged every sample what they lack.
    pub(crate) fn ask(&mut self, send: Send<'_>) {
        let range = [self.first(), self.next - 1];
        let mut asked = BTreeMap::new();
        for (guid, reader) in &self.readers {
            if reader.is_reliable && reader.acknowledged < range[1] {
                asked.insert(guid.prefix, reader.address);
            }
        }
        for (prefix, address) in asked {
            self.heartbeats += 1;
            let mut datagram = Datagram::new(&self.data.guid.prefix, Some(&prefix));
            datagram.heartbeat(self.data.guid.entity, range, self.heartbeats, false);
            send(address, datagram.bytes());
        }
    }

    /// Takes in what a reader has, and sends it what it lacks.
    pub(crate) fn acknowledge(&mut self, reader: &Guid, missing: &NumberSet, send: Send<'_>) {
        let Some(matched) = self.readers.get_mut(reader) else { return };
        let below = missing.base.clamp(1, self.next) - 1;
        matched.acknowledged = matched.acknowledged.max(below);
        let address = matched.address;
        let first = self.first();
        if missing.members.iter().any(|number| *number < first) {
            let mut datagram = Datagram::new(&self.data.guid.prefix, Some(&reader.prefix));
            datagram.gap(reader.entity, self.data.guid.entity, missing.base, first);
            send(address, datagram.bytes());
        }
        for number in &missing.members {
            self.send_again(reader, address, *number, None, send);
        }
    }

    /// Sends a reader the fragments of a sample that it lacks; fragments are counted from 1.
    pub(crate) fn send_fragments(
        &mut self,
        reader: &Guid,
        number: u64,
        missing: &NumberSet,
        send: Send<'_>,
    ) {
        let Some(address) = self.readers.get(reader).map(|matched| matched.address) else { return };
        if number < self.first() {
            let mut datagram = Datagram::new(&self.data.guid.prefix, Some(&reader.prefix));
            datagram.gap(reader.entity, self.data.guid.entity, number, self.first());
            send(address, datagram.bytes());
            return;
        }
        self.send_again(reader, address, number, Some(&missing.members), send);
    }

    fn send_again(
        &mut self,
        reader: &Guid,
        address: SocketAddrV4,
        number: u64,
        fragments: Option<&[u64]>,
        send: Send<'_>,
    ) {
        let Some((_, sample)) = self.samples.iter().find(|(n, _)| *n == number) else { return };
        self.heartbeats += 1;
        let heartbeat = Some(([self.first(), self.next - 1], self.heartbeats));
        let writer = self.data.guid;
        send_sample(writer, &reader.prefix, address, number, sample, fragments, heartbeat, send);
    }
}

/// Sends a sample, or these fragments of it, and a heartbeat behind it.
#[expect(clippy::too_many_arguments, reason = "what is sent, where to, and how")]
fn send_sample(
    writer: Guid,
    receiver: &GuidPrefix,
    address: SocketAddrV4,
    number: u64,
    sample: &[u8],
    fragments: Option<&[u64]>,
    heartbeat: Option<([u64; 2], u32)>,
    send: Send<'_>,
) {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let begin = || {
        let mut datagram = Datagram::new(&writer.prefix, Some(receiver));
        datagram.timestamp(now.as_secs() as u32, now.subsec_nanos());
        datagram
    };
    let end = |mut datagram: Datagram| {
        if let Some((range, count)) = heartbeat {
            datagram.heartbeat(writer.entity, range, count, false);
        }
        send(address, datagram.bytes());
    };
    if sample.len() <= FRAGMENT_BYTES {
        let mut datagram = begin();
        datagram.data(writer.entity, number, sample);
        return end(datagram);
    }
    let count = sample.len().div_ceil(FRAGMENT_BYTES);
    let is_wanted = |fragment: &usize| {
        fragments.is_none_or(|fragments| fragments.contains(&(*fragment as u64 + 1)))
    };
    let mut wanted = (0..count).filter(is_wanted).peekable();
    while let Some(fragment) = wanted.next() {
        let mut datagram = begin();
        datagram.fragment(writer.entity, number, sample, fragment, FRAGMENT_BYTES);
        if wanted.peek().is_some() {
            send(address, datagram.bytes());
        } else {
            end(datagram);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::{guid::EntityId, submessage};

    const READER: Guid = Guid { prefix: [2; 12], entity: EntityId(0x104) };

    fn writer(is_kept: bool, depth: usize) -> Writer {
        let data = EndpointData {
            guid: Guid { prefix: [1; 12], entity: EntityId::user_writer(1) },
            topic: "rt/a".to_owned(),
            type_name: "a".to_owned(),
            quality: Quality { is_reliable: true, is_kept },
            addresses: Vec::new(),
        };
        Writer::new(data, depth)
    }

    fn address() -> SocketAddrV4 {
        "127.0.0.1:7412".parse().unwrap()
    }

    /// Runs a function that sends, and returns the submessages as text.
    fn sent(act: impl FnOnce(Send<'_>)) -> Vec<String> {
        let found = RefCell::new(Vec::new());
        act(&|_, datagram| {
            let all = submessage::read(datagram, &READER.prefix, |_, submessage| {
                let text = format!("{submessage:?}");
                found.borrow_mut().push(text.split(' ').next().unwrap().to_owned());
            });
            assert!(all.is_some());
        });
        found.into_inner()
    }

    #[test]
    fn a_reader_gets_what_it_lacks_as_long_as_it_is_kept() {
        let mut writer = writer(false, 2);
        let reliable = Quality { is_reliable: true, is_kept: false };
        writer.match_reader(READER, address(), reliable, &|_, _| {});
        for byte in 0..3 {
            let departure = writer.add(Arc::new(vec![byte; 8]));
            assert_eq!(sent(|send| departure.send(send)), ["Data", "Heartbeat"]);
        }
        assert_eq!(sent(|send| writer.ask(send)), ["Heartbeat"]);
        let lacks = |base, members: &[u64]| NumberSet { base, members: members.to_vec() };
        let answer = sent(|send| writer.acknowledge(&READER, &lacks(1, &[1, 3]), send));
        assert_eq!(answer, ["Gap", "Data", "Heartbeat"], "sample 1 is forgotten");
        assert_eq!(sent(|send| writer.acknowledge(&READER, &lacks(4, &[]), send)), [""; 0]);
        assert_eq!(sent(|send| writer.ask(send)), [""; 0], "it has everything");
    }

    #[test]
    fn a_long_sample_is_sent_in_fragments() {
        let mut writer = writer(false, 1);
        let reliable = Quality { is_reliable: true, is_kept: false };
        writer.match_reader(READER, address(), reliable, &|_, _| {});
        let departure = writer.add(Arc::new(vec![1; 3 * FRAGMENT_BYTES + 1]));
        let count = RefCell::new(0);
        departure.send(&|_, datagram| {
            assert!(datagram.len() <= 65_507);
            *count.borrow_mut() += 1;
        });
        assert_eq!(count.into_inner(), 4);
        let missing = NumberSet { base: 2, members: vec![2, 4] };
        let count = RefCell::new(0);
        writer.send_fragments(&READER, 1, &missing, &|_, _| *count.borrow_mut() += 1);
        assert_eq!(count.into_inner(), 2);
    }

    #[test]
    fn qualities_that_the_writer_cannot_give_do_not_match() {
        let mut writer = writer(false, 1);
        let kept = Quality { is_reliable: true, is_kept: true };
        assert!(!writer.match_reader(READER, address(), kept, &|_, _| {}));
        assert!(writer.match_reader(READER, address(), Quality::default(), &|_, _| {}));
        assert!(writer.has_readers());
        writer.forget(|guid| guid.prefix == READER.prefix);
        assert!(!writer.has_readers());
    }
}
