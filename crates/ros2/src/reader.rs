//! A reader of a topic: which samples of each writer have arrived. It performs no input or output.

use std::{
    collections::{BTreeMap, BTreeSet},
    net::SocketAddrV4,
};

use crate::{
    discovery::{EndpointData, Quality},
    guid::Guid,
    submessage::{Datagram, NumberSet, SET_MAX},
};

/// A reader and its matched writers.
#[derive(Debug)]
pub(crate) struct Reader {
    pub(crate) data: EndpointData,
    writers: BTreeMap<Guid, MatchedWriter>,
}

#[derive(Debug)]
struct MatchedWriter {
    address: SocketAddrV4,
    /// Every sample before this one has arrived or will not come; `None`: unknown, because what was
    /// sent before the match is not wanted.
    next: Option<u64>,
    /// Samples after `next` that have arrived.
    arrived: BTreeSet<u64>,
    acknowledgements: u32,
}

impl MatchedWriter {
    /// Raises `next` over what has arrived.
    fn settle(&mut self, at_least: u64) {
        let mut next = self.next.unwrap_or(0).max(at_least);
        self.arrived.retain(|number| *number >= next);
        while self.arrived.remove(&next) {
            next += 1;
        }
        self.next = Some(next);
    }
}

impl Reader {
    pub(crate) fn new(data: EndpointData) -> Reader {
        Reader { data, writers: BTreeMap::new() }
    }

    /// Begins to receive from a writer, unless it cannot give the quality that this reader requests.
    pub(crate) fn match_writer(&mut self, writer: Guid, address: SocketAddrV4, offered: Quality) {
        let wanted = self.data.quality;
        if (wanted.is_reliable && !offered.is_reliable) || (wanted.is_kept && !offered.is_kept) {
            return;
        }
        let next = wanted.is_kept.then_some(1);
        let matched =
            MatchedWriter { address, next, arrived: BTreeSet::new(), acknowledgements: 0 };
        self.writers.entry(writer).or_insert(matched);
    }

    /// Forgets the writers that `is_gone` names.
    pub(crate) fn forget(&mut self, is_gone: impl Fn(&Guid) -> bool) {
        self.writers.retain(|guid, _| !is_gone(guid));
    }

    /// Takes a sample in; returns whether it is new.
    pub(crate) fn take(&mut self, writer: &Guid, number: u64) -> bool {
        let Some(matched) = self.writers.get_mut(writer) else { return false };
        let next = *matched.next.get_or_insert(number);
        // No honest writer is so far ahead.
        if number < next || number - next > 1 << 20 || !matched.arrived.insert(number) {
            return false;
        }
        matched.settle(next);
        true
    }

    /// Takes in that samples will not come.
    pub(crate) fn skip(&mut self, writer: &Guid, first: u64, missing: &NumberSet) {
        let Some(matched) = self.writers.get_mut(writer) else { return };
        let next = matched.next.unwrap_or(missing.base);
        matched.arrived.extend((first..missing.base).take(SET_MAX as usize));
        matched.arrived.extend(&missing.members);
        matched.settle(if first <= next { missing.base } else { next });
    }

    /// Takes in which samples a writer has. Returns the answer and its address: what has arrived and
    /// what is missing.
    pub(crate) fn answer(
        &mut self,
        writer: &Guid,
        [first, last]: [u64; 2],
        is_final: bool,
    ) -> Option<(SocketAddrV4, Datagram)> {
        let is_reliable = self.data.quality.is_reliable;
        let matched = self.writers.get_mut(writer).filter(|_| is_reliable)?;
        matched.settle(if matched.next.is_none() { last + 1 } else { first });
        let base = matched.next?;
        let end = (last + 1).min(base + SET_MAX);
        let members: Vec<u64> = (base..end).filter(|n| !matched.arrived.contains(n)).collect();
        if members.is_empty() && is_final {
            return None;
        }
        matched.acknowledgements += 1;
        let mut datagram = Datagram::new(&self.data.guid.prefix, Some(&writer.prefix));
        let missing = NumberSet { base, members };
        let count = matched.acknowledgements;
        datagram.acknowledge(self.data.guid.entity, writer.entity, &missing, count);
        Some((matched.address, datagram))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        guid::EntityId,
        submessage::{self, Submessage},
    };

    const WRITER: Guid = Guid { prefix: [2; 12], entity: EntityId(0x103) };

    fn reader(is_kept: bool) -> Reader {
        let quality = Quality { is_reliable: true, is_kept };
        let data = EndpointData {
            guid: Guid { prefix: [1; 12], entity: EntityId::user_reader(1) },
            topic: "rt/a".to_owned(),
            type_name: "a".to_owned(),
            quality,
            addresses: Vec::new(),
        };
        let mut reader = Reader::new(data);
        reader.match_writer(WRITER, "127.0.0.1:7412".parse().unwrap(), quality);
        reader
    }

    /// Returns base and members of the answer to a heartbeat.
    fn answer(reader: &mut Reader, range: [u64; 2]) -> Option<(u64, Vec<u64>)> {
        let (_, datagram) = reader.answer(&WRITER, range, true)?;
        let mut asked = None;
        submessage::read(datagram.bytes(), &WRITER.prefix, |_, submessage| {
            if let Submessage::Acknowledge { missing, .. } = submessage {
                asked = Some((missing.base, missing.members));
            }
        });
        asked
    }

    #[test]
    fn missing_samples_are_requested_and_each_is_taken_once() {
        let mut reader = reader(true);
        assert!(reader.take(&WRITER, 1));
        assert!(reader.take(&WRITER, 4) && !reader.take(&WRITER, 4));
        assert_eq!(answer(&mut reader, [1, 5]), Some((2, vec![2, 3, 5])));
        assert!(reader.take(&WRITER, 2));
        reader.skip(&WRITER, 3, &NumberSet { base: 4, members: Vec::new() });
        assert!(reader.take(&WRITER, 5));
        assert_eq!(answer(&mut reader, [1, 5]), None, "everything has arrived");
        assert!(!reader.take(&WRITER, 3), "it was declared lost");
    }

    #[test]
    fn what_was_sent_before_the_match_is_not_requested() {
        let mut reader = reader(false);
        assert_eq!(answer(&mut reader, [1, 50]), None);
        assert!(reader.take(&WRITER, 51) && !reader.take(&WRITER, 50));
        assert!(!reader.take(&Guid { prefix: [3; 12], ..WRITER }, 52), "it is not matched");
    }
}
