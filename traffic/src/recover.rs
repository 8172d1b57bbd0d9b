//! Out of trouble on one's own wheels: back out of what blocks, turn, and return to the lane.

use glam::Vec2;

use crate::{agents::Crowd, leader::Leader, rows::Rows, steer::Deviation};

/// Farther off its line than this, a vehicle is in trouble.
const ASTRAY_M: f32 = 1.3;
/// Turned from its line by more than this, a vehicle is in trouble.
const TURNED_RAD: f32 = 0.6;
/// Speed of a vehicle in trouble.
pub(crate) const CAREFUL_MPS: f32 = 3.0;
/// Speed of backing out.
const BACK_MPS: f32 = 1.5;
/// Standing so long for no good reason is being stuck.
const PATIENCE_S: f32 = 3.0;
/// One attempt at backing out.
const REVERSE_S: f32 = 3.0;
/// After it one waits at least so long.
const HOLD_S: f32 = 4.0;
/// Whoever is so near is touched, or nearly.
const TOUCH_M: f32 = 0.1;
/// Room that backing out needs behind.
const BEHIND_M: f32 = 1.5;

/// Whether a vehicle has lost its line.
pub(crate) fn is_in_trouble(deviation: &Deviation) -> bool {
    deviation.left_m.abs() > ASTRAY_M || deviation.heading_rad.abs() > TURNED_RAD
}

/// How a vehicle gets out of trouble.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    /// It need not.
    Forward,
    /// It backs out of what blocks it.
    Back,
    /// It has backed out, and lets the other one go first.
    Hold,
}

/// Decides how a row gets on in this frame.
///
/// `gain` is the acceleration that it would ask for. Who is stuck differs by id in patience, so
/// that of two who block each other one goes first.
pub(crate) fn way_out(
    rows: &mut Rows,
    row: usize,
    crowd: &Crowd,
    deviation: &Deviation,
    leader: &Leader,
    gain: f32,
    delta_s: f32,
) -> Way {
    let body = crowd.driven[row] as usize;
    let speed = crowd.speed(body);
    if rows.reverse_s[row] < 0.0 {
        rows.reverse_s[row] = (rows.reverse_s[row] + delta_s).min(0.0);
        return Way::Hold;
    }
    if rows.reverse_s[row] > 0.0 {
        rows.reverse_s[row] -= delta_s;
        if rows.reverse_s[row] > 0.0 && is_free(crowd, body, -1.0, BEHIND_M) {
            return Way::Back;
        }
        rows.reverse_s[row] = -(HOLD_S + 2.0 * (rows.id[row] % 4) as f32);
        return Way::Hold;
    }
    if speed > 2.0 {
        rows.reverses[row] = 0;
    }
    let pushes = gain > 0.4;
    let blocked_askew = leader.gap_m < 2.5
        && (is_in_trouble(deviation) || leader.aligned < 0.7 || leader.gap_m < TOUCH_M)
        && crowd.velocity[leader.body as usize].length_squared() < 0.1;
    let stuck = speed.abs() < 0.25 && (pushes || blocked_askew);
    rows.stuck_s[row] = if stuck { rows.stuck_s[row] + delta_s } else { 0.0 };
    let patience = PATIENCE_S + (rows.id[row] % 5) as f32 + 2.0 * rows.reverses[row].min(5) as f32;
    if rows.stuck_s[row] > patience {
        rows.stuck_s[row] = 0.0;
        if is_free(crowd, body, -1.0, BEHIND_M) {
            rows.reverse_s[row] = REVERSE_S;
            rows.reverses[row] = rows.reverses[row].saturating_add(1);
            return Way::Back;
        }
    }
    Way::Forward
}

/// The acceleration of backing out, along the tail.
pub(crate) fn back_gain(backward_mps: f32) -> f32 {
    (1.5 * (BACK_MPS - backward_mps)).clamp(-3.0, 1.5)
}

/// Whether nobody is within `distance_m` in front (`direction` 1) or behind (−1) of a body.
pub(crate) fn is_free(crowd: &Crowd, body: usize, direction: f32, distance_m: f32) -> bool {
    let size = crowd.body[body];
    let forward = crowd.forward[body];
    let edge = if direction > 0.0 { size.front_m } else { size.rear_m };
    let centre = crowd.position[body].truncate() + forward * direction * (edge + 0.5 * distance_m);
    (0..crowd.count()).all(|other| {
        other == body
            || (crowd.position[other].z - crowd.position[body].z).abs() > 3.0
            || !touches(crowd, other, centre, forward, 0.5 * distance_m, size.half_width_m + 0.2)
    })
}

/// Whether a body touches a box around `centre`, by separating axes.
fn touches(
    crowd: &Crowd,
    body: usize,
    centre: Vec2,
    forward: Vec2,
    length: f32,
    width: f32,
) -> bool {
    let size = crowd.body[body];
    let other_forward = crowd.forward[body];
    let half = 0.5 * size.length_m();
    let middle =
        crowd.position[body].truncate() + other_forward * 0.5 * (size.front_m - size.rear_m);
    let to = middle - centre;
    let axes = [forward, forward.perp(), other_forward, other_forward.perp()];
    axes.iter().all(|axis| {
        let mine = length * axis.dot(forward).abs() + width * axis.dot(forward.perp()).abs();
        let theirs = half * axis.dot(other_forward).abs()
            + size.half_width_m * axis.dot(other_forward.perp()).abs();
        to.dot(*axis).abs() <= mine + theirs
    })
}
