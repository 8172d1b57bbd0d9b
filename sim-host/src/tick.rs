//! One tick.
//!
//! ```text
//!  client ──command, control──▶ host ──snapshot N──▶ traffic ──control for N+1──▶ host
//!                                │ ╲
//!                                │  ╲──snapshot N──▶ renderer ──measurements N──▶ client
//!                                └─────snapshot N───────────────────────────────▶ client
//! ```
//!
//! What traffic decides on frame N acts in N+1: a fact of the world, not of process speed.

use bus::clock;
use protocol::{Frame, SnapshotHeader};

use crate::{
    HostError,
    host::{Host, ending},
};

impl Host {
    /// Advances the world by one tick. All of a tick is on this page.
    pub(crate) fn tick(&mut self) -> Result<Frame, HostError> {
        let begin_nanos = clock::now_nanos();
        let frame = self.barrier.advance();
        self.take_in_what_traffic_decided()?;
        self.apply_commands()?;
        let applied_nanos = clock::now_nanos();
        self.step();
        self.show_recorded();
        let stepped_nanos = clock::now_nanos();
        self.publish(SnapshotHeader {
            stamp: self.stamp(frame),
            delta_nanos: self.settings.delta_nanos,
            begin_nanos,
            applied_nanos,
            stepped_nanos,
            ..SnapshotHeader::default()
        })?;
        let verdict = self.await_arrivals(frame)?;
        self.control.close(frame, ending(&verdict));
        Ok(frame)
    }
}
