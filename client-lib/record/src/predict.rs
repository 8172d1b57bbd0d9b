//! What the next value of a column will be, from what is known by then.
//!
//! Plain IEEE arithmetic without fused operations: whoever reads predicts the same bits as who
//! wrote. Columns are coded in an order such that a prediction may use those before its own, of
//! the same frame too.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use crate::{
    columns::{Guess, Scheme},
    grid::{PAST, Row, WORDS},
};

/// Word of [`bus::ActorState`] at which a field begins.
pub(crate) mod word {
    pub(crate) const POSITION: usize = 4;
    pub(crate) const ROTATION: usize = 7;
    pub(crate) const VELOCITY: usize = 11;
    pub(crate) const SPIN: usize = 14;
    pub(crate) const ACCELERATION: usize = 17;
    pub(crate) const THROTTLE: usize = 20;
    pub(crate) const STEER: usize = 22;
    pub(crate) const GEAR: usize = 23;
    pub(crate) const ENGINE: usize = 24;
    pub(crate) const WHEEL_STEER: usize = 25;
    pub(crate) const WHEEL_SPIN: usize = 26;
    pub(crate) const PHASE: usize = 27;
}
use word::*;

/// How a column is predicted.
pub(crate) mod mode {
    /// All of it is as it was, or 0 for who is new.
    pub(crate) const STILL: u8 = 0;
    /// As it was.
    pub(crate) const LAST: u8 = 1;
    /// It goes on as before.
    pub(crate) const LINEAR: u8 = 2;
    /// By the laws of motion; the velocity within the frame counts as at its end, in the middle,
    /// or as the host's substeps take it.
    pub(crate) const MOTION: [u8; 3] = [3, 4, 5];
}

/// Share of the new velocity in the way, by mode.
const SHARE: [f32; 3] = [0.5, 0.525, 0.6];

/// Every field, exactly.
pub(crate) enum Exact {}

impl Scheme for Exact {
    #[rustfmt::skip]
    const GROUPS: &[&[usize]] = &[
        &[1], &[2], &[3], &[23], &[27], &[28], &[29], &[30], &[31],
        &[11], &[12], &[13], &[14], &[15], &[16], &[17], &[18], &[19], &[4], &[5], &[6],
        &[7, 8, 9, 10], &[20], &[21], &[22], &[25], &[24], &[26],
    ];
    const LEVEL: i32 = 3;

    fn modes(word: usize) -> &'static [u8] {
        match word {
            1 | 2 | 3 | GEAR | PHASE..WORDS => &[mode::LAST],
            POSITION..VELOCITY => &[mode::LAST, mode::LINEAR, 3, 4, 5],
            ACCELERATION..THROTTLE | ENGINE | WHEEL_STEER | WHEEL_SPIN => {
                &[mode::LAST, mode::LINEAR, 3]
            }
            _ => &[mode::LAST, mode::LINEAR],
        }
    }

    #[inline]
    fn is_float(word: usize) -> bool {
        (POSITION..GEAR).contains(&word) || (ENGINE..=WHEEL_SPIN).contains(&word)
    }

    #[inline]
    fn predict(view: &View, word: usize, mode: u8) -> Guess {
        if word == ROTATION { view.rotation(mode) } else { [view.predict(word, mode), 0, 0, 0] }
    }
}

/// The columns of an actor up to the slot that is predicted.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) columns: &'a [Vec<u32>],
    /// The slot that is predicted.
    pub(crate) slot: usize,
    /// How many slots before it are known, up to 2.
    pub(crate) known: usize,
    /// How long the frame is.
    pub(crate) step: Step,
}

/// A frame's length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    delta_s: f32,
    /// As the host computes it.
    per_second: f32,
}

impl Step {
    pub(crate) fn of(delta_nanos: u64) -> Step {
        Step {
            delta_s: (delta_nanos as f64 * 1e-9) as f32,
            per_second: (1e9 / delta_nanos.max(1) as f64) as f32,
        }
    }
}

impl<'a> View<'a> {
    /// Of a row's value in its `index`th frame.
    #[inline]
    pub(crate) fn new(
        columns: &'a [Vec<u32>],
        row: &Row,
        index: usize,
        steps: &[Step],
    ) -> View<'a> {
        View {
            columns,
            slot: row.at + index,
            known: (row.known + index).min(PAST),
            step: steps[row.from + index],
        }
    }

    #[inline]
    pub(crate) fn raw(&self, word: usize, back: usize) -> u32 {
        self.columns[word][self.slot - back]
    }

    #[inline]
    fn float(&self, word: usize, back: usize) -> f32 {
        f32::from_bits(self.raw(word, back))
    }

    #[inline]
    fn vector(&self, word: usize, back: usize) -> Vec3 {
        Vec3::new(self.float(word, back), self.float(word + 1, back), self.float(word + 2, back))
    }

    /// The bits that `word` will have.
    #[inline]
    pub(crate) fn predict(&self, word: usize, mode: u8) -> u32 {
        match (mode, self.known) {
            (_, 0) => 0,
            (mode::LINEAR, 2) => {
                (self.float(word, 1) + (self.float(word, 1) - self.float(word, 2))).to_bits()
            }
            (3..=5, _) => self.by_motion(word, SHARE[usize::from(mode - 3)]),
            _ => self.raw(word, 1),
        }
    }

    /// The bits that the four words of the rotation will have.
    #[inline]
    fn rotation(&self, mode: u8) -> Guess {
        match (mode, self.known) {
            (3..=5, 1..) => self.turned(SHARE[usize::from(mode - 3)]).map(f32::to_bits),
            _ => [0, 1, 2, 3].map(|i| self.predict(ROTATION + i, mode)),
        }
    }

    #[inline]
    fn by_motion(&self, word: usize, share: f32) -> u32 {
        match word {
            POSITION..ROTATION => {
                let axis = word - POSITION;
                let (before, after) =
                    (self.float(VELOCITY + axis, 1), self.float(VELOCITY + axis, 0));
                let mean = before + (after - before) * share;
                (self.float(word, 1) + mean * self.step.delta_s).to_bits()
            }
            ACCELERATION..THROTTLE => {
                let axis = word - ACCELERATION;
                let gained = self.float(VELOCITY + axis, 0) - self.float(VELOCITY + axis, 1);
                (gained * self.step.per_second).to_bits()
            }
            ENGINE => {
                let (before, after) = (self.speed(1), self.speed(0));
                (self.float(word, 1) * ratio(after, before)).to_bits()
            }
            WHEEL_STEER => {
                let (before, after) = (self.float(STEER, 1), self.float(STEER, 0));
                (self.float(word, 1) * ratio(after, before)).to_bits()
            }
            WHEEL_SPIN if self.known == 2 => {
                let mut step = self.float(word, 1) - self.float(word, 2);
                // Forwards the angle wraps from a full turn to 0.
                if step < 0.0 {
                    step += TAU;
                }
                let (long, now) = (self.speed(2) + self.speed(1), self.speed(1) + self.speed(0));
                let angle = self.float(word, 1) + step * ratio(now, long);
                (if angle >= TAU { angle - TAU } else { angle }).to_bits()
            }
            _ => self.raw(word, 1),
        }
    }

    #[inline]
    fn speed(&self, back: usize) -> f32 {
        let v = self.vector(VELOCITY, back);
        (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
    }

    /// The rotation after a frame of the mean spin.
    #[inline]
    fn turned(&self, share: f32) -> [f32; 4] {
        let (before, after) = (self.vector(SPIN, 1), self.vector(SPIN, 0));
        let half = (before + (after - before) * share) * (0.5 * self.step.delta_s);
        let square = half.x * half.x + half.y * half.y + half.z * half.z;
        // Sine over angle and cosine; the turn of a frame is small.
        let sine = 1.0 - square / 6.0 + square * square / 120.0;
        let cosine = 1.0 - square / 2.0 + square * square / 24.0;
        let turn = Quat::from_xyzw(half.x * sine, half.y * sine, half.z * sine, cosine);
        let was = [0, 1, 2, 3].map(|i| self.float(ROTATION + i, 1));
        let [x, y, z, w] = was;
        let t = turn;
        let turned = [
            t.w * x + t.x * w + t.y * z - t.z * y,
            t.w * y - t.x * z + t.y * w + t.z * x,
            t.w * z + t.x * y - t.y * x + t.z * w,
            t.w * w - t.x * x - t.y * y - t.z * z,
        ];
        let square = turned.iter().map(|v| v * v).sum::<f32>();
        let length = square.sqrt();
        if length > 0.5 { turned.map(|v| v / length) } else { was }
    }
}

#[inline]
fn ratio(after: f32, before: f32) -> f32 {
    let ratio = after / before;
    if ratio.is_finite() { ratio } else { 1.0 }
}
