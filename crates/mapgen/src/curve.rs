//! Reference lines made of straight pieces and arcs.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

/// A position and a heading in the plane. Metres and radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub(crate) position: DVec2,
    pub(crate) heading: f64,
}

impl Pose {
    pub(crate) fn direction(&self) -> DVec2 {
        DVec2::from_angle(self.heading)
    }

    /// The pose at the same position with the opposite heading.
    pub(crate) fn turned(&self) -> Pose {
        Pose { position: self.position, heading: wrapped(self.heading + PI) }
    }

    /// The pose `distance` metres ahead, with the same heading.
    pub(crate) fn ahead(&self, distance: f64) -> Pose {
        Pose { position: self.position + self.direction() * distance, heading: self.heading }
    }

    /// The pose `offset` metres to the right, with the same heading.
    pub(crate) fn right(&self, offset: f64) -> Pose {
        Pose { position: self.position - self.direction().perp() * offset, heading: self.heading }
    }
}

/// A straight piece (curvature 0) or an arc. Metres; positive curvature turns left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) start: Pose,
    pub(crate) length: f64,
    pub(crate) curvature: f64,
}

impl Piece {
    /// The pose at the end of the piece.
    pub(crate) fn end(&self) -> Pose {
        self.at(self.length)
    }

    /// The pose after `along` metres.
    pub(crate) fn at(&self, along: f64) -> Pose {
        let turn = self.curvature * along;
        let chord =
            if turn.abs() < 1e-12 { along } else { (turn * 0.5).sin() * 2.0 / self.curvature };
        Pose {
            position: self.start.position
                + DVec2::from_angle(self.start.heading + turn * 0.5) * chord,
            heading: self.start.heading + turn,
        }
    }

    /// The part between two distances from the start.
    fn part(&self, from: f64, to: f64) -> Piece {
        Piece { start: self.at(from), length: to - from, curvature: self.curvature }
    }

    /// The distance from the start at which the piece is nearest to a point.
    fn nearest(&self, point: DVec2) -> f64 {
        let gap = point - self.start.position;
        let along = if self.curvature == 0.0 {
            gap.dot(self.start.direction())
        } else {
            let radius = 1.0 / self.curvature;
            let center = self.start.position + self.start.direction().perp() * radius;
            let out = (self.start.position - center).to_angle();
            wrapped((point - center).to_angle() - out) * radius
        };
        along.clamp(0.0, self.length)
    }
}

/// The line parallel to another, `left` metres to its left.
pub(crate) fn beside(pieces: &[Piece], left: f64) -> Vec<Piece> {
    let moved = pieces.iter().map(|piece| {
        let stretch = 1.0 - piece.curvature * left;
        Piece {
            start: piece.start.right(-left),
            length: piece.length * stretch,
            curvature: piece.curvature / stretch,
        }
    });
    moved.collect()
}

/// The same line in the opposite direction.
pub(crate) fn reversed(pieces: &[Piece]) -> Vec<Piece> {
    let turned = pieces.iter().rev().map(|piece| Piece {
        start: piece.end().turned(),
        length: piece.length,
        curvature: -piece.curvature,
    });
    turned.collect()
}

/// The pose after `along` metres of a line.
pub(crate) fn at(pieces: &[Piece], mut along: f64) -> Pose {
    for piece in &pieces[..pieces.len() - 1] {
        if along <= piece.length {
            return piece.at(along);
        }
        along -= piece.length;
    }
    pieces[pieces.len() - 1].at(along)
}

/// The distance from a line's start at which it is nearest to a point.
pub(crate) fn nearest(pieces: &[Piece], point: DVec2) -> f64 {
    nearest_of(pieces, point, |_| true)
}

/// As [`nearest`], among the parts of the line whose heading is within 0.3 rad of `heading`.
pub(crate) fn passing(pieces: &[Piece], point: DVec2, heading: f64) -> f64 {
    nearest_of(pieces, point, |at| wrapped(at - heading).abs() < 0.3)
}

fn nearest_of(pieces: &[Piece], point: DVec2, fits: impl Fn(f64) -> bool) -> f64 {
    let (mut best, mut before) = ((f64::MAX, 0.0), 0.0);
    for piece in pieces {
        let along = piece.nearest(point);
        let at = piece.at(along);
        let away = at.position.distance(point);
        if away < best.0 && fits(at.heading) {
            best = (away, before + along);
        }
        before += piece.length;
    }
    best.1
}

/// The part of a closed line between two distances; it may pass the line's start.
pub(crate) fn cut(closed: &[Piece], from: f64, to: f64) -> Vec<Piece> {
    let total = length(closed);
    let to = if to <= from { to + total } else { to };
    let (mut pieces, mut before) = (Pieces::default(), 0.0);
    for piece in closed.iter().chain(closed) {
        let (start, end) = ((from - before).max(0.0), (to - before).min(piece.length));
        if end - start > 1e-3 {
            pieces.0.push(piece.part(start, end));
        }
        before += piece.length;
    }
    pieces.0
}

/// A closed polygon with rounded corners; the line starts in the middle of the first side.
pub(crate) fn closed(corners: &[DVec2], radius: f64) -> Vec<Piece> {
    let middle = (corners[0] + corners[1]) * 0.5;
    let mut line = vec![middle];
    line.extend(&corners[1..]);
    line.extend([corners[0], middle]);
    rounded(&line, &vec![radius; corners.len()])
}

/// The length that stays straight at an end of a line if the side is long enough. Metres.
const STRAIGHT_M: f64 = 14.0;

/// A polyline with rounded inner corners, as tangent pieces.
///
/// Each radius is reduced to what the neighbouring sides have room for.
pub(crate) fn rounded(corners: &[DVec2], radii: &[f64]) -> Vec<Piece> {
    let mut pieces = Pieces::default();
    let mut cut_before = 0.0;
    for index in 0..corners.len() - 1 {
        let (from, to) = (corners[index], corners[index + 1]);
        let along = to - from;
        let heading = along.to_angle();
        let (mut cut_after, mut arc) = (0.0, None);
        if let Some(beyond) = corners.get(index + 2) {
            let turn = wrapped((*beyond - to).to_angle() - heading);
            // Two corners share the side between them; a side at an end of the line has one corner.
            let room = |length: f64, is_end: bool| {
                if is_end { (length - STRAIGHT_M).max(length * 0.48) } else { length * 0.48 }
            };
            let last = index + 3 == corners.len();
            let room = room(along.length(), index == 0).min(room((*beyond - to).length(), last));
            let tangent = (radii[index] * (turn.abs() * 0.5).tan()).min(room);
            if turn.abs() > 1e-4 {
                let radius = tangent / (turn.abs() * 0.5).tan();
                cut_after = tangent;
                arc = Some((radius * turn.abs(), turn.signum() / radius));
            }
        }
        let start = Pose { position: from + along.normalize_or_zero() * cut_before, heading };
        pieces.push(start, along.length() - cut_before - cut_after, 0.0);
        if let Some((length, curvature)) = arc {
            let entry = to - along.normalize_or_zero() * cut_after;
            pieces.push(Pose { position: entry, heading }, length, curvature);
        }
        cut_before = cut_after;
    }
    pieces.0
}

/// A smooth line from one pose to another: straight, arc, straight where that fits, else two arcs.
pub(crate) fn between(from: Pose, to: Pose) -> Vec<Piece> {
    let gap = to.position - from.position;
    let (ahead, beside) = (gap.dot(from.direction()), gap.perp_dot(from.direction()));
    let turn = wrapped(to.heading - from.heading);
    let mut pieces = Pieces::default();
    if turn.abs() < 1e-6 && beside.abs() < 1e-6 {
        pieces.push(from, ahead, 0.0);
        return pieces.0;
    }
    if turn.abs() > 0.02 && turn.abs() < PI - 0.1 {
        // Distances from both poses to the intersection of their tangents.
        let cross = from.direction().perp_dot(to.direction());
        let before = gap.perp_dot(to.direction()) / cross;
        let after = from.direction().perp_dot(gap) / cross;
        let tangent = before.min(after);
        if tangent > 1.0 {
            let radius = tangent / (turn.abs() * 0.5).tan();
            pieces.push(from, before - tangent, 0.0);
            let entry = from.position + from.direction() * (before - tangent);
            pieces.push(
                Pose { position: entry, heading: from.heading },
                radius * turn.abs(),
                turn.signum() / radius,
            );
            let exit = to.position - to.direction() * (after - tangent);
            pieces.push(Pose { position: exit, heading: to.heading }, after - tangent, 0.0);
            return pieces.0;
        }
    }
    two_arcs(from, to)
}

/// Two arcs that meet at the point where both have the same tangent length.
fn two_arcs(from: Pose, to: Pose) -> Vec<Piece> {
    let gap = to.position - from.position;
    let (t1, t2) = (from.direction(), to.direction());
    let sum = t1 + t2;
    let (a, b, c) = (2.0 * (1.0 - t1.dot(t2)), 2.0 * gap.dot(sum), -gap.length_squared());
    let d = if a.abs() < 1e-9 {
        -c / b
    } else {
        (-b + (b * b - 4.0 * a * c).max(0.0).sqrt()) / (2.0 * a)
    };
    let joint = (from.position + to.position + (t1 - t2) * d) * 0.5;
    let mut pieces = Pieces::default();
    let mut arc = |start: Pose, end: DVec2| -> Pose {
        let chord = end - start.position;
        let turn = wrapped(chord.to_angle() - start.heading) * 2.0;
        let length = if turn.abs() < 1e-9 {
            chord.length()
        } else {
            chord.length() * turn * 0.5 / (turn * 0.5).sin()
        };
        pieces.push(start, length, turn / length);
        Pose { position: end, heading: start.heading + turn }
    };
    let middle = arc(from, joint);
    arc(middle, to.position);
    pieces.0
}

#[derive(Default)]
struct Pieces(Vec<Piece>);

impl Pieces {
    /// Adds a piece unless it is shorter than one millimetre.
    fn push(&mut self, start: Pose, length: f64, curvature: f64) {
        if length > 1e-3 {
            self.0.push(Piece { start, length, curvature });
        }
    }
}

/// The equivalent angle in [-π, π].
pub(crate) fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// The length of a line. Metres.
pub(crate) fn length(pieces: &[Piece]) -> f64 {
    pieces.iter().map(|piece| piece.length).sum()
}
