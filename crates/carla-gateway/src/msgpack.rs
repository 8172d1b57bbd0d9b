//! MessagePack, as far as CARLA's clients use it: values from a stream, and bytes to send.
//!
//! Input is not trusted: no memory is reserved by a length that a client claims, nesting is
//! limited, and what exceeds the budget of a request is read and discarded.

mod budget;
mod decode;
mod encode;
mod request;
#[cfg(test)]
mod tests;
mod value;

pub use budget::{Budget, Pool};
pub use decode::{DecodeError, read};
pub use encode::Pack;
pub use request::{Request, read_request};
pub use value::Value;
