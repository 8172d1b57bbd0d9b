//! What is kept of one frame.

use bytemuck::{Pod, Zeroable};
use protocol::{ActorId, ActorState, Frame, JournalEntry, Stamp, TrafficHeader, WalkerLimbs};

/// How much of a run is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// Every published field of every actor, exactly, and the inputs.
    #[default]
    State,
    /// What was requested and decided, and the whole world now and then: exact by re-simulation.
    Inputs,
    /// Places within 1 cm and 0.1 degrees, flags, colours of lights; no inputs.
    Compact,
}

impl Profile {
    /// All there are.
    pub const ALL: [Profile; 3] = [Profile::State, Profile::Inputs, Profile::Compact];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Profile::State => "state",
            Profile::Inputs => "inputs",
            Profile::Compact => "compact",
        }
    }

    /// The profile of this name.
    pub fn by_name(name: &str) -> Option<Profile> {
        Profile::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Its number on the bus.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// The profile of this number.
    pub fn by_code(code: u32) -> Option<Profile> {
        Profile::ALL.into_iter().find(|p| p.code() == code)
    }

    /// Whether where everybody was can be read from it.
    pub fn has_states(self) -> bool {
        self != Profile::Inputs
    }

    /// Whether it can be simulated again.
    pub fn has_inputs(self) -> bool {
        self != Profile::Compact
    }
}

/// Two that touched during a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Collision {
    /// The one with the lower id.
    pub actor: ActorId,
    /// The other; nobody: a building, a pole, a trunk.
    pub other: ActorId,
    /// What `actor` was given over the frame, in world space. Newton seconds.
    pub impulse_ns: [f32; 3],
    /// 1: they did not touch at the end of the frame before.
    pub began: u32,
}

/// What traffic decided that acts in a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// The frame that it was planned on; 0: nothing was decided yet.
    pub frame: Frame,
    /// Over its payload.
    pub hash: u64,
    /// Header and payload, where they do not follow from planning on every frame in turn.
    pub whole: Option<(TrafficHeader, Vec<u8>)>,
}

/// All that is kept of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// Which frame.
    pub stamp: Stamp,
    /// How much simulated time it took.
    pub delta_nanos: u64,
    /// The longest physics substep.
    pub substep_max_nanos: u64,
    /// Over everything that decides the future.
    pub state_hash: u64,
    /// What traffic had decided.
    pub decision: Decision,
    /// How many lines of the journal were carried out before traffic's decision was taken in.
    pub early: u32,
    /// What was requested, and what became of it.
    pub journal: Vec<JournalEntry>,
    /// Who touched whom.
    pub collisions: Vec<Collision>,
    /// Everybody, by id.
    pub actors: Vec<ActorState>,
    /// The limbs of every fallen walker, by id.
    pub limbs: Vec<WalkerLimbs>,
    /// Over `actors`.
    pub shown: u64,
    /// The whole world at the end of this frame, as the host saves it.
    pub world: Option<Vec<u8>>,
}

/// The sum over what a frame showed, for `Moment::shown`.
pub(crate) fn sum_of(actors: &[ActorState]) -> u64 {
    // Four lanes at a time: the multiplications overlap.
    let mut lanes = [0xcbf2_9ce4_8422_2325u64, 1, 2, 3];
    let words = actors_as_words(actors).as_flattened();
    for group in words.as_chunks::<8>().0 {
        for (lane, [low, high]) in lanes.iter_mut().zip(group.as_chunks::<2>().0) {
            let word = u64::from(*low) | u64::from(*high) << 32;
            *lane = (lane.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
    }
    lanes.into_iter().fold(words.len() as u64 / 2, |sum, lane| {
        let mixed = (sum.rotate_left(17) ^ lane).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ (mixed >> 29)
    })
}

fn actors_as_words(actors: &[ActorState]) -> &[[u32; 32]] {
    bytemuck::cast_slice(actors)
}
