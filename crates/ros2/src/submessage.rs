//! Datagrams of RTPS: a header and submessages (OMG RTPS 2.3, sections 8.3.7 and 9.4.5).

use crate::{
    cdr::CdrReader,
    guid::{EntityId, GuidPrefix},
};

/// "RTPS", protocol version 2.3, and a vendor without a number.
const MAGIC: [u8; 4] = *b"RTPS";
pub(crate) const VERSION: [u8; 2] = [2, 3];
pub(crate) const VENDOR: [u8; 2] = [0, 0];

const ACKNACK: u8 = 0x06;
const HEARTBEAT: u8 = 0x07;
const GAP: u8 = 0x08;
const INFO_TIMESTAMP: u8 = 0x09;
const INFO_DESTINATION: u8 = 0x0e;
const NACK_FRAGMENTS: u8 = 0x12;
const DATA: u8 = 0x15;
const DATA_FRAGMENT: u8 = 0x16;

const LITTLE_ENDIAN: u8 = 1;
/// Of a heartbeat and of an acknowledgement: no response is needed.
const FINAL: u8 = 2;
/// Of data: parameters precede the payload.
const INLINE_QOS: u8 = 2;
const HAS_DATA: u8 = 4;
const HAS_KEY: u8 = 8;

/// The most numbers that a set can name.
pub(crate) const SET_MAX: u64 = 256;
/// End of a list of parameters.
const SENTINEL: u16 = 1;
/// The parameter that says whether data ends the life of what it names.
const STATUS_INFO: u16 = 0x0071;
/// The two bits of [`STATUS_INFO`]: disposed, unregistered.
const GONE: u32 = 3;

/// Numbers that are requested or missing: a base and the offsets of at most [`SET_MAX`] members.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct NumberSet {
    /// The smallest number that the set could name; all before it are acknowledged.
    pub(crate) base: u64,
    /// The members.
    pub(crate) members: Vec<u64>,
}

/// A submessage that concerns an endpoint of this program.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Submessage<'a> {
    Data { reader: EntityId, writer: EntityId, number: u64, is_gone: bool, payload: &'a [u8] },
    Heartbeat { reader: EntityId, writer: EntityId, first: u64, last: u64, is_final: bool },
    Gap { writer: EntityId, first: u64, missing: NumberSet },
    Acknowledge { reader: EntityId, writer: EntityId, missing: NumberSet },
    RequestFragments { reader: EntityId, writer: EntityId, number: u64, missing: NumberSet },
}

/// Reads a datagram: calls `found` with each submessage for the participant `own`, and returns the
/// sender; `None` if it is no RTPS or its end is missing.
pub(crate) fn read<'a>(
    datagram: &'a [u8],
    own: &GuidPrefix,
    mut found: impl FnMut(&GuidPrefix, Submessage<'a>),
) -> Option<()> {
    let (header, mut rest) = datagram.split_first_chunk::<20>()?;
    if header[..4] != MAGIC || header[4] != VERSION[0] {
        return None;
    }
    let sender: &GuidPrefix = header[8..].first_chunk()?;
    let mut is_for_us = true;
    while let Some(([kind, flags, a, b], after)) = rest.split_first_chunk::<4>() {
        let is_little_endian = flags & LITTLE_ENDIAN != 0;
        let len = if is_little_endian {
            u16::from_le_bytes([*a, *b])
        } else {
            u16::from_be_bytes([*a, *b])
        };
        // A length of 0 says that the last submessage extends to the end.
        let is_last = len == 0 && *kind != INFO_TIMESTAMP && *kind != 0x01;
        let len = if is_last { after.len() } else { len.into() };
        let (body, next) = after.split_at_checked(len)?;
        rest = next;
        if *kind == INFO_DESTINATION {
            let to: &GuidPrefix = body.first_chunk()?;
            is_for_us = to == own || *to == [0; 12];
        } else if is_for_us {
            let submessage = submessage(*kind, *flags, CdrReader::new(body, is_little_endian));
            if let Some(submessage) = submessage {
                found(sender, submessage);
            }
        }
    }
    Some(())
}

fn submessage<'a>(kind: u8, flags: u8, mut body: CdrReader<'a>) -> Option<Submessage<'a>> {
    if kind == DATA {
        return data(flags, body);
    }
    if ![HEARTBEAT, GAP, ACKNACK, NACK_FRAGMENTS].contains(&kind) {
        return None;
    }
    let (reader, writer) = (entity(&mut body)?, entity(&mut body)?);
    Some(match kind {
        HEARTBEAT => {
            let (first, last) = (sequence_number(&mut body)?, sequence_number(&mut body)?);
            Submessage::Heartbeat { reader, writer, first, last, is_final: flags & FINAL != 0 }
        }
        GAP => {
            let first = sequence_number(&mut body)?;
            Submessage::Gap { writer, first, missing: number_set(&mut body, sequence_number)? }
        }
        ACKNACK => {
            let missing = number_set(&mut body, sequence_number)?;
            Submessage::Acknowledge { reader, writer, missing }
        }
        _ => {
            let number = sequence_number(&mut body)?;
            let missing = number_set(&mut body, |body| body.u32().map(u64::from))?;
            Submessage::RequestFragments { reader, writer, number, missing }
        }
    })
}

fn data<'a>(flags: u8, mut body: CdrReader<'a>) -> Option<Submessage<'a>> {
    let (_, to_qos) = (body.u16()?, body.u16()?);
    let (reader, writer) = (entity(&mut body)?, entity(&mut body)?);
    let number = sequence_number(&mut body)?;
    // The distance is counted from behind its own field; what is in between is of later versions.
    body.take(usize::from(to_qos).checked_sub(16)?)?;
    let mut is_gone = false;
    if flags & INLINE_QOS != 0 {
        loop {
            let (id, len) = (body.u16()?, body.u16()?);
            if id == SENTINEL {
                break;
            }
            let value = body.take(len.into())?;
            if id == STATUS_INFO {
                is_gone = u32::from_be_bytes(*value.first_chunk()?) & GONE != 0;
            }
        }
    }
    let has_payload = flags & (HAS_DATA | HAS_KEY) != 0;
    let payload = if has_payload { body.rest() } else { &[] };
    Some(Submessage::Data { reader, writer, number, is_gone, payload })
}

fn entity(body: &mut CdrReader<'_>) -> Option<EntityId> {
    let bytes = body.take(4)?.first_chunk()?;
    Some(EntityId(u32::from_be_bytes(*bytes)))
}

fn sequence_number(body: &mut CdrReader<'_>) -> Option<u64> {
    let (high, low) = (body.u32()?, body.u32()?);
    let number = u64::from(high) << 32 | u64::from(low);
    // The number is signed; at most half of its range keeps additions from overflow.
    (number < 1 << 62).then_some(number)
}

fn number_set(
    body: &mut CdrReader<'_>,
    mut number: impl FnMut(&mut CdrReader<'_>) -> Option<u64>,
) -> Option<NumberSet> {
    let base = number(body)?;
    let count = u64::from(body.u32()?);
    if count > SET_MAX {
        return None;
    }
    let mut members = Vec::new();
    let mut word = 0;
    for offset in 0..count {
        if offset % 32 == 0 {
            word = body.u32()?;
        }
        if word & 1 << (31 - offset % 32) != 0 {
            members.push(base + offset);
        }
    }
    Some(NumberSet { base, members })
}

/// Writes one datagram.
#[derive(Debug)]
pub(crate) struct Datagram {
    bytes: Vec<u8>,
}

impl Datagram {
    /// Begins a datagram of participant `sender`, for `receiver` if there is one.
    pub(crate) fn new(sender: &GuidPrefix, receiver: Option<&GuidPrefix>) -> Datagram {
        let mut datagram = Datagram { bytes: Vec::with_capacity(512) };
        datagram.bytes.extend(MAGIC);
        datagram.bytes.extend(VERSION);
        datagram.bytes.extend(VENDOR);
        datagram.bytes.extend(sender);
        if let Some(receiver) = receiver {
            datagram.submessage(INFO_DESTINATION, 0, |bytes| bytes.extend(receiver));
        }
        datagram
    }

    fn submessage(&mut self, kind: u8, flags: u8, write: impl FnOnce(&mut Vec<u8>)) {
        self.bytes.extend([kind, flags | LITTLE_ENDIAN, 0, 0]);
        let begin = self.bytes.len();
        write(&mut self.bytes);
        let padded = self.bytes.len().next_multiple_of(4);
        self.bytes.resize(padded, 0);
        let len = (self.bytes.len() - begin) as u16;
        self.bytes[begin - 2..begin].copy_from_slice(&len.to_le_bytes());
    }

    /// Adds the time of the data that follows: seconds and nanoseconds.
    pub(crate) fn timestamp(&mut self, seconds: u32, nanos: u32) {
        let fraction = (u64::from(nanos) << 32) / 1_000_000_000;
        self.submessage(INFO_TIMESTAMP, 0, |bytes| {
            bytes.extend(seconds.to_le_bytes());
            bytes.extend((fraction as u32).to_le_bytes());
        });
    }

    /// Adds a whole sample.
    pub(crate) fn data(&mut self, writer: EntityId, number: u64, payload: &[u8]) {
        self.submessage(DATA, HAS_DATA, |bytes| {
            put_data_header(bytes, 16, writer, number);
            bytes.extend(payload);
        });
    }

    /// Adds the end of what `key` names.
    pub(crate) fn gone(&mut self, writer: EntityId, number: u64, key: &[u8]) {
        self.submessage(DATA, INLINE_QOS | HAS_KEY, |bytes| {
            put_data_header(bytes, 16, writer, number);
            bytes.extend(STATUS_INFO.to_le_bytes());
            bytes.extend(4u16.to_le_bytes());
            bytes.extend(GONE.to_be_bytes());
            bytes.extend(SENTINEL.to_le_bytes());
            bytes.extend(0u16.to_le_bytes());
            bytes.extend(key);
        });
    }

    /// Adds one fragment of a sample; fragments are counted from 0 and all but the last are
    /// `fragment_len` long.
    pub(crate) fn fragment(
        &mut self,
        writer: EntityId,
        number: u64,
        sample: &[u8],
        fragment: usize,
        fragment_len: usize,
    ) {
        let from = fragment * fragment_len;
        let to = sample.len().min(from + fragment_len);
        self.bytes.reserve(to - from + 64);
        self.submessage(DATA_FRAGMENT, 0, |bytes| {
            put_data_header(bytes, 28, writer, number);
            bytes.extend((fragment as u32 + 1).to_le_bytes());
            bytes.extend(1u16.to_le_bytes());
            bytes.extend((fragment_len as u16).to_le_bytes());
            bytes.extend((sample.len() as u32).to_le_bytes());
            bytes.extend(&sample[from..to]);
        });
    }

    /// Adds which samples a writer has: `first` to `last`; none if `last` is below `first`.
    pub(crate) fn heartbeat(
        &mut self,
        writer: EntityId,
        [first, last]: [u64; 2],
        count: u32,
        is_final: bool,
    ) {
        self.submessage(HEARTBEAT, if is_final { FINAL } else { 0 }, |bytes| {
            put_entities(bytes, EntityId::UNKNOWN, writer);
            put_number(bytes, first);
            put_number(bytes, last);
            bytes.extend(count.to_le_bytes());
        });
    }

    /// Adds that the samples from `first` up to `end`, which is not among them, will not come.
    pub(crate) fn gap(&mut self, reader: EntityId, writer: EntityId, first: u64, end: u64) {
        self.submessage(GAP, 0, |bytes| {
            put_entities(bytes, reader, writer);
            put_number(bytes, first);
            put_set(bytes, &NumberSet { base: end, members: Vec::new() });
        });
    }

    /// Adds which samples a reader has: all below the set's base. It requests the members.
    pub(crate) fn acknowledge(
        &mut self,
        reader: EntityId,
        writer: EntityId,
        missing: &NumberSet,
        count: u32,
    ) {
        let flags = if missing.members.is_empty() { FINAL } else { 0 };
        self.submessage(ACKNACK, flags, |bytes| {
            put_entities(bytes, reader, writer);
            put_set(bytes, missing);
            bytes.extend(count.to_le_bytes());
        });
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

fn put_data_header(bytes: &mut Vec<u8>, to_qos: u16, writer: EntityId, number: u64) {
    bytes.extend(0u16.to_le_bytes());
    bytes.extend(to_qos.to_le_bytes());
    put_entities(bytes, EntityId::UNKNOWN, writer);
    put_number(bytes, number);
}

fn put_entities(bytes: &mut Vec<u8>, reader: EntityId, writer: EntityId) {
    bytes.extend(reader.0.to_be_bytes());
    bytes.extend(writer.0.to_be_bytes());
}

fn put_number(bytes: &mut Vec<u8>, number: u64) {
    bytes.extend(((number >> 32) as u32).to_le_bytes());
    bytes.extend((number as u32).to_le_bytes());
}

fn put_set(bytes: &mut Vec<u8>, set: &NumberSet) {
    put_number(bytes, set.base);
    let count = set.members.last().map_or(0, |last| last - set.base + 1);
    bytes.extend((count as u32).to_le_bytes());
    let mut words = vec![0u32; count.div_ceil(32) as usize];
    for member in &set.members {
        let offset = member - set.base;
        words[(offset / 32) as usize] |= 1 << (31 - offset % 32);
    }
    words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWN: GuidPrefix = [1; 12];
    const OTHER: GuidPrefix = [2; 12];
    const WRITER: EntityId = EntityId(0x103);

    fn written() -> Datagram {
        let mut datagram = Datagram::new(&OTHER, Some(&OWN));
        datagram.timestamp(3, 500_000_000);
        datagram.data(WRITER, 7, &[0, 1, 0, 0, 9]);
        datagram.gone(WRITER, 8, &[0, 3, 0, 0]);
        datagram.heartbeat(WRITER, [5, 1 << 33], 1, true);
        datagram.gap(EntityId::UNKNOWN, WRITER, 3, 5);
        let missing = NumberSet { base: 10, members: vec![10, 41, 42, 265] };
        datagram.acknowledge(EntityId(0x104), WRITER, &missing, 2);
        datagram
    }

    fn count(datagram: &[u8], own: &GuidPrefix) -> usize {
        let mut count = 0;
        let _ = read(datagram, own, |_, _| count += 1);
        count
    }

    #[test]
    fn what_is_written_is_read() {
        let datagram = written();
        let mut found = Vec::new();
        let all = read(datagram.bytes(), &OWN, |from, submessage| {
            assert_eq!(*from, OTHER);
            found.push(submessage);
        });
        assert_eq!(all, Some(()));
        let reader = EntityId::UNKNOWN;
        let missing = NumberSet { base: 10, members: vec![10, 41, 42, 265] };
        let payload = &[0, 1, 0, 0, 9, 0, 0, 0][..];
        let key = &[0, 3, 0, 0][..];
        let data = |number, is_gone, payload| Submessage::Data {
            reader,
            writer: WRITER,
            number,
            is_gone,
            payload,
        };
        assert_eq!(
            found,
            [
                data(7, false, payload),
                data(8, true, key),
                Submessage::Heartbeat {
                    reader,
                    writer: WRITER,
                    first: 5,
                    last: 1 << 33,
                    is_final: true
                },
                Submessage::Gap {
                    writer: WRITER,
                    first: 3,
                    missing: NumberSet { base: 5, members: vec![] }
                },
                Submessage::Acknowledge { reader: EntityId(0x104), writer: WRITER, missing },
            ]
        );
        assert_eq!(count(datagram.bytes(), &[3; 12]), 0, "it is for another participant");
    }

    #[test]
    fn no_datagram_causes_a_panic() {
        let good = written();
        for end in 0..good.bytes().len() {
            count(&good.bytes()[..end], &OWN);
        }
        for at in 0..good.bytes().len() {
            for value in [0, 1, 2, 0x7f, 0x80, 0xff] {
                let mut bad = good.bytes().to_vec();
                bad[at] = value;
                count(&bad, &OWN);
            }
        }
    }
}
