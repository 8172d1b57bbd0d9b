use wgpu::{Buffer, BufferDescriptor, BufferUsages, MapMode};

use super::batch::Window;
use super::open::Gpu;
use crate::{error::TraceError, job::BundleJob};

/// Number of staging buffers, one more than batches in flight.
const SLOTS: usize = 3;

/// Bytes per parallel copy.
const CHUNK: usize = 1 << 20;

/// Ring of mapped staging buffers for payloads that cannot be imported. The device fills a buffer,
/// then the CPU reads it.
#[derive(Debug, Default)]
pub(crate) struct Readback {
    slots: Vec<Option<Buffer>>,
    next: usize,
}

impl Readback {
    /// Returns a buffer of at least `byte_len` bytes that is not in use, provided that at most two
    /// batches are in flight.
    pub(crate) fn slot(&mut self, gpu: &Gpu, byte_len: u64) -> Buffer {
        self.slots.resize_with(SLOTS, || None);
        self.next = (self.next + 1) % SLOTS;
        let slot = &mut self.slots[self.next];
        match slot {
            Some(buffer) if buffer.size() >= byte_len => buffer.clone(),
            _ => slot
                .insert(gpu.device.create_buffer(&BufferDescriptor {
                    label: Some("readback"),
                    size: byte_len.next_multiple_of(1 << 16),
                    usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                }))
                .clone(),
        }
    }

    /// Requests the mapping of the first `byte_len` bytes; the next poll executes it.
    pub(crate) fn map(buffer: &Buffer, byte_len: u64) {
        // An error shows when the mapped range is requested.
        buffer.map_async(MapMode::Read, 0..byte_len, |_| ());
    }

    /// Copies each window from the mapped buffer to its payload.
    pub(crate) fn deliver(
        gpu: &Gpu,
        buffer: &Buffer,
        windows: &[Window],
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        for window in windows {
            let len = window.end - window.begin;
            let range = window.base..window.base + len.next_multiple_of(8);
            let view = buffer.get_mapped_range(range).map_err(|why| gpu.error(why.to_string()))?;
            let out = &mut jobs[window.job].out[window.begin as usize..window.end as usize];
            gpu.workers.run(|| {
                use rayon::prelude::*;
                out.par_chunks_mut(CHUNK)
                    .zip(view[..len as usize].par_chunks(CHUNK))
                    .for_each(|(out, seen)| out.copy_from_slice(seen));
            });
        }
        buffer.unmap();
        Ok(())
    }
}
