//! The parts of a frame, as differences of the instants of the stage clock.

use bus::StageClock;

/// Begin and end of a part; `None` if it did not take place.
pub(crate) type Span = (Option<u64>, Option<u64>);

/// A part of a frame.
pub(crate) struct Part {
    /// The name in results.
    pub(crate) name: &'static str,
    /// Begin and end, from the clock of the frame and the one of the next.
    pub(crate) span: fn(&StageClock, &StageClock) -> Span,
}

/// The parts, in the order of a synchronous frame.
pub(crate) const PARTS: &[Part] = &[
    Part { name: "frame", span: |a, b| (a.published_nanos, b.published_nanos) },
    Part { name: "host wakes", span: |a, _| (a.requested_nanos, a.begun_nanos) },
    Part { name: "commands", span: |a, _| (a.begun_nanos, a.physics_begun_nanos) },
    Part { name: "physics", span: |a, _| (a.physics_begun_nanos, a.physics_ended_nanos) },
    Part { name: "publishing", span: |a, _| (a.physics_ended_nanos, a.published_nanos) },
    Part { name: "traffic wakes", span: |a, _| (a.published_nanos, a.plan_begun_nanos) },
    Part { name: "traffic plans", span: |a, _| (a.plan_begun_nanos, a.planned_nanos) },
    Part { name: "traffic sends", span: |a, _| (a.planned_nanos, a.plan_delivered_nanos) },
    Part { name: "renderer wakes", span: |a, _| (a.published_nanos, a.trace_begun_nanos) },
    Part { name: "renderer traces", span: |a, _| (a.trace_begun_nanos, a.traced_nanos) },
    Part { name: "GPU traces", span: |a, _| (a.device_begun_nanos, a.device_traced_nanos) },
    Part { name: "GPU copies", span: |a, _| (a.device_traced_nanos, a.device_copied_nanos) },
    Part { name: "renderer sends", span: |a, _| (a.traced_nanos, a.delivered_nanos) },
    Part { name: "client wakes", span: |a, _| (arrived(a), a.read_nanos) },
    Part { name: "client works", span: |a, b| (a.read_nanos, b.requested_nanos) },
    Part { name: "snapshot to control", span: |a, _| (a.published_nanos, a.control_applied_nanos) },
];

/// When the last stage arrived.
pub(crate) fn arrived(clock: &StageClock) -> Option<u64> {
    clock.plan_delivered_nanos.max(clock.delivered_nanos)
}

/// The lengths of one part, in nanoseconds, of the frames that have it.
pub(crate) fn lengths(part: &Part, clocks: &[StageClock]) -> Vec<u64> {
    let frames = clocks.windows(2).filter(|pair| pair[0].frame.next() == pair[1].frame);
    let spans = frames.map(|pair| (part.span)(&pair[0], &pair[1]));
    // The parts of trailing stages may overlap: what is not after the other is not one.
    spans.filter_map(|(begin, end)| end?.checked_sub(begin?)).collect()
}
