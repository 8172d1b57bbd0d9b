//! Arrays of plain numbers, owned or borrowed from shared bytes.

use std::{
    ops::{Deref, Range},
    sync::Arc,
};

use bytemuck::Pod;

/// Bytes with shared ownership, such as a mapped file. They must not change while they are shared.
pub type SharedBytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// An array of plain numbers.
#[derive(Clone)]
pub(crate) enum Slab<T> {
    Owned(Vec<T>),
    Shared(SharedBytes, Range<usize>),
}

impl<T: Pod> Slab<T> {
    /// Returns the array that `range` of `bytes` is; `None` if range, size or alignment do not
    /// fit.
    pub(crate) fn shared(bytes: &SharedBytes, range: Range<usize>) -> Option<Slab<T>> {
        let own = (**bytes).as_ref().get(range.clone())?;
        bytemuck::try_cast_slice::<u8, T>(own).ok()?;
        Some(Slab::Shared(bytes.clone(), range))
    }
}

impl<T: Pod> Deref for Slab<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match self {
            Slab::Owned(own) => own,
            Slab::Shared(bytes, range) => bytemuck::cast_slice(&(**bytes).as_ref()[range.clone()]),
        }
    }
}

impl<T> Default for Slab<T> {
    fn default() -> Self {
        Slab::Owned(Vec::new())
    }
}

impl<T: Pod + PartialEq> PartialEq for Slab<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod + std::fmt::Debug> std::fmt::Debug for Slab<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_list().entries(&**self).finish()
    }
}
