//! Emergency braking: of two road users that would touch even if both braked, the vehicles brake in time.
//!
//! Leaders, reservations and obstacles keep vehicles apart along their routes, and from walkers. What they
//! leave out, such as the tail of a truck that swings out when it turns, is found here from the bodies
//! alone: as long as no two would touch if both braked from now on, they can still stop.

use glam::Vec2;

use crate::{
    agents::Agents,
    obstacles::{Course, Footprint, RETURN_M},
    occupancy::{Occupancy, ordered},
    route::ahead,
    spread::Spread,
    swept_path::turn_max_per_m,
    tracks::Tracks,
    vehicle_table::VehicleTable,
};

/// Deceleration that both are expected to reach, which heavy vehicles do on a wet road.
const BRAKE_MPS2: f32 = 4.0;
/// Deceleration of a vehicle that brakes: as strong as its tyres allow.
pub(crate) const FULL_BRAKE_MPS2: f32 = 7.0;
/// Time until a decision acts: a frame, and the build-up of the brakes.
const DELAY_S: f32 = 0.15;
/// Speed that a standing vehicle has at once when it starts.
const START_MPS: f32 = 0.2;
/// Clearance that remains, and between vehicles that are nearer already.
const MARGIN_M: f32 = 0.04;
const NEAR_M: f32 = 0.02;
/// By how much vehicles that are nearer than that too may approach: the prediction is no more exact.
const NEARER_M: f32 = 0.002;
/// Distance from its line at which a vehicle may stay in a curve.
const SLIP_M: f32 = 0.2;
/// Step of the prediction.
const STEP_S: f32 = 0.25;
/// Speed above which vehicles are not examined: they are on roads without crossing traffic, where those
/// ahead are leaders.
const FAST_MPS: f32 = 15.0;
/// Bound on the speed of an agent that slides or falls.
const FASTEST_MPS: f32 = 100.0;
/// Way within which a vehicle counts as standing: it does not leave twice this.
const CREEP_M: f32 = 0.05;
/// What is added to the region of a vehicle on its route, which is estimated.
const LOOSE_M: f32 = 0.3;
/// What is added to that of an agent that goes straight on.
const ROUNDING_M: f32 = 0.01;
/// Width of the strips of ground by which agents are sorted: most reach into one or two.
const STRIP_M: f32 = 50.0;
/// Difference in height between vehicles above each other.
const STOREY_M: f32 = 3.0;

/// The vehicles that have to brake now; kept to reuse its allocations.
#[derive(Default)]
pub(crate) struct Emergencies {
    /// The regions of agents, in each strip that they reach into; ascending by strip and least x.
    regions: Vec<Region>,
    /// Pairs of agents with regions that touch, of which this planner drives one.
    pairs: Vec<[u32; 2]>,
    /// By agent: whether it is in a pair.
    is_paired: Vec<bool>,
    /// Where those in pairs would be if they braked, one place after each step; the first is that of now.
    places: Vec<Place>,
    /// By agent: its first place; one more entry than agents.
    first: Vec<u32>,
    /// The rows that have to brake now, ascending, each with the agent that it would touch.
    found: Vec<(usize, u32)>,
}

/// The middle of a body, and its x axis.
struct Place {
    middle: Vec2,
    forward: Vec2,
}

/// What an agent that brakes stays within, its clearance included.
#[derive(Clone, Copy)]
struct Region {
    agent: u32,
    /// The strip of ground along the x axis that it is listed in.
    strip: i32,
    bounds: Footprint,
    low: Vec2,
    high: Vec2,
}

impl Region {
    /// Returns whether two regions of a strip touch; true in one of the strips that both reach into.
    fn meets(&self, other: &Region) -> bool {
        other.low.y <= self.high.y
            && self.low.y <= other.high.y
            && strip(self.low.y.max(other.low.y)) == self.strip
            && self.bounds.touches(&other.bounds)
    }
}

impl Emergencies {
    /// Returns the agent for which a row has to brake now.
    pub(crate) fn of_row(&self, row: usize) -> Option<u32> {
        let nth = self.found.binary_search_by_key(&row, |&(row, _)| row).ok()?;
        Some(self.found[nth].1)
    }

    /// Finds the vehicles that have to brake now.
    pub(crate) fn find(
        &mut self,
        vehicles: &VehicleTable,
        tracks: &Tracks,
        agents: &Agents,
        occupancy: &Occupancy,
        spread: Spread,
    ) {
        let Emergencies { regions, pairs, is_paired, places, first, found } = self;
        spread.list(agents.count(), regions, |agent, regions| {
            if !agents.is_prop[agent] && agents.speed(agent).abs() <= FAST_MPS {
                push_region(vehicles, agent, tracks, agents, regions);
            }
        });
        spread.sort(regions, |region| (region.strip, ordered(region.low.x), region.agent));
        spread.list(regions.len(), pairs, |nth, pairs| {
            let one = &regions[nth];
            let near = regions[nth + 1..]
                .iter()
                .take_while(|other| other.strip == one.strip && other.low.x <= one.high.x);
            pairs.extend(
                near.filter(|other| one.meets(other)).map(|other| [one.agent, other.agent]),
            );
        });
        let is_driven = |agent: u32| is_driven(vehicles, agent, agents);
        let height_m = |agent: u32| agents.position[agent as usize].z;
        pairs.retain(|&[one, other]| {
            (height_m(one) - height_m(other)).abs() < STOREY_M
                && (is_driven(one) || is_driven(other))
        });
        is_paired.clear();
        is_paired.resize(agents.count(), false);
        for &agent in pairs.iter().flatten() {
            is_paired[agent as usize] = true;
        }
        spread.ragged(agents.count(), (places, first), |agent, places| {
            if is_paired[agent] {
                push_places(vehicles, agent, tracks, agents, places);
            }
        });
        let of = |agent: u32| {
            &places[first[agent as usize] as usize..first[agent as usize + 1] as usize]
        };
        spread.list(pairs.len(), found, |nth, found| {
            let pair = pairs[nth];
            let ways = pair.map(of);
            let together = first_touch(pair, ways, agents);
            for side in [0, 1] {
                let (own, other) = (pair[side], pair[1 - side]);
                if !is_driven(own) || !occupancy.reacts_to(own, other) {
                    continue;
                }
                // One that stands may start or not.
                let stays = || {
                    let mut ways = ways;
                    ways[1 - side] = &ways[1 - side][..1];
                    let stands = agents.velocity[other as usize].length() < START_MPS;
                    stands.then(|| first_touch(pair, ways, agents)).flatten()
                };
                // One that stands by then does not brake for the other.
                let moves = |step: usize| step < ways[side].len();
                if together.is_some_and(moves) || stays().is_some_and(moves) {
                    found.push((agents.row[own as usize] as usize, other));
                }
            }
        });
        found.sort_unstable();
        found.dedup_by_key(|&mut (row, _)| row);
    }
}

/// Returns whether this planner drives a vehicle along its route.
fn is_driven(vehicles: &VehicleTable, agent: u32, agents: &Agents) -> bool {
    vehicles.get(agents.row[agent as usize] as usize).is_some_and(|vehicle| {
        vehicle.located == 1 && vehicle.u_turn == 0 && vehicle.reverse_s <= 0.0
    })
}

/// Returns the strip of ground in which a y coordinate lies.
fn strip(y: f32) -> i32 {
    (y / STRIP_M).floor() as i32
}

/// Appends the region of an agent once for each strip that it reaches into.
fn push_region(
    vehicles: &VehicleTable,
    agent: usize,
    tracks: &Tracks,
    agents: &Agents,
    regions: &mut Vec<Region>,
) {
    let roof_m = agents.body[agent].height_m * agents.lean[agent].length();
    let bounds = within(vehicles, agent, tracks, agents).grown(roof_m + MARGIN_M);
    let Footprint { middle, forward, half } = bounds;
    let reach = forward.abs() * half.x + forward.perp().abs() * half.y;
    let (low, high) = (middle - reach, middle + reach);
    let agent = agent as u32;
    let strips = strip(low.y)..=strip(high.y);
    regions.extend(strips.map(|strip| Region { agent, strip, bounds, low, high }));
}

/// Returns what an agent stays within that brakes: all its places of [`push_places`].
fn within(vehicles: &VehicleTable, agent: usize, tracks: &Tracks, agents: &Agents) -> Footprint {
    let (body, at, forward) =
        (&agents.body[agent], agents.position[agent].truncate(), agents.forward[agent]);
    let now = Footprint::of(body, at, forward);
    let speed_mps = agents.speed(agent);
    if speed_mps <= -START_MPS || !is_driven(vehicles, agent as u32, agents) {
        let velocity = agents.velocity[agent];
        let by = velocity.normalize_or_zero() * braking_m(velocity.length().min(FASTEST_MPS));
        let half = now.half + 0.5 * Vec2::new(by.dot(forward).abs(), by.perp_dot(forward).abs());
        return Footprint { half: half + ROUNDING_M, ..now.shifted(0.5 * by) };
    }
    let way_m = braking_m(speed_mps.max(START_MPS));
    if way_m < CREEP_M {
        return now.grown(2.0 * CREEP_M);
    }
    let vehicle = &vehicles[agents.row[agent] as usize];
    let ahead_m = body.tracking_point_m();
    let (lane, arc_m) = ahead(vehicle, tracks, ahead_m);
    let (point, tangent, _) = tracks.at(lane, arc_m);
    let off_m = (at + forward * ahead_m - point.truncate()).length();
    // The sine of the angle to the lane, and how sharply the vehicle turns.
    let aslant = tangent.perp_dot(forward).abs();
    let keeps_lane = vehicle.shift_m == 0.0
        && !vehicle.passes_prop()
        && !body.is_wide()
        && arc_m + way_m <= tracks.length(lane)
        && tangent.dot(forward) > 0.9
        && off_m < 1.0;
    let (aslant, turn_per_m) = if keeps_lane {
        (aslant + off_m / RETURN_M, tracks.sharpest(lane))
    } else {
        (0.0, turn_max_per_m(body))
    };
    let aside_m = (way_m * (aslant + 0.5 * turn_per_m * way_m)).min(way_m) + off_m;
    let swing_m = (aslant + turn_per_m * way_m).min(1.0) * body.front_m.max(body.rear_m);
    let way_m = way_m + off_m;
    let half = now.half + Vec2::new(0.5 * way_m, aside_m + swing_m) + LOOSE_M;
    Footprint { half, ..now.shifted(0.5 * way_m * forward) }
}

/// Appends the places of an agent that brakes: along its route if this planner drives it, else straight on.
fn push_places(
    vehicles: &VehicleTable,
    agent: usize,
    tracks: &Tracks,
    agents: &Agents,
    places: &mut Vec<Place>,
) {
    let (at, forward) = (agents.position[agent].truncate(), agents.forward[agent]);
    let now = Footprint::of(&agents.body[agent], at, forward);
    places.push(Place { middle: now.middle, forward });
    let speed_mps = agents.speed(agent);
    if speed_mps > -START_MPS && is_driven(vehicles, agent as u32, agents) {
        let row = agents.row[agent] as usize;
        let mut course = Course::off_line(vehicles, row, tracks, agents, SLIP_M);
        places.extend(steps(speed_mps.max(START_MPS)).map(|by_m| {
            let there = course.step(by_m);
            Place { middle: there.middle, forward: there.forward }
        }));
        return;
    }
    let (direction, mut middle) = (agents.velocity[agent].normalize_or_zero(), now.middle);
    let speed_mps = agents.velocity[agent].length().min(FASTEST_MPS);
    places.extend(steps(speed_mps).map(|by_m| {
        middle += direction * by_m;
        Place { middle, forward }
    }));
}

/// Returns the first step after which two vehicles are nearer than the clearance that remains; `None` if
/// there is none.
///
/// They may touch at the ground or at the lower of the two roofs.
fn first_touch(pair: [u32; 2], ways: [&[Place]; 2], agents: &Agents) -> Option<usize> {
    let agent = pair.map(|agent| agent as usize);
    // Half the diagonal of the body, and the shift of its roof.
    let radius_m = agent.map(|agent| {
        let body = &agents.body[agent];
        let shift_m = body.height_m * agents.lean[agent].length();
        0.5 * body.length_m().hypot(2.0 * body.half_width_m) + shift_m + MARGIN_M
    });
    let reach_m = radius_m[0] + radius_m[1];
    // The longest way of both in a step.
    let strides_m = agent.map(|agent| STEP_S * agents.velocity[agent].length().max(START_MPS));
    let stride_m = strides_m[0] + strides_m[1];
    let last = ways[0].len().max(ways[1].len()) - 1;
    let shift = agents.roof_shift(agent[0], agent[1]);
    let (mut step, mut margin_m) = (0, MARGIN_M);
    while step <= last {
        let places = ways.map(|way| &way[step.min(way.len() - 1)]);
        let gap_m = places[0].middle.distance(places[1].middle) - reach_m;
        if gap_m > 0.0 {
            // Nothing happens in the steps that the gap takes at least.
            step += 1 + (gap_m / stride_m) as usize;
            continue;
        }
        let [ground, other] = [0, 1].map(|side| {
            let body = &agents.body[agent[side]];
            let half = Vec2::new(0.5 * body.length_m(), body.half_width_m);
            Footprint { middle: places[side].middle, forward: places[side].forward, half }
        });
        let roof = ground.shifted(shift);
        let is_near =
            |margin_m: f32| ground.is_nearer(&other, margin_m) || roof.is_nearer(&other, margin_m);
        if step == 0 && is_near(MARGIN_M) {
            let gap_m = ground.gap_m(&other).min(roof.gap_m(&other));
            margin_m = NEAR_M.min(gap_m - NEARER_M);
        }
        if is_near(margin_m) {
            return Some(step);
        }
        step += 1;
    }
    None
}

/// Returns how far a vehicle drives that brakes.
fn braking_m(speed_mps: f32) -> f32 {
    speed_mps * (DELAY_S + speed_mps / (2.0 * BRAKE_MPS2))
}

/// Returns how far a vehicle that brakes drives in each step until it stands.
fn steps(speed_mps: f32) -> impl Iterator<Item = f32> {
    let driven_m = move |after_s: f32| {
        let brakes_s = (after_s - DELAY_S).clamp(0.0, speed_mps / BRAKE_MPS2);
        speed_mps * (after_s.min(DELAY_S) + brakes_s) - 0.5 * BRAKE_MPS2 * brakes_s * brakes_s
    };
    let duration_s = if speed_mps > 0.0 { DELAY_S + speed_mps / BRAKE_MPS2 } else { 0.0 };
    let count = (duration_s / STEP_S).ceil() as u32;
    (0..count)
        .map(move |step| driven_m(STEP_S * (step + 1) as f32) - driven_m(STEP_S * step as f32))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::body::CAR;
    use crate::tests::{
        course::{Car, Course as World, FOOT_RADIUS_M},
        maps,
    };

    /// A car on the lane along x, this far along it and to its left, with this speed.
    fn car(x: f32, left_m: f32, speed: f32) -> Car {
        Car { position: Vec3::new(x, left_m - 1.75, 0.0), speed, ..Car::default() }
    }

    /// Returns the rows that brake in the first frame; parked cars have none.
    fn braking(cars: Vec<Car>) -> Vec<usize> {
        braking_beside(cars, &[])
    }

    /// As [`braking`], beside walkers with these places and velocities.
    fn braking_beside(cars: Vec<Car>, walkers: &[(Vec2, Vec2)]) -> Vec<usize> {
        let mut world = World::with_cars(maps::two_way_loop(40.0, 80.0), 1, cars);
        for (at, velocity) in walkers {
            world.add_foot(*at);
            let foot = world.feet.last_mut().expect("it was added");
            (foot.velocity, foot.stands) = (*velocity, true);
        }
        world.snapshot();
        let actors = world.actors.clone();
        world.tick();
        let (map, vehicles) = (world.planner.map.clone(), &world.planner.state.vehicles);
        let (mut agents, mut occupancy) = (Agents::default(), Occupancy::default());
        agents.read(&actors, &map.bodies);
        occupancy.rebuild(&map.tracks, &map.grid, &agents, &[], Spread::Alone);
        let mut emergencies = Emergencies::default();
        emergencies.find(vehicles, &map.tracks, &agents, &occupancy, Spread::Alone);
        (0..vehicles.len()).filter(|&row| emergencies.of_row(row).is_some()).collect()
    }

    /// Drives vehicles of one blueprint in a town, and returns the numbers of vehicles that stand, that keep their lane
    /// and that turn or change lanes, and of the places of them outside their regions.
    fn places_outside(blueprint: &str) -> ([usize; 3], usize) {
        let mut world = World::new(maps::town(), 1, 60);
        world.vehicle_blueprint = town::blueprint(blueprint).expect("a blueprint").0;
        let (mut seen, mut outside) = ([0; 3], 0);
        let mut agents = Agents::default();
        for frame in 0..1200 {
            world.snapshot();
            let actors = world.actors.clone();
            world.tick();
            if frame % 10 != 0 {
                continue;
            }
            let (map, vehicles) = (world.planner.map.clone(), &world.planner.state.vehicles);
            agents.read(&actors, &map.bodies);
            for agent in 0..agents.count() {
                let region = within(vehicles, agent, &map.tracks, &agents);
                let now = Footprint::of(
                    &agents.body[agent],
                    agents.position[agent].truncate(),
                    agents.forward[agent],
                );
                let mut places = Vec::new();
                push_places(vehicles, agent, &map.tracks, &agents, &mut places);
                let wider_m = region.half.y - now.half.y;
                seen[if wider_m < 0.15 {
                    0
                } else if wider_m < 2.0 {
                    1
                } else {
                    2
                }] += 1;
                let holds = |place: &Place| {
                    let at = place.middle - region.middle;
                    let axes = [region.forward, region.forward.perp()];
                    let reach = axes.map(|axis| {
                        at.dot(axis).abs()
                            + now.half.x * place.forward.dot(axis).abs()
                            + now.half.y * place.forward.perp_dot(axis).abs()
                    });
                    reach[0] <= region.half.x && reach[1] <= region.half.y
                };
                outside += places.iter().filter(|place| !holds(place)).count();
            }
        }
        (seen, outside)
    }

    #[test]
    fn vehicles_that_brake_stay_within_their_regions() {
        for blueprint in ["vehicle.tesla.model3", "vehicle.mitsubishi.fusorosa"] {
            let (seen, outside) = places_outside(blueprint);
            println!("{blueprint}: {seen:?}, {outside} outside");
            assert!(seen[0] > 100 && seen[1] + seen[2] > 100, "{seen:?}");
            assert_eq!(outside, 0, "{blueprint}");
        }
    }

    #[test]
    fn a_vehicle_brakes_when_it_can_just_stop() {
        // The tail of the parked car reaches 5 cm into the way of the other one.
        let parked = Car { parked: true, ..car(40.0, 1.85, 0.0) };
        let gap_m = |gap_m: f32, speed: f32| {
            braking(vec![car(40.0 - 4.7 - gap_m, 0.0, speed), parked.clone()])
        };
        // From 5 m/s a vehicle stops within 3.9 m.
        assert_eq!(gap_m(3.5, 5.0), [0]);
        assert_eq!(gap_m(4.5, 5.0), [0; 0], "there is time");
        assert_eq!(gap_m(3.5, 3.0), [0; 0]);
        assert_eq!(gap_m(0.1, 0.0), [0; 0], "it may start");
        assert_eq!(gap_m(0.06, 0.0), [0]);
        let beside = Car { parked: true, ..car(40.0, 2.05, 0.0) };
        assert_eq!(braking(vec![car(33.0, 0.0, 5.0), beside]), [0; 0], "15 cm remain");
    }

    #[test]
    fn a_vehicle_brakes_for_a_walker_that_neither_can_avoid() {
        // The walker is right before the front, or beside the way by this clearance.
        let ahead = |gap_m: f32, clear_m: f32, velocity: Vec2| {
            let beside_m = CAR.half_width_m + FOOT_RADIUS_M + clear_m;
            let at = Vec2::new(40.0 + CAR.front_m + FOOT_RADIUS_M + gap_m, beside_m - 1.75);
            braking_beside(vec![car(40.0, 0.0, 5.0)], &[(at, velocity)])
        };
        assert_eq!(ahead(3.5, -0.1, Vec2::ZERO), [0]);
        assert_eq!(ahead(4.5, -0.1, Vec2::ZERO), [0; 0], "there is time");
        assert_eq!(ahead(3.0, 0.2, Vec2::ZERO), [0; 0], "it passes");
        assert_eq!(ahead(3.0, 0.2, Vec2::new(0.0, -1.4)), [0], "it walks into the way");
        assert_eq!(ahead(3.0, 0.6, Vec2::new(0.0, -1.4)), [0; 0], "it can stop");
    }

    #[test]
    fn a_vehicle_brakes_where_bodies_pitch_towards_each_other() {
        let pitched = |own: f32, other: f32| {
            let parked = Car { parked: true, pitch: other, ..car(40.0, 1.85, 0.0) };
            braking(vec![Car { pitch: own, ..car(40.0 - 4.7 - 0.15, 0.0, 0.0) }, parked])
        };
        assert_eq!(pitched(0.0, 0.0), [0; 0], "it may start");
        // The roofs are 10 cm nearer than the bumpers.
        assert_eq!(pitched(-0.04, 0.025), [0]);
        assert_eq!(pitched(0.04, 0.04), [0; 0], "both are on the same slope");
        assert_eq!(pitched(0.04, -0.025), [0; 0], "on a crest");
    }

    #[test]
    fn a_vehicle_does_not_count_on_the_start_of_one_that_stands() {
        let apart =
            |gap_m: f32| braking(vec![car(40.0 - 4.7 - gap_m, 0.0, 0.0), car(40.0, 0.0, 0.0)]);
        assert_eq!(apart(0.06), [0]);
        assert_eq!(apart(0.1), [0; 0]);
    }

    #[test]
    fn vehicles_that_are_too_near_do_not_approach() {
        let beside = |x: f32, left_m: f32| {
            let parked = Car { parked: true, ..car(x, left_m, 0.0) };
            braking(vec![car(40.0, 0.0, 0.0), parked])
        };
        assert_eq!(beside(40.0 + 4.71, 0.0), [0]);
        assert_eq!(beside(40.0 - 4.71, 0.0), [0; 0], "it drives away");
        assert_eq!(beside(40.0, 1.91), [0; 0], "it passes");
    }

    #[test]
    fn two_that_come_towards_each_other_brake_for_the_ways_of_both() {
        let apart = |gap_m: f32| {
            let oncoming = Car { yaw: std::f32::consts::PI, ..car(40.0 + 4.7 + gap_m, 0.0, 5.0) };
            braking(vec![car(40.0, 0.0, 5.0), oncoming])
        };
        assert_eq!(apart(6.0), [0, 1]);
        assert_eq!(apart(10.0), [0; 0]);
    }

    #[test]
    fn a_vehicle_that_slides_off_its_line_does_not_count_on_its_return() {
        // 5 cm remain beside the line, and 15 cm are lost already, 9 m before the other one.
        let narrow = Car { parked: true, ..car(45.0, 1.95, 0.0) };
        assert_eq!(braking(vec![car(31.0, 0.0, 9.0), narrow.clone()]), [0; 0]);
        assert_eq!(braking(vec![car(31.0, 0.15, 9.0), narrow]), [0]);
    }
}
