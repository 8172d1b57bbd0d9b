//! How time passes.

use std::time::Duration;

/// How time passes: see [`Client::apply_settings`](crate::Client::apply_settings).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Simulated time of one tick: 0.1 ms to 10 s.
    pub delta: Duration,
    /// The longest physics substep: 0.1 ms to 100 ms.
    pub substep_max: Duration,
    /// How frames are started.
    pub pace: Pace,
    /// How many frames rendering may trail behind the world: 0 (strict) to 3.
    pub pipeline: u32,
    /// Whether sensors are rendered.
    pub rendering: bool,
}

/// How frames are started.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// By the client that holds the tick.
    Synchronous,
    /// By the host's own clock, at this many simulated seconds per real second.
    RealTime(f32),
    /// By the host, one after the other without a pause.
    Unpaced,
}

impl Default for Settings {
    /// Asynchronous, 50 ms at real-time pace, substeps of 10 ms.
    fn default() -> Self {
        Settings::from(protocol::Settings::default())
    }
}

impl Settings {
    /// The same settings with another duration of a tick.
    #[must_use]
    pub fn with_delta(self, delta: Duration) -> Settings {
        Settings { delta, ..self }
    }

    /// The same settings with another longest physics substep.
    #[must_use]
    pub fn with_substep_max(self, substep_max: Duration) -> Settings {
        Settings { substep_max, ..self }
    }

    /// The same settings with another pace.
    #[must_use]
    pub fn with_pace(self, pace: Pace) -> Settings {
        Settings { pace, ..self }
    }

    /// The same settings with rendering `pipeline` frames behind the world at most.
    #[must_use]
    pub fn with_pipeline(self, pipeline: u32) -> Settings {
        Settings { pipeline, ..self }
    }

    /// The same settings with or without rendering.
    #[must_use]
    pub fn with_rendering(self, rendering: bool) -> Settings {
        Settings { rendering, ..self }
    }
}

impl From<protocol::Settings> for Settings {
    fn from(settings: protocol::Settings) -> Settings {
        let pace = match (settings.synchronous, settings.real_time_permille) {
            (0, 0) => Pace::Unpaced,
            (0, permille) => Pace::RealTime(permille as f32 / 1000.0),
            _ => Pace::Synchronous,
        };
        Settings {
            delta: Duration::from_nanos(settings.delta_nanos),
            substep_max: Duration::from_nanos(settings.substep_max_nanos),
            pace,
            pipeline: settings.pipeline,
            rendering: settings.no_rendering == 0,
        }
    }
}

impl Settings {
    /// As the protocol has them. `permille` is the pace that a later switch to real time has.
    pub(crate) fn to_wire(self, permille: u32) -> protocol::Settings {
        let nanos = |d: Duration| u64::try_from(d.as_nanos()).unwrap_or(u64::MAX);
        protocol::Settings {
            delta_nanos: nanos(self.delta),
            substep_max_nanos: nanos(self.substep_max),
            synchronous: (self.pace == Pace::Synchronous).into(),
            pipeline: self.pipeline,
            real_time_permille: match self.pace {
                Pace::Synchronous => permille,
                // Never 0, which would mean without a pause.
                Pace::RealTime(factor) => (factor * 1000.0).round().max(1.0) as u32,
                Pace::Unpaced => 0,
            },
            no_rendering: (!self.rendering).into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_from_the_protocol() {
        let settings = Settings::default()
            .with_delta(Duration::from_millis(20))
            .with_pace(Pace::RealTime(2.5))
            .with_pipeline(2)
            .with_rendering(false);
        assert_eq!(Settings::from(settings.to_wire(1000)), settings);
        for pace in [Pace::Synchronous, Pace::Unpaced] {
            let settings = settings.with_pace(pace);
            assert_eq!(Settings::from(settings.to_wire(1000)), settings);
        }
    }
}
