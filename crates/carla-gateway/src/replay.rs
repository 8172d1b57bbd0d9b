//! The settings of the next replay, and the actor that the spectator follows during a replay.

use client_lib::{ActorId, Pose, World};

/// Where CARLA puts the spectator: this far behind the actor that it follows, and this high.
/// Metres.
pub(crate) const SPECTATOR_BACK_M: f32 = 10.0;
pub(crate) const SPECTATOR_UP_M: f32 = 5.0;

/// The settings of CARLA's replayer.
pub(crate) struct Replayer {
    pub(crate) time_factor: f32,
    pub(crate) ignore_hero: bool,
    pub(crate) follow: Option<Follow>,
}

impl Default for Replayer {
    fn default() -> Replayer {
        Replayer { time_factor: 1.0, ignore_hero: false, follow: None }
    }
}

/// The actor that the spectator follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follow {
    pub(crate) actor: u32,
    /// `actor_from_spectator`.
    pub(crate) offset: Pose,
    /// The simulated time at which the replay ends. Nanoseconds.
    pub(crate) until_nanos: u64,
}

impl Replayer {
    /// Returns the pose of the spectator in this frame if it follows an actor that exists.
    pub(crate) fn spectator(&mut self, world: &World) -> Option<Pose> {
        let follow = self.follow?;
        if world.header().stamp.sim_time_nanos > follow.until_nanos {
            self.follow = None;
            return None;
        }
        let at = world.state(ActorId(follow.actor))?.pose;
        let (_, rotation, position) =
            (at.affine() * follow.offset.affine()).to_scale_rotation_translation();
        Some(Pose::new(position, rotation))
    }
}
