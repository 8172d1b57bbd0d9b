//! Proportions: cages are modelled over one body, which is changed to that of each person.

use glam::{Vec3, vec3};

use crate::catalogue::{
    skeleton::{Skeleton, bone},
    walker::people::Person,
};

/// The part of the body that a vertex of a cage moves with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Piece {
    Hips,
    Chest,
    Head,
    Arm,
    Forearm,
    Thigh,
    Leg,
    Foot,
}

impl Piece {
    pub(super) fn named(name: &str) -> Option<Piece> {
        Some(match name {
            "hips" => Piece::Hips,
            "chest" => Piece::Chest,
            "head" => Piece::Head,
            "arm" => Piece::Arm,
            "forearm" => Piece::Forearm,
            "thigh" => Piece::Thigh,
            "leg" => Piece::Leg,
            "foot" => Piece::Foot,
            _ => return None,
        })
    }
}

/// The body of a person: how far it differs from the one that the cages are modelled over.
///
/// That one has the mean proportions of Gordon et al. 2014, "2012 Anthropometric Survey of U.S.
/// Army Personnel", as fractions of the height: biacromial breadth 0.230, bideltoid breadth 0.28
/// to 0.29, hip breadth 0.20, hand length 0.11, foot length 0.154.
pub(super) struct Body {
    pub(super) height_m: f32,
    pub(super) bones: Skeleton,
    pub(super) girth: f32,
    /// The breadth at hips, waist, chest and shoulders.
    breadths: [f32; 4],
    /// How far the bust and the belly reach ahead, as fractions of the height.
    bust: f32,
    belly: f32,
    neck: f32,
    arm: f32,
    leg: f32,
    jaw: f32,
    /// The middle of the head, and half of its height. Metres.
    pub(super) head_m: Vec3,
    pub(super) half_head_m: f32,
}

/// The axis of the left arm: (height, forward, left). It runs through the joints of the skeleton.
const ARM_AXIS: [[f32; 3]; 3] =
    [[0.487, 0.014, 0.140], [0.635, -0.004, 0.128], [0.808, 0.0, 0.108]];
/// The axis of the leg: (height, forward).
const LEG_AXIS: [[f32; 2]; 4] = [[0.045, -0.008], [0.285, 0.006], [0.36, 0.006], [0.51, 0.0]];
/// The distance of a leg from the middle.
pub(super) const LEG_ASIDE: f32 = 0.052;
/// The height at which the trunk ends and the neck begins.
const NECK: [f32; 2] = [0.822, 0.846];

/// Interpolates linearly in a table of which the first column increases; constant beyond its ends.
fn interpolated<const N: usize>(table: &[[f32; N]], at: f32) -> [f32; N] {
    let after = table.partition_point(|row| row[0] <= at).clamp(1, table.len() - 1);
    let (low, high) = (table[after - 1], table[after]);
    let share = ((at - low[0]) / (high[0] - low[0])).clamp(0.0, 1.0);
    std::array::from_fn(|column| low[column] + (high[column] - low[column]) * share)
}

/// A bell that is 1 at `middle`.
fn bell(at: f32, middle: f32, width: f32) -> f32 {
    let off = (at - middle) / width;
    1.0 / (1.0 + off * off).powi(2)
}

impl Body {
    pub(super) fn new(person: &Person, head_top: f32) -> Body {
        let &Person { height_m, girth, is_female, is_child, .. } = person;
        // Larger relative to the body for children.
        let half_head_m = (height_m * 0.125).max(0.185) * 0.5;
        let (breadths, limbs) = match (is_child, is_female) {
            (true, _) => ([0.94, 1.02, 0.93, 0.96], [0.90, 0.96]),
            (_, true) => ([1.04, 0.90, 0.92, 0.95], [0.86, 1.0]),
            (_, false) => ([0.97, 1.0, 1.02, 1.02], [1.03, 0.98]),
        };
        let is_woman = is_female && !is_child;
        Body {
            height_m,
            bones: Skeleton::new(height_m, girth),
            girth,
            breadths,
            bust: if is_woman { 0.013 } else { 0.0 },
            belly: (girth - 1.03).max(0.0) * 0.22,
            neck: if is_woman || is_child { 0.88 } else { 1.02 } * (0.6 + 0.4 * girth),
            arm: limbs[0] * (0.6 + 0.4 * girth),
            leg: limbs[1] * (0.4 + 0.6 * girth),
            jaw: if is_female || is_child { 0.93 } else { 1.03 },
            head_m: vec3(0.010 * height_m, 0.0, head_top * height_m - half_head_m),
            half_head_m,
        }
    }

    /// The origin of a bone as fractions of the height.
    fn joint(&self, bone: usize) -> Vec3 {
        self.bones.bones[bone].at_m / self.height_m
    }

    /// The depth of the back relative to the body that cages are modelled over.
    pub(super) fn depth(&self) -> f32 {
        let [_, waist, chest, _] = self.breadths;
        (0.35 + 0.65 * (waist + chest) * 0.5) * self.girth
    }

    /// How far a forearm reaches from the middle in a sleeve of this thickness, as fractions of
    /// the height.
    pub(super) fn forearm_aside(&self, sleeve: f32) -> f32 {
        let arms = self.joint(bone::ARM[0]).y / ARM_AXIS[2][2];
        0.1307 * arms + (0.0236 + sleeve) * self.arm
    }

    /// The place of a point of a cage on the left, in metres of actor space. Heads are modelled in
    /// half heads from their middle, everything else in fractions of the height.
    pub(super) fn placed(&self, piece: Piece, point: Vec3) -> Vec3 {
        let fraction = match piece {
            Piece::Head => return self.on_head(point),
            Piece::Hips | Piece::Chest => self.on_trunk(point),
            Piece::Arm | Piece::Forearm => self.on_arm(point),
            Piece::Thigh | Piece::Leg => self.on_leg(point, self.leg),
            Piece::Foot => self.on_leg(point, 1.0),
        };
        fraction * self.height_m
    }

    fn on_head(&self, point: Vec3) -> Vec3 {
        // Jaw and cheeks, not the hair beside them.
        let share = bell(point.z, -0.75, 0.5) * f32::from(point.x > -0.2 && point.z > -1.02);
        let narrow = 1.0 + (self.jaw - 1.0) * share;
        self.head_m + point * vec3(1.0, narrow, 1.0) * self.half_head_m
    }

    fn on_trunk(&self, point: Vec3) -> Vec3 {
        let [hips, waist, chest, shoulders] = self.breadths;
        // The shoulders keep to the joints of the arms.
        let arms = self.joint(bone::ARM[0]).y / ARM_AXIS[2][2];
        let wide = [
            [0.53, hips * self.girth],
            [0.61, waist * self.girth],
            [0.66, (waist + chest) * 0.5 * self.girth],
            [0.74, chest * self.girth],
            [0.795, shoulders * arms],
            [NECK[0], shoulders * arms],
            [NECK[1], self.neck],
        ];
        let deep = [
            [0.53, self.girth],
            [0.61, (0.35 + 0.65 * waist) * self.girth],
            [0.74, (0.35 + 0.65 * chest) * self.girth],
            [NECK[0], chest * arms],
            [NECK[1], self.neck],
        ];
        let ahead = if point.x > 0.0 {
            let front = (point.x / 0.06).min(1.0);
            let bust = bell(point.z, 0.725, 0.035) * (1.0 - (point.y.abs() / 0.1).powi(2)).max(0.0);
            let belly = bell(point.z, 0.60, 0.075);
            front * (self.bust * bust + self.belly * belly)
        } else {
            0.0
        };
        let [_, wide] = interpolated(&wide, point.z);
        let [_, deep] = interpolated(&deep, point.z);
        vec3(point.x * deep + ahead, point.y * wide, point.z)
    }

    fn on_arm(&self, point: Vec3) -> Vec3 {
        let [_, x, y] = interpolated(&ARM_AXIS, point.z);
        let aside = self.joint(bone::ARM[0]).y / ARM_AXIS[2][2];
        vec3(x + (point.x - x) * self.arm, y * aside + (point.y - y) * self.arm, point.z)
    }

    fn on_leg(&self, point: Vec3, thick: f32) -> Vec3 {
        let [_, x] = interpolated(&LEG_AXIS, point.z);
        let x = if thick == 1.0 { point.x } else { x + (point.x - x) * thick };
        let aside = self.joint(bone::THIGH[0]).y;
        vec3(x, aside + (point.y - LEG_ASIDE) * thick, point.z)
    }
}
