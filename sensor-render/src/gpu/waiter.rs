//! Waiting for the device.

use std::time::{Duration, Instant};

use wgpu::{PollError, PollType, SubmissionIndex};

use super::open::Gpu;
use crate::error::TraceError;

/// Time about the expected end of a submission in which the device is polled. Processors of virtual machines that
/// block for longer are given away, and notice the end up to 0.2 ms late.
const POLLED: Duration = Duration::from_micros(500);

/// Waits for submissions: it blocks until shortly before the time that the last one took, and polls from then on.
#[derive(Debug, Default)]
pub(crate) struct Waiter {
    /// Duration of the last wait.
    last: Duration,
}

impl Waiter {
    /// Waits until a submission is complete.
    ///
    /// # Errors
    /// [`TraceError::Gpu`] if the device is lost, or does not finish in its time.
    pub(crate) fn wait(
        &mut self,
        gpu: &Gpu,
        submission: SubmissionIndex,
    ) -> Result<(), TraceError> {
        let begin = Instant::now();
        let poll = |timeout: Duration| {
            let submission_index = Some(submission.clone());
            gpu.device.poll(PollType::Wait { submission_index, timeout: Some(timeout) })
        };
        let mut result = poll(self.last.saturating_sub(POLLED));
        while let Err(PollError::Timeout) = result
            && begin.elapsed() < self.last + POLLED
        {
            std::thread::yield_now();
            result = poll(Duration::ZERO);
        }
        if let Err(PollError::Timeout) = result {
            result = poll(gpu.timeout);
        }
        self.last = begin.elapsed();
        result.map(drop).map_err(|why| gpu.error(why.to_string()))
    }
}
