//! Saved states.

use glam::Vec3;
use protocol::{Name, Pose, Spawn, WorldCommand};
use sim_host::{Inputs, NoServices, SavedState};

use super::commands::{check, plain};

/// The map of the states.
const MAP: u64 = 0;

/// Reads a state and restores it. What is restored is finite, and saves the same actors.
///
/// It is not stepped: the rigid-body world in a state with right checksums is trusted.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let state = match SavedState::from_bytes(bytes, MAP) {
        Ok(state) => state,
        Err(why) => {
            assert!(!why.to_string().is_empty());
            return false;
        }
    };
    assert_eq!(SavedState::from_bytes(&state.to_bytes(), MAP).as_ref().err(), None);
    let _ = state.planner();
    let mut sim = plain();
    let before = sim.state_hash();
    if sim.restore(&state).is_err() {
        assert_eq!(sim.state_hash(), before, "a refused state changes nothing");
        return false;
    }
    check(&sim);
    true
}

/// States of this build: of an empty world, and of one actor of each kind.
pub(crate) fn made() -> Vec<Vec<u8>> {
    let blueprints = ["", "vehicle.tesla.model3", "walker.pedestrian.0001", "static.prop.box01"];
    let state = |blueprint: &str| {
        let mut sim = plain();
        let pose = Pose::level(Vec3::ZERO, 0.2);
        let spawn = Spawn { blueprint: Name::new(blueprint), pose, ..Spawn::default() };
        // Without a blueprint, the world stays empty.
        let _ = sim.apply_world(&WorldCommand::Spawn(spawn));
        for _ in 0..3 {
            let Ok(_) = sim.step(&Inputs::default(), &mut NoServices::default());
        }
        let mut state = SavedState { map: MAP, ..SavedState::default() };
        sim.save_into(&mut state);
        state.to_bytes()
    };
    blueprints.map(state).into()
}
