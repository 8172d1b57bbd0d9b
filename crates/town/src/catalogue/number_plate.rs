//! Number plates.

use glam::vec3;
use mesh::Material;

use crate::{
    catalogue::end::{End, OUT_M},
    mesh_builder::MeshBuilder,
};

/// Tint of the rectangle of a plate: renderers draw characters on it, which differ between actors.
const PLATE: [u8; 3] = [0, 0, 8];

/// Adds a number plate with its lower edge at `z`.
pub(super) fn number_plate(builder: &mut MeshBuilder, end: &End, z: f32) {
    let forward = end.forward();
    let front =
        [z + 0.02, z + 0.055, z + 0.09].map(|z| end.ahead(0.0, z).map(|hit| hit.0.x * forward));
    let middle = front.iter().flatten().copied().reduce(f32::max);
    let x = middle.unwrap_or(end.place(0.0).0[0] * forward) * forward + forward * OUT_M * 0.6;
    builder.material(Material::Sign);
    let back = x - forward * 0.05;
    builder.block(vec3(x.min(back), -0.26, z), vec3(x.max(back), 0.26, z + 0.11));
    builder.tinted(Material::Sign, PLATE);
    let x = x + forward * 0.003;
    // Seen from ahead, the text runs towards the vehicle's left, and from behind to its right.
    let corner = |u: f32, z: f32| vec3(x, u * forward, z);
    builder.quad([
        corner(-0.26, z),
        corner(0.26, z),
        corner(0.26, z + 0.11),
        corner(-0.26, z + 0.11),
    ]);
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use mesh::{Face, Material};

    use super::PLATE;
    use crate::catalogue::blueprint;

    #[test]
    fn plates_face_away_from_the_vehicle_at_both_ends() {
        assert_eq!(Face::tint(PLATE), 1, "renderers know the tint");
        for id in ["vehicle.lincoln.mkz_2020", "vehicle.tesla.cybertruck"] {
            let mesh = blueprint(id).unwrap().1.mesh();
            let mut areas = [0.0; 2];
            for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
                if face.material == Material::Sign as u8 && face.tint == 1 {
                    let [a, b, c] = corners.map(|at| Vec3::from(mesh.positions[at as usize]));
                    let normal = (b - a).cross(c - a);
                    assert!(normal.x * a.x > 0.0 && normal.x.abs() > 0.999 * normal.length());
                    areas[usize::from(a.x < 0.0)] += normal.length() * 0.5;
                }
            }
            for area in areas {
                assert!((area / (0.52 * 0.11) - 1.0).abs() < 0.1, "{id}: {areas:?}");
            }
        }
    }
}
