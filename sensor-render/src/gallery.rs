//! What the journal says is drawn, and has not ended.

use std::collections::BTreeMap;
use std::sync::Arc;

use protocol::{EraseShapes, JournalEntry, Shape, ShapeReceipt, Stamp};

use crate::Overlay;

/// Shapes by their numbers, and what tracers see of them.
#[derive(Debug)]
pub(crate) struct Gallery {
    shapes: BTreeMap<u32, (Shape, ShapeReceipt)>,
    overlay: Arc<Overlay>,
    is_stale: bool,
    /// None of them ends before.
    soonest_nanos: u64,
}

impl Default for Gallery {
    fn default() -> Gallery {
        Gallery {
            shapes: BTreeMap::new(),
            overlay: Arc::default(),
            is_stale: false,
            soonest_nanos: u64::MAX,
        }
    }
}

impl Gallery {
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

    /// This frame is measured next: forgets what it does not show.
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

    /// What tracers see.
    pub(crate) fn overlay(&mut self) -> Arc<Overlay> {
        if std::mem::take(&mut self.is_stale) {
            self.overlay = Arc::new(Overlay::new(self.shapes.values().map(|(shape, _)| shape)));
        }
        Arc::clone(&self.overlay)
    }
}
