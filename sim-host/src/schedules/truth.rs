//! What happened, as the host published it, and what stages have to know of it.

use std::collections::{BTreeMap, BTreeSet};

use bus::{Reader, observer};
use mesh::WordHash;
use protocol::{
    Block, BundleId, Command, Frame, HideLayers, JournalEntry, JournalHeader, Outcome, Settings,
    SnapshotHeader, Stamp, StandingState, TrafficHeader, param, status,
};

/// What the planner of a schedule knows: commands that act once, in their order, and a setting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct PlannerState {
    once: u64,
    lasting: u64,
}

impl PlannerState {
    pub(super) fn apply(&mut self, entry: &JournalEntry) {
        if let Some(Command::TrafficParam(set)) = entry.command.decode()
            && entry.outcome.status == status::DONE
        {
            let value = u64::from(set.value.to_bits());
            if param::is_once(set.param) {
                self.once = (self.once.rotate_left(7) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            } else {
                self.lasting = value;
            }
        }
    }
}

/// The sum of a journal.
#[derive(Clone, Debug, Default)]
pub(super) struct Folded {
    pub(super) standing: StandingState,
    pub(super) bundles: BTreeSet<BundleId>,
    planner: PlannerState,
}

impl Folded {
    pub(super) fn apply(&mut self, entry: &JournalEntry) {
        if entry.outcome.status != status::DONE {
            return;
        }
        let Some(command) = entry.command.decode() else { return };
        self.standing.apply(&command, &entry.outcome);
        match command {
            Command::CreateBundle(_) => {
                self.bundles.insert(BundleId(entry.outcome.id));
            }
            Command::DestroyBundle(id) => {
                self.bundles.remove(&id);
            }
            Command::LoadMap(_) => self.planner = PlannerState::default(),
            _ => self.planner.apply(entry),
        }
    }

    fn digest(&self) -> u64 {
        let mut hash = WordHash::new();
        hash_standing(&mut hash, &self.standing);
        self.bundles.iter().for_each(|bundle| hash.word(bundle.0.into()));
        hash.value()
    }
}

fn hash_standing(hash: &mut WordHash, standing: &StandingState) {
    for (command, outcome) in standing.commands() {
        let raw: protocol::RawCommand = command.into();
        hash.bytes(bytemuck::bytes_of(&raw));
        hash.bytes(&outcome.text[..32]);
    }
}

/// A published frame.
struct Published {
    entries: Vec<JournalEntry>,
    settings: Settings,
    planner: PlannerState,
    digest: u64,
}

/// Every published frame.
pub(super) struct Truth {
    outcomes: Option<Reader<JournalHeader, JournalEntry>>,
    snapshots: Option<Reader<SnapshotHeader, Block>>,
    decisions: Option<Reader<TrafficHeader, Block>>,
    /// Entries by their frame, which is not published yet.
    coming: BTreeMap<Frame, Vec<JournalEntry>>,
    folded: Folded,
    published: Vec<Published>,
    /// The frame up to which the work of each stage is done.
    done: [Frame; 2],
}

impl Truth {
    pub(super) fn new(settings: Settings) -> Truth {
        let mut folded = Folded::default();
        let hide = HideLayers { layers: 0, hidden: 1 };
        for command in [Command::SetSettings(settings), Command::HideLayers(hide)] {
            folded.standing.apply(&command, &Outcome::done(0));
        }
        Truth {
            outcomes: None,
            snapshots: None,
            decisions: None,
            coming: BTreeMap::new(),
            folded,
            published: Vec::new(),
            done: [Frame(0); 2],
        }
    }

    /// Reads the channels of the host from now on.
    pub(super) fn observe(&mut self) {
        self.outcomes = Some(observer("outcome").unwrap());
        self.snapshots = Some(observer("snapshot").unwrap());
        self.decisions = Some(observer("traffic").unwrap());
    }

    /// Takes in what the host and traffic have sent.
    pub(super) fn update(&mut self) {
        while let Some(part) = self.outcomes.as_ref().and_then(|o| o.receive().unwrap()) {
            let entries = self.coming.entry(part.header().stamp.frame).or_default();
            assert_eq!(entries.len(), part.header().first as usize, "outcomes are out of order");
            entries.extend_from_slice(part.payload());
        }
        while let Some(snapshot) = self.snapshots.as_ref().and_then(|s| s.receive().unwrap()) {
            self.publish(snapshot.header());
        }
        while let Some(decision) = self.decisions.as_ref().and_then(|d| d.receive().unwrap()) {
            let header = decision.header();
            let frame = header.stamp.frame;
            let planner = header.parts(decision.payload()).unwrap().planner;
            assert_eq!(
                bytemuck::pod_read_unaligned::<PlannerState>(planner),
                self.published[frame.0 as usize].planner,
                "traffic planned {frame} from another journal"
            );
            self.done[0] = self.done[0].max(frame);
        }
    }

    fn publish(&mut self, header: &SnapshotHeader) {
        let Stamp { frame, .. } = header.stamp;
        assert_eq!(frame.0, self.published.len() as u64, "frames are out of order");
        let entries = self.coming.remove(&frame).unwrap_or_default();
        assert_eq!(entries.len(), header.journal_entries as usize, "{frame} lacks outcomes");
        entries.iter().for_each(|entry| self.folded.apply(entry));
        self.folded.standing.shapes.begin_frame(header.stamp);
        self.published.push(Published {
            entries,
            settings: self.folded.standing.settings,
            planner: self.folded.planner,
            digest: self.folded.digest(),
        });
        self.folded.standing.end_frame(header.stamp);
    }

    /// The number of published frames.
    pub(super) fn frames(&self) -> usize {
        self.published.len()
    }

    /// Checks that a stage has received the entries of the frames after `last` up to `frame`.
    pub(super) fn check_entries(
        &mut self,
        who: &str,
        last: Frame,
        frame: Frame,
        entries: impl Iterator<Item = JournalEntry>,
    ) {
        self.update();
        let expected = &self.published[last.0 as usize + 1..=frame.0 as usize];
        let mut expected = expected.iter().flat_map(|published| &published.entries);
        let mut count = 0;
        for entry in entries {
            assert!(expected.next() == Some(&entry), "{who}, {frame}: entry {count} is another");
            count += 1;
        }
        assert_eq!(expected.count(), 0, "{who}, {frame}: only {count} entries arrived");
    }

    /// Checks what a renderer knows at `frame`.
    pub(super) fn check_fold(&mut self, frame: Frame, stamp: Stamp, folded: &Folded) {
        let mut folded = folded.clone();
        folded.standing.shapes.begin_frame(stamp);
        let expected = self.published[frame.0 as usize].digest;
        assert_eq!(folded.digest(), expected, "the renderer knows another world at {frame}");
    }

    /// Checks what the host knows after the last frame.
    pub(super) fn check_standing(&self, standing: &StandingState) {
        let digest = |standing: &StandingState| {
            let mut hash = WordHash::new();
            hash_standing(&mut hash, standing);
            hash.value()
        };
        let own = digest(&self.folded.standing);
        assert_eq!(digest(standing), own, "the host knows another world than its journal says");
    }

    /// The work of a stage is done up to `frame`.
    pub(super) fn set_done(&mut self, slot: usize, frame: Frame) {
        self.done[slot] = self.done[slot].max(frame);
    }

    /// Checks that both stages have done their work on `frame`, which is complete.
    pub(super) fn check_complete(&mut self, frame: Frame) {
        self.update();
        let around = &self.published[frame.0 as usize..];
        if around.iter().any(|published| published.settings.synchronous == 0) {
            return;
        }
        let lag = around.iter().map(|published| published.settings.pipeline).max().unwrap_or(0);
        let [traffic, render] = self.done;
        assert!(traffic >= frame, "{frame} is complete, and traffic has planned {traffic} only");
        assert!(
            render.0 + u64::from(lag) >= frame.0,
            "{frame} is complete, and the renderer has measured {render} only"
        );
    }
}
