//! Messages on their way to one page.

use axum::extract::ws::Message;
use serde::Serialize;
use tokio::sync::mpsc::Sender;

/// Messages on their way to the page. It has room for all that the flows allow and for the replies to
/// the requests that were not read; a page that lets it fill up is not served any longer.
pub(crate) struct Outbox {
    messages: Sender<Message>,
    is_full: bool,
}

impl Outbox {
    pub(crate) fn new(messages: Sender<Message>) -> Outbox {
        Outbox { messages, is_full: false }
    }

    /// Whether a message was lost.
    pub(crate) fn is_full(&self) -> bool {
        self.is_full
    }

    pub(crate) fn send(&mut self, message: Message) -> bool {
        let is_sent = self.messages.try_send(message).is_ok();
        self.is_full |= !is_sent;
        is_sent
    }

    pub(crate) fn text(&mut self, message: &impl Serialize) -> bool {
        let text = serde_json::to_string(message).expect("no map with keys other than strings");
        self.send(Message::text(text))
    }
}
