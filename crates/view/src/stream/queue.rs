//! Messages on their way to one client of the protocol, which acknowledges nothing: what bounds memory.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use axum::extract::ws::Message;
use serde_json::Value;
use tokio::sync::Notify;

/// Messages of one channel that wait: of more the oldest are dropped.
const CHANNEL_MAX: usize = 4;
/// Texts that wait: a client that causes more and reads none of them is not served any longer.
const TEXTS_MAX: usize = 64;
/// A client that has taken nothing for so long is stalled.
const STALLED_AFTER: Duration = Duration::from_secs(2);
/// The channel of the server's clock.
const CLOCK: u32 = 0;

/// Messages on their way to a client. The thread that fills it never waits.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    waiting: Mutex<Waiting>,
    added: Notify,
}

#[derive(Debug, Default)]
struct Waiting {
    texts: VecDeque<Message>,
    /// Channels and messages.
    data: VecDeque<(u32, Message)>,
    dropped: u64,
    /// Since when something waits and nothing was taken.
    since: Option<Instant>,
    is_closed: bool,
}

impl Queue {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends a text, which is never dropped.
    pub(crate) fn text(&self, text: &Value) {
        let mut waiting = self.waiting();
        waiting.texts.push_back(Message::text(text.to_string()));
        waiting.is_closed |= waiting.texts.len() > TEXTS_MAX;
        waiting.since.get_or_insert_with(Instant::now);
        self.added.notify_one();
    }

    /// Sets the server's clock; one that waits is replaced.
    pub(crate) fn clock(&self, message: Vec<u8>) {
        self.waiting().data.retain(|(of, _)| *of != CLOCK);
        self.data(CLOCK, message);
    }

    /// Appends a message of a channel, and drops its oldest one if too many wait.
    pub(crate) fn data(&self, channel: u32, message: Vec<u8>) {
        let mut waiting = self.waiting();
        let waiting = &mut *waiting;
        if waiting.data.iter().filter(|(of, _)| *of == channel).count() >= CHANNEL_MAX
            && let Some(oldest) = waiting.data.iter().position(|(of, _)| *of == channel)
        {
            waiting.data.remove(oldest);
            waiting.dropped += 1;
        }
        waiting.data.push_back((channel, Message::binary(message)));
        waiting.since.get_or_insert_with(Instant::now);
        self.added.notify_one();
    }

    /// Removes what waits of a channel.
    pub(crate) fn clear(&self, channel: u32) {
        self.waiting().data.retain(|(of, _)| *of != channel);
    }

    /// How many messages were dropped.
    pub(crate) fn dropped(&self) -> u64 {
        self.waiting().dropped
    }

    /// Whether the client has taken nothing for two seconds.
    pub(crate) fn is_stalled(&self) -> bool {
        self.waiting().since.is_some_and(|since| since.elapsed() >= STALLED_AFTER)
    }

    /// Ends the queue when what waits was taken.
    pub(crate) fn close(&self) {
        self.waiting().is_closed = true;
        self.added.notify_one();
    }

    /// Whether nothing more is sent.
    pub(crate) fn is_closed(&self) -> bool {
        self.waiting().is_closed
    }

    /// Takes the next message, texts first, and waits for one; `None` at the end.
    pub(crate) async fn next(&self) -> Option<Message> {
        loop {
            {
                let mut waiting = self.waiting();
                let text = waiting.texts.pop_front();
                let next = text.or_else(|| waiting.data.pop_front().map(|(_, message)| message));
                let is_empty = waiting.texts.is_empty() && waiting.data.is_empty();
                waiting.since = (!is_empty).then(Instant::now);
                if next.is_some() || waiting.is_closed {
                    return next;
                }
            }
            self.added.notified().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn taken(queue: &Queue) -> Vec<Vec<u8>> {
        queue.close();
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let next = || runtime.block_on(queue.next()).map(|message| message.into_data().to_vec());
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn of_a_channel_that_is_not_read_the_newest_messages_are_kept() {
        let queue = Queue::default();
        queue.data(7, vec![70]);
        for number in 0..100 {
            queue.data(3, vec![number]);
            queue.clock(vec![200 + number % 10]);
        }
        assert_eq!(queue.dropped(), 96);
        queue.text(&json!(1));
        let expected = [b"1".to_vec(), vec![70], vec![96], vec![97], vec![98], vec![99], vec![209]];
        assert_eq!(taken(&queue), expected);
    }

    #[test]
    fn what_waits_of_a_channel_is_removed_with_its_subscription() {
        let queue = Queue::default();
        queue.data(3, vec![1]);
        queue.data(4, vec![2]);
        queue.clear(3);
        assert_eq!((taken(&queue), queue.dropped()), (vec![vec![2]], 0));
    }

    #[test]
    fn a_client_that_reads_no_replies_is_not_served() {
        let queue = Queue::default();
        for number in 0..TEXTS_MAX {
            queue.text(&json!(number));
        }
        assert!(!queue.is_closed());
        queue.text(&json!("one more"));
        assert!(queue.is_closed());
    }
}
