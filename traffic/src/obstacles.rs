//! Obstacles in the swept path of a wide vehicle: in curves its front overhang swings out of the
//! lane and its rear cuts the corner.

use glam::Vec2;

use crate::{
    agents::Agents,
    body::Body,
    leader::Leader,
    occupancy::Occupancy,
    route::{ahead, shift_at},
    spread::Spread,
    steer::{evasion_left, wide_offset_left},
    swept_path,
    tracks::{NONE, Tracks},
    vehicle_table::{Vehicle, VehicleTable},
};

/// Clearance beside an obstacle.
const MARGIN_M: f32 = 0.25;
/// Clearance after the vehicle has waited for a while or has reversed: it passes slowly.
const NARROW_M: f32 = 0.06;
/// Waiting time after which [`NARROW_M`] applies.
const PATIENCE_S: f32 = 3.0;
/// A waiting vehicle does not start while a passing one is nearer than this.
const PASSING_M: f32 = 1.0;
/// Step of the prediction along the route.
const STEP_M: f32 = 1.0;
/// Most that the middle of a vehicle moves in a step.
const STRIDE_M: f32 = 1.5 * STEP_M;
/// Least prediction distance, so that a waiting vehicle sees what is beyond the junction.
const HORIZON_M: f32 = 45.0;
/// Distance over which a vehicle returns to its line.
pub(crate) const RETURN_M: f32 = 8.0;
/// A crossing agent faster than this will be gone.
const STANDING_MPS: f32 = 1.5;

/// An agent in the swept path of the vehicle of a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Obstacle {
    pub(crate) row: usize,
    /// The agent as a leader on the same lane.
    pub(crate) leader: Leader,
    /// Unit vector from the path of the vehicle towards the agent, across the path.
    pub(crate) away: Vec2,
}

/// Returns the obstacles of one row in a list that is sorted by row.
pub(crate) fn of_row(obstacles: &[Obstacle], row: usize) -> &[Obstacle] {
    let begin = obstacles.partition_point(|obstacle| obstacle.row < row);
    let end = begin + obstacles[begin..].partition_point(|obstacle| obstacle.row == row);
    &obstacles[begin..end]
}

/// A rectangle on the ground.
#[derive(Clone, Copy)]
pub(crate) struct Footprint {
    pub(crate) middle: Vec2,
    pub(crate) forward: Vec2,
    pub(crate) half: Vec2,
}

impl Footprint {
    /// Returns the footprint of a vehicle at a pose.
    pub(crate) fn of(body: &Body, origin: Vec2, forward: Vec2) -> Footprint {
        Footprint {
            middle: origin + forward * 0.5 * (body.front_m - body.rear_m),
            forward,
            half: Vec2::new(0.5 * body.length_m(), body.half_width_m),
        }
    }

    /// Returns the footprint enlarged on all sides.
    pub(crate) fn grown(self, by_m: f32) -> Footprint {
        Footprint { half: self.half + by_m, ..self }
    }

    /// Returns the footprint moved by a vector.
    pub(crate) fn shifted(self, by: Vec2) -> Footprint {
        Footprint { middle: self.middle + by, ..self }
    }

    /// Returns whether two rectangles touch.
    pub(crate) fn touches(&self, other: &Footprint) -> bool {
        self.gaps_m(other).all(|gap_m| gap_m <= 0.0)
    }

    /// Returns whether [`Footprint::gap_m`] is less than this.
    pub(crate) fn is_nearer(&self, other: &Footprint, than_m: f32) -> bool {
        self.gaps_m(other).all(|gap_m| gap_m < than_m)
    }

    /// Returns the gap between two rectangles, negative if they overlap: the largest along their axes,
    /// which is less than the distance of two corners.
    pub(crate) fn gap_m(&self, other: &Footprint) -> f32 {
        self.gaps_m(other).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Returns the gaps along the axes of both rectangles.
    fn gaps_m(&self, other: &Footprint) -> impl Iterator<Item = f32> {
        let (one, other) = (*self, *other);
        let to = other.middle - one.middle;
        let reach = |of: &Footprint, axis: Vec2| {
            of.half.x * of.forward.dot(axis).abs() + of.half.y * of.forward.perp_dot(axis).abs()
        };
        [one.forward, one.forward.perp(), other.forward, other.forward.perp()]
            .into_iter()
            .map(move |axis| to.dot(axis).abs() - (reach(&one, axis) + reach(&other, axis)))
    }
}

/// An agent near the course of a vehicle.
struct Near {
    agent: usize,
    footprint: Footprint,
    /// Half its diagonal.
    radius_m: f32,
    /// The step of the course before which the vehicle is too far away.
    from_step: u32,
}

impl Near {
    fn new((agent, footprint): (usize, Footprint)) -> Near {
        Near { agent, footprint, radius_m: footprint.half.length(), from_step: 0 }
    }

    /// Returns whether a footprint of a course in steps of [`STEP_M`] touches the agent.
    fn is_touched(&mut self, place: &Footprint, step: u32) -> bool {
        if step < self.from_step {
            return false;
        }
        let reach_m = self.radius_m + place.half.length();
        let apart_m = place.middle.distance(self.footprint.middle) - reach_m;
        if apart_m > 0.0 {
            self.from_step = step + 1 + (apart_m / STRIDE_M) as u32;
            return false;
        }
        place.touches(&self.footprint)
    }
}

/// Lists the agents that wide vehicles would touch if all others stood still, and the wide vehicles
/// that others would touch, unless the vehicle ignores them. Sorted by row.
pub(crate) fn find(
    vehicles: &VehicleTable,
    tracks: &Tracks,
    agents: &Agents,
    occupancy: &Occupancy,
    spread: Spread,
    found: &mut Vec<Obstacle>,
) {
    spread.list(vehicles.len(), found, |row, found| {
        if vehicles[row].located == 1 && vehicles[row].u_turn == 0 {
            let begin = found.len();
            find_for(vehicles, row, tracks, agents, found);
            let mut index = begin;
            while index < found.len() {
                if occupancy.reacts_to(agents.driven[row], found[index].leader.agent) {
                    index += 1;
                } else {
                    found.remove(index);
                }
            }
        }
    });
}

fn find_for(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    found: &mut Vec<Obstacle>,
) {
    let own = agents.driven[row] as usize;
    let (body, position) = (&agents.body[own], agents.position[own]);
    let speed = agents.speed(own).max(0.0);
    // Beside a prop, a vehicle may be outside its lane.
    let passes_prop = vehicles[row].passes_prop();
    let wide = body.is_wide() || passes_prop;
    let is_patient =
        vehicles[row].reservation_idle_s <= PATIENCE_S && vehicles[row].reverse_count == 0;
    let margin_m = if is_patient { MARGIN_M } else { NARROW_M };
    let horizon_m = (0.25 * speed * speed + 2.0 * speed + 12.0)
        .max(if wide { HORIZON_M } else { 0.0 })
        .min(if wide { f32::INFINITY } else { HORIZON_M });
    let forward = agents.forward[own];
    let now = Footprint::of(body, position.truncate(), forward);
    let reach_m = horizon_m + 15.0;
    let places = if wide { &agents.places } else { &agents.wide_places };
    let near: Vec<(usize, Footprint)> = places
        .near(position.truncate(), reach_m)
        .into_iter()
        .map(|other| other as usize)
        .filter(|&other| {
            let to = agents.position[other] - position;
            other != own && to.z.abs() < 3.0 && to.truncate().length_squared() < reach_m * reach_m
        })
        .map(|other| {
            let place = agents.position[other].truncate();
            (other, Footprint::of(&agents.body[other], place, agents.forward[other]))
        })
        .filter(|(other, place)| {
            let to = place.middle - now.middle;
            let beside = now.grown(margin_m).touches(place);
            let passes = wide && passes(vehicles, row, agents, *other, forward);
            if passes && now.grown(PASSING_M).touches(place) {
                let leader =
                    Leader { gap_m: 0.0, speed_mps: 0.0, agent: *other as u32, aligned: -1.0 };
                found.push(Obstacle { row, leader, away: across(forward, to) });
            }
            to.dot(forward) > -2.0 && !beside
        })
        .collect();
    if near.is_empty() {
        return;
    }

    let mut course = Course::new(vehicles, row, tracks, agents);
    let mut near: Vec<Near> = near.into_iter().map(Near::new).collect();
    for step in 1..=(horizon_m / STEP_M) as u32 {
        let bare = course.step(STEP_M);
        let place = bare.grown(margin_m);
        let (ahead_m, forward) = (course.ahead_m, course.forward);
        near.retain_mut(|near| {
            if !near.is_touched(&place, step) {
                return true;
            }
            let Near { agent: other, footprint, .. } = &*near;
            // A vehicle that has the right of way passes one that waits for it with little room.
            if goes_first(vehicles, row, agents, *other, forward)
                && !bare.grown(NARROW_M).touches(footprint)
            {
                return true;
            }
            if (wide || in_curve(agents.forward[own], forward))
                && (passes_prop || matters(vehicles, row, agents, *other, forward))
            {
                let leader = Leader {
                    gap_m: ahead_m - STEP_M,
                    speed_mps: agents.velocity[*other].dot(forward).max(0.0),
                    agent: *other as u32,
                    aligned: agents.forward[*other].dot(forward),
                };
                let away = across(forward, footprint.middle - place.middle);
                found.push(Obstacle { row, leader, away });
            }
            false
        });
    }
}

/// Returns the unit vector across a path on the side of `to`.
pub(crate) fn across(forward: Vec2, to: Vec2) -> Vec2 {
    forward.perp() * forward.perp_dot(to).signum()
}

/// The footprints of a vehicle that drives along its route, one step after another: the tracking
/// point follows the line of the vehicle, as far as its steering allows, and the rear axle follows the
/// tracking point.
pub(crate) struct Course<'a> {
    vehicle: &'a Vehicle,
    tracks: &'a Tracks,
    body: Body,
    cross_track: Vec2,
    /// The part of the cross-track error that does not end.
    kept: Vec2,
    rear: Vec2,
    forward: Vec2,
    ahead_m: f32,
}

impl<'a> Course<'a> {
    pub(crate) fn new(
        vehicles: &'a VehicleTable,
        row: usize,
        tracks: &'a Tracks,
        agents: &Agents,
    ) -> Course<'a> {
        let own = agents.driven[row] as usize;
        let (body, forward) = (agents.body[own], agents.forward[own]);
        let position = agents.position[own].truncate();
        let rear = position - forward * 0.5 * body.wheelbase_m;
        let mut course = Course {
            vehicle: &vehicles[row],
            tracks,
            body,
            cross_track: Vec2::ZERO,
            kept: Vec2::ZERO,
            rear,
            forward,
            ahead_m: 0.0,
        };
        course.cross_track = position + forward * body.tracking_point_m() - course.line(0.0);
        course
    }

    /// As [`Course::new`], but the vehicle stays off its line by up to `kept_m`, as it does in curves,
    /// where its tyres slip.
    pub(crate) fn off_line(
        vehicles: &'a VehicleTable,
        row: usize,
        tracks: &'a Tracks,
        agents: &Agents,
        kept_m: f32,
    ) -> Course<'a> {
        let course = Course::new(vehicles, row, tracks, agents);
        Course { kept: course.cross_track.clamp_length_max(kept_m), ..course }
    }

    /// Returns the point that the tracking point aims at after `ahead_m` more metres.
    fn line(&self, ahead_m: f32) -> Vec2 {
        let ahead_m = self.body.tracking_point_m() + ahead_m;
        let (lane, arc_m) = ahead(self.vehicle, self.tracks, ahead_m);
        let (point, tangent, _) = self.tracks.at(lane, arc_m);
        let evasion_m = if self.vehicle.passes_prop() { 0.0 } else { evasion_left(self.vehicle) };
        let left_m = shift_at(self.vehicle, ahead_m).left_m
            + wide_offset_left(self.tracks, lane, arc_m, &self.body)
            + evasion_m;
        point.truncate() + tangent.perp() * left_m
    }

    /// Drives this much farther and returns the footprint there.
    pub(crate) fn step(&mut self, by_m: f32) -> Footprint {
        self.ahead_m += by_m;
        let return_part = (1.0 - self.ahead_m / RETURN_M).max(0.0);
        let off_line = self.kept + (self.cross_track - self.kept) * return_part;
        let lead = self.line(self.ahead_m) + off_line;
        let (forward, rear) = (&mut self.forward, &mut self.rear);
        let lead = swept_path::follow(forward, rear, lead, &self.body, by_m);
        Footprint::of(&self.body, lead - self.forward * self.body.tracking_point_m(), self.forward)
    }
}

/// Returns whether a vehicle could drive `distance_m` along its route if all others stood still.
pub(crate) fn is_way_free(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    distance_m: f32,
) -> bool {
    touched(vehicles, row, tracks, agents, distance_m, NARROW_M, |_| true).1.is_empty()
}

/// Returns whether a vehicle would clear an agent by at least [`NARROW_M`] if it drove `distance_m` along its
/// route.
pub(crate) fn clears(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    other: u32,
    distance_m: f32,
) -> bool {
    let counts = |agent: usize| agent as u32 == other;
    let (cleared, _) = touched(vehicles, row, tracks, agents, distance_m, NARROW_M, counts);
    !cleared.is_empty()
}

/// Returns of the agents that `count`, those that a vehicle would clear by `margin_m` if it drove
/// `distance_m` along its route and all others stood still, and those that it would not.
pub(crate) fn touched(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    distance_m: f32,
    margin_m: f32,
    counts: impl Fn(usize) -> bool,
) -> (Vec<u32>, Vec<u32>) {
    let own = agents.driven[row] as usize;
    let (position, forward) = (agents.position[own], agents.forward[own]);
    let now = Footprint::of(&agents.body[own], position.truncate(), forward).grown(NARROW_M);
    let reach_m = distance_m + 20.0;
    let mut near: Vec<Near> = agents
        .places
        .near(position.truncate(), reach_m)
        .into_iter()
        .map(|other| other as usize)
        .filter(|&other| {
            let to = agents.position[other] - position;
            let is_near = to.truncate().length_squared() < reach_m * reach_m;
            other != own && is_near && to.z.abs() < 3.0 && counts(other)
        })
        .map(|other| {
            let place = agents.position[other].truncate();
            (other, Footprint::of(&agents.body[other], place, agents.forward[other]))
        })
        .filter(|(_, place)| !now.touches(place))
        .map(Near::new)
        .collect();
    let mut touched = Vec::new();
    let mut course = Course::new(vehicles, row, tracks, agents);
    for step in 1..=(distance_m / STEP_M).ceil() as u32 {
        if near.is_empty() {
            break;
        }
        let place = course.step(STEP_M).grown(margin_m);
        near.retain_mut(|near| {
            let touches = near.is_touched(&place, step);
            if touches {
                touched.push(near.agent as u32);
            }
            !touches
        });
    }
    (near.into_iter().map(|near| near.agent as u32).collect(), touched)
}

/// Returns whether an oncoming wide vehicle is passing that this vehicle has waited for: it moves
/// on after that vehicle has passed.
fn passes(
    vehicles: &VehicleTable,
    row: usize,
    agents: &Agents,
    other: usize,
    forward: Vec2,
) -> bool {
    let waits = agents.speed(agents.driven[row] as usize) < STANDING_MPS;
    let oncoming = agents.forward[other].dot(forward) < -0.7;
    let moves = agents.velocity[other].length() > STANDING_MPS;
    waits
        && oncoming
        && moves
        && agents.body[other].is_wide()
        && vehicles[row].id > agents.id[other]
}

/// Returns whether the route has turned away from the present heading.
fn in_curve(from: Vec2, to: Vec2) -> bool {
    from.dot(to) < 0.995
}

/// Returns whether to wait for an agent that the vehicle would touch while heading `forward`.
fn matters(
    vehicles: &VehicleTable,
    row: usize,
    agents: &Agents,
    other: usize,
    forward: Vec2,
) -> bool {
    let aligned = agents.forward[other].dot(forward);
    if aligned > 0.7 || agents.velocity[other].length() < STANDING_MPS {
        return true;
    }
    // Of two vehicles in each other's way, the one with the higher id waits.
    is_oncoming_wide(agents, other, forward) && vehicles[row].id > agents.id[other]
}

/// Returns whether a vehicle has the right of way over an agent that it would touch while heading
/// `forward`.
fn goes_first(
    vehicles: &VehicleTable,
    row: usize,
    agents: &Agents,
    other: usize,
    forward: Vec2,
) -> bool {
    let other_row = agents.row[other];
    if other_row == NONE || !is_oncoming_wide(agents, other, forward) {
        return false;
    }
    // A vehicle without a reservation waits at a line: it does not go first, whatever its id.
    let other = &vehicles[other_row as usize];
    (other.wait_s > PATIENCE_S && other.reservation == 0) || vehicles[row].id < other.id
}

/// Returns whether an agent is a wide vehicle that faces a vehicle which heads `forward`.
fn is_oncoming_wide(agents: &Agents, other: usize, forward: Vec2) -> bool {
    agents.row[other] != NONE
        && agents.body[other].is_wide()
        && agents.forward[other].dot(forward) < -0.7
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::tests::{
        course::{Car, Course as World},
        maps,
    };

    /// The lane turns with a radius of 3.25 m, and the vehicle with 5.7 m at best.
    #[test]
    fn a_course_turns_no_tighter_than_the_steering_allows() {
        let car = Car { position: Vec3::new(14.0, -1.75, 0.0), ..Car::default() };
        let car = car.built_as("vehicle.nissan.patrol_2021");
        let mut world = World::with_cars(maps::loop_road(1.5, 20.0), 1, vec![car.clone()]);
        let actors = world.actors.clone();
        world.tick();
        let (map, vehicles) = (world.planner.map.clone(), &world.planner.state.vehicles);
        let mut agents = Agents::default();
        agents.read(&actors, &map.bodies);
        let mut course = Course::new(vehicles, 0, &map.tracks, &agents);
        let turn_max = swept_path::turn_max_per_m(&car.body()) * 0.5;
        let (mut forward, mut turned, mut aside_m) = (course.forward, 0.0, 0.0f32);
        for _ in 0..40 {
            let place = course.step(0.5);
            let turn = forward.angle_to(place.forward);
            assert!(turn.abs() < turn_max + 1e-4, "{turn} rad in a step, at most {turn_max}");
            (forward, turned) = (place.forward, turned + turn);
            let lead = course.rear + forward * car.body().axle_to_tracking_point_m();
            aside_m = aside_m.max(lead.distance(course.line(course.ahead_m)));
        }
        assert!((1.2..2.0).contains(&turned), "{turned} rad, a quarter of a circle");
        assert!(aside_m > 1.0, "{aside_m} m off the line");
    }

    #[test]
    fn a_course_leads_to_the_side_to_which_the_vehicle_evades() {
        let car = Car { position: Vec3::new(14.0, -1.75, 0.0), ..Car::default() };
        let mut world = World::with_cars(maps::two_way_loop(20.0, 60.0), 1, vec![car]);
        let actors = world.actors.clone();
        world.tick();
        let (map, vehicles) = (world.planner.map.clone(), &mut world.planner.state.vehicles);
        let mut agents = Agents::default();
        agents.read(&actors, &map.bodies);
        let mut left_m = |reverse_count: u32| {
            (vehicles[0].reverse_count, vehicles[0].evasion_side) = (reverse_count, 1.0);
            let mut course = Course::new(vehicles, 0, &map.tracks, &agents);
            (0..20).map(|_| course.step(1.0).middle.y + 1.75).last().expect("a step")
        };
        assert!(left_m(0).abs() < 0.1);
        assert!((0.9..1.1).contains(&left_m(2)), "{} m", left_m(2));
    }

    #[test]
    fn footprints_touch_where_they_overlap() {
        let place = |x: f32, y: f32, yaw: f32| Footprint {
            middle: Vec2::new(x, y),
            forward: Vec2::from_angle(yaw),
            half: Vec2::new(2.0, 1.0),
        };
        let here = place(0.0, 0.0, 0.0);
        assert!(here.touches(&place(3.9, 0.0, 0.0)));
        assert!(!here.touches(&place(4.1, 0.0, 0.0)));
        assert!(!here.touches(&place(0.0, 2.1, 0.0)));
        assert!(here.touches(&place(0.0, 2.9, std::f32::consts::FRAC_PI_2)));
        assert!(!here.touches(&place(3.1, 1.9, 2.4)));
        assert!((here.gap_m(&place(4.3, 1.0, 0.0)) - 0.3).abs() < 1e-4);
        assert!((here.gap_m(&place(0.0, 1.9, 0.0)) + 0.1).abs() < 1e-4);
    }
}
