//! A fuzz target under libFuzzer: `OMNIBUS_FUZZ_TARGET` names it. `./run fuzz` builds and starts it.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use omnibus_fuzz::{CountingAllocator, Target, target};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

static TARGET: LazyLock<&Target> = LazyLock::new(|| {
    let name = std::env::var("OMNIBUS_FUZZ_TARGET").unwrap_or_default();
    target(&name).unwrap_or_else(|| panic!("OMNIBUS_FUZZ_TARGET {name:?} is no target"))
});

fuzz_target!(|bytes: &[u8]| {
    if let Some(seal) = TARGET.seal {
        let mut bytes = bytes.to_vec();
        seal(&mut bytes);
        TARGET.check(&bytes);
    } else {
        TARGET.check(bytes);
    }
});
