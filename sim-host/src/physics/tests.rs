//! Tests of the physics.

mod ackermann;
mod commonroad;
mod determinism;
mod doors;
mod dormant;
mod driving;
mod figures;
mod forces;
mod ground;
mod motion;
mod props;
mod ragdoll;
mod rails;
mod solo;
mod stability;
mod tuning;
mod walkers;
mod world;

use std::sync::Arc;

use glam::{Quat, Vec3};
use protocol::{ActorId, ActorState, Pose, VehicleControl};

use super::{Ground, Physics, VehicleModel};

pub(super) const FRAME_NANOS: u64 = 50_000_000;
pub(super) const SUBSTEP_NANOS: u64 = 10_000_000;

/// Returns a plane through the origin that rises by `slope` along x.
pub(super) fn incline(slope: f32) -> Arc<Ground> {
    let mut mesh = mesh::Mesh::default();
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    let corner = |x: f32, y: f32| [x * 2000.0, y * 2000.0, x * 2000.0 * slope];
    mesh.quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], face);
    Arc::new(Ground::new(&mesh))
}

/// One vehicle on a ground.
pub(super) struct Lone {
    pub(super) physics: Physics,
    pub(super) control: VehicleControl,
    pub(super) seconds: f32,
}

impl Lone {
    pub(super) fn new(ground: Arc<Ground>, model: VehicleModel) -> Lone {
        let mut physics = Physics::new(ground, &[]);
        let id = ActorId(1);
        physics.spawn_vehicle(id, &Arc::new(model), &Pose::IDENTITY, false).unwrap();
        let control = VehicleControl { actor_id: id, ..VehicleControl::default() };
        Lone { physics, control, seconds: 0.0 }
    }

    pub(super) fn sedan() -> Lone {
        Lone::new(Arc::new(Ground::flat(0.0)), VehicleModel::sedan())
    }

    pub(super) fn state(&self) -> ActorState {
        let mut state = ActorState { actor_id: ActorId(1), ..ActorState::default() };
        assert!(self.physics.write_state(&mut state));
        state
    }

    pub(super) fn position(&self) -> Vec3 {
        self.state().pose.position()
    }

    pub(super) fn rotation(&self) -> Quat {
        self.state().pose.rotation()
    }

    pub(super) fn speed(&self) -> f32 {
        self.state().velocity().length()
    }

    pub(super) fn frame(&mut self) {
        self.physics.control(&self.control).unwrap();
        self.physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        self.seconds += FRAME_NANOS as f32 * 1e-9;
    }

    pub(super) fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds / (FRAME_NANOS as f32 * 1e-9)).round() as usize {
            self.frame();
        }
    }
}
