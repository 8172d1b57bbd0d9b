//! How much of one channel a page has not acknowledged: what bounds memory and keeps images new.

use std::time::{Duration, Instant};

/// Messages of one channel that may be unacknowledged: one that the page draws, one on its way.
const UNREAD_MAX: u32 = 2;
/// The shortest time between two messages of a channel: 30 a second, with room for the phase.
const INTERVAL_MIN: Duration = Duration::from_millis(31);
/// A page that has acknowledged nothing for so long is stalled.
const STALLED_AFTER: Duration = Duration::from_secs(2);

/// The messages of one channel, towards one page.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Flow {
    unread: u32,
    sent: Option<Instant>,
    /// Since when something is unacknowledged and nothing was acknowledged.
    waits_since: Option<Instant>,
}

impl Flow {
    /// Whether the next message may be sent.
    pub(crate) fn is_open(&self, now: Instant) -> bool {
        let is_due = self.sent.is_none_or(|sent| now.duration_since(sent) >= INTERVAL_MIN);
        self.unread < UNREAD_MAX && is_due
    }

    /// Whether the page has not acknowledged anything for two seconds.
    pub(crate) fn is_stalled(&self, now: Instant) -> bool {
        self.waits_since.is_some_and(|since| now.duration_since(since) >= STALLED_AFTER)
    }

    /// Notes that a message was sent.
    pub(crate) fn send(&mut self, now: Instant) {
        self.unread += 1;
        self.sent = Some(now);
        self.waits_since.get_or_insert(now);
    }

    /// Notes that the page has acknowledged a message.
    pub(crate) fn acknowledge(&mut self, now: Instant) {
        self.unread = self.unread.saturating_sub(1);
        self.waits_since = (self.unread > 0).then_some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_messages_may_be_unread_and_a_page_that_reads_none_is_stalled() {
        let begin = Instant::now();
        let after = |millis| begin + Duration::from_millis(millis);
        let mut flow = Flow::default();
        assert!(flow.is_open(begin));
        flow.send(begin);
        assert!(!flow.is_open(after(10)), "more than 30 messages a second");
        assert!(flow.is_open(after(40)));
        flow.send(after(40));
        assert!(!flow.is_open(after(1000)), "two are unread");
        assert!(!flow.is_stalled(after(1999)) && flow.is_stalled(after(2000)));
        flow.acknowledge(after(2500));
        assert!(flow.is_open(after(2500)) && !flow.is_stalled(after(4499)));
        assert!(flow.is_stalled(after(4500)), "one is unread still");
        flow.acknowledge(after(5000));
        flow.acknowledge(after(5000));
        assert!(!flow.is_stalled(after(99_000)), "nothing is unread");
    }
}
