use protocol::ActorId;

/// Why a command was not carried out. The world is as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhysicsError {
    /// The name is not in use.
    #[error("{0} does not exist")]
    Unknown(ActorId),
    /// The name is in use.
    #[error("{0} exists already")]
    Taken(ActorId),
    /// Something stands where the actor was to be.
    #[error("{actor} would stand in {obstacle}; choose another place")]
    Blocked {
        /// Who was to be spawned.
        actor: ActorId,
        /// `actor 12`, `a building`.
        obstacle: String,
    },
    /// A number is not finite, a quaternion not of unit length, or the world is not that wide.
    #[error("the {what} of {actor} is {value}: {why}")]
    Bad {
        /// Whose.
        actor: ActorId,
        /// What was given.
        what: &'static str,
        /// As given.
        value: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The command fits another kind of actor.
    #[error("{0} is not a {1}")]
    WrongKind(ActorId, &'static str),
    /// A number is out of its range; which, and what the range is.
    #[error("{0}: {1}")]
    Refused(ActorId, String),
    /// A saved state cannot be read.
    #[error("the saved state is not of this build or is damaged: {0}")]
    Damaged(String),
}
