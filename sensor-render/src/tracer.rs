use protocol::tracer;

use crate::{
    cpu::CpuTracer,
    device::Device,
    error::TraceError,
    gpu::{DeviceTimes, GpuTracer},
    job::BundleJob,
    outputs,
    scene::Scene,
    world::World,
};

/// Backend that casts rays and writes measurements.
#[derive(Debug)]
pub enum Tracer {
    /// Writes only the table of planes, for measuring the cost of the hand-over alone.
    Null,
    /// Traces packets of rays on the CPU.
    Cpu(CpuTracer),
    /// Traces one ray per GPU thread.
    Gpu(Box<GpuTracer>),
}

impl Tracer {
    /// Opens the tracer for `device`. `threads` is the number of CPU threads; 0 means one per core
    /// that this process may use.
    ///
    /// # Errors
    /// [`TraceError`] if the adapter does not exist, the device cannot be opened, or threads cannot
    /// be started.
    pub fn open(device: Device, threads: usize) -> Result<Tracer, TraceError> {
        let cpu = || CpuTracer::new(threads).map(Tracer::Cpu);
        let number = match device {
            Device::Cpu => return cpu(),
            Device::Auto => None,
            Device::Gpu(number) => Some(number),
        };
        match GpuTracer::open(number, threads)? {
            Some(gpu) => Ok(Tracer::Gpu(Box::new(gpu))),
            None => cpu(),
        }
    }

    /// Returns a description for users: the name of the adapter, or the number of threads and the
    /// instruction set.
    pub fn describe(&self) -> String {
        match self {
            Tracer::Null => "null".into(),
            Tracer::Cpu(tracer) => tracer.describe(),
            Tracer::Gpu(tracer) => tracer.adapter().into(),
        }
    }

    /// Returns the [`protocol::tracer`] code to stamp on measurements.
    pub fn code(&self) -> u32 {
        match self {
            Tracer::Null => tracer::NULL,
            Tracer::Gpu(_) => tracer::GPU,
            Tracer::Cpu(_) => tracer::CPU,
        }
    }

    /// Returns when a GPU worked on the last frame.
    pub fn device_times(&self) -> Option<DeviceTimes> {
        match self {
            Tracer::Gpu(tracer) => tracer.device_times(),
            Tracer::Null | Tracer::Cpu(_) => None,
        }
    }

    /// Lets a GPU write straight into payloads that it can import.
    ///
    /// # Safety
    /// As [`GpuTracer::import_payloads`].
    #[expect(unsafe_code, reason = "hands on a promise about memory")]
    pub unsafe fn import_payloads(&mut self) {
        if let Tracer::Gpu(tracer) = self {
            // SAFETY: the caller promises what `import_payloads` asks for.
            unsafe { tracer.import_payloads() };
        }
    }

    /// Releases all imported payloads; see [`GpuTracer::forget_imports`].
    pub fn forget_imports(&mut self) {
        if let Tracer::Gpu(tracer) = self {
            tracer.forget_imports();
        }
    }

    /// Measures all sensors of all bundles at the frame of `world`, as one batch. `world` must have
    /// been placed in `scene`.
    ///
    /// Writes the table of planes, with each lidar's first azimuth, then every plane.
    ///
    /// # Errors
    /// [`TraceError`]; the payloads of `jobs` may then be partly written.
    pub fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        match self {
            Tracer::Null => outputs::split(scene, world, jobs).map(drop),
            Tracer::Cpu(tracer) => tracer.measure(scene, world, jobs),
            Tracer::Gpu(tracer) => tracer.measure(scene, world, jobs),
        }
    }
}
