//! The mesh under vertical rays.

use glam::DVec3;
use mesh::{Mesh, Tag};

use super::{made, shared_maps, small};
use crate::{LanePoint, LaneTypes, Network, surface_mesh};

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

    /// Returns height and triangle of the first surface at most `reach` below `from`.
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

/// Where a junction's roads contradict each other, its surface blends their heights in cells of
/// this size, metres, so that they bend what lies beside them.
const CELL_OF_BLEND_M: f64 = 0.9;

/// Returns whether several roads of one junction lie around `point` at different heights, and `z`
/// is between them.
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
            let (pose, _) = network.lane_pose(lane.index, along_m, 0.0);
            let offset = pose.rotation().inverse() * (point - pose.position);
            let half = 0.5 * network.width(LanePoint { lane: lane.index, along_m });
            if offset.x.abs() < 0.2
                && offset.y.abs() < half + CELL_OF_BLEND_M
                && offset.z.abs() < 0.6
            {
                let foot = network.lane_pose(lane.index, along_m, offset.y).0.position;
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
    for (name, text) in maps() {
        let network = Network::parse(&text).expect("a map that loads");
        let mesh = surface_mesh(&network, 5.0);
        let caster = Caster::new(&mesh);
        let (mut rays, mut missed, mut height, mut tag) = (0, 0, 0, 0);
        let mut first = None;
        for lane in network.lanes() {
            if !LaneTypes::DRIVABLE.contains(lane.kind) {
                continue;
            }
            let steps = (lane.length_m / 0.9).ceil().max(1.0) as usize;
            for step in 0..=steps {
                // Not exactly on seams: where two surfaces meet, a ray may find either.
                let along_m = lane.length_m * (step as f64 + 0.137) / (steps as f64 + 0.3);
                let width = network.width(LanePoint { lane: lane.index, along_m });
                if width < 0.3 {
                    continue;
                }
                for share in [-0.46, -0.21, 0.013, 0.24, 0.47] {
                    let offset = share * width;
                    let bend = network.place_at(lane.index, along_m, 0.0).curvature_per_m;
                    // The inner side of a bend that is tighter than the lane's width does not
                    // exist.
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
            "{name:<55} {:>9} {rays:>8} | {missed:>6} {height:>6} {tag:>6}",
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

/// Returns hand-made maps, and those of `OMNIBUS_MAPS`.
fn maps() -> Vec<(String, String)> {
    let mut maps = made::maps();
    maps.push(("small".to_string(), small::text(small::JOINED)));
    maps.extend(shared_maps());
    maps
}

#[test]
fn rays_find_a_surface_where_lanes_meet() {
    let mut failed = Vec::new();
    for (name, text) in maps() {
        let network = Network::parse(&text).expect("a map that loads");
        let mesh = surface_mesh(&network, 5.0);
        let caster = Caster::new(&mesh);
        let (mut rays, mut wrong, mut first) = (0, 0, None);
        for lane in network.lanes() {
            // Gaps in the file itself are not closed.
            let ends = [lane.successors.first(), lane.predecessors.first()];
            let joined = |end: usize| {
                let (Some(next), along) = (ends[end], [lane.length_m, 0.0][end]) else {
                    return false;
                };
                let next = network.lane(*next);
                let there = network.place_at(next.index, [0.0, next.length_m][end], 0.0).position;
                there.distance(network.place_at(lane.index, along, 0.0).position) < 0.01
            };
            if !LaneTypes::DRIVABLE.contains(lane.kind) || lane.length_m < 0.1 {
                continue;
            }
            for end in [0, 1].into_iter().filter(|end| joined(*end)) {
                // Eight kilometres from the origin f32 resolves half a millimetre.
                for back in [1e-3, 0.003, 0.01, 0.05] {
                    let along_m = if end == 0 { lane.length_m - back } else { back };
                    let width = network.width(LanePoint { lane: lane.index, along_m });
                    for share in [-0.45, -0.2, 0.0, 0.2, 0.45] {
                        let offset = share * width;
                        let bend = network.place_at(lane.index, along_m, 0.0).curvature_per_m;
                        if width < 0.3 || bend * offset > 0.8 {
                            continue;
                        }
                        let point = network.place_at(lane.index, along_m, offset).position;
                        rays += 1;
                        let hit = caster.below(point + DVec3::Z, 3.0);
                        let is_right = hit.is_some_and(|(z, _)| {
                            (z - point.z).abs() < 0.02 || between_lanes(&network, point, z)
                        });
                        if !is_right {
                            wrong += 1;
                            let road = &network.roads()[lane.road as usize].id;
                            first.get_or_insert(format!(
                                "{hit:?} at {point:.3}, road {road} lane {} at its {along_m:.3} m",
                                lane.id
                            ));
                        }
                    }
                }
            }
        }
        println!("joints of {name}: {rays} rays, {wrong} wrong {first:?}");
        if wrong > 0 {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// Widest crack, metres; wider gaps lie between roads.
const CRACK_M: f64 = 0.15;
/// Distance of the places at which edges are examined, metres.
const EVERY_M: f64 = 0.2;

#[test]
fn no_crack_runs_through_the_surface_of_roads() {
    let mut failed = Vec::new();
    for (name, text) in maps() {
        let network = Network::parse(&text).expect("a map that loads");
        let mesh = surface_mesh(&network, 5.0);
        let caster = Caster::new(&mesh);
        let (mut edges, mut cracks, mut first) = (0, 0, None);
        for (from, to) in open_edges(&mesh) {
            let [a, b] = [from, to]
                .map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
            // Faces lie to the left of their edges.
            let out = -(b - a).truncate().normalize_or_zero().perp().extend(0.0);
            edges += 1;
            let places = (a.distance(b) / EVERY_M).ceil().max(1.0) as usize;
            let is_crack = |place: usize| {
                let from = a.lerp(b, (place as f64 + 0.5) / places as f64);
                let at = |away: f64| caster.below(from + out * away + DVec3::Z * 0.3, 0.6);
                let is_gap = |away: f64| at(away).is_none();
                let beyond = at(CRACK_M).filter(|hit| (hit.0 - from.z).abs() < 0.05);
                let beyond = beyond.filter(|hit| {
                    let tag = Tag::from_code(mesh.faces[hit.1].tag);
                    matches!(tag, Some(Tag::Roads | Tag::RoadLine))
                });
                let cracked = (is_gap(0.002) || is_gap(0.02) || is_gap(0.06)) && beyond.is_some();
                cracked.then_some(from)
            };
            if let Some(place) = (0..places).find_map(is_crack) {
                cracks += 1;
                first.get_or_insert(format!("{place:.3}"));
            }
        }
        println!("cracks of {name}: {cracks} at {edges} open edges {first:?}");
        let known = CRACKS.iter().find(|known| name.ends_with(known.0)).map_or(0, |known| known.1);
        if cracks > known {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// Maps with cracks, and the number of cracked edges: where a file's roads contradict each other in
/// height or overlap by slivers that are narrower than what joins them.
const CRACKS: [(&str, usize); 3] = [("carla2019__Town03", 7), ("Town06", 1), ("acosta", 7)];

/// Returns the edges of roads that belong to only one horizontal triangle, in its direction.
fn open_edges(mesh: &Mesh) -> Vec<(u32, u32)> {
    let road = [Tag::Roads as u8, Tag::RoadLine as u8];
    let mut edges = Vec::new();
    for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
        let [a, b, c] =
            corners.map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
        if (b - a).cross(c - a).normalize_or_zero().z < 0.3 {
            continue;
        }
        for at in 0..3 {
            let (from, to) = (corners[at], corners[(at + 1) % 3]);
            edges.push((from.min(to), from.max(to), from, to, road.contains(&face.tag)));
        }
    }
    edges.sort_unstable();
    edges
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .filter(|same| same.len() == 1 && same[0].4)
        .map(|same| (same[0].2, same[0].3))
        .collect()
}

#[test]
fn paint_is_as_wide_and_as_long_as_the_file_says() {
    let mark = r#"<roadMark sOffset="4" type="broken" color="white" width="0.2"><type name="broken"><line length="3" space="5" tOffset="0.1" sOffset="1" width="0.2"/></type></roadMark></lane>"#;
    let text = small::text(small::JOINED);
    let (before, after) = text.split_at(text.find(r#"<lane id="-1""#).expect("lane -1"));
    let text = before.to_string() + &after.replacen("</lane>", mark, 1);
    let network = Network::parse(&text).expect("a valid map");
    let mesh = surface_mesh(&network, 5.0);
    let caster = Caster::new(&mesh);
    let is_painted = |x: f64, y: f64| {
        let (_, triangle) = caster.below(DVec3::new(x, y, 1.0), 2.0).expect("a surface");
        Tag::from_code(mesh.faces[triangle].tag) == Some(Tag::RoadLine)
    };
    // Along the middle of the line: at t -3.4, from s 5 on, three metres in eight.
    for step in 0..500 {
        let x = 0.05 + 0.1 * f64::from(step);
        let wanted = x > 4.0 && (x - 5.0).rem_euclid(8.0) < 3.0 && x > 5.0;
        assert_eq!(is_painted(x, -3.4), wanted, "at {x}");
    }
    for step in 0..100 {
        let y = -3.9 + 0.01 * f64::from(step) + 0.005;
        assert_eq!(is_painted(6.0, y), (y + 3.4).abs() < 0.1, "at {y}");
    }
}
