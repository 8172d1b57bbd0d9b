//! The table of targets.

use crate::{
    allocation::allocated,
    targets::{carla_log, commands, gltf, msgpack, open_drive, recording, saved_state},
};

/// A reader of bytes from outside, with the bounds of its work.
pub struct Target {
    /// The name, also of its folder in the corpus.
    pub name: &'static str,
    /// Reads the bytes, and checks what it promises; returns whether they were accepted.
    pub run: fn(&[u8]) -> bool,
    /// Makes the lengths or checksums of mutated bytes right, so that mutations reach what lies
    /// behind them.
    pub seal: Option<fn(&mut [u8])>,
    /// Makes seeds of a format that changes with the build, in addition to the corpus.
    pub made: Option<fn() -> Vec<Vec<u8>>>,
    /// Whether the format is text with elements and attributes.
    pub is_markup: bool,
    /// The most bytes that reading may allocate in sum: for any input, and for each of its bytes.
    pub allocated_max: [u64; 2],
    /// Executions in `./run test` and in `./run soak`.
    pub executions: [u64; 2],
}

impl Target {
    /// Reads the bytes. Returns whether they were accepted, and the bytes that this allocated.
    ///
    /// # Panics
    /// They show a fault of the reader.
    pub fn check(&self, bytes: &[u8]) -> (bool, u64) {
        let before = allocated();
        let is_accepted = (self.run)(bytes);
        let count = allocated() - before;
        let [base, each] = self.allocated_max;
        let most = base + each * bytes.len() as u64;
        let len = bytes.len();
        assert!(count <= most, "{len} bytes made it allocate {count} bytes, more than {most}");
        (is_accepted, count)
    }
}

/// Every target. The executions of the soak are 10⁷ in sum.
pub const TARGETS: &[Target] = &[
    Target {
        name: "msgpack",
        run: msgpack::run,
        seal: None,
        made: None,
        is_markup: false,
        allocated_max: [1 << 20, 1 << 12],
        executions: [4000, 4_000_000],
    },
    Target {
        name: "carla_log",
        run: carla_log::run,
        seal: None,
        made: None,
        is_markup: false,
        allocated_max: [1 << 20, 1 << 12],
        executions: [2000, 2_000_000],
    },
    Target {
        name: "gltf",
        run: gltf::run,
        seal: Some(gltf::seal),
        made: None,
        is_markup: false,
        allocated_max: [256 << 20, 1 << 12],
        executions: [2000, 2_000_000],
    },
    Target {
        name: "recording",
        run: recording::run,
        seal: None,
        made: None,
        is_markup: false,
        allocated_max: [64 << 20, 1 << 16],
        executions: [1000, 1_000_000],
    },
    Target {
        name: "saved_state",
        run: saved_state::run,
        seal: Some(sim_host::SavedState::seal),
        made: Some(saved_state::made),
        is_markup: false,
        allocated_max: [64 << 20, 1 << 16],
        executions: [500, 600_000],
    },
    Target {
        name: "commands",
        run: commands::run,
        seal: None,
        made: None,
        is_markup: false,
        allocated_max: [64 << 20, 1 << 16],
        executions: [100, 100_000],
    },
    Target {
        name: "open_drive",
        run: open_drive::run,
        seal: None,
        made: None,
        is_markup: true,
        allocated_max: [4 << 30, 1 << 20],
        executions: [300, 300_000],
    },
];

/// Returns the target of this name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
