use glam::{DVec3, Vec2, dvec3, vec2};

use crate::{
    Area, Cell, Cells, Crossing, Ground, Search, Surface, Walk,
    cells::Outlines,
    funnel::{self, Portal},
    outline,
};

fn square(low: [f64; 2], high: [f64; 2]) -> outline::Loop {
    let ([x, y], [u, v]) = (low, high);
    vec![dvec3(x, y, 0.0), dvec3(u, y, 0.0), dvec3(u, v, 0.0), dvec3(x, v, 0.0)]
}

fn area_m2(cells: &Cells, of: Area) -> f64 {
    let twice = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|at| cells.positions[at as usize].truncate());
        (b - a).perp_dot(c - a)
    };
    let all = cells.triangles.iter().filter(|cell| cell.area == of);
    all.map(|cell| twice(cell.corners) / 2.0).sum()
}

/// Two sidewalks along x, 20 m long, a crosswalk between them, and a shortcut across the road.
fn street() -> Ground {
    let outlines = Outlines {
        sidewalks: vec![square([0.0, 0.0], [20.0, 2.0]), square([0.0, 8.0], [20.0, 10.0])],
        crossings: vec![square([8.0, 1.0], [12.0, 9.0]), square([1.0, 1.0], [3.0, 9.0])],
        crosswalks: 1,
        holes: vec![square([4.0, 0.5], [5.0, 1.0])],
    };
    let areas = [Area::Crosswalk, Area::Road];
    let crossings = outlines.crossings.iter().zip(areas);
    Ground {
        cells: Cells::of(&outlines, |_| None),
        crossings: crossings
            .map(|(outline, area)| Crossing { area, outline: outline.clone() })
            .collect(),
    }
}

#[test]
fn two_sidewalks_and_two_crossings_are_one_ground_with_a_hole() {
    let Ground { cells, .. } = street();
    assert!((area_m2(&cells, Area::Sidewalk) - 79.5).abs() < 0.2);
    assert!((area_m2(&cells, Area::Crosswalk) - 24.0).abs() < 0.2);
    assert!((area_m2(&cells, Area::Road) - 12.0).abs() < 0.2);
    let mut reached = vec![false; cells.triangles.len()];
    let mut next = vec![0];
    while let Some(at) = next.pop() {
        if !std::mem::replace(&mut reached[at], true) {
            let neighbours = cells.triangles[at].neighbours.iter().flatten();
            next.extend(neighbours.map(|other| *other as usize));
        }
    }
    assert!(reached.iter().all(|is| *is), "not all of the ground is connected");
    for (index, cell) in cells.triangles.iter().enumerate() {
        for other in cell.neighbours.iter().flatten() {
            let back = cells.triangles[*other as usize].neighbours;
            assert!(back.contains(&Some(index as u32)), "{index} is not a neighbour of {other}");
        }
    }
}

fn route(from: Vec2, to: Vec2, walk: Walk) -> Vec<Vec2> {
    let surface = Surface::new(&street());
    let on = |at: Vec2| surface.nearest(at, 0.5).unwrap();
    Search::default().route(&surface, on(from), on(to), walk).unwrap()
}

fn length_m(from: Vec2, way: &[Vec2]) -> f32 {
    let starts = std::iter::once(&from).chain(way);
    starts.zip(way).map(|(a, b)| a.distance(*b)).sum()
}

#[test]
fn only_those_that_cross_streets_leave_the_crosswalk() {
    let (from, to) = (vec2(0.5, 1.0), vec2(0.5, 9.0));
    let law = route(from, to, Walk { crosses: false, side: 0.5 });
    let free = route(from, to, Walk { crosses: true, side: 0.5 });
    assert_eq!((law.last(), free.last()), (Some(&to), Some(&to)));
    let surface = Surface::new(&street());
    let areas = |way: &[Vec2]| {
        let starts = std::iter::once(&from).chain(way);
        let points =
            starts.zip(way).flat_map(|(a, b)| (0..50).map(|n| a.lerp(*b, n as f32 / 50.0)));
        let mut areas: Vec<_> =
            points.map(|at| surface.cell(surface.nearest(at, 0.05).unwrap().0).area).collect();
        areas.dedup();
        areas
    };
    assert_eq!(areas(&law), [Area::Sidewalk, Area::Crosswalk, Area::Sidewalk]);
    assert_eq!(areas(&free), [Area::Sidewalk, Area::Road, Area::Sidewalk]);
    assert!(length_m(from, &law) > length_m(from, &free) + 10.0);
}

#[test]
fn walkers_that_prefer_sides_keep_them() {
    let (from, to) = (vec2(0.2, 9.0), vec2(19.8, 9.0));
    let height = |side: f32| {
        let way = route(from, to, Walk { crosses: false, side });
        way.iter()
            .rev()
            .skip(1)
            .map(|at| at.y)
            .fold((10.0f32, 8.0f32), |(low, high), y| (low.min(y), high.max(y)))
    };
    // On the way to the east, the right side is the south.
    assert!(height(0.1).1 < 9.0 && height(0.9).0 > 9.0, "{:?} {:?}", height(0.1), height(0.9));
}

#[test]
fn a_step_stays_on_the_ground_and_slides_along_its_edges() {
    let surface = Surface::new(&street());
    let from = vec2(15.0, 1.0);
    let cell = surface.cell_at(from).unwrap();
    let (_, at) = surface.step(cell, from, vec2(16.0, 5.0), |_| true);
    assert!(at.distance(vec2(16.0, 2.0)) < 0.01, "{at}");
    let (last, at) = surface.step(cell, from, vec2(15.0, 1.5), |_| true);
    assert_eq!((at, surface.cell(last).area), (vec2(15.0, 1.5), Area::Sidewalk));
    let keeps_off = |cell: &crate::Cell| cell.area == Area::Sidewalk;
    let from = vec2(10.0, 1.5);
    let (_, at) = surface.step(surface.cell_at(from).unwrap(), from, vec2(10.0, 4.0), keeps_off);
    assert!(at.distance(vec2(10.0, 2.0)) < 0.01, "{at}");
    let (_, at) = surface.step(surface.cell_at(from).unwrap(), from, vec2(10.0, 4.0), |_| true);
    assert!(at.distance(vec2(10.0, 4.0)) < 0.01, "{at}");
}

/// Returns ground of these triangles, all of them sidewalks.
fn sidewalk(points: &[Vec2], triangles: &[[u32; 3]]) -> Ground {
    let side = |corners: &[u32; 3], begin: usize| (corners[begin], corners[(begin + 1) % 3]);
    let beyond = |(from, to)| {
        let shares = |other: &[u32; 3]| (0..3).any(|begin| side(other, begin) == (to, from));
        triangles.iter().position(shares).map(|cell| cell as u32)
    };
    let cell = |corners: &[u32; 3]| Cell {
        corners: *corners,
        neighbours: [0, 1, 2].map(|begin| beyond(side(corners, begin))),
        area: Area::Sidewalk,
        crossing: None,
    };
    let positions = points.iter().map(|at| at.as_dvec2().extend(0.0)).collect();
    let cells = Cells { positions, triangles: triangles.iter().map(cell).collect() };
    Ground { cells, crossings: Vec::new() }
}

/// A point that lies a metre beyond the tip of a triangle of 50 m by 4 cm, within a millimetre of the lines of
/// all three sides.
#[test]
fn a_point_beyond_the_tip_of_a_sliver_is_not_in_it() {
    let points = [[0.0, 0.0], [50.0, 0.0], [30.0, 0.04], [0.0, 2.0], [50.0, 2.0], [60.0, 0.0]];
    let triangles = [[0, 1, 2], [0, 2, 3], [2, 4, 3], [2, 1, 4], [1, 5, 4]];
    let surface = Surface::new(&sidewalk(&points.map(Vec2::from_array), &triangles));
    let beyond = vec2(50.9, 0.0005);
    assert_eq!(surface.cell_at(beyond), Some(4));
    let (cell, there) = surface.step(0, vec2(49.5, 0.0003), beyond, |_| true);
    assert_eq!((cell, there), (4, beyond), "a step over the tip");
    let ahead = vec2(50.1, 0.0005);
    let (cell, there) = surface.step(4, beyond, ahead, |_| true);
    assert_eq!((cell, there), (4, ahead), "a step towards the tip");
    let over = vec2(49.0, 0.5);
    let (_, there) = surface.step(4, beyond, over, |_| true);
    assert_eq!(there, over, "a step past the sliver");
}

/// Returns how far one comes in a direction in 40 steps of 9 mm that enter no crossing.
fn progress_m(surface: &Surface, from: Vec2, direction: Vec2, has_detours: bool) -> f32 {
    let mut at = from;
    for _ in 0..40 {
        let (cell, near) = surface.nearest(at, 0.1).unwrap();
        let here = surface.cell(cell).crossing;
        let allows = |next: &crate::Cell| next.crossing.is_none() || next.crossing == here;
        let (_, mut there) = surface.step(cell, near, near + direction * 0.009, allows);
        if has_detours
            && there.distance(near) < 0.003
            && let Some(detour) = surface.detour(cell, near, direction, allows)
        {
            there = near + (detour - near).clamp_length_max(0.009);
        }
        at = there;
    }
    (at - from).dot(direction)
}

#[test]
fn no_one_is_held_where_corners_meet() {
    let text = mapgen::named("Flatford").unwrap();
    let network = road::Network::parse(&text).unwrap();
    let surface = Surface::new(&Ground::new(&network, &town::furnish(&network, 3)));
    let (mut held, mut still_held, mut count) = (0, 0, 0);
    for corner in (0..surface.cells().len() as u32).map(|cell| surface.corners(cell)[0]) {
        let Some((cell, at)) = surface.nearest(corner, 0.01) else { continue };
        if surface.cell(cell).area != Area::Sidewalk {
            continue;
        }
        for turn in 0..8 {
            let direction = Vec2::from_angle(turn as f32 * std::f32::consts::FRAC_PI_4);
            let (last, there) = surface.step(cell, at, at + direction * 0.5, |_| true);
            let is_open = there.distance(at + direction * 0.5) < 0.01;
            if is_open && surface.cell(last).area == Area::Sidewalk {
                count += 1;
                held += usize::from(progress_m(&surface, at, direction, false) < 0.05);
                still_held += usize::from(progress_m(&surface, at, direction, true) < 0.05);
            }
        }
    }
    assert!(held > 0, "without detours some of {count} ways are held, or the test shows nothing");
    assert!(still_held * 8 < held, "{still_held} of {held} are held with detours");
}

#[test]
fn the_way_round_a_corner_touches_it() {
    let portals = [
        Portal { right: vec2(5.0, 0.0), left: vec2(5.0, 2.0) },
        Portal { right: vec2(7.0, 2.0), left: vec2(5.0, 2.0) },
    ];
    let way = funnel::shortest(vec2(0.0, 1.0), vec2(6.0, 8.0), &portals);
    assert_eq!(way, [vec2(5.0, 2.0), vec2(6.0, 8.0)]);
}

#[test]
fn the_sidewalks_of_a_town_keep_off_its_roads() {
    let text = mapgen::named("Town01").unwrap();
    let network = road::Network::parse(&text).unwrap();
    let town = town::furnish(&network, 1);
    let Ground { cells, crossings } = Ground::new(&network, &town);
    assert!(area_m2(&cells, Area::Sidewalk) > 5_000.0);
    assert!(area_m2(&cells, Area::Crosswalk) > 500.0);
    assert!(area_m2(&cells, Area::Road) > 100.0);
    assert!(crossings.iter().any(|one| one.area == Area::Road));
    for cell in cells.triangles.iter().filter(|cell| cell.area == Area::Sidewalk) {
        let corners = cell.corners.map(|at| cells.positions[at as usize]);
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        let Some(at) = network.nearest(middle, road::LaneTypes::DRIVING) else { continue };
        let place = network.place(at);
        let aside = (place.position - middle).truncate().length();
        assert!(aside > network.width(at) / 2.0, "{middle} is {aside} m from the lane's middle");
    }
}

#[test]
fn the_sidewalks_of_a_town_are_connected() {
    let text = mapgen::named("Flatford").unwrap();
    let network = road::Network::parse(&text).unwrap();
    let cells = Ground::new(&network, &town::furnish(&network, 3)).cells;
    let mut known = vec![false; cells.triangles.len()];
    let (mut largest, mut whole) = (0.0f64, 0.0);
    for start in 0..cells.triangles.len() {
        let (mut open, mut part_m2) = (vec![start], 0.0);
        while let Some(at) = open.pop() {
            if std::mem::replace(&mut known[at], true) {
                continue;
            }
            let cell = cells.triangles[at];
            let [a, b, c] = cell.corners.map(|corner| cells.positions[corner as usize].truncate());
            part_m2 += (b - a).perp_dot(c - a) / 2.0;
            open.extend(cell.neighbours.iter().flatten().map(|next| *next as usize));
        }
        largest = largest.max(part_m2);
        whole += part_m2;
    }
    assert!(largest > 0.97 * whole, "{largest} of {whole} m²");
}

#[test]
fn the_ground_is_that_of_the_town_without_scenery() {
    let text = mapgen::named("Flatford").unwrap();
    let network = road::Network::parse(&text).unwrap();
    let town = town::furnish(&network, 3);
    let [whole, bare] = [&town, &town.without_scenery()].map(|town| Ground::new(&network, town));
    assert_eq!(whole.cells.positions, bare.cells.positions);
    assert_eq!(whole.cells.triangles, bare.cells.triangles);
    assert_eq!(whole.crossings, bare.crossings);
}
