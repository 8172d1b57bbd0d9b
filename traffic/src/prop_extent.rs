//! Where props stand on a vehicle's route.

use crate::{agents::Agents, tracks::Tracks, vehicle_table::VehicleTable};

/// Largest distance between two props that are passed at once.
const APART_M: f32 = 20.0;
/// Largest length of props that are passed at once.
const LENGTH_MAX_M: f32 = 60.0;
/// Distance up to which props are examined.
const REACH_M: f32 = 130.0;
/// Largest lateral distance of a prop from the lane.
const BESIDE_M: f32 = 8.0;
/// Clearance beside the vehicle on its lane below which a prop is in its way.
const IN_WAY_M: f32 = 0.3;

/// The stretch of a vehicle's route beside which props stand. Distances are from the vehicle's
/// origin; lateral offsets are from the lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) from_m: f32,
    pub(crate) to_m: f32,
    pub(crate) right_m: f32,
    pub(crate) left_m: f32,
}

/// Returns the extent of the prop `first` and of those behind it that are passed at once.
pub(crate) fn group(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    first: u32,
) -> Option<Extent> {
    let own = agents.driven[row] as usize;
    let half_m = agents.body[own].half_width_m + IN_WAY_M;
    let mut group = extent(vehicles, row, tracks, agents, first as usize)?;
    let mut others: Vec<Extent> = (0..agents.count())
        .filter(|&agent| agent != first as usize && agents.is_standing_prop(agent as u32))
        .filter(|&agent| {
            agents.position[agent].distance_squared(agents.position[own]) < REACH_M * REACH_M
        })
        .filter_map(|agent| extent(vehicles, row, tracks, agents, agent))
        .filter(|other| other.left_m > -half_m && other.right_m < half_m)
        .filter(|other| other.to_m > group.from_m)
        .collect();
    others.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    for other in others {
        let to_m = group.to_m.max(other.to_m);
        if other.from_m > group.to_m + APART_M || to_m - group.from_m > LENGTH_MAX_M {
            break;
        }
        group = Extent {
            from_m: group.from_m.min(other.from_m),
            to_m,
            right_m: group.right_m.min(other.right_m),
            left_m: group.left_m.max(other.left_m),
        };
    }
    Some(group)
}

/// Returns the extent of one prop; `None` if it is not beside the route.
fn extent(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    prop: usize,
) -> Option<Extent> {
    let own = agents.driven[row] as usize;
    let (body, forward) = (agents.body[prop], agents.forward[prop]);
    let middle = agents.position[prop].truncate() + forward * 0.5 * (body.front_m - body.rear_m);
    if (agents.position[prop].z - agents.position[own].z).abs() > 3.0 {
        return None;
    }
    let distance_m = middle.distance(agents.position[own].truncate());
    let mut begins_m = -vehicles[row].arc_m;
    for &lane in vehicles[row].route.lanes() {
        if begins_m > REACH_M {
            return None;
        }
        let on = tracks.project(lane, middle, distance_m - begins_m);
        if (0.0..=tracks.length(lane)).contains(&on.arc_m) && on.left_m.abs() < BESIDE_M {
            let cos = on.tangent.dot(forward).abs();
            let sin = on.tangent.perp_dot(forward).abs();
            let along_m = 0.5 * body.length_m() * cos + body.half_width_m * sin;
            let across_m = 0.5 * body.length_m() * sin + body.half_width_m * cos;
            let at_m = begins_m + on.arc_m;
            return Some(Extent {
                from_m: at_m - along_m,
                to_m: at_m + along_m,
                right_m: on.left_m - across_m,
                left_m: on.left_m + across_m,
            });
        }
        begins_m += tracks.length(lane);
    }
    None
}
