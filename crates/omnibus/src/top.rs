//! `omnibus top`: a running simulator at a glance, in the terminal.

mod view;

use std::{
    io::{IsTerminal, stdout},
    time::{Duration, Instant},
};

use anyhow::Context;
use bus::{Instance, Role, StageClock};
use ratatui::{
    buffer::Buffer,
    crossterm::event::{self, Event, KeyCode, KeyModifiers},
    layout::Rect,
};

use crate::profile::{
    limit::Limit,
    report::Series,
    sampler::{Member, Sampler},
    spans::{PARTS, Span, lengths},
};
use view::View;

/// Arguments of `omnibus top`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct TopArgs {
    /// The name of the simulator; default: the only one that runs
    #[arg(long)]
    name: Option<String>,
    /// Seconds between two updates; without a terminal, how long to look before the one that is printed
    #[arg(long, default_value_t = 0.5)]
    interval: f64,
}

/// Frames over which times are summed up, at most.
const FRAMES_MAX: usize = 400;
/// Time between two looks at the stage clock, which keeps 64 frames.
const POLL: Duration = Duration::from_millis(2);
/// The width of what is printed without a terminal.
const PLAIN_WIDTH: u16 = 96;

/// Shows a simulator until `q` is pressed or it ends.
pub(crate) fn top(args: &TopArgs) -> anyhow::Result<()> {
    anyhow::ensure!(
        (0.05..=60.0).contains(&args.interval),
        "--interval is {}; use 0.05 to 60 (seconds)",
        args.interval
    );
    let interval = Duration::from_secs_f64(args.interval);
    let instance = Instance::find(args.name.as_deref())?;
    let mut watched =
        Watched { map: instance.episode()?.map, sampler: Sampler::new(&instance)?, instance };
    if !stdout().is_terminal() {
        watched.sample(interval, || Ok(false))?;
        print_line!("{}", plain(&watched.view()));
        return Ok(());
    }
    // The panic hook that this sets restores the terminal too.
    let mut terminal = ratatui::try_init().context("terminal")?;
    let shown = loop {
        let view = watched.view();
        let drawn = terminal.draw(|frame| view.render(frame.area(), frame.buffer_mut()));
        match drawn.map_err(anyhow::Error::from).and_then(|_| watched.sample(interval, is_left)) {
            Ok(Next::Update) => {}
            next => break next,
        }
    };
    ratatui::try_restore().context("terminal")?;
    if let Next::Ended = shown? {
        print_line!("simulator {:?} has ended", watched.instance.id());
    }
    Ok(())
}

/// Returns whether `q`, Escape or Ctrl-C was pressed.
fn is_left() -> anyhow::Result<bool> {
    if !event::poll(Duration::ZERO)? {
        return Ok(false);
    }
    let Event::Key(key) = event::read()? else { return Ok(false) };
    let is_interrupt =
        key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
    Ok(is_interrupt || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc))
}

/// What follows an interval.
enum Next {
    Update,
    Left,
    Ended,
}

/// A simulator that is shown.
struct Watched {
    map: String,
    sampler: Sampler,
    instance: Instance,
}

impl Watched {
    /// Reads frames for one interval.
    fn sample(
        &mut self,
        interval: Duration,
        mut is_left: impl FnMut() -> anyhow::Result<bool>,
    ) -> anyhow::Result<Next> {
        let begin = Instant::now();
        while begin.elapsed() < interval {
            std::thread::sleep(POLL);
            self.sampler.poll();
            if is_left()? {
                return Ok(Next::Left);
            }
            if self.sampler.is_over() {
                return Ok(Next::Ended);
            }
        }
        let old = self.sampler.clocks.len().saturating_sub(FRAMES_MAX);
        self.sampler.clocks.drain(..old);
        Ok(Next::Update)
    }

    fn view(&self) -> View {
        let settings = self.sampler.settings();
        let clocks = &self.sampler.clocks;
        let mode = match (settings.synchronous, settings.pipeline) {
            (0, _) => "asynchronous".to_owned(),
            (_, 0) => "synchronous".to_owned(),
            (_, frames) => format!("pipelined by {frames}"),
        };
        let rate = match Rate::of(clocks) {
            Some(rate) => format!("{:.1} frames/s", rate.hz),
            None => "stands still".to_owned(),
        };
        let frame = self.sampler.frame().0;
        let title =
            format!("{} on {}, {mode}, frame {frame}, {rate}", self.instance.id(), self.map);
        let queues = self.sampler.queues();
        let parts = PARTS
            .iter()
            .map(|part| Series { name: part.name.to_owned(), nanos: lengths(part, clocks) })
            .filter(|series| !series.nanos.is_empty());
        View {
            title,
            members: self.sampler.members().iter().map(|member| row(member, clocks)).collect(),
            parts: parts.map(|series| (series.name.clone(), series.percentiles_ms())).collect(),
            queues: format!(
                "{} batches of commands, {} parts of the journal, {} recorded frames; most: {}, {}, {}",
                queues.commands,
                queues.journal_parts,
                queues.recorded_frames,
                self.sampler.queues_max.commands,
                self.sampler.queues_max.journal_parts,
                self.sampler.queues_max.recorded_frames,
            ),
            limit: Limit::of(clocks, &settings).map_or_else(
                || "Too few frames to name the stage that limits the frame rate.".to_owned(),
                |limit| limit.sentence(),
            ),
        }
    }
}

/// The rate of frames over the sampled ones.
struct Rate {
    hz: f64,
    wall_nanos: f64,
}

impl Rate {
    fn of(clocks: &[StageClock]) -> Option<Rate> {
        let (first, last) = (clocks.first()?, clocks.last()?);
        let wall = last.published_nanos?.checked_sub(first.published_nanos?)? as f64;
        let frames = (last.frame.0 - first.frame.0) as f64;
        (wall > 0.0).then(|| Rate { hz: frames * 1e9 / wall, wall_nanos: wall })
    }
}

/// The line of a participant: role, name, process, works, frames behind, missed, unread outcomes.
fn row(member: &Member, clocks: &[StageClock]) -> [String; 7] {
    let span: Option<fn(&StageClock) -> Span> = match member.role {
        Role::Host => Some(|clock| (clock.begun_nanos, clock.published_nanos)),
        Role::Traffic => Some(|clock| (clock.plan_begun_nanos, clock.plan_delivered_nanos)),
        Role::Render => Some(|clock| (clock.trace_begun_nanos, clock.delivered_nanos)),
        Role::Client => None,
    };
    let works = span.zip(Rate::of(clocks)).map(|(span, rate)| {
        let lengths = clocks.iter().filter_map(|clock| {
            let (from, to) = span(clock);
            to?.checked_sub(from?)
        });
        format!("{:.0} %", 100.0 * lengths.sum::<u64>() as f64 / rate.wall_nanos)
    });
    let ticks = if member.holds_tick { " *" } else { "" };
    [
        member.role.name().to_owned(),
        format!("{}{ticks}", member.name),
        member.pid.to_string(),
        works.unwrap_or_default(),
        member.behind.to_string(),
        member.missed.to_string(),
        member.unread.map(|unread| unread.to_string()).unwrap_or_default(),
    ]
}

/// Returns a view as lines of text.
fn plain(view: &View) -> String {
    let area = Rect::new(0, 0, PLAIN_WIDTH, view.height());
    let mut buffer = Buffer::empty(area);
    view.render(area, &mut buffer);
    view::text_of(&buffer)
}
