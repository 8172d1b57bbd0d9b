//! Lane links: which lane continues which.

use std::collections::HashMap;

use super::findings::Findings;
use crate::{
    junction::{Junction, JunctionKind},
    lane::LaneIndex,
    records::{RawLink, Records},
    road::RoadLink,
};

/// One end of a lane along s.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct LaneEnd {
    lane: LaneIndex,
    at_start: bool,
}

pub(super) fn join(
    records: &mut Records,
    road_ids: &HashMap<String, u32>,
    junctions: &[Junction],
    findings: &mut Findings,
) {
    let junction_ids: HashMap<&str, u32> =
        junctions.iter().zip(0..).map(|(junction, index)| (&*junction.id, index)).collect();
    for index in 0..records.roads.len() {
        let extra = &records.road_extras[index];
        let mut resolve = |link: &Option<RawLink>| {
            let link = link.as_ref()?;
            let found = if link.junction {
                junction_ids.get(link.id.as_str()).map(|index| RoadLink::Junction(*index))
            } else {
                let road = road_ids.get(&link.id);
                road.map(|road| RoadLink::Road { road: *road, at_start: link.at_start })
            };
            if found.is_none() {
                let kind = if link.junction { "junction" } else { "road" };
                let id = &records.roads[index].id;
                findings.add(
                    extra.offset,
                    format!("road {id} leads to {kind} {}, which does not exist", link.id),
                );
            }
            found
        };
        let (predecessor, successor) = (resolve(&extra.predecessor), resolve(&extra.successor));
        records.roads[index].predecessor = predecessor;
        records.roads[index].successor = successor;
    }
    let declared = declared(records, junctions, findings);
    connect(records, &declared);
}

/// Returns every pair of lane ends that the file declares to be connected, each from the lane that
/// declares it.
fn declared(
    records: &Records,
    junctions: &[Junction],
    findings: &mut Findings,
) -> Vec<(LaneEnd, LaneEnd)> {
    let mut pairs = Vec::new();
    // Connections from each road's end into a junction: incoming road, junction, index of the
    // connection.
    let mut ways: Vec<(u32, u32, usize)> = Vec::new();
    for (junction, index) in junctions.iter().zip(0..) {
        let incoming = |(way, connection): (usize, &crate::junction::Connection)| {
            (connection.incoming, index, way)
        };
        ways.extend(junction.connections.iter().enumerate().map(incoming));
    }
    ways.sort_unstable();
    let find = |road: u32, section: usize, id: i32| {
        let section = records.roads[road as usize].sections.get(section)?;
        section.lanes.iter().copied().find(|lane| records.lanes[lane.0 as usize].id == id)
    };
    for lane in &records.lanes {
        let road = &records.roads[lane.road as usize];
        let section = lane.section as usize;
        for at_start in [true, false] {
            let here = LaneEnd { lane: lane.index, at_start };
            let ids =
                if at_start { &lane.declared.predecessors } else { &lane.declared.successors };
            let inner = if at_start { section.checked_sub(1) } else { Some(section + 1) };
            let inner = inner.filter(|section| *section < road.sections.len());
            let link = if at_start { road.predecessor } else { road.successor };
            let (other_road, other_section, other_at_start) = match (inner, link) {
                (Some(section), _) => (lane.road, section, !at_start),
                (None, Some(RoadLink::Road { road, at_start })) => {
                    let sections = records.roads[road as usize].sections.len();
                    (road, if at_start { 0 } else { sections - 1 }, at_start)
                }
                (None, Some(RoadLink::Junction(junction))) => {
                    let first = ways.partition_point(|way| (way.0, way.1) < (lane.road, junction));
                    let through = ways[first..].iter();
                    for way in through.take_while(|way| (way.0, way.1) == (lane.road, junction)) {
                        let connection = &junctions[junction as usize].connections[way.2];
                        let sections = records.roads[connection.connecting as usize].sections.len();
                        let section = if connection.at_start { 0 } else { sections - 1 };
                        for (from, to) in &connection.lane_links {
                            if *from != lane.id {
                                continue;
                            }
                            match find(connection.connecting, section, *to) {
                                Some(other) => pairs.push((
                                    here,
                                    LaneEnd { lane: other, at_start: connection.at_start },
                                )),
                                None => findings.add(
                                    lane.declared.offset,
                                    no_such_lane(
                                        records,
                                        lane.index,
                                        *to,
                                        connection.connecting,
                                        section,
                                    ),
                                ),
                            }
                        }
                    }
                    continue;
                }
                (None, None) => continue,
            };
            for id in ids {
                match find(other_road, other_section, *id) {
                    Some(other) => {
                        pairs.push((here, LaneEnd { lane: other, at_start: other_at_start }));
                    }
                    None => findings.add(
                        lane.declared.offset,
                        no_such_lane(records, lane.index, *id, other_road, other_section),
                    ),
                }
            }
        }
    }
    // A direct junction may declare its connections from one side only; they hold for both.
    for junction in junctions.iter().filter(|junction| junction.kind == JunctionKind::Direct) {
        let ids = |road: u32, at_start: bool| {
            let sections = records.roads[road as usize].sections.len();
            move |id: i32| {
                let lane = find(road, if at_start { 0 } else { sections - 1 }, id)?;
                Some(LaneEnd { lane, at_start })
            }
        };
        for connection in &junction.connections {
            let incoming = &records.roads[connection.incoming as usize];
            let at_start = matches!(incoming.predecessor, Some(RoadLink::Junction(index))
                if std::ptr::eq(&junctions[index as usize], junction));
            for (from, to) in &connection.lane_links {
                let from = ids(connection.incoming, at_start)(*from);
                let to = ids(connection.connecting, connection.at_start)(*to);
                if let (Some(from), Some(to)) = (from, to) {
                    pairs.push((to, from));
                }
            }
        }
    }
    pairs
}

fn no_such_lane(records: &Records, lane: LaneIndex, id: i32, road: u32, section: usize) -> String {
    let lane = &records.lanes[lane.0 as usize];
    let own = &records.roads[lane.road as usize].id;
    let other = &records.roads[road as usize];
    let mut ids: Vec<i32> = Vec::new();
    if let Some(section) = other.sections.get(section) {
        ids.extend(section.lanes.iter().map(|lane| records.lanes[lane.0 as usize].id));
    }
    let has = match (ids.iter().min(), ids.iter().max()) {
        (Some(low), Some(high)) => format!("has lanes {low} to {high}"),
        _ => "has no lanes".to_string(),
    };
    format!("lane {} of road {own} leads to lane {id}, but road {} {has}", lane.id, other.id)
}

/// Converts connected ends into successors and predecessors in driving direction.
fn connect(records: &mut Records, declared: &[(LaneEnd, LaneEnd)]) {
    let exit = |records: &Records, end: &LaneEnd| {
        records.lanes[end.lane.0 as usize].forward != end.at_start
    };
    let mut forward: Vec<(LaneIndex, LaneIndex)> = Vec::new();
    let mut backward: Vec<(LaneIndex, LaneIndex)> = Vec::new();
    for (here, other) in declared {
        match (exit(records, here), exit(records, other)) {
            (true, false) => forward.push((here.lane, other.lane)),
            (false, true) => backward.push((other.lane, here.lane)),
            // Both lanes lead away from here, or both towards it: no connection for traffic.
            _ => {}
        }
    }
    for (from, to) in &forward {
        let successors = &mut records.lanes[from.0 as usize].successors;
        if !successors.contains(to) {
            successors.push(*to);
        }
    }
    // A link that only the following lane declares counts if the preceding lane declares none.
    let silent: Vec<bool> = records.lanes.iter().map(|lane| lane.successors.is_empty()).collect();
    for (from, to) in &backward {
        let successors = &mut records.lanes[from.0 as usize].successors;
        if silent[from.0 as usize] && !successors.contains(to) {
            successors.push(*to);
        }
    }
    for index in 0..records.lanes.len() {
        for next in records.lanes[index].successors.clone() {
            records.lanes[next.0 as usize].predecessors.push(LaneIndex(index as u32));
        }
    }
}
