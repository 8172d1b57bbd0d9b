//! What is drawn over the world and has not ended: for the keyframes of the journal and for saved
//! states. It decides nothing.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use protocol::{
    Command, EraseShapes, JournalEntry, Outcome, SHAPES_MAX, Shape, ShapeReceipt, Stamp,
};

use crate::journal::Request;

/// A shape that stands in a saved state.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SavedShape {
    /// What it looks like.
    pub shape: Shape,
    /// Simulated time at which it ends.
    pub until_nanos: u64,
}

/// Shapes by the number under which they are known, which counts up.
#[derive(Clone, Debug)]
pub(crate) struct Drawings {
    last: u32,
    shapes: BTreeMap<u32, (Shape, ShapeReceipt)>,
    /// None of them ends before.
    soonest_nanos: u64,
}

impl Default for Drawings {
    fn default() -> Drawings {
        Drawings { last: 0, shapes: BTreeMap::new(), soonest_nanos: u64::MAX }
    }
}

impl Drawings {
    /// Takes in a command; `first` is the first frame that will show it.
    pub(crate) fn draw(&mut self, shape: &Shape, first: Stamp) -> Result<Outcome, String> {
        shape.check()?;
        if self.shapes.len() >= SHAPES_MAX {
            return Err(format!(
                "{} shapes are drawn, SHAPES_MAX is {SHAPES_MAX}; erase some, or give them a life",
                self.shapes.len()
            ));
        }
        Ok(self.add(shape, shape.drawn(first)))
    }

    fn add(&mut self, shape: &Shape, drawn: ShapeReceipt) -> Outcome {
        let outcome = Outcome::answer(self.last + 1, &drawn);
        self.settle(shape, &outcome);
        outcome
    }

    /// What a line of the journal says was drawn.
    pub(crate) fn settle(&mut self, shape: &Shape, outcome: &Outcome) {
        if let Ok(drawn) = outcome.answered::<ShapeReceipt>() {
            self.last = self.last.max(outcome.id);
            self.soonest_nanos = self.soonest_nanos.min(drawn.until_nanos);
            self.shapes.insert(outcome.id, (*shape, drawn));
        }
    }

    pub(crate) fn erase(&mut self, erase: &EraseShapes) {
        self.shapes.retain(|_, (shape, _)| !erase.takes(shape));
    }

    /// This frame was the last for some.
    pub(crate) fn forget(&mut self, stamp: Stamp) {
        if self.soonest_nanos > stamp.sim_time_nanos {
            return;
        }
        self.shapes.retain(|_, (_, drawn)| !drawn.is_over(stamp));
        let ends = self.shapes.values().map(|(_, drawn)| drawn.until_nanos);
        self.soonest_nanos = ends.min().unwrap_or(u64::MAX);
    }

    /// Another world begins; numbers go on.
    pub(crate) fn clear(&mut self) {
        self.shapes.clear();
    }

    /// The lines that say what stands.
    pub(crate) fn entries(&self) -> impl Iterator<Item = JournalEntry> {
        self.shapes.iter().map(|(id, (shape, drawn))| line(shape, Outcome::answer(*id, drawn)))
    }

    /// For a state saved at `stamp`; what is of one frame is over by then.
    pub(crate) fn save(&self, stamp: Stamp) -> Vec<SavedShape> {
        let standing = self.shapes.values().filter(|(_, drawn)| !drawn.is_over(stamp));
        let standing = standing.filter(|(_, drawn)| drawn.until_nanos != 0);
        standing
            .map(|(shape, drawn)| SavedShape { shape: *shape, until_nanos: drawn.until_nanos })
            .collect()
    }

    /// Draws what stood in a saved state, and nothing else, from frame `first` on. The lines that
    /// say so.
    pub(crate) fn restore(&mut self, saved: &[SavedShape], first: Stamp) -> Vec<JournalEntry> {
        self.shapes.clear();
        let line = |SavedShape { shape, until_nanos }: &SavedShape| {
            let drawn = ShapeReceipt { frame: first.frame, until_nanos: *until_nanos };
            line(shape, self.add(shape, drawn))
        };
        saved.iter().filter(|s| s.until_nanos != 0).take(SHAPES_MAX).map(line).collect()
    }
}

fn line(shape: &Shape, outcome: Outcome) -> JournalEntry {
    Request::of_host(Command::Draw(*shape)).ended(outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{Frame, shape};

    fn at(frame: u64) -> Stamp {
        Stamp { frame: Frame(frame), sim_time_nanos: frame * 100, ..Stamp::default() }
    }

    fn lasting(life_nanos: u64) -> Shape {
        Shape { life_nanos, ..Shape::new(shape::POINT) }
    }

    fn lives(drawings: &Drawings) -> Vec<u64> {
        let of = |entry: JournalEntry| match entry.command.decode() {
            Some(Command::Draw(shape)) => shape.life_nanos,
            other => panic!("{other:?}"),
        };
        drawings.entries().map(of).collect()
    }

    #[test]
    fn what_has_ended_is_forgotten_and_what_stands_is_told() {
        let mut drawings = Drawings::default();
        for life in [0, 150, shape::FOR_EVER] {
            drawings.draw(&lasting(life), at(3)).unwrap();
        }
        drawings.forget(at(2));
        assert_eq!(lives(&drawings), [0, 150, shape::FOR_EVER]);
        drawings.forget(at(3));
        assert_eq!(lives(&drawings), [150, shape::FOR_EVER]);
        let mut heard = Drawings::default();
        for entry in drawings.entries() {
            let Some(Command::Draw(shape)) = entry.command.decode() else { panic!() };
            heard.settle(&shape, &entry.outcome);
        }
        assert_eq!(heard.shapes, drawings.shapes);
        drawings.forget(at(5));
        assert_eq!(lives(&drawings), [shape::FOR_EVER]);
        drawings.erase(&EraseShapes { shapes: 0, texts: 1 });
        assert_eq!(lives(&drawings), [shape::FOR_EVER]);
        drawings.erase(&EraseShapes::ALL);
        assert!(lives(&drawings).is_empty());
    }

    #[test]
    fn a_saved_state_brings_back_what_stood() {
        let mut drawings = Drawings::default();
        for life in [0, 150, shape::FOR_EVER] {
            drawings.draw(&lasting(life), at(3)).unwrap();
        }
        let saved = drawings.save(at(3));
        assert_eq!(saved.iter().map(|s| s.until_nanos).collect::<Vec<_>>(), [450, u64::MAX]);
        drawings.draw(&lasting(7), at(9)).unwrap();
        let told = drawings.restore(&saved, at(20));
        assert_eq!(told, drawings.entries().collect::<Vec<_>>());
        assert_eq!(lives(&drawings), [150, shape::FOR_EVER]);
        assert!(told.iter().all(|line| line.outcome.id > 4), "numbers are never given out twice");
    }

    #[test]
    fn no_more_than_fit_are_drawn() {
        let mut drawings = Drawings::default();
        for _ in 0..SHAPES_MAX {
            drawings.draw(&lasting(100), at(1)).unwrap();
        }
        let why = drawings.draw(&lasting(100), at(1)).unwrap_err();
        assert!(why.contains("16384 shapes are drawn, SHAPES_MAX is 16384"), "{why}");
        drawings.forget(at(2));
        assert!(drawings.draw(&lasting(100), at(2)).is_ok());
        assert!(drawings.draw(&Shape { size_m: f32::NAN, ..lasting(1) }, at(2)).is_err());
    }
}
