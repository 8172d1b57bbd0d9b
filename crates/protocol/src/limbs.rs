//! How one who fell lies: turns of limbs, packed into the words that only vehicles use.

use glam::{Quat, Vec3};

use crate::{ActorState, flag};

/// How many parts of one who fell turn against the part that carries them. In their order: chest,
/// head, left arm and forearm, right ones, left thigh and shin, right ones. The hips carry chest and
/// thighs, the chest carries head and arms.
pub const LIMBS: usize = 10;

/// Those that turn about y alone: elbows and knees.
const HINGES: [usize; 4] = [3, 5, 7, 9];
/// The others.
const BALLS: [usize; 6] = [0, 1, 2, 4, 6, 8];
/// Of one number; a word holds two, which any float of that size does exactly.
const BITS: u32 = 12;
/// Whole steps to half a turn.
const HALF_TURN: f32 = 2047.0;

impl ActorState {
    /// Of a walker who fell: how each limb is turned against the one that carries it, within a
    /// tenth of a degree. Its pose is that of the hips, from between the feet as it stood.
    pub fn limbs(&self) -> Option<[Quat; LIMBS]> {
        if !self.has(flag::DOWN) {
            return None;
        }
        let mut turns = [Quat::IDENTITY; LIMBS];
        let numbers: Vec<f32> = self.limb_words().into_iter().flat_map(unpacked).collect();
        for (ball, axes) in BALLS.into_iter().zip(numbers.chunks_exact(3)) {
            turns[ball] = Quat::from_scaled_axis(Vec3::from_slice(axes));
        }
        for (hinge, angle) in HINGES.into_iter().zip(&numbers[18..]) {
            turns[hinge] = Quat::from_rotation_y(*angle);
        }
        Some(turns)
    }

    /// Says how one who fell lies; see [`ActorState::limbs`].
    pub fn set_limbs(&mut self, turns: &[Quat; LIMBS]) {
        let mut numbers = [0.0; 22];
        for (ball, axes) in BALLS.into_iter().zip(numbers.chunks_exact_mut(3)) {
            axes.copy_from_slice(&short(turns[ball]).to_scaled_axis().to_array());
        }
        for (hinge, angle) in HINGES.into_iter().zip(&mut numbers[18..]) {
            let turn = short(turns[hinge]);
            *angle = 2.0 * turn.y.atan2(turn.w);
        }
        let mut words = numbers.chunks_exact(2).map(|pair| packed([pair[0], pair[1]]));
        self.each_limb_word(|| words.next().unwrap_or_default());
    }

    /// One who stands again: the words are as they were.
    pub fn clear_limbs(&mut self) {
        self.each_limb_word(|| 0);
    }

    /// The last two, which a recording of places keeps, hold elbows and knees.
    fn limb_words(&self) -> [u32; 11] {
        let whole = |value: f32| value as u32;
        [
            whole(self.throttle),
            whole(self.brake),
            whole(self.steer),
            self.gear as u32,
            whole(self.engine_rpm),
            whole(self.wheel_steer_rad),
            whole(self.wheel_spin_rad),
            self.lamps,
            self.doors,
            self.phase,
            self.signal,
        ]
    }

    fn each_limb_word(&mut self, mut next: impl FnMut() -> u32) {
        self.throttle = next() as f32;
        self.brake = next() as f32;
        self.steer = next() as f32;
        self.gear = next() as i32;
        self.engine_rpm = next() as f32;
        self.wheel_steer_rad = next() as f32;
        self.wheel_spin_rad = next() as f32;
        self.lamps = next();
        self.doors = next();
        self.phase = next();
        self.signal = next();
    }
}

/// The one of two quaternions of a turn that goes the short way.
fn short(turn: Quat) -> Quat {
    if turn.w < 0.0 { -turn } else { turn }
}

fn packed(pair: [f32; 2]) -> u32 {
    let mask = (1 << BITS) - 1;
    let steps = pair.map(|angle| {
        let steps = (angle / std::f32::consts::PI * HALF_TURN).round();
        steps.clamp(-HALF_TURN, HALF_TURN) as i32 as u32 & mask
    });
    steps[0] | steps[1] << BITS
}

fn unpacked(word: u32) -> [f32; 2] {
    [word, word >> BITS].map(|bits| {
        // The sign goes to the top and comes back.
        let steps = (bits << (32 - BITS)) as i32 >> (32 - BITS);
        steps as f32 / HALF_TURN * std::f32::consts::PI
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limbs_come_back_within_a_tenth_of_a_degree() {
        let ball = |i: usize| {
            let axis = Vec3::new(0.3, -0.8 + i as f32 * 0.2, 0.5 - i as f32 * 0.1);
            Quat::from_scaled_axis(axis.normalize_or(Vec3::X) * (0.5 * i as f32 - 2.5))
        };
        let mut turns: [Quat; LIMBS] = std::array::from_fn(ball);
        for (hinge, angle) in HINGES.into_iter().zip([-2.4f32, 0.0, 2.3, 0.001]) {
            turns[hinge] = Quat::from_rotation_y(angle);
        }
        let mut state = ActorState::default();
        state.set_limbs(&turns);
        assert_eq!(state.limbs(), None, "who stands has none");
        state.flags = flag::DOWN;
        for (limb, (a, b)) in turns.iter().zip(state.limbs().unwrap()).enumerate() {
            assert!(a.angle_between(b) < 0.003, "limb {limb}: {a} {b}");
        }
        let values = [state.throttle, state.engine_rpm, state.wheel_spin_rad];
        assert!(values.iter().all(|v| (0.0..16_777_216.0).contains(v) && v.fract() == 0.0));
        state.clear_limbs();
        assert_eq!(state.limbs(), Some([Quat::IDENTITY; LIMBS]), "zeros are a straight body");
    }
}
