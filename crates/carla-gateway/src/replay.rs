//! What the next replay is to be like, and whom the spectator follows while one goes on.

use client_lib::{ActorId, Pose, World};

/// Where CARLA's spectator is put behind whom it follows, and how high. Metres.
pub(crate) const SPECTATOR_BACK_M: f32 = 10.0;
pub(crate) const SPECTATOR_UP_M: f32 = 5.0;

/// CARLA's replayer, as far as it is set from outside.
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

/// Whom the spectator follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follow {
    pub(crate) actor: u32,
    /// `actor_from_spectator`.
    pub(crate) offset: Pose,
    /// The replay's end, in simulated time.
    pub(crate) until_nanos: u64,
}

impl Replayer {
    /// Where the spectator stands in this frame, if it follows somebody who is there.
    pub(crate) fn spectator(&mut self, world: &World) -> Option<Pose> {
        let follow = self.follow?;
        if world.header().stamp.sim_time_nanos > follow.until_nanos {
            self.follow = None;
            return None;
        }
        let at = world.actor(ActorId(follow.actor))?.pose;
        let (_, rotation, position) =
            (at.affine() * follow.offset.affine()).to_scale_rotation_translation();
        Some(Pose::new(position, rotation))
    }
}
