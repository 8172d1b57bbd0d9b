//! What participants tell each other of themselves and of their endpoints: lists of parameters
//! (OMG RTPS 2.3, sections 8.5 and 9.6.2).

use std::{
    net::{Ipv4Addr, SocketAddrV4},
    time::Duration,
};

use crate::{
    cdr::CdrReader,
    guid::{EntityId, Guid, GuidPrefix},
    submessage,
};

/// The encapsulation of a list of parameters, little-endian.
const LIST_LITTLE_ENDIAN: [u8; 4] = [0, 3, 0, 0];
const UDP_V4: u32 = 1;
/// The endpoints of discovery that this program has: announcers and detectors of participants, of
/// publications and of subscriptions.
const BUILTIN_ENDPOINTS: u32 = 0x3f;

/// Identifiers of parameters.
mod id {
    pub(super) const SENTINEL: u16 = 0x0001;
    pub(super) const LEASE_DURATION: u16 = 0x0002;
    pub(super) const TOPIC_NAME: u16 = 0x0005;
    pub(super) const TYPE_NAME: u16 = 0x0007;
    pub(super) const PROTOCOL_VERSION: u16 = 0x0015;
    pub(super) const VENDOR: u16 = 0x0016;
    pub(super) const RELIABILITY: u16 = 0x001a;
    pub(super) const DURABILITY: u16 = 0x001d;
    pub(super) const UNICAST_LOCATOR: u16 = 0x002f;
    pub(super) const DEFAULT_UNICAST_LOCATOR: u16 = 0x0031;
    pub(super) const METATRAFFIC_UNICAST_LOCATOR: u16 = 0x0032;
    pub(super) const PARTICIPANT_GUID: u16 = 0x0050;
    pub(super) const BUILTIN_ENDPOINT_SET: u16 = 0x0058;
    pub(super) const ENDPOINT_GUID: u16 = 0x005a;
    pub(super) const ENTITY_NAME: u16 = 0x0062;
}

/// A participant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ParticipantData {
    pub(crate) prefix: GuidPrefix,
    /// The name that tools show; empty if it has none.
    pub(crate) name: String,
    /// For how long it exists after its last announcement.
    pub(crate) lease: Duration,
    /// Addresses for discovery.
    pub(crate) discovery_addresses: Vec<SocketAddrV4>,
    /// Addresses for data.
    pub(crate) data_addresses: Vec<SocketAddrV4>,
}

/// Quality of service, as far as it decides whether endpoints match.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Quality {
    /// Lost samples are sent again.
    pub(crate) is_reliable: bool,
    /// A reader that comes later receives what the writer has kept.
    pub(crate) is_kept: bool,
}

/// A writer or a reader of a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EndpointData {
    pub(crate) guid: Guid,
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) quality: Quality,
    /// Addresses of its own; empty: those of its participant.
    pub(crate) addresses: Vec<SocketAddrV4>,
}

impl ParticipantData {
    /// Returns the announcement.
    pub(crate) fn write(&self) -> Vec<u8> {
        let mut list = ParameterList::new();
        list.put(id::PROTOCOL_VERSION, &submessage::VERSION);
        list.put(id::VENDOR, &submessage::VENDOR);
        list.put(id::PARTICIPANT_GUID, &self.guid().to_bytes());
        list.put(id::BUILTIN_ENDPOINT_SET, &BUILTIN_ENDPOINTS.to_le_bytes());
        let mut lease = (self.lease.as_secs() as u32).to_le_bytes().to_vec();
        lease.extend([0; 4]);
        list.put(id::LEASE_DURATION, &lease);
        for address in &self.discovery_addresses {
            list.put(id::METATRAFFIC_UNICAST_LOCATOR, &locator(address));
        }
        for address in &self.data_addresses {
            list.put(id::DEFAULT_UNICAST_LOCATOR, &locator(address));
        }
        list.put(id::ENTITY_NAME, &string(&self.name));
        list.finish()
    }

    /// Returns the name of the participant as a whole.
    pub(crate) fn guid(&self) -> Guid {
        Guid { prefix: self.prefix, entity: EntityId::PARTICIPANT }
    }

    /// Returns the key under which the announcement is withdrawn.
    pub(crate) fn key(&self) -> Vec<u8> {
        let mut list = ParameterList::new();
        list.put(id::PARTICIPANT_GUID, &self.guid().to_bytes());
        list.finish()
    }

    /// Reads an announcement.
    pub(crate) fn read(payload: &[u8]) -> Option<ParticipantData> {
        let mut prefix = None;
        let mut data = ParticipantData {
            prefix: GuidPrefix::default(),
            name: String::new(),
            lease: Duration::from_secs(100),
            discovery_addresses: Vec::new(),
            data_addresses: Vec::new(),
        };
        read_list(payload, |id, mut value| match id {
            id::PARTICIPANT_GUID => prefix = Guid::from_bytes(value.rest()).map(|g| g.prefix),
            id::ENTITY_NAME => data.name = value.string().unwrap_or_default(),
            id::LEASE_DURATION => {
                data.lease = Duration::from_secs(value.u32().map_or(100, u64::from));
            }
            id::METATRAFFIC_UNICAST_LOCATOR => {
                data.discovery_addresses.extend(address(&mut value));
            }
            id::DEFAULT_UNICAST_LOCATOR => data.data_addresses.extend(address(&mut value)),
            _ => {}
        })?;
        data.prefix = prefix?;
        Some(data)
    }
}

impl EndpointData {
    /// Returns the announcement.
    pub(crate) fn write(&self) -> Vec<u8> {
        let mut list = ParameterList::new();
        list.put(id::ENDPOINT_GUID, &self.guid.to_bytes());
        list.put(id::TOPIC_NAME, &string(&self.topic));
        list.put(id::TYPE_NAME, &string(&self.type_name));
        let mut reliability =
            if self.quality.is_reliable { 2u32 } else { 1 }.to_le_bytes().to_vec();
        // The longest time that a write may block: 0.1 s.
        reliability.extend([0, 0, 0, 0]);
        reliability.extend((u32::MAX / 10).to_le_bytes());
        list.put(id::RELIABILITY, &reliability);
        list.put(id::DURABILITY, &u32::from(self.quality.is_kept).to_le_bytes());
        list.finish()
    }

    /// Reads an announcement.
    pub(crate) fn read(payload: &[u8]) -> Option<EndpointData> {
        let (mut guid, mut topic, mut type_name) = (None, None, None);
        let (mut quality, mut addresses) = (Quality::default(), Vec::new());
        read_list(payload, |id, mut value| match id {
            id::ENDPOINT_GUID => guid = Guid::from_bytes(value.rest()),
            id::TOPIC_NAME => topic = value.string(),
            id::TYPE_NAME => type_name = value.string(),
            id::RELIABILITY => quality.is_reliable = value.u32() == Some(2),
            id::DURABILITY => quality.is_kept = value.u32().is_some_and(|kind| kind > 0),
            id::UNICAST_LOCATOR => addresses.extend(address(&mut value)),
            _ => {}
        })?;
        Some(EndpointData { guid: guid?, topic: topic?, type_name: type_name?, quality, addresses })
    }
}

/// Returns what the key of a withdrawn announcement names.
pub(crate) fn withdrawn(key: &[u8]) -> Option<Guid> {
    let mut guid = None;
    read_list(key, |id, value| {
        if matches!(id, id::PARTICIPANT_GUID | id::ENDPOINT_GUID) {
            guid = Guid::from_bytes(value.rest());
        }
    })?;
    guid
}

struct ParameterList(Vec<u8>);

impl ParameterList {
    fn new() -> ParameterList {
        ParameterList(LIST_LITTLE_ENDIAN.to_vec())
    }

    fn put(&mut self, id: u16, value: &[u8]) {
        let padded = value.len().next_multiple_of(4);
        self.0.extend(id.to_le_bytes());
        self.0.extend((padded as u16).to_le_bytes());
        self.0.extend(value);
        self.0.resize(self.0.len() + padded - value.len(), 0);
    }

    fn finish(mut self) -> Vec<u8> {
        self.put(id::SENTINEL, &[]);
        self.0
    }
}

/// Calls `found` with each parameter of a list; `None` if its end is missing.
fn read_list<'a>(payload: &'a [u8], mut found: impl FnMut(u16, CdrReader<'a>)) -> Option<()> {
    let (encapsulation, rest) = payload.split_first_chunk::<4>()?;
    let is_little_endian = match encapsulation {
        [0, 2, ..] => false,
        [0, 3, ..] => true,
        _ => return None,
    };
    let mut list = CdrReader::new(rest, is_little_endian);
    loop {
        let (id, len) = (list.u16()?, list.u16()?);
        if id == id::SENTINEL {
            return Some(());
        }
        found(id, CdrReader::new(list.take(len.into())?, is_little_endian));
    }
}

fn string(text: &str) -> Vec<u8> {
    let mut bytes = (text.len() as u32 + 1).to_le_bytes().to_vec();
    bytes.extend(text.as_bytes());
    bytes.push(0);
    bytes
}

fn locator(address: &SocketAddrV4) -> Vec<u8> {
    let mut bytes = UDP_V4.to_le_bytes().to_vec();
    bytes.extend(u32::from(address.port()).to_le_bytes());
    bytes.extend([0; 12]);
    bytes.extend(address.ip().octets());
    bytes
}

fn address(value: &mut CdrReader<'_>) -> Option<SocketAddrV4> {
    let (kind, port) = (value.u32()?, value.u32()?);
    let bytes: &[u8; 4] = value.take(16)?.last_chunk()?;
    let port = u16::try_from(port).ok()?;
    let ip = Ipv4Addr::from(*bytes);
    (kind == UDP_V4 && !ip.is_multicast()).then(|| SocketAddrV4::new(ip, port))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn announcements_are_read_as_they_are_written() {
        let participant = ParticipantData {
            prefix: [7; 12],
            name: "omnibus".to_owned(),
            lease: Duration::from_secs(10),
            discovery_addresses: vec!["127.0.0.1:7410".parse().unwrap()],
            data_addresses: vec!["10.0.0.1:7411".parse().unwrap(); 2],
        };
        assert_eq!(ParticipantData::read(&participant.write()), Some(participant.clone()));
        assert_eq!(withdrawn(&participant.key()), Some(participant.guid()));
        let endpoint = EndpointData {
            guid: Guid { prefix: [7; 12], entity: EntityId::user_writer(3) },
            topic: "rt/clock".to_owned(),
            type_name: "rosgraph_msgs::msg::dds_::Clock_".to_owned(),
            quality: Quality { is_reliable: true, is_kept: false },
            addresses: Vec::new(),
        };
        let written = endpoint.write();
        assert_eq!(EndpointData::read(&written), Some(endpoint));
        for end in 0..written.len() {
            assert_eq!(EndpointData::read(&written[..end]), None, "{end}");
        }
    }
}
