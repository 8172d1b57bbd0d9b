//! Tunnels and bridges.

use glam::DVec3;
use mesh::{Face, Material, Tag};

use super::sweep::{BOX, GATE, Sweep, structure_ranges};
use crate::{axes::RoadAxes, lane::Lane, network::Network, object::Span, road::Road};

const STATION_M: f64 = 2.0;
/// Distance of a tunnel's walls from the lanes, metres.
const BERM_M: f64 = 0.5;
/// Thickness of walls and roofs, metres.
const WALL_M: f64 = 0.5;
/// Clear height of a tunnel, metres.
const CLEAR_M: f64 = 5.0;
/// How deep walls reach into the ground, metres.
const FOOT_M: f64 = 0.4;
const PARAPET_M: f64 = 1.0;
const PARAPET_THICK_M: f64 = 0.25;
/// Thickness of a bridge's deck, metres.
const DECK_M: f64 = 0.7;
/// How far the deck's top lies below the lanes on it, metres.
const BELOW_M: f64 = 0.05;

pub(super) fn span(network: &Network, span: &Span, sweep: &mut Sweep) {
    let road = &network.roads()[span.road as usize];
    let from = span.s.clamp(0.0, road.length_m);
    let to = (span.s + span.length_m).clamp(from, road.length_m);
    let steps = ((to - from) / STATION_M).ceil() as usize;
    if to - from < 0.1 || !sweep.admits(steps) {
        return;
    }
    let stations: Vec<Station> = (0..=steps)
        .map(|step| Station::new(network, road, from + (to - from) * step as f64 / steps as f64))
        .collect();
    if span.is_tunnel {
        structure_ranges(stations.len()).for_each(|part| tunnel(span.road, &stations[part], sweep));
    } else {
        bridge(span.road, &stations, sweep);
    }
}

/// A road's cross-section: the outer borders of its outermost lanes.
struct Station {
    axes: RoadAxes,
    left: f64,
    right: f64,
}

impl Station {
    fn new(network: &Network, road: &Road, s: f64) -> Station {
        let section = &road.sections[road.section_at(s)];
        let offset = section.lane_offset(road, s).value;
        let ds = s - section.start_m;
        let reach = |lanes: &mut dyn Iterator<Item = &Lane>| {
            lanes.fold(0.0, |inner, lane| inner + lane.width_from(inner, ds))
        };
        let lanes = || section.lanes.iter().map(|lane| network.lane(*lane));
        let left =
            offset + reach(&mut lanes().take(section.left).collect::<Vec<_>>().into_iter().rev());
        let right = offset - reach(&mut lanes().skip(section.left));
        Station { axes: RoadAxes::new(road.station(s)), left, right }
    }

    /// Returns a point `beside` metres outside the left edge; `right` does so for the right edge.
    fn left(&self, beside: f64, up: f64) -> DVec3 {
        self.axes.point(self.left + beside, 0.0, up)
    }

    fn right(&self, beside: f64, up: f64) -> DVec3 {
        self.axes.point(self.right - beside, 0.0, up)
    }
}

fn tunnel(road: u32, stations: &[Station], sweep: &mut Sweep) {
    let (inner, outer) = (BERM_M, BERM_M + WALL_M);
    let row = |at: &Station| {
        [
            at.left(outer, CLEAR_M + WALL_M),
            at.right(outer, CLEAR_M + WALL_M),
            at.right(outer, -FOOT_M),
            at.right(inner, -FOOT_M),
            at.right(inner, CLEAR_M),
            at.left(inner, CLEAR_M),
            at.left(inner, -FOOT_M),
            at.left(outer, -FOOT_M),
        ]
    };
    let rows: Vec<[DVec3; 8]> = stations.iter().map(row).collect();
    let face = Face::new(Tag::Wall, Material::Concrete, 0);
    sweep.begin(Tag::Wall, false);
    // A road that enters the tunnel from the side finds its wall open.
    let foot = |row: &[DVec3; 8]| row[3].midpoint(row[2]) + DVec3::Z * FOOT_M;
    let free = sweep.body(&GATE, &rows, road, face, foot);
    for corners in [[7, 6, 5, 0], [4, 1, 2, 3]] {
        let wall: Vec<[DVec3; 4]> =
            rows.iter().map(|row| corners.map(|corner| row[corner])).collect();
        sweep.solid(&wall, &free, 0.0);
    }
}

fn bridge(road: u32, stations: &[Station], sweep: &mut Sweep) {
    let face = Face::new(Tag::Bridge, Material::Concrete, 0);
    let sides: [fn(&Station, f64, f64) -> DVec3; 2] = [Station::left, Station::right];
    for (side, is_left) in sides.into_iter().zip([true, false]) {
        let row = |at: &Station| {
            let (inner, outer) = (0.0, PARAPET_THICK_M);
            let (left, right) = if is_left { (outer, inner) } else { (inner, outer) };
            [
                side(at, left, PARAPET_M),
                side(at, right, PARAPET_M),
                side(at, right, -DECK_M),
                side(at, left, -DECK_M),
            ]
        };
        let foot = |row: &[DVec3; 4]| row[2].midpoint(row[3]) + DVec3::Z * DECK_M;
        for part in structure_ranges(stations.len()) {
            let rows: Vec<[DVec3; 4]> = stations[part].iter().map(row).collect();
            sweep.begin(Tag::Bridge, false);
            let free = sweep.body(&BOX, &rows, road, face, foot);
            sweep.solid(&rows, &free, 0.0);
        }
    }
    let row = |at: &Station| {
        [
            at.left(0.0, -BELOW_M),
            at.right(0.0, -BELOW_M),
            at.right(0.0, -DECK_M),
            at.left(0.0, -DECK_M),
        ]
    };
    let rows: Vec<[DVec3; 4]> = stations.iter().map(row).collect();
    sweep.begin(Tag::Bridge, true);
    // The deck lies below every road that it carries.
    sweep.body(&BOX, &rows, road, face, |row| row[0] - DVec3::Z * 100.0);
}
