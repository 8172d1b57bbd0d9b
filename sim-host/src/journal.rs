//! The journal: commands arrive in a fixed order; entries with outcomes are published in parts.

use std::collections::VecDeque;

use bus::{BusError, HostPorts, SLOTS};
use protocol::{
    BATCH_MAX, BatchHeader, Command, Frame, JOURNAL_PART_MAX, JournalEntry, JournalHeader, Name,
    RawCommand, SENSORS_MAX, Stamp, VehicleControl,
};

use crate::request::{Pending, Request};

/// A batch of commands of one client that waits for its time.
pub(crate) struct Batch {
    header: BatchHeader,
    commands: Vec<RawCommand>,
}

/// Commands that clients sent and the host has not applied yet.
#[derive(Default)]
pub(crate) struct Inbox {
    batches: Vec<Batch>,
    /// Batches that end within the sensors of a bundle: the rest of these sensors is on its way.
    unfinished: Vec<Batch>,
    controls: Vec<(BatchHeader, Vec<VehicleControl>)>,
    /// The newest frame that the writer of each batch of controls had seen, of those taken last.
    control_frames: Vec<Frame>,
}

/// With so many batches waiting, others stay in the channels, and their writers wait.
const BATCHES_ENOUGH: usize = 4096;

/// With so many batches waiting, a tick applies all of them, whoever sent them.
const BATCHES_MAX: usize = 4096;

impl Inbox {
    /// Receives batches from the channels: all of them, or only if few wait already. Returns whether
    /// some are to be applied now.
    pub(crate) fn drain(&mut self, ports: &HostPorts, all: bool) -> Result<bool, BusError> {
        let channel = bus::channel("command");
        // No more than the channels held at first: clients may send as fast as this receives.
        for _ in 0..channel.depth * channel.writers_max {
            if !all && self.batches.len() >= BATCHES_ENOUGH {
                break;
            }
            let Some(batch) = ports.command.receive()? else { break };
            self.add(Batch { header: *batch.header(), commands: batch.payload().to_vec() });
        }
        while let Some(batch) = ports.control.receive()? {
            self.controls.push((*batch.header(), batch.payload().to_vec()));
        }
        Ok(self.has_urgent(|_| true))
    }

    /// Adds what arrived to the batches that wait. A bundle with more sensors than fit into a batch
    /// becomes one batch, because it is applied as a whole.
    fn add(&mut self, arrived: Batch) {
        let is_last = arrived.commands.len() < BATCH_MAX;
        let of_client = |batch: &Batch| batch.header.client == arrived.header.client;
        let begun = self.unfinished.iter().position(of_client);
        let mut batch = arrived;
        if let Some(mut begun) = begun.map(|index| self.unfinished.remove(index)) {
            if begun.header.sequence + begun.commands.len() as u64 == batch.header.sequence {
                begun.commands.append(&mut batch.commands);
                batch = begun;
            } else {
                self.batches.push(begun);
            }
        }
        if is_last || !awaits_sensors(&batch.commands) {
            self.batches.push(batch);
            return;
        }
        self.unfinished.push(batch);
        if self.unfinished.len() > SLOTS {
            // Of clients that are gone.
            self.batches.append(&mut self.unfinished);
        }
    }

    /// The frames on which the controls were sent that a frame took last.
    pub(crate) fn control_frames(&self) -> &[Frame] {
        &self.control_frames
    }

    /// Returns the number of batches of commands that wait.
    pub(crate) fn len(&self) -> usize {
        self.batches.len()
    }

    /// Whether commands of such a client wait that are to be applied now.
    pub(crate) fn has_urgent(&self, is_asked: impl Fn(Name) -> bool) -> bool {
        self.batches.iter().any(|b| b.header.now != 0 && is_asked(b.header.client))
    }

    /// Returns the requests of a frame: commands, then controls, each by (client, sequence). All
    /// commands of the ticking client belong to it; of other clients, one pass of `others` batches.
    pub(crate) fn take(&mut self, ticking: Option<Name>, others: usize) -> Vec<Request> {
        let is_full = self.batches.len() > BATCHES_MAX;
        let batches = std::mem::take(&mut self.batches);
        let is_whole = |batch: &Batch| is_full || Some(batch.header.client) == ticking;
        let (mut whole, rest): (Vec<_>, Vec<_>) = batches.into_iter().partition(is_whole);
        whole.extend(self.one_pass(rest, others));
        self.requests(whole)
    }

    /// Returns the batches of one pass, and keeps the others: as many of each client, in their order,
    /// and at least one of each if `count` is not 0.
    fn one_pass(&mut self, mut batches: Vec<Batch>, count: usize) -> Vec<Batch> {
        if count == 0 {
            self.batches.append(&mut batches);
            return batches;
        }
        batches.sort_by_key(|b| (b.header.client, b.header.sequence));
        let clients = batches.chunk_by(|a, b| a.header.client == b.header.client).count();
        let share = (count / clients.max(1)).max(1);
        let mut last = (Name::default(), 0);
        let (mut pass, rest): (Vec<_>, Vec<_>) = batches.into_iter().partition(|batch| {
            let client = batch.header.client;
            last = (client, if client == last.0 { last.1 + 1 } else { 1 });
            last.1 <= share
        });
        // At most one large bundle in a pass: clients have room for its outcomes.
        if let Some(long) = pass.iter().position(|batch| batch.commands.len() > BATCH_MAX) {
            self.batches.extend(pass.drain(long + 1..));
        }
        self.batches.extend(rest);
        pass
    }

    /// Returns commands, then all controls, each by (client, sequence).
    fn requests(&mut self, mut batches: Vec<Batch>) -> Vec<Request> {
        batches.sort_by_key(|b| (b.header.client, b.header.sequence));
        self.controls.sort_by_key(|(header, _)| (header.client, header.sequence));
        let mut requests = Vec::new();
        for batch in batches {
            push(&mut requests, &batch.header, &batch.commands);
        }
        self.control_frames.clear();
        for (header, controls) in self.controls.drain(..) {
            self.control_frames.push(header.stamp.frame);
            for (index, control) in controls.into_iter().enumerate() {
                requests.push(Request {
                    client: header.client,
                    sequence: header.sequence + index as u64,
                    command: Command::Control(control).into(),
                });
            }
        }
        requests
    }

    /// Returns the requests of one pass that are to be applied between two frames, by client: of each,
    /// those up to its last batch that asks for it. The pass has as many batches of the ticking client
    /// and of the others as `counts` says.
    pub(crate) fn take_urgent(
        &mut self,
        ticking: Option<Name>,
        counts: [usize; 2],
    ) -> Vec<Request> {
        let mut urgent = Vec::new();
        let mut rest = Vec::new();
        for batch in self.batches.drain(..) {
            if batch.header.now != 0 { urgent.push(batch) } else { rest.push(batch) }
        }
        let precedes_urgent = |b: &Batch| {
            let same = urgent.iter().filter(|u| u.header.client == b.header.client);
            same.map(|u| u.header.sequence).max().is_some_and(|last| b.header.sequence < last)
        };
        let (earlier, later): (Vec<_>, Vec<_>) = rest.into_iter().partition(precedes_urgent);
        urgent.extend(earlier);
        self.batches = later;
        let is_own = |batch: &Batch| Some(batch.header.client) == ticking;
        let (own, others): (Vec<_>, Vec<_>) = urgent.into_iter().partition(is_own);
        let mut urgent = self.one_pass(own, counts[0]);
        urgent.extend(self.one_pass(others, counts[1]));
        urgent.sort_by_key(|b| (b.header.client, b.header.sequence));
        let mut requests = Vec::new();
        for batch in urgent {
            push(&mut requests, &batch.header, &batch.commands);
        }
        requests
    }

    /// Returns the requests that wait for the next frame, unordered.
    pub(crate) fn waiting(&self) -> Vec<Pending> {
        let mut requests = Vec::new();
        for batch in &self.batches {
            push(&mut requests, &batch.header, &batch.commands);
        }
        let mut waiting: Vec<_> = requests.iter().map(|r| r.pending(false)).collect();
        for (header, controls) in &self.controls {
            let mut requests = Vec::new();
            let commands: Vec<_> = controls.iter().map(|c| Command::Control(*c).into()).collect();
            push(&mut requests, header, &commands);
            waiting.extend(requests.iter().map(|r| r.pending(true)));
        }
        waiting
    }

    /// Replaces the waiting requests, and returns the replaced ones.
    pub(crate) fn replace(&mut self, pending: &[Pending]) -> Vec<Request> {
        let mut batches = std::mem::take(&mut self.batches);
        batches.append(&mut self.unfinished);
        let dropped = self.requests(batches);
        for command in pending {
            let header = BatchHeader {
                client: command.client,
                sequence: command.sequence,
                ..BatchHeader::default()
            };
            match (command.is_control, command.command.decode()) {
                (1, Some(Command::Control(control))) => self.controls.push((header, vec![control])),
                _ => self.batches.push(Batch { header, commands: vec![command.command] }),
            }
        }
        dropped
    }
}

/// Whether the last bundle of these commands has more sensors than follow it.
fn awaits_sensors(commands: &[RawCommand]) -> bool {
    let mut sensors = 0;
    for command in commands.iter().rev() {
        match command.decode() {
            Some(Command::Sensor(_)) => sensors += 1,
            Some(Command::CreateBundle(bundle)) => {
                return sensors < (bundle.sensor_count as usize).min(SENSORS_MAX);
            }
            _ => return false,
        }
    }
    false
}

fn push(requests: &mut Vec<Request>, header: &BatchHeader, commands: &[RawCommand]) {
    for (index, command) in commands.iter().enumerate() {
        requests.push(Request {
            client: header.client,
            sequence: header.sequence + index as u64,
            command: *command,
        });
    }
}

/// The journal of the frame in progress, and the parts that stages have no room for yet.
#[derive(Default)]
pub(crate) struct JournalWriter {
    entries: Vec<JournalEntry>,
    /// Number of entries whose outcomes clients have.
    announced: usize,
    /// Serial of the next part with outcomes for clients.
    outcome_serial: u64,
    /// Serial of the next part for stages.
    serial: u64,
    /// Parts for stages that are not sent yet.
    backlog: VecDeque<(JournalHeader, Vec<JournalEntry>)>,
}

impl JournalWriter {
    /// Adds an entry.
    pub(crate) fn write(&mut self, entry: JournalEntry) {
        self.entries.push(entry);
    }

    /// Sends the new entries of `stamp`'s frame to clients.
    pub(crate) fn announce(&mut self, ports: &HostPorts, stamp: Stamp) -> Result<(), BusError> {
        while self.announced < self.entries.len() {
            let part = &self.entries[self.announced..];
            let part = &part[..part.len().min(JOURNAL_PART_MAX)];
            let first = self.announced as u32;
            let header = JournalHeader { stamp, serial: self.outcome_serial, first, keyframe: 0 };
            ports.outcome.send(header, part)?;
            self.outcome_serial += 1;
            self.announced += part.len();
        }
        Ok(())
    }

    /// Puts a keyframe for late participants into the backlog, and the journals after it.
    pub(crate) fn push_keyframe(
        &mut self,
        (at, standing): &(Frame, Vec<JournalEntry>),
        after: &[(Frame, Vec<JournalEntry>)],
    ) {
        let parts = |entries: &[JournalEntry]| entries.len().div_ceil(JOURNAL_PART_MAX);
        let follow: usize = after.iter().map(|(_, entries)| parts(entries)).sum();
        let total = parts(standing).max(1) + follow;
        let stamp = |frame| Stamp { frame, ..Stamp::default() };
        if standing.is_empty() {
            self.push_part(stamp(*at), 0, total as u32, Vec::new());
        }
        for (index, part) in standing.chunks(JOURNAL_PART_MAX).enumerate() {
            let first = (index * JOURNAL_PART_MAX) as u32;
            self.push_part(stamp(*at), first, (total - index) as u32, part.to_vec());
        }
        for (frame, entries) in after {
            self.push_frame(stamp(*frame), entries);
        }
    }

    /// Completes the frame: puts its journal into the backlog and returns it.
    pub(crate) fn take_frame(&mut self, stamp: Stamp) -> Vec<JournalEntry> {
        self.announced = 0;
        let entries = std::mem::take(&mut self.entries);
        self.push_frame(stamp, &entries);
        entries
    }

    fn push_frame(&mut self, stamp: Stamp, entries: &[JournalEntry]) {
        for (index, part) in entries.chunks(JOURNAL_PART_MAX).enumerate() {
            self.push_part(stamp, (index * JOURNAL_PART_MAX) as u32, 0, part.to_vec());
        }
    }

    fn push_part(&mut self, stamp: Stamp, first: u32, keyframe: u32, entries: Vec<JournalEntry>) {
        let header = JournalHeader { stamp, serial: self.serial, first, keyframe };
        self.serial += 1;
        self.backlog.push_back((header, entries));
    }

    /// Sends parts of the backlog, at most `room`. Returns whether it sent one.
    pub(crate) fn send_backlog(&mut self, ports: &HostPorts, room: u64) -> Result<bool, BusError> {
        let mut sent = 0;
        while sent < room
            && let Some((header, entries)) = self.backlog.front()
        {
            ports.journal.send(*header, entries)?;
            self.backlog.pop_front();
            sent += 1;
        }
        Ok(sent > 0)
    }

    /// Whether stages have been sent everything.
    pub(crate) fn is_sent(&self) -> bool {
        self.backlog.is_empty()
    }

    /// Returns the serial of the next part to be sent to stages.
    pub(crate) fn sent(&self) -> u64 {
        self.serial - self.backlog.len() as u64
    }

    /// Returns the serial after the last part in the backlog.
    pub(crate) fn serial(&self) -> u64 {
        self.serial
    }

    /// Returns the number of parts that stages have not been sent.
    pub(crate) fn backlog(&self) -> usize {
        self.backlog.len()
    }

    /// Returns the serial of the next part of outcomes.
    pub(crate) fn outcome_serial(&self) -> u64 {
        self.outcome_serial
    }

    /// Returns the number of entries of the frame.
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{ActorId, CreateBundle, SensorSpec};

    /// Batches as `client:sequence`, with `!` behind those to be applied now.
    fn inbox(batches: &[&str]) -> Inbox {
        let batch = |text: &&str| {
            let (client, sequence) = text.trim_end_matches('!').split_once(':').unwrap();
            let header = BatchHeader {
                client: Name::new(client),
                sequence: sequence.parse().unwrap(),
                now: text.ends_with('!').into(),
                ..BatchHeader::default()
            };
            Batch { header, commands: vec![Command::Destroy(ActorId(1)).into()] }
        };
        Inbox { batches: batches.iter().map(batch).collect(), ..Inbox::default() }
    }

    fn names(requests: &[Request]) -> Vec<String> {
        requests.iter().map(|r| format!("{}:{}", r.client, r.sequence)).collect()
    }

    #[test]
    fn clients_take_turns_and_each_keeps_its_order() {
        let flood: Vec<String> = (0..40).rev().map(|n| format!("flood:{n}!")).collect();
        let mut batches: Vec<&str> = flood.iter().map(String::as_str).collect();
        batches.push("quiet:7!");
        let mut inbox = inbox(&batches);
        let wanted: Vec<String> = (0..8).map(|n| format!("flood:{n}")).collect();
        let first = names(&inbox.take_urgent(None, [0, 16]));
        assert_eq!(first, [&wanted[..], &["quiet:7".to_owned()]].concat());
        assert!(inbox.has_urgent(|_| true));
        assert_eq!(names(&inbox.take_urgent(None, [0, 16])).first().unwrap(), "flood:8");
        assert_eq!(names(&inbox.take_urgent(None, [0, 16])).len(), 16);
        assert!(!inbox.has_urgent(|_| true));
    }

    #[test]
    fn the_ticking_client_s_commands_do_not_wait_behind_those_of_others() {
        let mut inbox = inbox(&["flood:0!", "flood:1!", "ticker:0!", "ticker:1!"]);
        let ticking = Some(Name::new("ticker"));
        assert_eq!(names(&inbox.take_urgent(ticking, [16, 0])), ["ticker:0", "ticker:1"]);
        assert!(!inbox.has_urgent(|client| Some(client) == ticking));
        assert_eq!(names(&inbox.take_urgent(ticking, [16, 1])), ["flood:0"]);
    }

    #[test]
    fn a_frame_has_every_command_of_its_ticking_client() {
        let own: Vec<String> = (0..40).map(|n| format!("ticker:{n}")).collect();
        let flood: Vec<String> = (0..40).map(|n| format!("flood:{n}!")).collect();
        let batches: Vec<&str> = own.iter().chain(&flood).map(String::as_str).collect();
        let mut inbox = inbox(&batches);
        let ticking = Some(Name::new("ticker"));
        assert_eq!(inbox.take(ticking, 0).len(), 40);
        assert_eq!(names(&inbox.take(ticking, 16)), flood_names(0..16));
        assert_eq!(names(&inbox.take(ticking, 16)), flood_names(16..32));
    }

    /// A batch of client `owner` with a bundle of `announced` sensors, if any, and `sensors`.
    fn part(sequence: u64, announced: Option<u32>, sensors: usize) -> Batch {
        let bundle = announced.map(|sensor_count| {
            Command::CreateBundle(CreateBundle { sensor_count, ..CreateBundle::default() })
        });
        let sensors = std::iter::repeat_n(Command::Sensor(SensorSpec::default()), sensors);
        let commands = bundle.into_iter().chain(sensors).map(RawCommand::from).collect();
        let header =
            BatchHeader { client: Name::new("owner"), sequence, now: 1, ..BatchHeader::default() };
        Batch { header, commands }
    }

    #[test]
    fn a_bundle_waits_for_all_of_its_sensors() {
        let mut inbox = Inbox::default();
        inbox.add(part(0, Some(300), 127));
        assert!(!inbox.has_urgent(|_| true));
        inbox.add(part(128, None, 128));
        assert!(inbox.take_urgent(None, [0, 1]).is_empty());
        inbox.add(part(256, None, 45));
        assert_eq!(inbox.take_urgent(None, [0, 1]).len(), 301);
        // One that announces more than it sends is applied, and refused.
        inbox.add(part(400, Some(300), 20));
        assert_eq!(inbox.take_urgent(None, [0, 1]).len(), 21);
        // A client of the same name continues nothing of one that is gone.
        inbox.add(part(500, Some(300), 127));
        inbox.add(part(0, Some(1), 1));
        assert_eq!(inbox.take_urgent(None, [0, 2]).len(), 130);
    }

    fn flood_names(range: std::ops::Range<u64>) -> Vec<String> {
        range.map(|n| format!("flood:{n}")).collect()
    }
}
