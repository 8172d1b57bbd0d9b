//! What the planner decided for a vehicle, for tests and diagnosis.

use protocol::ActorId;
use road::LaneIndex;

use crate::constraint::WaitReason;

/// Distance beyond which a leader does not slow a vehicle down.
const LEADER_FREE_M: f32 = 60.0;
/// Distance beyond which a stop line does not slow a vehicle down.
const STOP_FREE_M: f32 = 200.0;

/// What was planned for one vehicle in the last frame. Distances are from its front bumper along
/// its route, in metres; infinity where there is nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehiclePlan {
    /// The vehicle.
    pub actor_id: ActorId,
    /// The lane that it follows.
    pub lane: LaneIndex,
    /// Arc length of its origin on that lane.
    pub along_m: f32,
    /// Cross-track error, positive to the left, from the centre of the lane or the path of a lane
    /// change.
    pub cross_track_error_m: f32,
    /// Speed limit at its position.
    pub limit_mps: f32,
    /// Speed that limits and curves ahead allow.
    pub desired_speed_mps: f32,
    /// The agent that it follows, or [`ActorId::NONE`].
    pub leader: ActorId,
    /// Gap to the leader.
    pub leader_m: f32,
    /// Distance at which a junction or a traffic light requires it to stop.
    pub stop_m: f32,
    /// Gap to a leader that is still on another lane of a merge.
    pub merge_m: f32,
    /// Number of its reservation for the next junction; 0 without one.
    pub reservation: u64,
    /// Time that it has waited at the line of the next junction, seconds.
    pub waited_s: f32,
    /// Why it has no reservation.
    pub wait_reason: WaitReason,
    /// The agent that it waits for, or yields to in the junction, or [`ActorId::NONE`].
    pub blocker: ActorId,
    /// Whether it reverses away from an obstacle.
    pub reverses: bool,
    /// Whether it makes a U-turn at a dead end.
    pub is_turning_around: bool,
}

impl VehiclePlan {
    /// Returns whether only the speed limit and curves bound its speed: no leader, no stop line and
    /// no recovery.
    pub fn is_free(&self) -> bool {
        self.leader_m > LEADER_FREE_M
            && self.stop_m.min(self.merge_m) > STOP_FREE_M
            && !self.reverses
            && !self.is_turning_around
    }

    /// Returns whether a curve or a lower limit ahead keeps it below the present limit.
    pub fn is_in_curve(&self) -> bool {
        self.desired_speed_mps < 0.95 * self.limit_mps
    }
}

/// The motion that the controls of one vehicle mean to the planner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntendedMotion {
    /// 1 forwards, −1 backwards.
    pub direction: f32,
    /// Present speed straight ahead, metres per second.
    pub speed_mps: f32,
    /// Acceleration in that direction on level ground, which ends at standstill.
    pub acceleration_mps2: f32,
    /// Angle of the front wheels, positive to the left, radians.
    pub wheel_steer_rad: f32,
    /// Distance between the axles; the origin is in the middle.
    pub wheelbase_m: f32,
}
