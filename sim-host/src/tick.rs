//! One tick.
//!
//! ```text
//!  client ──command, control──▶ host ──snapshot N──▶ traffic ──control for N+1──▶ host
//!                                │ ╲
//!                                │  ╲──snapshot N──▶ renderer ──measurements N──▶ client
//!                                └─────snapshot N───────────────────────────────▶ client
//! ```
//!
//! A decision of traffic on frame N acts in N+1, whatever the speed of the processes.

use bus::clock;
use protocol::Frame;

use crate::{HostError, host::Host};

impl Host {
    /// Advances the world by one tick. This function is the whole tick.
    pub(crate) fn tick(&mut self) -> Result<Frame, HostError> {
        self.shell.tick.begin_nanos = clock::now_nanos();
        // What replaces the world waits for the end of the tick.
        self.shell.is_ticking = true;
        self.shell.clean_up_kept();
        let frame = self.shell.barrier.advance();
        let requests = self.drain_inputs()?;
        let outputs = self.step(&requests)?;
        self.shell.publish(&self.sim, &outputs)?;
        let verdict = self.await_arrivals(frame)?;
        self.shell.is_ticking = false;
        self.shell.close(frame, &verdict);
        Ok(frame)
    }
}
