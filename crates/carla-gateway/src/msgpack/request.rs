//! Reads one request of msgpack-rpc, and rejects anything else at its first wrong byte.
//!
//! A stranger's bytes decode as values too: those of an HTTP request are integers. A reader that
//! skipped values until a request would execute one that a web page has put into its body.

use std::io::Read;

use crate::msgpack::{
    budget::Budget,
    decode::{DecodeError, Decoder, first_byte},
    value::Value,
};

/// The longest name of a call. Bytes.
const METHOD_MAX: u64 = 256;

/// A request.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// The id that the answer repeats; `None` of a notification, which has no answer.
    pub id: Option<u64>,
    /// The name of the call.
    pub method: String,
    /// The arguments, without those beyond the budget.
    pub params: Vec<Value>,
}

/// Reads one request: `[0, id, method, params]`, or the notification `[2, method, params]`.
///
/// # Errors
///
/// Returns an error if the stream ends or its next bytes are not a request. The stream cannot be
/// used any longer.
pub fn read_request(input: &mut impl Read, budget: &mut Budget) -> Result<Request, DecodeError> {
    let first = first_byte(input)?;
    let mut decoder = Decoder { input, budget };
    let parts = match first {
        0x90..=0x9f => u64::from(first & 0x0f),
        0xdc => decoder.uint::<2>()?,
        0xdd => decoder.uint::<4>()?,
        _ => return Err(DecodeError::NotARequest { expected: "a list", found: first }),
    };
    let [kind] = decoder.array()?;
    let id = match (parts, kind) {
        (4, 0) => Some(id(&mut decoder)?),
        (3, 2) => None,
        _ => return Err(DecodeError::NotARequest { expected: "its kind", found: kind }),
    };
    let method = method(&mut decoder)?;
    let [first] = decoder.array()?;
    let params = match first {
        0x90..=0x9f | 0xdc | 0xdd => decoder.value(first, 0)?,
        _ => return Err(DecodeError::NotARequest { expected: "arguments", found: first }),
    };
    let Value::List(params) = params else { unreachable!("a list was read") };
    Ok(Request { id, method, params })
}

fn id(decoder: &mut Decoder<impl Read>) -> Result<u64, DecodeError> {
    let [first] = decoder.array()?;
    Ok(match first {
        0x00..=0x7f => first.into(),
        0xcc => decoder.uint::<1>()?,
        0xcd => decoder.uint::<2>()?,
        0xce => decoder.uint::<4>()?,
        0xcf => decoder.uint::<8>()?,
        _ => return Err(DecodeError::NotARequest { expected: "an id", found: first }),
    })
}

fn method(decoder: &mut Decoder<impl Read>) -> Result<String, DecodeError> {
    let [first] = decoder.array()?;
    let len = match first {
        0xa0..=0xbf => u64::from(first & 0x1f),
        0xd9 => decoder.uint::<1>()?,
        0xda => decoder.uint::<2>()?,
        _ => METHOD_MAX + 1,
    };
    if len > METHOD_MAX {
        return Err(DecodeError::NotARequest { expected: "the name of a call", found: first });
    }
    let mut bytes = vec![0; len as usize];
    decoder.fill(&mut bytes)?;
    String::from_utf8(bytes)
        .map_err(|_| DecodeError::NotARequest { expected: "the name of a call", found: first })
}
