//! The growth of branches: space colonisation.
//!
//! A. Runions, B. Lane, P. Prusinkiewicz, *Modeling Trees with a Space Colonization Algorithm*,
//! Eurographics Workshop on Natural Phenomena 2007, section 3. The radii of branches keep the area
//! of the cross sections where a branch divides (section 3.4 there, with exponent 2).

use glam::{Vec3, vec3};
use mesh::RandomStream;

use super::lobes::{Lobes, unit};

/// The space that branches fill.
pub(super) struct Envelope {
    pub(super) center: Vec3,
    pub(super) radii: Vec3,
    /// How much narrower the top is than the middle.
    pub(super) taper: f32,
    pub(super) lobes: Lobes,
    /// The upward tendency of branches.
    pub(super) rise: f32,
    /// The number of points that attract branches.
    pub(super) points: u32,
    /// The length of one segment. Metres.
    pub(super) step_m: f32,
    /// The trunk and its limbs, from which growth starts: positions from the foot on, each with the index of the one
    /// before it.
    pub(super) stem: Vec<(Vec3, usize)>,
}

/// The end of a segment of a branch. Metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    pub(super) at: Vec3,
    /// The index of the joint at the other end, lower than its own; the first is its own parent.
    pub(super) parent: usize,
    /// The radius of the segment as a fraction of the trunk's.
    pub(super) radius: f32,
    /// The number of segments to the farthest end of a branch.
    pub(super) to_tip: u32,
}

/// The distances at which a point attracts a joint, and at which it is reached, in segments.
const ATTRACTS: f32 = 9.0;
const REACHED: f32 = 1.9;
/// The maximum number of rounds of growth.
const ROUNDS: u32 = 120;

/// A point that attracts the nearest joint.
struct Attractor {
    at: Vec3,
    nearest: usize,
    distance: f32,
}

/// Returns the joints of a plant, parents before children.
pub(super) fn grow(envelope: &Envelope, random: &mut RandomStream) -> Vec<Joint> {
    let step = envelope.step_m;
    let stem = envelope.stem.iter();
    let mut joints: Vec<Joint> = stem.map(|(at, parent)| joint(*at, *parent)).collect();
    let mut points: Vec<Attractor> = (0..envelope.points)
        .map(|_| Attractor { at: inside(envelope, random), nearest: 0, distance: f32::MAX })
        .collect();
    let mut known = 0;
    for _ in 0..ROUNDS {
        for point in &mut points {
            for (index, joint) in joints.iter().enumerate().skip(known) {
                let distance = joint.at.distance(point.at);
                if distance < point.distance {
                    (point.nearest, point.distance) = (index, distance);
                }
            }
        }
        known = joints.len();
        points.retain(|point| point.distance > REACHED * step);
        let mut pulls = vec![Vec3::ZERO; known];
        // The crown begins above the trunk, whatever its distance.
        let reach = if known == envelope.stem.len() { f32::MAX } else { ATTRACTS * step };
        for point in points.iter().filter(|point| point.distance < reach) {
            let from = joints[point.nearest].at;
            pulls[point.nearest] += (point.at - from) / point.distance;
        }
        for (index, pull) in pulls.iter().enumerate().filter(|(_, pull)| **pull != Vec3::ZERO) {
            let lean = Vec3::Z * envelope.rise + unit(random) * 0.18;
            let direction = (pull.normalize_or_zero() + lean).normalize_or(Vec3::Z);
            joints.push(joint(joints[index].at + direction * step, index));
        }
        // Two points on either side of a joint would make the same branch again and again.
        let added: Vec<Joint> = joints[known..].to_vec();
        let mut kept = known;
        for one in added {
            let twin = |other: &Joint| {
                other.parent == one.parent && other.at.distance(one.at) < step * 0.4
            };
            if joints[..kept].iter().skip(one.parent).any(twin) {
                points.retain(|point| point.nearest != one.parent);
            } else {
                joints[kept] = one;
                kept += 1;
            }
        }
        joints.truncate(kept);
        if kept == known {
            break;
        }
    }
    thicken(&mut joints);
    joints
}

fn joint(at: Vec3, parent: usize) -> Joint {
    Joint { at, parent, radius: 0.0, to_tip: 0 }
}

/// Sets the radii from the ends of the branches to the trunk.
fn thicken(joints: &mut [Joint]) {
    let mut areas = vec![0.0f32; joints.len()];
    for index in (1..joints.len()).rev() {
        areas[index] = areas[index].max(1.0);
        let Joint { parent, to_tip, .. } = joints[index];
        areas[parent] += areas[index];
        joints[parent].to_tip = joints[parent].to_tip.max(to_tip + 1);
    }
    let whole = areas[0].max(1.0);
    for (joint, area) in joints.iter_mut().zip(areas) {
        joint.radius = (area / whole).sqrt();
    }
}

/// A random point in the envelope, which is an ellipsoid that narrows upwards.
fn inside(envelope: &Envelope, random: &mut RandomStream) -> Vec3 {
    let out = random.unit().max(random.unit()).max(random.unit());
    let towards = unit(random);
    let p = towards * out * envelope.lobes.surface(towards);
    let wide = 1.0 - envelope.taper * p.z;
    envelope.center + envelope.radii * vec3(p.x * wide, p.y * wide, p.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_fill_their_envelope_and_grow_thinner_towards_their_ends() {
        let envelope = Envelope {
            center: Vec3::Z * 5.0,
            radii: Vec3::splat(2.0),
            taper: 0.0,
            lobes: Lobes::new(&mut RandomStream::from_state(5)),
            rise: 0.2,
            points: 500,
            step_m: 0.3,
            stem: (0..10).map(|at| (Vec3::Z * 0.3 * at as f32, at.max(1) - 1)).collect(),
        };
        let joints = grow(&envelope, &mut RandomStream::from_state(1));
        assert!(joints.len() > 120 && joints.len() < 1500, "{}", joints.len());
        for (index, joint) in joints.iter().enumerate().skip(1) {
            assert!(joint.parent < index && joint.radius <= joints[joint.parent].radius);
            assert!(joint.at.distance(envelope.center) < 2.4 || joint.at.z < 3.5, "{joint:?}");
        }
        // Every eighth of the space has branches.
        for octant in 0..8 {
            let sign = |bit: u32| if octant & bit == 0 { 1.0 } else { -1.0 };
            let corner = vec3(sign(1), sign(2), sign(4));
            let inside = |joint: &&Joint| {
                ((joint.at - envelope.center) * corner).cmpgt(Vec3::splat(0.2)).all()
            };
            let count = joints.iter().filter(inside).count();
            assert!(count > 3, "octant {octant}: {count}");
        }
    }
}
