//! Requests of CARLA's clients.

use carla_gateway::msgpack::{Budget, DecodeError, read};

/// Reads requests until the end of the bytes, and the arguments of each as every call reads them.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let mut input = bytes;
    let mut count = 0;
    loop {
        let before = input.len();
        match read(&mut input, &mut Budget::new(1 << 10, 1 << 12)) {
            Ok(value) => {
                assert!(input.len() < before, "a value of no bytes");
                carla_gateway::read_arguments(&value);
                count += 1;
            }
            Err(DecodeError::Ended) => return count > 0,
            Err(why) => {
                assert!(!why.to_string().is_empty());
                return false;
            }
        }
    }
}
