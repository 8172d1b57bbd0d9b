//! The compute tracer, over Vulkan.
//!
//! One submission measures a batch of sensors: one dispatch for all cameras' pixels, one for all
//! lidars' beams, one that packs tags into bytes. The device writes into its own memory; its copy
//! engine then carries the bytes into the reader's memory, if that can be imported, or into a
//! staging buffer, whence they are copied.

mod batch;
mod import;
mod instance;
mod kernels;
mod open;
mod readback;
mod resident;
#[cfg(test)]
pub(crate) mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use wgpu::{Buffer, CommandEncoderDescriptor, ComputePassDescriptor, PollType, SubmissionIndex};

use crate::outputs::need_cpu;
use crate::{BundleJob, CpuTracer, Scene, TraceError, World};
use batch::{Batch, Window, batches};
use kernels::Kernels;
use open::Gpu;
use readback::Readback;
use resident::{GROUPS_ACROSS, Resident};

/// The most that one submission writes: word offsets are 32 bits wide, and staging is as long.
const BATCH_BYTES_MAX: u64 = 1 << 30;

/// A device that has not answered for so long is lost.
const PATIENCE: Duration = Duration::from_secs(30);

/// Casts rays on a graphics processor.
#[derive(Debug)]
pub struct GpuTracer {
    gpu: Gpu,
    kernels: Kernels,
    resident: Resident,
    readback: Readback,
    /// Payloads as buffers of the device, by address; `None`: nobody allowed to import them.
    imported: Option<BTreeMap<usize, Import>>,
    /// Measures bundles with outputs that the shaders lack, once there is one; on so many threads.
    beside: Option<CpuTracer>,
    threads: usize,
}

/// The same job for a shorter time.
fn again<'a>(job: &'a mut BundleJob<'_>) -> BundleJob<'a> {
    BundleJob { out: &mut *job.out, ..*job }
}

/// What became of the attempt to import one payload.
#[derive(Debug)]
struct Import {
    len: usize,
    /// `None`: the driver refused.
    buffer: Option<Buffer>,
}

/// A batch on its way.
struct Flight {
    submission: SubmissionIndex,
    /// Where the windows that could not be imported arrive.
    staging: Option<(Buffer, Vec<Window>)>,
}

impl GpuTracer {
    /// Opens adapter `number`, or, with `None`, the first that is hardware; `Ok(None)` if there is
    /// none. `threads` of this process (0: one a core) copy what cannot be imported.
    pub fn open(number: Option<usize>, threads: usize) -> Result<Option<GpuTracer>, TraceError> {
        let Some(gpu) = open::open(number, threads)? else { return Ok(None) };
        let kernels = Kernels::new(&gpu.device);
        let resident = Resident::new(&gpu);
        gpu.check()?;
        let readback = Readback::default();
        Ok(Some(GpuTracer {
            gpu,
            kernels,
            resident,
            readback,
            imported: None,
            beside: None,
            threads,
        }))
    }

    /// The adapter's name.
    pub fn adapter(&self) -> &str {
        &self.gpu.name
    }

    /// Whether the driver can write into this process's memory.
    pub fn can_import(&self) -> bool {
        self.gpu.imports
    }

    /// From now on payloads that are whole pages are imported, each once: the device writes into
    /// them, and they are found again by address.
    ///
    /// # Safety
    /// Every `out` that [`crate::Tracer::measure`] is given must stay mapped, at the same physical
    /// pages, until [`GpuTracer::forget_imports`] or the end of this tracer. Samples of a shared
    /// memory pool with static allocation do, as long as their publisher lives.
    #[expect(unsafe_code, reason = "the device writes into memory whose lifetime it cannot see")]
    pub unsafe fn import_payloads(&mut self) {
        self.imported = self.gpu.imports.then(BTreeMap::new);
    }

    /// Lets go of all imported memory, and imports no more until [`GpuTracer::import_payloads`] is
    /// called again. To be called before any of it is unmapped.
    pub fn forget_imports(&mut self) {
        if self.imported.take().is_some() {
            // Buffers live until the device has seen that they are gone.
            let _ = self.gpu.device.poll(PollType::Poll);
        }
    }

    /// How many payloads the device writes into.
    pub fn imported_count(&self) -> usize {
        let imported = self.imported.iter().flat_map(BTreeMap::values);
        imported.filter(|import| import.buffer.is_some()).count()
    }

    pub(crate) fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        if !jobs.iter().any(|job| need_cpu(job.planes)) {
            return self.dispatch(scene, world, jobs);
        }
        let (beside, own): (Vec<_>, Vec<_>) = jobs.iter_mut().partition(|j| need_cpu(j.planes));
        let mut own: Vec<BundleJob> = own.into_iter().map(again).collect();
        self.dispatch(scene, world, &mut own)?;
        let mut beside: Vec<BundleJob> = beside.into_iter().map(again).collect();
        let tracer = match &mut self.beside {
            Some(tracer) => tracer,
            none => none.insert(CpuTracer::new(self.threads)?),
        };
        tracer.measure(scene, world, &mut beside)
    }

    /// Measures what the shaders can give.
    fn dispatch(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        self.gpu.check()?;
        let limits = self.gpu.device.limits();
        let bytes_max = limits.max_storage_buffer_binding_size.min(BATCH_BYTES_MAX) & !255;
        let batches = batches(world, jobs, bytes_max)?;
        self.resident.take_scene(&self.gpu, scene)?;
        let mut flights = VecDeque::new();
        for batch in &batches {
            if flights.len() == 2 {
                self.land(flights.pop_front(), jobs)?;
            }
            flights.push_back(self.launch(scene, world, batch, jobs));
        }
        while !flights.is_empty() {
            self.land(flights.pop_front(), jobs)?;
        }
        self.gpu.check()
    }

    /// Submits a batch.
    fn launch(
        &mut self,
        scene: &Scene,
        world: &World,
        batch: &Batch,
        jobs: &mut [BundleJob],
    ) -> Flight {
        self.resident.take_batch(&self.gpu, scene, world, batch);
        let descriptor = CommandEncoderDescriptor { label: Some("batch") };
        let mut encoder = self.gpu.device.create_command_encoder(&descriptor);
        if self.resident.is_new_plan(batch) {
            encoder.clear_buffer(self.resident.out(), 0, None);
        }
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_bind_group(0, self.resident.group(&self.gpu, &self.kernels), &[]);
            let Kernels { see, draw_over, sweep, pack, .. } = &self.kernels;
            let [cameras, lidars, packing] = batch.groups;
            let drawn = if world.overlay.is_empty() { 0 } else { cameras };
            for (kernel, groups) in
                [(see, cameras), (draw_over, drawn), (sweep, lidars), (pack, packing)]
            {
                if groups > 0 {
                    pass.set_pipeline(kernel);
                    let rows = groups.div_ceil(GROUPS_ACROSS);
                    pass.dispatch_workgroups(groups.min(GROUPS_ACROSS), rows, 1);
                }
            }
        }
        let out = self.resident.out().clone();
        let mut staged = Vec::new();
        for window in &batch.windows {
            let whole = (window.end - window.begin).next_multiple_of(4);
            match self.imported_payload(jobs[window.job].out) {
                Some(payload) if window.begin + whole <= payload.size() => {
                    encoder.copy_buffer_to_buffer(&out, window.base, payload, window.begin, whole);
                }
                _ => staged.push(*window),
            }
        }
        let staging = (!staged.is_empty()).then(|| {
            let buffer = self.readback.slot(&self.gpu, batch.byte_len);
            for window in &staged {
                let whole = (window.end - window.begin).next_multiple_of(8);
                encoder.copy_buffer_to_buffer(&out, window.base, &buffer, window.base, whole);
            }
            (buffer, staged)
        });
        let submission = self.gpu.queue.submit([encoder.finish()]);
        if let Some((buffer, _)) = &staging {
            Readback::map(buffer, batch.byte_len);
        }
        Flight { submission, staging }
    }

    /// Waits for a batch, and brings home what was staged.
    fn land(&mut self, flight: Option<Flight>, jobs: &mut [BundleJob]) -> Result<(), TraceError> {
        let Some(flight) = flight else { return Ok(()) };
        let wait =
            PollType::Wait { submission_index: Some(flight.submission), timeout: Some(PATIENCE) };
        self.gpu.device.poll(wait).map_err(|why| self.gpu.error(why.to_string()))?;
        self.gpu.check()?;
        if let Some((buffer, windows)) = flight.staging {
            Readback::deliver(&self.gpu, &buffer, &windows, jobs)?;
        }
        Ok(())
    }

    /// The payload as a buffer of the device, if it may be and can be one.
    fn imported_payload(&mut self, out: &mut [u8]) -> Option<&Buffer> {
        let imported = self.imported.as_mut()?;
        let len = out.len() - out.len() % import::ALIGNMENT;
        if !out.as_ptr().addr().is_multiple_of(import::ALIGNMENT) || len == 0 {
            return None;
        }
        let known = imported.get(&out.as_ptr().addr()).is_some_and(|known| known.len >= len);
        if !known {
            #[expect(unsafe_code, reason = "import_payloads' caller has promised what it takes")]
            // SAFETY: the caller of `import_payloads` promised that payloads stay mapped.
            let buffer = unsafe { import::import(&self.gpu, out.as_mut_ptr(), len) }.ok();
            imported.insert(out.as_ptr().addr(), Import { len, buffer });
        }
        imported.get(&out.as_ptr().addr())?.buffer.as_ref()
    }
}
