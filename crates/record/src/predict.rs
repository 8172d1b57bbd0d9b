//! Predicts the next value of a word from the values known by then.
//!
//! Plain IEEE arithmetic without fused operations, so that reader and writer predict the same bits.
//! Words are coded in an order such that a prediction may use the words before its own, also of the
//! same frame.

use std::{f32::consts::TAU, mem::take, ops::Range};

use protocol::parts;

use crate::{
    columns::{Pass, Scheme, Span, by_rule, mode, straight},
    grid::{Block, SLOTS},
    space::{Floats, Grid, Space, Whole},
};

/// The word of [`protocol::ActorState`] at which a field begins.
pub(crate) mod word {
    pub(crate) const POSITION: usize = 4;
    pub(crate) const ROTATION: usize = 7;
    pub(crate) const VELOCITY: usize = 11;
    pub(crate) const SPIN: usize = 14;
    pub(crate) const ACCELERATION: usize = 17;
    pub(crate) const THROTTLE: usize = 20;
    pub(crate) const STEER: usize = 22;
    pub(crate) const ENGINE: usize = 24;
    pub(crate) const WHEEL_STEER: usize = 25;
    pub(crate) const WHEEL_SPIN: usize = 26;
    pub(crate) const PHASE: usize = 27;
}
use word::*;

/// The weight of the new velocity in the displacement, by mode.
const SHARE: [f32; 3] = [0.5, 0.525, 0.6];

/// The grid on which the host rounds what it publishes; other values take more room.
type Motions = Grid<{ parts::MOTION }>;
type Engines = Grid<{ parts::ENGINE }>;
type Angles = Grid<{ parts::WHEEL }>;

/// Every field, exactly.
pub(crate) enum Exact {}

impl Scheme for Exact {
    #[rustfmt::skip]
    const GROUPS: &[&[usize]] = &[
        &[1], &[2], &[3], &[23], &[27], &[28], &[29], &[30], &[31],
        &[11, 12, 13], &[14, 15, 16], &[17, 18, 19], &[4, 5, 6], &[7, 8, 9, 10], &[20, 21, 22],
        &[24, 25, 26],
    ];
    const LEVEL: i32 = 15;
    const PARTS: usize = 2;

    fn modes(word: usize) -> &'static [u8] {
        match word {
            POSITION | ROTATION => &[mode::MOTION, 4, mode::MOTION_LAST, mode::LAST, mode::LINEAR],
            ACCELERATION => &[mode::MOTION, mode::LAST],
            ENGINE => &[mode::MOTION, mode::LAST, mode::LINEAR],
            VELOCITY | SPIN | THROTTLE => &[mode::LAST, mode::LINEAR],
            _ => &[mode::LAST],
        }
    }

    fn is_on_grid(group: &[usize], block: &Block, slots: Range<usize>) -> bool {
        let all = |word: usize, has: fn(u32) -> bool| {
            block.cells[word][slots.clone()].iter().all(|bits| has(*bits))
        };
        match group[0] {
            VELOCITY | SPIN => group.iter().all(|word| all(*word, Motions::has)),
            ENGINE => {
                all(ENGINE, Engines::has)
                    && all(WHEEL_STEER, Angles::has)
                    && all(WHEEL_SPIN, Angles::has)
            }
            _ => false,
        }
    }

    #[inline]
    fn walk<P: Pass>(
        pass: &mut P,
        block: &mut Block,
        span: &Span,
        group: &[usize],
        mode: u8,
    ) -> bool {
        let word = group[0];
        let share = || SHARE[usize::from(mode - mode::MOTION)];
        match (word, mode) {
            (POSITION, mode::MOTION..=mode::MOTION_LAST) => moved(pass, block, span, share()),
            (ROTATION, mode::MOTION..=mode::MOTION_LAST) => turned(pass, block, span, share()),
            (ROTATION, _) => straight::<Floats, P, 4>(pass, block, span, (word, 0), mode),
            (ACCELERATION, mode::MOTION) => pushed(pass, block, span),
            (ENGINE, mode::ON_GRID..) => {
                carried::<Engines, Angles, P>(pass, block, span, mode & !mode::ON_GRID)
            }
            (ENGINE, _) => carried::<Floats, Floats, P>(pass, block, span, mode),
            (VELOCITY | SPIN, mode::ON_GRID..) => {
                straight::<Motions, P, 3>(pass, block, span, (word, 0), mode)
            }
            (POSITION | VELOCITY | SPIN | ACCELERATION | THROTTLE, _) => {
                straight::<Floats, P, 3>(pass, block, span, (word, 0), mode)
            }
            _ => straight::<Whole, P, 1>(pass, block, span, (word, 0), mode),
        }
    }
}

/// Predicts from the mean velocity.
#[inline]
fn moved<P: Pass>(pass: &mut P, block: &mut Block, span: &Span, share: f32) -> bool {
    by_rule::<Floats, P, 3>(pass, block, span, POSITION, |block, slot, step| {
        let mut guess = [0.0; 3];
        for (axis, guess) in guess.iter_mut().enumerate() {
            let before = block.float(VELOCITY + axis, slot - 1);
            let mean = before + (block.float(VELOCITY + axis, slot) - before) * share;
            *guess = block.float(POSITION + axis, slot - 1) + mean * step.delta_s;
        }
        guess
    })
}

/// Predicts from the velocity gained.
#[inline]
fn pushed<P: Pass>(pass: &mut P, block: &mut Block, span: &Span) -> bool {
    by_rule::<Floats, P, 3>(pass, block, span, ACCELERATION, |block, slot, step| {
        let mut guess = [0.0; 3];
        for (axis, guess) in guess.iter_mut().enumerate() {
            let (before, after) =
                (block.float(VELOCITY + axis, slot - 1), block.float(VELOCITY + axis, slot));
            *guess = (after - before) * step.per_second;
        }
        guess
    })
}

/// Predicts from the speed and the steering of the vehicle.
#[inline]
fn carried<E: Space, A: Space, P: Pass>(
    pass: &mut P,
    block: &mut Block,
    span: &Span,
    mode: u8,
) -> bool {
    if mode != mode::MOTION {
        return straight::<E, P, 1>(pass, block, span, (ENGINE, 0), mode)
            && straight::<A, P, 2>(pass, block, span, (WHEEL_STEER, 1), mode);
    }
    let speeds = speeds(block, span);
    let mut own = take(pass);
    for slot in span.start..span.end {
        let (before, now) = (speeds[slot - 1], speeds[slot]);
        let rpm = block.float(ENGINE, slot - 1) * ratio(now, before);
        let steer = ratio(block.float(STEER, slot), block.float(STEER, slot - 1));
        let steer_rad = block.float(WHEEL_STEER, slot - 1) * steer;
        let mut angle = block.float(WHEEL_SPIN, slot - 1);
        if slot >= span.both {
            let mut step = angle - block.float(WHEEL_SPIN, slot - 2);
            // Driving forwards, the angle wraps from a full turn to 0.
            if step < 0.0 {
                step += TAU;
            }
            angle += step * ratio(before + now, speeds[slot - 2] + before);
            if angle >= TAU {
                angle -= TAU;
            }
        }
        own.value::<E>(&mut block.cells[ENGINE][slot], E::number(rpm.to_bits()), 0);
        let guess = A::number(steer_rad.to_bits());
        own.value::<A>(&mut block.cells[WHEEL_STEER][slot], guess, 1);
        own.value::<A>(&mut block.cells[WHEEL_SPIN][slot], A::number(angle.to_bits()), 2);
    }
    *pass = own;
    true
}

/// By slot, from two before the first on.
#[inline]
fn speeds(block: &Block, span: &Span) -> [f32; SLOTS] {
    let mut speeds = [0.0; SLOTS];
    for (slot, speed) in speeds.iter_mut().enumerate().take(span.end).skip(span.start - 2) {
        let x = block.float(VELOCITY, slot);
        let y = block.float(VELOCITY + 1, slot);
        let z = block.float(VELOCITY + 2, slot);
        *speed = (x * x + y * y + z * z).sqrt();
    }
    speeds
}

#[inline]
fn ratio(after: f32, before: f32) -> f32 {
    let ratio = after / before;
    if ratio.is_finite() { ratio } else { 1.0 }
}

/// Predicts the rotation after a frame with the mean spin. The largest component follows from the
/// others.
#[inline]
fn turned<P: Pass>(pass: &mut P, block: &mut Block, span: &Span, share: f32) -> bool {
    let turns = turns(block, span, share);
    let mut own = take(pass);
    let mut was = [0, 1, 2, 3].map(|place| block.float(ROTATION + place, span.start - 1));
    for (slot, turn) in turns.iter().enumerate().take(span.end).skip(span.start) {
        let guess = product(turn, &was);
        let mut largest = 0;
        for place in 1..4 {
            if guess[place].abs() > guess[largest].abs() {
                largest = place;
            }
        }
        let mut missing = 1.0 - f64::from(guess[largest]) * f64::from(guess[largest]);
        let share = 0.5 / guess[largest];
        for (place, guess) in guess.iter().enumerate() {
            if place != largest {
                let cell = &mut block.cells[ROTATION + place][slot];
                own.value::<Floats>(cell, Floats::number(guess.to_bits()), place);
                was[place] = f32::from_bits(*cell);
                missing -= f64::from(was[place]) * f64::from(was[place]);
            }
        }
        // One Newton step towards unit length.
        let guess = guess[largest] + missing as f32 * share;
        let cell = &mut block.cells[ROTATION + largest][slot];
        own.value::<Floats>(cell, Floats::number(guess.to_bits()), largest);
        was[largest] = f32::from_bits(*cell);
    }
    *pass = own;
    true
}

/// Returns the rotation by the mean spin in each slot's frame, as x, y, z, w.
#[inline]
fn turns(block: &Block, span: &Span, share: f32) -> [[f32; 4]; SLOTS] {
    let mut turns = [[0.0; 4]; SLOTS];
    for (slot, turn) in turns.iter_mut().enumerate().take(span.end).skip(span.start) {
        let half_s = 0.5 * span.step(slot).delta_s;
        let half = |word: usize| {
            let before = block.float(word, slot - 1);
            (before + (block.float(word, slot) - before) * share) * half_s
        };
        let (x, y, z) = (half(SPIN), half(SPIN + 1), half(SPIN + 2));
        let square = x * x + y * y + z * z;
        // Sine over angle and cosine by series; the rotation in a frame is small.
        let sine = 1.0 - square / 6.0 + square * square / 120.0;
        let cosine = 1.0 - square / 2.0 + square * square / 24.0;
        *turn = [x * sine, y * sine, z * sine, cosine];
    }
    turns
}

/// Returns the product of two rotations, normalised.
#[inline]
fn product([tx, ty, tz, tw]: &[f32; 4], [x, y, z, w]: &[f32; 4]) -> [f32; 4] {
    let (rx, ry, rz, rw) = (
        (tw * x + tx * w) + (ty * z - tz * y),
        (tw * y - tx * z) + (ty * w + tz * x),
        (tw * z + tx * y) - (ty * x - tz * w),
        (tw * w - tx * x) - (ty * y + tz * z),
    );
    let scale = 1.5 - 0.5 * ((rx * rx + ry * ry) + (rz * rz + rw * rw));
    [rx * scale, ry * scale, rz * scale, rw * scale]
}
