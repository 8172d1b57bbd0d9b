use protocol::Name;
use thiserror::Error;

/// Reason why a batch cannot be measured.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TraceError {
    /// There is no ray generator for this kind of sensor.
    #[error("sensor {sensor}: there is no kind {kind}; cameras are 1, lidars 2")]
    UnknownKind {
        /// Its name.
        sensor: Name,
        /// Kind of the sensor.
        kind: u32,
    },
    /// The field of view of a camera is out of range.
    #[error(
        "sensor {sensor}: a camera's field of view lies between 0 and pi rad, this one's is {fov_rad}"
    )]
    FieldOfView {
        /// Its name.
        sensor: Name,
        /// Horizontal field of view. Radians.
        fov_rad: f32,
    },
    /// The pose of a sensor has a number that is not finite, or a quaternion that is not of unit
    /// length.
    #[error("sensor {sensor}: its pose is not a rigid transform")]
    InvalidPose {
        /// Its name.
        sensor: Name,
    },
    /// The sensor does not have this output.
    #[error("sensor {sensor}: a sensor of kind {kind} has no output {output:#x}")]
    WrongOutput {
        /// Its name.
        sensor: Name,
        /// Kind of the sensor.
        kind: u32,
        /// One of [`protocol::output`].
        output: u32,
    },
    /// The sensor has more rows or columns than a tracer supports.
    #[error("sensor {sensor}: {width} x {height} is too large; width and height are at most {max}")]
    SensorSize {
        /// Its name.
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
        "plane {plane} wants {byte_len} bytes at {offset}, but {why}; lay planes out by protocol::layout"
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
    #[error("the payload begins at an address that is no multiple of 16")]
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
    #[error("{adapter}: {why}; --device cpu needs no driver")]
    Gpu {
        /// Its name.
        adapter: String,
        /// Error message.
        why: String,
    },
    /// One sensor has more bytes than the device can write at once.
    #[error(
        "sensor {sensor} gives {byte_len} bytes a frame, the device writes at most {bytes_max}; \
         ask for a smaller image or for --device cpu"
    )]
    TooLarge {
        /// Its name.
        sensor: Name,
        /// Bytes of the sensor per frame.
        byte_len: u64,
        /// Maximum that the device can write.
        bytes_max: u64,
    },
    /// The worker threads cannot be started.
    #[error("{threads} render threads cannot be started: {why}")]
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
