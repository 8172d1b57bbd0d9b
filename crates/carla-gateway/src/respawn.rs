//! CARLA's respawn of dormant vehicles: vehicles of the traffic manager that are far from every hero
//! continue at a free spawn point nearer to one.

use client_lib::{
    ActorId, Pose, World, spawn_poses,
    wire::{Command, Teleport, flag, kind},
};
use glam::Vec3;
use road::Network;

/// Distance of a spawn point from every vehicle from which on it is free. Metres.
const FREE_M: f32 = 12.0;
/// Vehicles that are moved in one frame at most.
const PER_FRAME: usize = 2;
/// CARLA's default boundaries: the lower one, and `actor_active_distance`. Metres.
const BOUNDARIES_M: [f32; 2] = [25.0, 2000.0];

/// Whether and whither vehicles respawn.
pub(crate) struct Respawn {
    pub(crate) is_on: bool,
    /// The least and the greatest distance from the nearest hero of a vehicle that respawned. Metres.
    pub(crate) boundaries_m: [f32; 2],
    /// The spawn points of the map, once they are needed.
    places: Vec<Pose>,
    /// Index of the spawn point that is tried first.
    next: usize,
}

/// A vehicle, its place, and whether traffic drives it.
type Vehicle = (ActorId, Vec3, bool);

impl Default for Respawn {
    fn default() -> Respawn {
        Respawn { is_on: false, boundaries_m: BOUNDARIES_M, places: Vec::new(), next: 0 }
    }
}

impl Respawn {
    /// Returns the commands that move vehicles before the next frame.
    pub(crate) fn commands(
        &mut self,
        world: &World,
        network: &Network,
        is_hero: impl Fn(u32) -> bool,
    ) -> Vec<Command> {
        if !self.is_on {
            return Vec::new();
        }
        if self.places.is_empty() {
            self.places = spawn_poses(network);
        }
        let vehicles: Vec<Vehicle> = (world.states().iter())
            .filter(|actor| actor.kind == kind::VEHICLE)
            .map(|actor| (actor.actor_id, actor.pose.position(), actor.has(flag::AUTOPILOT)))
            .collect();
        let heroes = vehicles.iter().filter(|(id, ..)| is_hero(id.0));
        let heroes: Vec<Vec3> = heroes.map(|(_, place, _)| *place).collect();
        let moves = self.moves(&heroes, &vehicles);
        moves.into_iter().map(Command::Teleport).collect()
    }

    fn moves(&mut self, heroes: &[Vec3], vehicles: &[Vehicle]) -> Vec<Teleport> {
        let [lower_m, upper_m] = self.boundaries_m;
        let distance_m = |place: Vec3| {
            heroes.iter().map(|hero| hero.distance(place)).fold(f32::INFINITY, f32::min)
        };
        if heroes.is_empty() {
            return Vec::new();
        }
        let mut taken: Vec<Vec3> = vehicles.iter().map(|(_, place, _)| *place).collect();
        let is_far = |(_, place, on): &&Vehicle| *on && distance_m(*place) > upper_m;
        let mut moves = Vec::new();
        for (actor_id, ..) in vehicles.iter().filter(is_far).take(PER_FRAME) {
            let count = self.places.len();
            let mut tried = (0..count).map(|step| (self.next + step) % count);
            let free = tried.find(|index| {
                let place = self.places[*index].position();
                (lower_m..=upper_m).contains(&distance_m(place))
                    && taken.iter().all(|other| other.distance(place) > FREE_M)
            });
            let Some(index) = free else { break };
            let pose = self.places[index];
            self.next = (index + 1) % count;
            taken.push(pose.position());
            moves.push(Teleport { actor_id: *actor_id, pose });
        }
        moves
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of spawn points, 20 m apart, and a hero at its beginning.
    fn row(boundaries_m: [f32; 2]) -> Respawn {
        let places = (0..50).map(|n| Pose::level(Vec3::X * (20.0 * n as f32), 0.0)).collect();
        Respawn { is_on: true, boundaries_m, places, next: 0 }
    }

    fn at(id: u32, x: f32, on: bool) -> Vehicle {
        (ActorId(id), Vec3::X * x, on)
    }

    #[test]
    fn far_vehicles_of_traffic_move_to_free_spawn_points_within_the_boundaries() {
        let mut respawn = row([30.0, 300.0]);
        let vehicles =
            [at(1, 0.0, false), at(2, 400.0, true), at(3, 500.0, false), at(4, 290.0, true)];
        let moves = respawn.moves(&[Vec3::ZERO], &vehicles);
        let [Teleport { actor_id: ActorId(2), pose }] = moves[..] else { panic!("{moves:?}") };
        assert_eq!(pose.position(), Vec3::X * 40.0);
        // The next vehicle takes the next point, and none that is occupied.
        let vehicles = [at(1, 0.0, false), at(2, 61.0, true), at(5, 900.0, true)];
        let moves = respawn.moves(&[Vec3::ZERO], &vehicles);
        let [Teleport { actor_id: ActorId(5), pose }] = moves[..] else { panic!("{moves:?}") };
        assert_eq!(pose.position(), Vec3::X * 80.0);
    }

    #[test]
    fn without_a_hero_or_a_free_point_vehicles_stay() {
        let vehicles = [at(2, 400.0, true)];
        assert!(row([30.0, 300.0]).moves(&[], &vehicles).is_empty());
        assert!(row([45.0, 55.0]).moves(&[Vec3::ZERO], &vehicles).is_empty());
        let many: Vec<Vehicle> = (0..9).map(|n| at(n, 900.0 + n as f32, true)).collect();
        assert_eq!(row([30.0, 300.0]).moves(&[Vec3::ZERO], &many).len(), PER_FRAME);
    }
}
