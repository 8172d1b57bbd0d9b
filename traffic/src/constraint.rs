//! What a junction imposes on a vehicle.

/// What a junction asks of a vehicle; distances from its front bumper.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JunctionConstraint {
    /// Where it must stand, or infinity.
    pub(crate) stop_m: f32,
    /// Whom it must follow though he is on another lane yet: distance (infinity: nobody).
    pub(crate) merge_leader_m: f32,
    /// And his speed.
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

/// Why a vehicle must not pass the next junction yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WaitReason {
    /// It may, or none is near.
    #[default]
    None,
    /// A light, or a sign that asks for a full stop.
    Signal,
    /// Somebody before it on its own lane.
    Queue,
    /// No room to stand beyond the junction.
    ExitBlocked,
    /// Others whose paths cross.
    Conflict,
    /// Somebody stands where its nose or tail would sweep.
    SweptPath,
}
