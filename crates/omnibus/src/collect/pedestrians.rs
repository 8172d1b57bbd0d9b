//! Pedestrians around the ego: they walk along sidewalks, led by this client.

use std::sync::Arc;

use client_lib::Client;
use glam::{DVec3, Vec3};
use mesh::RandomStream;
use protocol::{ActorId, Command, Name, Pose, SetVelocity, Spawn, status};
use road::{LaneType, LaneTypes, Network};

use crate::collect::CollectError;

/// Frames between two corrections of the direction of walking.
const CORRECTION_FRAMES: u64 = 10;
/// Distance of the point on the sidewalk's centre that a pedestrian walks towards.
const LOOKAHEAD_M: f64 = 2.0;
/// Distance between two pedestrians where they start, at least.
const SPACING_M: f64 = 2.5;
/// Pedestrians start within this distance of the ego.
const RANGE_M: f32 = 200.0;
/// Height of a pedestrian's centre above the ground at the start.
const START_HEIGHT_M: f32 = 1.0;

/// Pedestrians, each with its direction along its sidewalk.
pub(crate) struct Pedestrians {
    network: Arc<Network>,
    walking: Vec<Walking>,
}

struct Walking {
    actor: ActorId,
    speed_mps: f32,
    /// Whether the pedestrian walks against the direction in which the lane is described.
    is_reversed: bool,
}

impl Pedestrians {
    /// Places up to `count` pedestrians ahead of the ego. Places that the host refuses are passed over.
    pub(crate) fn assemble(
        client: &mut Client,
        ego: &Pose,
        seed: u64,
        count: u32,
    ) -> Result<Pedestrians, CollectError> {
        let network = client.map()?;
        let mut pedestrians = Pedestrians { network, walking: Vec::new() };
        if count == 0 {
            return Ok(pedestrians);
        }
        let mut random = RandomStream::from_state(seed ^ 0x9ede_5712_1a95_3cc1);
        let mut places = pedestrians.places(ego);
        let blueprints: Vec<_> =
            town::catalogue().iter().filter(|b| b.id.starts_with("walker.")).collect();
        while pedestrians.walking.len() < count as usize && !places.is_empty() {
            let pose = places.swap_remove(random.below(places.len()));
            let spawn = Spawn {
                blueprint: Name::new(random.choose(&blueprints).id),
                pose,
                role: Name::new("pedestrian"),
                ..Spawn::default()
            };
            let outcomes = client.try_wire_request("spawn", &[Command::Spawn(spawn)])?;
            let speed_mps = 1.0 + random.below(60) as f32 / 100.0;
            let is_reversed = random.below(2) == 1;
            if outcomes[0].outcome.status == status::DONE
                && let Ok(id) = outcomes[0].outcome.result()
            {
                pedestrians.walking.push(Walking { actor: ActorId(id), speed_mps, is_reversed });
            }
        }
        Ok(pedestrians)
    }

    /// Places on the sidewalks ahead, with distance between them.
    fn places(&self, ego: &Pose) -> Vec<Pose> {
        let forward = ego.rotation() * Vec3::X;
        let sidewalks = LaneTypes::only(LaneType::Sidewalk);
        let points = self.network.waypoints(SPACING_M, sidewalks).into_iter();
        let placed = points.map(|point| self.network.place(point));
        placed
            .map(|place| {
                let position = place.position.as_vec3() + Vec3::Z * START_HEIGHT_M;
                Pose::level(position, place.heading_rad as f32)
            })
            .filter(|place| {
                let from_ego = place.position() - ego.position();
                from_ego.length() < RANGE_M && from_ego.dot(forward) > 0.0
            })
            .collect()
    }

    /// The commands that lead the pedestrians during the next frame.
    pub(crate) fn lead(&self, client: &Client) -> Vec<Command> {
        if !client.frame().0.is_multiple_of(CORRECTION_FRAMES) {
            return Vec::new();
        }
        let walking = self.walking.iter().filter_map(|one| self.step(client, one));
        walking.map(Command::SetVelocity).collect()
    }

    fn step(&self, client: &Client, one: &Walking) -> Option<SetVelocity> {
        let position = client.world().state(one.actor)?.pose.position().as_dvec3();
        let sidewalks = LaneTypes::only(LaneType::Sidewalk);
        let here = self.network.place(self.network.nearest(position, sidewalks)?);
        let forward = DVec3::new(here.heading_rad.cos(), here.heading_rad.sin(), 0.0);
        let along = if one.is_reversed { -forward } else { forward };
        let target = here.position + along * LOOKAHEAD_M;
        let direction = (target - position).with_z(0.0).as_vec3().normalize_or_zero();
        Some(SetVelocity {
            actor_id: one.actor,
            velocity_mps: (direction * one.speed_mps).to_array(),
            angular_velocity_radps: [0.0; 3],
        })
    }
}
