/// MessagePack bytes that are being written. A list begins with its length; its values follow.
#[derive(Clone, Debug, Default)]
pub struct Pack {
    bytes: Vec<u8>,
}

impl Pack {
    /// Creates an empty buffer.
    pub fn new() -> Pack {
        Pack::default()
    }

    /// Returns the bytes that were written.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the number of bytes that the buffer has reserved.
    pub fn capacity(&self) -> usize {
        self.bytes.capacity()
    }

    /// Converts the buffer into its bytes.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Removes everything after the first `len` bytes.
    pub fn truncate(&mut self, len: usize) {
        self.bytes.truncate(len);
    }

    /// Begins a list of `len` values, which follow.
    pub fn list(&mut self, len: usize) -> &mut Pack {
        match len {
            0..=15 => self.bytes.push(0x90 | len as u8),
            16..=0xffff => self.head(0xdc, &(len as u16).to_be_bytes()),
            _ => self.head(0xdd, &(len as u32).to_be_bytes()),
        }
        self
    }

    /// Writes nil.
    pub fn nil(&mut self) -> &mut Pack {
        self.bytes.push(0xc0);
        self
    }

    /// Writes a boolean.
    pub fn bool(&mut self, value: bool) -> &mut Pack {
        self.bytes.push(0xc2 | u8::from(value));
        self
    }

    /// Writes an unsigned integer in its shortest form.
    pub fn uint(&mut self, value: u64) -> &mut Pack {
        match value {
            0..=0x7f => self.bytes.push(value as u8),
            0x80..=0xff => self.head(0xcc, &[value as u8]),
            0x100..=0xffff => self.head(0xcd, &(value as u16).to_be_bytes()),
            0x1_0000..=0xffff_ffff => self.head(0xce, &(value as u32).to_be_bytes()),
            _ => self.head(0xcf, &value.to_be_bytes()),
        }
        self
    }

    /// Writes a signed integer.
    pub fn int(&mut self, value: i64) -> &mut Pack {
        match value {
            0.. => self.uint(value as u64),
            -32..0 => {
                self.bytes.push(value as i8 as u8);
                self
            }
            _ => {
                self.head(0xd3, &value.to_be_bytes());
                self
            }
        }
    }

    /// Writes a number of single precision.
    pub fn f32(&mut self, value: f32) -> &mut Pack {
        self.head(0xca, &value.to_be_bytes());
        self
    }

    /// Writes a number of double precision.
    pub fn f64(&mut self, value: f64) -> &mut Pack {
        self.head(0xcb, &value.to_be_bytes());
        self
    }

    /// Writes a string.
    pub fn text(&mut self, text: &str) -> &mut Pack {
        match text.len() {
            len @ 0..=31 => self.bytes.push(0xa0 | len as u8),
            len @ 32..=0xff => self.head(0xd9, &[len as u8]),
            len @ 0x100..=0xffff => self.head(0xda, &(len as u16).to_be_bytes()),
            len => self.head(0xdb, &(len as u32).to_be_bytes()),
        }
        self.bytes.extend_from_slice(text.as_bytes());
        self
    }

    /// Writes bytes.
    pub fn bin(&mut self, bytes: &[u8]) -> &mut Pack {
        match bytes.len() {
            len @ 0..=0xff => self.head(0xc4, &[len as u8]),
            len @ 0x100..=0xffff => self.head(0xc5, &(len as u16).to_be_bytes()),
            len => self.head(0xc6, &(len as u32).to_be_bytes()),
        }
        self.bytes.extend_from_slice(bytes);
        self
    }

    /// Writes three numbers of single precision as a list.
    pub fn vector(&mut self, [x, y, z]: [f32; 3]) -> &mut Pack {
        self.list(3).f32(x).f32(y).f32(z)
    }

    fn head(&mut self, code: u8, rest: &[u8]) {
        self.bytes.push(code);
        self.bytes.extend_from_slice(rest);
    }
}
