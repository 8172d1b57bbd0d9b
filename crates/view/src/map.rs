//! The lanes of a map, as a page draws them.

use client_lib::road::{Lane, LanePoint, Network};

use crate::message::{binary, kind};

/// The longest distance between two points of a border, metres.
const STEP_M: f64 = 2.0;

/// Returns the message of a map: of each lane its type as a bit of `road::LaneTypes` and the number of
/// its cross sections (u32 each), then of each cross section the left and the right border in driving
/// direction: x, y, x, y as f32, metres.
pub(crate) fn message(network: &Network) -> Vec<u8> {
    let mut bytes = binary(kind::MAP, 0, 0);
    for lane in network.lanes() {
        let sections = (lane.length_m / STEP_M).ceil().max(1.0) as u32 + 1;
        bytes.extend((lane.kind as u32).to_le_bytes());
        bytes.extend(sections.to_le_bytes());
        for section in 0..sections {
            let along_m = lane.length_m * f64::from(section) / f64::from(sections - 1);
            for number in borders(network, lane, along_m) {
                bytes.extend((number as f32).to_le_bytes());
            }
        }
    }
    bytes
}

fn borders(network: &Network, lane: &Lane, along_m: f64) -> [f64; 4] {
    let at = LanePoint { lane: lane.index, along_m };
    let (centre, half) = (network.place(at), 0.5 * network.width(at));
    let (left, right) = (centre.point(0.0, half, 0.0), centre.point(0.0, -half, 0.0));
    [left.x, left.y, right.x, right.y]
}
