//! One trace of all processes, in the JSON format of Chrome's trace events, which ui.perfetto.dev and
//! chrome://tracing open.
//!
//! Format: "Trace Event Format", Google, 2016: complete events (`X`, microseconds), flow events (`s`,
//! `t`, `f`), counters (`C`) and metadata (`M`).

use bus::{Role, StageClock};
use serde_json::{Value, json};

use super::{live::LiveRun, sampler::Member};

/// A point of an arrow: the process and the time.
type Point = (Role, Option<u64>);

/// The track of the renderer's GPU, which is none of a role.
const GPU_TRACK: u32 = 100;

/// A slice of one process.
struct Slice {
    role: Role,
    track: u32,
    name: &'static str,
    begin: Option<u64>,
    end: Option<u64>,
}

/// The slices of a frame.
fn slices(clock: &StageClock, next: Option<&StageClock>) -> [Slice; 12] {
    let slice = |role, name, begin, end| Slice { role, track: role as u32, name, begin, end };
    let on_gpu =
        |name, begin, end| Slice { track: GPU_TRACK, ..slice(Role::Render, name, begin, end) };
    let (read, requested) = (clock.read_nanos, next.and_then(|next| next.requested_nanos));
    [
        slice(Role::Host, "commands", clock.begun_nanos, clock.physics_begun_nanos),
        slice(Role::Host, "physics", clock.physics_begun_nanos, clock.physics_ended_nanos),
        slice(Role::Host, "publish", clock.physics_ended_nanos, clock.published_nanos),
        slice(Role::Host, "await arrivals", clock.published_nanos, clock.closed_nanos),
        slice(Role::Traffic, "plan", clock.plan_begun_nanos, clock.planned_nanos),
        slice(Role::Traffic, "send plan", clock.planned_nanos, clock.plan_delivered_nanos),
        slice(
            Role::Render,
            "measure",
            clock.trace_begun_nanos,
            clock.traced_nanos.or(clock.delivered_nanos),
        ),
        on_gpu("trace", clock.device_begun_nanos, clock.device_traced_nanos),
        on_gpu("copy", clock.device_traced_nanos, clock.device_copied_nanos),
        slice(Role::Render, "send measurements", clock.traced_nanos, clock.delivered_nanos),
        // A measurement of a trailing renderer is read after the next request.
        slice(Role::Client, "await frame", clock.requested_nanos, read.min(requested.or(read))),
        slice(Role::Client, "work", clock.read_nanos, next.and_then(|next| next.requested_nanos)),
    ]
}

/// Returns the trace.
pub(crate) fn chrome_trace(run: &LiveRun) -> String {
    let client = run.members.iter().find(|member| member.holds_tick);
    let client = client.or_else(|| run.members.iter().find(|m| m.role == Role::Client));
    let shown: Vec<&Member> = run
        .members
        .iter()
        .filter(|member| member.role != Role::Client || Some(*member) == client)
        .collect();
    // Threads of one process are tracks of their own, too.
    let track = |role: Role| role as u32;
    let (mut events, mut arrows) = (Vec::new(), Vec::new());
    for member in shown {
        let name = match member.role {
            Role::Client => format!("client {:?} (process {})", member.name, member.pid),
            role => format!("{} (process {})", role.name(), member.pid),
        };
        let (pid, order) = (track(member.role), track(member.role));
        events.push(json!({ "ph": "M", "name": "process_name", "pid": pid, "tid": pid,
            "args": { "name": name } }));
        events.push(json!({ "ph": "M", "name": "process_sort_index", "pid": pid, "tid": pid,
            "args": { "sort_index": order } }));
    }
    if run.clocks.iter().any(|clock| clock.device_begun_nanos.is_some()) {
        events.push(json!({ "ph": "M", "name": "thread_name", "pid": track(Role::Render),
            "tid": GPU_TRACK, "args": { "name": "GPU" } }));
    }
    let origin = run.clocks.iter().filter_map(|clock| clock.requested_nanos.or(clock.begun_nanos));
    let origin = origin.min().unwrap_or(0);
    let micros = |nanos: u64| nanos.saturating_sub(origin) as f64 / 1e3;
    for (index, clock) in run.clocks.iter().enumerate() {
        let frame = clock.frame.0;
        let next = run.clocks.get(index + 1).filter(|next| next.frame == clock.frame.next());
        for Slice { role, track: thread, name, begin, end } in slices(clock, next) {
            let (Some(begin), Some(end)) = (begin, end) else { continue };
            if end < begin {
                continue;
            }
            events.push(json!({ "ph": "X", "name": name, "cat": "stage", "pid": track(role),
                "tid": thread, "ts": micros(begin), "dur": (end - begin) as f64 / 1e3,
                "args": { "frame": frame } }));
        }
        let chains: [(&str, &[Point]); 2] = [
            (
                "plan",
                &[
                    (Role::Host, clock.physics_ended_nanos),
                    (Role::Traffic, clock.plan_begun_nanos),
                    (Role::Host, next.and_then(|next| next.begun_nanos)),
                ],
            ),
            (
                "measurement",
                &[
                    (Role::Client, clock.requested_nanos),
                    (Role::Host, clock.begun_nanos),
                    (Role::Render, clock.trace_begun_nanos),
                    (Role::Client, clock.read_nanos),
                    // In the next frame, which may not be sampled.
                    (Role::Host, next.and(clock.control_applied_nanos)),
                ],
            ),
        ];
        for (name, points) in chains {
            flow(&mut arrows, name, frame, points, &micros, &track);
        }
    }
    // Last: a point at the begin of a slice belongs to it.
    events.append(&mut arrows);
    json!({ "traceEvents": events, "displayTimeUnit": "ms",
        "otherData": { "map": run.map, "omnibus_version": env!("CARGO_PKG_VERSION") } })
    .to_string()
}

/// Adds the arrows of one frame through the slices of processes.
fn flow(
    events: &mut Vec<Value>,
    name: &str,
    frame: u64,
    points: &[Point],
    micros: &impl Fn(u64) -> f64,
    track: &impl Fn(Role) -> u32,
) {
    let known: Vec<(Role, u64)> =
        points.iter().filter_map(|(role, nanos)| Some((*role, (*nanos)?))).collect();
    if known.len() < 2 {
        return;
    }
    for (index, (role, nanos)) in known.iter().enumerate() {
        let phase = match index {
            0 => "s",
            last if last + 1 == known.len() => "f",
            _ => "t",
        };
        // The end of an arrow is bound to the slice around it, as the other points are.
        events.push(json!({ "ph": phase, "bp": "e", "name": name, "cat": "frame",
            "id": frame, "pid": track(*role), "tid": track(*role),
            "ts": micros(*nanos) }));
    }
}
