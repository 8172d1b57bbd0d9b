//! A suburb: collector roads, curved residential loops between them, and cul-de-sacs.

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    junction::widen_bends,
    lattice::{Bend, lattice},
    layout::Layout,
    plan::Plan,
    relief::Ground,
    street::{Control, Node, Profile, Street},
};

const COLLECTOR: Profile = Profile::town(1, 3.5, 2.5, 50.0);
const HOME: Profile = Profile::town(1, 3.5, 2.0, 30.0);

pub(super) fn layout(plan: &Plan) -> Layout {
    let size = plan.size_m;
    let mut random = RandomStream::named(plan.seed, 0x5b0);
    let bend = Bend {
        extent: dvec2(size, size),
        center: DVec2::ZERO,
        block: 215.0,
        jitter: 10.0,
        sway: size.min(900.0) * 0.05,
        swirl: 0.25,
        bows: (0.0, 0.0, 0.0),
        thinned: 0,
    };
    let grid = lattice(&mut random, &bend, |_, _| COLLECTOR);
    let mut suburb = Suburb { nodes: grid.nodes(Control::Yield), streets: Vec::new() };
    // The side streets of each collector: the fraction of its length, and the node.
    let mut joins: Vec<Vec<(f64, usize)>> = vec![Vec::new(); grid.links.len()];
    let across = |row: usize, column: usize| row * (grid.columns - 1) + column;
    let along =
        |row: usize, column: usize| grid.rows * (grid.columns - 1) + column * (grid.rows - 1) + row;
    for row in 0..grid.rows - 1 {
        for column in 0..grid.columns - 1 {
            let corner = |up: usize, right: usize| grid.nodes[grid.node(row + up, column + right)];
            let quad = Quad([corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)]);
            let (south, west) = (across(row, column), along(row, column));
            suburb.fill(&mut random, &quad, &mut joins, south, west);
        }
    }
    for (link, mut on) in grid.links.iter().zip(joins) {
        on.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut from = link.ends[0];
        let ends = on.iter().map(|(_, node)| *node).chain([link.ends[1]]);
        for to in ends {
            suburb.streets.push(Street::new(link.place.name(), [from, to], COLLECTOR));
            from = to;
        }
    }
    suburb.drop_bends(grid.nodes.len());
    let Suburb { nodes, streets } = suburb;
    let ground = Ground::new(plan, size, &nodes, &streets);
    let mut layout = Layout { nodes, streets, ground };
    widen_bends(&mut layout);
    layout
}

/// A block between four collectors; corners south-west, south-east, north-west, north-east.
struct Quad([DVec2; 4]);

impl Quad {
    fn at(&self, x: f64, y: f64) -> DVec2 {
        let [sw, se, nw, ne] = self.0;
        sw.lerp(se, x).lerp(nw.lerp(ne, x), y)
    }
}

struct Suburb {
    nodes: Vec<Node>,
    streets: Vec<Street>,
}

impl Suburb {
    fn node(&mut self, position: DVec2, control: Control) -> usize {
        self.nodes.push(Node::new(position, control));
        self.nodes.len() - 1
    }

    fn home(&mut self, name: &str, ends: [usize; 2], via: Vec<DVec2>) {
        self.streets.push(Street::new(name.to_string(), ends, HOME).over(via, 45.0));
    }

    /// Adds the streets of a block, joined to the collectors on its south and west sides.
    fn fill(
        &mut self,
        random: &mut RandomStream,
        quad: &Quad,
        joins: &mut [Vec<(f64, usize)>],
        south: usize,
        west: usize,
    ) {
        let jig = |random: &mut RandomStream| f64::from(random.between(-0.03, 0.03));
        if random.chance(0.5) {
            // A crescent from the south, a cul-de-sac from the west.
            let (a, b) = (0.22 + jig(random), 0.78 + jig(random));
            let start = self.node(quad.at(a, 0.0), Control::Yield);
            let end = self.node(quad.at(b, 0.0), Control::Yield);
            joins[south].extend([(a, start), (b, end)]);
            let high = 0.44 + jig(random);
            let middle = self.node(quad.at(0.5, high), Control::Yield);
            self.home("Crescent", [start, middle], vec![quad.at(a, high * 0.9)]);
            self.home("Crescent", [middle, end], vec![quad.at(b, high * 0.9)]);
            let close = self.node(quad.at(0.52, 0.44 + 0.34), Control::Turning);
            self.home("Close", [middle, close], Vec::new());
            if random.chance(0.6) {
                let up = 0.72 + jig(random);
                let start = self.node(quad.at(0.0, up), Control::Yield);
                joins[west].push((up, start));
                let close = self.node(quad.at(0.26, up), Control::Turning);
                self.home("Court", [start, close], Vec::new());
            }
        } else {
            // A street round the corner, with a cul-de-sac at its bend.
            let (a, b) = (0.52 + jig(random), 0.5 + jig(random));
            let start = self.node(quad.at(a, 0.0), Control::Yield);
            let end = self.node(quad.at(0.0, b), Control::Yield);
            joins[south].push((a, start));
            joins[west].push((b, end));
            let bend = self.node(quad.at(0.45, 0.43), Control::Yield);
            self.home("Drive", [start, bend], vec![quad.at(a, 0.2)]);
            self.home("Drive", [bend, end], vec![quad.at(0.2, b)]);
            let close = self.node(quad.at(0.74, 0.72), Control::Turning);
            self.home("Close", [bend, close], vec![quad.at(0.58, 0.62)]);
        }
    }

    /// Joins the two collectors at a corner of the town that has no third.
    fn drop_bends(&mut self, corners: usize) {
        for node in 0..corners {
            let here: Vec<usize> =
                (0..self.streets.len()).filter(|k| self.streets[*k].ends.contains(&node)).collect();
            let [a, b] = here[..] else { continue };
            let far = |street: &Street| street.ends[0] + street.ends[1] - node;
            let ends = [far(&self.streets[a]), far(&self.streets[b])];
            let via = vec![self.nodes[node].position];
            let name = self.streets[a].name.clone();
            self.streets[a] = Street::new(name, ends, COLLECTOR).over(via, 50.0);
            self.streets.swap_remove(b);
        }
    }
}
