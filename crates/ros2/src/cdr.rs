//! Common Data Representation, version 1, of DDS: little-endian, each number aligned to its size
//! (OMG RTPS 2.3, chapter 10; the plain encoding of ROS 2 messages).

/// The encapsulation that precedes every message: plain CDR, little-endian, without options.
const PLAIN_LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// Writes one message. Offsets are counted after the encapsulation.
#[derive(Debug)]
pub(crate) struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    /// Returns a writer with room for `capacity` bytes.
    pub(crate) fn with_capacity(capacity: usize) -> CdrWriter {
        let mut bytes = Vec::with_capacity(capacity + PLAIN_LITTLE_ENDIAN.len());
        bytes.extend(PLAIN_LITTLE_ENDIAN);
        CdrWriter { bytes }
    }

    fn number<const N: usize>(&mut self, number: [u8; N]) {
        let offset = self.bytes.len() - PLAIN_LITTLE_ENDIAN.len();
        let padded = self.bytes.len() + offset.next_multiple_of(N) - offset;
        self.bytes.resize(padded, 0);
        self.bytes.extend(number);
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(crate) fn bool(&mut self, value: bool) {
        self.u8(value.into());
    }

    pub(crate) fn u16(&mut self, value: u16) {
        self.number(value.to_le_bytes());
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.number(value.to_le_bytes());
    }

    pub(crate) fn i32(&mut self, value: i32) {
        self.number(value.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, value: u64) {
        self.number(value.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, value: f32) {
        self.number(value.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, value: f64) {
        self.number(value.to_le_bytes());
    }

    /// Writes numbers of an array of fixed length.
    pub(crate) fn f64s(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.f64(*value));
    }

    /// Writes a string: its length with the final zero, its bytes, zero.
    pub(crate) fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// Writes a sequence of bytes that `fill` appends; their number must be `len`.
    pub(crate) fn bytes_with(&mut self, len: usize, fill: impl FnOnce(&mut Vec<u8>)) {
        self.u32(len as u32);
        let begin = self.bytes.len();
        fill(&mut self.bytes);
        debug_assert_eq!(self.bytes.len() - begin, len);
    }

    /// Returns the message with its encapsulation.
    pub(crate) fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Reads numbers of either byte order, aligned to their size. Every method gives `None` at the end
/// of the bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CdrReader<'a> {
    bytes: &'a [u8],
    offset: usize,
    is_little_endian: bool,
}

impl<'a> CdrReader<'a> {
    /// Returns a reader of bytes without an encapsulation.
    pub(crate) fn new(bytes: &'a [u8], is_little_endian: bool) -> CdrReader<'a> {
        CdrReader { bytes, offset: 0, is_little_endian }
    }

    /// Returns a reader of a message in plain CDR; `None` for another encapsulation.
    pub(crate) fn of_message(message: &'a [u8]) -> Option<CdrReader<'a>> {
        match message {
            [0, order @ (0 | 1), _, _, bytes @ ..] => Some(CdrReader::new(bytes, *order == 1)),
            _ => None,
        }
    }

    /// Takes the next bytes.
    pub(crate) fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let end = self.offset.checked_add(len)?;
        let taken = self.bytes.get(self.offset..end)?;
        self.offset = end;
        Some(taken)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.offset = self.offset.next_multiple_of(N);
        let mut number: [u8; N] = self.take(N)?.try_into().ok()?;
        if !self.is_little_endian {
            number.reverse();
        }
        Some(number)
    }

    /// Returns the bytes that were not read yet.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.offset..).unwrap_or_default()
    }

    pub(crate) fn bool(&mut self) -> Option<bool> {
        self.take(1).map(|byte| byte[0] != 0)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.number().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    pub(crate) fn i32(&mut self) -> Option<i32> {
        self.number().map(i32::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Option<f32> {
        self.number().map(f32::from_le_bytes)
    }

    /// Reads a string; what is not UTF-8 is replaced.
    pub(crate) fn string(&mut self) -> Option<String> {
        let len = self.u32()? as usize;
        let bytes = self.take(len)?;
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Some(String::from_utf8_lossy(text).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_after_the_encapsulation() {
        let mut message = CdrWriter::with_capacity(0);
        message.u8(7);
        message.f64(1.5);
        message.bool(true);
        message.u16(2);
        message.string("ab");
        let bytes = message.finish();
        assert_eq!(bytes.len(), 4 + 8 + 8 + 4 + 4 + 3);
        let mut reader = CdrReader::of_message(&bytes).unwrap();
        assert_eq!(reader.take(1), Some(&[7][..]));
        assert_eq!(reader.number().map(f64::from_le_bytes), Some(1.5));
        assert_eq!((reader.bool(), reader.u16()), (Some(true), Some(2)));
        assert_eq!((reader.string().as_deref(), reader.u32()), (Some("ab"), None));
    }

    #[test]
    fn the_other_byte_order_is_read_too() {
        let mut reader = CdrReader::of_message(&[0, 0, 0, 0, 0, 0, 0, 2]).unwrap();
        assert_eq!(reader.u32(), Some(2));
        assert!(CdrReader::of_message(&[0, 7, 0, 0, 1]).is_none());
    }
}
