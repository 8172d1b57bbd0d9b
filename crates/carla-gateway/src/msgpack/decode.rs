use std::io::{self, Read};

use crate::msgpack::{budget::Budget, value::Value};

/// The deepest nesting of lists; a batch with commands after spawns nests 12 deep.
const DEPTH_MAX: usize = 64;
/// Most bytes of one request, including discarded ones.
const READ_MAX: u64 = 1 << 30;
/// Most bytes that are allocated before they are received.
const CHUNK: usize = 1 << 16;

/// Why no value could be read. The stream cannot be used any longer.
#[derive(Debug, thiserror::Error)]
pub enum DecodeError {
    /// The stream ended between two values.
    #[error("the stream has ended")]
    Ended,
    /// The stream ended within a value.
    #[error("the stream ended within a value")]
    Truncated,
    /// The stream cannot be read.
    #[error(transparent)]
    Io(io::Error),
    /// Lists are nested too deeply.
    #[error("lists are nested deeper than {DEPTH_MAX}")]
    TooDeep,
    /// A request is too long.
    #[error("request is longer than {READ_MAX} bytes")]
    TooLong,
    /// The bytes are not a request.
    #[error(
        "byte {found:#04x} is not {expected}: this is not a call of msgpack-rpc; is it another \
         protocol, HTTP for instance?"
    )]
    NotARequest {
        /// The part of a request that the byte should begin.
        expected: &'static str,
        /// The byte.
        found: u8,
    },
    /// An extension type, or the byte that MessagePack does not use.
    #[error("unsupported MessagePack type {0:#04x}")]
    Unknown(u8),
}

/// Reads one value.
///
/// # Errors
///
/// Returns an error if the stream ends or the value is malformed or too large.
pub fn read(input: &mut impl Read, budget: &mut Budget) -> Result<Value, DecodeError> {
    let first = first_byte(input)?;
    Decoder { input, budget }.value(first, 0)
}

/// Reads the first byte of a value.
pub(super) fn first_byte(input: &mut impl Read) -> Result<u8, DecodeError> {
    let mut first = [0];
    loop {
        match input.read(&mut first) {
            Ok(0) => return Err(DecodeError::Ended),
            Ok(_) => return Ok(first[0]),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(DecodeError::Io(e)),
        }
    }
}

pub(super) struct Decoder<'a, R> {
    pub(super) input: &'a mut R,
    pub(super) budget: &'a mut Budget,
}

impl<R: Read> Decoder<'_, R> {
    pub(super) fn value(&mut self, first: u8, depth: usize) -> Result<Value, DecodeError> {
        self.spend(1)?;
        Ok(match first {
            0x00..=0x7f => Value::Int(first.into()),
            0xe0..=0xff => Value::Int((first as i8).into()),
            0x80..=0x8f => self.list(u64::from(first & 0x0f) * 2, depth)?,
            0x90..=0x9f => self.list((first & 0x0f).into(), depth)?,
            0xa0..=0xbf => self.text((first & 0x1f).into())?,
            0xc0 => Value::Nil,
            0xc2 => Value::Bool(false),
            0xc3 => Value::Bool(true),
            0xc4 => self.bytes_of::<1>()?,
            0xc5 => self.bytes_of::<2>()?,
            0xc6 => self.bytes_of::<4>()?,
            0xca => Value::Float(f32::from_be_bytes(self.array()?).into()),
            0xcb => Value::Float(f64::from_be_bytes(self.array()?)),
            0xcc => Value::Int(self.uint::<1>()? as i64),
            0xcd => Value::Int(self.uint::<2>()? as i64),
            0xce => Value::Int(self.uint::<4>()? as i64),
            0xcf => Value::Int(self.uint::<8>()?.min(i64::MAX as u64) as i64),
            0xd0 => Value::Int(i8::from_be_bytes(self.array()?).into()),
            0xd1 => Value::Int(i16::from_be_bytes(self.array()?).into()),
            0xd2 => Value::Int(i32::from_be_bytes(self.array()?).into()),
            0xd3 => Value::Int(i64::from_be_bytes(self.array()?)),
            0xd9 => self.text_of::<1>()?,
            0xda => self.text_of::<2>()?,
            0xdb => self.text_of::<4>()?,
            0xdc => self.list_of::<2>(1, depth)?,
            0xdd => self.list_of::<4>(1, depth)?,
            0xde => self.list_of::<2>(2, depth)?,
            0xdf => self.list_of::<4>(2, depth)?,
            0xc1 | 0xc7..=0xc9 | 0xd4..=0xd8 => return Err(DecodeError::Unknown(first)),
        })
    }

    fn list_of<const N: usize>(&mut self, each: u64, depth: usize) -> Result<Value, DecodeError> {
        let len = self.uint::<N>()?;
        self.list(len * each, depth)
    }

    fn text_of<const N: usize>(&mut self) -> Result<Value, DecodeError> {
        let len = self.uint::<N>()?;
        self.text(len)
    }

    fn bytes_of<const N: usize>(&mut self) -> Result<Value, DecodeError> {
        let len = self.uint::<N>()?;
        self.run(len).map(Value::Bytes)
    }

    fn list(&mut self, len: u64, depth: usize) -> Result<Value, DecodeError> {
        if depth >= DEPTH_MAX {
            return Err(DecodeError::TooDeep);
        }
        let mut values = Vec::with_capacity((len as usize).min(CHUNK / size_of::<Value>() / 8));
        for _ in 0..len {
            let [first] = self.array()?;
            let value = self.value(first, depth + 1)?;
            if self.budget.keep_value() {
                values.push(value);
            }
        }
        Ok(Value::List(values))
    }

    fn text(&mut self, len: u64) -> Result<Value, DecodeError> {
        let bytes = self.run(len)?;
        Ok(match String::from_utf8(bytes) {
            Ok(text) => Value::Text(text),
            Err(e) => Value::Text(String::from_utf8_lossy(e.as_bytes()).into_owned()),
        })
    }

    /// Reads `len` bytes; returns none of them if they exceed the budget.
    fn run(&mut self, len: u64) -> Result<Vec<u8>, DecodeError> {
        self.spend(len)?;
        let is_kept = self.budget.keep_bytes(len as usize);
        let mut bytes = Vec::new();
        let mut left = len as usize;
        while left > 0 {
            let part = left.min(CHUNK);
            let begin = bytes.len();
            bytes.resize(begin + part, 0);
            self.fill(&mut bytes[begin..])?;
            if !is_kept {
                bytes.clear();
            }
            left -= part;
        }
        Ok(bytes)
    }

    pub(super) fn uint<const N: usize>(&mut self) -> Result<u64, DecodeError> {
        let bytes: [u8; N] = self.array()?;
        Ok(bytes.iter().fold(0, |all, byte| all << 8 | u64::from(*byte)))
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    pub(super) fn fill(&mut self, bytes: &mut [u8]) -> Result<(), DecodeError> {
        self.input.read_exact(bytes).map_err(|e| match e.kind() {
            io::ErrorKind::UnexpectedEof => DecodeError::Truncated,
            _ => DecodeError::Io(e),
        })
    }

    fn spend(&mut self, bytes: u64) -> Result<(), DecodeError> {
        self.budget.read += bytes;
        if self.budget.read > READ_MAX { Err(DecodeError::TooLong) } else { Ok(()) }
    }
}
