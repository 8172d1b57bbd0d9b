use std::fmt;
use std::str::FromStr;

/// Device that traces the rays: `auto`, `cpu` or `gpu:0`, `gpu:1`, …
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Device {
    /// The first adapter that is a hardware GPU; the CPU if there is none.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The adapter with this number; software adapters count too.
    Gpu(usize),
}

impl FromStr for Device {
    type Err = String;

    fn from_str(text: &str) -> Result<Device, String> {
        match text {
            "auto" => Ok(Device::Auto),
            "cpu" => Ok(Device::Cpu),
            "gpu" => Ok(Device::Gpu(0)),
            _ => text
                .strip_prefix("gpu:")
                .and_then(|number| number.parse().ok())
                .map(Device::Gpu)
                .ok_or_else(|| format!("there is no device {text}; try auto, cpu, or gpu:0")),
        }
    }
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Device::Auto => f.write_str("auto"),
            Device::Cpu => f.write_str("cpu"),
            Device::Gpu(number) => write!(f, "gpu:{number}"),
        }
    }
}
