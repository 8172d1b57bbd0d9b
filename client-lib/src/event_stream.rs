//! The event stream of an observer.

use protocol::Name;

use crate::{ClientError, Event, Observer, events::Follower};

impl Observer {
    /// Collects events from now on: [`Observer::next_event`] returns them. They cost memory and
    /// time only while they are followed.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`].
    pub fn follow_events(&mut self) -> Result<(), ClientError> {
        self.connection().inbox().follow_others()?;
        let mut follower = Follower::default();
        follower.compare(self.frame(), self.world().states());
        self.set_follower(Some(follower));
        Ok(())
    }

    /// Collects no more events.
    pub fn ignore_events(&mut self) {
        self.connection().inbox().ignore_others();
        self.set_follower(None);
    }

    /// Returns the next event, if there is one: first those of snapshots that
    /// [`Observer::refresh`] and [`Observer::await_frame`] took in, then commands of others. Never
    /// blocks.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`].
    pub fn next_event(&mut self) -> Result<Option<Event>, ClientError> {
        if let Some(event) = self.follower().and_then(Follower::next) {
            return Ok(Some(event));
        }
        let connection = self.connection();
        let mut inbox = connection.inbox();
        if !inbox.follows_others() {
            return Ok(None);
        }
        inbox.take_in(connection.name())?;
        if inbox.take_gap() {
            return Ok(Some(Event::CommandsLost));
        }
        Ok(inbox.next_other().map(|(frame, entry)| Event::Command {
            frame,
            client: name_of(entry.client),
            command: entry.command.decode().map_or_else(String::new, |c| variant(&c)),
            refused: entry.outcome.result().err(),
        }))
    }
}

fn name_of(name: Name) -> String {
    name.as_str().to_owned()
}

/// The name of a command's variant.
fn variant(command: &protocol::Command) -> String {
    let text = format!("{command:?}");
    text.split('(').next().unwrap_or_default().to_owned()
}
