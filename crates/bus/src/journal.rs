//! Reading the journal: stages receive every part of it, clients the outcomes that they poll in time.

use std::collections::VecDeque;

use crate::{BusError, Reader};
use protocol::{Frame, JournalEntry, JournalHeader};

/// A client's reading end of the outcomes.
pub struct Outcomes {
    reader: Reader<JournalHeader, JournalEntry>,
    /// The next expected serial; `None` before the first part.
    next: Option<u64>,
}

impl Outcomes {
    pub(crate) fn new(reader: Reader<JournalHeader, JournalEntry>) -> Outcomes {
        Outcomes { reader, next: None }
    }

    /// Hands over the entries that have arrived, each with the first frame that shows its effect.
    /// Returns true if entries before them were overwritten unread.
    pub fn receive(
        &mut self,
        mut take: impl FnMut(Frame, &JournalEntry),
    ) -> Result<bool, BusError> {
        let mut is_lost = false;
        while let Some(part) = self.reader.receive()? {
            let header = part.header();
            is_lost |= self.next.is_some_and(|next| header.serial > next);
            self.next = Some(header.serial + 1);
            part.payload().iter().for_each(|entry| take(header.stamp.frame, entry));
        }
        Ok(is_lost)
    }

    /// Discards everything that has arrived, including losses. At least `sent` parts had been sent
    /// before.
    pub fn begin_here(&mut self, sent: u64) -> Result<(), BusError> {
        let mut next = sent.max(self.next());
        while let Some(part) = self.reader.receive()? {
            next = next.max(part.header().serial + 1);
        }
        self.next = Some(next);
        Ok(())
    }

    /// The serial after the last part that has arrived.
    pub fn next(&self) -> u64 {
        self.next.unwrap_or(0)
    }
}

/// A stage's reading end of the journal.
pub struct Journal {
    reader: Reader<JournalHeader, JournalEntry>,
    inbox: Inbox,
}

impl Journal {
    /// What arrives before the first keyframe is ignored.
    pub(crate) fn new(reader: Reader<JournalHeader, JournalEntry>) -> Journal {
        Journal { reader, inbox: Inbox::default() }
    }

    /// Before the keyframe: it begins at the part `serial`. Earlier ones are for other readers.
    pub(crate) fn begin_at(&mut self, serial: u64) {
        self.inbox.begin_at(serial);
    }

    /// Receives the parts that have arrived, and returns the serial after the last of them.
    pub(crate) fn receive(&mut self) -> Result<u64, BusError> {
        while let Some(part) = self.reader.receive()? {
            self.inbox.take_in(part.header(), part.payload())?;
        }
        Ok(self.inbox.next)
    }

    /// Whether the journal is whole up to the part before `serial`.
    pub(crate) fn is_whole(&self, serial: u64) -> bool {
        self.inbox.is_whole(serial)
    }

    /// Returns the entries up to and including `frame` that were not returned yet. The standing state
    /// of the keyframe comes first.
    pub fn until(&mut self, frame: Frame) -> Vec<Event> {
        self.inbox.until(frame)
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
    /// The next expected serial.
    next: u64,
    /// The keyframe has begun; parts are ignored before it.
    has_keyframe: bool,
    /// The serial after the last part that belongs to the keyframe.
    whole_at: u64,
    /// Everything up to here is in `events` or was returned.
    known: (Frame, u32),
    events: VecDeque<(Frame, Event)>,
}

impl Inbox {
    fn begin_at(&mut self, serial: u64) {
        if !self.has_keyframe {
            self.next = self.next.max(serial);
        }
    }

    fn is_whole(&self, serial: u64) -> bool {
        self.has_keyframe && self.next >= self.whole_at.max(serial)
    }

    fn take_in(
        &mut self,
        header: &JournalHeader,
        entries: &[JournalEntry],
    ) -> Result<(), BusError> {
        if !self.has_keyframe && header.serial < self.next {
            return Ok(());
        }
        if self.has_keyframe && header.serial != self.next {
            return Err(BusError::JournalGap { expected: self.next, received: header.serial });
        }
        self.next = header.serial + 1;
        let frame = header.stamp.frame;
        if header.keyframe != 0 {
            if !self.has_keyframe && header.first == 0 {
                self.has_keyframe = true;
                self.whole_at = header.serial + u64::from(header.keyframe);
                self.events.push_back((frame, Event::Reset));
                self.known = (frame, u32::MAX);
            }
            // A later keyframe is for another reader.
            if header.serial < self.whole_at {
                self.push(frame, entries);
            }
            return Ok(());
        }
        // Parts that are repeated for a new reader are known to the others.
        let last = header.first + entries.len() as u32;
        if self.has_keyframe && (frame, last) > self.known {
            self.known = (frame, last);
            self.push(frame, entries);
        }
        Ok(())
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

    /// Feeds parts, `serial:frame.first+count`, and compares what is returned up to frame 9, written
    /// as `reset`, a frame number for each entry, `incomplete`, or `gap`. `K` before the frame marks
    /// a part of a keyframe, and `&n` says that n more parts belong to it.
    fn check(script: &str, outcome: &str) {
        let entry = JournalEntry {
            client: Name::new("tester"),
            sequence: 0,
            command: Command::Destroy(ActorId(1)).into(),
            outcome: Outcome::done(1),
        };
        let mut inbox = Inbox::default();
        let mut said = Vec::new();
        for word in script.split_whitespace() {
            let (serial, rest) = word.split_once(':').unwrap();
            let (at, count) = rest.split_once('+').unwrap();
            let (count, follow) = count.split_once('&').unwrap_or((count, "0"));
            let follow: u32 = follow.parse().unwrap();
            let (frame, first) = at.split_once('.').unwrap_or((at, "0"));
            let keyframe = frame.strip_prefix('K');
            let frame = keyframe.unwrap_or(frame);
            let header = JournalHeader {
                stamp: Stamp { frame: Frame(frame.parse().unwrap()), ..Stamp::default() },
                serial: serial.parse().unwrap(),
                first: first.parse().unwrap(),
                keyframe: if keyframe.is_some() { follow + 1 } else { 0 },
            };
            if inbox.take_in(&header, &vec![entry; count.parse().unwrap()]).is_err() {
                said.push("gap".to_owned());
                break;
            }
        }
        said.extend(inbox.until(Frame(9)).into_iter().map(|e| match e {
            Event::Reset => "reset".to_owned(),
            Event::Entry(frame, _) => frame.0.to_string(),
        }));
        if !inbox.is_whole(0) {
            said.push("incomplete".to_owned());
        }
        assert_eq!(said.join(" "), outcome, "{script}");
    }

    #[test]
    fn everything_before_the_keyframe_is_ignored() {
        check("0:1+2 1:2+1", "incomplete");
        check("3:1+2 9:K2+1 10:3+2", "reset 2 3 3");
    }

    #[test]
    fn parts_come_out_in_order_and_once() {
        check("0:K0+0 1:1+2 2:2+1", "reset 1 1 2");
        check("0:K0+0 1:1.0+1 2:1.1+1", "reset 1 1");
        check("5:K0+0 6:3+1 7:3+1", "reset 3");
    }

    #[test]
    fn a_keyframe_of_several_parts_is_whole_with_its_last() {
        check("0:K2+1&1", "reset 2 incomplete");
        check("0:K2+1&1 1:3+1", "reset 2 3");
        check("0:K2.0+2&2 1:K2.2+1&1", "reset 2 2 2 incomplete");
        check("0:K2.0+2&2 1:K2.2+1&1 2:3+1 3:4+1", "reset 2 2 2 3 4");
    }

    #[test]
    fn the_keyframe_of_another_reader_and_its_parts_are_ignored() {
        check("0:K0+0 1:1+1 2:2+1 3:K1+1&1 4:2+1 5:3+1", "reset 1 2 3");
        check("0:K0+0 1:2+1 2:K2.0+2&1 3:K2.2+2 4:3+1", "reset 2 3");
    }

    #[test]
    fn a_keyframe_before_the_own_one_is_ignored() {
        let keyframe = |serial, frame| JournalHeader {
            stamp: Stamp { frame: Frame(frame), ..Stamp::default() },
            serial,
            first: 0,
            keyframe: 1,
        };
        let mut inbox = Inbox::default();
        inbox.begin_at(4);
        // That of a stage that is further on, which started at the same time.
        inbox.take_in(&keyframe(3, 9), &[]).unwrap();
        assert!(!inbox.is_whole(0));
        inbox.take_in(&keyframe(4, 7), &[]).unwrap();
        assert!(inbox.is_whole(5));
        assert_eq!(inbox.until(Frame(7)), [Event::Reset]);
    }

    #[test]
    fn a_lost_part_is_an_error() {
        check("0:K0+0 1:1+1 3:3+1", "gap reset 1");
    }
}
