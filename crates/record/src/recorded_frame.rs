//! What is recorded of one frame.

use bytemuck::{Pod, Zeroable};
use protocol::{ActorId, ActorState, Frame, JournalEntry, Stamp, TrafficHeader, WalkerLimbs};

/// How much of each frame is recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// Every published field of every actor, exactly, and the inputs.
    #[default]
    State,
    /// Commands and decisions, and the whole world at intervals: exact by re-simulation.
    Inputs,
    /// Positions within 1 cm and 0.1 degrees, flags, colours of lights; no inputs.
    Compact,
}

impl Profile {
    /// All profiles.
    pub const ALL: [Profile; 3] = [Profile::State, Profile::Inputs, Profile::Compact];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Profile::State => "state",
            Profile::Inputs => "inputs",
            Profile::Compact => "compact",
        }
    }

    /// Returns the profile of this name.
    pub fn by_name(name: &str) -> Option<Profile> {
        Profile::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Returns the code on the bus.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Returns the profile of this code.
    pub fn by_code(code: u32) -> Option<Profile> {
        Profile::ALL.into_iter().find(|p| p.code() == code)
    }

    /// Returns whether the recording holds the states of actors.
    pub fn has_states(self) -> bool {
        self != Profile::Inputs
    }

    /// Returns whether the recording can be simulated again.
    pub fn has_inputs(self) -> bool {
        self != Profile::Compact
    }
}

/// A contact between two actors during a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Collision {
    /// The actor with the lower id.
    pub actor: ActorId,
    /// The other actor; `ActorId::NONE` for the ground, a building or another static object.
    pub other: ActorId,
    /// Impulse on `actor` over the frame, in world space. Newton seconds.
    pub impulse_ns: [f32; 3],
    /// 1 if the two did not touch at the end of the frame before.
    pub began: u32,
}

/// The decision of traffic that acts in a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// The frame it was planned on; 0 before the first decision.
    pub frame: Frame,
    /// Hash of its payload.
    pub hash: u64,
    /// Header and payload, if they do not follow from planning on every frame in turn.
    pub whole: Option<(TrafficHeader, Vec<u8>)>,
}

/// Everything that is recorded of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedFrame {
    /// Frame, simulated time and episode.
    pub stamp: Stamp,
    /// Simulated time of the frame.
    pub delta_nanos: u64,
    /// The longest physics substep.
    pub substep_max_nanos: u64,
    /// Hash of everything that decides the future.
    pub state_hash: u64,
    /// The decision of traffic.
    pub decision: Decision,
    /// The number of journal entries that were executed before the decision of traffic was applied.
    pub early: u32,
    /// Commands and their outcomes.
    pub journal: Vec<JournalEntry>,
    /// The contacts during the frame.
    pub collisions: Vec<Collision>,
    /// All actors, sorted by id.
    pub actors: Vec<ActorState>,
    /// The limbs of every fallen walker, sorted by id.
    pub limbs: Vec<WalkerLimbs>,
    /// Hash of `actors`.
    pub shown: u64,
    /// The whole world at the end of this frame, as the host saves it.
    pub world: Option<Vec<u8>>,
}

/// Returns the hash of the actors of a frame, for `RecordedFrame::shown`.
pub(crate) fn sum_of(actors: &[ActorState]) -> u64 {
    // Four independent lanes, so that the multiplications overlap.
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
