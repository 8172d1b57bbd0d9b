//! Snapshots: two arrays in one message, the actors and the limbs of fallen walkers.

use protocol::{ActorState, Block, SnapshotHeader, WalkerLimbs};

use crate::{
    BusError,
    port::{Loan, Reader, Sample, Writer},
};

/// The writing end of the snapshot channel.
#[derive(Debug)]
pub struct SnapshotWriter(pub(crate) Writer<SnapshotHeader, Block>);

impl SnapshotWriter {
    /// Borrows room for a snapshot of so many actors and fallen walkers.
    pub fn loan(&self, actors: usize, limbs: usize) -> Result<SnapshotLoan, BusError> {
        let counts = SnapshotHeader {
            actor_count: actors as u32,
            limbs_count: limbs as u32,
            ..SnapshotHeader::default()
        };
        Ok(SnapshotLoan { loan: self.0.loan(counts.payload_blocks())?, counts })
    }

    /// Connects readers that were made since the last call and sends them the channel's history.
    pub fn connect_readers(&self) -> Result<(), BusError> {
        self.0.connect_readers()
    }
}

/// A snapshot that is being written.
pub struct SnapshotLoan {
    loan: Loan<SnapshotHeader, Block>,
    counts: SnapshotHeader,
}

impl SnapshotLoan {
    /// Room for the actors and for the limbs of fallen walkers, both to be sorted by id.
    pub fn parts_mut(&mut self) -> (&mut [ActorState], &mut [WalkerLimbs]) {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(self.loan.payload_mut());
        let (actors, rest) = bytes.split_at_mut(self.counts.actor_bytes());
        let limbs = &mut rest[..self.counts.limbs_bytes()];
        (bytemuck::cast_slice_mut(actors), bytemuck::cast_slice_mut(limbs))
    }

    /// Sends the snapshot; its bytes do not move.
    pub fn send(self, header: SnapshotHeader) -> Result<(), BusError> {
        let SnapshotHeader { actor_count, limbs_count, .. } = self.counts;
        self.loan.send(SnapshotHeader { actor_count, limbs_count, ..header })
    }
}

/// The reading end of the snapshot channel.
#[derive(Debug)]
pub struct SnapshotReader(pub(crate) Reader<SnapshotHeader, Block>);

impl SnapshotReader {
    /// Returns the oldest snapshot that was not read yet, if there is one. Never blocks.
    pub fn receive(&self) -> Result<Option<Snapshot>, BusError> {
        Ok(self.0.receive()?.map(Snapshot))
    }
}

/// The world at one frame, read in the memory in which the host wrote it.
#[derive(Debug)]
pub struct Snapshot(Sample<SnapshotHeader, Block>);

impl Snapshot {
    /// Frame, state hash and stage clock.
    pub fn header(&self) -> &SnapshotHeader {
        self.0.header()
    }

    /// Every actor, sorted by id.
    pub fn actors(&self) -> &[ActorState] {
        let bytes: &[u8] = bytemuck::cast_slice(self.0.payload());
        bytes.get(..self.header().actor_bytes()).map(bytemuck::cast_slice).unwrap_or_default()
    }

    /// The limbs of every fallen walker, sorted by id.
    pub fn limbs(&self) -> &[WalkerLimbs] {
        let bytes: &[u8] = bytemuck::cast_slice(self.0.payload());
        let header = self.header();
        let limbs = bytes.get(header.actor_bytes()..).and_then(|b| b.get(..header.limbs_bytes()));
        limbs.map(bytemuck::cast_slice).unwrap_or_default()
    }
}
