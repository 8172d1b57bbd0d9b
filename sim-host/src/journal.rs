//! The journal: commands arrive in a fixed order; entries with outcomes are published in parts.

use bus::{BusError, HostPorts};
use protocol::{
    BatchHeader, Command, Frame, JournalEntry, JournalHeader, RawCommand, Stamp, VehicleControl,
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
    controls: Vec<(BatchHeader, Vec<VehicleControl>)>,
}

impl Inbox {
    /// Receives all batches from the channels. Returns whether some are to be applied now.
    pub(crate) fn drain(&mut self, ports: &HostPorts) -> Result<bool, BusError> {
        while let Some(batch) = ports.command.receive()? {
            let header = *batch.header();
            self.batches.push(Batch { header, commands: batch.payload().to_vec() });
        }
        while let Some(batch) = ports.control.receive()? {
            self.controls.push((*batch.header(), batch.payload().to_vec()));
        }
        Ok(self.batches.iter().any(|b| b.header.now != 0))
    }

    /// Returns the requests of a frame: commands, then controls, each by (client, sequence).
    pub(crate) fn take(&mut self) -> Vec<Request> {
        self.batches.sort_by_key(|b| (b.header.client, b.header.sequence));
        self.controls.sort_by_key(|(header, _)| (header.client, header.sequence));
        let mut requests = Vec::new();
        for batch in self.batches.drain(..) {
            push(&mut requests, &batch.header, &batch.commands);
        }
        for (header, controls) in self.controls.drain(..) {
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

    /// Returns the requests to be applied between two frames: all of each client up to its last
    /// batch that asks for it, by client.
    pub(crate) fn take_urgent(&mut self) -> Vec<Request> {
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
        let dropped = self.take();
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

fn push(requests: &mut Vec<Request>, header: &BatchHeader, commands: &[RawCommand]) {
    for (index, command) in commands.iter().enumerate() {
        requests.push(Request {
            client: header.client,
            sequence: header.sequence + index as u64,
            command: *command,
        });
    }
}

/// The journal of the frame in progress.
#[derive(Default)]
pub(crate) struct JournalWriter {
    entries: Vec<JournalEntry>,
    /// Number of entries that are published.
    published: usize,
    serial: u64,
}

impl JournalWriter {
    /// Adds an entry.
    pub(crate) fn write(&mut self, entry: JournalEntry) {
        self.entries.push(entry);
    }

    /// Publishes the new entries as a part of the journal of `stamp`'s frame.
    pub(crate) fn publish(&mut self, ports: &HostPorts, stamp: Stamp) -> Result<(), BusError> {
        if self.published < self.entries.len() {
            let first = self.published as u32;
            let header = self.header(stamp, first, 0);
            ports.journal.send(header, &self.entries[self.published..])?;
            self.published = self.entries.len();
        }
        Ok(())
    }

    /// Publishes a keyframe for late participants; `follow` journals of later frames belong to it.
    pub(crate) fn publish_keyframe(
        &mut self,
        ports: &HostPorts,
        frame: Frame,
        entries: &[JournalEntry],
        follow: usize,
    ) -> Result<(), BusError> {
        let parts = 1 + follow as u32;
        ports.journal.send(self.header(Stamp { frame, ..Stamp::default() }, 0, parts), entries)
    }

    /// Publishes the journal of a past frame again, for late participants.
    pub(crate) fn publish_again(
        &mut self,
        ports: &HostPorts,
        frame: Frame,
        entries: &[JournalEntry],
    ) -> Result<(), BusError> {
        ports.journal.send(self.header(Stamp { frame, ..Stamp::default() }, 0, 0), entries)
    }

    fn header(&mut self, stamp: Stamp, first: u32, keyframe: u32) -> JournalHeader {
        let serial = self.serial;
        self.serial += 1;
        JournalHeader { stamp, serial, first, keyframe }
    }

    /// Returns the published entries of the coming frame.
    pub(crate) fn published(&self) -> &[JournalEntry] {
        &self.entries[..self.published]
    }

    /// Returns the number of entries of the frame.
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Completes the frame and returns its journal.
    pub(crate) fn take_frame(&mut self) -> Vec<JournalEntry> {
        self.published = 0;
        std::mem::take(&mut self.entries)
    }
}
