//! Constraints of a junction on a vehicle.

/// What a junction requires of a vehicle. Distances are from its front bumper.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JunctionConstraint {
    /// Distance at which the vehicle must stop, or infinity.
    pub(crate) stop_m: f32,
    /// Gap to a leader that is still on another lane of a merge, or infinity.
    pub(crate) merge_leader_m: f32,
    /// Speed of that leader.
    pub(crate) merge_leader_mps: f32,
}

impl JunctionConstraint {
    /// No constraint.
    pub(crate) const FREE: JunctionConstraint = JunctionConstraint {
        stop_m: f32::INFINITY,
        merge_leader_m: f32::INFINITY,
        merge_leader_mps: 0.0,
    };
}

/// Why a vehicle has no reservation for the next junction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WaitReason {
    /// It has one, or no junction is near.
    #[default]
    None,
    /// A traffic light, or a sign that requires a full stop.
    Signal,
    /// A vehicle ahead on the same lane has none.
    Queue,
    /// No room to stand beyond the junction.
    ExitBlocked,
    /// Vehicles on conflicting paths.
    Conflict,
    /// A vehicle stands in the swept path.
    SweptPath,
}
