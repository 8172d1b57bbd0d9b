//! The ports of each role. A role receives its own ports only: traffic cannot write a snapshot.

use std::collections::BTreeMap;

use crate::{
    BusError, BusNode, Reader, Sample, Writer, channel,
    journal::{Journal, Outcomes},
    port::OwnedService,
    snapshot::{SnapshotReader, SnapshotWriter},
};
use protocol::{
    BatchHeader, Block, BundleHeader, BundleId, JOURNAL_PART_MAX, JournalEntry, JournalHeader,
    Page, Query, QueryHeader, RawCommand, Response, SnapshotHeader, TrafficHeader, VehicleControl,
};

/// Initial capacity of a snapshot and of traffic's message in blocks of 64 bytes.
const BLOCKS_AT_FIRST: usize = 1024;

/// The measurements of one sensor bundle at one frame, as received.
pub type BundleSample = Sample<BundleHeader, Page>;
/// Traffic's decisions of one frame, as received.
pub type TrafficSample = Sample<TrafficHeader, Block>;

fn bundle_name(bundle: BundleId) -> String {
    format!("bundle/{}", bundle.0)
}

/// The ports of the host, which creates the channels.
pub struct HostPorts {
    /// Snapshots of the world.
    pub snapshot: SnapshotWriter,
    /// Outcomes of commands, for clients.
    pub outcome: Writer<JournalHeader, JournalEntry>,
    /// Commands and their outcomes by frame, for stages.
    pub journal: Writer<JournalHeader, JournalEntry>,
    /// The planner state for a restarted traffic process.
    pub resume: Writer<TrafficHeader, Block>,
    /// Commands.
    pub command: Reader<BatchHeader, RawCommand>,
    /// Vehicle controls.
    pub control: Reader<BatchHeader, VehicleControl>,
    /// Queries.
    pub query: Reader<QueryHeader, Query>,
    /// The responses to queries.
    pub response: Writer<QueryHeader, Response>,
    /// Traffic's decisions.
    pub traffic: Reader<TrafficHeader, Block>,
    bundles: BTreeMap<BundleId, OwnedService<BundleHeader, Page>>,
    node: BusNode,
    _owned: Box<dyn std::any::Any>,
}

impl HostPorts {
    /// Creates every channel of the instance and the host's ports.
    pub fn create(node: BusNode) -> Result<HostPorts, BusError> {
        let row = channel;
        let owned = Box::new((
            node.create::<BatchHeader, RawCommand>(row("command"), "command", row("command").held)?,
            node.create::<BatchHeader, VehicleControl>(
                row("control"),
                "control",
                row("control").held,
            )?,
            node.create::<QueryHeader, Query>(row("query"), "query", row("query").held)?,
            node.create::<QueryHeader, Response>(
                row("response"),
                "response",
                row("response").held,
            )?,
            node.create::<JournalHeader, JournalEntry>(
                row("outcome"),
                "outcome",
                row("outcome").held,
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
            // Parts of a fixed room: the connection to a reader of a channel that grows has 256 bytes
            // for each message that may exist.
            outcome: node.writer(row("outcome"), "outcome", JOURNAL_PART_MAX, false, 2)?,
            journal: node.writer(row("journal"), "journal", JOURNAL_PART_MAX, false, 2)?,
            resume: node.writer(row("resume"), "resume", BLOCKS_AT_FIRST, true, 1)?,
            command: node.reader(row("command"), "command")?,
            control: node.reader(row("control"), "control")?,
            query: node.reader(row("query"), "query")?,
            response: node.writer(row("response"), "response", 16, true, 1)?,
            traffic: node.reader(row("traffic"), "traffic")?,
            bundles: BTreeMap::new(),
            node,
            _owned: owned,
        })
    }

    /// Creates the channel of a bundle, whose readers may borrow `held` messages each.
    pub fn create_bundle(&mut self, bundle: BundleId, held: usize) -> Result<(), BusError> {
        let owned = self.node.create(channel("bundle"), &bundle_name(bundle), held)?;
        self.bundles.insert(bundle, owned);
        Ok(())
    }

    /// A writer for a bundle that the host measures, of at most `bundle_bytes` per message.
    pub fn bundle(
        &self,
        bundle: BundleId,
        bundle_bytes: u64,
    ) -> Result<Writer<BundleHeader, Page>, BusError> {
        self.node.bundle_writer(bundle, bundle_bytes)
    }

    /// Releases the channel of a bundle; it is removed with its last port.
    pub fn remove_bundle(&mut self, bundle: BundleId) {
        self.bundles.remove(&bundle);
    }

    /// Shared memory that the channel of a bundle of `bundle_bytes` needs when every queue is full.
    pub fn bundle_channel_bytes(bundle_bytes: u64, held: usize) -> u64 {
        let row = channel("bundle");
        let chunks = row.readers_max * (row.depth + held) + row.history + BUNDLE_LOANS;
        bundle_bytes.next_multiple_of(4096) * chunks as u64
    }

    /// The host's node, for cleaning up after dead processes.
    pub fn node(&self) -> &BusNode {
        &self.node
    }
}

/// Messages of one bundle that may be written at a time.
const BUNDLE_LOANS: usize = protocol::PIPELINE_MAX as usize + 1;

/// The ports of traffic.
pub struct TrafficPorts {
    /// Snapshots of the world.
    pub snapshot: SnapshotReader,
    /// Commands and their outcomes.
    pub journal: Journal,
    /// The planner state, after a restart.
    pub resume: Reader<TrafficHeader, Block>,
    /// Traffic's decisions.
    pub decided: Writer<TrafficHeader, Block>,
    _node: BusNode,
}

impl TrafficPorts {
    /// Opens the ports.
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

/// The ports of the renderer.
pub struct RenderPorts {
    /// Snapshots of the world.
    pub snapshot: SnapshotReader,
    /// Commands and their outcomes.
    pub journal: Journal,
    node: BusNode,
}

impl RenderPorts {
    /// Opens the ports.
    pub fn open(node: BusNode) -> Result<RenderPorts, BusError> {
        Ok(RenderPorts {
            snapshot: SnapshotReader(node.reader(channel("snapshot"), "snapshot")?),
            journal: Journal::new(node.reader(channel("journal"), "journal")?),
            node,
        })
    }

    /// A writer for a bundle of at most `bundle_bytes` per message.
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
    pub outcomes: Outcomes,
    /// Commands.
    pub command: Writer<BatchHeader, RawCommand>,
    /// Pedals and wheels.
    pub control: Writer<BatchHeader, VehicleControl>,
    /// Queries.
    pub query: Writer<QueryHeader, Query>,
    /// The responses to the queries of all clients.
    pub response: Reader<QueryHeader, Response>,
    /// Measurements of the client's bundles.
    pub bundles: BundleReaders,
}

impl ClientPorts {
    /// Opens the ends.
    pub fn open(node: BusNode) -> Result<ClientPorts, BusError> {
        Ok(ClientPorts {
            snapshot: SnapshotReader(node.reader(channel("snapshot"), "snapshot")?),
            outcomes: Outcomes::new(node.reader(channel("outcome"), "outcome")?),
            command: node.writer(channel("command"), "command", 4, true, 2)?,
            control: node.writer(channel("control"), "control", 4, true, 2)?,
            query: node.writer(channel("query"), "query", 16, true, 1)?,
            response: node.reader(channel("response"), "response")?,
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
