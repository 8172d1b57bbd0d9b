//! What each role may hold of the bus. A room is handed its own bundle and cannot name another's:
//! traffic has no way to write a snapshot.

use std::collections::BTreeMap;

use crate::{
    ActorState, BatchHeader, Block, BundleHeader, BusError, Command, Founded, Hub, JournalEntry,
    JournalHeader, Page, Reader, RigId, Sample, SnapshotHeader, TrafficHeader, VehicleControl,
    Writer, channel, journal::Journal,
};

/// Actors that a snapshot has room for before it must grow.
const ACTORS_AT_FIRST: usize = 512;
/// Blocks of 64 bytes that traffic's sample has room for before it must grow.
const BLOCKS_AT_FIRST: usize = 1024;

/// A received snapshot.
pub type Snapshot = Sample<SnapshotHeader, ActorState>;
/// A received bundle of one rig's measurements.
pub type Bundle = Sample<BundleHeader, Page>;
/// What traffic decided, received.
pub type TrafficSample = Sample<TrafficHeader, Block>;

fn rig_name(rig: RigId) -> String {
    format!("rig/{}", rig.0)
}

/// The host's ends. Founding them makes the channels.
pub struct HostPorts {
    /// The truth.
    pub snapshot: Writer<SnapshotHeader, ActorState>,
    /// What was wished, and what became of it.
    pub journal: Writer<JournalHeader, JournalEntry>,
    /// A restarted traffic's own mind.
    pub resume: Writer<TrafficHeader, Block>,
    /// Wishes.
    pub command: Reader<BatchHeader, Command>,
    /// Pedals.
    pub control: Reader<BatchHeader, VehicleControl>,
    /// What traffic decided.
    pub traffic: Reader<TrafficHeader, Block>,
    rigs: BTreeMap<RigId, Founded<BundleHeader, Page>>,
    hub: Hub,
    _founded: Box<dyn std::any::Any>,
}

impl HostPorts {
    /// Makes every channel of the instance and the host's ends of them.
    pub fn found(hub: Hub) -> Result<HostPorts, BusError> {
        let row = channel;
        let founded = Box::new((
            hub.found::<BatchHeader, Command>(row("command"), "command", row("command").held)?,
            hub.found::<BatchHeader, VehicleControl>(
                row("control"),
                "control",
                row("control").held,
            )?,
            hub.found::<JournalHeader, JournalEntry>(
                row("journal"),
                "journal",
                row("journal").held,
            )?,
            hub.found::<SnapshotHeader, ActorState>(
                row("snapshot"),
                "snapshot",
                row("snapshot").held,
            )?,
            hub.found::<TrafficHeader, Block>(row("resume"), "resume", row("resume").held)?,
            hub.found::<TrafficHeader, Block>(row("traffic"), "traffic", row("traffic").held)?,
        ));
        Ok(HostPorts {
            snapshot: hub.writer(row("snapshot"), "snapshot", ACTORS_AT_FIRST, true, 2)?,
            journal: hub.writer(row("journal"), "journal", 4, true, 2)?,
            resume: hub.writer(row("resume"), "resume", BLOCKS_AT_FIRST, true, 1)?,
            command: hub.reader(row("command"), "command")?,
            control: hub.reader(row("control"), "control")?,
            traffic: hub.reader(row("traffic"), "traffic")?,
            rigs: BTreeMap::new(),
            hub,
            _founded: founded,
        })
    }

    /// Makes a rig's channel, whose readers may hold `held` bundles each.
    pub fn found_rig(&mut self, rig: RigId, held: usize) -> Result<(), BusError> {
        let founded = self.hub.found(channel("rig"), &rig_name(rig), held)?;
        self.rigs.insert(rig, founded);
        Ok(())
    }

    /// The end into which the host's own bundles of a rig go, at most `bundle_bytes` each.
    pub fn rig(
        &self,
        rig: RigId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        self.hub.rig_writer(rig, bundle_bytes)
    }

    /// Gives a rig's channel up; it goes when its last port goes.
    pub fn forget_rig(&mut self, rig: RigId) {
        self.rigs.remove(&rig);
    }

    /// Shared memory that a rig of `bundle_bytes` may come to need, every queue full.
    pub fn rig_bytes(bundle_bytes: u64, held: usize) -> u64 {
        let row = channel("rig");
        let chunks = row.readers_max * (row.depth + held) + row.history + RIG_LOANS;
        bundle_bytes.next_multiple_of(4096) * chunks as u64
    }

    /// The host's place on the bus, for cleaning up.
    pub fn hub(&self) -> &Hub {
        &self.hub
    }
}

/// Bundles of one rig that may be in the making at a time.
const RIG_LOANS: usize = crate::PIPELINE_MAX as usize + 1;

/// Traffic's ends.
pub struct TrafficPorts {
    /// The truth.
    pub snapshot: Reader<SnapshotHeader, ActorState>,
    /// What was wished, and what became of it.
    pub journal: Journal,
    /// Its own mind, if this is not its first life.
    pub resume: Reader<TrafficHeader, Block>,
    /// What it decides.
    pub decided: Writer<TrafficHeader, Block>,
    _hub: Hub,
}

impl TrafficPorts {
    /// Opens them.
    pub fn open(hub: Hub) -> Result<TrafficPorts, BusError> {
        Ok(TrafficPorts {
            snapshot: hub.reader(channel("snapshot"), "snapshot")?,
            journal: Journal::new(hub.reader(channel("journal"), "journal")?),
            resume: hub.reader(channel("resume"), "resume")?,
            decided: hub.writer(channel("traffic"), "traffic", BLOCKS_AT_FIRST, true, 1)?,
            _hub: hub,
        })
    }
}

/// The renderer's ends.
pub struct RenderPorts {
    /// The truth.
    pub snapshot: Reader<SnapshotHeader, ActorState>,
    /// What was wished, and what became of it.
    pub journal: Journal,
    hub: Hub,
}

impl RenderPorts {
    /// Opens them.
    pub fn open(hub: Hub) -> Result<RenderPorts, BusError> {
        Ok(RenderPorts {
            snapshot: hub.reader(channel("snapshot"), "snapshot")?,
            journal: Journal::new(hub.reader(channel("journal"), "journal")?),
            hub,
        })
    }

    /// The end into which a rig's bundles of at most `bundle_bytes` go.
    pub fn rig(
        &self,
        rig: RigId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        self.hub.rig_writer(rig, bundle_bytes)
    }
}

impl Hub {
    fn rig_writer(
        &self,
        rig: RigId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        let pages = bundle_bytes.div_ceil(4096) as usize;
        self.writer(channel("rig"), &rig_name(rig), pages, false, RIG_LOANS)
    }
}

/// A client's ends.
pub struct ClientPorts {
    /// The truth.
    pub snapshot: Reader<SnapshotHeader, ActorState>,
    /// What was wished, and what became of it.
    pub journal: Journal,
    /// Wishes.
    pub command: Writer<BatchHeader, Command>,
    /// Pedals.
    pub control: Writer<BatchHeader, VehicleControl>,
    hub: Hub,
}

impl ClientPorts {
    /// Opens them.
    pub fn open(hub: Hub) -> Result<ClientPorts, BusError> {
        Ok(ClientPorts {
            snapshot: hub.reader(channel("snapshot"), "snapshot")?,
            journal: Journal::new(hub.reader(channel("journal"), "journal")?),
            command: hub.writer(channel("command"), "command", 4, true, 2)?,
            control: hub.writer(channel("control"), "control", 4, true, 2)?,
            hub,
        })
    }

    /// The end from which a rig's bundles come.
    pub fn rig(&self, rig: RigId) -> Result<Reader<BundleHeader, Page>, BusError> {
        self.hub.reader(channel("rig"), &rig_name(rig))
    }
}
