//! Actors: spawned, destroyed, moved.

use glam::Vec3;
use protocol::{ActorId, Name, Pose, Weather, flag};
use road::Network;

use crate::{Client, ClientError, Command};

/// What to spawn, and where.
#[derive(Clone, Copy, Debug)]
#[must_use = "hand it to Client::spawn"]
pub struct Spawn(protocol::Spawn);

impl Spawn {
    /// An actor of a blueprint at `world_from_actor`. A vehicle is set onto the road below it.
    pub fn new(blueprint: &str, pose: Pose) -> Spawn {
        Spawn(protocol::Spawn {
            blueprint: Name::new(blueprint),
            pose,
            ..protocol::Spawn::default()
        })
    }

    /// Lets traffic drive it.
    pub fn autopilot(mut self) -> Spawn {
        self.0.flags |= flag::AUTOPILOT;
        self
    }

    /// Moves it by teleports and set velocities only, not by physics.
    pub fn kinematic(mut self) -> Spawn {
        self.0.flags |= flag::KINEMATIC;
        self
    }

    /// Lets a walker fall when it is hit.
    pub fn ragdoll_on_hit(mut self) -> Spawn {
        self.0.flags |= flag::RAGDOLL_ON_HIT;
        self
    }

    /// Lets a walker stand up 5 s of simulated time after it fell ([`protocol::LIE_NANOS`]), where it
    /// lies, as soon as there is room.
    pub fn gets_up_after_fall(mut self) -> Spawn {
        self.0.flags |= flag::GETS_UP_AFTER_FALL;
        self
    }

    /// Makes a kinematic prop dynamic when a moving actor touches it: it stays where it is spawned
    /// until a vehicle pushes it aside.
    pub fn released_on_hit(mut self) -> Spawn {
        self.0.flags |= flag::RELEASED_ON_HIT;
        self
    }

    /// Lets the host destroy a walker 10 s of simulated time after it fell
    /// ([`protocol::BODY_LIFE_NANOS`]), as CARLA's server does.
    pub fn removed_after_fall(mut self) -> Spawn {
        self.0.flags |= flag::REMOVED_AFTER_FALL;
        self
    }

    /// Paints it: red, green, blue, sRGB.
    pub fn color(mut self, [r, g, b]: [u8; 3]) -> Spawn {
        self.0.color = u32::from_le_bytes([r, g, b, 255]);
        self
    }

    /// Sets its role name, as `hero`: at most 40 bytes.
    pub fn role(mut self, role: &str) -> Spawn {
        self.0.role = Name::new(role);
        self
    }

    /// The command in the protocol's layout.
    #[must_use]
    pub fn wire(self) -> protocol::Command {
        protocol::Command::Spawn(self.0)
    }
}

impl From<Spawn> for Command {
    fn from(spawn: Spawn) -> Command {
        Command(spawn.wire())
    }
}

impl Client {
    /// Spawns an actor. It exists when this returns; the next frame shows it.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`]: the place is occupied, the blueprint is unknown, or the pose is
    /// not finite; and as for [`Controller::try_request`](crate::Controller::try_request).
    pub fn spawn(&mut self, spawn: Spawn) -> Result<ActorId, ClientError> {
        self.request_one("spawn", spawn.wire()).map(ActorId)
    }

    /// Destroys an actor, and every bundle on it.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist.
    pub fn destroy(&mut self, actor: ActorId) -> Result<(), ClientError> {
        self.request_one("destroy", Command::destroy(actor).0).map(drop)
    }

    /// Moves an actor to `world_from_actor`, at rest.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist, or the pose is not finite.
    pub fn teleport(&mut self, actor_id: ActorId, pose: Pose) -> Result<(), ClientError> {
        self.request_one("teleport", Command::teleport(actor_id, pose).0).map(drop)
    }

    /// Hands a vehicle or walker to traffic, or takes it back.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist or is neither.
    pub fn set_autopilot(&mut self, actor_id: ActorId, on: bool) -> Result<(), ClientError> {
        self.request_one("autopilot", Command::set_autopilot(actor_id, on).0).map(drop)
    }

    /// Sets sun, clouds, rain and fog.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if a value is not finite.
    pub fn set_weather(&mut self, weather: Weather) -> Result<(), ClientError> {
        self.request_one("weather", Command::set_weather(weather).0).map(drop)
    }

    /// Returns sun, clouds, rain and fog as they were set last, by whichever client.
    ///
    /// # Errors
    ///
    /// As for [`Queries`](crate::Queries).
    pub fn weather(&self) -> Result<Weather, ClientError> {
        self.queries().weather()
    }

    /// Returns poses for vehicles, half a metre above the road.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn spawn_points(&self) -> Result<Vec<Pose>, ClientError> {
        Ok(spawn_poses(&*self.map()?))
    }
}

/// Returns poses for vehicles on a map, half a metre above the road.
#[must_use]
pub fn spawn_poses(network: &Network) -> Vec<Pose> {
    let pose = |at| {
        let place = network.place(at);
        let position = place.position.as_vec3() + Vec3::Z * 0.5;
        Pose::new(position, place.rotation().as_quat())
    };
    network.spawn_points().into_iter().map(pose).collect()
}
