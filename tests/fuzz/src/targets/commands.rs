//! Commands of clients: whatever they say, the world stays finite.

use std::sync::OnceLock;

use glam::Vec3;
use mesh::{Face, Material, Tag};
use protocol::{Name, Pose, RawCommand, Spawn, WorldCommand, flag};
use sim_host::{Inputs, NoServices, Request, Sim};
use town::Town;

/// Commands of one frame.
const OF_FRAME: usize = 4;
/// Frames of one execution.
const FRAMES: usize = 16;

/// Applies the bytes as commands, four in each frame, and steps the simulation.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let mut sim = crowd();
    let commands: Vec<RawCommand> = bytes
        .chunks_exact(size_of::<RawCommand>())
        .take(OF_FRAME * FRAMES)
        .map(bytemuck::pod_read_unaligned)
        .collect();
    let mut is_accepted = false;
    for batch in commands.chunks(OF_FRAME).chain([&[][..], &[]]) {
        let request = |command: &RawCommand| Request {
            client: Name::new("fuzz"),
            sequence: 0,
            command: *command,
        };
        let requests: Vec<Request> = batch.iter().map(request).collect();
        let mut services = NoServices::default();
        let Ok(_) = sim.step(&Inputs { decision: None, requests: &requests }, &mut services);
        assert_eq!(services.journal.len(), requests.len(), "every command has an outcome");
        is_accepted |= services.journal.iter().any(|entry| entry.outcome.result().is_ok());
        check(&sim);
    }
    is_accepted
}

/// Checks that every state is finite.
pub(crate) fn check(sim: &Sim) {
    let wrong = sim.states().iter().find(|state| !state.is_valid());
    assert!(wrong.is_none(), "{wrong:?}");
    let wrong = sim.world().limbs().iter().find(|limbs| !limbs.is_valid());
    assert!(wrong.is_none(), "{wrong:?}");
}

/// A plain without objects.
pub(crate) fn plain() -> Sim {
    static TOWN: OnceLock<Town> = OnceLock::new();
    let town = TOWN.get_or_init(|| {
        let mut town = Town::default();
        let corner = |x: f32, y: f32| [x * 500.0, y * 500.0, 0.0];
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        town.mesh.quad(corners, Face::new(Tag::Roads, Material::Asphalt, 0));
        town
    });
    Sim::new(town, 1)
}

/// A plain with two vehicles, two walkers and a prop.
fn crowd() -> Sim {
    let mut sim = plain();
    let actors = [
        ("vehicle.tesla.model3", 0),
        ("vehicle.diamondback.century", flag::AUTOPILOT),
        ("walker.pedestrian.0001", flag::RAGDOLL_ON_HIT),
        ("walker.pedestrian.0002", flag::GETS_UP_AFTER_FALL),
        ("static.prop.box01", 0),
    ];
    for (nth, (blueprint, flags)) in actors.into_iter().enumerate() {
        let pose = Pose::level(Vec3::X * (4.0 * nth as f32), 0.2);
        let spawn = Spawn { blueprint: Name::new(blueprint), flags, pose, ..Spawn::default() };
        sim.apply_world(&WorldCommand::Spawn(spawn)).expect("room for it");
    }
    sim
}
