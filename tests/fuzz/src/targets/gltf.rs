//! glTF files that replace meshes.

use town::Motion;

/// Makes the lengths of the file and of its two chunks right.
pub(crate) fn seal(bytes: &mut [u8]) {
    let len = bytes.len();
    let Some(binary) = bytes.windows(4).rposition(|word| word == b"BIN\0") else { return };
    let mut put = |at: usize, value: usize| {
        if let Some(room) = bytes.get_mut(at..at + 4) {
            room.copy_from_slice(&(value as u32).to_le_bytes());
        }
    };
    if binary >= 24 {
        put(8, len);
        put(12, binary - 4 - 20);
        put(binary - 4, len - binary - 4);
    }
}

/// Replaces the meshes of a car, a walker and a prop by the file.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let mut is_accepted = false;
    for id in ["vehicle.tesla.model3", "walker.pedestrian.0001", "static.prop.box01"] {
        let (_, blueprint) = town::blueprint(id).expect("a blueprint of the catalogue");
        let Ok((geometry, rig)) = town::replaced(blueprint, bytes) else { continue };
        let mut positions = geometry.pieces.iter().flat_map(|piece| &piece.positions).flatten();
        assert!(positions.all(|x| x.is_finite()), "a vertex of {id} is not finite");
        for joint in &rig.joints {
            let at = match joint.motion {
                Motion::Wheel { hub_m, .. } => hub_m,
                Motion::Door { hinge_m, .. } => hinge_m,
                Motion::Steer { pivot_m, .. } => pivot_m,
                _ => continue,
            };
            assert!(at.is_finite(), "{} of {id} turns about {at}", joint.name);
        }
        is_accepted = true;
    }
    is_accepted
}
