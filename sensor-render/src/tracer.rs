use protocol::{ActorId, Name, Plane, SensorSpec, tracer};
use thiserror::Error;

use crate::{CpuTracer, Device, GpuTracer, Scene, World, outputs};

/// One bundle to measure: what it carries, and where the bytes go.
#[derive(Debug)]
pub struct BundleJob<'a> {
    /// Who carries the bundle; [`ActorId::NONE`]: it stands in the world.
    pub parent: ActorId,
    /// The bundle's sensors.
    pub sensors: &'a [SensorSpec],
    /// As `protocol::layout` laid them out, with `world_from_sensor` filled (see
    /// [`crate::pose_planes`]).
    pub planes: &'a [Plane],
    /// The bundle's payload: table and planes are written here.
    pub out: &'a mut [u8],
}

/// What turns rays into measurements.
#[derive(Debug)]
pub enum Tracer {
    /// Writes the table of planes and nothing else: for measuring the hand-over alone.
    Null,
    /// Packets of rays on the processor.
    Cpu(CpuTracer),
    /// One thread of a graphics processor for each ray.
    Gpu(Box<GpuTracer>),
}

impl Tracer {
    /// The tracer that `device` asks for, with `threads` threads of this process; 0: one for each
    /// core that it may use.
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

    /// What traces, in words: the adapter's name, or the instruction set and the threads.
    pub fn describe(&self) -> String {
        match self {
            Tracer::Null => "null".into(),
            Tracer::Cpu(tracer) => tracer.describe(),
            Tracer::Gpu(tracer) => tracer.adapter().into(),
        }
    }

    /// One of [`protocol::tracer`], to be stamped on the measurement of such planes.
    pub fn code(&self, planes: &[Plane]) -> u32 {
        match self {
            Tracer::Null => tracer::NULL,
            Tracer::Gpu(_) if !outputs::need_cpu(planes) => tracer::GPU,
            Tracer::Cpu(_) | Tracer::Gpu(_) => tracer::CPU,
        }
    }

    /// From now on a graphics processor writes straight into payloads that it can import.
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

    /// Lets go of all imported payloads; see [`GpuTracer::forget_imports`].
    pub fn forget_imports(&mut self) {
        if let Tracer::Gpu(tracer) = self {
            tracer.forget_imports();
        }
    }

    /// Measures all sensors of all bundles at the frame that `world` stands in, as one batch.
    ///
    /// Writes the table of planes, each with its lidar's first azimuth, then every plane. When it
    /// returns an error, the bytes of `jobs` may be half written.
    pub fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        match self {
            Tracer::Null => outputs::split(world, jobs).map(drop),
            Tracer::Cpu(tracer) => tracer.measure(scene, world, jobs),
            Tracer::Gpu(tracer) => tracer.measure(scene, world, jobs),
        }
    }
}

/// Why there is no measurement.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TraceError {
    /// No ray generator for such a sensor.
    #[error("sensor {sensor}: there is no kind {kind}; cameras are 1, lidars 2")]
    UnknownKind {
        /// Its name.
        sensor: Name,
        /// The kind it claims.
        kind: u32,
    },
    /// No such pinhole.
    #[error(
        "sensor {sensor}: a camera's field of view lies between 0 and pi rad, this one's is {fov_rad}"
    )]
    FieldOfView {
        /// Its name.
        sensor: Name,
        /// Its horizontal field of view.
        fov_rad: f32,
    },
    /// A number is not finite, or the quaternion is not of unit length.
    #[error("sensor {sensor}: its pose is not a rigid transform")]
    InvalidPose {
        /// Its name.
        sensor: Name,
    },
    /// The sensor cannot give this.
    #[error("sensor {sensor}: a sensor of kind {kind} has no output {output:#x}")]
    WrongOutput {
        /// Its name.
        sensor: Name,
        /// Its kind.
        kind: u32,
        /// One of [`protocol::output`].
        output: u32,
    },
    /// The plane does not fit its sensor or the bytes.
    #[error(
        "plane {plane} wants {byte_len} bytes at {offset}, but {why}; lay planes out by protocol::layout"
    )]
    Plane {
        /// Which.
        plane: usize,
        /// Where it begins.
        offset: u64,
        /// How long it is.
        byte_len: u64,
        /// The fact that disagrees.
        why: String,
    },
    /// The caller's bytes begin at an odd address.
    #[error("the payload begins at an address that is no multiple of 16")]
    Unaligned,
    /// No such adapter.
    #[error("--device gpu:{number}: {}", one_of(adapters))]
    NoAdapter {
        /// The number that was asked for.
        number: usize,
        /// The names of those that there are.
        adapters: Vec<String>,
    },
    /// The graphics processor or its driver gave up.
    #[error("{adapter}: {why}; --device cpu needs no driver")]
    Gpu {
        /// Its name.
        adapter: String,
        /// What it says.
        why: String,
    },
    /// One sensor gives more than the device can write at once.
    #[error(
        "sensor {sensor} gives {byte_len} bytes a frame, the device writes at most {bytes_max}; \
         ask for a smaller image or for --device cpu"
    )]
    TooLarge {
        /// Its name.
        sensor: Name,
        /// What it gives.
        byte_len: u64,
        /// The most that the device takes.
        bytes_max: u64,
    },
    /// The worker threads could not be started.
    #[error("{threads} render threads cannot be started: {why}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        why: String,
    },
}

fn one_of(adapters: &[String]) -> String {
    if adapters.is_empty() {
        return "there is no Vulkan adapter; try --device cpu".into();
    }
    let named: Vec<String> =
        adapters.iter().enumerate().map(|(number, name)| format!("{number} is {name}")).collect();
    let count = adapters.len();
    format!("there {} {count}: {}", if count == 1 { "is" } else { "are" }, named.join(", "))
}
