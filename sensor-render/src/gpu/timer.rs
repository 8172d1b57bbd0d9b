use bus::clock;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, ComputePassTimestampWrites, Device,
    Features, MapMode, QuerySet, QuerySetDescriptor, QueryType, Queue,
};

/// Timestamps of one batch: before the rays, behind them, and behind the copies of their results.
const STAMPS: u32 = 3;
const BYTES: u64 = STAMPS as u64 * 8;

/// Number of batches whose timestamps are kept, one more than batches in flight.
const SLOTS: usize = 3;

/// When the device worked on a frame, in nanoseconds of the monotonic clock.
///
/// A device has a clock of its own, whose offset is unknown. The last timestamp is therefore taken
/// for the time at which this process noticed the end of the work: intervals are those of the
/// device, and all of them lie later than they were by the time that the notice took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceTimes {
    /// The device began to cast rays.
    pub begun_nanos: u64,
    /// It had cast all rays.
    pub traced_nanos: u64,
    /// It had copied the results to where this process reads them.
    pub copied_nanos: u64,
}

/// Measures when the device works. The timestamps of a frame are those of its first batch for the
/// begin, and of its last batch for the rest.
#[derive(Debug)]
pub(crate) struct Timer {
    slots: Vec<Slot>,
    next: usize,
    nanos_per_tick: f64,
    /// The first timestamp of the frame, in ticks of the device.
    begun: Option<u64>,
    times: Option<DeviceTimes>,
}

#[derive(Debug)]
struct Slot {
    queries: QuerySet,
    resolved: Buffer,
    read: Buffer,
}

impl Timer {
    /// Returns `None` if the device has no timestamps between commands.
    pub(crate) fn new(device: &Device, queue: &Queue) -> Option<Timer> {
        let needed = Features::TIMESTAMP_QUERY | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        if !device.features().contains(needed) {
            return None;
        }
        let slot = |_| Slot {
            queries: device.create_query_set(&QuerySetDescriptor {
                label: Some("timestamps"),
                ty: QueryType::Timestamp,
                count: STAMPS,
            }),
            resolved: buffer(device, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            read: buffer(device, BufferUsages::MAP_READ | BufferUsages::COPY_DST),
        };
        Some(Timer {
            slots: (0..SLOTS).map(slot).collect(),
            next: 0,
            nanos_per_tick: queue.get_timestamp_period().into(),
            begun: None,
            times: None,
        })
    }

    /// Begins a frame.
    pub(crate) fn begin_frame(&mut self) {
        (self.begun, self.times) = (None, None);
    }

    /// Returns the slot of the next batch, and the timestamps of its compute pass.
    pub(crate) fn begin_batch(&mut self) -> (usize, ComputePassTimestampWrites<'_>) {
        self.next = (self.next + 1) % SLOTS;
        let writes = ComputePassTimestampWrites {
            query_set: &self.slots[self.next].queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        };
        (self.next, writes)
    }

    /// Writes the last timestamp of a batch, and reads all of them back.
    pub(crate) fn end_batch(&self, slot: usize, encoder: &mut CommandEncoder) {
        let Slot { queries, resolved, read } = &self.slots[slot];
        encoder.write_timestamp(queries, STAMPS - 1);
        encoder.resolve_query_set(queries, 0..STAMPS, resolved, 0);
        encoder.copy_buffer_to_buffer(resolved, 0, read, 0, BYTES);
    }

    /// Requests the mapping of a submitted batch's timestamps; the next poll executes it.
    pub(crate) fn map(&self, slot: usize) {
        // An error shows when the mapped range is requested.
        self.slots[slot].read.map_async(MapMode::Read, .., |_| ());
    }

    /// Takes in the timestamps of a batch that has just ended.
    pub(crate) fn finish_batch(&mut self, slot: usize) {
        let now = clock::now_nanos();
        let read = &self.slots[slot].read;
        let Ok(view) = read.get_mapped_range(..) else { return };
        let ticks: [u64; STAMPS as usize] = bytemuck::pod_read_unaligned(&view);
        drop(view);
        read.unmap();
        let begun = *self.begun.get_or_insert(ticks[0]);
        self.times = device_times([begun, ticks[1], ticks[2]], self.nanos_per_tick, now);
    }

    /// Returns the times of the frame.
    pub(crate) fn times(&self) -> Option<DeviceTimes> {
        self.times
    }
}

fn buffer(device: &Device, usage: BufferUsages) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("timestamps"),
        size: BYTES,
        usage,
        mapped_at_creation: false,
    })
}

/// Converts timestamps of the device, of which the last one is `now`. `None` if they do not rise,
/// as on software devices that do not measure compute passes.
fn device_times(ticks: [u64; 3], nanos_per_tick: f64, now: u64) -> Option<DeviceTimes> {
    let [begun, traced, copied] = ticks;
    let is_rising = begun < traced && traced <= copied;
    let before = |ticks: u64| now.checked_sub(((copied - ticks) as f64 * nanos_per_tick) as u64);
    is_rising.then_some(())?;
    Some(DeviceTimes {
        begun_nanos: before(begun)?,
        traced_nanos: before(traced)?,
        copied_nanos: now,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_timestamp_is_the_notice_of_the_end_and_the_others_lie_before_it() {
        let times = device_times([1000, 1600, 1700], 2.5, 1_000_000);
        let expected =
            DeviceTimes { begun_nanos: 998_250, traced_nanos: 999_750, copied_nanos: 1_000_000 };
        assert_eq!(times, Some(expected));
    }

    #[test]
    fn timestamps_that_do_not_rise_are_no_times() {
        for ticks in [[0, 0, 0], [5, 5, 9], [7, 6, 9], [5, 7, 6]] {
            assert_eq!(device_times(ticks, 1.0, 100), None, "{ticks:?}");
        }
        assert_eq!(device_times([0, 500, 1000], 1.0, 100), None, "before the clock began");
    }
}
