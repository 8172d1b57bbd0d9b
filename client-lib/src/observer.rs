//! The half of a client that sees the world.

use std::sync::Arc;

use bus::{Instance, SlotInstant, SnapshotReader, StageClock, Watch};
use protocol::{BlueprintInfo, Frame};
use road::Network;

use crate::{
    ClientError, Deadlines, Measurement, SensorBundle, Settings, Waiter, World,
    connection::{Connection, after},
    events::Follower,
};

/// Takes in snapshots, measurements and events: one half of a [`Client`](crate::Client::split). It
/// is `Send`, so that it can observe on another thread than its [`Controller`](crate::Controller)
/// acts on.
pub struct Observer {
    world: Option<Arc<World>>,
    snapshot: SnapshotReader,
    frame: Frame,
    follower: Option<Follower>,
    deadlines: Deadlines,
    connection: Arc<Connection>,
}

impl Observer {
    pub(crate) fn new(
        connection: Arc<Connection>,
        snapshot: SnapshotReader,
        deadlines: Deadlines,
    ) -> Result<Observer, ClientError> {
        let frame = connection.first;
        let mut observer =
            Observer { world: None, snapshot, frame, follower: None, deadlines, connection };
        observer.refresh()?;
        Ok(observer)
    }

    pub(crate) fn connection(&self) -> &Arc<Connection> {
        &self.connection
    }

    pub(crate) fn follower(&mut self) -> Option<&mut Follower> {
        self.follower.as_mut()
    }

    pub(crate) fn set_follower(&mut self, follower: Option<Follower>) {
        self.follower = follower;
    }

    /// How long calls wait.
    #[must_use]
    pub fn deadlines(&self) -> Deadlines {
        self.deadlines
    }

    /// Sets how long calls wait.
    pub fn set_deadlines(&mut self, deadlines: Deadlines) {
        self.deadlines = deadlines;
    }

    /// The simulator that this client is connected to.
    #[must_use]
    pub fn instance(&self) -> &Instance {
        self.connection.participant.instance()
    }

    /// The blueprints that can be spawned; an actor's blueprint is an index into this list.
    #[must_use]
    pub fn blueprints(&self) -> &[BlueprintInfo] {
        &self.connection.blueprints
    }

    /// The number of the world that is running, from 1. Loading a world raises it; actors and
    /// bundles of earlier worlds no longer exist.
    #[must_use]
    pub fn episode(&self) -> u32 {
        self.connection.episode()
    }

    /// Returns how time passes now.
    #[must_use]
    pub fn settings(&self) -> Settings {
        Settings::from(self.connection.participant.control().settings())
    }

    /// Returns the road network of the running map. It is read once for each map that is loaded,
    /// from the cache of baked maps where possible, and shared: it outlives the map and the client.
    ///
    /// # Errors
    ///
    /// [`ClientError::Map`] if the map cannot be parsed, [`ClientError::Bus`] if its text cannot be
    /// read.
    pub fn map(&self) -> Result<Arc<Network>, ClientError> {
        self.connection.network()
    }

    /// Takes in the newest snapshot; returns whether it is newer than the one before. Never blocks.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`].
    pub fn refresh(&mut self) -> Result<bool, ClientError> {
        let mut is_newer = false;
        while let Some(snapshot) = self.snapshot.receive()? {
            if snapshot.header().stamp.frame >= self.frame {
                self.frame = snapshot.header().stamp.frame;
                if let Some(follower) = &mut self.follower {
                    follower.compare(self.frame, snapshot.actors());
                }
                let world = World::new(snapshot);
                // Without an allocation, unless the older one is shared.
                match self.world.as_mut().and_then(Arc::get_mut) {
                    Some(last) => *last = world,
                    None => self.world = Some(Arc::new(world)),
                }
                is_newer = true;
            }
        }
        self.connection.set_frame(self.frame);
        if is_newer {
            self.connection.participant.mark(SlotInstant::Read, self.frame);
        }
        Ok(is_newer)
    }

    /// Waits until a newer frame than the one that was taken in last is published, and takes the
    /// newest in.
    ///
    /// # Errors
    ///
    /// [`ClientError::HostEnded`]; [`ClientError::Timeout`] after [`Deadlines::frame`].
    pub fn await_frame(&mut self) -> Result<Frame, ClientError> {
        let deadline = self.deadlines.frame;
        let published = self.connection.participant.next_frame(self.frame, deadline.map(after));
        published.map_err(|why| {
            self.connection.interrupted(why, "the next frame", deadline.unwrap_or_default())
        })?;
        self.refresh()?;
        Ok(self.frame)
    }

    /// The world at the newest frame that was taken in.
    ///
    /// # Panics
    ///
    /// Never: a snapshot comes with the connection.
    #[must_use]
    pub fn world(&self) -> &World {
        self.world.as_ref().expect("a snapshot comes with the connection")
    }

    /// The same world, to be kept after newer ones were taken in. At most two older ones may be kept:
    /// with a third, taking a newer one in fails.
    ///
    /// # Panics
    ///
    /// Never, as [`Observer::world`].
    #[must_use]
    pub fn shared_world(&self) -> Arc<World> {
        Arc::clone(self.world.as_ref().expect("a snapshot comes with the connection"))
    }

    /// Waits for frames and measurements beside this observer.
    #[must_use]
    pub fn waiter(&self) -> Waiter {
        Waiter::new(&self.connection)
    }

    /// The newest frame that was taken in.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Returns when the parts of a frame began and ended, with this client's own instants: for one
    /// of the last 64 frames. A part that is not over yet, did not take place or is too long ago
    /// gives `None`.
    #[must_use]
    pub fn stage_clock(&self, frame: Frame) -> StageClock {
        let participant = &self.connection.participant;
        participant.control().stage_clock(frame, Some(participant.slot()))
    }

    /// Waits for `bundle`'s next measurement: for pipelined and asynchronous worlds.
    ///
    /// # Errors
    ///
    /// [`ClientError::WorldGone`] if another world was loaded; [`ClientError::Timeout`] after
    /// [`Deadlines::answer`]; [`ClientError::HostEnded`]; [`ClientError::Bus`] if more measurements
    /// are held than the bundle allows.
    pub fn await_measurement(
        &mut self,
        bundle: &mut SensorBundle,
    ) -> Result<Measurement, ClientError> {
        let waited = self.deadlines.answer;
        let id = bundle.id().0;
        let connection = &self.connection;
        let found = connection.participant.await_answer(after(waited), || match bundle.receive() {
            Ok(None) => bundle.check(connection.episode()).err().map(Err),
            Ok(Some(measurement)) => Some(Ok(measurement)),
            Err(e) => Some(Err(e)),
        });
        found.map_err(|why| {
            connection.interrupted(why, &format!("a measurement of bundle {id}"), waited)
        })?
    }

    /// For another thread of this process: a view that sees frames arrive without taking them in.
    #[must_use]
    pub fn watch(&self) -> Watch {
        self.connection.participant.watch()
    }
}

impl std::fmt::Debug for Observer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Observer")
            .field("connection", &self.connection)
            .field("deadlines", &self.deadlines)
            .finish_non_exhaustive()
    }
}
