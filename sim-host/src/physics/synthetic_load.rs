//! A synthetic load of the physics, for benchmarks.

use std::sync::Arc;

use glam::Vec3;
use protocol::{ActorId, Pose, VehicleControl};

use super::{ground::Ground, model::VehicleModel, world::Physics};

/// Cars that drive on an uneven plain with changing pedals and steering.
pub struct SyntheticLoad {
    physics: Physics,
    frame: u64,
}

impl SyntheticLoad {
    /// Spawns `cars` sedans, 16 m apart, on a plain of triangles with edges of 2 m.
    pub fn new(cars: u32) -> SyntheticLoad {
        SyntheticLoad::spaced(cars, 16.0)
    }

    /// As [`SyntheticLoad::new`], with the cars `apart_m` metres apart, at least 6.
    pub fn spaced(cars: u32, apart_m: f32) -> SyntheticLoad {
        let columns = f64::from(cars).sqrt().ceil() as u32;
        let side_m = columns as f32 * apart_m + 400.0;
        let ground = Arc::new(Ground::new(&plain(side_m, 2.0)));
        let mut physics = Physics::new(ground, &[]);
        let model = Arc::new(VehicleModel::sedan());
        for car in 0..cars {
            let (column, row) = (car % columns, car / columns);
            let middle = (columns as f32 - 1.0) / 2.0;
            let x = (column as f32 - middle) * apart_m;
            let y = (row as f32 - middle) * apart_m;
            let pose = Pose::level(Vec3::new(x, y, bump(x, y) + 0.3), car as f32 * 0.9);
            physics
                .spawn_vehicle(ActorId(car + 1), &model, &pose, false)
                .expect("cars 6 m apart do not overlap");
        }
        SyntheticLoad { physics, frame: 0 }
    }

    /// Simulates one frame with new controls for every car.
    pub fn frame(&mut self, delta_nanos: u64, substep_max_nanos: u64) {
        let ids: Vec<ActorId> = self.physics.ids().collect();
        for id in ids {
            let phase = self.frame as f32 * 0.02 + id.0 as f32;
            let braking = (self.frame / 60 + u64::from(id.0)) % 5 == 4;
            let control = VehicleControl {
                actor_id: id,
                throttle: if braking { 0.0 } else { 0.5 },
                brake: if braking { 0.4 } else { 0.0 },
                steer: 0.3 + 0.2 * phase.sin(),
                ..VehicleControl::default()
            };
            self.physics.control(&control).expect("the car was spawned");
        }
        self.physics.step(delta_nanos, substep_max_nanos);
        self.frame += 1;
    }

    /// Sets the number of threads on which the cars move.
    pub fn set_threads(&mut self, threads: usize) {
        self.physics.set_threads(threads);
    }

    /// Restores a saved state of the physics after `frame` frames.
    #[cfg(test)]
    pub(super) fn restore(&mut self, saved: &[u8], frame: u64) {
        self.physics.restore(saved).expect("the state is one of this load");
        self.frame = frame;
    }

    /// Makes the first `cars` cars dormant that may be.
    pub fn make_dormant(&mut self, cars: u32) {
        for id in (1..=cars).map(ActorId) {
            self.physics.set_dormant(id, true).expect("the car was spawned");
        }
    }

    /// Returns the physics world.
    pub fn physics(&self) -> &Physics {
        &self.physics
    }
}

fn bump(x: f32, y: f32) -> f32 {
    0.6 * (x * 0.021).sin() * (y * 0.017).cos() + 0.03 * (x * 0.31).sin() * (y * 0.27).sin()
}

/// Returns a square of `side_m` around the origin, in triangles with edges of `edge_m`.
fn plain(side_m: f32, edge_m: f32) -> mesh::Mesh {
    let mut mesh = mesh::Mesh::default();
    let count = (side_m / edge_m).ceil() as u32 + 1;
    for row in 0..count {
        for column in 0..count {
            let x = (column as f32 - count as f32 / 2.0) * edge_m;
            let y = (row as f32 - count as f32 / 2.0) * edge_m;
            mesh.vertex([x, y, bump(x, y)]);
        }
    }
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    for row in 0..count - 1 {
        for column in 0..count - 1 {
            let a = row * count + column;
            mesh.triangle([a, a + 1, a + count + 1], face);
            mesh.triangle([a, a + count + 1, a + count], face);
        }
    }
    mesh
}
