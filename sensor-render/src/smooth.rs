//! Normals at the corners of triangles, with which curved panels and limbs are shaded.

use std::collections::HashMap;

use glam::Vec3;

/// Normals at the three corners of a triangle in the space of its piece, octahedral, two signed 16-bit
/// numbers each; and a zero, or [`LEAF`].
pub(crate) type CornerNormals = [u32; 4];

/// Fourth word of a leaf: its first normal holds everywhere on it.
pub(crate) const LEAF: u32 = 1;

/// How far the normals of leaves are turned from that of their face to that of their crown: light falls on a crown as
/// on its shape, and its leaves still differ.
const OF_CROWN: f32 = 0.5;

/// Cosine of the angle between two faces above which their edge is a crease: 38 degrees.
const CREASE: f32 = 0.788;

/// Returns the normals at the corners of triangles: the mean over the faces around a corner that no
/// crease divides from its own, weighted by area.
pub(crate) fn corner_normals(triangles: &[[Vec3; 3]]) -> Vec<CornerNormals> {
    let faces: Vec<Vec3> = triangles.iter().map(|[a, b, c]| (b - a).cross(c - a)).collect();
    // Adding 0 makes -0 equal to 0.
    let key = |corner: &Vec3| (*corner + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut around: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
    for (triangle, index) in triangles.iter().zip(0..) {
        for corner in triangle {
            let faces = around.entry(key(corner)).or_default();
            if faces.last() != Some(&index) {
                faces.push(index);
            }
        }
    }
    let normal = |own: Vec3, corner: &Vec3| {
        let direction = own.normalize_or_zero();
        let near = around[&key(corner)].iter().map(|index| faces[*index as usize]);
        let sum: Vec3 = near.filter(|face| face.normalize_or_zero().dot(direction) >= CREASE).sum();
        packed(sum.try_normalize().unwrap_or(direction))
    };
    let of_triangle = |(corners, own): (&[Vec3; 3], &Vec3)| {
        let [a, b, c] = corners.each_ref().map(|corner| normal(*own, corner));
        [a, b, c, 0]
    };
    triangles.iter().zip(&faces).map(of_triangle).collect()
}

/// Returns the normal of each leaf of a crown, between that of its face and that of the ellipsoid around all leaves.
pub(crate) fn leaf_normals(leaves: &[[Vec3; 3]]) -> Vec<CornerNormals> {
    let corners = leaves.iter().flatten();
    let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = corners.fold(nothing, |(low, high), at| (low.min(*at), high.max(*at)));
    let (center, radii) = ((low + high) * 0.5, ((high - low) * 0.5).max(Vec3::splat(1e-3)));
    let of_leaf = |[a, b, c]: &[Vec3; 3]| {
        let out = (((*a + *b + *c) / 3.0 - center) / radii).normalize_or(Vec3::Z);
        let own = (*b - *a).cross(*c - *a).normalize_or(out);
        let outward = if own.dot(out) < 0.0 { -own } else { own };
        [packed(outward.lerp(out, OF_CROWN).normalize_or(out)), 0, 0, LEAF]
    };
    leaves.iter().map(of_leaf).collect()
}

/// Returns the octahedral form of a unit vector (Meyer et al. 2010).
fn packed(normal: Vec3) -> u32 {
    let sum = normal.abs().element_sum().max(1e-12);
    let (mut x, mut y) = (normal.x / sum, normal.y / sum);
    if normal.z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    let word = |part: f32| u32::from((part * 32_767.0).round() as i16 as u16);
    word(x) | word(y) << 16
}

/// Returns the vector of an octahedral form; its length is not 1.
pub(crate) fn unpacked(word: u32) -> Vec3 {
    let part = |bits: u32| f32::from(bits as u16 as i16) * (1.0 / 32_767.0);
    let (x, y) = (part(word), part(word >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(x - fold.copysign(x), y - fold.copysign(y), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_normals_keep_their_direction() {
        for at in 0..2000u32 {
            let (turn, z) = (at as f32 * 2.399_963_2, at as f32 / 1000.0 - 0.999_5);
            let flat = (1.0 - z * z).sqrt();
            let normal = Vec3::new(flat * turn.cos(), flat * turn.sin(), z);
            let back = unpacked(packed(normal)).normalize_or_zero();
            assert!(back.dot(normal) > 0.999_999, "{normal} {back}");
        }
    }

    #[test]
    fn leaves_face_out_of_their_crown() {
        // Leaves all over a crown, turned in all directions.
        let unit = |at: u32| {
            let (turn, z) = (at as f32 * 2.399_963_2, (at * 7919 % 1000) as f32 / 500.0 - 0.999);
            let flat = (1.0 - z * z).sqrt();
            Vec3::new(flat * turn.cos(), flat * turn.sin(), z)
        };
        let center = Vec3::new(1.0, 2.0, 6.0);
        let leaves: Vec<[Vec3; 3]> = (0..400)
            .map(|at| {
                let (at, along) = (center + unit(at) * 3.0, unit(at * 31 + 7) * 0.1);
                [at, at + along, at + along.any_orthogonal_vector()]
            })
            .collect();
        let mut own = 0.0;
        for (leaf, words) in leaves.iter().zip(leaf_normals(&leaves)) {
            assert_eq!(words[3], LEAF);
            let normal = unpacked(words[0]).normalize_or_zero();
            assert!(normal.dot((leaf[0] - center).normalize_or_zero()) > 0.65, "{normal}");
            let [a, b, c] = leaf;
            own += normal.dot((*b - *a).cross(*c - *a).normalize_or_zero()).abs();
        }
        assert!(own / 400.0 > 0.7, "leaves keep some of their own normal");
    }

    #[test]
    fn corners_are_smooth_on_a_sphere_and_sharp_on_a_box() {
        // A strip of a cylinder of 24 sides, whose faces meet at 15 degrees.
        let rim = |side: usize, z: f32| {
            let turn = std::f32::consts::TAU * side as f32 / 24.0;
            Vec3::new(turn.cos(), turn.sin(), z)
        };
        let cylinder: Vec<[Vec3; 3]> = (0..24)
            .flat_map(|side| {
                let [a, b] = [rim(side, 0.0), rim((side + 1) % 24, 0.0)];
                let [c, d] = [rim((side + 1) % 24, 1.0), rim(side, 1.0)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        for (triangle, words) in cylinder.iter().zip(corner_normals(&cylinder)) {
            for (corner, word) in triangle.iter().zip(words) {
                let outward = corner.with_z(0.0);
                assert!(unpacked(word).normalize_or_zero().dot(outward) > 0.999);
            }
        }
        // Two faces of a box keep their own normals at the edge.
        let edge = [Vec3::ZERO, Vec3::X];
        let fold = [[edge[0], edge[1], Vec3::Y], [edge[1], edge[0], Vec3::Z]];
        for (words, own) in corner_normals(&fold).iter().zip([Vec3::Z, Vec3::Y]) {
            for word in &words[..3] {
                assert!(unpacked(*word).normalize_or_zero().dot(own) > 0.999, "{own}");
            }
        }
    }
}
