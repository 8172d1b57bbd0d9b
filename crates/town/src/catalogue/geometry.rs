use mesh::{Face, Mesh};

use crate::catalogue::rig::{Motion, OCCUPANTS, Rig};

/// The meshes of a blueprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The whole mesh at rest, with closed doors and without occupants, as vehicles are parked.
    pub whole: Mesh,
    /// One mesh for each joint of the rig, in actor space at rest. Those that show at rest make up the
    /// whole mesh.
    pub pieces: Vec<Mesh>,
    /// Driver and passengers, shown with the body ([`Rig::is_body`]) of a vehicle that is not
    /// parked, in actor space. Empty for other blueprints.
    pub occupants: Mesh,
}

impl Geometry {
    /// Splits a mesh by the objects of its faces, which are joints or the occupants. The piece of a `Shut`
    /// joint is the shell together with its doors.
    pub(crate) fn of(rig: &Rig, mesh: Mesh) -> Geometry {
        if rig.joints.len() == 1 {
            let mut whole = mesh;
            whole.faces.iter_mut().for_each(|face| face.object = 0);
            return Geometry { pieces: vec![whole.clone()], whole, occupants: Mesh::default() };
        }
        let motion = |object: u32| rig.joints.get(object as usize).map(|joint| &joint.motion);
        let is_shell = |object: u32| {
            matches!(motion(object), Some(Motion::Ajar | Motion::Shut | Motion::Door { .. }))
        };
        let pieces = rig
            .joints
            .iter()
            .zip(0..)
            .map(|(joint, number)| match joint.motion {
                Motion::Shut => part(&mesh, is_shell),
                _ => part(&mesh, |object| object == number),
            })
            .collect();
        Geometry {
            whole: part(&mesh, |object| object != OCCUPANTS),
            pieces,
            occupants: part(&mesh, |object| object == OCCUPANTS),
        }
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
