use std::io;

use client_lib::{ActorId, ClientError};

/// Why the node cannot start, or has ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Ros2Error {
    /// The simulator.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The ports of the domain cannot be opened.
    #[error("DDS domain {domain}: {source}")]
    Network {
        /// The domain.
        domain: u16,
        /// The reason.
        source: io::Error,
    },
    /// A thread cannot be started.
    #[error("thread: {0}")]
    Thread(io::Error),
    /// The number of the domain has no ports.
    #[error("domain {domain} has no ports; use 0 to {}", crate::DOMAIN_MAX)]
    Domain {
        /// The domain.
        domain: u16,
    },
    /// A name cannot be part of a topic.
    #[error(
        "{what} {name:?} cannot be part of a ROS topic; use letters, digits and underscores, with a \
         letter first"
    )]
    Name {
        /// What has the name.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// Two sensors have the same topic.
    #[error("two outputs of sensors have the topic {topic}; rename one of the sensors")]
    SameTopic {
        /// The topic.
        topic: String,
    },
    /// The actor is no vehicle, or there is none.
    #[error("{actor} {problem}; vehicles: {}", list(vehicles))]
    NoVehicle {
        /// The actor.
        actor: ActorId,
        /// What is wrong.
        problem: &'static str,
        /// The vehicles that there are, with their blueprints.
        vehicles: Vec<String>,
    },
    /// There is no such spawn point.
    #[error("spawn point {number} does not exist; the map has {count}, counted from 0")]
    SpawnPoint {
        /// The number that was named.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// No spawn point is free.
    #[error("each of the {count} spawn points of the map is occupied; destroy a vehicle")]
    NoPlace {
        /// How many there are.
        count: usize,
    },
    /// The vehicle was destroyed.
    #[error("the vehicle of role {role:?}, {actor}, was destroyed at {frame}")]
    VehicleGone {
        /// The role.
        role: String,
        /// The vehicle.
        actor: ActorId,
        /// The first frame without it.
        frame: client_lib::Frame,
    },
}

fn list(vehicles: &[String]) -> String {
    if vehicles.is_empty() { "none".to_owned() } else { vehicles.join(", ") }
}
