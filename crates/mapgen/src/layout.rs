//! A whole plan of streets on its ground.

use crate::{
    curve::{self, Piece},
    relief::Ground,
    street::{Node, Street},
};

/// Half the length of the level top of a hump. Metres.
const HUMP_FLAT_M: f64 = 40.0;

/// A whole plan: nodes, streets and the ground below them.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) nodes: Vec<Node>,
    pub(crate) streets: Vec<Street>,
    pub(crate) ground: Ground,
}

impl Layout {
    /// The height of a node. Metres.
    pub(crate) fn height(&self, node: usize) -> f64 {
        let node = &self.nodes[node];
        self.ground.height(node.level_with.unwrap_or(node.position)) + node.lift
    }

    /// The elevation of a street along its reference line: distance, height and slope at each knot.
    pub(crate) fn heights(&self, street: &Street, line: &[Piece]) -> Vec<[f64; 3]> {
        let length = curve::length(line);
        let ends = street.ends.map(|end| self.height(end));
        let count =
            if street.follows_ground { (length / 45.0).round().max(1.0) as usize } else { 1 };
        let step = length / count as f64;
        let high = |k: usize| match k {
            0 => ends[0],
            k if k == count => ends[1],
            k => {
                let place = curve::at(line, k as f64 * step).position;
                let hump = street.hump.map_or(0.0, |(at, high, reach)| {
                    let away = (k as f64 * step - at).abs() - HUMP_FLAT_M;
                    let near = (1.0 - away.max(0.0) / reach).clamp(0.0, 1.0);
                    high * near * near * (3.0 - 2.0 * near)
                });
                self.ground.height(place) + hump
            }
        };
        let knots = (0..=count).map(|k| {
            let inner = k > 0 && k < count;
            let slope = if inner { (high(k + 1) - high(k - 1)) / (2.0 * step) } else { 0.0 };
            [k as f64 * step, high(k), slope]
        });
        knots.collect()
    }
}
