//! GPU tracer: compute shaders over Vulkan.
//!
//! One submission measures a batch of sensors: one dispatch for the pixels of all cameras, three
//! that develop the films of those with effects, one for debug shapes, one for the beams of all
//! lidars, and one that packs tags into bytes. The shaders write cameras into payloads in subscribers'
//! memory that can be imported. Lidars, and cameras of other payloads, are written into the device's own memory,
//! and its copy engine copies the bytes into the subscribers' memory, or into a staging buffer from which the
//! CPU copies them.

mod batch;
mod bounds;
mod import;
mod instance;
mod kernels;
mod open;
mod payloads;
mod readback;
mod resources;
#[cfg(test)]
pub(crate) mod tests;
mod timer;
mod top_levels;
mod waiter;

use std::collections::VecDeque;

use wgpu::{
    Buffer, CommandEncoderDescriptor, ComputePass, ComputePassDescriptor, ComputePipeline,
    SubmissionIndex,
};

use crate::{error::TraceError, job::BundleJob, scene::Scene, world::World};
use batch::{Batch, CAMERA_KINDS, Window, batches};
use kernels::{CameraKernel, Kernels};
use open::Gpu;
use payloads::Payloads;
use readback::Readback;
use resources::{GROUPS_ACROSS, GpuResources};
pub use timer::DeviceTimes;
use timer::Timer;
use waiter::Waiter;

/// Maximum output of one submission in bytes: word offsets have 32 bits, and the staging buffer has
/// the same length.
const BATCH_BYTES_MAX: u64 = 1 << 30;

/// Tracer on a GPU.
#[derive(Debug)]
pub struct GpuTracer {
    gpu: Gpu,
    kernels: Kernels,
    resources: GpuResources,
    readback: Readback,
    /// `None` if the device has no timestamps.
    timer: Option<Timer>,
    waiter: Waiter,
    payloads: Payloads,
    /// Batch of the last frame, for its memory: fresh pages cost as much as what is written to them.
    spare: Batch,
}

/// Runs a kernel, if there is one, in rows of workgroups.
fn run_kernel(pass: &mut ComputePass, kernel: Option<&ComputePipeline>, groups: u32) {
    if groups > 0
        && let Some(kernel) = kernel
    {
        pass.set_pipeline(kernel);
        let rows = groups.div_ceil(GROUPS_ACROSS);
        pass.dispatch_workgroups(groups.min(GROUPS_ACROSS), rows, 1);
    }
}

/// Submitted batch.
struct InFlight {
    submission: SubmissionIndex,
    /// The slot of its timestamps.
    timed: Option<usize>,
    /// Staging buffer, and the windows that are copied from it.
    staging: Option<(Buffer, Vec<Window>)>,
}

impl GpuTracer {
    /// Opens adapter `number`, or, with `None`, the first hardware adapter. Returns `Ok(None)` if
    /// there is no such adapter. `threads` CPU threads (0 means one per core) copy payloads that
    /// cannot be imported.
    ///
    /// # Errors
    /// [`TraceError`] if the adapter does not exist or cannot be opened.
    pub fn open(number: Option<usize>, threads: usize) -> Result<Option<GpuTracer>, TraceError> {
        let Some(gpu) = open::open(number, threads)? else { return Ok(None) };
        let kernels = Kernels::new(&gpu.device);
        let resources = GpuResources::new(&gpu);
        gpu.check()?;
        let readback = Readback::default();
        let timer = Timer::new(&gpu.device, &gpu.queue);
        let waiter = Waiter::default();
        let (payloads, spare) = (Payloads::new(&gpu.device), Batch::default());
        Ok(Some(GpuTracer { gpu, kernels, resources, readback, timer, waiter, payloads, spare }))
    }

    /// Returns the name of the adapter.
    pub fn adapter(&self) -> &str {
        &self.gpu.name
    }

    /// Returns when the device worked on the last frame; `None` if it measured nothing, or has no
    /// timestamps.
    pub fn device_times(&self) -> Option<DeviceTimes> {
        self.timer.as_ref()?.times()
    }

    /// Returns whether the driver can import memory of this process.
    pub fn can_import(&self) -> bool {
        self.gpu.imports
    }

    /// Allows imports: payloads that are whole pages are imported once each and found again by
    /// address, and the device writes into them.
    ///
    /// # Safety
    /// Every `out` that is passed to [`crate::Tracer::measure`] must stay mapped, at the same
    /// physical pages, until [`GpuTracer::forget_imports`] is called or this tracer is dropped.
    /// Samples of a shared-memory pool with static allocation do, as long as their publisher lives.
    #[expect(unsafe_code, reason = "the device writes into memory whose lifetime it cannot see")]
    pub unsafe fn import_payloads(&mut self) {
        if self.gpu.imports {
            self.payloads.allow_imports();
        }
    }

    /// Releases all imported memory, and allows no more imports until
    /// [`GpuTracer::import_payloads`] is called again. Call it before any imported memory is
    /// unmapped.
    pub fn forget_imports(&mut self) {
        self.payloads.forget_imports(&self.gpu.device);
    }

    /// Returns the number of imported payloads.
    pub fn imported_count(&self) -> usize {
        self.payloads.imported_count()
    }

    /// Measures as [`crate::Tracer::measure`].
    pub(crate) fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        self.gpu.check()?;
        let limits = self.gpu.device.limits();
        let bytes_max = limits.max_storage_buffer_binding_size.min(BATCH_BYTES_MAX) & !255;
        let target = |job: &mut BundleJob| self.payloads.target(&self.gpu.device, job.out);
        let targets: Vec<_> = jobs.iter_mut().map(target).collect();
        let spare = std::mem::take(&mut self.spare);
        let batches = batches(scene, world, jobs, &targets, bytes_max, spare)?;
        self.resources.upload_scene(&self.gpu, scene)?;
        for world in std::iter::once(world).chain(world.all_slices()) {
            bounds::check_world(scene, world).map_err(|why| self.gpu.error(why))?;
        }
        for batch in &batches {
            let words_of = |payload| self.payloads.word_count(payload);
            bounds::check_batch(batch, world.overlay.texts.len(), words_of)
                .map_err(|why| self.gpu.error(why))?;
        }
        if let Some(timer) = &mut self.timer {
            timer.begin_frame();
        }
        let mut in_flight = VecDeque::new();
        for batch in &batches {
            if in_flight.len() == 2 {
                self.finish_readback(in_flight.pop_front(), jobs)?;
            }
            in_flight.push_back(self.submit(scene, world, batch, jobs));
        }
        while !in_flight.is_empty() {
            self.finish_readback(in_flight.pop_front(), jobs)?;
        }
        self.spare = batches.into_iter().next().unwrap_or_default();
        self.gpu.check()
    }

    /// Submits a batch.
    fn submit(
        &mut self,
        scene: &Scene,
        world: &World,
        batch: &Batch,
        jobs: &mut [BundleJob],
    ) -> InFlight {
        self.resources.upload_batch(&self.gpu, scene, world, batch);
        let descriptor = CommandEncoderDescriptor { label: Some("batch") };
        let mut encoder = self.gpu.device.create_command_encoder(&descriptor);
        self.payloads.prepare(&self.gpu, batch, &mut encoder);
        let (timed, timestamp_writes) = self.timer.as_mut().map(Timer::begin_batch).unzip();
        {
            let descriptor = ComputePassDescriptor { label: Some("rays"), timestamp_writes };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            pass.set_bind_group(0, self.resources.group(&self.gpu, &self.kernels), &[]);
            let outputs = self.payloads.group(&self.gpu.device, &self.kernels.outputs_layout);
            pass.set_bind_group(1, outputs, &[]);
            let Kernels { draw_overlay, trace_lidars, pack_tags, .. } = &self.kernels;
            let has_lamps = self.resources.has_lamps();
            let has_rain = batch.has_rain();
            let kinds = batch.camera_kinds();
            let traced: [_; CAMERA_KINDS] = std::array::from_fn(|kind| {
                let groups = if kinds[kind] { batch.groups[0] } else { 0 };
                let [is_smooth, has_lens, has_effects, has_surfaces] =
                    [1, 2, 4, 8].map(|bit| kind & bit != 0);
                let kind = CameraKernel {
                    is_smooth,
                    has_lens,
                    has_effects,
                    has_surfaces,
                    has_lamps,
                    has_rain,
                };
                let kernel =
                    (groups > 0).then(|| self.kernels.trace_cameras(&self.gpu.device, kind));
                (kernel, groups)
            });
            let [cameras, lidars, packing] = batch.groups;
            let drawn = if world.overlay.is_empty() { 0 } else { cameras };
            let [plain, echoing] =
                [false, true].map(|has| if batch.has_lidars(has) { lidars } else { 0 });
            let trace_echoes = (echoing > 0).then(|| self.kernels.trace_echoes(&self.gpu.device));
            let others = [
                (Some(draw_overlay), drawn),
                (Some(trace_lidars), plain),
                (trace_echoes, echoing),
                (Some(pack_tags), packing),
            ];
            for (kernel, groups) in traced {
                run_kernel(&mut pass, kernel, groups);
            }
            if let Some(cells) = batch.cells_max() {
                let [gather, expose, develop] = self.kernels.develop(&self.gpu.device);
                let count = batch.cameras.len() as u32;
                pass.set_pipeline(gather);
                pass.dispatch_workgroups(cells.div_ceil(64), count, 1);
                pass.set_pipeline(expose);
                pass.dispatch_workgroups(1, count, 1);
                run_kernel(&mut pass, Some(develop), cameras);
            }
            for (kernel, groups) in others {
                run_kernel(&mut pass, kernel, groups);
            }
        }
        let out = self.payloads.own().clone();
        let mut staged = Vec::new();
        for window in &batch.windows {
            let whole = (window.end - window.begin).next_multiple_of(4);
            match self.payloads.imported(&self.gpu.device, jobs[window.job].out) {
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
        let timer = self.timer.as_ref().zip(timed);
        if let Some((timer, slot)) = timer {
            timer.end_batch(slot, &mut encoder);
        }
        let submission = self.gpu.queue.submit([encoder.finish()]);
        if let Some((timer, slot)) = timer {
            timer.map(slot);
        }
        if let Some((buffer, _)) = &staging {
            Readback::map(buffer, batch.byte_len);
        }
        InFlight { submission, timed, staging }
    }

    /// Waits for a batch and copies its staged windows to the payloads.
    fn finish_readback(
        &mut self,
        batch: Option<InFlight>,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        let Some(batch) = batch else { return Ok(()) };
        self.waiter.wait(&self.gpu, batch.submission)?;
        self.gpu.check()?;
        if let Some((timer, slot)) = self.timer.as_mut().zip(batch.timed) {
            timer.finish_batch(slot);
        }
        if let Some((buffer, windows)) = batch.staging {
            Readback::deliver(&self.gpu, &buffer, &windows, jobs)?;
        }
        Ok(())
    }
}
