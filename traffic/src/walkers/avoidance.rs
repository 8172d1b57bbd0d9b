//! Avoidance of others: optimal reciprocal collision avoidance (van den Berg, Guy, Lin, Manocha,
//! 2011). Each of two walkers takes half of the change that avoids a contact; a vehicle or a prop
//! takes none.

use glam::Vec2;

use super::{
    groups::Groups,
    linear_program::{HalfPlane, nearest},
    pace,
    view::View,
};
use crate::{body::Body, neighbours::Neighbours};

/// Distance and number up to which others are considered.
const NEAR_M: f32 = 5.0;
const NEIGHBOURS_MAX: usize = 10;
/// Time within which contacts are avoided, with walkers and with others. Seconds.
const HORIZON_S: f32 = 2.2;
const BODY_HORIZON_S: f32 = 1.6;
/// Time within which a walker does not come to where a body is now, which may stop at any time. Seconds.
const STOP_S: f32 = 0.5;
/// Time in which an overlap ends. Seconds.
const OVERLAP_S: f32 = 0.6;
/// What a walker keeps from others beside its own radius. Metres.
const SPACE_M: f32 = 0.1;
const BODY_SPACE_M: f32 = 0.3;
/// Cosine of the angle to a body below which a walker that keeps its space walks along it.
const INWARDS: f32 = 0.3;
/// Radius of the discs in the corners of a body, by half its width: a walker that keeps its space from
/// them clears the corners.
const CORNER_SHARE: f32 = 0.3;
/// Half the width of a body from which on it has such corners. Metres.
const CORNERS_FROM_M: f32 = 0.5;
/// Speed that others expect of one that stands on the road and is to leave it. Metres per second.
const LEAVES_ROAD_MPS: f32 = 0.8;
/// Distance within which a walker walks round one that stands straight ahead. Metres.
const STANDS_AHEAD_M: f32 = 1.2;
/// Least cosine of the angle to one that is straight ahead.
const STRAIGHT: f32 = 0.99;
/// How far a walker turns to the right for others that come towards it, and round one that stands ahead.
const RIGHT: f32 = 0.18;
/// Fastest that a walker becomes to avoid others, by the wanted speed, and when it stands. Metres per
/// second.
const FASTER: f32 = 1.25;
const ASIDE_MPS: f32 = 0.5;

/// Everything around the walkers of a frame.
pub(super) struct Crowd<'a> {
    pub(super) bodies: &'a Neighbours,
    pub(super) groups: &'a Groups,
    /// By row: the velocity that a walker prefers.
    pub(super) wanted: &'a [Vec2],
    /// By row: whether others let it pass, as if it walked already.
    pub(super) leaves_road: &'a [bool],
    pub(super) view: &'a View<'a>,
}

/// A disc that is to be avoided.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Disc {
    /// Its centre, from the walker.
    at: Vec2,
    velocity: Vec2,
    /// The sum of both radii.
    radius_m: f32,
    /// The part of the change that the walker takes.
    share: f32,
    horizon_s: f32,
}

/// The place of a vehicle or a prop in the axes of its body.
struct Place {
    /// The walker.
    from: Vec2,
    low: Vec2,
    high: Vec2,
    /// What the middle of the walker keeps from the rectangle.
    radius_m: f32,
}

impl Crowd<'_> {
    /// Returns the velocity of a walker in the next frame, its ground not considered.
    pub(super) fn velocity(&self, row: usize) -> Vec2 {
        let agents = self.view.agents;
        let agent = agents.led[row] as usize;
        let at = agents.position[agent].truncate();
        let velocity = agents.velocity[agent].clamp_length_max(3.0);
        let mut wanted = self.wanted[row];
        let discs = self.discs(row, agent, at, velocity, &mut wanted);
        let planes: Vec<HalfPlane> = discs.iter().map(|disc| disc.plane(velocity)).collect();
        let limit = (wanted.length() * FASTER).max(ASIDE_MPS);
        let chosen = nearest(&planes, limit, wanted);
        // However short a frame is, the first step of a standing walker is no longer standing.
        let first = if velocity.length() < pace::STANDING_MPS { pace::FIRST_MPS } else { 0.0 };
        let change = (pace::ACCELERATION_MPS2 * self.view.delta_s).max(first);
        velocity + (chosen - velocity).clamp_length_max(change)
    }

    /// Returns the discs around a walker, the nearest first, and turns the wanted velocity to the
    /// right of those that come towards it.
    fn discs(
        &self,
        row: usize,
        agent: usize,
        at: Vec2,
        velocity: Vec2,
        wanted: &mut Vec2,
    ) -> Vec<Disc> {
        let agents = self.view.agents;
        let radius_m = agents.body[agent].half_width_m + SPACE_M;
        let mut near: Vec<(f32, u32, Disc)> = Vec::new();
        let (mut is_met, mut round) = (false, Vec2::ZERO);
        for other in agents.foot_places.near(at, NEAR_M) {
            let index = other as usize;
            let way = agents.position[index].truncate() - at;
            if index == agent || way.length_squared() > NEAR_M * NEAR_M {
                continue;
            }
            let moves = agents.velocity[index];
            let other_row = agents.led.binary_search(&other).ok();
            let is_friend = other_row.is_some_and(|it| self.groups.are_together(row, it));
            let comes = moves.dot(velocity) < -0.3 && way.dot(*wanted) > 0.0;
            let straight = way.normalize_or_zero().dot(wanted.normalize_or_zero());
            is_met |= comes && straight > 0.9;
            let stands = moves.length() < pace::SLOW_MPS;
            if stands && straight > STRAIGHT && way.length() < STANDS_AHEAD_M {
                // Right behind one that stands, the nearest free velocity would be none.
                let left = if way.perp_dot(*wanted) > 0.0 { 1.0 } else { -1.0 };
                round = wanted.perp() * left * RIGHT;
            }
            // Walkers that this planner does not lead avoid no one.
            let share = if other_row.is_some() { 0.5 } else { 1.0 };
            let space_m = if is_friend { 0.0 } else { SPACE_M };
            let leaving = other_row.filter(|&it| self.leaves_road[it] && stands);
            let moves =
                leaving.map_or(moves, |it| self.wanted[it].clamp_length_max(LEAVES_ROAD_MPS));
            near.push((
                way.length_squared(),
                other,
                Disc {
                    at: way,
                    velocity: moves,
                    radius_m: radius_m + agents.body[index].half_width_m + space_m,
                    share,
                    horizon_s: HORIZON_S,
                },
            ));
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(NEIGHBOURS_MAX);
        let mut discs = self.bodies_near(at, radius_m + BODY_SPACE_M);
        discs.extend(near.into_iter().map(|(.., disc)| disc));
        *wanted += if is_met { -wanted.perp() * RIGHT } else { round };
        discs
    }

    /// Returns a velocity, to which the ground may have bound the one of [`Crowd::velocity`], slowed down where
    /// it leads to the place of a vehicle or a prop.
    pub(super) fn slowed(&self, row: usize, velocity: Vec2) -> Vec2 {
        if velocity == Vec2::ZERO {
            return velocity;
        }
        let agents = self.view.agents;
        let agent = agents.led[row] as usize;
        let at = agents.position[agent].truncate();
        let radius_m = agents.body[agent].half_width_m + SPACE_M;
        let near = self.bodies.near(at, NEAR_M + agents.reach_max_m);
        let times_s = near.into_iter().map(|other| {
            let (body, forward) = (&agents.body[other as usize], agents.forward[other as usize]);
            let into_axes = Vec2::new(forward.x, -forward.y);
            let place = Place {
                from: into_axes.rotate(at - agents.position[other as usize].truncate()),
                low: Vec2::new(-body.rear_m, -body.half_width_m),
                high: Vec2::new(body.front_m, body.half_width_m),
                radius_m,
            };
            place.reached_s(into_axes.rotate(velocity))
        });
        velocity * (times_s.fold(STOP_S, f32::min) / STOP_S)
    }

    /// Returns the discs of vehicles and props around a walker of this radius.
    fn bodies_near(&self, at: Vec2, radius_m: f32) -> Vec<Disc> {
        let agents = self.view.agents;
        let mut discs = Vec::new();
        for other in self.bodies.near(at, NEAR_M + agents.reach_max_m) {
            let index = other as usize;
            let (body, forward) = (&agents.body[index], agents.forward[index]);
            let way = agents.position[index].truncate() - at;
            if way.length() > NEAR_M + body.front_m.max(body.rear_m) {
                continue;
            }
            discs.extend(body_discs(body).filter_map(|(center, of_body_m)| {
                let from_origin = forward.rotate(center);
                let to = way + from_origin;
                (to.length_squared() < NEAR_M * NEAR_M).then_some(Disc {
                    at: to,
                    // The tail of a vehicle that turns swings out.
                    velocity: agents.velocity[index] + agents.yaw_rate[index] * from_origin.perp(),
                    radius_m: radius_m + of_body_m,
                    share: 1.0,
                    horizon_s: BODY_HORIZON_S,
                })
            }));
        }
        discs
    }
}

/// Returns discs that cover a body, as centres in its axes and radii: a row along it, and its corners.
fn body_discs(body: &Body) -> impl Iterator<Item = (Vec2, f32)> {
    let half_m = body.half_width_m.max(0.1);
    // The discs touch each other, so that none fits between them.
    let (front, rear) = (body.front_m - half_m, half_m - body.rear_m);
    let count = (((front - rear) / (1.2 * half_m)).ceil().clamp(0.0, 16.0)) as usize;
    let row = (0..=count).map(move |step| {
        let along = rear + (front - rear) * (step as f32 / count.max(1) as f32);
        (Vec2::new(along.clamp(rear.min(front), front.max(rear)), 0.0), half_m)
    });
    let corner_m = CORNER_SHARE * half_m;
    let (aside, ends) = (half_m - corner_m, [body.front_m - corner_m, corner_m - body.rear_m]);
    let corners = ends.into_iter().flat_map(move |x| [(x, aside), (x, -aside)]);
    let has_corners = half_m > CORNERS_FROM_M;
    row.chain(corners.filter(move |_| has_corners).map(move |(x, y)| (Vec2::new(x, y), corner_m)))
}

impl Place {
    /// Returns the time after which a walker with this velocity comes to the place; infinity if it does not, and 0 if
    /// it is there and walks on into it.
    fn reached_s(&self, velocity: Vec2) -> f32 {
        let nearest = self.from.clamp(self.low, self.high);
        let mut inwards = nearest - self.from;
        if inwards.length_squared() <= self.radius_m * self.radius_m {
            // It may walk along the edge, the straighter the nearer the body is.
            let gap_m = inwards.length() - (self.radius_m - SPACE_M);
            let most = INWARDS * (gap_m / SPACE_M).clamp(0.0, 1.0);
            if inwards == Vec2::ZERO {
                // Inside it may walk away from the middle.
                inwards = 0.5 * (self.low + self.high) - self.from;
            }
            let is_inwards = velocity.dot(inwards) > most * velocity.length() * inwards.length();
            return if is_inwards { 0.0 } else { f32::INFINITY };
        }
        let (x, y) = (Vec2::new(self.radius_m, 0.0), Vec2::new(0.0, self.radius_m));
        let sides = [x, y].map(|wider| self.sides_reached_s(wider, velocity));
        let corners = [
            self.low,
            self.high,
            Vec2::new(self.low.x, self.high.y),
            Vec2::new(self.high.x, self.low.y),
        ];
        let corners = corners.map(|corner| self.corner_reached_s(corner, velocity));
        sides.into_iter().chain(corners).fold(f32::INFINITY, f32::min)
    }

    /// Returns when a walker outside comes into the rectangle, which is wider by `wider` on both sides.
    fn sides_reached_s(&self, wider: Vec2, velocity: Vec2) -> f32 {
        let to_low = (self.low - wider - self.from) / velocity;
        let to_high = (self.high + wider - self.from) / velocity;
        let (first, last) = (to_low.min(to_high), to_low.max(to_high));
        let (enters, leaves) = (first.max_element(), last.min_element());
        if enters >= 0.0 && enters < leaves { enters } else { f32::INFINITY }
    }

    /// Returns when a walker outside comes within the radius of a corner.
    fn corner_reached_s(&self, corner: Vec2, velocity: Vec2) -> f32 {
        let way = corner - self.from;
        let (along, speed) = (velocity.dot(way), velocity.length_squared());
        let outside = way.length_squared() - self.radius_m * self.radius_m;
        let root = along * along - speed * outside;
        if along <= 0.0 || root <= 0.0 {
            return f32::INFINITY;
        }
        outside / (along + root.sqrt())
    }
}

impl Disc {
    /// Returns the velocities that keep a walker with this velocity off the disc (section 4 of the
    /// paper).
    fn plane(&self, velocity: Vec2) -> HalfPlane {
        let relative = velocity - self.velocity;
        let (far, radius) = (self.at.length_squared(), self.radius_m);
        let cut_off = |time_s: f32| {
            let from_center = relative - self.at / time_s;
            let length = from_center.length();
            // Two walkers in one place part along x.
            let outwards = from_center.try_normalize().unwrap_or(Vec2::X);
            (outwards, outwards * (radius / time_s - length))
        };
        let (normal_direction, change) = if far <= radius * radius {
            let (outwards, change) = cut_off(OVERLAP_S);
            (-outwards.perp(), change)
        } else {
            let from_center = relative - self.at / self.horizon_s;
            let along = from_center.dot(self.at);
            if along < 0.0 && along * along > radius * radius * from_center.length_squared() {
                let (outwards, change) = cut_off(self.horizon_s);
                (-outwards.perp(), change)
            } else {
                let leg = (far - radius * radius).sqrt();
                let at = self.at;
                let direction = if at.perp_dot(from_center) > 0.0 {
                    Vec2::new(at.x * leg - at.y * radius, at.x * radius + at.y * leg) / far
                } else {
                    -Vec2::new(at.x * leg + at.y * radius, -at.x * radius + at.y * leg) / far
                };
                (direction, direction * relative.dot(direction) - relative)
            }
        };
        HalfPlane { point: velocity + change * self.share, direction: normal_direction }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Bodies;

    #[test]
    fn a_place_is_reached_after_the_time_of_the_way_to_its_edge() {
        let reached_s = |x: f32, y: f32, velocity: Vec2| {
            let from = Vec2::new(x, y);
            let (low, high) = (Vec2::new(-2.0, -0.8), Vec2::new(2.5, 0.8));
            Place { from, low, high, radius_m: 0.5 }.reached_s(velocity)
        };
        let (ahead, left) = (Vec2::new(1.2, 0.0), Vec2::new(0.0, 1.0));
        assert!((reached_s(-3.1, 0.5, ahead) - 0.5).abs() < 1e-5);
        assert!((reached_s(1.0, -1.8, left) - 0.5).abs() < 1e-5);
        // Beside a corner, 0.3 m off its side, the edge lies 0.4 m before it.
        assert!((reached_s(-3.0, 1.1, ahead) - 0.5).abs() < 1e-5);
        // A walker comes to each corner on the diagonal, 0.5 m before it.
        for (x, y) in [(-2.0, -0.8), (-2.0, 0.8), (2.5, -0.8), (2.5, 0.8)] {
            let outwards = Vec2::new(x, y).signum() * std::f32::consts::FRAC_1_SQRT_2;
            let from = Vec2::new(x, y) + 1.1 * outwards;
            assert!((reached_s(from.x, from.y, -1.2 * outwards) - 0.5).abs() < 1e-5);
        }
        assert_eq!(reached_s(-3.1, 1.4, ahead), f32::INFINITY, "it passes");
        assert_eq!(reached_s(3.1, 0.0, ahead), f32::INFINITY, "it walks away");
        assert_eq!(reached_s(-2.4, 0.2, ahead), 0.0);
        assert_eq!(reached_s(0.0, -1.2, ahead), f32::INFINITY, "it walks along the edge");
        // The walker is 0.4 m wide to each side: 0.1 m are left, then none.
        let slanting = Vec2::new(1.2, 0.3);
        assert_eq!(reached_s(0.0, -1.299, slanting), f32::INFINITY, "it has its space");
        assert_eq!(reached_s(0.0, -1.201, slanting), 0.0, "it would touch");
        assert_eq!(reached_s(-1.0, 0.0, slanting), 0.0, "it is inside");
        assert_eq!(reached_s(-1.0, 0.0, -ahead), f32::INFINITY, "it walks out");
    }

    #[test]
    fn a_walker_that_keeps_its_space_from_a_body_clears_its_corners() {
        let bodies = Bodies::from_catalogue();
        for (index, blueprint) in town::catalogue().iter().enumerate() {
            if blueprint.kind != town::Kind::Vehicle {
                continue;
            }
            let body = bodies.of(index as u32);
            for x in [body.front_m, -body.rear_m] {
                for y in [body.half_width_m, -body.half_width_m] {
                    let from = |(at, radius): (Vec2, f32)| at.distance(Vec2::new(x, y)) - radius;
                    let sticks_out_m = body_discs(&body).map(from).fold(f32::INFINITY, f32::min);
                    assert!(sticks_out_m < 0.8 * BODY_SPACE_M, "{}: {sticks_out_m}", blueprint.id);
                }
            }
        }
    }
}
