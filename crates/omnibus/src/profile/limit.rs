//! The stage that limits the frame rate, from the critical path of each frame.
//!
//! A synchronous frame is a chain: the request, the host, then traffic beside the renderer, of which
//! the later one closes the frame, then the client until its next request. The time of a frame is
//! attributed to the links of this chain. A frame of a pipelined or asynchronous world is no chain;
//! there the stage that works for the largest part of the time is the limit.

use bus::StageClock;
use protocol::Settings;

/// What may limit the frame rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Commands,
    Physics,
    Publishing,
    Traffic,
    Rendering,
    Client,
    /// The time from a word of one process to the next process that acts on it.
    HandOver,
    /// The pace of an asynchronous world.
    RealTime,
}

impl Stage {
    const ALL: [Stage; 7] = [
        Stage::Commands,
        Stage::Physics,
        Stage::Publishing,
        Stage::Traffic,
        Stage::Rendering,
        Stage::Client,
        Stage::HandOver,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Stage::Commands => "applying commands",
            Stage::Physics => "physics",
            Stage::Publishing => "publishing",
            Stage::Traffic => "traffic",
            Stage::Rendering => "rendering",
            Stage::Client => "the client",
            Stage::HandOver => "hand-over between processes",
            Stage::RealTime => "real time",
        }
    }

    /// What would change the limit; `is_chain`: the next frame waits for all stages; `on_gpu`: a GPU
    /// traces.
    fn advice(self, is_chain: bool, on_gpu: bool) -> &'static str {
        match self {
            Stage::Commands => "fewer commands for each frame would change it",
            Stage::Physics => {
                "fewer vehicles and walkers, or a longer step (--fixed-delta), would change it"
            }
            Stage::Publishing => "fewer actors, or no recording, would change it",
            Stage::Traffic => "fewer vehicles on autopilot would change it",
            Stage::Rendering if is_chain && on_gpu => {
                "fewer or smaller sensors, or rendering beside the next frames (--pipeline 1), would \
                 change it"
            }
            Stage::Rendering if on_gpu => "fewer or smaller sensors would change it",
            Stage::Rendering if is_chain => {
                "fewer or smaller sensors, a GPU (--device gpu:0), or rendering beside the next frames \
                 (--pipeline 1) would change it"
            }
            Stage::Rendering => {
                "fewer or smaller sensors, or a GPU (--device gpu:0), would change it"
            }
            Stage::Client => {
                "less work between the return of a tick and the next request would change it"
            }
            Stage::HandOver => {
                "spinning on free cores (--wait latency) or threads of one process \
                 (--single-process) would change it"
            }
            Stage::RealTime => "a higher --real-time-factor, or 0, would change it",
        }
    }
}

/// The limit of a run.
#[derive(Clone, Debug)]
pub(crate) struct Limit {
    pub(crate) stage: Stage,
    /// Its part of the time, 0 to 1.
    pub(crate) share: f64,
    /// Frames per second of the run.
    pub(crate) rate_hz: f64,
    /// Frames per second if this stage took half its time.
    pub(crate) rate_at_double_speed_hz: f64,
    /// Whether each frame waited for every stage.
    is_chain: bool,
    /// The part of rendering in which the GPU works, 0 to 1, if there is one.
    gpu_share: Option<f64>,
}

impl Limit {
    /// Returns the limit of these frames; `None` if too few are complete.
    pub(crate) fn of(clocks: &[StageClock], settings: &Settings) -> Option<Limit> {
        let is_chain = settings.synchronous != 0 && settings.pipeline == 0;
        let chain = if is_chain { chain(clocks) } else { None };
        let limit = chain.or_else(|| parallel(clocks, settings))?;
        Some(Limit { gpu_share: gpu_share(clocks), ..limit })
    }

    /// One sentence: the stage, and what would change it.
    pub(crate) fn sentence(&self) -> String {
        let Limit { stage, share, rate_hz, rate_at_double_speed_hz, is_chain, gpu_share } = self;
        let name = stage.name();
        let name = name[..1].to_uppercase() + &name[1..];
        let percent = share * 100.0;
        let mut advice = stage.advice(*is_chain, gpu_share.is_some()).to_owned();
        if let (Stage::Rendering, Some(gpu)) = (stage, gpu_share) {
            advice = format!("the GPU works in {:.0} % of it; {advice}", gpu * 100.0);
        }
        if *stage == Stage::RealTime {
            return format!(
                "{name} limits the frame rate at {rate_hz:.1} frames/s: the busiest stage works \
                 {percent:.0} % of the time; {advice}."
            );
        }
        format!(
            "{name} limits the frame rate: it takes {percent:.0} % of the time of a frame, and at twice \
             its speed there would be {rate_at_double_speed_hz:.1} instead of {rate_hz:.1} frames/s; \
             {advice}."
        )
    }
}

/// The links of one synchronous frame, in nanoseconds.
struct Links {
    hand_over: i64,
    host: [i64; 3],
    /// Until the stage begins, and until it has arrived.
    traffic: [i64; 2],
    rendering: [i64; 2],
    client_wakes: i64,
    client: i64,
}

impl Links {
    fn of(a: &StageClock, b: &StageClock) -> Option<Links> {
        let span = |from: Option<u64>, to: Option<u64>| Some(to? as i64 - from? as i64);
        let traffic = span(a.published_nanos, a.plan_begun_nanos)
            .zip(span(a.plan_begun_nanos, a.plan_delivered_nanos));
        let rendering = span(a.published_nanos, a.trace_begun_nanos)
            .zip(span(a.trace_begun_nanos, a.delivered_nanos));
        Some(Links {
            hand_over: span(a.requested_nanos, a.begun_nanos)?,
            host: [
                span(a.begun_nanos, a.physics_begun_nanos)?,
                span(a.physics_begun_nanos, a.physics_ended_nanos)?,
                span(a.physics_ended_nanos, a.published_nanos)?,
            ],
            traffic: traffic.map_or([0; 2], Into::into),
            rendering: rendering.map_or([0; 2], Into::into),
            client_wakes: span(super::spans::arrived(a), a.read_nanos)?,
            client: span(a.read_nanos, b.requested_nanos)?,
        })
    }

    /// The time of the frame if `halved` took half its time.
    fn total(&self, halved: Option<Stage>) -> i64 {
        let scaled = |stage, nanos: i64| if halved == Some(stage) { nanos / 2 } else { nanos };
        let branch =
            |stage, [wakes, works]: [i64; 2]| scaled(Stage::HandOver, wakes) + scaled(stage, works);
        let traffic = branch(Stage::Traffic, self.traffic);
        let rendering = branch(Stage::Rendering, self.rendering);
        let [commands, physics, publishing] = self.host;
        scaled(Stage::HandOver, self.hand_over + self.client_wakes)
            + scaled(Stage::Commands, commands)
            + scaled(Stage::Physics, physics)
            + scaled(Stage::Publishing, publishing)
            + traffic.max(rendering)
            + scaled(Stage::Client, self.client)
    }

    /// The time of the frame that is attributed to a stage.
    fn critical(&self, stage: Stage) -> i64 {
        let is_closed_by_traffic =
            self.traffic.iter().sum::<i64>() > self.rendering.iter().sum::<i64>();
        let (closing, other) = if is_closed_by_traffic {
            (self.traffic, Stage::Rendering)
        } else {
            (self.rendering, Stage::Traffic)
        };
        match stage {
            Stage::Commands => self.host[0],
            Stage::Physics => self.host[1],
            Stage::Publishing => self.host[2],
            Stage::Client => self.client,
            Stage::HandOver => self.hand_over + closing[0] + self.client_wakes,
            stage if stage == other => 0,
            _ => closing[1],
        }
    }
}

/// The limit of frames that are chains.
fn chain(clocks: &[StageClock]) -> Option<Limit> {
    let frames: Vec<Links> = clocks
        .windows(2)
        .filter(|pair| pair[0].frame.next() == pair[1].frame)
        .filter_map(|pair| Links::of(&pair[0], &pair[1]))
        .collect();
    let sum = |of: &dyn Fn(&Links) -> i64| frames.iter().map(of).sum::<i64>().max(1) as f64;
    let total = sum(&|frame| frame.total(None));
    let stage_nanos = |stage: Stage| sum(&|frame| frame.critical(stage));
    let longest = Stage::ALL
        .into_iter()
        .filter(|stage| *stage != Stage::RealTime)
        .max_by(|a, b| stage_nanos(*a).total_cmp(&stage_nanos(*b)))?;
    if frames.is_empty() {
        return None;
    }
    let count = frames.len() as f64 * 1e9;
    Some(Limit {
        stage: longest,
        share: stage_nanos(longest) / total,
        rate_hz: count / total,
        rate_at_double_speed_hz: count / sum(&|frame| frame.total(Some(longest))),
        is_chain: true,
        gpu_share: None,
    })
}

/// The limit of frames whose stages work side by side.
fn parallel(clocks: &[StageClock], settings: &Settings) -> Option<Limit> {
    let (first, last) = (clocks.first()?, clocks.last()?);
    let frames = (last.frame.0 - first.frame.0) as f64;
    let wall = last.published_nanos?.saturating_sub(first.published_nanos?) as f64;
    if frames == 0.0 || wall == 0.0 {
        return None;
    }
    let busy = |span: fn(&StageClock) -> (Option<u64>, Option<u64>)| -> f64 {
        let length = |clock: &StageClock| {
            let (from, to) = span(clock);
            Some(to?.saturating_sub(from?) as f64)
        };
        let known: Vec<f64> = clocks.iter().filter_map(length).collect();
        // As if the frames that were not sampled were like the others.
        known.iter().sum::<f64>() / clocks.len() as f64 * frames
    };
    let client = clocks.windows(2).filter(|pair| pair[0].frame.next() == pair[1].frame);
    let client = client.filter_map(|pair| {
        let (from, to) = (pair[0].read_nanos?, pair[1].requested_nanos?);
        Some(to.saturating_sub(from) as f64)
    });
    let stages = [
        (Stage::Commands, busy(|c| (c.begun_nanos, c.physics_begun_nanos))),
        (Stage::Physics, busy(|c| (c.physics_begun_nanos, c.physics_ended_nanos))),
        (Stage::Publishing, busy(|c| (c.physics_ended_nanos, c.published_nanos))),
        (Stage::Traffic, busy(|c| (c.plan_begun_nanos, c.plan_delivered_nanos))),
        (Stage::Rendering, busy(|c| (c.trace_begun_nanos, c.delivered_nanos))),
        (Stage::Client, client.sum()),
    ];
    let is_asynchronous = settings.synchronous == 0;
    // In asynchronous mode the host waits for no stage; a slow one misses frames.
    let limits = stages.iter().filter(|(stage, _)| {
        !is_asynchronous || matches!(stage, Stage::Commands | Stage::Physics | Stage::Publishing)
    });
    let (stage, nanos) = *limits.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (rate_hz, busiest) = (frames * 1e9 / wall, stages.iter().map(|s| s.1).fold(0.0, f64::max));
    let pace = (settings.delta_nanos * 1000).checked_div(settings.real_time_permille.into());
    if let Some(pace) = pace
        && is_asynchronous
        && wall / frames < pace as f64 * 1.05
    {
        let at_double_speed = 2.0 * rate_hz;
        return Some(Limit {
            stage: Stage::RealTime,
            share: busiest / wall,
            rate_hz,
            rate_at_double_speed_hz: at_double_speed,
            is_chain: false,
            gpu_share: None,
        });
    }
    // Side by side with the other stages: the next one limits the gain.
    let rendering = stages[4].1;
    let serial: f64 = wall.min(stages.iter().map(|s| s.1).sum::<f64>() - rendering);
    let halved = match stage {
        Stage::Rendering => serial.max(wall - nanos / 2.0),
        _ => rendering.max(wall - nanos / 2.0),
    };
    Some(Limit {
        stage,
        share: (nanos / wall).min(1.0),
        rate_hz,
        rate_at_double_speed_hz: frames * 1e9 / halved.max(1.0),
        is_chain: false,
        gpu_share: None,
    })
}

/// The part of rendering in which the GPU works; `None` if it never does.
fn gpu_share(clocks: &[StageClock]) -> Option<f64> {
    let spans = clocks.iter().filter_map(|clock| {
        let gpu = clock.device_copied_nanos?.saturating_sub(clock.device_begun_nanos?);
        Some((gpu, clock.delivered_nanos?.saturating_sub(clock.trace_begun_nanos?)))
    });
    let (gpu, rendering) = spans.fold((0, 0), |sum, span| (sum.0 + span.0, sum.1 + span.1));
    (rendering > 0).then(|| gpu as f64 / rendering as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::Frame;

    /// A frame of host, traffic (2 ms) and rendering, in steps of 0.1 ms.
    fn clock(number: u64, rendering: u64) -> StageClock {
        let arrived = 32.max(12 + rendering);
        let begin = number * (arrived + 4);
        let at = |tick: u64| Some((begin + tick) * 100_000);
        let mut clock = StageClock::at(Frame(number));
        clock.requested_nanos = at(0);
        clock.begun_nanos = at(1);
        clock.physics_begun_nanos = at(2);
        clock.physics_ended_nanos = at(10);
        clock.published_nanos = at(11);
        clock.plan_begun_nanos = at(12);
        clock.plan_delivered_nanos = at(32);
        clock.trace_begun_nanos = at(12);
        clock.delivered_nanos = at(12 + rendering);
        clock.read_nanos = at(arrived + 1);
        clock
    }

    fn strict() -> Settings {
        Settings { synchronous: 1, ..Settings::default() }
    }

    /// Frames of which each is requested 0.3 ms after the client has read the one before.
    fn run(rendering: u64) -> Vec<StageClock> {
        (1..20).map(|number| clock(number, rendering)).collect()
    }

    #[test]
    fn the_later_stage_closes_the_frame_and_is_attributed_its_time() {
        let limit = Limit::of(&run(60), &strict()).unwrap();
        assert_eq!(limit.stage, Stage::Rendering);
        // 1.1 ms of the host, 0.1 ms until the renderer begins, 6 ms of it, 0.1 + 0.3 ms of the client.
        assert!((limit.share - 6.0 / 7.6).abs() < 1e-9, "{limit:?}");
        assert!((limit.rate_at_double_speed_hz - 1e3 / 4.6).abs() < 1e-6, "{limit:?}");
        assert!(limit.sentence().starts_with("Rendering limits the frame rate"), "{limit:?}");
        let limit = Limit::of(&run(10), &strict()).unwrap();
        assert_eq!(limit.stage, Stage::Traffic);
        // The renderer, 1 ms, closes the frame if traffic takes no longer than that.
        assert!((limit.rate_at_double_speed_hz - 1e3 / 2.6).abs() < 1e-6, "{limit:?}");
    }

    #[test]
    fn a_gpu_is_advised_only_where_none_traces() {
        let mut clocks = run(60);
        let without = Limit::of(&clocks, &strict()).unwrap().sentence();
        assert!(without.contains("--device gpu:0"), "{without}");
        for clock in &mut clocks {
            // 1.5 of the 6 ms of rendering.
            let begun = clock.trace_begun_nanos.unwrap();
            clock.device_begun_nanos = Some(begun + 1_000_000);
            clock.device_traced_nanos = Some(begun + 2_000_000);
            clock.device_copied_nanos = Some(begun + 2_500_000);
        }
        let with = Limit::of(&clocks, &strict()).unwrap().sentence();
        assert!(with.contains("the GPU works in 25 % of it"), "{with}");
        assert!(!with.contains("--device") && with.contains("--pipeline 1"), "{with}");
    }

    #[test]
    fn an_asynchronous_world_that_keeps_its_pace_is_limited_by_real_time() {
        let settings = Settings { delta_nanos: 100_000_000, ..Settings::default() };
        assert_eq!(Limit::of(&run(60), &settings).unwrap().stage, Stage::RealTime);
        let settings = Settings { real_time_permille: 0, ..settings };
        assert_eq!(Limit::of(&run(60), &settings).unwrap().stage, Stage::Physics);
        let settings = Settings { synchronous: 1, pipeline: 1, ..settings };
        assert_eq!(Limit::of(&run(60), &settings).unwrap().stage, Stage::Rendering);
    }
}
