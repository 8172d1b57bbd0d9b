//! The channels that a client has subscribed to.

use client_lib::Frame;

use crate::stream::{protocol::Subscription, topics::Topic};

/// The subscriptions of a client.
#[derive(Debug, Default)]
pub(crate) struct Subscriptions(Vec<Subscribed>);

/// A subscription, and what was sent of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Subscribed {
    /// The number that the client has chosen.
    pub(crate) id: u32,
    pub(crate) topic: Topic,
    /// The frame that was sent last.
    sent: Option<Frame>,
}

impl Subscriptions {
    /// Adds subscriptions; returns the first fault of those that were not added.
    pub(crate) fn add(&mut self, requested: &[Subscription]) -> Option<String> {
        first(requested.iter().map(|requested| self.add_one(*requested)))
    }

    fn add_one(&mut self, Subscription { id, channel_id }: Subscription) -> Result<(), String> {
        let Some(topic) = Topic::of(channel_id) else {
            return Err(format!(
                "unknown channel {channel_id}; subscribe to one that is advertised"
            ));
        };
        if self.0.iter().any(|subscribed| subscribed.id == id) {
            return Err(format!("subscription {id} exists already; use another id"));
        }
        if self.of(topic).is_some() {
            return Err(format!(
                "channel {channel_id} has a subscription already; unsubscribe first"
            ));
        }
        self.0.push(Subscribed { id, topic, sent: None });
        Ok(())
    }

    /// Removes subscriptions, and returns the topics of those that were and the first fault.
    pub(crate) fn remove(&mut self, ids: &[u32]) -> (Vec<Topic>, Option<String>) {
        let mut removed = Vec::new();
        let fault = first(ids.iter().map(|id| {
            let place = self.0.iter().position(|subscribed| subscribed.id == *id);
            let place = place.ok_or_else(|| format!("unknown subscription {id}"))?;
            removed.push(self.0.swap_remove(place).topic);
            Ok(())
        }));
        (removed, fault)
    }

    /// Returns the subscription to a topic.
    pub(crate) fn of(&self, topic: Topic) -> Option<Subscribed> {
        self.0.iter().find(|subscribed| subscribed.topic == topic).copied()
    }

    /// Returns the subscription to a topic if nothing of this frame or a later one was sent, and notes
    /// that it is sent.
    pub(crate) fn due(&mut self, topic: Topic, frame: Frame) -> Option<u32> {
        let subscribed = self.0.iter_mut().find(|subscribed| subscribed.topic == topic)?;
        if subscribed.sent >= Some(frame) {
            return None;
        }
        subscribed.sent = Some(frame);
        Some(subscribed.id)
    }

    /// Notes that nothing was sent.
    pub(crate) fn renew(&mut self) {
        self.0.iter_mut().for_each(|subscribed| subscribed.sent = None);
    }
}

/// Returns the first fault, and how many follow.
fn first(results: impl Iterator<Item = Result<(), String>>) -> Option<String> {
    let faults: Vec<String> = results.filter_map(Result::err).collect();
    match &faults[..] {
        [] => None,
        [fault] => Some(fault.clone()),
        [fault, rest @ ..] => Some(format!("{fault}; and {} more faults", rest.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subscription(id: u32, channel_id: u32) -> Subscription {
        Subscription { id, channel_id }
    }

    #[test]
    fn wrong_subscriptions_have_one_fault_and_the_others_are_added() {
        let mut subscriptions = Subscriptions::default();
        let requested = [subscription(5, 99), subscription(6, 1), subscription(6, 2)];
        let fault = subscriptions.add(&requested).unwrap();
        assert_eq!(
            fault,
            "unknown channel 99; subscribe to one that is advertised; and 1 more faults"
        );
        assert_eq!(subscriptions.of(Topic::Transforms).map(|subscribed| subscribed.id), Some(6));
        assert!(subscriptions.add(&[subscription(7, 1)]).unwrap().contains("channel 1 has"));
        assert_eq!(subscriptions.remove(&[6]), (vec![Topic::Transforms], None));
        let (removed, fault) = subscriptions.remove(&[6]);
        assert_eq!((removed, fault.as_deref()), (vec![], Some("unknown subscription 6")));
    }

    #[test]
    fn a_frame_is_due_once_until_the_world_is_another() {
        let mut subscriptions = Subscriptions::default();
        assert_eq!(subscriptions.add(&[subscription(6, 1)]), None);
        let mut due = |frame| subscriptions.due(Topic::Transforms, Frame(frame));
        assert_eq!([due(0), due(0), due(2), due(1)], [Some(6), None, Some(6), None]);
        assert_eq!(subscriptions.due(Topic::Map, Frame(9)), None);
        subscriptions.renew();
        assert_eq!(subscriptions.due(Topic::Transforms, Frame(1)), Some(6));
    }
}
