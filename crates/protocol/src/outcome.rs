//! The result of a command.

use bytemuck::{Pod, Zeroable};

use crate::refusal::{Refusal, RefusalCode, reason, text};

/// Values of [`Outcome::status`] that are no refusal.
pub mod status {
    /// The command took effect.
    pub const DONE: u32 = 0;
}

/// Bytes of [`Outcome::text`].
const TEXT_BYTES: usize = 184;

/// The result of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Outcome {
    /// [`status::DONE`], or the number of a [`RefusalCode`]: then the command had no effect.
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
        Outcome { status: status::DONE, id, text: [0; TEXT_BYTES] }
    }

    /// The outcome of a command that took effect on, or created, `id`, with a response.
    pub fn answer<T: Answer>(id: u32, response: &T) -> Outcome {
        const { assert!(size_of::<T>() <= TEXT_BYTES) };
        let mut text = [0; TEXT_BYTES];
        let bytes = bytemuck::bytes_of(response);
        text[..bytes.len()].copy_from_slice(bytes);
        Outcome { status: status::DONE, id, text }
    }

    /// Returns the response.
    ///
    /// # Errors
    /// The refusal.
    pub fn answered<T: Answer>(&self) -> Result<T, Refusal> {
        self.result()?;
        Ok(bytemuck::pod_read_unaligned(&self.text[..size_of::<T>()]))
    }

    /// The outcome of a command that was refused. The reason is cut after 184 bytes.
    pub fn refused(refusal: &Refusal) -> Outcome {
        Outcome { status: refusal.code as u32, id: 0, text: text(&refusal.reason) }
    }

    /// Returns the id of what the command created or changed.
    ///
    /// # Errors
    /// The refusal.
    pub fn result(&self) -> Result<u32, Refusal> {
        if self.status == status::DONE {
            return Ok(self.id);
        }
        Err(Refusal { code: RefusalCode::from_number(self.status), reason: reason(&self.text) })
    }
}

/// A struct that fits into an [`Outcome`].
pub trait Answer: Pod {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_comes_back_with_its_code_and_its_reason() {
        let refusal = Refusal::spawn_collision("actor 3 would stand in actor 2");
        assert_eq!(Outcome::refused(&refusal).result(), Err(refusal));
        let long = Refusal::file("ö".repeat(100));
        let cut = Outcome::refused(&long).result().unwrap_err();
        assert_eq!((cut.code, cut.reason), (RefusalCode::File, "ö".repeat(92)));
        assert_eq!(Outcome::done(7).result(), Ok(7));
    }
}
