//! Messagepack, as much of it as CARLA's clients speak: values in from a stream, bytes out.
//!
//! What comes in is hostile until it is read: nothing is reserved by a length that a stranger
//! claims, nesting is bounded, and what exceeds a request's budget is read past, not kept.

mod decode;
mod encode;
#[cfg(test)]
mod tests;

pub use decode::{Budget, DecodeError, read};
pub use encode::Pack;

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Nothing.
    Nil,
    /// A truth value.
    Bool(bool),
    /// A whole number; those beyond i64 are clamped, nobody sends them.
    Int(i64),
    /// A number.
    Float(f64),
    /// Text, or what was sent as such.
    Text(String),
    /// Bytes.
    Bytes(Vec<u8>),
    /// Several values; a map comes as its keys and values in turn.
    List(Vec<Value>),
}
