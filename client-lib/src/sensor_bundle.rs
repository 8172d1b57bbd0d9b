//! Sensor bundles: the stream of what their sensors measure.

use std::sync::{Arc, Weak};

use bus::Reader;
use protocol::{BundleHeader, BundleId, Command, Frame, Page, RawCommand, SensorSpec};

use crate::{ClientError, Measurement, connection::Connection};

/// Sensors that are measured together, and the stream of their measurements.
///
/// Dropped, it is destroyed: rendering stops with the next frame. It is `Send`.
#[must_use = "dropped, the bundle is destroyed"]
pub struct SensorBundle {
    id: BundleId,
    /// The number of the world that it was made in.
    episode: u32,
    sensors: Arc<[SensorSpec]>,
    reader: Reader<BundleHeader, Page>,
    last: Frame,
    missed: u64,
    /// Whose it is; none once it was destroyed.
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

    /// Whether the world that it was made in still stands.
    pub(crate) fn check(&self, standing: u32) -> Result<(), ClientError> {
        if self.episode == standing {
            return Ok(());
        }
        Err(ClientError::WorldGone { bundle: self.id, standing })
    }

    /// Its id.
    pub fn id(&self) -> BundleId {
        self.id
    }

    /// Its sensors.
    pub fn sensors(&self) -> &[SensorSpec] {
        &self.sensors
    }

    /// The oldest measurement that was not read yet, if there is one. Never blocks. A restarted
    /// renderer may send a frame once more; each comes out once.
    pub fn receive(&mut self) -> Result<Option<Measurement>, ClientError> {
        while let Some(bundle) = self.reader.receive()? {
            let frame = bundle.header().stamp.frame;
            if frame > self.last {
                if self.last.0 > 0 {
                    self.missed += frame.0 - self.last.0 - 1;
                }
                self.last = frame;
                let sensors = Arc::clone(&self.sensors);
                return Ok(Some(Measurement::new(bundle, sensors)));
            }
        }
        Ok(None)
    }

    /// The measurement of `frame`. Earlier ones are dropped, and counted as missed.
    pub(crate) fn receive_at(&mut self, frame: Frame) -> Result<Option<Measurement>, ClientError> {
        while self.last < frame {
            let Some(next) = self.receive()? else { break };
            if next.frame() == frame {
                return Ok(Some(next));
            }
            self.missed += 1;
        }
        Ok(None)
    }

    /// The newest measurement, older ones dropped.
    pub fn latest(&mut self) -> Result<Option<Measurement>, ClientError> {
        let mut newest = None;
        while let Some(next) = self.receive()? {
            newest = Some(next);
        }
        Ok(newest)
    }

    /// The last frame that came out.
    pub fn last(&self) -> Frame {
        self.last
    }

    /// Frames between the first and the last that never came out.
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

impl Drop for SensorBundle {
    /// Sends the command that destroys the bundle, and does not wait for it. A client that is gone,
    /// or a world that is, has taken the bundle along.
    fn drop(&mut self) {
        if let Some(owner) = self.owner.upgrade()
            && owner.episode() == self.episode
        {
            let command = RawCommand::from(Command::DestroyBundle(self.id));
            // A host that takes no commands any more frees the bundle with its client.
            let _ = owner.send(std::iter::once(command), true);
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
