//! The mesh under vertical rays.

use super::shared_maps;
use crate::{LanePoint, LaneTypes, Mesh, Network, Tag, surface_mesh};
use glam::DVec3;

/// Triangles by the square cells that they cross, for vertical rays.
pub(super) struct Caster<'a> {
    mesh: &'a Mesh,
    low: [f32; 2],
    columns: usize,
    rows: usize,
    cells: Vec<Vec<u32>>,
}

const CELL_M: f32 = 2.0;

impl<'a> Caster<'a> {
    pub(super) fn new(mesh: &'a Mesh) -> Caster<'a> {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for position in &mesh.positions {
            for axis in 0..2 {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
        }
        let cells = |axis: usize| ((high[axis] - low[axis]) / CELL_M) as usize + 1;
        let (columns, rows) = (cells(0), cells(1));
        let mut caster =
            Caster { mesh, low, columns, rows, cells: vec![Vec::new(); columns * rows] };
        for (index, corners) in mesh.triangles.iter().enumerate() {
            let points = corners.map(|corner| mesh.positions[corner as usize]);
            let span = |axis: usize, limit: usize| {
                let values = points.map(|point| ((point[axis] - low[axis]) / CELL_M) as usize);
                let first = values.into_iter().min().unwrap_or(0);
                first..=values.into_iter().max().unwrap_or(0).min(limit - 1)
            };
            for row in span(1, rows) {
                for column in span(0, columns) {
                    caster.cells[row * columns + column].push(index as u32);
                }
            }
        }
        caster
    }

    /// Height and triangle of the first surface at most `reach` below `from`.
    pub(super) fn below(&self, from: DVec3, reach: f64) -> Option<(f64, usize)> {
        let (x, y) = (from.x, from.y);
        let column = ((x as f32 - self.low[0]) / CELL_M) as usize;
        let row = ((y as f32 - self.low[1]) / CELL_M) as usize;
        if column >= self.columns || row >= self.rows {
            return None;
        }
        let mut best: Option<(f64, usize)> = None;
        for &index in &self.cells[row * self.columns + column] {
            let [a, b, c] = self.mesh.triangles[index as usize]
                .map(|corner| self.mesh.positions[corner as usize].map(f64::from));
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if area.abs() < 1e-12 {
                continue;
            }
            let side = |p: [f64; 3], q: [f64; 3]| {
                ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
            };
            let shares = [side(b, c), side(c, a), side(a, b)];
            if shares.iter().any(|share| *share < 0.0) {
                continue;
            }
            let z = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
            if z <= from.z && z >= from.z - reach && best.is_none_or(|(top, _)| z > top) {
                best = Some((z, index as usize));
            }
        }
        best
    }
}

/// Where a junction's roads contradict each other, its surface goes from one to the other across
/// cells of this size, so that they bend what lies beside them.
const CELL_OF_BLEND_M: f64 = 0.9;

/// Whether several roads of one junction lie round `point` in different heights, and `z` between
/// them.
fn between_lanes(network: &Network, point: DVec3, z: f64) -> bool {
    let (mut low, mut high) = (point.z, point.z);
    for lane in network.lanes().iter().filter(|lane| lane.junction.is_some()) {
        let middle = network.place_at(lane.index, 0.5 * lane.length_m, 0.0).position;
        if middle.distance(point) > lane.length_m + 10.0 {
            continue;
        }
        let steps = (lane.length_m / 0.2).ceil() as usize;
        for step in 0..=steps {
            let along_m = lane.length_m * step as f64 / steps.max(1) as f64;
            let pose = network.place_at(lane.index, along_m, 0.0);
            let offset = pose.rotation().inverse() * (point - pose.position);
            let half = 0.5 * network.width(LanePoint { lane: lane.index, along_m });
            if offset.x.abs() < 0.2
                && offset.y.abs() < half + CELL_OF_BLEND_M
                && offset.z.abs() < 0.6
            {
                let foot = network.place_at(lane.index, along_m, offset.y).position;
                low = low.min(foot.z);
                high = high.max(foot.z);
            }
        }
    }
    (low - 0.02..=high + 0.02).contains(&z)
}

#[test]
fn rays_find_every_driving_lane_at_its_height_as_road() {
    println!(
        "{:<55} {:>9} {:>8} | {:>6} {:>6} {:>6}",
        "map", "triangles", "rays", "missed", "height", "tag"
    );
    let mut failed = Vec::new();
    for (name, text) in shared_maps() {
        let network = Network::parse(&text).expect("a map that loads");
        let start = std::time::Instant::now();
        let mesh = surface_mesh(&network, 5.0);
        let took = start.elapsed();
        let caster = Caster::new(&mesh);
        let (mut rays, mut missed, mut height, mut tag) = (0, 0, 0, 0);
        let mut first = None;
        for lane in network.lanes() {
            if !LaneTypes::DRIVABLE.contains(lane.kind) {
                continue;
            }
            let steps = (lane.length_m / 0.9).ceil().max(1.0) as usize;
            for step in 0..=steps {
                // Not on the very seams: where two surfaces meet, either may be found.
                let along_m = lane.length_m * (step as f64 + 0.137) / (steps as f64 + 0.3);
                let width = network.width(LanePoint { lane: lane.index, along_m });
                if width < 0.3 {
                    continue;
                }
                for share in [-0.46, -0.21, 0.013, 0.24, 0.47] {
                    let offset = share * width;
                    let bend = network.place_at(lane.index, along_m, 0.0).curvature_per_m;
                    // The inner side of a bend tighter than the lane is wide is nowhere.
                    if bend * offset > 0.8 {
                        continue;
                    }
                    let point = network.place_at(lane.index, along_m, offset).position;
                    rays += 1;
                    let what = match caster.below(point + DVec3::Z, 3.0) {
                        None => {
                            missed += 1;
                            "missed".to_string()
                        }
                        Some((z, triangle)) => {
                            let found = Tag::from_code(mesh.faces[triangle].tag);
                            if (z - point.z).abs() > 0.02 && !between_lanes(&network, point, z) {
                                height += 1;
                                format!("height {:+.3} {found:?}", z - point.z)
                            } else if !matches!(found, Some(Tag::Roads | Tag::RoadLine)) {
                                tag += 1;
                                format!("tag {found:?}")
                            } else {
                                continue;
                            }
                        }
                    };
                    if first.is_none() {
                        let (road, section, id, s) =
                            network.road_space(LanePoint { lane: lane.index, along_m });
                        first = Some(format!(
                            "{what} at {point:.3} road {} section {section} lane {id} s {s:.3} share {share}",
                            road.id
                        ));
                    }
                }
            }
        }
        println!(
            "{name:<55} {:>9} {rays:>8} | {missed:>6} {height:>6} {tag:>6}  {took:?}",
            mesh.triangles.len()
        );
        if let Some(first) = first {
            println!("    {first}");
        }
        if missed + height + tag > 0 {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}
