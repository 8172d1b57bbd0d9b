//! Rolling ground.

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    plan::Plan,
    street::{Node, Street},
};

/// The greatest mean slope of a street; the slope in its middle is 1.5 times as much.
const CLIMB: f64 = 0.045;
/// The greatest slope of the ground where roads follow it.
const ROLL: f64 = 0.05;

/// The height of the ground: a sum of waves in three directions. Metres.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    phase: [f64; 3],
    size: f64,
    scale: f64,
}

impl Ground {
    /// Returns ground with the relief of the plan, limited to slopes that streets can have.
    pub(crate) fn new(plan: &Plan, size: f64, nodes: &[Node], streets: &[Street]) -> Ground {
        let mut random = RandomStream::named(plan.seed, 0x4e1);
        let phase = [0; 3].map(|_: i32| f64::from(random.between(0.0, std::f32::consts::TAU)));
        let mut ground = Ground { phase, size, scale: 1.0 };
        let mut steepest = streets
            .iter()
            .map(|street| {
                let [a, b] = street.ends.map(|end| &nodes[end]);
                let high = |node: &Node| ground.height(node.level_with.unwrap_or(node.position));
                (high(a) - high(b)).abs() / (a.position.distance(b.position) - 30.0).max(20.0)
            })
            .fold(1e-9, f64::max);
        if streets.iter().any(|street| street.follows_ground) {
            let places = nodes.iter().map(|node| node.position);
            let (low, high) = places
                .fold((DVec2::MAX, DVec2::MIN), |(low, high), at| (low.min(at), high.max(at)));
            for step in 0..40 * 40 {
                let fraction = dvec2(f64::from(step % 40), f64::from(step / 40)) / 39.0;
                let at = low + (high - low) * fraction;
                let rise = |along: DVec2| ground.height(at + along) - ground.height(at - along);
                let slope = dvec2(rise(DVec2::X), rise(DVec2::Y)).length() * 0.5;
                steepest = steepest.max(slope * CLIMB / ROLL);
            }
        }
        ground.scale = plan.relief_m.max(0.0).min(CLIMB / steepest);
        ground
    }

    /// The height at a position. Metres.
    pub(crate) fn height(&self, at: DVec2) -> f64 {
        let (p, phase) = (at / self.size, &self.phase);
        let wave = (p.x * 3.1 + phase[0]).sin()
            + (p.y * 3.9 + phase[1]).sin()
            + 0.5 * ((p.x - p.y) * 6.0 + phase[2]).sin();
        (wave / 5.0 + 0.5) * self.scale
    }
}
