//! Positions only: centimetres and fifths of a degree.

use glam::{EulerRot, Quat, Vec3};
use protocol::{ActorState, Pose};

use crate::{
    columns::{Pass, Scheme, Span, mode, straight},
    grid::Block,
    predict::word::{PHASE, POSITION, ROTATION},
    space::Whole,
};

/// Grid of a coordinate: at most half a step of error on each axis, 9 mm in space.
const STEP_M: f32 = 0.01;
/// Grid of an angle: at most half a step of error.
const STEP_RAD: f32 = std::f32::consts::PI / 900.0;

/// Whole steps, predicted linearly.
pub(crate) enum Compact {}

impl Scheme for Compact {
    #[rustfmt::skip]
    const GROUPS: &[&[usize]] = &[
        &[1], &[2], &[3], &[PHASE], &[28], &[29], &[POSITION], &[POSITION + 1], &[POSITION + 2],
        &[ROTATION], &[ROTATION + 1], &[ROTATION + 2],
    ];
    const LEVEL: i32 = 15;
    const PARTS: usize = 1;

    fn modes(word: usize) -> &'static [u8] {
        match word {
            POSITION..=9 => &[mode::LAST, mode::LINEAR],
            _ => &[mode::LAST],
        }
    }

    fn is_on_grid(_: &[usize], _: &Block, _: std::ops::Range<usize>) -> bool {
        false
    }

    #[inline]
    fn walk<P: Pass>(
        pass: &mut P,
        block: &mut Block,
        span: &Span,
        group: &[usize],
        mode: u8,
    ) -> bool {
        straight::<Whole, P, 1>(pass, block, span, (group[0], 0), mode)
    }
}

/// Rounds a state to whole steps, stored in the words of the fields.
pub(crate) fn quantised(state: &ActorState) -> ActorState {
    let (yaw, pitch, roll) = state.pose.rotation().to_euler(EulerRot::ZYX);
    let mut words = [0u32; crate::grid::WORDS];
    let of: &crate::grid::Words = crate::grid::words_of(state);
    for word in [0, 1, 2, 3, PHASE, 28, 29] {
        words[word] = of[word];
    }
    for (axis, metres) in state.pose.position_m.into_iter().enumerate() {
        words[POSITION + axis] = (metres / STEP_M).round() as i32 as u32;
    }
    for (axis, angle) in [yaw, pitch, roll].into_iter().enumerate() {
        words[ROTATION + axis] = (angle / STEP_RAD).round() as i32 as u32;
    }
    bytemuck::cast(words)
}

/// Inverts [`quantised`] within the rounding error.
pub(crate) fn restored(kept: &ActorState) -> ActorState {
    let words: &crate::grid::Words = crate::grid::words_of(kept);
    let step = |word: usize| words[word] as i32 as f32;
    let position = Vec3::from_array([0, 1, 2].map(|axis| step(POSITION + axis) * STEP_M));
    let [yaw, pitch, roll] = [0, 1, 2].map(|axis| step(ROTATION + axis) * STEP_RAD);
    let rotation = Quat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
    ActorState { pose: Pose::new(position, rotation), ..unplaced(words) }
}

fn unplaced(words: &crate::grid::Words) -> ActorState {
    let mut words = *words;
    words[POSITION..=ROTATION + 2].fill(0);
    bytemuck::cast(words)
}
