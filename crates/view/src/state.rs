//! The world at one frame, as a page shows it.

use client_lib::{
    Actor, ActorFlags, ActorId, ActorKind, Client, Frame, LightPhase, Pace, Pose, StageClock,
};
use serde::Serialize;

use crate::{
    ahead::lanes_ahead,
    data_set::{StoredActor, StoredFrame},
    message::Sky,
};

/// Frames back from the newest that are looked through: fewer than the stage clock keeps.
const LOOK_BACK: u64 = 48;

/// A state: everything of a frame but images and points.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "state")]
pub(crate) struct State<'a> {
    frame: u64,
    sim_time_s: f64,
    /// `synchronous`, `real_time` or `unpaced`.
    pace: &'static str,
    /// Simulated time of a tick.
    delta_s: f64,
    /// The client that holds the tick.
    holder: Option<String>,
    /// Whether that is this page.
    holds_tick: bool,
    /// Whether time passes by this page's ticks, or by the player of a recording.
    plays: bool,
    /// Which part of a recording is shown.
    playback: Option<Playback>,
    ego: Option<u32>,
    weather: Option<Sky>,
    actors: Vec<ActorLine>,
    /// Half of length and width of each actor of a data set, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    extents_m: Option<Vec<[f32; 2]>>,
    selected: Option<Details<'a>>,
    timeline: Option<Timeline>,
    /// The lanes ahead of the vehicle that is selected, or else of the page's own.
    ahead_m: Vec<Vec<[f32; 2]>>,
}

/// Which part of something that has a length is shown.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Playback {
    /// What is shown now, and the last that can be.
    pub(crate) at: f64,
    pub(crate) last: f64,
    /// From one frame to the next.
    pub(crate) step: f64,
    /// `s` or `frame`.
    pub(crate) unit: &'static str,
}

/// What a page knows beside the world.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Own {
    pub(crate) ego: Option<ActorId>,
    pub(crate) selected: Option<ActorId>,
    pub(crate) weather: Option<Sky>,
    pub(crate) plays: bool,
    pub(crate) playback: Option<Playback>,
}

/// Id, kind, index of the blueprint, x, y, z, yaw, speed, and the phase of a traffic light or
/// whether traffic drives.
type ActorLine = (u32, u8, usize, f32, f32, f32, f32, f32, u8);

/// The actor that is selected.
#[derive(Debug, Serialize)]
struct Details<'a> {
    id: u32,
    kind: &'static str,
    blueprint: &'a str,
    position_m: [f32; 3],
    yaw_rad: f32,
    velocity_mps: [f32; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration_mps2: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    angular_velocity_radps: Option<[f32; 3]>,
    /// The names of its states, as `AUTOPILOT`.
    flags: Vec<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vehicle: Option<Driving>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<&'static str>,
}

#[derive(Debug, Serialize)]
struct Driving {
    throttle: f32,
    brake: f32,
    /// −1 (full right) to 1 (full left).
    steer: f32,
    gear: i32,
    engine_rpm: f32,
    lights: u32,
    doors: u32,
}

/// When the parts of a complete frame took place, in milliseconds since its first instant.
#[derive(Debug, Serialize)]
pub(crate) struct Timeline {
    pub(crate) frame: u64,
    /// Stage, part, begin, end.
    pub(crate) parts: Vec<(&'static str, &'static str, f64, f64)>,
}

impl<'a> State<'a> {
    pub(crate) fn new(client: &'a Client, own: &Own) -> State<'a> {
        let (world, settings) = (client.world(), client.settings());
        State {
            frame: world.frame().0,
            sim_time_s: world.sim_time().as_secs_f64(),
            pace: match settings.pace {
                Pace::Synchronous => "synchronous",
                Pace::RealTime(_) => "real_time",
                Pace::Unpaced => "unpaced",
            },
            delta_s: settings.delta.as_secs_f64(),
            holder: holder(client),
            holds_tick: client.holds_tick(),
            plays: own.plays,
            playback: own.playback,
            ego: own.ego.map(|ego| ego.0),
            weather: own.weather,
            actors: world.actors().iter().map(line).collect(),
            extents_m: None,
            selected: own.selected.and_then(|id| Some(details(client, world.actor(id)?))),
            timeline: timeline(client, world.frame()),
            ahead_m: ahead(client, own),
        }
    }
}

impl<'a> State<'a> {
    /// Returns a frame of a data set.
    pub(crate) fn of_stored(
        frame: &'a StoredFrame,
        selected: Option<u32>,
        plays: bool,
        playback: Playback,
    ) -> State<'a> {
        let selected = frame.actors.iter().find(|actor| Some(actor.id) == selected);
        State {
            frame: frame.frame,
            sim_time_s: frame.sim_time.as_secs_f64(),
            pace: "synchronous",
            delta_s: 0.0,
            holder: None,
            holds_tick: false,
            plays,
            playback: Some(playback),
            ego: Some(frame.ego),
            weather: Some(frame.weather.into()),
            actors: frame.actors.iter().map(line_of_stored).collect(),
            extents_m: Some(frame.actors.iter().map(|actor| actor.half_extents_m).collect()),
            selected: selected.map(details_of_stored),
            timeline: None,
            ahead_m: Vec::new(),
        }
    }
}

fn ahead(client: &Client, own: &Own) -> Vec<Vec<[f32; 2]>> {
    let vehicle = |id| client.world().actor(id).filter(|a| a.kind() == ActorKind::Vehicle);
    let shown = own.selected.and_then(vehicle).or_else(|| own.ego.and_then(vehicle));
    match (shown, client.map()) {
        (Some(shown), Ok(map)) => lanes_ahead(&map, shown.position()),
        _ => Vec::new(),
    }
}

/// Returns the name of the client that holds the tick.
fn holder(client: &Client) -> Option<String> {
    let control = client.instance().control().ok()?;
    control.ticker().map(|slot| control.slot(slot).name().to_string())
}

fn yaw_rad(pose: &Pose) -> f32 {
    let ahead = pose.rotation() * client_lib::glam::Vec3::X;
    ahead.y.atan2(ahead.x)
}

fn line(actor: &Actor) -> ActorLine {
    let is_driven = actor.flags().contains(ActorFlags::AUTOPILOT);
    let state = state_of(actor.kind(), is_driven, actor.traffic_light().map(|light| light.phase));
    let (id, place, speed) = (actor.id().0, actor.pose(), actor.speed_mps());
    rounded(id, actor.kind(), actor.blueprint(), &place, speed, state)
}

fn line_of_stored(actor: &StoredActor) -> ActorLine {
    let speed = client_lib::glam::Vec3::from_array(actor.velocity_mps).length();
    let state = state_of(actor.kind, false, actor.phase);
    rounded(actor.id, actor.kind, 0, &actor.pose, speed, state)
}

fn state_of(kind: ActorKind, is_driven: bool, phase: Option<LightPhase>) -> u8 {
    match kind {
        ActorKind::Vehicle => is_driven.into(),
        _ => phase.map_or(0, |phase| phase as u8),
    }
}

fn rounded(
    id: u32,
    kind: ActorKind,
    blueprint: usize,
    pose: &Pose,
    speed_mps: f32,
    state: u8,
) -> ActorLine {
    let kind = match kind {
        ActorKind::Vehicle => 1,
        ActorKind::Walker => 2,
        ActorKind::TrafficLight => 3,
        _ => 4,
    };
    // A centimetre and a thousandth of a radian are less than a page shows.
    let cut = |number: f32, unit: f32| (number * unit).round() / unit;
    let yaw = cut(yaw_rad(pose), 1000.0);
    let [x, y, z] = pose.position_m.map(|number| cut(number, 100.0));
    (id, kind, blueprint, x, y, z, yaw, cut(speed_mps, 100.0), state)
}

fn details<'a>(client: &'a Client, actor: &Actor) -> Details<'a> {
    let blueprint = client.blueprints().get(actor.blueprint());
    Details {
        id: actor.id().0,
        kind: name_of(actor.kind()),
        blueprint: blueprint.map_or("", |blueprint| &blueprint.id),
        position_m: actor.position().to_array(),
        yaw_rad: yaw_rad(&actor.pose()),
        velocity_mps: actor.velocity().to_array(),
        acceleration_mps2: Some(actor.acceleration().to_array()),
        angular_velocity_radps: Some(actor.angular_velocity().to_array()),
        flags: actor.flags().iter_names().map(|(name, _)| name).collect(),
        vehicle: actor.vehicle().map(|state| Driving {
            throttle: state.throttle,
            brake: state.brake,
            steer: state.steer,
            gear: state.gear,
            engine_rpm: state.engine_rpm,
            lights: state.lights.bits(),
            doors: state.doors.bits(),
        }),
        phase: actor.traffic_light().map(|light| name_of_phase(light.phase)),
    }
}

fn details_of_stored(actor: &StoredActor) -> Details<'_> {
    Details {
        id: actor.id,
        kind: name_of(actor.kind),
        blueprint: &actor.blueprint,
        position_m: actor.pose.position_m,
        yaw_rad: yaw_rad(&actor.pose),
        velocity_mps: actor.velocity_mps,
        acceleration_mps2: None,
        angular_velocity_radps: None,
        flags: Vec::new(),
        vehicle: None,
        phase: actor.phase.map(name_of_phase),
    }
}

fn name_of(kind: ActorKind) -> &'static str {
    match kind {
        ActorKind::Vehicle => "vehicle",
        ActorKind::Walker => "walker",
        ActorKind::TrafficLight => "traffic light",
        _ => "prop",
    }
}

fn name_of_phase(phase: LightPhase) -> &'static str {
    match phase {
        LightPhase::Red => "red",
        LightPhase::Yellow => "yellow",
        LightPhase::Green => "green",
        LightPhase::Off => "off",
    }
}

/// Returns the timeline of the newest frame that was rendered, or of the newest that is complete if
/// none was: an asynchronous world completes frames before they are rendered, and skips some.
pub(crate) fn timeline(client: &Client, newest: Frame) -> Option<Timeline> {
    let frames = (0..LOOK_BACK).map_while(|age| newest.0.checked_sub(age));
    let clocks: Vec<_> = frames.map(|frame| client.stage_clock(Frame(frame))).collect();
    let rendered = clocks.iter().find(|clock| clock.delivered_nanos.is_some());
    parts(rendered.or_else(|| clocks.iter().find(|clock| clock.closed_nanos.is_some()))?)
}

fn parts(clock: &StageClock) -> Option<Timeline> {
    let first = clock.requested_nanos.or(clock.begun_nanos)?;
    let spans = [
        ("host", "wakes", clock.requested_nanos, clock.begun_nanos),
        ("host", "commands", clock.begun_nanos, clock.physics_begun_nanos),
        ("host", "physics", clock.physics_begun_nanos, clock.physics_ended_nanos),
        ("host", "publishing", clock.physics_ended_nanos, clock.published_nanos),
        ("traffic", "wakes", clock.published_nanos, clock.plan_begun_nanos),
        ("traffic", "plans", clock.plan_begun_nanos, clock.planned_nanos),
        ("traffic", "sends", clock.planned_nanos, clock.plan_delivered_nanos),
        ("renderer", "wakes", clock.published_nanos, clock.trace_begun_nanos),
        ("renderer", "traces", clock.trace_begun_nanos, clock.traced_nanos),
        ("renderer", "sends", clock.traced_nanos, clock.delivered_nanos),
        ("GPU", "traces", clock.device_begun_nanos, clock.device_traced_nanos),
        ("GPU", "copies", clock.device_traced_nanos, clock.device_copied_nanos),
        ("viewer", "reads", clock.published_nanos, clock.read_nanos),
    ];
    let millis = |nanos: u64| Some(nanos.checked_sub(first)? as f64 / 1e6);
    let parts = spans.into_iter().filter_map(|(stage, part, begin, end)| {
        let (begin, end) = (millis(begin?)?, millis(end?)?);
        (begin <= end).then_some((stage, part, begin, end))
    });
    Some(Timeline { frame: clock.frame.0, parts: parts.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_that_did_not_take_place_is_not_in_the_timeline() {
        let mut clock = StageClock::at(Frame(7));
        clock.begun_nanos = Some(1_000_000);
        clock.physics_begun_nanos = Some(2_000_000);
        clock.physics_ended_nanos = Some(4_500_000);
        // Of an older frame: the renderer trails.
        clock.trace_begun_nanos = Some(500_000);
        clock.traced_nanos = Some(900_000);
        let timeline = parts(&clock).unwrap();
        assert_eq!(timeline.frame, 7);
        assert_eq!(timeline.parts, [("host", "commands", 0.0, 1.0), ("host", "physics", 1.0, 3.5)]);
        assert!(parts(&StageClock::at(Frame(7))).is_none());
    }
}
