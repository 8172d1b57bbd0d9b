//! Reading the journal without gaps: parts in, complete frames out.

use std::collections::VecDeque;

use crate::{BusError, Reader};
use protocol::{Frame, JournalEntry, JournalHeader};

/// The reading end of the journal channel.
pub struct Journal {
    reader: Reader<JournalHeader, JournalEntry>,
    inbox: Inbox,
}

impl Journal {
    pub(crate) fn new(reader: Reader<JournalHeader, JournalEntry>) -> Journal {
        Journal { reader, inbox: Inbox::default() }
    }

    /// Receives the parts that have arrived. Returns true if a part was lost and a keyframe is needed.
    pub fn poll(&mut self) -> Result<bool, BusError> {
        while let Some(part) = self.reader.receive()? {
            self.inbox.take_in(part.header(), part.payload());
        }
        Ok(self.inbox.is_lost())
    }

    /// Returns the entries up to and including `frame` that were not returned yet. After a reset the
    /// standing state comes first.
    pub fn until(&mut self, frame: Frame) -> Vec<Event> {
        self.inbox.until(frame)
    }

    /// Discards everything received so far, including losses, for a reader of new entries only.
    pub fn begin_here(&mut self) -> Result<(), BusError> {
        while self.reader.receive()?.is_some() {}
        self.inbox = Inbox::default();
        Ok(())
    }

    /// Ignores everything before the next keyframe, for a reader that needs the standing state.
    pub fn await_keyframe(&mut self) {
        self.inbox.lost = true;
    }
}

/// An event of the journal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "the large one is the usual one")]
pub enum Event {
    /// The standing state follows; earlier entries are void.
    Reset,
    /// A command and its outcome, and the first frame that shows its effect.
    Entry(Frame, JournalEntry),
}

#[derive(Default)]
struct Inbox {
    /// The next expected serial; `None` before the first part.
    next: Option<u64>,
    /// A part was lost; parts are ignored until a keyframe arrives.
    lost: bool,
    /// The serial after the last part that belongs to the keyframe.
    whole_at: u64,
    /// Everything up to here is in `events` or was returned.
    known: (Frame, u32),
    events: VecDeque<(Frame, Event)>,
}

impl Inbox {
    fn is_lost(&self) -> bool {
        self.lost || self.next.is_some_and(|next| next < self.whole_at)
    }

    fn take_in(&mut self, header: &JournalHeader, entries: &[JournalEntry]) {
        if self.next.is_some_and(|next| header.serial > next) {
            self.lost = true;
        }
        self.next = Some(header.serial + 1);
        let frame = header.stamp.frame;
        if header.keyframe != 0 {
            if self.lost {
                self.lost = false;
                self.whole_at = header.serial + u64::from(header.keyframe);
                self.events.clear();
                self.events.push_back((frame, Event::Reset));
                self.known = (frame, u32::MAX);
                self.push(frame, entries);
            }
            return;
        }
        // Parts that are repeated for a new reader are known to the others.
        let last = header.first + entries.len() as u32;
        if self.lost || (frame, last) <= self.known {
            return;
        }
        self.known = (frame, last);
        self.push(frame, entries);
    }

    fn push(&mut self, frame: Frame, entries: &[JournalEntry]) {
        self.events.extend(entries.iter().map(|e| (frame, Event::Entry(frame, *e))));
    }

    fn until(&mut self, frame: Frame) -> Vec<Event> {
        let count = self.events.partition_point(|(f, _)| *f <= frame);
        self.events.drain(..count).map(|(_, event)| event).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{ActorId, Command, Name, Outcome, Stamp};

    /// Feeds `serial:frame.first+count` and `serial:Kframe+count&follow` parts and compares what is
    /// returned up to frame 9, written as `reset`, a frame number, or `lost`.
    fn check(script: &str, outcome: &str) {
        let entry = JournalEntry {
            client: Name::new("tester"),
            sequence: 0,
            command: Command::Destroy(ActorId(1)).into(),
            outcome: Outcome::done(1),
        };
        let mut inbox = Inbox::default();
        for word in script.split_whitespace() {
            let (serial, rest) = word.split_once(':').unwrap();
            let (at, count) = rest.split_once('+').unwrap();
            let keyframe = at.starts_with('K');
            // `+2&1`: two entries, and one more part belongs to the keyframe.
            let (count, follow) = count.split_once('&').unwrap_or((count, "0"));
            let follow: u32 = follow.parse().unwrap();
            let (frame, first) = at
                .trim_start_matches('K')
                .split_once('.')
                .unwrap_or((at.trim_start_matches('K'), "0"));
            let header = JournalHeader {
                stamp: Stamp { frame: Frame(frame.parse().unwrap()), ..Stamp::default() },
                serial: serial.parse().unwrap(),
                first: first.parse().unwrap(),
                keyframe: if keyframe { follow + 1 } else { 0 },
            };
            inbox.take_in(&header, &vec![entry; count.parse().unwrap()]);
        }
        let mut said: Vec<String> = inbox
            .until(Frame(9))
            .into_iter()
            .map(|e| match e {
                Event::Reset => "reset".to_owned(),
                Event::Entry(frame, _) => frame.0.to_string(),
            })
            .collect();
        if inbox.is_lost() {
            said.push("lost".to_owned());
        }
        assert_eq!(said.join(" "), outcome, "{script}");
    }

    #[test]
    fn parts_come_out_in_order_and_once() {
        check("0:1+2 1:2+1", "1 1 2");
        check("0:1.0+1 1:1.1+1", "1 1");
        check("5:3+1 6:3+1", "3");
    }

    #[test]
    fn after_a_gap_parts_are_ignored_until_a_keyframe() {
        check("0:1+1 2:3+1", "1 lost");
        check("0:1+1 2:3+1 3:K3+2 4:4+1", "reset 3 3 4");
        check("0:1+1 2:3+1 3:K2+1&1", "reset 2 lost");
        check("0:1+1 2:3+1 3:K2+1&1 4:3+1", "reset 2 3");
    }

    #[test]
    fn a_reader_without_a_gap_ignores_keyframes_and_repeated_parts() {
        check("0:1+1 1:2+1 2:K1+1 3:2+1 4:3+1", "1 2 3");
    }
}
