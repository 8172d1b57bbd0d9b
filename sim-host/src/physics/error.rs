use protocol::ActorId;

/// The cause of a refused command. The world is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhysicsError {
    /// No actor has this id.
    #[error("{0} does not exist")]
    Unknown(ActorId),
    /// An actor has this id already.
    #[error("{0} exists already")]
    Taken(ActorId),
    /// The actor would overlap an obstacle.
    #[error("{actor} would stand in {obstacle}; choose another position")]
    Blocked {
        /// The actor to be spawned.
        actor: ActorId,
        /// The obstacle: `actor 12`, `a building`.
        obstacle: String,
    },
    /// A number is not finite or out of range, a quaternion has no unit length, or a pose lies too
    /// far out.
    #[error("the {what} of {actor} is {value}: {why}")]
    Bad {
        /// The actor that the command names.
        actor: ActorId,
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: String,
        /// The rule that it violates.
        why: &'static str,
    },
    /// The command does not apply to this kind of actor.
    #[error("{0} is not a {1}")]
    WrongKind(ActorId, &'static str),
    /// The walker has fallen; it cannot walk, jump or be given a velocity.
    #[error("{0} has fallen and lies on the ground")]
    Fallen(ActorId),
    /// An obstacle is in the way of every door that should open.
    #[error("{obstacle} is in the way of the doors of {actor}")]
    DoorBlocked {
        /// The vehicle.
        actor: ActorId,
        /// The obstacle: `actor 12`, `a building`.
        obstacle: String,
    },
    /// The number of wheels differs from that of the vehicle.
    #[error("{actor} has {wheels} wheels, not {given}")]
    WheelCount {
        /// The vehicle.
        actor: ActorId,
        /// The number of wheels in the command.
        given: usize,
        /// The number of wheels of the vehicle.
        wheels: usize,
    },
    /// The vehicle has no wheel of this index.
    #[error("{actor} has {wheels} wheels; there is no wheel {index}")]
    NoWheel {
        /// The vehicle.
        actor: ActorId,
        /// The index in the query.
        index: u32,
        /// The number of wheels of the vehicle.
        wheels: usize,
    },
    /// A value is out of its range; the text names the value and the range.
    #[error("{0}: {1}")]
    Refused(ActorId, String),
    /// A saved state cannot be read.
    #[error("the saved physics state is of another build or damaged: {0}")]
    Damaged(String),
}
