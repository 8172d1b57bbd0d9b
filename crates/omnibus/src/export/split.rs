//! Which frames are for training, and which for validation.

use crate::export::set::Set;

/// Divides the frames of a set: the last scenes are for validation; of a single scene, its last
/// frames. Neighbouring frames resemble each other, and are not divided by chance for that reason.
pub(crate) struct Split {
    /// The first scene, and the first frame in it, that are for validation.
    validation_from: (usize, usize),
}

impl Split {
    /// Puts this fraction of the scenes, or of the frames of a single scene, into the validation
    /// part: at least one, unless the fraction is 0, and not all.
    pub(crate) fn of(set: &Set, fraction: f64) -> Split {
        let of = |count: usize| {
            let wanted = (count as f64 * fraction).round() as usize;
            let least = usize::from(fraction > 0.0);
            count - wanted.max(least).min(count - 1)
        };
        let validation_from = match set.scenes() {
            [scene] => (0, of(scene.frames())),
            scenes => (of(scenes.len()), 0),
        };
        Split { validation_from }
    }

    /// Returns the part of a frame: 0 for training, 1 for validation.
    pub(crate) fn part(&self, place: (usize, usize)) -> usize {
        usize::from(place >= self.validation_from)
    }
}

/// The names of the parts.
pub(crate) const PARTS: [&str; 2] = ["train", "val"];
