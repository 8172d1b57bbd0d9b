//! What a planner reckons with, for whoever judges it or asks why a vehicle stands.

use protocol::ActorId;
use road::LaneIndex;

use crate::constraint::WaitReason;

/// A leader farther away than this does not slow anybody down.
const LEADER_FREE_M: f32 = 60.0;
/// Nor does a stop line farther away than this.
const STOP_FREE_M: f32 = 200.0;

/// What the planner of one vehicle reckoned with in the frame that was planned last. Distances are
/// from its front bumper along its route, in metres; infinity where there is nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehiclePlan {
    /// Whose.
    pub actor_id: ActorId,
    /// The lane that it follows.
    pub lane: LaneIndex,
    /// How far along that lane its origin is, as arc length.
    pub along_m: f32,
    /// How far left of its line it is: of the lane's centre, or of its way there in a lane change.
    pub cross_track_error_m: f32,
    /// The limit that holds here.
    pub limit_mps: f32,
    /// The speed that limits and curves ahead allow.
    pub desired_speed_mps: f32,
    /// Who is in front, or [`ActorId::NONE`].
    pub leader: ActorId,
    /// To his rear.
    pub leader_m: f32,
    /// To where a junction or a light asks it to stand.
    pub stop_m: f32,
    /// To whom it must follow though he is on another lane yet.
    pub merge_m: f32,
    /// Its place in the order of those who may pass the next junction; 0: it may not.
    pub reservation: u64,
    /// How long it has waited at the line of the next junction.
    pub waited_s: f32,
    /// And what for.
    pub wait_reason: WaitReason,
    /// And for whom, or [`ActorId::NONE`].
    pub blocker: ActorId,
    /// It backs out of what blocks it.
    pub reverses: bool,
    /// It turns round at a dead end.
    pub is_turning_around: bool,
}

impl VehiclePlan {
    /// Whether nobody before it, no line and no trouble slows the vehicle down: nothing but the
    /// limit and curves.
    pub fn is_free(&self) -> bool {
        self.leader_m > LEADER_FREE_M
            && self.stop_m.min(self.merge_m) > STOP_FREE_M
            && !self.reverses
            && !self.is_turning_around
    }

    /// Whether a curve or a lower limit ahead keeps it below the limit that holds here.
    pub fn is_in_curve(&self) -> bool {
        self.desired_speed_mps < 0.95 * self.limit_mps
    }
}
