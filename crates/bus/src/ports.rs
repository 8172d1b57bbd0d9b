//! What each role may hold of the bus. A room is handed its own bundle and cannot name another's:
//! traffic has no way to write a snapshot.

use std::collections::BTreeMap;

use crate::{
    BusError, BusNode, Reader, Sample, Writer, channel,
    journal::Journal,
    port::OwnedService,
    snapshot::{SnapshotReader, SnapshotWriter},
};
use protocol::{
    BatchHeader, Block, BundleHeader, BundleId, JournalEntry, JournalHeader, Page, RawCommand,
    SnapshotHeader, TrafficHeader, VehicleControl,
};

/// Blocks of 64 bytes that a snapshot and traffic's sample have room for before they must grow.
const BLOCKS_AT_FIRST: usize = 1024;

/// A received bundle of one bundle's measurements.
pub type BundleSample = Sample<BundleHeader, Page>;
/// What traffic decided, received.
pub type TrafficSample = Sample<TrafficHeader, Block>;

fn bundle_name(bundle: BundleId) -> String {
    format!("bundle/{}", bundle.0)
}

/// The host's ends. OwnedInstance them makes the channels.
pub struct HostPorts {
    /// The truth.
    pub snapshot: SnapshotWriter,
    /// What was requested, and what became of it.
    pub journal: Writer<JournalHeader, JournalEntry>,
    /// A restarted traffic's own planner.
    pub resume: Writer<TrafficHeader, Block>,
    /// Commands.
    pub command: Reader<BatchHeader, RawCommand>,
    /// Pedals.
    pub control: Reader<BatchHeader, VehicleControl>,
    /// What traffic decided.
    pub traffic: Reader<TrafficHeader, Block>,
    bundles: BTreeMap<BundleId, OwnedService<BundleHeader, Page>>,
    node: BusNode,
    _owned: Box<dyn std::any::Any>,
}

impl HostPorts {
    /// Makes every channel of the instance and the host's ends of them.
    pub fn create(node: BusNode) -> Result<HostPorts, BusError> {
        let row = channel;
        let owned = Box::new((
            node.create::<BatchHeader, RawCommand>(row("command"), "command", row("command").held)?,
            node.create::<BatchHeader, VehicleControl>(
                row("control"),
                "control",
                row("control").held,
            )?,
            node.create::<JournalHeader, JournalEntry>(
                row("journal"),
                "journal",
                row("journal").held,
            )?,
            node.create::<SnapshotHeader, Block>(
                row("snapshot"),
                "snapshot",
                row("snapshot").held,
            )?,
            node.create::<TrafficHeader, Block>(row("resume"), "resume", row("resume").held)?,
            node.create::<TrafficHeader, Block>(row("traffic"), "traffic", row("traffic").held)?,
        ));
        Ok(HostPorts {
            snapshot: SnapshotWriter(node.writer(
                row("snapshot"),
                "snapshot",
                BLOCKS_AT_FIRST,
                true,
                2,
            )?),
            journal: node.writer(row("journal"), "journal", 4, true, 2)?,
            resume: node.writer(row("resume"), "resume", BLOCKS_AT_FIRST, true, 1)?,
            command: node.reader(row("command"), "command")?,
            control: node.reader(row("control"), "control")?,
            traffic: node.reader(row("traffic"), "traffic")?,
            bundles: BTreeMap::new(),
            node,
            _owned: owned,
        })
    }

    /// Makes a bundle's channel, whose readers may hold `held` bundles each.
    pub fn create_bundle(&mut self, bundle: BundleId, held: usize) -> Result<(), BusError> {
        let owned = self.node.create(channel("bundle"), &bundle_name(bundle), held)?;
        self.bundles.insert(bundle, owned);
        Ok(())
    }

    /// The end into which the host's own bundles of a bundle go, at most `bundle_bytes` each.
    pub fn bundle(
        &self,
        bundle: BundleId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        self.node.bundle_writer(bundle, bundle_bytes)
    }

    /// Gives a bundle's channel up; it goes when its last port goes.
    pub fn remove_bundle(&mut self, bundle: BundleId) {
        self.bundles.remove(&bundle);
    }

    /// Shared memory that a bundle of `bundle_bytes` may come to need, every queue full.
    pub fn bundle_channel_bytes(bundle_bytes: u64, held: usize) -> u64 {
        let row = channel("bundle");
        let chunks = row.readers_max * (row.depth + held) + row.history + BUNDLE_LOANS;
        bundle_bytes.next_multiple_of(4096) * chunks as u64
    }

    /// The host's place on the bus, for cleaning up.
    pub fn node(&self) -> &BusNode {
        &self.node
    }
}

/// Bundles of one bundle that may be in the making at a time.
const BUNDLE_LOANS: usize = protocol::PIPELINE_MAX as usize + 1;

/// Traffic's ends.
pub struct TrafficPorts {
    /// The truth.
    pub snapshot: SnapshotReader,
    /// What was requested, and what became of it.
    pub journal: Journal,
    /// Its own planner, if this is not its first life.
    pub resume: Reader<TrafficHeader, Block>,
    /// What it decides.
    pub decided: Writer<TrafficHeader, Block>,
    _node: BusNode,
}

impl TrafficPorts {
    /// Opens them.
    pub fn open(node: BusNode) -> Result<TrafficPorts, BusError> {
        Ok(TrafficPorts {
            snapshot: SnapshotReader(node.reader(channel("snapshot"), "snapshot")?),
            journal: Journal::new(node.reader(channel("journal"), "journal")?),
            resume: node.reader(channel("resume"), "resume")?,
            decided: node.writer(channel("traffic"), "traffic", BLOCKS_AT_FIRST, true, 1)?,
            _node: node,
        })
    }
}

/// The renderer's ends.
pub struct RenderPorts {
    /// The truth.
    pub snapshot: SnapshotReader,
    /// What was requested, and what became of it.
    pub journal: Journal,
    node: BusNode,
}

impl RenderPorts {
    /// Opens them.
    pub fn open(node: BusNode) -> Result<RenderPorts, BusError> {
        Ok(RenderPorts {
            snapshot: SnapshotReader(node.reader(channel("snapshot"), "snapshot")?),
            journal: Journal::new(node.reader(channel("journal"), "journal")?),
            node,
        })
    }

    /// The end into which a bundle's bundles of at most `bundle_bytes` go.
    pub fn bundle(
        &self,
        bundle: BundleId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        self.node.bundle_writer(bundle, bundle_bytes)
    }
}

impl BusNode {
    fn bundle_writer(
        &self,
        bundle: BundleId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        let pages = bundle_bytes.div_ceil(4096) as usize;
        self.writer(channel("bundle"), &bundle_name(bundle), pages, false, BUNDLE_LOANS)
    }
}

/// A client's ends of the channels.
pub struct ClientPorts {
    /// Snapshots of the world.
    pub snapshot: SnapshotReader,
    /// Commands that were carried out, and their outcomes.
    pub journal: Journal,
    /// Commands.
    pub command: Writer<BatchHeader, RawCommand>,
    /// Pedals and wheels.
    pub control: Writer<BatchHeader, VehicleControl>,
    /// Measurements of the client's bundles.
    pub bundles: BundleReaders,
}

impl ClientPorts {
    /// Opens the ends.
    pub fn open(node: BusNode) -> Result<ClientPorts, BusError> {
        Ok(ClientPorts {
            snapshot: SnapshotReader(node.reader(channel("snapshot"), "snapshot")?),
            journal: Journal::new(node.reader(channel("journal"), "journal")?),
            command: node.writer(channel("command"), "command", 4, true, 2)?,
            control: node.writer(channel("control"), "control", 4, true, 2)?,
            bundles: BundleReaders(node),
        })
    }
}

/// Opens the reading ends of bundles.
pub struct BundleReaders(BusNode);

impl BundleReaders {
    /// Opens the end from which the measurements of a bundle come.
    pub fn open(&self, bundle: BundleId) -> Result<Reader<BundleHeader, Page>, BusError> {
        self.0.reader(channel("bundle"), &bundle_name(bundle))
    }
}
