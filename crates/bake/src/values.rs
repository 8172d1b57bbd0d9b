//! Values of a baked item: in memory, or in the file that processes share.

use std::{ops::Deref, ops::Range, sync::Arc};

use bytemuck::Pod;

use crate::memory::Mapped;

/// Values of `T`, either in memory of their own or in a mapped file of the cache.
#[derive(Debug)]
pub struct Values<T>(Owner<T>);

#[derive(Debug)]
enum Owner<T> {
    Memory(Vec<T>),
    File(Arc<Mapped>, Range<usize>),
}

impl<T: Pod> Values<T> {
    /// Returns the values in a part of a file; `None` if the part is outside, or its address or
    /// length does not fit.
    pub(crate) fn mapped(file: Arc<Mapped>, part: Range<usize>) -> Option<Values<T>> {
        let bytes = (*file).as_ref().get(part.clone())?;
        bytemuck::try_cast_slice::<u8, T>(bytes).ok()?;
        Some(Values(Owner::File(file, part)))
    }
}

impl<T> From<Vec<T>> for Values<T> {
    fn from(values: Vec<T>) -> Values<T> {
        Values(Owner::Memory(values))
    }
}

impl<T: Pod> Deref for Values<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Owner::Memory(values) => values,
            Owner::File(file, part) => bytemuck::cast_slice(&(**file).as_ref()[part.clone()]),
        }
    }
}
