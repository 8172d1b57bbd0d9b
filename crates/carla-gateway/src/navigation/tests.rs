use glam::dvec3;

use super::{
    area::Area,
    cells::{Cells, Ground},
    detour, outline,
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

#[test]
fn two_sidewalks_and_a_crosswalk_are_one_ground_with_a_hole() {
    let ground = Ground {
        sidewalks: vec![square([0.0, 0.0], [20.0, 2.0]), square([0.0, 8.0], [20.0, 10.0])],
        crosswalks: vec![square([8.0, 1.0], [12.0, 9.0])],
        holes: vec![square([4.0, 0.5], [5.0, 1.0])],
    };
    let cells = Cells::of(&ground, |_| None);
    assert!((area_m2(&cells, Area::Sidewalk) - 79.5).abs() < 0.2);
    assert!((area_m2(&cells, Area::Crosswalk) - 24.0).abs() < 0.2);
    let mut reached = vec![false; cells.triangles.len()];
    let mut next = vec![0];
    while let Some(at) = next.pop() {
        if !std::mem::replace(&mut reached[at], true) {
            next.extend(
                cells.triangles[at].neighbours.iter().flatten().map(|other| *other as usize),
            );
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

#[test]
fn the_sidewalks_of_a_town_keep_off_its_roads() {
    let text = mapgen::named("Town01").unwrap();
    let network = road::Network::parse(&text).unwrap();
    let town = town::furnish(&network, 1);
    let cells = super::cells(&network, &town);
    assert!(area_m2(&cells, Area::Sidewalk) > 5_000.0);
    assert!(area_m2(&cells, Area::Crosswalk) > 500.0);
    for cell in cells.triangles.iter().filter(|cell| cell.area == Area::Sidewalk) {
        let corners = cell.corners.map(|at| cells.positions[at as usize]);
        let middle = corners.iter().sum::<glam::DVec3>() / 3.0;
        let Some(at) = network.nearest(middle, road::LaneTypes::DRIVING) else { continue };
        let place = network.place(at);
        let aside = (place.position - middle).truncate().length();
        assert!(aside > network.width(at) / 2.0, "{middle} is {aside} m from the lane's middle");
    }
    let file = detour::file(&cells);
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap());
    assert_eq!(word(0), 0x4d53_4554);
    // The length of the tile in the header matches, and the file ends with the tile.
    let head = 4 * 3 + 4 * 7 + 8;
    assert_eq!(file.len(), head + word(head - 4) as usize);
}
