//! Neighbours of lanes, permission to change to them, and speed limits.

use crate::{
    lane::{Lane, LaneIndex, LaneTypes},
    mark::RoadMark,
    records::Records,
};

pub(super) fn connect(records: &mut Records) {
    for road in &records.roads {
        for section in &road.sections {
            for (position, index) in section.lanes.iter().enumerate() {
                let lane = &records.lanes[index.0 as usize];
                let left_of_s = position.checked_sub(1).map(|at| section.lanes[at]);
                let right_of_s = section.lanes.get(position + 1).copied();
                let (left, right) =
                    if lane.forward { (left_of_s, right_of_s) } else { (right_of_s, left_of_s) };
                let may_change_to = |other: Option<LaneIndex>| {
                    let Some(other) = other.map(|other| &records.lanes[other.0 as usize]) else {
                        return false;
                    };
                    let is_driven = |lane: &Lane| LaneTypes::DRIVABLE.contains(lane.kind);
                    if !is_driven(lane) || !is_driven(other) || lane.forward != other.forward {
                        return false;
                    }
                    let marks = between(lane, other, &section.marks);
                    marks.is_empty() || marks.iter().any(|mark| mark.allows(lane.id, other.id))
                };
                let (left_change, right_change) = (may_change_to(left), may_change_to(right));
                let speed_limit_mps = lane.speed_limit_at(0.0).or_else(|| {
                    let s = if lane.forward {
                        section.start_m
                    } else {
                        section.start_m + section.length_m
                    };
                    road.type_at(s).and_then(|kind| kind.limit_mps)
                });
                let lane = &mut records.lanes[index.0 as usize];
                (lane.left, lane.right) = (left, right);
                (lane.left_change, lane.right_change) = (left_change, right_change);
                lane.speed_limit_mps = speed_limit_mps;
            }
        }
    }
}

/// Returns the marks on the border that two neighbours share.
fn between<'a>(lane: &'a Lane, other: &'a Lane, centre: &'a [RoadMark]) -> &'a [RoadMark] {
    if (lane.id > 0) != (other.id > 0) {
        centre
    } else if lane.id.abs() < other.id.abs() {
        &lane.marks
    } else {
        &other.marks
    }
}
