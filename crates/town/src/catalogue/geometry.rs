use mesh::{Face, Mesh};

use crate::catalogue::rig::{Motion, OCCUPANTS, Rig};

/// The meshes of a blueprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The whole mesh at rest, with closed doors and without occupants, as vehicles are parked.
    pub whole: Mesh,
    /// One mesh for each joint of the rig, in actor space at rest.
    pub pieces: Vec<Mesh>,
}

impl Geometry {
    /// Splits a mesh whose faces name their joints as their objects. The piece of a `Shut` joint is
    /// the shell together with its doors; occupants belong to the body, shut or ajar.
    pub(crate) fn of(rig: &Rig, mesh: Mesh) -> Geometry {
        if rig.joints.len() == 1 {
            let mut whole = mesh;
            whole.faces.iter_mut().for_each(|face| face.object = 0);
            return Geometry { pieces: vec![whole.clone()], whole };
        }
        let motion = |object: u32| rig.joints.get(object as usize).map(|joint| &joint.motion);
        let is_shell = |object: u32| {
            matches!(motion(object), Some(Motion::Ajar | Motion::Shut | Motion::Door { .. }))
                || object == OCCUPANTS
        };
        let pieces = rig
            .joints
            .iter()
            .zip(0..)
            .map(|(joint, number)| match joint.motion {
                Motion::Shut => part(&mesh, is_shell),
                Motion::Ajar => part(&mesh, |object| object == number || object == OCCUPANTS),
                Motion::Still if number == 0 => {
                    part(&mesh, |object| object == 0 || object == OCCUPANTS)
                }
                _ => part(&mesh, |object| object == number),
            })
            .collect();
        Geometry { whole: part(&mesh, |object| object != OCCUPANTS), pieces }
    }
}

/// The faces of some objects, with the vertices that they use.
fn part(mesh: &Mesh, wanted: impl Fn(u32) -> bool) -> Mesh {
    let mut place = vec![u32::MAX; mesh.positions.len()];
    let mut part = Mesh::default();
    for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
        if wanted(face.object) {
            let corners = corners.map(|corner| {
                let place = &mut place[corner as usize];
                if *place == u32::MAX {
                    *place = part.vertex(mesh.positions[corner as usize]);
                }
                *place
            });
            part.triangle(corners, Face { object: 0, ..*face });
        }
    }
    part
}
