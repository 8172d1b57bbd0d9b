//! Dark seals along the edges of window panes.

use std::collections::BTreeMap;

use glam::Vec3;
use mesh::{Face, Material};

use crate::mesh_builder::MeshBuilder;

/// The width of the seals of side windows, and of the dark edges of windscreens and rear windows. Metres.
const SIDE_M: f32 = 0.018;
const END_M: f32 = 0.036;
/// How far seals reach beyond the edge of a pane, and how far they stand out. Metres.
const BEYOND_M: f32 = 0.005;
const OUT_M: f32 = 0.003;
const RUBBER: [u8; 3] = [12, 12, 13];

/// A corner of a pane.
#[derive(Clone, Copy, Default)]
struct Corner {
    /// The sum of the directions into the pane from the edges that meet here.
    inward: Vec3,
    normal: Vec3,
}

/// Adds seals along the edges of all panes among the triangles from `first` on, as parts of their objects.
pub(super) fn add(builder: &mut MeshBuilder, first: usize) {
    let mesh = &builder.mesh;
    let panes: Vec<([u32; 3], Face)> = mesh.triangles[first..]
        .iter()
        .zip(&mesh.faces[first..])
        .filter(|(_, face)| face.material == Material::Glass as u8)
        .map(|(corners, face)| (*corners, *face))
        .collect();
    let point = |index: u32| Vec3::from_array(mesh.positions[index as usize]);
    let directed = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let mut sides = BTreeMap::new();
    for (corners, face) in &panes {
        for edge in directed(*corners) {
            sides.insert(edge, face.object);
        }
    }
    let mut around: BTreeMap<(u32, u32), Corner> = BTreeMap::new();
    let mut edges = Vec::new();
    for (corners, face) in &panes {
        let [a, b, c] = corners.map(point);
        let normal = (b - a).cross(c - a);
        for corner in corners {
            around.entry((*corner, face.object)).or_default().normal += normal;
        }
        let out = normal.normalize_or_zero();
        for (from, to) in directed(*corners) {
            if sides.get(&(to, from)) == Some(&face.object) {
                continue;
            }
            let inward = out.cross(point(to) - point(from)).normalize_or_zero();
            for end in [from, to] {
                around.entry((end, face.object)).or_default().inward += inward;
            }
            let wide = if out.y.abs() < 0.6 { END_M } else { SIDE_M };
            edges.push((from, to, face.object, inward, wide));
        }
    }
    let strips: Vec<(bool, u32, [Vec3; 4])> = edges
        .iter()
        .map(|(from, to, object, inward, wide)| {
            let ends = [from, to].map(|end| {
                let Corner { inward: sum, normal } = around[&(*end, *object)];
                let miter = sum.normalize_or_zero();
                let miter = miter * (1.0 / miter.dot(*inward).max(0.4));
                let at = point(*end) + normal.normalize_or_zero() * OUT_M;
                [at - miter * BEYOND_M, at + miter * *wide]
            });
            (*wide == END_M, *object, [ends[0][0], ends[1][0], ends[1][1], ends[0][1]])
        })
        .collect();
    for (is_end, object, corners) in strips {
        // The black print of windscreens lies below their glass, and mirrors as that does.
        builder.tinted(if is_end { Material::CarPaint } else { Material::Rubber }, RUBBER);
        builder.object(object).quad(corners);
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3;
    use mesh::Tag;

    use super::*;

    #[test]
    fn a_seal_runs_round_a_pane_and_not_across_it() {
        let mut builder = MeshBuilder::new(Tag::Car, Material::Glass, 3);
        let [a, b, c, d] = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| vec3(x, y, 0.0));
        builder.quad([a, b, c, d]);
        add(&mut builder, 0);
        let mesh = &builder.mesh;
        assert_eq!(mesh.triangles.len(), 2 + 4 * 2);
        assert!(mesh.faces[2..].iter().all(|face| face.object == 3 && face.tint != 0));
        // This pane faces up, as a windscreen does, and has a black print.
        assert!(mesh.faces[2..].iter().all(|face| face.material == Material::CarPaint as u8));
        let area: f32 = mesh.triangles[2..]
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|at| Vec3::from_array(mesh.positions[at as usize]));
                let normal = (b - a).cross(c - a);
                assert!(normal.z > 0.0, "a seal faces outwards");
                normal.z * 0.5
            })
            .sum();
        let (outer, inner) = (1.0 + 2.0 * BEYOND_M, 1.0 - 2.0 * END_M);
        assert!((area - outer * outer + inner * inner).abs() < 1e-5, "{area}");
    }
}
