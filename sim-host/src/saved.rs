//! Saved states: everything that decides the future, as bytes.
//!
//! A fork and the re-simulation of a recording start from one. It is valid for the build and the
//! map that it was saved with.

use bytemuck::{Pod, Zeroable};
use mesh::WordHash;
use protocol::{ActorState, Episode, JournalEntry, Name, Stamp, TrafficHeader, WalkerLimbs};

use crate::{physics::Physics, request::Pending};

/// The magic number of a saved state, and the version of its layout.
const MAGIC: u64 = u64::from_le_bytes(*b"omnistat");
const VERSION: u32 = 8;

/// Everything that decides the future.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SavedState {
    /// The frame at whose end the state was saved, and the simulated time.
    pub stamp: Stamp,
    /// [`map_sum`] of the map and seed that the state is valid for.
    pub map: u64,
    /// Commands that make the default [`protocol::StandingState`] into the saved one.
    pub standing: Vec<JournalEntry>,
    /// The number of the debug shape that was drawn last.
    pub last_shape: u32,
    /// The id of the actor spawned last.
    pub last_actor: u32,
    /// Every actor, by id.
    pub actors: Vec<ActorState>,
    /// The role name of each actor, in the same order.
    pub roles: Vec<Name>,
    /// The limbs of fallen walkers, by id.
    pub limbs: Vec<WalkerLimbs>,
    /// The bytes of [`crate::physics::Physics::save`].
    pub physics: Vec<u8>,
    /// The newest decision of traffic: controls, lights and the planner's state.
    pub decision: Option<(TrafficHeader, Vec<u8>)>,
    /// Commands that were not applied yet.
    pub pending: Vec<Pending>,
}

/// The cause why bytes are not a saved state of this world.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// The bytes are something else, or of another build.
    #[error("not a saved state of this build: {0}")]
    Strange(String),
    /// The state was saved on another map or with another seed.
    #[error(
        "the state was saved on another map or seed; start the simulator with that map and seed"
    )]
    OtherMap,
    /// The bytes are inconsistent.
    #[error("the state is damaged: {0}")]
    Damaged(String),
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    magic: u64,
    version: u32,
    last_actor: u32,
    map: u64,
    stamp: Stamp,
    standing: u64,
    last_shape: u32,
    reserved: u32,
    actors: u64,
    limbs: u64,
    physics: u64,
    /// 0 without a decision; otherwise the payload's length plus 1.
    decision: u64,
    pending: u64,
    header: TrafficHeader,
    sum: u64,
}

/// Returns the hash of a map and seed.
pub fn map_sum(episode: &Episode) -> u64 {
    let mut hash = WordHash::new();
    hash.word(episode.seed);
    hash.bytes(episode.open_drive.as_bytes());
    hash.value()
}

/// Returns the hash of a decision of traffic, which is part of the state hash.
pub fn decision_hash(payload: &[u8]) -> u64 {
    let mut hash = WordHash::new();
    hash.bytes(payload);
    hash.value()
}

impl SavedState {
    /// Returns the state as bytes; equal states have equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (header, payload) = self.decision.as_ref().map_or_else(
            || (TrafficHeader::default(), &[][..]),
            |(header, payload)| (*header, &payload[..]),
        );
        let mut head = Head {
            magic: MAGIC,
            version: VERSION,
            last_actor: self.last_actor,
            map: self.map,
            stamp: self.stamp,
            standing: self.standing.len() as u64,
            last_shape: self.last_shape,
            reserved: 0,
            actors: self.actors.len() as u64,
            limbs: self.limbs.len() as u64,
            physics: self.physics.len() as u64,
            decision: self.decision.as_ref().map_or(0, |(_, p)| 1 + p.len() as u64),
            pending: self.pending.len() as u64,
            header,
            sum: 0,
        };
        let parts: [&[u8]; 7] = [
            bytemuck::cast_slice(&self.standing),
            bytemuck::cast_slice(&self.actors),
            bytemuck::cast_slice(&self.roles),
            bytemuck::cast_slice(&self.limbs),
            &self.physics,
            payload,
            bytemuck::cast_slice(&self.pending),
        ];
        let body = parts.concat();
        head.sum = sum(&head, &body);
        [bytemuck::bytes_of(&head), &body].concat()
    }

    /// Reads a state for the world of `map`.
    ///
    /// # Errors
    ///
    /// The bytes are of another version, another map, or damaged.
    pub fn from_bytes(bytes: &[u8], map: u64) -> Result<SavedState, StateError> {
        let (head, body) = bytes
            .split_at_checked(size_of::<Head>())
            .ok_or(StateError::Strange("shorter than the header".to_owned()))?;
        let head: Head = bytemuck::pod_read_unaligned(head);
        if head.magic != MAGIC {
            return Err(StateError::Strange("bad magic".to_owned()));
        }
        if head.version != VERSION {
            let version = head.version;
            return Err(StateError::Strange(format!("version {version}, expected {VERSION}")));
        }
        if head.sum != sum(&Head { sum: 0, ..head }, body) {
            return Err(StateError::Damaged("bad checksum; is the file complete?".to_owned()));
        }
        if head.map != map {
            return Err(StateError::OtherMap);
        }
        let mut rest = body;
        let standing = list(&mut rest, head.standing)?;
        let actors: Vec<ActorState> = list(&mut rest, head.actors)?;
        let roles = list(&mut rest, head.actors)?;
        let limbs = list(&mut rest, head.limbs)?;
        let physics = list(&mut rest, head.physics)?;
        let payload = list(&mut rest, head.decision.saturating_sub(1))?;
        let pending = list(&mut rest, head.pending)?;
        if !rest.is_empty() {
            return Err(StateError::Damaged(format!(
                "{} bytes follow the end of the state",
                rest.len()
            )));
        }
        Ok(SavedState {
            stamp: head.stamp,
            map,
            standing,
            last_shape: head.last_shape,
            last_actor: head.last_actor,
            actors,
            roles,
            limbs,
            physics,
            decision: (head.decision != 0).then_some((head.header, payload)),
            pending,
        })
    }

    /// Makes the checksums of bytes right, as far as the bytes have the layout of a state. Fuzzing
    /// reaches with it what lies behind the checksums.
    pub fn seal(bytes: &mut [u8]) {
        let Some((head, body)) = bytes.split_at_mut_checked(size_of::<Head>()) else { return };
        let mut read: Head = bytemuck::pod_read_unaligned(head);
        let before = [
            (read.standing, size_of::<JournalEntry>()),
            (read.actors, size_of::<ActorState>() + size_of::<Name>()),
            (read.limbs, size_of::<WalkerLimbs>()),
        ];
        let begin = before.iter().fold(0u64, |sum, (count, size)| {
            sum.saturating_add(count.saturating_mul(*size as u64))
        });
        let end = begin.saturating_add(read.physics);
        if let (Ok(begin), Ok(end)) = (usize::try_from(begin), usize::try_from(end))
            && let Some(physics) = body.get_mut(begin..end)
        {
            Physics::seal(physics);
        }
        read.sum = 0;
        read.sum = sum(&read, body);
        head.copy_from_slice(bytemuck::bytes_of(&read));
    }

    /// Returns the planner's state in the decision of traffic.
    pub fn planner(&self) -> Option<Vec<u8>> {
        let (header, payload) = self.decision.as_ref()?;
        let blocks = bytemuck::pod_collect_to_vec::<u8, protocol::Block>(payload);
        Some(header.parts(&blocks)?.planner.to_vec())
    }
}

fn sum(head: &Head, body: &[u8]) -> u64 {
    let mut hash = WordHash::new();
    hash.bytes(bytemuck::bytes_of(head));
    hash.bytes(body);
    hash.value()
}

fn list<T: Pod>(rest: &mut &[u8], count: u64) -> Result<Vec<T>, StateError> {
    let len = usize::try_from(count).ok().and_then(|n| n.checked_mul(size_of::<T>()));
    let split = len.and_then(|len| rest.split_at_checked(len));
    let (front, back) =
        split.ok_or_else(|| StateError::Damaged("shorter than its header says".to_owned()))?;
    *rest = back;
    Ok(front.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> SavedState {
        SavedState {
            map: 7,
            standing: vec![bytemuck::Zeroable::zeroed(); 3],
            last_shape: 4,
            actors: vec![ActorState::default(); 2],
            roles: vec![Name::new("a"), Name::new("b")],
            limbs: vec![WalkerLimbs::default()],
            physics: vec![1, 2, 3],
            decision: Some((TrafficHeader::default(), vec![4; 64])),
            pending: vec![Pending::default()],
            ..SavedState::default()
        }
    }

    #[test]
    fn a_state_survives_conversion_to_bytes_and_back() {
        for state in [state(), SavedState { map: 7, ..SavedState::default() }] {
            assert_eq!(SavedState::from_bytes(&state.to_bytes(), 7), Ok(state));
        }
    }

    #[test]
    fn damaged_bytes_and_states_of_other_maps_are_refused() {
        let bytes = state().to_bytes();
        assert_eq!(SavedState::from_bytes(&bytes, 8), Err(StateError::OtherMap));
        for len in 0..bytes.len() {
            assert!(SavedState::from_bytes(&bytes[..len], 7).is_err(), "{len} bytes");
            let mut bad = bytes.clone();
            bad[len] ^= 4;
            assert!(SavedState::from_bytes(&bad, 7).is_err(), "byte {len}");
        }
    }
}
