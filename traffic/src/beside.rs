//! What lies beside the lanes: oncoming lanes and shoulders.

use road::{Lane, LaneIndex, LanePoint, LaneTypes, Network};

use crate::tracks::{NONE, Tracks};

/// Lanes beside the driving lanes that a vehicle may use to pass a prop.
const SHOULDERS: LaneTypes =
    LaneTypes(LaneTypes::SHOULDER.0 | LaneTypes::STOP.0 | LaneTypes::PARKING.0);

/// What lies beside each lane, by lane.
pub(crate) struct Beside {
    /// The adjacent oncoming lane, or [`NONE`].
    pub(crate) oncoming: Vec<u32>,
    /// Whether the markings allow vehicles to pass on the oncoming lane.
    pub(crate) may_cross: Vec<bool>,
    /// Least widths of the shoulders to the left and to the right, metres.
    pub(crate) shoulders_m: Vec<[f32; 2]>,
}

impl Beside {
    /// Reads the neighbours of every lane with a track.
    pub(crate) fn new(network: &Network, tracks: &Tracks) -> Beside {
        let lanes = network.lanes();
        let mut beside = Beside {
            oncoming: vec![NONE; lanes.len()],
            may_cross: vec![false; lanes.len()],
            shoulders_m: vec![[0.0; 2]; lanes.len()],
        };
        for lane in lanes.iter().filter(|lane| tracks.has(lane.index.0)) {
            let at = lane.index.0 as usize;
            let side = tracks.oncoming[at];
            let oncoming = if side > 0.0 { lane.left } else { lane.right };
            if let Some(oncoming) = oncoming.filter(|lane| side != 0.0 && tracks.has(lane.0)) {
                let middle = LanePoint { lane: lane.index, along_m: 0.5 * lane.length_m };
                let marks = network.marks(middle);
                beside.oncoming[at] = oncoming.0;
                beside.may_cross[at] =
                    if side > 0.0 { marks.left_change } else { marks.right_change };
            }
            beside.shoulders_m[at] =
                [lane.left, lane.right].map(|side| width_m(network, lane, side));
        }
        beside
    }
}

/// Returns the least width of a shoulder beside `lane`; 0 if `side` is none.
fn width_m(network: &Network, lane: &Lane, side: Option<LaneIndex>) -> f32 {
    let is_shoulder = |side: &LaneIndex| SHOULDERS.contains(network.lane(*side).kind);
    let Some(side) = side.filter(is_shoulder) else { return 0.0 };
    let width_at = |part: f64| {
        network.width(LanePoint { lane: side, along_m: part * lane.length_m }).max(0.0) as f32
    };
    [0.05, 0.25, 0.5, 0.75, 0.95].into_iter().map(width_at).fold(f32::INFINITY, f32::min)
}
