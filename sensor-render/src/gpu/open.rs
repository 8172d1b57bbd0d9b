use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use wgpu::{
    Adapter, DeviceDescriptor, DeviceType, ExperimentalFeatures, Features, MemoryHints, Trace,
};

use super::import;
use super::instance::adapters;
use crate::error::TraceError;
use crate::workers::Workers;

/// What a device needs for an array of buffers that shaders write to.
pub(crate) const ARRAY_FEATURES: Features = Features::BUFFER_BINDING_ARRAY
    .union(Features::STORAGE_RESOURCE_BINDING_ARRAY)
    .union(Features::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING)
    .union(Features::PARTIALLY_BOUND_BINDING_ARRAY);

/// Open device, its queue, and the first error that it reported.
#[derive(Debug)]
pub(crate) struct Gpu {
    pub(crate) name: String,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// Whether the device can import memory of this process (VK_EXT_external_memory_host).
    pub(crate) imports: bool,
    /// Threads that copy staged measurements.
    pub(crate) workers: Workers,
    fault: Arc<Mutex<Option<String>>>,
    /// Time after which a device that has not finished a batch counts as lost.
    pub(crate) timeout: Duration,
}

/// Opens adapter `number`, or, with `None`, the first hardware adapter. Returns `Ok(None)` if there
/// is none.
pub(crate) fn open(number: Option<usize>, threads: usize) -> Result<Option<Gpu>, TraceError> {
    let adapters = adapters();
    let chosen = match number {
        Some(number) => Some(adapters.get(number).ok_or_else(|| TraceError::NoAdapter {
            number,
            adapters: adapters.iter().map(|adapter| adapter.get_info().name).collect(),
        })?),
        None => adapters.iter().find(|adapter| {
            matches!(
                adapter.get_info().device_type,
                DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu
            )
        }),
    };
    chosen.map(|adapter| open_adapter(adapter, Workers::new(threads)?)).transpose()
}

fn open_adapter(adapter: &Adapter, workers: Workers) -> Result<Gpu, TraceError> {
    let name = adapter.get_info().name;
    let descriptor = DeviceDescriptor {
        label: Some("sensor-render"),
        required_features: adapter.features()
            & (Features::TIMESTAMP_QUERY
                | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
                | ARRAY_FEATURES),
        required_limits: adapter.limits(),
        experimental_features: ExperimentalFeatures::disabled(),
        memory_hints: MemoryHints::Performance,
        trace: Trace::Off,
    };
    let (device, queue, imports) = match import::open(adapter, &descriptor) {
        Some((device, queue)) => (device, queue, true),
        None => {
            let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
                .map_err(|why| TraceError::Gpu { adapter: name.clone(), why: why.to_string() })?;
            (device, queue, false)
        }
    };
    let fault = Arc::new(Mutex::new(None));
    let note = |fault: &Arc<Mutex<Option<String>>>, why: String| {
        fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
    };
    let (on_error, on_loss) = (fault.clone(), fault.clone());
    device.on_uncaptured_error(Arc::new(move |error| note(&on_error, error.to_string())));
    device.set_device_lost_callback(move |reason, why| {
        note(&on_loss, format!("the device is lost ({reason:?}): {why}"));
    });
    // A software device shares its processors with everything else.
    let is_software = adapter.get_info().device_type == DeviceType::Cpu;
    let timeout = Duration::from_secs(if is_software { 600 } else { 30 });
    Ok(Gpu { name, device, queue, imports, workers, fault, timeout })
}

impl Gpu {
    /// Returns the first error that the device reported, if any.
    pub(crate) fn check(&self) -> Result<(), TraceError> {
        match self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone() {
            Some(why) => Err(self.error(why)),
            None => Ok(()),
        }
    }

    pub(crate) fn error(&self, why: String) -> TraceError {
        TraceError::Gpu { adapter: self.name.clone(), why }
    }
}
