//! The stage clock: when the parts of the last frames began and ended, beside the barrier's words.
//!
//! Each process stores its own instants, so that a reader needs no message and no permission of
//! another process. An instant is a pair of words, the frame and the time; the frame is invalid
//! while the time is replaced.
//!
//! The words decide nothing. They are therefore plain atomics, also where the other words of the
//! page are those of a model checker or of a scheduler of tests.

use std::sync::atomic::{AtomicU64, Ordering, fence};

use protocol::Frame;

/// Number of frames that the stage clock keeps; the instants of older frames are overwritten.
pub const CLOCK_FRAMES: usize = 64;

/// An instant that the host stores for each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostInstant {
    /// The frame began.
    Begun,
    /// Commands and controls were applied; physics began.
    PhysicsBegun,
    /// Physics ended.
    PhysicsEnded,
    /// The frame was published: every other process may see it from now on.
    Published,
    /// The frame was complete.
    Closed,
    /// The controls that clients sent on this frame were applied, in a later one.
    ControlApplied,
}

/// An instant of the device that traces for the renderer, which the renderer stores for each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceInstant {
    /// The device began to cast rays.
    Begun,
    /// The device had cast all rays.
    Traced,
    /// The device had copied the results to where the renderer reads them.
    Copied,
}

/// An instant that a stage or a client stores for each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotInstant {
    /// A client requested the frame.
    Requested,
    /// A stage began its work.
    Begun,
    /// A stage has its result: traffic has planned, the renderer has measured.
    Worked,
    /// The holder of the slot arrived: what it sends for the frame is sent.
    Arrived,
    /// A client took in the snapshot of the frame, or a measurement if that was later.
    Read,
    /// A client sent controls after it had seen this frame and no later one.
    ControlSent,
}

/// The instants of one kind.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Ring([[AtomicU64; 2]; CLOCK_FRAMES]);

impl Ring {
    /// Stores the instant of a frame. One process at a time writes.
    pub(crate) fn store(&self, frame: Frame, nanos: u64) {
        let [at, time] = &self.0[frame.0 as usize % CLOCK_FRAMES];
        at.store(0, Ordering::Relaxed);
        // A reader that finds the new time does not find the old frame.
        fence(Ordering::Release);
        time.store(nanos, Ordering::Relaxed);
        at.store(frame.0 + 1, Ordering::Release);
    }

    /// Returns the instant of a frame, unless it was not stored or is overwritten.
    pub(crate) fn load(&self, frame: Frame) -> Option<u64> {
        let [at, time] = &self.0[frame.0 as usize % CLOCK_FRAMES];
        if at.load(Ordering::Acquire) != frame.0 + 1 {
            return None;
        }
        let nanos = time.load(Ordering::Relaxed);
        fence(Ordering::Acquire);
        (at.load(Ordering::Relaxed) == frame.0 + 1).then_some(nanos)
    }
}

/// The instants of all processes.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Clocks<const SLOTS: usize> {
    host: [Ring; 6],
    device: [Ring; 3],
    slots: [[Ring; 6]; SLOTS],
}

impl<const SLOTS: usize> Clocks<SLOTS> {
    pub(crate) fn of_host(&self, instant: HostInstant) -> &Ring {
        &self.host[instant as usize]
    }

    pub(crate) fn of_device(&self, instant: DeviceInstant) -> &Ring {
        &self.device[instant as usize]
    }

    pub(crate) fn of_slot(&self, slot: usize, instant: SlotInstant) -> &Ring {
        &self.slots[slot][instant as usize]
    }
}

/// When the parts of one frame began and ended, in nanoseconds of the monotonic clock, which all
/// processes of a machine share. `None`: the part did not take place, is not over yet, or is too
/// long ago ([`CLOCK_FRAMES`]).
///
/// In synchronous mode without pipelining the instants of the fields are in rising order, but for
/// those of traffic (`plan_*`, `planned_nanos`), which works beside the renderer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StageClock {
    /// The frame.
    pub frame: Frame,
    /// The client requested the frame. In asynchronous mode there are no requests.
    pub requested_nanos: Option<u64>,
    /// The host began the frame.
    pub begun_nanos: Option<u64>,
    /// Commands and controls were applied; physics began.
    pub physics_begun_nanos: Option<u64>,
    /// Physics ended.
    pub physics_ended_nanos: Option<u64>,
    /// The frame was published: journal, snapshot and measurements of physics sensors are sent.
    pub published_nanos: Option<u64>,
    /// Traffic began to plan.
    pub plan_begun_nanos: Option<u64>,
    /// Traffic had planned.
    pub planned_nanos: Option<u64>,
    /// The plan was sent to the host.
    pub plan_delivered_nanos: Option<u64>,
    /// The renderer began with the frame.
    pub trace_begun_nanos: Option<u64>,
    /// A GPU began to cast rays. `None` without a GPU that has timestamps. The times of a GPU are
    /// moved so that the last of them is when the renderer noticed the end of its work: they are
    /// late by the time that the notice took.
    pub device_begun_nanos: Option<u64>,
    /// The GPU had cast all rays.
    pub device_traced_nanos: Option<u64>,
    /// The GPU had copied the results to where the renderer reads them.
    pub device_copied_nanos: Option<u64>,
    /// The renderer had measured every sensor that was due. `None` if none was.
    pub traced_nanos: Option<u64>,
    /// Every measurement was where clients read it.
    pub delivered_nanos: Option<u64>,
    /// The client took in the snapshot, or a measurement of this frame if that was later.
    pub read_nanos: Option<u64>,
    /// The client sent controls after it had seen this frame and no later one.
    pub control_sent_nanos: Option<u64>,
    /// The host had applied all controls that clients sent on this frame. They act in a later frame.
    pub control_applied_nanos: Option<u64>,
    /// The host had noticed that every participant had arrived, and completed the frame. A client
    /// that spins may notice it earlier.
    pub closed_nanos: Option<u64>,
}

impl StageClock {
    /// A frame without an instant.
    #[must_use]
    pub fn at(frame: Frame) -> StageClock {
        StageClock { frame, ..StageClock::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instant_is_found_until_its_place_is_used_again() {
        let ring = Ring(std::array::from_fn(|_| Default::default()));
        assert_eq!(ring.load(Frame(0)), None, "an empty ring knows frame 0");
        ring.store(Frame(0), 7);
        ring.store(Frame(63), 70);
        assert_eq!((ring.load(Frame(0)), ring.load(Frame(63))), (Some(7), Some(70)));
        ring.store(Frame(CLOCK_FRAMES as u64), 9);
        assert_eq!((ring.load(Frame(0)), ring.load(Frame(64))), (None, Some(9)));
    }
}
