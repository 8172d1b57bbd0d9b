//! Where streets run: nodes of a bent, thinned-out grid and the streets between them.

use glam::{DVec2, dvec2};

use super::Plan;
use super::curve::wrapped;
use crate::random::Random;

/// A crossing, or the bend between two streets.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) position: DVec2,
    pub(super) height: f64,
}

/// What a street looks like across. Metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Profile {
    /// Driving lanes per direction.
    pub(super) lanes: usize,
    pub(super) lane: f64,
    /// 0 where nobody may park.
    pub(super) parking: f64,
    pub(super) sidewalk: f64,
    pub(super) limit_kmh: f64,
}

impl Profile {
    /// From the centre line to the kerb, where nobody parks.
    pub(super) fn half(&self) -> f64 {
        self.lanes as f64 * self.lane
    }

    /// The sidewalk's lane number, without its sign.
    pub(super) fn sidewalk_id(&self) -> i32 {
        self.lanes as i32 + 1 + i32::from(self.parking > 0.0)
    }
}

/// A street between two crossings.
#[derive(Clone, Debug)]
pub(super) struct Street {
    pub(super) name: String,
    /// Nodes at its start and end.
    pub(super) ends: [usize; 2],
    /// Corners on the way, to be rounded.
    pub(super) via: Vec<DVec2>,
    pub(super) radii: Vec<f64>,
    pub(super) profile: Profile,
}

#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) nodes: Vec<Node>,
    pub(super) streets: Vec<Street>,
}

const AVENUE: Profile =
    Profile { lanes: 2, lane: 3.5, parking: 0.0, sidewalk: 4.0, limit_kmh: 50.0 };
const STREET: Profile =
    Profile { lanes: 1, lane: 3.5, parking: 0.0, sidewalk: 3.0, limit_kmh: 40.0 };
const PARKED: Profile = Profile { parking: 2.3, limit_kmh: 30.0, ..STREET };

/// The steepest a street may be on average: its middle is half as steep again.
const CLIMB: f64 = 0.045;

/// One link of the grid before bends are joined.
#[derive(Clone)]
struct Link {
    ends: [usize; 2],
    bow: Option<DVec2>,
    profile: Profile,
    name: String,
    alive: bool,
}

/// A city grid: avenues through the middle, streets between, some links left out, some bowed.
pub(super) fn grid(plan: &Plan) -> Layout {
    let mut random = Random::new(plan.seed, 0x61d);
    let size = plan.size_m.clamp(250.0, 3000.0);
    let xs = spread(&mut random, size);
    let ys = spread(&mut random, size);
    let (columns, rows) = (xs.len(), ys.len());
    let bow = size * 0.05;
    let mut nodes = Vec::new();
    for (row, y) in ys.iter().enumerate() {
        for (column, x) in xs.iter().enumerate() {
            // The whole plan is bent a little, and no two corners are quite alike.
            let sway = dvec2((y / size * 4.0).sin(), (x / size * 3.2 + 0.6).sin()) * bow;
            let jitter =
                dvec2(f64::from(random.between(-5.0, 5.0)), f64::from(random.between(-5.0, 5.0)));
            nodes.push(Node { position: dvec2(*x, *y) + sway + jitter, height: 0.0 });
            debug_assert_eq!(nodes.len(), row * columns + column + 1);
        }
    }
    let mut links = links(&mut random, columns, rows, &nodes);
    thin_out(&mut random, &mut links, &nodes);
    heights(plan, &mut nodes, &links, size);
    Layout { streets: join_bends(&nodes, &links), nodes }
}

/// Street positions across the town: blocks between 75 and 125 metres.
fn spread(random: &mut Random, size: f64) -> Vec<f64> {
    let blocks = ((size / 105.0).round() as usize).max(2);
    let weights: Vec<f64> = (0..blocks).map(|_| f64::from(random.between(0.78, 1.28))).collect();
    let total: f64 = weights.iter().sum();
    let mut at = -size * 0.5;
    let mut positions = vec![at];
    for weight in weights {
        at += size * weight / total;
        positions.push(at);
    }
    positions
}

fn links(random: &mut Random, columns: usize, rows: usize, nodes: &[Node]) -> Vec<Link> {
    let avenue_column = columns / 2;
    let avenue_row = rows / 2;
    let ring = random.chance(0.5);
    let mut links = Vec::new();
    let mut add = |random: &mut Random, ends: [usize; 2], avenue: bool, name: String| {
        let profile = if avenue {
            AVENUE
        } else if random.chance(0.45) {
            PARKED
        } else {
            STREET
        };
        let [a, b] = ends.map(|end| nodes[end].position);
        let bow = (!avenue && random.chance(0.28)).then(|| {
            let side = if random.chance(0.5) { 1.0 } else { -1.0 };
            (a + b) * 0.5 + (b - a).perp() * side * f64::from(random.between(0.07, 0.14))
        });
        links.push(Link { ends, bow, profile, name, alive: true });
    };
    for row in 0..rows {
        for column in 0..columns - 1 {
            let start = row * columns + column;
            let avenue = row == avenue_row || (ring && row == 0);
            add(random, [start, start + 1], avenue, across(row));
        }
    }
    for column in 0..columns {
        for row in 0..rows - 1 {
            let start = row * columns + column;
            add(random, [start, start + columns], column == avenue_column, along(column));
        }
    }
    links
}

fn across(row: usize) -> String {
    const NAMES: [&str; 12] = [
        "Quay", "Mill", "Market", "Church", "Station", "Garden", "School", "Bridge", "Castle",
        "Orchard", "Forge", "Abbey",
    ];
    format!("{} Street{}", NAMES[row % 12], if row >= 12 { " North" } else { "" })
}

fn along(column: usize) -> String {
    const NAMES: [&str; 12] = [
        "Willow", "Elm", "Alder", "Maple", "Linden", "Chestnut", "Rowan", "Birch", "Hazel", "Oak",
        "Cedar", "Poplar",
    ];
    format!("{} Road{}", NAMES[column % 12], if column >= 12 { " East" } else { "" })
}

/// Leaves out about every seventh street, never so that one could not turn back without it.
fn thin_out(random: &mut Random, links: &mut [Link], nodes: &[Node]) {
    let wanted = links.len() / 7;
    let at = links_at(nodes.len(), links.iter().map(|link| link.ends));
    let mut removed = 0;
    for _ in 0..links.len() * 4 {
        if removed == wanted {
            break;
        }
        let chosen = random.below(links.len());
        let busy = |node: usize| at[node].iter().filter(|l| links[**l].alive).count();
        let link = &links[chosen];
        // Both ends stay junctions: a bend in mid-town would be a kink in two streets.
        if !link.alive || link.profile == AVENUE || link.ends.iter().any(|end| busy(*end) < 4) {
            continue;
        }
        links[chosen].alive = false;
        if two_ways_round(links, &at) {
            removed += 1;
        } else {
            links[chosen].alive = true;
        }
    }
}

/// Links by node: one list for each.
pub(super) fn links_at(nodes: usize, ends: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<usize>> {
    let mut at = vec![Vec::new(); nodes];
    for (link, [a, b]) in ends.enumerate() {
        at[a].push(link);
        at[b].push(link);
    }
    at
}

/// No single street is the only way between two parts: depth-first, each node remembers the
/// earliest one to which something behind it leads back (Tarjan 1974).
fn two_ways_round(links: &[Link], at: &[Vec<usize>]) -> bool {
    let nodes = at.len();
    let (mut found, mut earliest) = (vec![usize::MAX; nodes], vec![usize::MAX; nodes]);
    let mut count = 1;
    (found[0], earliest[0]) = (0, 0);
    // Node, the link by which it was reached, how many of its links were looked at.
    let mut path = vec![(0, usize::MAX, 0)];
    while let Some((node, from, looked)) = path.last_mut() {
        let (node, from) = (*node, *from);
        if let Some(&link) = at[node].get(*looked) {
            *looked += 1;
            if link == from || !links[link].alive {
                continue;
            }
            let other = links[link].ends[0] + links[link].ends[1] - node;
            if found[other] == usize::MAX {
                (found[other], earliest[other]) = (count, count);
                count += 1;
                path.push((other, link, 0));
            } else {
                earliest[node] = earliest[node].min(found[other]);
            }
        } else {
            path.pop();
            if let Some((parent, ..)) = path.last() {
                if earliest[node] > found[*parent] {
                    return false;
                }
                earliest[*parent] = earliest[*parent].min(earliest[node]);
            }
        }
    }
    count == nodes
}

/// Rolling ground, flattened until no street climbs too much.
fn heights(plan: &Plan, nodes: &mut [Node], links: &[Link], size: f64) {
    let mut random = Random::new(plan.seed, 0x4e1);
    let phase = [0; 3].map(|_: i32| f64::from(random.between(0.0, std::f32::consts::TAU)));
    for node in nodes.iter_mut() {
        let p = node.position / size;
        let wave = (p.x * 3.1 + phase[0]).sin()
            + (p.y * 3.9 + phase[1]).sin()
            + 0.5 * ((p.x - p.y) * 6.0 + phase[2]).sin();
        node.height = wave / 5.0 + 0.5;
    }
    let steepest = links
        .iter()
        .filter(|link| link.alive)
        .map(|link| {
            let [a, b] = link.ends.map(|end| &nodes[end]);
            (a.height - b.height).abs() / ((a.position.distance(b.position)) - 30.0).max(20.0)
        })
        .fold(1e-9, f64::max);
    let scale = plan.relief_m.max(0.0).min(CLIMB / steepest);
    for node in nodes.iter_mut() {
        node.height *= scale;
    }
}

/// Streets from junction to junction: links that meet at a node with no third are one street.
fn join_bends(nodes: &[Node], links: &[Link]) -> Vec<Street> {
    let mut at = links_at(nodes.len(), links.iter().map(|link| link.ends));
    at.iter_mut().for_each(|here| here.retain(|link| links[*link].alive));
    let is_bend = |node: usize| at[node].len() == 2;
    let mut used = vec![false; links.len()];
    let mut streets = Vec::new();
    for first in 0..links.len() {
        let Some(start) = links[first].ends.into_iter().find(|end| !is_bend(*end)) else {
            continue;
        };
        if used[first] || !links[first].alive {
            continue;
        }
        let (mut link, mut node) = (first, start);
        let (mut via, mut radii) = (Vec::new(), Vec::new());
        loop {
            used[link] = true;
            if let Some(bow) = links[link].bow {
                via.push(bow);
                radii.push(220.0);
            }
            node = links[link].ends[0] + links[link].ends[1] - node;
            if !is_bend(node) {
                break;
            }
            via.push(nodes[node].position);
            radii.push(32.0);
            link = at[node].iter().copied().find(|other| *other != link).unwrap_or(link);
        }
        let (name, profile) = (links[first].name.clone(), links[first].profile);
        streets.push(Street { name, ends: [start, node], via, radii, profile });
    }
    streets
}

impl Street {
    /// The bearing in which it leaves its start (0) or its end (1).
    pub(super) fn bearing(&self, nodes: &[Node], end: usize) -> f64 {
        let here = nodes[self.ends[end]].position;
        let far = nodes[self.ends[1 - end]].position;
        let next = if end == 0 { self.via.first() } else { self.via.last() };
        wrapped((*next.unwrap_or(&far) - here).to_angle())
    }
}
