//! Sensor bundles: the stream of what their sensors measure.

use std::sync::{Arc, Weak};

use bus::{Reader, SlotInstant};
use protocol::{BundleHeader, BundleId, Command, Frame, Page, RawCommand, SensorSpec};

use crate::{ClientError, Measurement, connection::Connection};

/// Sensors that are measured together, and the stream of their measurements.
///
/// Dropped, it is destroyed: rendering stops with the next frame. It is `Send`.
#[must_use = "dropped, the bundle is destroyed"]
pub struct SensorBundle {
    id: BundleId,
    /// The number of the world in which it was created.
    episode: u32,
    sensors: Arc<[SensorSpec]>,
    reader: Reader<BundleHeader, Page>,
    last: Frame,
    missed: u64,
    /// The connection that destroys it; none once it was destroyed.
    owner: Weak<Connection>,
}

impl SensorBundle {
    pub(crate) fn new(
        id: BundleId,
        episode: u32,
        sensors: Arc<[SensorSpec]>,
        reader: Reader<BundleHeader, Page>,
        owner: Weak<Connection>,
    ) -> SensorBundle {
        SensorBundle { id, episode, sensors, reader, last: Frame(0), missed: 0, owner }
    }

    /// Returns the bundle's id; the bundle is not destroyed when this value is dropped.
    pub(crate) fn release(mut self) -> BundleId {
        self.owner = Weak::new();
        self.id
    }

    /// Checks that the world of the bundle is the running one, whose number is `standing`
    /// ([`Client::episode`](crate::Client::episode)).
    ///
    /// # Errors
    ///
    /// [`ClientError::WorldGone`].
    pub fn check(&self, standing: u32) -> Result<(), ClientError> {
        if self.episode == standing {
            return Ok(());
        }
        Err(ClientError::WorldGone { bundle: self.id, standing })
    }

    /// Returns the id.
    #[must_use]
    pub fn id(&self) -> BundleId {
        self.id
    }

    /// Returns the sensors in the protocol's layout, in the order of their indices.
    #[must_use]
    pub fn sensors(&self) -> &[SensorSpec] {
        &self.sensors
    }

    /// Returns the oldest measurement that was not received yet, if there is one. Never blocks. A
    /// restarted renderer may measure a frame twice; each frame is returned once.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`] if more measurements are held than the bundle allows.
    pub fn receive(&mut self) -> Result<Option<Measurement>, ClientError> {
        while let Some(bundle) = self.reader.receive()? {
            let frame = bundle.header().stamp.frame;
            if frame > self.last {
                if self.last.0 > 0 {
                    self.missed += frame.0 - self.last.0 - 1;
                }
                self.last = frame;
                if let Some(owner) = self.owner.upgrade() {
                    owner.participant.mark(SlotInstant::Read, frame);
                }
                let sensors = Arc::clone(&self.sensors);
                return Ok(Some(Measurement::new(bundle, sensors)));
            }
        }
        Ok(None)
    }

    /// Returns the measurement of `frame`, if it has come. Earlier ones are dropped, and counted as
    /// missed.
    ///
    /// # Errors
    ///
    /// As for [`SensorBundle::receive`]; [`ClientError::HostEnded`] if it has not come and the host
    /// has ended, because the renderer then ends, too.
    pub fn receive_at(&mut self, frame: Frame) -> Result<Option<Measurement>, ClientError> {
        while self.last < frame {
            let Some(next) = self.receive()? else { break };
            if next.frame() == frame {
                return Ok(Some(next));
            }
            self.missed += 1;
        }
        match self.owner.upgrade() {
            Some(owner) if self.last < frame && owner.has_host_ended() => Err(owner.host_ended()),
            _ => Ok(None),
        }
    }

    /// Returns the newest measurement that was not received yet and drops older ones.
    ///
    /// # Errors
    ///
    /// As for [`SensorBundle::receive`].
    pub fn latest(&mut self) -> Result<Option<Measurement>, ClientError> {
        let mut newest = None;
        while let Some(next) = self.receive()? {
            newest = Some(next);
        }
        Ok(newest)
    }

    /// Returns the frame of the measurement that was received last; frame 0 before the first.
    #[must_use]
    pub fn last(&self) -> Frame {
        self.last
    }

    /// Returns the number of frames between the first and the last received one that were not
    /// received.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

impl Drop for SensorBundle {
    /// Sends the command that destroys the bundle, and does not wait for it. If the client or the
    /// world is gone, the host has destroyed the bundle already.
    fn drop(&mut self) {
        if let Some(owner) = self.owner.upgrade()
            && owner.episode() == self.episode
        {
            let command = RawCommand::from(Command::DestroyBundle(self.id));
            // If the command cannot be sent, the host destroys the bundle with its client.
            let _ = owner.send(std::iter::once(command), true, None);
        }
    }
}

impl std::fmt::Debug for SensorBundle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SensorBundle")
            .field("id", &self.id)
            .field("episode", &self.episode)
            .field("sensors", &self.sensors)
            .field("last", &self.last)
            .field("missed", &self.missed)
            .finish_non_exhaustive()
    }
}
