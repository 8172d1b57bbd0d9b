//! The debug shapes that are drawn over the world and have not ended.

use std::collections::BTreeMap;

use crate::{EraseShapes, Frame, Outcome, Refusal, SHAPES_MAX, Shape, ShapeReceipt, Stamp};

/// Debug shapes by number. Numbers rise and are never used twice in one run of the host.
#[derive(Clone, Debug)]
pub struct DebugShapes {
    last: u32,
    shapes: BTreeMap<u32, (Shape, ShapeReceipt)>,
    /// Simulated time before which no shape ends.
    soonest_nanos: u64,
    revision: u64,
}

impl Default for DebugShapes {
    fn default() -> DebugShapes {
        DebugShapes { last: 0, shapes: BTreeMap::new(), soonest_nanos: u64::MAX, revision: 0 }
    }
}

impl DebugShapes {
    /// Returns the outcome of drawing `shape`, first shown at `first`: its number and its
    /// [`ShapeReceipt`]. [`DebugShapes::insert`] takes it.
    ///
    /// # Errors
    /// [`SHAPES_MAX`] shapes are drawn already.
    pub fn admit(&self, shape: &Shape, first: Stamp) -> Result<Outcome, Refusal> {
        if self.shapes.len() >= SHAPES_MAX {
            return Err(Refusal::full(format!(
                "{} shapes are drawn, SHAPES_MAX is {SHAPES_MAX}; erase some, or give them a life",
                self.shapes.len()
            )));
        }
        Ok(Outcome::answer(self.last + 1, &shape.drawn(first)))
    }

    /// Adds a shape under the number and with the receipt of an outcome.
    pub fn insert(&mut self, shape: &Shape, outcome: &Outcome) {
        if let Ok(receipt) = outcome.answered::<ShapeReceipt>() {
            self.last = self.last.max(outcome.id);
            self.soonest_nanos = self.soonest_nanos.min(receipt.until_nanos);
            self.shapes.insert(outcome.id, (*shape, receipt));
            self.revision += 1;
        }
    }

    /// Removes the shapes that a command names.
    pub fn erase(&mut self, erase: &EraseShapes) {
        self.retain(|shape, _| !erase.takes(shape));
    }

    /// Removes all shapes; numbers go on.
    pub fn clear(&mut self) {
        self.retain(|_, _| false);
    }

    /// Removes the shapes that no frame after this one shows.
    pub fn end_frame(&mut self, stamp: Stamp) {
        if self.soonest_nanos <= stamp.sim_time_nanos {
            self.retain(|_, receipt| !receipt.is_over(stamp));
        }
    }

    /// Removes the shapes that this frame does not show.
    pub fn begin_frame(&mut self, stamp: Stamp) {
        if self.soonest_nanos <= stamp.sim_time_nanos {
            self.retain(|_, receipt| receipt.is_shown(stamp));
        }
    }

    fn retain(&mut self, keeps: impl Fn(&Shape, &ShapeReceipt) -> bool) {
        let before = self.shapes.len();
        self.shapes.retain(|_, (shape, receipt)| keeps(shape, receipt));
        self.revision += u64::from(self.shapes.len() != before);
        let ends = self.shapes.values().map(|(_, receipt)| receipt.until_nanos);
        self.soonest_nanos = ends.min().unwrap_or(u64::MAX);
    }

    /// Returns the shapes by number.
    pub fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.shapes.values().map(|(shape, _)| shape)
    }

    /// Returns each shape with the outcome of its command, by number.
    pub fn outcomes(&self) -> impl Iterator<Item = (&Shape, Outcome)> {
        self.shapes.iter().map(|(id, (shape, receipt))| (shape, Outcome::answer(*id, receipt)))
    }

    /// A number that differs whenever the set of shapes does.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The number that was used last; 0: none was.
    pub fn last_number(&self) -> u32 {
        self.last
    }

    /// Numbers go on after `last` at the earliest.
    pub fn skip_numbers(&mut self, last: u32) {
        self.last = self.last.max(last);
    }

    /// Gives every shape a new number, after all that were used before, and `first` as the first
    /// frame that shows it.
    pub fn renumber(&mut self, first: Frame) {
        for (shape, receipt) in std::mem::take(&mut self.shapes).into_values() {
            self.last += 1;
            self.shapes.insert(self.last, (shape, ShapeReceipt { frame: first, ..receipt }));
        }
        self.revision += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape;

    fn at(frame: u64) -> Stamp {
        Stamp { frame: Frame(frame), sim_time_nanos: frame * 100, ..Stamp::default() }
    }

    fn lasting(life_nanos: u64) -> Shape {
        Shape { life_nanos, ..Shape::new(shape::POINT) }
    }

    fn draw(shapes: &mut DebugShapes, life_nanos: u64, first: Stamp) {
        let shape = lasting(life_nanos);
        let outcome = shapes.admit(&shape, first).unwrap();
        shapes.insert(&shape, &outcome);
    }

    fn lives(shapes: &DebugShapes) -> Vec<u64> {
        shapes.shapes().map(|shape| shape.life_nanos).collect()
    }

    #[test]
    fn an_ended_shape_is_forgotten_and_the_others_are_listed() {
        let mut shapes = DebugShapes::default();
        for life in [0, 150, shape::FOR_EVER] {
            draw(&mut shapes, life, at(3));
        }
        shapes.end_frame(at(2));
        assert_eq!(lives(&shapes), [0, 150, shape::FOR_EVER]);
        shapes.end_frame(at(3));
        assert_eq!(lives(&shapes), [150, shape::FOR_EVER]);
        let mut copy = DebugShapes::default();
        shapes.outcomes().for_each(|(shape, outcome)| copy.insert(shape, &outcome));
        assert_eq!(copy.shapes, shapes.shapes);
        shapes.end_frame(at(5));
        assert_eq!(lives(&shapes), [shape::FOR_EVER]);
        shapes.erase(&EraseShapes { shapes: 0, texts: 1 });
        assert_eq!(lives(&shapes), [shape::FOR_EVER]);
        shapes.erase(&EraseShapes::ALL);
        assert!(lives(&shapes).is_empty());
    }

    #[test]
    fn no_number_is_used_twice() {
        let mut shapes = DebugShapes::default();
        for life in [0, 150, shape::FOR_EVER] {
            draw(&mut shapes, life, at(3));
        }
        draw(&mut shapes, 7, at(9));
        shapes.renumber(Frame(20));
        assert_eq!(lives(&shapes), [0, 150, shape::FOR_EVER, 7]);
        assert!(shapes.outcomes().all(|(_, outcome)| outcome.id > 4));
        shapes.clear();
        assert_eq!(shapes.admit(&lasting(1), at(21)).unwrap().id, 9);
    }

    #[test]
    fn at_most_shapes_max_are_drawn() {
        let mut shapes = DebugShapes::default();
        for _ in 0..SHAPES_MAX {
            draw(&mut shapes, 100, at(1));
        }
        let why = shapes.admit(&lasting(100), at(1)).unwrap_err();
        assert!(why.reason.contains("16384 shapes are drawn, SHAPES_MAX is 16384"), "{why}");
        shapes.end_frame(at(2));
        assert!(shapes.admit(&lasting(100), at(2)).is_ok());
    }
}
