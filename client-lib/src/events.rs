//! Events in the world, and how snapshots are compared for them.

use std::collections::VecDeque;

use protocol::{ActorId, ActorState, Frame, Refusal, flag};

/// Something that happened in the world: see
/// [`Observer::follow_events`](crate::Observer::follow_events).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// An actor is in this snapshot and was not in the one that was taken in before.
    Spawned {
        /// The frame of the snapshot.
        frame: Frame,
        /// The actor.
        actor_id: ActorId,
    },
    /// An actor is no longer in the snapshot.
    Destroyed {
        /// The frame of the snapshot.
        frame: Frame,
        /// The actor.
        actor_id: ActorId,
    },
    /// An actor touches something and did not in the snapshot that was taken in before.
    Collided {
        /// The frame of the snapshot.
        frame: Frame,
        /// The actor.
        actor_id: ActorId,
    },
    /// Another participant's command was carried out or refused.
    Command {
        /// The first frame that shows its effect.
        frame: Frame,
        /// The participant's name.
        client: String,
        /// The command's name, as `Spawn`.
        command: String,
        /// Why it was refused; `None` if it was carried out.
        refused: Option<Refusal>,
    },
    /// Commands of other participants were lost because this client did not read them in time.
    CommandsLost,
}

/// What is needed to tell one snapshot's events from the next.
#[derive(Debug, Default)]
pub(crate) struct Follower {
    /// The actors of the last snapshot by id, and whether each one touched something.
    known: Vec<(ActorId, bool)>,
    is_begun: bool,
    pending: VecDeque<Event>,
}

/// Snapshots and commands that wait to be read: the oldest go beyond it.
const PENDING_MAX: usize = 65_536;

impl Follower {
    /// Compares a snapshot with the one before; both are sorted by id.
    pub(crate) fn compare(&mut self, frame: Frame, actors: &[ActorState]) {
        let Follower { known, is_begun, pending } = self;
        if *is_begun {
            let mut before = known.iter().peekable();
            for actor in actors {
                while let Some((gone, _)) = before.next_if(|(id, _)| *id < actor.actor_id) {
                    pending.push_back(Event::Destroyed { frame, actor_id: *gone });
                }
                let actor_id = actor.actor_id;
                let was = before.next_if(|(id, _)| *id == actor_id);
                if was.is_none() {
                    pending.push_back(Event::Spawned { frame, actor_id });
                }
                if actor.has(flag::COLLIDING) && !was.is_some_and(|(_, touched)| *touched) {
                    pending.push_back(Event::Collided { frame, actor_id });
                }
            }
            let gone = before.map(|(id, _)| Event::Destroyed { frame, actor_id: *id });
            pending.extend(gone);
            while pending.len() > PENDING_MAX {
                pending.pop_front();
            }
        }
        *is_begun = true;
        known.clear();
        known.extend(actors.iter().map(|actor| (actor.actor_id, actor.has(flag::COLLIDING))));
    }

    pub(crate) fn next(&mut self) -> Option<Event> {
        self.pending.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn actor(id: u32, flags: u32) -> ActorState {
        ActorState { actor_id: ActorId(id), flags, ..ActorState::default() }
    }

    #[test]
    fn two_snapshots_differ_by_spawns_destructions_and_collisions() {
        let mut follower = Follower::default();
        follower.compare(Frame(1), &[actor(1, 0), actor(3, 0), actor(4, flag::COLLIDING)]);
        assert_eq!(follower.next(), None, "what existed before is no event");
        let frame = Frame(2);
        follower
            .compare(frame, &[actor(2, 0), actor(3, flag::COLLIDING), actor(4, flag::COLLIDING)]);
        let events: Vec<Event> = std::iter::from_fn(|| follower.next()).collect();
        assert_eq!(
            events,
            [
                Event::Destroyed { frame, actor_id: ActorId(1) },
                Event::Spawned { frame, actor_id: ActorId(2) },
                Event::Collided { frame, actor_id: ActorId(3) },
            ]
        );
        follower.compare(Frame(3), &[]);
        assert_eq!(std::iter::from_fn(|| follower.next()).count(), 3);
    }
}
