//! Walkers on autopilot: where they walk, and what they do beside others and vehicles.

use std::sync::Arc;

use glam::{DVec3, Vec2, vec2};
use protocol::{
    ActorId, ActorState, Command, JournalEntry, Name, Outcome, Pose, RouteCommand, RouteStep,
    TrafficParam, flag, kind, light, param, status,
};
use walkable::{Area, Cell, Cells, Ground};

use super::{
    course::{Course, DELTA_NANOS, FOOT_RADIUS_M, Foot},
    maps,
};
use crate::{
    Planner,
    agents::Agents,
    client_route::ClientRoutes,
    leader::Leader,
    map::Map,
    obstacles::Obstacle,
    occupancy::Occupancy,
    params::Params,
    spread::Spread,
    vehicle_table::VehicleTable,
    walkers::{self, WALK_S, WalkerTable},
};

/// Returns the journal entry of a command that was done.
fn entry(command: Command) -> JournalEntry {
    JournalEntry {
        client: Name::new("test"),
        sequence: 1,
        command: command.into(),
        outcome: Outcome { status: status::DONE, ..bytemuck::Zeroable::zeroed() },
    }
}

fn set(actor_id: ActorId, param: u32, value: f32) -> JournalEntry {
    entry(Command::TrafficParam(TrafficParam { actor_id, param, value }))
}

fn route(actor_id: ActorId, to: Vec2) -> JournalEntry {
    let steps = [RouteStep::place(to.extend(0.0))];
    entry(Command::RouteCommand(RouteCommand::route(actor_id, &steps)[0]))
}

/// Returns a town with vehicles, and walkers spread over its sidewalks.
fn town(seed: u64, cars: usize, feet: usize) -> Course {
    let mut course = Course::new(maps::town(), seed, cars);
    let mut draws = mesh::RandomStream::from_state(seed);
    while course.feet.len() < feet {
        let ground = course.planner.map.walker_ground();
        let place = [draws.unit(), draws.unit(), draws.unit()];
        let (_, at) = ground.point(place).expect("the town has sidewalks");
        if course.feet.iter().all(|foot| foot.position.distance(at) > 1.0) {
            course.add_foot(at);
        }
    }
    course.snapshot();
    course
}

/// Returns a path of 60 m along x and 3 m wide beside a road.
fn path() -> Course {
    on_ground(rectangles(&[([0.0, 20.0], [60.0, 23.0])], Area::Sidewalk))
}

/// Returns rectangles of one kind beside each other along x, from their low to their high corners.
fn rectangles(of: &[([f64; 2], [f64; 2])], area: Area) -> Ground {
    let mut ground =
        Ground { cells: Cells { positions: vec![], triangles: vec![] }, crossings: vec![] };
    for (nth, &([low_x, low_y], [high_x, high_y])) in (0u32..).zip(of) {
        let corners = [(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)];
        let outline: Vec<_> = corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        ground.cells.positions.extend(&outline);
        let crossing = (area != Area::Sidewalk).then_some(nth);
        let [before, after] =
            [nth.checked_sub(1).map(|n| 2 * n), (nth + 1 < of.len() as u32).then_some(2 * nth + 3)];
        let cell = |corners: [u32; 3], neighbours: [Option<u32>; 3]| Cell {
            corners: corners.map(|corner| 4 * nth + corner),
            neighbours,
            area,
            crossing,
        };
        ground.cells.triangles.extend([
            cell([0, 1, 2], [None, after, Some(2 * nth + 1)]),
            cell([0, 2, 3], [Some(2 * nth), None, before]),
        ]);
        if crossing.is_some() {
            ground.crossings.push(walkable::Crossing { area, outline });
        }
    }
    ground
}

/// Returns a straight road along x with this ground.
fn on_ground(ground: Ground) -> Course {
    let network = maps::straight(200.0);
    let mut course = Course::with_cars(network.clone(), 1, Vec::new());
    let map = Map::new(&network, Box::new(move || ground.clone()));
    course.planner = Planner::of(Arc::new(map), 1);
    course
}

/// Returns the kind of ground under a walker and the crossing; `None` off the ground.
fn under(course: &Course, foot: usize) -> Option<(Area, Option<u32>)> {
    let surface = &course.planner.map.walker_ground().surface;
    let (cell, _) = surface.nearest(course.feet[foot].position, 0.02)?;
    Some((surface.cell(cell).area, surface.cell(cell).crossing))
}

/// What walkers did in a town.
#[derive(Debug, Default)]
struct Seen {
    /// How often a walker stepped onto a crosswalk without and with lights.
    begins: [u32; 2],
    /// How often one did although the lights let vehicles pass.
    at_red: u32,
    /// How often one did after the walk interval, when vehicles that turn pass.
    late: u32,
    /// Frames of walkers off the ground, and on streets away from crosswalks.
    off: u32,
    on_road: u32,
    walked_m: f32,
}

fn watch(course: &mut Course, seconds: f32) -> Seen {
    let mut seen = Seen::default();
    let mut before: Vec<_> = (0..course.feet.len()).map(|foot| under(course, foot)).collect();
    let until = course.time_s() + seconds;
    while course.time_s() < until {
        let shown: Vec<Vec<(u32, f32)>> = {
            let Planner { map, state, .. } = &course.planner;
            let age_s = |signal: u32| map.signals.phase_age_s(signal, &state.clocks);
            let of = |signal: &u32| (course.light(*signal), age_s(*signal));
            let ground = map.walker_ground();
            ground.crossings.iter().map(|on| on.signals.iter().map(of).collect()).collect()
        };
        course.tick();
        for (foot, before) in before.iter_mut().enumerate() {
            seen.walked_m += course.feet[foot].velocity.length() * 0.05;
            let now = under(course, foot);
            match now {
                None => seen.off += 1,
                Some((Area::Road, _)) => seen.on_road += 1,
                Some((Area::Crosswalk, Some(crossing))) if now != *before => {
                    let lights = &shown[crossing as usize];
                    seen.begins[usize::from(!lights.is_empty())] += 1;
                    let passes = |at: &(u32, f32)| matches!(at.0, light::GREEN | light::YELLOW);
                    seen.at_red += u32::from(lights.iter().any(passes));
                    seen.late += u32::from(lights.iter().any(|at| at.1 > WALK_S));
                }
                Some(_) => {}
            }
            *before = now;
        }
    }
    seen
}

#[test]
fn walkers_keep_to_sidewalks_and_crosswalks_and_obey_lights() {
    let mut course = town(3, 40, 150);
    let seen = watch(&mut course, 150.0);
    println!("{seen:?}");
    assert_eq!((seen.off, seen.on_road, seen.at_red, seen.late), (0, 0, 0, 0));
    assert!(seen.begins[0] > 30 && seen.begins[1] > 30, "{seen:?}");
    assert!(seen.walked_m > 150.0 * 100.0, "{seen:?}");
    assert_eq!((course.hits, course.collisions), (vec![], vec![]));
}

#[test]
fn by_the_cross_factor_walkers_cross_streets_away_from_crosswalks() {
    let mut course = town(5, 40, 100);
    course.tick_with(&[set(ActorId::NONE, param::CROSS_FACTOR, 1.0)]);
    let seen = watch(&mut course, 120.0);
    println!("{seen:?}");
    assert!(seen.on_road > 200 && seen.off == 0, "{seen:?}");
    assert_eq!(course.hits, []);
}

#[test]
fn vehicles_and_walkers_do_not_wait_for_each_other_forever() {
    let mut course = town(9, 60, 300);
    let seen = watch(&mut course, 240.0);
    println!("{seen:?}");
    assert_eq!(course.hits, []);
    let longest_s = course.cars.iter().map(|car| car.longest_stand_s).fold(0.0, f32::max);
    let driven_m = course.cars.iter().map(|car| car.driven_m).sum::<f32>() / 60.0;
    println!("{longest_s} {driven_m}");
    assert!(longest_s < 150.0 && driven_m > 500.0, "{longest_s} s, {driven_m} m");
}

/// Returns how many stretches of lanes a walker claims that is this far from the middle of a crossing,
/// along the crossing from the kerb at its beginning and along the road from its side, with this speed
/// along the crossing.
fn claims_at(along_m: Option<f32>, beside_m: f32, speed_mps: f32) -> usize {
    let course = town(1, 0, 1);
    let ground = course.planner.map.walker_ground();
    let crossing = ground.crossings.iter().find(|it| it.area == Area::Crosswalk).expect("one");
    let along_m = along_m.map_or(0.0, |along_m| along_m - crossing.half_length_m);
    let at = crossing.center
        + crossing.axis.perp() * (crossing.half_width_m + beside_m)
        + crossing.axis * along_m;
    let walker = ActorState {
        actor_id: ActorId(1),
        kind: kind::WALKER,
        flags: flag::AUTOPILOT,
        pose: Pose::level(at.extend(0.0), 0.0),
        velocity_mps: (crossing.axis * speed_mps).extend(0.0).to_array(),
        ..ActorState::default()
    };
    let mut agents = Agents::default();
    agents.read(&[walker], &course.planner.map.bodies);
    let (mut scratch, mut claims) = (walkers::Scratch::default(), Vec::new());
    scratch.stand(ground, &agents);
    let mut table = WalkerTable::default();
    table.retain(std::iter::once(1));
    scratch.claims(&table, ground, &agents, &mut claims);
    claims.len()
}

#[test]
fn a_walker_claims_the_lanes_of_a_crossing_only_while_it_is_on_it() {
    assert!(claims_at(None, -0.5, 0.0) > 0, "on the crossing");
    assert_eq!(claims_at(None, 1.5, 0.0), 0, "beside it, with the crossing as the nearest ground");
}

#[test]
fn a_walker_at_the_end_of_a_crossing_claims_its_lanes_only_when_it_begins_to_cross() {
    assert_eq!(claims_at(Some(-0.3), -0.5, 0.0), 0, "it stands");
    assert_eq!(claims_at(Some(-0.3), -0.5, -1.3), 0, "it leaves");
    assert!(claims_at(Some(-0.3), -0.5, 1.3) > 0, "it begins");
    let beside = claims_at(Some(0.3), -0.5, 0.0);
    assert!(claims_at(Some(0.3), -0.5, 1.3) > beside, "it begins beyond the kerb");
    assert!(claims_at(Some(1.0), -0.5, 0.0) > beside, "it stands on the road");
}

#[test]
fn a_walker_that_stands_at_the_end_of_a_crossing_begins_when_its_lights_are_red() {
    let mut course = town(1, 0, 0);
    let ground = course.planner.map.walker_ground();
    let Planner { map, state, .. } = &course.planner;
    let is_green = |signal: &u32| map.signals.shows(*signal, &state.clocks) == light::GREEN;
    let mut crossings = ground.crossings.iter().filter(|it| it.area == Area::Crosswalk);
    let it = crossings.find(|it| it.signals.iter().any(is_green)).expect("one that is closed");
    let (signals, axis) = (it.signals.clone(), it.axis);
    let place = |inside_m: f32| it.center - axis * (it.half_length_m - inside_m);
    let (from, to) = (place(0.3), place(2.0 * it.half_length_m + 1.0));
    let id = course.add_foot(from);
    course.snapshot();
    course.tick_with(&[route(id, to)]);
    while (course.feet[0].position - from).dot(axis) < 0.2 {
        assert!(course.time_s() < 60.0, "it has not begun");
        course.tick();
    }
    let shown: Vec<u32> = signals.iter().map(|signal| course.light(*signal)).collect();
    assert!(shown.iter().all(|shows| *shows == light::RED), "{shown:?}");
}

/// Returns a town, the index of a crosswalk that its lights close to walkers, and a place on it that is
/// this far inside the kerb and beside its middle.
fn closed_crossing() -> (Course, usize, impl Fn(f32, f32) -> Vec2) {
    let course = town(1, 0, 0);
    let Planner { map, state, .. } = &course.planner;
    let closes = |signal: &u32| {
        map.signals.shows(*signal, &state.clocks) == light::GREEN
            && map.signals.phase_age_s(*signal, &state.clocks) < 5.0
    };
    let crossings = &map.walker_ground().crossings;
    let is_closed =
        |it: &walkers::Crossing| it.area == Area::Crosswalk && it.signals.iter().any(closes);
    let index = crossings.iter().position(is_closed).expect("one that is closed");
    let (center, axis, half_m) = {
        let it = &crossings[index];
        (it.center, it.axis, it.half_length_m)
    };
    let place = move |inside_m: f32, beside_m: f32| {
        center - axis * (half_m - inside_m) + axis.perp() * beside_m
    };
    (course, index, place)
}

/// Returns how far a walker is from the kerb of a crosswalk, positive on the road.
fn inside_m(course: &Course, crossing: usize, foot: usize) -> f32 {
    let it = &course.planner.map.walker_ground().crossings[crossing];
    it.half_length_m - (course.feet[foot].position - it.center).dot(it.axis).abs()
}

#[test]
fn a_walker_that_has_to_wait_at_the_end_of_a_crossing_steps_off_the_road() {
    let (mut course, crossing, place) = closed_crossing();
    let id = course.add_foot(place(0.4, 0.0));
    course.snapshot();
    course.tick_with(&[route(id, place(20.0, 0.0))]);
    while course.time_s() < 3.0 {
        course.tick();
    }
    let inside_m = inside_m(&course, crossing, 0);
    assert!(inside_m < 0.0, "{inside_m} m on the road");
}

#[test]
fn a_walker_that_comes_no_farther_at_the_end_of_a_crossing_leaves_the_road() {
    let (mut course, crossing, place) = closed_crossing();
    course.add_foot(place(0.4, 0.0));
    // Its way leads along the kerb, through others that stand.
    for nth in 0..9 {
        course.add_foot(place(0.45 * nth as f32 - 1.4, 0.6));
        course.feet.last_mut().expect("one was added").stands = true;
    }
    course.snapshot();
    course.tick();
    course.planner.state.walkers.set_own_way(0, vec![place(0.4, 12.0)]);
    let mut least_m = f32::INFINITY;
    while course.time_s() < 40.0 {
        course.tick();
        least_m = least_m.min(inside_m(&course, crossing, 0));
    }
    assert!(least_m < 0.0, "it stands {least_m} m on the road");
}

/// Returns how far from its kerb a walker comes within 2 min that leaves a crosswalk there, while others stand in
/// its way at this distance from the kerb.
fn held_up_on_a_crossing_m(crowd_m: f32) -> f32 {
    let (mut course, crossing, place) = closed_crossing();
    course.add_foot(place(crowd_m + 1.8, 0.0));
    for nth in 0..14 {
        let beside_m = 0.45 * (nth % 7 - 3) as f32;
        course.add_foot(place(crowd_m - 0.5 * (nth / 7) as f32, beside_m));
        course.feet.last_mut().expect("one was added").stands = true;
    }
    course.snapshot();
    course.tick();
    course.planner.state.walkers.set_own_way(0, vec![place(-6.0, 0.0)]);
    let mut farthest_m = 0.0_f32;
    while course.time_s() < 120.0 {
        course.tick();
        farthest_m = farthest_m.max(inside_m(&course, crossing, 0));
    }
    farthest_m
}

#[test]
fn a_walker_turns_round_in_the_middle_of_a_crossing_but_not_at_its_end() {
    let (at_end_m, inside_m) = (held_up_on_a_crossing_m(-0.3), held_up_on_a_crossing_m(1.2));
    println!("{at_end_m} m, {inside_m} m");
    assert!(at_end_m < 2.0, "it went back until {at_end_m} m from the kerb");
    assert!(inside_m > 3.2, "it stayed within {inside_m} m of the kerb");
}

#[test]
fn walkers_that_wait_before_a_crossing_let_pass_one_that_leaves_the_road() {
    let (mut course, crossing, place) = closed_crossing();
    let mut journal = vec![(course.add_foot(place(0.3, 0.0)), place(-4.0, 0.0))];
    for nth in 0..6 {
        let beside_m = 0.62 * (nth % 3 - 1) as f32;
        let id = course.add_foot(place(if nth < 3 { -0.4 } else { -1.0 }, beside_m));
        journal.push((id, place(20.0, beside_m)));
    }
    course.snapshot();
    let journal: Vec<_> = journal.into_iter().map(|(id, to)| route(id, to)).collect();
    course.tick_with(&journal);
    while course.time_s() < 8.0 {
        course.tick();
    }
    let inside_m = inside_m(&course, crossing, 0);
    assert!(inside_m < 0.0, "{inside_m} m on the road");
}

#[test]
fn a_walker_right_behind_one_that_stands_walks_round_it() {
    let mut course = path();
    let id = course.add_foot(vec2(10.0, 21.5));
    course.add_foot(vec2(10.75, 21.5));
    course.feet[1].stands = true;
    course.snapshot();
    course.tick_with(&[route(id, vec2(40.0, 21.5))]);
    while course.feet[0].position.x < 15.0 {
        assert!(course.time_s() < 8.0, "it is at {}", course.feet[0].position);
        course.tick();
    }
}

#[test]
fn a_walker_that_has_come_onto_a_street_leaves_it() {
    let mut course = town(1, 0, 0);
    let ground = course.planner.map.walker_ground();
    let it = ground.crossings.iter().find(|it| it.area == Area::Road).expect("a quiet street");
    let at = it.center - it.axis * (it.half_length_m - 0.4);
    course.add_foot(at);
    course.snapshot();
    course.tick();
    assert_eq!(under(&course, 0).map(|on| on.0), Some(Area::Road));
    while under(&course, 0).is_none_or(|on| on.0 == Area::Road) {
        assert!(course.time_s() < 30.0, "it stands there");
        course.tick();
    }
}

#[test]
fn walkers_step_out_of_the_swept_paths_of_buses_that_wait_for_them() {
    let mut course = town(5, 40, 300);
    let (bus, _) = town::blueprint("vehicle.mitsubishi.fusorosa").expect("it is in the catalogue");
    course.vehicle_blueprint = bus;
    course.snapshot();
    let walkers_from = course.actors[course.actors.len() - course.feet.len()].actor_id;
    let (mut waited_s, mut longest_s) = (vec![0.0f32; course.cars.len()], 0.0f32);
    while course.time_s() < 240.0 {
        course.tick();
        let plans: Vec<_> = course.planner.vehicle_plans().collect();
        for plan in plans {
            let car = plan.actor_id.0 as usize - 1;
            let waits = plan.leader >= walkers_from && course.cars[car].speed < 0.2;
            waited_s[car] = if waits { waited_s[car] + 0.05 } else { 0.0 };
            longest_s = longest_s.max(waited_s[car]);
        }
    }
    println!("{longest_s} s");
    assert!(longest_s < 90.0, "a bus waited {longest_s} s for a walker");
}

/// Walkers that a planner leads past a vehicle which stands and does not move, whatever they do.
struct Stand {
    course: Course,
    table: WalkerTable,
    scratch: walkers::Scratch,
    /// The walkers that the vehicle waits for, and the directions out of its path.
    waits_for: Vec<(usize, Vec2)>,
    /// The walker that stands right before the vehicle, as its leader.
    leader: Option<usize>,
}

impl Stand {
    /// Returns how many stretches of lanes the walkers claim.
    fn claims(&mut self) -> usize {
        self.course.snapshot();
        let ground = self.course.planner.map.walker_ground();
        let (mut agents, mut claims) = (Agents::default(), Vec::new());
        agents.read(&self.course.actors, &self.course.planner.map.bodies);
        self.scratch.stand(ground, &agents);
        self.scratch.claims(&self.table, ground, &agents, &mut claims);
        claims.len()
    }

    /// Lets the walkers walk for a time.
    fn walk(&mut self, vehicle: Option<ActorState>, seconds: f32) {
        let map = self.course.planner.map.clone();
        let (mut vehicles, mut routes) = (VehicleTable::default(), ClientRoutes::default());
        let (params, mut controls) = (Params::default(), Vec::new());
        for _ in 0..(seconds * 20.0) as u32 {
            self.course.snapshot();
            let mut actors = self.course.actors.clone();
            // Its id follows those of the walkers.
            actors.extend(vehicle);
            let (mut agents, mut occupancy) = (Agents::default(), Occupancy::default());
            agents.read(&actors, &map.bodies);
            occupancy.rebuild(&map.tracks, &map.grid, &agents, &[], Spread::Alone);
            vehicles.retain(&vehicle.map(|actor| actor.actor_id.0).into_iter().collect::<Vec<_>>());
            self.table.retain(agents.led.iter().map(|&agent| agents.id[agent as usize]));
            let obstacle = |&(foot, away): &(usize, Vec2)| {
                let leader = Leader { agent: agents.led[foot], gap_m: 1.0, ..Leader::NONE };
                Obstacle { row: 0, leader, away }
            };
            let obstacles: Vec<Obstacle> = self.waits_for.iter().map(obstacle).collect();
            let leader = self.leader.map(|foot| agents.led[foot]);
            let leader =
                leader.map_or(Leader::NONE, |agent| Leader { agent, gap_m: 1.0, ..Leader::NONE });
            let leaders = vec![leader; vehicles.len()];
            let lights = vec![light::RED; map.signals.count()];
            let view = walkers::View {
                map: &map,
                ground: map.walker_ground(),
                agents: &agents,
                occupancy: &occupancy,
                obstacles: &obstacles,
                leaders: &leaders,
                vehicles: &vehicles,
                params: &params,
                light_states: &lights,
                clocks: &vec![0; map.signals.cycles()],
                seed: 1,
                delta_s: 0.05,
            };
            self.scratch.stand(map.walker_ground(), &agents);
            walkers::plan(&mut self.table, &mut routes, &mut self.scratch, &view, &mut controls);
            for (foot, control) in self.course.feet.iter_mut().zip(&controls) {
                foot.velocity = Vec2::from(control.direction) * control.speed_mps;
                foot.position += foot.velocity * 0.05;
            }
        }
    }

    fn of(course: Course, waits_for: Vec<(usize, Vec2)>) -> Stand {
        let (table, scratch) = (WalkerTable::default(), walkers::Scratch::default());
        Stand { course, table, scratch, waits_for, leader: None }
    }
}

/// Returns a vehicle on autopilot that stands.
fn standing_vehicle(blueprint: &str, id: u32, at: Vec2, yaw_rad: f32) -> ActorState {
    let (blueprint, _) = town::blueprint(blueprint).expect("it is in the catalogue");
    ActorState {
        actor_id: ActorId(id),
        kind: kind::VEHICLE,
        flags: flag::AUTOPILOT,
        blueprint,
        pose: Pose::level(at.extend(0.0), yaw_rad),
        ..ActorState::default()
    }
}

/// Returns how far a walker has come after 20 s that begins here on a path from y = 20 to 23, with a
/// vehicle that waits for it to step aside in this direction.
fn walked_beside_a_path(from: Vec2, away: Vec2) -> Vec2 {
    let mut course = path();
    course.add_foot(from);
    let far = vec2(200.0, 0.0);
    let mut stand = Stand::of(course, vec![(0, away)]);
    stand.walk(Some(standing_vehicle("vehicle.tesla.model3", 99, far, 0.0)), 20.0);
    stand.course.feet[0].position - from
}

#[test]
fn a_walker_beside_a_point_of_its_way_has_passed_it_only_if_the_way_to_the_next_is_free() {
    let farthest_m = |next: Vec2| {
        let mut course = path();
        course.add_foot(vec2(20.0, 20.05));
        course.snapshot();
        course.tick();
        course.planner.state.walkers.set_own_way(0, vec![vec2(21.0, 20.2), next]);
        let mut farthest_m = 0.0_f32;
        for _ in 0..40 {
            course.tick();
            farthest_m = farthest_m.max(course.feet[0].position.x - 20.0);
        }
        farthest_m
    };
    let (free_m, not_free_m) = (farthest_m(vec2(10.0, 22.5)), farthest_m(vec2(19.0, 10.0)));
    assert!(free_m < 0.1, "it goes {free_m} m to a point that it has passed");
    assert!(not_free_m > 0.5, "it goes {not_free_m} m before it turns");
}

#[test]
fn a_walker_with_no_ground_to_step_aside_goes_on() {
    let walked = walked_beside_a_path(vec2(5.0, 20.02), vec2(0.0, -1.0));
    assert!(walked.length() > 5.0, "{walked}");
}

#[test]
fn a_walker_off_the_ground_returns_to_it_before_it_steps_aside() {
    let walked = walked_beside_a_path(vec2(20.0, 25.0), vec2(0.0, 1.0));
    assert!(walked.y < -1.5, "{walked}");
}

#[test]
fn a_walker_that_waits_at_a_corner_steps_aside_over_the_end_of_another_crossing() {
    let crossings = [([20.0, -6.0], [22.0, 6.0]), ([22.0, -6.0], [24.0, 6.0])];
    let mut course = on_ground(rectangles(&crossings, Area::Crosswalk));
    let id = course.add_foot(vec2(21.85, -5.8));
    let mut stand = Stand::of(course, vec![(0, vec2(1.0, 0.0))]);
    stand.table.retain([id.0].into_iter());
    stand.table.set_own_way(0, vec![vec2(21.85, 5.5)]);
    // It stands on the crossing, so that the walker waits.
    let car = standing_vehicle("vehicle.tesla.model3", id.0 + 1, vec2(21.0, -1.75), 0.0);
    stand.walk(Some(car), 2.0);
    let at = stand.course.feet[0].position;
    assert!(at.x > 22.4 && at.y < -5.0, "it is at {at}");
}

#[test]
fn a_walker_that_waits_before_a_crossing_steps_aside_at_a_slant_if_there_is_no_other_room() {
    // Along y: 0.5 m of sidewalk, then the crossing.
    let cells = [([-6.5, -24.0], [-6.0, -20.0]), ([-6.0, -24.0], [6.0, -20.0])];
    let mut ground = rectangles(&cells, Area::Crosswalk);
    let outlines = ground.crossings.iter_mut().flat_map(|crossing| &mut crossing.outline);
    for position in ground.cells.positions.iter_mut().chain(outlines) {
        *position = DVec3::new(-position.y, position.x, 0.0);
    }
    for sidewalk in &mut ground.cells.triangles[..2] {
        (sidewalk.area, sidewalk.crossing) = (Area::Sidewalk, None);
    }
    let mut course = on_ground(ground);
    let from = vec2(22.0, -6.3);
    let id = course.add_foot(from);
    let mut stand = Stand::of(course, vec![(0, vec2(0.0, -1.0))]);
    stand.table.retain([id.0].into_iter());
    stand.table.set_own_way(0, vec![vec2(22.0, 5.5)]);
    // It stands on the crossing, so that the walker waits.
    let car = standing_vehicle("vehicle.tesla.model3", id.0 + 1, vec2(22.0, -1.75), 0.0);
    stand.walk(Some(car), 2.0);
    let walked = stand.course.feet[0].position - from;
    assert!(walked.x.abs() > 0.2 && walked.y < -0.1, "{walked}");
}

#[test]
fn walkers_on_a_crossing_go_back_from_a_vehicle_in_their_way_that_waits_for_them() {
    go_back_from_a_vehicle(false);
}

#[test]
fn a_walker_right_before_a_vehicle_goes_back_though_it_is_beside_the_swept_path() {
    go_back_from_a_vehicle(true);
}

/// Lets two walkers on a crossing go back from a bus on it. The first one is in the swept path of the bus, or is
/// its leader.
fn go_back_from_a_vehicle(as_leader: bool) {
    let course = || town(1, 0, 0);
    let (center, axis, half_m, lane, arc_m, along_m) = {
        let course = course();
        let ground = course.planner.map.walker_ground();
        let is_long =
            |it: &&walkers::Crossing| it.area == Area::Crosswalk && it.half_length_m > 4.0;
        let it = ground.crossings.iter().find(is_long).expect("a crosswalk");
        let far =
            |a: &&walkers::CrossedLane, b: &&walkers::CrossedLane| a.along_m.total_cmp(&b.along_m);
        let crossed = it.lanes.iter().max_by(far).expect("it crosses a lane");
        (it.center, it.axis, it.half_length_m, crossed.lane, crossed.arc_m, crossed.along_m)
    };
    let mut course = course();
    let (on, tangent, _) = course.planner.map.tracks.at(lane, arc_m);
    // Between the near kerb and the vehicle.
    let place = |short_m: f32| center + axis * (along_m - short_m);
    let goal = center + axis * (half_m + 1.0);
    let ids = [2.2, 3.0].map(|short_m| course.add_foot(place(short_m)));
    let vehicle = standing_vehicle(
        "vehicle.mitsubishi.fusorosa",
        ids[1].0 + 1,
        on.truncate(),
        tangent.to_angle(),
    );
    let waits_for = if as_leader { Vec::new() } else { vec![(0, -axis)] };
    let mut stand = Stand::of(course, waits_for);
    stand.leader = as_leader.then_some(0);
    let routed = |stand: &mut Stand| {
        for foot in 0..2 {
            stand.table.retain(ids.iter().map(|id| id.0));
            stand.table.set_own_way(foot, vec![goal]);
        }
    };
    routed(&mut stand);
    stand.walk(Some(vehicle), 3.0);
    for foot in 0..2 {
        let back_m = -(stand.course.feet[foot].position - place([2.2, 3.0][foot])).dot(axis);
        assert!(back_m > 0.8, "{foot}: {back_m} m back");
    }
    let back = stand.course.feet[0].position;
    // They stay there though another one behind them waits for the first one too.
    let behind = standing_vehicle(
        "vehicle.tesla.model3",
        vehicle.actor_id.0,
        place(9.0),
        tangent.to_angle(),
    );
    (stand.waits_for, stand.leader) = (vec![(0, axis)], None);
    stand.walk(Some(behind), 1.0);
    assert_eq!(stand.claims(), 0, "they stand and claim no lane meanwhile");
    stand.waits_for.clear();
    stand.walk(Some(vehicle), 1.0);
    assert_eq!(stand.claims(), 0, "they stand and claim no lane meanwhile");
    stand.walk(None, 15.0);
    let went_m = (stand.course.feet[0].position - back).dot(axis);
    assert!(went_m > 3.0, "it goes on when the vehicle has gone: {went_m} m");
}

#[test]
fn a_walker_steps_back_from_the_tail_of_a_bus_that_swings_out() {
    // The left rear corner of the bus is at (20, 20), the walker 0.65 m beside it.
    let (_, bus) = town::blueprint("vehicle.mitsubishi.fusorosa").expect("a blueprint");
    let rear_left = bus.center_m + bus.half_extents_m * glam::Vec3::new(-1.0, 1.0, 0.0);
    let origin = vec2(20.0, 20.0) - rear_left.truncate();
    let aside_m = |yaw_rate: f32| {
        let mut course = path();
        let from = vec2(20.3, 20.65 + FOOT_RADIUS_M);
        course.add_foot(from);
        let bus = ActorState {
            angular_velocity_radps: [0.0, 0.0, yaw_rate],
            ..standing_vehicle("vehicle.mitsubishi.fusorosa", 99, origin, 0.0)
        };
        let mut stand = Stand::of(course, Vec::new());
        stand.walk(Some(bus), 0.6);
        stand.course.feet[0].position.y - from.y
    };
    let [right, straight, left] = [-0.3, 0.0, 0.3].map(aside_m);
    assert!(right > straight + 0.1 && right > left + 0.1, "{right} {straight} {left} m");
}

#[test]
fn opposed_streams_pass_each_other_without_contact() {
    let mut course = path();
    let mut journal = Vec::new();
    for nth in 0..30 {
        let (column, line) = (nth / 2 % 5, nth / 10);
        let y = 20.4 + 0.55 * column as f32;
        let (from, to) = match nth % 2 {
            0 => (vec2(2.0 + 1.2 * line as f32, y), vec2(58.0, y)),
            _ => (vec2(58.0 - 1.2 * line as f32, y), vec2(2.0, y)),
        };
        let id = course.add_foot(from);
        journal.push(route(id, to));
    }
    course.snapshot();
    course.tick_with(&journal);
    let mut arrived = vec![false; 30];
    let mut nearest_m = f32::MAX;
    while course.time_s() < 110.0 && arrived.contains(&false) {
        course.tick();
        for (a, arrived) in arrived.iter_mut().enumerate() {
            let at = course.feet[a].position;
            *arrived |= if a % 2 == 0 { at.x > 54.0 } else { at.x < 6.0 };
            for b in a + 1..30 {
                nearest_m = nearest_m.min(at.distance(course.feet[b].position));
            }
        }
    }
    println!("{nearest_m} m, {} s", course.time_s());
    assert!(!arrived.contains(&false), "{arrived:?} after {} s", course.time_s());
    assert!(nearest_m > 2.0 * FOOT_RADIUS_M, "{nearest_m} m");
}

#[test]
fn walkers_turn_round_before_a_crowd_that_does_not_move() {
    let mut course = on_ground(rectangles(&[([0.0, 20.0], [120.0, 23.0])], Area::Sidewalk));
    for nth in 0..12 {
        course.add_foot(vec2(30.0 + 2.0 * nth as f32, 20.5 + (nth % 3) as f32));
    }
    for nth in 0..7 {
        course.add_foot(vec2(60.0, 20.06 + 0.48 * nth as f32));
        course.feet[12 + nth].stands = true;
    }
    course.snapshot();
    let (mut stayed_s, mut longest_s, mut came) = ([0.0; 12], 0.0_f32, 0);
    while course.time_s() < 240.0 {
        course.tick();
        for (foot, stayed_s) in course.feet.iter().zip(&mut stayed_s) {
            let is_there = (foot.position.x - 60.0).abs() < 3.0;
            came += u32::from(is_there && *stayed_s == 0.0);
            *stayed_s = if is_there { *stayed_s + 0.05 } else { 0.0 };
            longest_s = longest_s.max(*stayed_s);
        }
    }
    println!("{longest_s} s, {came} times");
    assert!(came > 20 && longest_s < 60.0, "{longest_s} s, {came} times");
}

#[test]
fn walkers_that_go_together_stay_together() {
    let mut course = town(7, 10, 40);
    // Walkers 0 to 29 in threes.
    let mut journal = Vec::new();
    for foot in (0..30).filter(|foot| foot % 3 != 0) {
        let leader = foot - foot % 3;
        let aside = vec2(0.3 * (foot % 3) as f32, 0.6);
        course.feet[foot].position = course.feet[leader].position + aside;
        let id = course.foot_id(foot);
        journal.push(set(id, param::WALKS_WITH, course.foot_id(leader).0 as f32));
    }
    course.snapshot();
    course.tick_with(&journal);
    let (mut frames, mut near, mut farthest_m) = (0, 0, 0.0f32);
    while course.time_s() < 120.0 {
        course.tick();
        if course.time_s() < 10.0 {
            continue;
        }
        for foot in (0..30).filter(|foot| foot % 3 != 0) {
            let leader = foot - foot % 3;
            let apart_m = course.feet[foot].position.distance(course.feet[leader].position);
            frames += 1;
            near += u32::from(apart_m < 2.5);
            farthest_m = farthest_m.max(apart_m);
        }
    }
    let share = near as f32 / frames as f32;
    println!("{share} within 2.5 m, at most {farthest_m} m");
    assert!(share > 0.75 && farthest_m < 20.0, "{share} within 2.5 m, at most {farthest_m} m");
    assert_eq!(course.hits, []);
}

#[test]
fn a_walker_goes_to_the_place_of_its_client_with_its_speed() {
    let mut course = town(4, 0, 1);
    let id = course.foot_id(0);
    let ground = course.planner.map.walker_ground();
    let from = course.feet[0].position;
    let far = (0..100).filter_map(|n| ground.point([n as f32 / 100.0, 0.3, 0.3]));
    let is_far = |at: &Vec2| (60.0..120.0).contains(&at.distance(from));
    let to = far.map(|(_, at)| at).find(is_far).expect("there is a place");
    course.tick_with(&[route(id, to), set(id, param::SPEED_MPS, 2.5)]);
    let mut fastest = 0.0f32;
    while course.feet[0].position.distance(to) > 1.0 && course.time_s() < 240.0 {
        course.tick();
        fastest = fastest.max(course.feet[0].velocity.length());
    }
    assert!(course.feet[0].position.distance(to) < 1.0);
    assert!((2.4..2.55).contains(&fastest), "{fastest}");
}

/// Returns all decisions and the state of a planner.
fn bytes(planner: &Planner) -> Vec<u8> {
    let mut bytes: Vec<u8> = bytemuck::cast_slice(planner.controls()).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(planner.walker_controls()));
    bytes.extend_from_slice(bytemuck::cast_slice(planner.lights()));
    bytes.extend(planner.save());
    bytes
}

#[test]
fn a_restored_planner_leads_walkers_with_the_same_bits() {
    for restart_at in [1, 37, 700] {
        let mut course = town(4, 20, 60);
        course.tick_with(&[set(ActorId::NONE, param::CROSS_FACTOR, 0.5)]);
        for _ in 0..restart_at {
            course.tick();
        }
        let mut second = Planner::new(course.network.clone(), 4);
        second.restore(&course.planner.save()).unwrap();
        for tick in 0..300 {
            let mut turned = course.actors.clone();
            let middle = tick % turned.len();
            turned.rotate_left(middle);
            course.planner.plan(DELTA_NANOS, &course.actors, &[]);
            second.plan(DELTA_NANOS, &turned, &[]);
            assert!(
                bytes(&course.planner) == bytes(&second),
                "{tick} ticks after a restart at {restart_at}"
            );
            course.advance();
        }
    }
}

#[test]
fn a_seed_of_walkers_decides_where_they_go() {
    let run = |seed: Option<f32>| {
        let mut course = town(4, 5, 20);
        let journal: Vec<_> =
            seed.map(|seed| set(ActorId::NONE, param::WALKER_SEED, seed)).into_iter().collect();
        course.tick_with(&journal);
        for _ in 0..200 {
            course.tick();
        }
        let at: Vec<_> =
            course.feet.iter().map(|foot| foot.position.to_array().map(f32::to_bits)).collect();
        at
    };
    assert_eq!(run(Some(3.0)), run(Some(3.0)));
    assert_ne!(run(Some(3.0)), run(None));
}

#[test]
fn walkers_set_off_in_short_frames_too() {
    for delta_nanos in [2_000_000, 100_000_000] {
        let delta_s = delta_nanos as f32 * 1e-9;
        let mut course = town(4, 0, 20);
        let start: Vec<Vec2> = course.feet.iter().map(|foot| foot.position).collect();
        for _ in 0..(6.0 / delta_s) as usize {
            course.planner.plan(delta_nanos, &course.actors, &[]);
            let controls = course.planner.walker_controls();
            for (foot, control) in course.feet.iter_mut().zip(controls) {
                foot.velocity = Vec2::from(control.direction) * control.speed_mps;
                foot.position += foot.velocity * delta_s;
            }
            course.snapshot();
        }
        // A few wait at crossings.
        let walked = |(foot, start): (&Foot, &Vec2)| foot.position.distance(*start) > 2.0;
        let count = course.feet.iter().zip(&start).filter(|pair| walked(*pair)).count();
        assert!(count >= 15, "{count} of 20 walked 2 m in 6 s, in frames of {delta_s} s");
    }
}
