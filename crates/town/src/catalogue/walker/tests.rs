//! Bodies and clothes of all walkers, at rest and in every phase of the walk.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3};

use crate::{
    catalogue::{
        Posture, blueprint,
        walker::{
            body::Piece,
            figure::{Figure, joint_of, parsed},
            garment::{Garment, Patch},
            outfit,
            people::{Hair, PEOPLE},
            rig,
        },
    },
    mesh_builder::bounds,
    subdivision::edge,
};

/// How deep clothes may lie below the skin that they cover. Metres.
const DEPTH_M: f32 = 0.004;
/// How far off the skin clothes may hang. Metres.
const LOOSE_M: f32 = 0.25;

#[test]
fn every_cage_is_sound_and_its_slots_have_colours() {
    let mut painted = BTreeMap::new();
    for (name, text) in outfit::ALL {
        let garment = Garment::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut edges = BTreeMap::<(u32, u32), u32>::new();
        let cage = garment.fitted(&Figure::new(2).body);
        for (corners, patch) in &cage.faces {
            painted.entry(garment.slot(*patch)).or_insert(false);
            for (at, a) in corners.iter().enumerate() {
                *edges.entry(edge(*a, corners[(at + 1) % corners.len()])).or_default() += 1;
            }
        }
        assert!(edges.values().all(|count| *count <= 2), "{name}: an edge of three faces");
        assert!(cage.points.iter().all(|point| point.is_finite()), "{name}");
    }
    for number in 0..PEOPLE.len() {
        let outfit = Figure::new(number).outfit;
        for (slot, is_painted) in &mut painted {
            *is_painted |= (0..20).any(|at| outfit.paint(slot, at as f32 * 0.05).is_some());
        }
    }
    let bare: Vec<_> = painted.iter().filter(|(_, painted)| !**painted).map(|(s, _)| *s).collect();
    assert_eq!(bare, ["under"], "slots without a colour");
}

#[test]
fn shoulders_have_the_breadth_of_people() {
    // Bideltoid breadth from the 5th percentile of women to the 95th of men, 0.246 to 0.325 of the
    // height, for heavy people to the 99th (Gordon et al. 2014); and 2 cm for clothes.
    for one in &PEOPLE {
        let mesh = blueprint(one.id).unwrap().1.mesh();
        let at_shoulders = |z: &f32| (0.72..0.80).contains(&(z / one.height_m));
        let aside = mesh.positions.iter().filter(|p| at_shoulders(&p[2])).map(|p| p[1].abs());
        let breadth = 2.0 * aside.fold(0.0, f32::max);
        let most = if one.girth > 1.1 { 0.336 } else { 0.325 };
        let range = 0.246 * one.height_m..most * one.height_m + 0.02;
        assert!(range.contains(&breadth), "{}: {breadth} m of {} m", one.id, one.height_m);
        // They slope: between neck and arm nothing is higher than the shoulder joint by far.
        let outer =
            |p: &&[f32; 3]| p[1].abs() > 0.105 * one.height_m && p[1].abs() < 0.16 * one.height_m;
        let top = mesh.positions.iter().filter(outer).map(|p| p[2]).fold(0.0, f32::max);
        assert!(top < 0.832 * one.height_m, "{}: shoulders at {top} m", one.id);
    }
}

/// Whether a ray meets a triangle, and at which distance; negative behind its origin.
fn distance(from: Vec3, along: Vec3, [a, b, c]: &[Vec3; 3]) -> Option<f32> {
    let (u, v) = (*b - *a, *c - *a);
    let p = along.cross(v);
    let det = u.dot(p);
    let s = from - *a;
    let q = s.cross(u);
    let (x, y) = (s.dot(p) / det, along.dot(q) / det);
    (det.abs() > 1e-12 && x >= -1e-3 && y >= -1e-3 && x + y <= 1.001).then(|| v.dot(q) / det)
}

/// A person as layers: triangles of clothes, and points of the skin below them with the direction
/// outwards; each with the number of its joint.
struct Layers {
    cloth: Vec<(u32, [Vec3; 3])>,
    skin: Vec<(u32, Vec3, Vec3)>,
}

impl Layers {
    fn of(number: usize) -> Layers {
        let figure = Figure::new(number);
        let (height, cover) = (figure.body.height_m, figure.outfit.cover());
        let mut layers = Layers { cloth: Vec::new(), skin: Vec::new() };
        figure.outfit.each_cage(|text| {
            let garment = parsed(text);
            let cage = garment.fitted(&figure.body);
            for (corners, patch) in &cage.faces {
                if !matches!(
                    garment.slot(*patch),
                    "top" | "bottom" | "inner" | "trim" | "shoe" | "hair" | "hat" | "band"
                ) {
                    continue;
                }
                for at in 1..corners.len() - 1 {
                    let of = [0, at, at + 1].map(|c| cage.points[corners[c] as usize]);
                    layers.cloth.push((joint_of(*patch), of));
                }
            }
        });
        let (middle, half) = (figure.body.head_m, figure.body.half_head_m);
        let is_bald = PEOPLE[number].hair == Hair::Bald;
        for point in parsed(outfit::HEAD).fitted(&figure.body).points {
            let at = (point - middle) / half;
            let hair = at.x < -0.25 && (-0.1..0.9).contains(&at.z) && !is_bald;
            if hair && at.length() > 0.5 {
                let joint = joint_of(Patch::of(Piece::Head));
                layers.skin.push((joint, point, at.normalize_or_zero()));
            }
        }
        let garment = parsed(outfit::BODY);
        let cage = garment.fitted(&figure.body);
        for (corners, patch) in cage.faces.iter().step_by(3) {
            let point = cage.points[corners[0] as usize];
            let z = point.z / height;
            let (is_covered, axis) = match (patch.piece, garment.slot(*patch)) {
                (_, "skin") => continue,
                (Piece::Arm, _) => (cover.sleeve < 1.0 && z > cover.sleeve.max(0.63) + 0.01, 0.120),
                (Piece::Forearm, _) => (cover.sleeve < 0.1 && z > 0.50, 0.133),
                (Piece::Thigh, _) => (z > cover.hem.max(0.28) + 0.012 && z < 0.50, 0.052),
                (Piece::Leg, _) => (cover.hem < 0.1 && z > 0.06 && z < 0.29, 0.052),
                _ => (z > 0.49 && z < 0.79, 0.0),
            };
            let inside = Vec3::new(0.0, axis * height * point.y.signum(), point.z);
            if is_covered && patch.piece == Piece::Arm && z > 0.77 {
                continue;
            }
            if is_covered {
                let out = (point - inside).normalize_or_zero();
                layers.skin.push((joint_of(*patch), point, out));
            }
        }
        layers
    }

    /// The depth of the worst place where skin shows through clothes in this posture.
    fn worst(&self, placed: &[Affine3A]) -> (f32, Vec3) {
        let cloth: Vec<[Vec3; 3]> = self
            .cloth
            .iter()
            .map(|(joint, corners)| corners.map(|c| placed[*joint as usize].transform_point3(c)))
            .collect();
        let mut worst = (0.0, Vec3::ZERO);
        for (joint, point, out) in &self.skin {
            let placed = &placed[*joint as usize];
            let (from, along) = (placed.transform_point3(*point), placed.transform_vector3(*out));
            let hits = cloth.iter().filter_map(|corners| distance(from, along, corners));
            let highest = hits.filter(|far| *far < LOOSE_M).fold(f32::NEG_INFINITY, f32::max);
            if -highest > worst.0 {
                worst = (-highest, *point);
            }
        }
        worst
    }
}

#[test]
fn clothes_and_hair_cover_the_skin_in_every_phase_of_walk_and_run() {
    for (number, one) in PEOPLE.iter().enumerate() {
        let layers = Layers::of(number);
        assert!(layers.skin.len() > 100, "{}: {} points of skin", one.id, layers.skin.len());
        for (phase, speed_mps) in [(0.0, 1.4), (0.2, 1.4), (0.45, 1.4), (0.7, 1.4), (0.3, 3.0)] {
            let posture = Posture { stride: phase, speed_mps, ..Posture::default() };
            let mut placed = Vec::new();
            rig(number).place(&posture, |_, actor_from_piece| placed.push(actor_from_piece));
            let (depth, at) = layers.worst(&placed);
            let of = at / one.height_m;
            assert!(depth < DEPTH_M, "{}: {depth} m at {of} in phase {phase}", one.id);
        }
    }
}

/// Which of 64 x 128 cells a mesh covers, seen from the front: 1 m x 2 m.
fn silhouette(id: &str) -> Vec<bool> {
    let mesh = blueprint(id).unwrap().1.mesh();
    let mut cells = vec![false; 64 * 128];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
        for u in 0..=4 {
            for v in 0..=(4 - u) {
                let point = a + (b - a) * (u as f32 / 4.0) + (c - a) * (v as f32 / 4.0);
                let (x, y) = ((point.y + 0.5) * 64.0, point.z * 64.0);
                cells[(y as usize).min(127) * 64 + (x as usize).min(63)] = true;
            }
        }
    }
    cells
}

#[test]
fn no_two_walkers_have_the_same_silhouette() {
    let all: Vec<_> = PEOPLE.iter().map(|one| silhouette(one.id)).collect();
    for (number, one) in all.iter().enumerate() {
        for (other, two) in all.iter().enumerate().skip(number + 1) {
            let both = one.iter().zip(two).filter(|(a, b)| **a && **b).count();
            let either = one.iter().zip(two).filter(|(a, b)| **a || **b).count();
            let share = both as f32 / either as f32;
            assert!(share < 0.97, "{} and {}: {share}", PEOPLE[number].id, PEOPLE[other].id);
        }
    }
}

#[test]
fn soles_stay_on_the_ground_while_walking() {
    for id in ["walker.pedestrian.0004", "walker.pedestrian.0013", "walker.pedestrian.0026"] {
        let (_, one) = blueprint(id).unwrap();
        for step in 0..20 {
            let posture =
                Posture { stride: step as f32 / 20.0, speed_mps: 1.4, ..Posture::default() };
            let mut lowest = f32::INFINITY;
            one.rig().place(&posture, |piece, placed| {
                let points = &one.geometry().pieces[piece].positions;
                let z = |p: &[f32; 3]| placed.transform_point3(Vec3::from_array(*p)).z;
                lowest = points.iter().map(z).fold(lowest, f32::min);
            });
            assert!(lowest > -0.045 && lowest < 0.03, "{id}: {lowest} m in step {step}");
        }
    }
}

#[test]
fn the_crown_is_at_the_height_of_the_table() {
    for one in &PEOPLE {
        let top = bounds(blueprint(one.id).unwrap().1.mesh()).1.z;
        assert!((top - one.height_m).abs() < 0.012, "{}: {top} of {} m", one.id, one.height_m);
    }
}

#[test]
fn the_keypoints_of_heads_lie_on_their_meshes() {
    // Nose, eyes and ears as COCO's keypoints place them: in half heads from the middle.
    const POINTS: [[f32; 3]; 5] = [
        [0.93, 0.0, -0.20],
        [0.72, 0.27, 0.03],
        [0.72, -0.27, 0.03],
        [-0.04, 0.73, -0.08],
        [-0.04, -0.73, -0.08],
    ];
    for (number, one) in PEOPLE.iter().enumerate() {
        let mesh = blueprint(one.id).unwrap().1.mesh();
        let half = Figure::new(number).body.half_head_m;
        let middle = Vec3::new(0.010, 0.0, 0.995) * one.height_m - Vec3::Z * half;
        // Hats push three heads down.
        let most = if one.hair == Hair::Hat { 0.026 } else { 0.012 };
        for point in POINTS {
            let point = middle + Vec3::from_array(point) * half;
            let far = mesh.positions.iter().map(|at| point.distance(Vec3::from_array(*at)));
            let near = far.fold(f32::INFINITY, f32::min);
            assert!(near < most, "{}: {point} is {near} m from the mesh", one.id);
        }
    }
}
