//! Enums whose values travel as one byte.

/// Defines an enum with explicit codes, the list of its values and the conversion from a code.
macro_rules! coded {
    ($(#[$head:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $code:literal,)* }) => {
        $(#[$head])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum $name { $($(#[$doc])* $variant = $code,)* }

        impl $name {
            /// All values in the order of their codes.
            pub const ALL: &[$name] = &[$($name::$variant,)*];

            /// Returns the value with this code, or `None` if no value has it.
            pub const fn from_code(code: u8) -> Option<$name> {
                match code { $($code => Some($name::$variant),)* _ => None }
            }
        }
    };
}

pub(crate) use coded;
