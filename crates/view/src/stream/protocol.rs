//! The messages of the protocol.
//!
//! Source: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>. The two subprotocols
//! have the same form of all messages that are used here.

use serde::Deserialize;
use serde_json::{Value, json};

/// The subprotocols that are spoken: of Foxglove's SDK, and the older one of Lichtblick.
pub(crate) const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// What a client requests.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(crate) enum Request {
    Subscribe { subscriptions: Vec<Subscription> },
    Unsubscribe { subscription_ids: Vec<u32> },
}

/// A subscription, under a number that the client has chosen.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Subscription {
    pub(crate) id: u32,
    pub(crate) channel_id: u32,
}

/// How serious a status is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Warning = 1,
    Error = 2,
}

/// Returns a status; one with an id takes the place of the one before of that id.
pub(crate) fn status(level: Level, message: &str, id: Option<&str>) -> Value {
    let mut status = json!({ "op": "status", "level": level as u8, "message": message });
    if let Some(id) = id {
        status["id"] = id.into();
    }
    status
}

/// Returns the message that removes a status.
pub(crate) fn status_removal(id: &str) -> Value {
    json!({ "op": "removeStatus", "statusIds": [id] })
}

/// Returns the first message to a client.
pub(crate) fn server_info(name: &str, session: &str) -> Value {
    json!({
        "op": "serverInfo",
        "name": name,
        "capabilities": ["time"],
        "metadata": { "omnibus_version": env!("CARGO_PKG_VERSION") },
        "sessionId": session,
    })
}

/// Returns a message of a channel, at a simulated time.
pub(crate) fn message_data(subscription: u32, time_nanos: u64, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(13 + data.len());
    bytes.push(1);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(time_nanos.to_le_bytes());
    bytes.extend(data);
    bytes
}

/// Returns the server's clock.
pub(crate) fn time(time_nanos: u64) -> Vec<u8> {
    let mut bytes = vec![2];
    bytes.extend(time_nanos.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_and_wrong_ones_name_their_fault() {
        let text = r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":3}]}"#;
        let request =
            Request::Subscribe { subscriptions: vec![Subscription { id: 7, channel_id: 3 }] };
        assert_eq!(serde_json::from_str::<Request>(text).unwrap(), request);
        let text = r#"{"op":"unsubscribe","subscriptionIds":[7]}"#;
        let request = Request::Unsubscribe { subscription_ids: vec![7] };
        assert_eq!(serde_json::from_str::<Request>(text).unwrap(), request);
        for (text, fault) in [
            ("{", "EOF"),
            (r#"{"op":"fly"}"#, "unknown variant `fly`"),
            (r#"{"op":"subscribe"}"#, "missing field `subscriptions`"),
            (r#"{"op":"unsubscribe","subscriptionIds":[-1]}"#, "invalid value"),
        ] {
            let why = serde_json::from_str::<Request>(text).unwrap_err().to_string();
            assert!(why.contains(fault), "{why}");
        }
    }

    #[test]
    fn binary_messages_have_the_layout_of_the_specification() {
        let bytes = message_data(0x0403_0201, 0x0c0b_0a09_0807_0605, b"xy");
        assert_eq!(bytes, [1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, b'x', b'y']);
        assert_eq!(time(1), [2, 1, 0, 0, 0, 0, 0, 0, 0]);
    }
}
