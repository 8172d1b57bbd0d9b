//! The result of a command.

use bytemuck::{Pod, Zeroable};

/// Values of [`Outcome::status`].
pub mod status {
    /// The command took effect.
    pub const DONE: u32 = 0;
    /// The command had no effect; [`super::Outcome::text`] holds the reason.
    pub const REFUSED: u32 = 1;
}

/// The result of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Outcome {
    /// One of [`status`].
    pub status: u32,
    /// The actor or bundle that the command created or changed.
    pub id: u32,
    /// The reason of a refusal as UTF-8, or a response; padded with zeros.
    pub text: [u8; 184],
}

const _: () = assert!(size_of::<Outcome>() == 192);

impl Outcome {
    /// The outcome of a command that took effect on, or created, `id`.
    pub fn done(id: u32) -> Outcome {
        Outcome { status: status::DONE, id, text: [0; 184] }
    }

    /// The outcome of a command that took effect on, or created, `id`, with a response.
    pub fn answer<T: Answer>(id: u32, response: &T) -> Outcome {
        const { assert!(size_of::<T>() <= 184) };
        let mut text = [0; 184];
        let bytes = bytemuck::bytes_of(response);
        text[..bytes.len()].copy_from_slice(bytes);
        Outcome { status: status::DONE, id, text }
    }

    /// Returns the response.
    ///
    /// # Errors
    /// The reason of the refusal.
    pub fn answered<T: Answer>(&self) -> Result<T, &str> {
        self.result()?;
        Ok(bytemuck::pod_read_unaligned(&self.text[..size_of::<T>()]))
    }

    /// The outcome of a command that was refused. `why` is cut after 184 bytes.
    pub fn refused(why: &str) -> Outcome {
        let mut text = [0; 184];
        let mut end = why.len().min(184);
        while !why.is_char_boundary(end) {
            end -= 1;
        }
        text[..end].copy_from_slice(&why.as_bytes()[..end]);
        Outcome { status: status::REFUSED, id: 0, text }
    }

    /// Returns the id, or the reason of the refusal.
    pub fn result(&self) -> Result<u32, &str> {
        if self.status == status::DONE {
            return Ok(self.id);
        }
        let end = self.text.iter().position(|&b| b == 0).unwrap_or(184);
        Err(std::str::from_utf8(&self.text[..end]).unwrap_or("refused"))
    }
}

/// A struct that fits into an [`Outcome`].
pub trait Answer: Pod {}
