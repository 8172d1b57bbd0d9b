//! What a junction imposes on a vehicle.

/// What a junction asks of a vehicle; distances from its front bumper.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halt {
    /// Where it must stand, or infinity.
    pub(crate) stop_m: f32,
    /// Whom it must follow though he is on another lane yet: distance (infinity: nobody).
    pub(crate) behind_m: f32,
    /// And his speed.
    pub(crate) behind_mps: f32,
}

impl Halt {
    /// No constraint.
    pub(crate) const FREE: Halt =
        Halt { stop_m: f32::INFINITY, behind_m: f32::INFINITY, behind_mps: 0.0 };
}

/// Why a vehicle must not pass the next junction yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wait {
    /// It may, or none is near.
    #[default]
    No,
    /// A light, or a sign that asks for a full stop.
    Light,
    /// Somebody before it on its own lane.
    Queue,
    /// No room to stand beyond the junction.
    Room,
    /// Others whose paths cross.
    Others,
    /// Somebody stands where its nose or tail would sweep.
    Sweep,
}
