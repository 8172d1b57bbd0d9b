//! Frontages: the outer edges of roads, along which buildings stand.

use glam::{DVec3, Vec2};
use road::{LaneType, LaneTypes, Network};

/// The distance between two stations of a frontage. Metres.
pub(super) const STEP_M: f32 = 2.0;

/// A point on the outer edge of a road.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// The position on the edge.
    pub(super) edge: Vec2,
    /// The direction away from the road.
    pub(super) out: Vec2,
    /// The distance from the kerb to the edge; 0 without a sidewalk. Metres.
    pub(super) walk_m: f32,
    /// The speed limit. Metres per second.
    pub(super) limit_mps: f32,
}

/// One side of a road outside junctions, in the direction of s.
pub(super) type Frontage = Vec<Station>;

/// Returns every frontage, in the order of roads; the right side of each road comes first.
pub(super) fn frontages(network: &Network) -> Vec<Frontage> {
    let mut all = Vec::new();
    for road in network.roads().iter().filter(|road| road.junction.is_none()) {
        for right in [true, false] {
            let mut frontage = Vec::new();
            for section in &road.sections {
                let lanes = section.lanes.iter().map(|lane| network.lane(*lane));
                // From the middle outwards.
                let mut side: Vec<_> = lanes.filter(|lane| (lane.id < 0) == right).collect();
                side.sort_by_key(|lane| lane.id.abs());
                let Some(outer) = side.last() else { continue };
                let walk = side.iter().rev().find(|lane| lane.kind == LaneType::Sidewalk);
                let limit = side
                    .iter()
                    .filter(|lane| LaneTypes::DRIVABLE.contains(lane.kind))
                    .find_map(|lane| lane.speed_limit_mps)
                    .unwrap_or(14.0) as f32;
                let count = (outer.length_m as f32 / STEP_M).ceil().max(1.0) as usize;
                for step in 0..count {
                    let s = outer.length_m * (step as f64 + 0.5) / count as f64;
                    let along_m = if outer.forward { s } else { outer.length_m - s };
                    let at = road::LanePoint { lane: outer.index, along_m };
                    let middle = network.place(at);
                    // The outer side is on the right of traffic in the direction of s on the right
                    // side.
                    let to_right = outer.forward == right;
                    let out = middle.heading_rad
                        + if to_right {
                            -std::f64::consts::FRAC_PI_2
                        } else {
                            std::f64::consts::FRAC_PI_2
                        };
                    let out = DVec3::new(out.cos(), out.sin(), 0.0);
                    let edge = middle.position + out * network.width(at) * 0.5;
                    let walk_m = walk.map_or(0.0, |walk| {
                        network.width(road::LanePoint { lane: walk.index, along_m }) as f32
                    });
                    frontage.push(Station {
                        edge: edge.truncate().as_vec2(),
                        out: out.truncate().as_vec2(),
                        walk_m,
                        limit_mps: limit,
                    });
                }
            }
            if frontage.len() > 1 {
                all.push(frontage);
            }
        }
    }
    all
}
