//! What a caller gives: the values of one list, taken one by one.

use client_lib::ClientError;

use crate::msgpack::Value;

/// Why a call is not carried out, in words for the caller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Refusal(pub(crate) String);

impl From<&str> for Refusal {
    fn from(why: &str) -> Refusal {
        Refusal(why.to_owned())
    }
}

impl From<String> for Refusal {
    fn from(why: String) -> Refusal {
        Refusal(why)
    }
}

impl From<ClientError> for Refusal {
    fn from(why: ClientError) -> Refusal {
        Refusal(why.to_string())
    }
}

/// A list that is read from its front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Args<'a> {
    values: &'a [Value],
}

impl<'a> Args<'a> {
    pub(crate) fn new(values: &'a [Value]) -> Args<'a> {
        Args { values }
    }

    /// How many are left.
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// The next value as it is.
    pub(crate) fn next(&mut self) -> Result<&'a Value, Refusal> {
        let (first, rest) =
            self.values.split_first().ok_or("the call has too few arguments or fields")?;
        self.values = rest;
        Ok(first)
    }

    pub(crate) fn f64(&mut self) -> Result<f64, Refusal> {
        match self.next()? {
            Value::Float(value) => Ok(*value),
            Value::Int(value) => Ok(*value as f64),
            other => Err(wanted("a number", other)),
        }
    }

    pub(crate) fn f32(&mut self) -> Result<f32, Refusal> {
        self.f64().map(|value| value as f32)
    }

    pub(crate) fn int(&mut self) -> Result<i64, Refusal> {
        match self.next()? {
            Value::Int(value) => Ok(*value),
            other => Err(wanted("a whole number", other)),
        }
    }

    pub(crate) fn u32(&mut self) -> Result<u32, Refusal> {
        let value = self.int()?;
        u32::try_from(value).map_err(|_| Refusal(format!("{value} is not 0 to {}", u32::MAX)))
    }

    pub(crate) fn bool(&mut self) -> Result<bool, Refusal> {
        match self.next()? {
            Value::Bool(value) => Ok(*value),
            other => Err(wanted("true or false", other)),
        }
    }

    pub(crate) fn text(&mut self) -> Result<&'a str, Refusal> {
        match self.next()? {
            Value::Text(text) => Ok(text),
            other => Err(wanted("a text", other)),
        }
    }

    pub(crate) fn bytes(&mut self) -> Result<&'a [u8], Refusal> {
        match self.next()? {
            Value::Bytes(bytes) => Ok(bytes),
            other => Err(wanted("bytes", other)),
        }
    }

    /// A list within the list.
    pub(crate) fn list(&mut self) -> Result<Args<'a>, Refusal> {
        match self.next()? {
            Value::List(values) => Ok(Args { values }),
            other => Err(wanted("a list", other)),
        }
    }

    /// `[false]`, or `[true, value]`, whose value is read next from what this gives.
    pub(crate) fn optional(&mut self) -> Result<Option<Args<'a>>, Refusal> {
        let mut list = self.list()?;
        Ok(if list.bool()? { Some(list) } else { None })
    }

    /// Three numbers.
    pub(crate) fn vector(&mut self) -> Result<[f32; 3], Refusal> {
        let mut list = self.list()?;
        let vector = [list.f32()?, list.f32()?, list.f32()?];
        if vector.iter().all(|v| v.is_finite()) {
            return Ok(vector);
        }
        Err(format!("{vector:?} is not finite").into())
    }
}

fn wanted(what: &str, got: &Value) -> Refusal {
    let kind = match got {
        Value::Nil => "nothing",
        Value::Bool(_) => "a truth value",
        Value::Int(_) => "a whole number",
        Value::Float(_) => "a number",
        Value::Text(_) => "a text",
        Value::Bytes(_) => "bytes",
        Value::List(_) => "a list",
    };
    Refusal(format!("an argument is {kind}, not {what}"))
}
