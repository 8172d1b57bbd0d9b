//! Messages in protobuf's binary form.

/// A message in protobuf's binary form.
#[derive(Clone, Debug, Default)]
pub struct Message(pub Vec<u8>);

impl Message {
    /// Returns an empty message.
    #[must_use]
    pub fn new() -> Message {
        Message::default()
    }

    fn varint(&mut self, mut value: u64) {
        while value > 0x7f {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn key(&mut self, field: u32, wire_type: u32) {
        self.varint(u64::from(field << 3 | wire_type));
    }

    /// Appends an integer, a Boolean or a value of an enumeration.
    #[must_use]
    pub fn integer(mut self, field: u32, value: u64) -> Message {
        self.key(field, 0);
        self.varint(value);
        self
    }

    /// Appends a number.
    #[must_use]
    pub fn double(mut self, field: u32, value: f64) -> Message {
        self.key(field, 1);
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Appends a list of numbers.
    #[must_use]
    pub fn doubles(self, field: u32, values: &[f64]) -> Message {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.bytes(field, &bytes)
    }

    /// Appends an integer of four bytes.
    #[must_use]
    pub fn fixed32(mut self, field: u32, value: u32) -> Message {
        self.key(field, 5);
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Appends bytes.
    #[must_use]
    pub fn bytes(mut self, field: u32, bytes: &[u8]) -> Message {
        self.begin_bytes(field, bytes.len()).extend_from_slice(bytes);
        self
    }

    /// Appends the head of a field of this many bytes, and returns where they go. Large data are
    /// put together there, without a copy.
    pub fn begin_bytes(&mut self, field: u32, len: usize) -> &mut Vec<u8> {
        self.key(field, 2);
        self.varint(len as u64);
        self.0.reserve_exact(len);
        &mut self.0
    }

    /// Appends a text.
    #[must_use]
    pub fn text(self, field: u32, text: &str) -> Message {
        self.bytes(field, text.as_bytes())
    }

    /// Appends a message, one of several for a repeated field.
    #[must_use]
    pub fn message(self, field: u32, message: &Message) -> Message {
        self.bytes(field, &message.0)
    }
}

/// Returns `google.protobuf.Timestamp`.
#[must_use]
pub fn timestamp(nanos: u64) -> Message {
    Message::new().integer(1, nanos / 1_000_000_000).integer(2, nanos % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of <https://protobuf.dev/programming-guides/encoding/>.
    #[test]
    fn messages_have_the_bytes_of_the_published_examples() {
        assert_eq!(Message::new().integer(1, 150).0, [0x08, 0x96, 0x01]);
        let text = [0x12, 0x07, 0x74, 0x65, 0x73, 0x74, 0x69, 0x6e, 0x67];
        assert_eq!(Message::new().text(2, "testing").0, text);
        let inner = Message::new().integer(1, 150);
        assert_eq!(Message::new().message(3, &inner).0, [0x1a, 0x03, 0x08, 0x96, 0x01]);
    }
}
