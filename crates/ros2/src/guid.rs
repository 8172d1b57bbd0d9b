//! Names of participants and endpoints in RTPS (OMG RTPS 2.3, sections 8.2.4 and 9.3.1).

/// The name of a participant: twelve bytes.
pub(crate) type GuidPrefix = [u8; 12];

/// The part of a name that says which endpoint of a participant is meant: four bytes, as a
/// big-endian number. The last byte is the kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct EntityId(pub(crate) u32);

impl EntityId {
    /// Every endpoint that is meant by the context.
    pub(crate) const UNKNOWN: EntityId = EntityId(0);
    /// The participant itself.
    pub(crate) const PARTICIPANT: EntityId = EntityId(0x0000_01c1);
    /// Writer of participants (SPDP).
    pub(crate) const PARTICIPANT_WRITER: EntityId = EntityId(0x0001_00c2);
    /// Writer and reader of writers (SEDP).
    pub(crate) const PUBLICATION_WRITER: EntityId = EntityId(0x0000_03c2);
    pub(crate) const PUBLICATION_READER: EntityId = EntityId(0x0000_03c7);
    /// Writer and reader of readers (SEDP).
    pub(crate) const SUBSCRIPTION_WRITER: EntityId = EntityId(0x0000_04c2);
    pub(crate) const SUBSCRIPTION_READER: EntityId = EntityId(0x0000_04c7);

    /// A user's writer of a topic without a key.
    pub(crate) fn user_writer(number: u32) -> EntityId {
        EntityId(number << 8 | 0x03)
    }

    /// A user's reader of a topic without a key.
    pub(crate) fn user_reader(number: u32) -> EntityId {
        EntityId(number << 8 | 0x04)
    }
}

/// The name of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Guid {
    pub(crate) prefix: GuidPrefix,
    pub(crate) entity: EntityId,
}

impl Guid {
    pub(crate) fn to_bytes(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        bytes[..12].copy_from_slice(&self.prefix);
        bytes[12..].copy_from_slice(&self.entity.0.to_be_bytes());
        bytes
    }

    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Guid> {
        let (prefix, entity) = bytes.split_first_chunk::<12>()?;
        let entity = entity.first_chunk::<4>()?;
        Some(Guid { prefix: *prefix, entity: EntityId(u32::from_be_bytes(*entity)) })
    }
}
