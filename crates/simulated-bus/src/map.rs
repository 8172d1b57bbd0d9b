//! The control page on the heap.
#![expect(unsafe_code, reason = "a page of zeros is seen as the control page")]

use std::{
    alloc::{Layout, alloc_zeroed, handle_alloc_error},
    ops::Deref,
    sync::Arc,
};

use crate::ControlPage;

/// The control page of the simulated instance; clones share it.
#[derive(Clone)]
pub struct ControlPageMapping(Arc<ControlPage>);

impl ControlPageMapping {
    /// A page of zeros.
    pub(crate) fn blank() -> ControlPageMapping {
        let layout = Layout::new::<ControlPage>();
        // SAFETY: the layout is that of a page, which has a size.
        let address = unsafe { alloc_zeroed(layout) };
        if address.is_null() {
            handle_alloc_error(layout);
        }
        // SAFETY: allocated above with the layout of a page, which holds nothing but atomics and
        // reserved words, for which zeros are values.
        let page = unsafe { Box::from_raw(address.cast::<ControlPage>()) };
        ControlPageMapping(Arc::from(page))
    }
}

impl Deref for ControlPageMapping {
    type Target = ControlPage;

    fn deref(&self) -> &ControlPage {
        &self.0
    }
}
