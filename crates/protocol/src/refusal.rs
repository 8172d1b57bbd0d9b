//! Why a command or a query is refused: a code for programs and a reason for people.

macro_rules! refusals {
    ($($(#[doc = $doc:literal])* $name:ident($constructor:ident) = $code:literal,)*) => {
        /// The cause of a refusal. Programs match it; the reason beside it is for people.
        ///
        /// Numbers are never reused. A reader takes a number that it does not know for
        /// [`RefusalCode::Other`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u32)]
        #[non_exhaustive]
        pub enum RefusalCode {
            $($(#[doc = $doc])* $name = $code,)*
        }

        impl RefusalCode {
            /// Every code.
            pub const ALL: &[RefusalCode] = &[$(RefusalCode::$name),*];

            /// Returns the code of a number on the wire; [`RefusalCode::Other`] if it is unknown.
            pub fn from_number(number: u32) -> RefusalCode {
                match number {
                    $($code => RefusalCode::$name,)*
                    _ => RefusalCode::Other,
                }
            }

            /// Returns the name, as `SpawnCollision`.
            pub fn name(self) -> &'static str {
                match self {
                    $(RefusalCode::$name => stringify!($name),)*
                }
            }

            /// Returns the description: what the code means.
            pub fn description(self) -> &'static str {
                match self {
                    $(RefusalCode::$name => concat!($($doc),*).trim_ascii(),)*
                }
            }
        }

        impl Refusal {
            $(
                #[doc = concat!("A refusal with [`RefusalCode::", stringify!($name), "`].")]
                pub fn $constructor(reason: impl Into<String>) -> Refusal {
                    Refusal { code: RefusalCode::$name, reason: reason.into() }
                }
            )*
        }
    };
}

refusals! {
    /// A cause without a code of its own; the reason names it.
    Other(other) = 1,
    /// The actor would be spawned inside the ground, a building or another actor.
    SpawnCollision(spawn_collision) = 2,
    /// The actor was never spawned, or was destroyed.
    UnknownActor(unknown_actor) = 3,
    /// No blueprint has this id.
    UnknownBlueprint(unknown_blueprint) = 4,
    /// The actor, blueprint or sensor is of a kind that the command does not apply to.
    WrongKind(wrong_kind) = 5,
    /// A number, a count, a pose or a set of bits is outside its range.
    OutOfRange(out_of_range) = 6,
    /// No bundle, sensor, part of a vehicle or object of the map has this number.
    NotFound(not_found) = 7,
    /// A capacity is used up: actors, shapes, waiting texts or shared memory.
    Full(full) = 8,
    /// The actor cannot do this in its present state: it lies on the ground, or something blocks it.
    WrongState(wrong_state) = 9,
    /// The map cannot be found or loaded.
    Map(map) = 10,
    /// A file cannot be read or written, or does not hold what the command needs.
    File(file) = 11,
    /// The kind of command or query is unknown to this host, or this run carries out none of them.
    Unsupported(unsupported) = 12,
    /// Another world or a saved state replaced the world before the command was carried out.
    WorldReplaced(world_replaced) = 13,
}

/// A refusal of a command or query, with its code and its reason. The world is as it was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The cause, for programs.
    pub code: RefusalCode,
    /// The reason, for people.
    pub reason: String,
}

impl Refusal {
    /// Returns the refusal with what it is about in front of its reason: `context: reason`.
    #[must_use]
    pub fn about(self, context: impl std::fmt::Display) -> Refusal {
        Refusal { reason: format!("{context}: {}", self.reason), ..self }
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.reason)
    }
}

impl std::error::Error for Refusal {}

/// Writes a reason into the text of a message, cut at a character's boundary and padded with zeros.
pub(crate) fn text<const N: usize>(reason: &str) -> [u8; N] {
    let mut text = [0; N];
    let end = reason.floor_char_boundary(N);
    text[..end].copy_from_slice(&reason.as_bytes()[..end]);
    text
}

/// Reads a reason out of the text of a message.
pub(crate) fn reason(text: &[u8]) -> String {
    let end = text.iter().position(|byte| *byte == 0).unwrap_or(text.len());
    String::from_utf8_lossy(&text[..end]).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_is_read_from_its_own_number_and_unknown_numbers_are_other() {
        for code in RefusalCode::ALL {
            assert_eq!(RefusalCode::from_number(*code as u32), *code);
        }
        assert_eq!(RefusalCode::from_number(1_000_000), RefusalCode::Other);
    }
}
