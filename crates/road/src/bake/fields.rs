//! Fields as bytes, little-endian, without padding.

use glam::{DVec2, DVec3};

/// A value that can be part of a serialised network.
pub(crate) trait Field: Sized {
    /// Appends the value to `bytes`.
    fn put(&self, bytes: &mut Vec<u8>);
    /// Removes a value from the front of `bytes`; `None` if they do not begin with one.
    fn take(bytes: &mut &[u8]) -> Option<Self>;
}

/// Implements [`Field`] for structs, field by field. A missing field is a compile error.
macro_rules! baked {
    ($($type:ident { $($field:ident),* $(,)? })*) => { $(
        impl $crate::bake::fields::Field for $type {
            fn put(&self, bytes: &mut Vec<u8>) {
                let $type { $($field),* } = self;
                $($crate::bake::fields::Field::put($field, bytes);)*
            }

            #[inline]
            fn take(bytes: &mut &[u8]) -> Option<$type> {
                Some($type { $($field: $crate::bake::fields::Field::take(bytes)?),* })
            }
        }
    )* };
}

/// Implements [`Field`] for an enum: a number for each variant, then its fields.
macro_rules! baked_enum {
    ($type:ident { $($tag:literal => $variant:ident $({ $($field:ident),* })? $(($inner:ident))?),* $(,)? }) => {
        impl $crate::bake::fields::Field for $type {
            fn put(&self, bytes: &mut Vec<u8>) {
                match self { $(
                    $type::$variant $({ $($field),* })? $(($inner))? => {
                        bytes.push($tag);
                        $($($crate::bake::fields::Field::put($field, bytes);)*)?
                        $($crate::bake::fields::Field::put($inner, bytes);)?
                    }
                )* }
            }

            #[inline]
            fn take(bytes: &mut &[u8]) -> Option<$type> {
                match <u8 as $crate::bake::fields::Field>::take(bytes)? {
                    $($tag => {
                        $($(let $field = $crate::bake::fields::Field::take(bytes)?;)*)?
                        $(let $inner = $crate::bake::fields::Field::take(bytes)?;)?
                        Some($type::$variant $({ $($field),* })? $(($inner))?)
                    })*
                    _ => None,
                }
            }
        }
    };
}

pub(crate) use {baked, baked_enum};

macro_rules! numbers {
    ($($type:ident)*) => { $(
        impl Field for $type {
            fn put(&self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }

            #[inline]
            fn take(bytes: &mut &[u8]) -> Option<$type> {
                let (own, rest) = bytes.split_first_chunk()?;
                *bytes = rest;
                Some($type::from_le_bytes(*own))
            }
        }
    )* };
}

numbers! { u8 u32 u64 i32 i64 f64 }

impl Field for usize {
    fn put(&self, bytes: &mut Vec<u8>) {
        (*self as u64).put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<usize> {
        usize::try_from(u64::take(bytes)?).ok()
    }
}

impl Field for bool {
    fn put(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(*self));
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<bool> {
        let byte = u8::take(bytes)?;
        (byte < 2).then_some(byte == 1)
    }
}

impl Field for String {
    fn put(&self, bytes: &mut Vec<u8>) {
        (self.len() as u32).put(bytes);
        bytes.extend_from_slice(self.as_bytes());
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<String> {
        let length = u32::take(bytes)? as usize;
        let (own, rest) = bytes.split_at_checked(length)?;
        *bytes = rest;
        Some(std::str::from_utf8(own).ok()?.to_owned())
    }
}

impl<T: Field> Field for Option<T> {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.is_some().put(bytes);
        if let Some(inner) = self {
            inner.put(bytes);
        }
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<Option<T>> {
        if bool::take(bytes)? { T::take(bytes).map(Some) } else { Some(None) }
    }
}

/// Most elements that are reserved before they have been read, in case a count is wrong.
const TRUSTED: usize = 64;

impl<T: Field> Field for Vec<T> {
    fn put(&self, bytes: &mut Vec<u8>) {
        (self.len() as u32).put(bytes);
        self.iter().for_each(|one| one.put(bytes));
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<Vec<T>> {
        let count = u32::take(bytes)? as usize;
        let mut all = Vec::with_capacity(count.min(TRUSTED));
        for _ in 0..count {
            all.push(T::take(bytes)?);
        }
        Some(all)
    }
}

impl<T: Field> Field for Box<T> {
    fn put(&self, bytes: &mut Vec<u8>) {
        (**self).put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<Box<T>> {
        T::take(bytes).map(Box::new)
    }
}

impl<T: Field + Default, const N: usize> Field for [T; N] {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.iter().for_each(|one| one.put(bytes));
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<[T; N]> {
        let mut all = std::array::from_fn(|_| T::default());
        for one in &mut all {
            *one = T::take(bytes)?;
        }
        Some(all)
    }
}

impl<A: Field, B: Field> Field for (A, B) {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.0.put(bytes);
        self.1.put(bytes);
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<(A, B)> {
        Some((A::take(bytes)?, B::take(bytes)?))
    }
}

impl<A: Field, B: Field, C: Field> Field for (A, B, C) {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.0.put(bytes);
        self.1.put(bytes);
        self.2.put(bytes);
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<(A, B, C)> {
        Some((A::take(bytes)?, B::take(bytes)?, C::take(bytes)?))
    }
}

impl Field for DVec2 {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.to_array().put(bytes);
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<DVec2> {
        <[f64; 2]>::take(bytes).map(DVec2::from_array)
    }
}

impl Field for DVec3 {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.to_array().put(bytes);
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<DVec3> {
        <[f64; 3]>::take(bytes).map(DVec3::from_array)
    }
}
