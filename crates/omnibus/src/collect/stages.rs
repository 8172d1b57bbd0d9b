//! Where the time of a run goes, by the clocks of the stages.

use std::fmt;

use protocol::{BundleHeader, SnapshotHeader};

/// Nanoseconds that each stage worked, over some frames. Traffic and rendering run at the same
/// time, and the writers beside everything, so the percentages need not add up to 100.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stages {
    /// Frames that were kept.
    pub(crate) frames: u64,
    /// Elapsed wall-clock time.
    pub(crate) wall_nanos: u64,
    /// Work of the host: commands, physics, publishing.
    pub(crate) simulating_nanos: u64,
    /// Work of traffic: planning.
    pub(crate) planning_nanos: u64,
    /// Work of the renderer: measuring.
    pub(crate) rendering_nanos: u64,
    /// Time that the collector waited for its writers.
    pub(crate) waiting_nanos: u64,
    /// Work of the writers, encoding and writing, summed over all threads.
    pub(crate) writing_nanos: u64,
    /// The number of writers.
    pub(crate) writers: u32,
}

impl Stages {
    /// Adds the times of a frame's snapshot.
    pub(crate) fn add_snapshot(&mut self, header: &SnapshotHeader) {
        self.simulating_nanos += header.published_nanos.saturating_sub(header.begin_nanos);
    }

    /// Adds the times of a frame's bundle.
    pub(crate) fn add_bundle(&mut self, header: &BundleHeader) {
        self.rendering_nanos += header.end_nanos.saturating_sub(header.begin_nanos);
    }

    /// Returns the kept frames per second.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.frames as f64 / (self.wall_nanos.max(1) as f64 / 1e9)
    }

    fn share(&self, nanos: u64) -> f64 {
        100.0 * nanos as f64 / self.wall_nanos.max(1) as f64
    }

    fn writers_share(&self) -> f64 {
        self.share(self.writing_nanos) / f64::from(self.writers.max(1))
    }

    /// Returns the stage that limits the run, and its percentage of the time.
    pub(crate) fn bound(&self) -> (&'static str, f64) {
        let stages = [
            ("simulating", self.share(self.simulating_nanos)),
            ("planning traffic", self.share(self.planning_nanos)),
            ("rendering", self.share(self.rendering_nanos)),
            // A collector that waits for the writers is limited by all of their work.
            (
                "writing",
                if self.share(self.waiting_nanos) > 10.0 { self.writers_share() } else { 0.0 },
            ),
        ];
        let mut most = stages[0];
        for stage in stages {
            if stage.1 > most.1 {
                most = stage;
            }
        }
        most
    }
}

/// `simulate 4 %, plan 6 %, render 71 %, write 2 x 58 %, wait 1 %`.
impl fmt::Display for Stages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "simulate {:.0} %, plan {:.0} %, render {:.0} %, write {} x {:.0} %, wait for writers {:.0} %",
            self.share(self.simulating_nanos),
            self.share(self.planning_nanos),
            self.share(self.rendering_nanos),
            self.writers,
            self.writers_share(),
            self.share(self.waiting_nanos),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: Stages = Stages {
        frames: 30,
        wall_nanos: 2_000_000_000,
        simulating_nanos: 80_000_000,
        planning_nanos: 120_000_000,
        rendering_nanos: 1_420_000_000,
        waiting_nanos: 20_000_000,
        writing_nanos: 2_320_000_000,
        writers: 2,
    };

    #[test]
    fn shares_are_of_the_wall_and_of_each_writer() {
        assert_eq!(RUN.rate_hz(), 15.0);
        assert_eq!(
            RUN.to_string(),
            "simulate 4 %, plan 6 %, render 71 %, write 2 x 58 %, wait for writers 1 %"
        );
    }

    #[test]
    fn a_run_is_bound_by_writing_only_if_it_waits_for_the_writers() {
        assert_eq!(RUN.bound().0, "rendering");
        let slow_disk = Stages { writing_nanos: 3_900_000_000, ..RUN };
        assert_eq!(
            slow_disk.bound().0,
            "rendering",
            "they are busy, but the collector does not wait for them"
        );
        let waiting = Stages { waiting_nanos: 800_000_000, ..slow_disk };
        assert_eq!(waiting.bound().0, "writing");
    }
}
