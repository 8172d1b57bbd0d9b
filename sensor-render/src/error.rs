use protocol::Name;
use thiserror::Error;

/// Reason why a batch cannot be measured.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TraceError {
    /// There is no ray generator for this kind of sensor.
    #[error(
        "sensor {sensor}: unsupported sensor type {kind}; the renderer measures cameras (1) and lidars (2)"
    )]
    UnknownKind {
        /// Name of the sensor.
        sensor: Name,
        /// Kind of the sensor.
        kind: u32,
    },
    /// The lens of a camera, or its field of view, is out of range.
    #[error("sensor {sensor}: {why}")]
    Lens {
        /// Name of the sensor.
        sensor: Name,
        /// What is out of range.
        why: String,
    },
    /// The pose of a sensor has a number that is not finite, or a quaternion that is not of unit
    /// length.
    #[error("sensor {sensor}: its pose is not a rigid transform")]
    InvalidPose {
        /// Name of the sensor.
        sensor: Name,
    },
    /// The sensor does not have this output.
    #[error("sensor {sensor}: unsupported output {output:#x} for sensor type {kind}")]
    WrongOutput {
        /// Name of the sensor.
        sensor: Name,
        /// Kind of the sensor.
        kind: u32,
        /// One of [`protocol::output`].
        output: u32,
    },
    /// The sensor has more rows or columns than a tracer supports.
    #[error("sensor {sensor}: {width} x {height} is too large; width and height are at most {max}")]
    SensorSize {
        /// Name of the sensor.
        sensor: Name,
        /// Width, or columns.
        width: u32,
        /// Height, or channels.
        height: u32,
        /// Maximum of each.
        max: u32,
    },
    /// A plane does not fit its sensor or the payload.
    #[error(
        "plane {plane}: invalid range of {byte_len} bytes at offset {offset}: {why}; use protocol::layout"
    )]
    Plane {
        /// Index of the plane.
        plane: usize,
        /// Offset of its first byte.
        offset: u64,
        /// Length in bytes.
        byte_len: u64,
        /// What the plane disagrees with.
        why: String,
    },
    /// The payload is not aligned to 16 bytes.
    #[error("the payload is not aligned to 16 bytes")]
    Unaligned,
    /// There is no adapter with this number.
    #[error("--device gpu:{number}: {}", one_of(adapters))]
    NoAdapter {
        /// Requested number.
        number: usize,
        /// Names of the available adapters.
        adapters: Vec<String>,
    },
    /// The GPU or its driver failed.
    #[error("{adapter}: {why}; try --device cpu, which needs no driver")]
    Gpu {
        /// Name of the adapter.
        adapter: String,
        /// Error message.
        why: String,
    },
    /// One sensor has more bytes than the device can write at once.
    #[error(
        "sensor {sensor}: {byte_len} bytes per frame exceed the {bytes_max} bytes that the device can \
         write at once; try a smaller image or --device cpu"
    )]
    TooLarge {
        /// Name of the sensor.
        sensor: Name,
        /// Bytes of the sensor per frame.
        byte_len: u64,
        /// Maximum that the device can write.
        bytes_max: u64,
    },
    /// The worker threads cannot be started.
    #[error("cannot start {threads} render threads: {why}")]
    Threads {
        /// Requested number of threads.
        threads: usize,
        /// Error message of the system.
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
