//! The identity of a build.

/// Version and build, as `omnibus --version` prints them: `0.1.0 (build 0123456789abcdef)`.
pub const VERSION: &str = env!("OMNIBUS_VERSION");

/// The build as a number: a hash of the version and of the sources that define what lies in shared
/// memory (the crates `protocol` and `bus`). Programs of one instance have the same.
pub const BUILD: u64 = parse(env!("OMNIBUS_BUILD"));

const fn parse(digits: &str) -> u64 {
    let digits = digits.as_bytes();
    let (mut number, mut index) = (0u64, 0);
    while index < digits.len() {
        number = number.wrapping_mul(10).wrapping_add((digits[index] - b'0') as u64);
        index += 1;
    }
    number
}
