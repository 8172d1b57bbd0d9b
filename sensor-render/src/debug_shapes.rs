//! Debug shapes that commands have drawn and that have not expired.

use std::collections::BTreeMap;
use std::sync::Arc;

use protocol::{EraseShapes, JournalEntry, Shape, ShapeReceipt, Stamp};

use crate::overlay::Overlay;

/// Shapes by id, and their converted form.
#[derive(Debug)]
pub(crate) struct DebugShapes {
    shapes: BTreeMap<u32, (Shape, ShapeReceipt)>,
    overlay: Arc<Overlay>,
    is_stale: bool,
    /// Simulated time at which the first shape expires.
    soonest_nanos: u64,
}

impl Default for DebugShapes {
    fn default() -> DebugShapes {
        DebugShapes {
            shapes: BTreeMap::new(),
            overlay: Arc::default(),
            is_stale: false,
            soonest_nanos: u64::MAX,
        }
    }
}

impl DebugShapes {
    pub(crate) fn draw(&mut self, shape: &Shape, entry: &JournalEntry) {
        if let Ok(drawn) = entry.outcome.answered::<ShapeReceipt>() {
            self.shapes.insert(entry.outcome.id, (*shape, drawn));
            self.soonest_nanos = self.soonest_nanos.min(drawn.until_nanos);
            self.is_stale = true;
        }
    }

    pub(crate) fn erase(&mut self, erase: &EraseShapes) {
        self.keep(|shape, _| !erase.takes(shape));
    }

    pub(crate) fn clear(&mut self) {
        self.erase(&EraseShapes::ALL);
    }

    /// Removes the shapes that have expired at this frame.
    pub(crate) fn begin(&mut self, stamp: Stamp) {
        if self.soonest_nanos <= stamp.sim_time_nanos {
            self.keep(|_, drawn| drawn.is_shown(stamp));
        }
    }

    fn keep(&mut self, keeps: impl Fn(&Shape, &ShapeReceipt) -> bool) {
        let before = self.shapes.len();
        self.shapes.retain(|_, (shape, drawn)| keeps(shape, drawn));
        self.is_stale |= self.shapes.len() != before;
        let ends = self.shapes.values().map(|(_, drawn)| drawn.until_nanos);
        self.soonest_nanos = ends.min().unwrap_or(u64::MAX);
    }

    /// Returns the form that tracers draw.
    pub(crate) fn overlay(&mut self) -> Arc<Overlay> {
        if std::mem::take(&mut self.is_stale) {
            self.overlay = Arc::new(Overlay::new(self.shapes.values().map(|(shape, _)| shape)));
        }
        Arc::clone(&self.overlay)
    }
}
