//! The values that a request consists of.

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Nil.
    Nil,
    /// A boolean.
    Bool(bool),
    /// An integer, clamped to the range of i64.
    Int(i64),
    /// A number.
    Float(f64),
    /// A string.
    Text(String),
    /// Bytes.
    Bytes(Vec<u8>),
    /// A list; a map is the list of its keys and values in turn.
    List(Vec<Value>),
}
