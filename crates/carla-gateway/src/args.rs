//! The arguments of a call: the values of a list, read one after the other.

use client_lib::{ClientError, Refusal};

use crate::msgpack::Value;

/// Why a call failed, as text for the caller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RpcError(pub(crate) String);

impl From<&str> for RpcError {
    fn from(why: &str) -> RpcError {
        RpcError(why.to_owned())
    }
}

impl From<String> for RpcError {
    fn from(why: String) -> RpcError {
        RpcError(why)
    }
}

impl From<Refusal> for RpcError {
    fn from(refusal: Refusal) -> RpcError {
        RpcError(refusal.reason)
    }
}

impl From<ClientError> for RpcError {
    fn from(why: ClientError) -> RpcError {
        RpcError(why.to_string())
    }
}

/// A list of arguments, read from its front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Args<'a> {
    values: &'a [Value],
}

impl<'a> Args<'a> {
    pub(crate) fn new(values: &'a [Value]) -> Args<'a> {
        Args { values }
    }

    /// Returns the number of values that are left.
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns the next value.
    ///
    /// # Errors
    ///
    /// Returns an error if no value is left.
    pub(crate) fn next(&mut self) -> Result<&'a Value, RpcError> {
        let (first, rest) =
            self.values.split_first().ok_or("too few arguments or fields in the call")?;
        self.values = rest;
        Ok(first)
    }

    /// Reads a number, which may be NaN or infinite.
    pub(crate) fn number(&mut self) -> Result<f64, RpcError> {
        match self.next()? {
            Value::Float(value) => Ok(*value),
            Value::Int(value) => Ok(*value as f64),
            other => Err(type_error("a number", other)),
        }
    }

    /// Reads a finite number.
    pub(crate) fn f64(&mut self) -> Result<f64, RpcError> {
        let value = self.number()?;
        if value.is_finite() { Ok(value) } else { Err(not_finite(value)) }
    }

    /// Reads a finite number of single precision.
    pub(crate) fn f32(&mut self) -> Result<f32, RpcError> {
        let value = self.number()?;
        if (value as f32).is_finite() { Ok(value as f32) } else { Err(not_finite(value)) }
    }

    pub(crate) fn int(&mut self) -> Result<i64, RpcError> {
        match self.next()? {
            Value::Int(value) => Ok(*value),
            other => Err(type_error("an integer", other)),
        }
    }

    pub(crate) fn u32(&mut self) -> Result<u32, RpcError> {
        let value = self.int()?;
        u32::try_from(value)
            .map_err(|_| RpcError(format!("{value} is out of range 0 to {}", u32::MAX)))
    }

    pub(crate) fn bool(&mut self) -> Result<bool, RpcError> {
        match self.next()? {
            Value::Bool(value) => Ok(*value),
            other => Err(type_error("a boolean", other)),
        }
    }

    pub(crate) fn text(&mut self) -> Result<&'a str, RpcError> {
        match self.next()? {
            Value::Text(text) => Ok(text),
            other => Err(type_error("a string", other)),
        }
    }

    /// Returns the number of bytes of all strings that are left, without those in lists.
    pub(crate) fn text_bytes(&self) -> usize {
        let bytes = |value: &Value| if let Value::Text(text) = value { text.len() } else { 0 };
        self.values.iter().map(bytes).sum()
    }

    pub(crate) fn bytes(&mut self) -> Result<&'a [u8], RpcError> {
        match self.next()? {
            Value::Bytes(bytes) => Ok(bytes),
            other => Err(type_error("bytes", other)),
        }
    }

    /// Returns the next value, which must be a list, as arguments of its own.
    pub(crate) fn list(&mut self) -> Result<Args<'a>, RpcError> {
        match self.next()? {
            Value::List(values) => Ok(Args { values }),
            other => Err(type_error("a list", other)),
        }
    }

    /// Reads `[false]` or `[true, value]`. In the second case, the value is the next one of the
    /// result.
    pub(crate) fn optional(&mut self) -> Result<Option<Args<'a>>, RpcError> {
        let mut list = self.list()?;
        Ok(if list.bool()? { Some(list) } else { None })
    }

    /// Reads three finite numbers.
    pub(crate) fn vector(&mut self) -> Result<[f32; 3], RpcError> {
        let mut list = self.list()?;
        Ok([list.f32()?, list.f32()?, list.f32()?])
    }
}

fn not_finite(value: f64) -> RpcError {
    RpcError(format!("expected a finite number of single precision as an argument, found {value}"))
}

fn type_error(what: &str, got: &Value) -> RpcError {
    let kind = match got {
        Value::Nil => "nil",
        Value::Bool(_) => "a boolean",
        Value::Int(_) => "an integer",
        Value::Float(_) => "a number",
        Value::Text(_) => "a string",
        Value::Bytes(_) => "bytes",
        Value::List(_) => "a list",
    };
    RpcError(format!("expected {what} as an argument, found {kind}"))
}
