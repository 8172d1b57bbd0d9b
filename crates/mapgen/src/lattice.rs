//! The distorted, thinned-out grid from which most styles begin.

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::street::{Control, Node, Profile, Shape, Street, links_at};

/// The radius of the bend at a node with only two streets; buses clear the lamp posts. Metres.
const BEND_M: f64 = 48.0;

/// How a grid is distorted. Metres and radians.
#[derive(Clone, Debug)]
pub(crate) struct Bend {
    pub(crate) extent: DVec2,
    pub(crate) center: DVec2,
    /// The mean distance between two parallel streets.
    pub(crate) block: f64,
    /// The greatest random displacement of a node.
    pub(crate) jitter: f32,
    /// The amplitude of the waves that long streets follow.
    pub(crate) sway: f64,
    /// The rotation of the middle against the edge.
    pub(crate) swirl: f64,
    /// The fraction of streets with a bow of their own, and the least and greatest bow per length.
    pub(crate) bows: (f32, f32, f32),
    /// One of this many streets is left out; 0 keeps all.
    pub(crate) thinned: usize,
}

/// The position of a link in the grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Whether the link runs along a row instead of a column.
    pub(crate) across: bool,
    /// The index of its row or column.
    pub(crate) line: usize,
    /// The number of rows or columns.
    pub(crate) lines: usize,
}

impl Place {
    /// Whether the link belongs to the line through the middle.
    pub(crate) fn is_middle(&self) -> bool {
        self.line == self.lines / 2
    }

    /// The street name of the line.
    pub(crate) fn name(&self) -> String {
        const ACROSS: [&str; 12] = [
            "Quay", "Mill", "Market", "Church", "Station", "Garden", "School", "Bridge", "Castle",
            "Orchard", "Forge", "Abbey",
        ];
        const ALONG: [&str; 12] = [
            "Willow", "Elm", "Alder", "Maple", "Linden", "Chestnut", "Rowan", "Birch", "Hazel",
            "Oak", "Cedar", "Poplar",
        ];
        let (names, kind, far) =
            if self.across { (ACROSS, "Street", " North") } else { (ALONG, "Road", " East") };
        format!("{} {kind}{}", names[self.line % 12], if self.line >= 12 { far } else { "" })
    }
}

/// One link of the grid before links are joined at bends.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) ends: [usize; 2],
    pub(crate) bow: Option<DVec2>,
    pub(crate) profile: Profile,
    pub(crate) place: Place,
    pub(crate) alive: bool,
}

/// Nodes in rows, and the links between them.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    pub(crate) nodes: Vec<DVec2>,
    pub(crate) links: Vec<Link>,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

/// Builds a distorted grid whose streets have the profiles that `profile` returns.
pub(crate) fn lattice(
    random: &mut RandomStream,
    bend: &Bend,
    mut profile: impl FnMut(&mut RandomStream, Place) -> Profile,
) -> Lattice {
    let xs = spread(random, bend.extent.x, bend.block);
    let ys = spread(random, bend.extent.y, bend.block);
    let (columns, rows) = (xs.len(), ys.len());
    let size = bend.extent.max_element();
    let mut nodes = Vec::new();
    for y in &ys {
        for x in &xs {
            // Waves displace the whole plan a little, and jitter every node.
            let sway = dvec2((y / size * 4.0).sin(), (x / size * 3.2 + 0.6).sin()) * bend.sway;
            let mut off = || f64::from(random.between(-bend.jitter, bend.jitter));
            let jitter = dvec2(off(), off());
            let far = dvec2(*x, *y).length() / (size * 0.5);
            let turn = DVec2::from_angle(bend.swirl * (1.0 - far).max(0.0));
            nodes.push(bend.center + turn.rotate(dvec2(*x, *y)) + sway + jitter);
        }
    }
    let mut links = Vec::new();
    let mut add = |random: &mut RandomStream, ends: [usize; 2], place: Place| {
        let profile = profile(random, place);
        let [a, b] = ends.map(|end| nodes[end]);
        let (chance, least, most) = bend.bows;
        let bow = (profile.all_lanes() <= 2 && random.chance(chance)).then(|| {
            let side = if random.chance(0.5) { 1.0 } else { -1.0 };
            (a + b) * 0.5 + (b - a).perp() * side * f64::from(random.between(least, most))
        });
        links.push(Link { ends, bow, profile, place, alive: true });
    };
    for row in 0..rows {
        for column in 0..columns - 1 {
            let start = row * columns + column;
            add(random, [start, start + 1], Place { across: true, line: row, lines: rows });
        }
    }
    for column in 0..columns {
        for row in 0..rows - 1 {
            let start = row * columns + column;
            let place = Place { across: false, line: column, lines: columns };
            add(random, [start, start + columns], place);
        }
    }
    let mut lattice = Lattice { nodes, links, columns, rows };
    if let Some(wanted) = lattice.links.len().checked_div(bend.thinned) {
        lattice.thin_out(random, wanted);
    }
    lattice
}

/// Returns street positions across the town; blocks measure three to five quarters of the mean.
fn spread(random: &mut RandomStream, size: f64, block: f64) -> Vec<f64> {
    let blocks = ((size / block).round() as usize).max(2);
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

impl Lattice {
    /// Leaves out links; every link that remains is part of a loop.
    fn thin_out(&mut self, random: &mut RandomStream, wanted: usize) {
        let links = &mut self.links;
        let at = links_at(self.nodes.len(), links.iter().map(|link| link.ends));
        let mut removed = 0;
        for _ in 0..links.len() * 4 {
            if removed == wanted {
                break;
            }
            let chosen = random.remainder(links.len());
            let busy = |node: usize| at[node].iter().filter(|l| links[**l].alive).count();
            let link = &links[chosen];
            // Both ends stay junctions: with two links, a node in the middle of the town would be a
            // kink.
            let broad = link.profile.all_lanes() > 2;
            if !link.alive || broad || link.ends.iter().any(|end| busy(*end) < 4) {
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

    /// Returns streets from junction to junction: two links that meet at a node without a third
    /// become one street, unless `keep` holds for the node.
    pub(crate) fn streets(&self, keep: impl Fn(usize) -> bool) -> Vec<Street> {
        let links = &self.links;
        let mut at = links_at(self.nodes.len(), links.iter().map(|link| link.ends));
        at.iter_mut().for_each(|here| here.retain(|link| links[*link].alive));
        let is_bend = |node: usize| at[node].len() == 2 && !keep(node);
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
                // The next corner has no room for another rounding.
                let bent = links[link].ends.iter().any(|end| is_bend(*end));
                if let Some(bow) = links[link].bow.filter(|_| !bent) {
                    via.push(bow);
                    radii.push(220.0);
                }
                node = links[link].ends[0] + links[link].ends[1] - node;
                if !is_bend(node) {
                    break;
                }
                via.push(self.nodes[node]);
                radii.push(BEND_M);
                link = at[node].iter().copied().find(|other| *other != link).unwrap_or(link);
            }
            let one = &links[first];
            let mut street = Street::new(one.place.name(), [start, node], one.profile);
            street.shape = Shape::Corners { via, radii };
            streets.push(street);
        }
        streets
    }

    /// The nodes, all with the same control.
    pub(crate) fn nodes(&self, control: Control) -> Vec<Node> {
        self.nodes.iter().map(|at| Node::new(*at, control)).collect()
    }

    /// The index of the node in this row and column.
    pub(crate) fn node(&self, row: usize, column: usize) -> usize {
        row * self.columns + column
    }
}

/// Whether no single link is the only connection between two parts. Depth-first search; each node
/// keeps the earliest node that a node behind it leads back to (Tarjan 1974).
fn two_ways_round(links: &[Link], at: &[Vec<usize>]) -> bool {
    let nodes = at.len();
    let (mut found, mut earliest) = (vec![usize::MAX; nodes], vec![usize::MAX; nodes]);
    let mut count = 1;
    (found[0], earliest[0]) = (0, 0);
    // Node, the link by which it was reached, how many of its links were visited.
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
