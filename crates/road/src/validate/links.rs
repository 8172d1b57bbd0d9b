//! Whether links between roads and lanes agree at both ends.

use super::{report::Report, subject::Subject};
use crate::{
    junction::JunctionKind,
    lane::Lane,
    road::{Road, RoadLink},
};

impl Subject<'_> {
    pub(super) fn links(&self, report: &mut Report) {
        for index in 0..self.network.roads.len() as u32 {
            for at_start in [true, false] {
                self.road_link(index, at_start, report);
            }
        }
        self.lane_links(report);
        self.junctions(report);
    }

    fn link(&self, road: u32, at_start: bool) -> Option<RoadLink> {
        let road = &self.network.roads[road as usize];
        if at_start { road.predecessor } else { road.successor }
    }

    fn road_link(&self, index: u32, at_start: bool, report: &mut Report) {
        let Some(RoadLink::Road { road: other, at_start: other_at_start }) =
            self.link(index, at_start)
        else {
            return;
        };
        let roads = &self.network.roads;
        let (road, next) = (&roads[index as usize], &roads[other as usize]);
        let end = |at_start: bool| if at_start { "start" } else { "end" };
        let says = |what: String| {
            format!(
                "the {} of road {} leads to the {} of road {}, {what}",
                end(at_start),
                road.id,
                end(other_at_start),
                next.id
            )
        };
        let offset = self.positions.roads[index as usize].offset;
        match self.link(other, other_at_start) {
            Some(RoadLink::Road { road: back, at_start: back_at_start })
                if (back, back_at_start) == (index, at_start) => {}
            // Connections through a junction begin where roads lead into it.
            Some(RoadLink::Junction(junction)) if road.junction == Some(junction) => {}
            // A road that joins a virtual junction does so at the side of the main road.
            _ if self.is_virtual(road) || self.is_virtual(next) => {}
            Some(RoadLink::Road { road: back, at_start: back_at_start }) => {
                let what = format!(
                    "which leads to the {} of road {}",
                    end(back_at_start),
                    roads[back as usize].id
                );
                report.error(offset, says(what));
            }
            Some(RoadLink::Junction(junction)) => {
                let junction = &self.network.junctions[junction as usize].id;
                report.error(offset, says(format!("which leads into junction {junction}")));
            }
            None => report.warn(offset, says("which has no link there".to_string())),
        }
    }

    fn is_virtual(&self, road: &Road) -> bool {
        let junction = road.junction.map(|junction| &self.network.junctions[junction as usize]);
        junction.is_some_and(|junction| junction.kind == JunctionKind::Virtual)
    }

    /// Reports lanes of which one says that it leads to the other, and the other that it leads
    /// elsewhere.
    fn lane_links(&self, report: &mut Report) {
        for lane in &self.network.lanes {
            for at_start in [true, false] {
                let Some((other, section, other_at_start)) = self.beyond(lane, at_start) else {
                    continue;
                };
                let ids = |lane: &Lane, at_start: bool| {
                    let links = &lane.declared;
                    if at_start { links.predecessors.clone() } else { links.successors.clone() }
                };
                let road = &self.network.roads[other as usize];
                for id in ids(lane, at_start) {
                    let Some(next) = self.network.lane_of(road, section, id) else { continue };
                    let next = self.network.lane(next);
                    // Links of a lane whose road leads into a junction or elsewhere do not concern
                    // this one.
                    let here = (lane.road, lane.section as usize, at_start);
                    if self.beyond(next, other_at_start) != Some(here) {
                        continue;
                    }
                    let back = ids(next, other_at_start);
                    // Several lanes may lead into one that names only one of them.
                    let disagrees = !back.is_empty()
                        && !back.contains(&lane.id)
                        && !self.merges(lane, at_start, id, &back);
                    if disagrees {
                        let own = &self.network.roads[lane.road as usize].id;
                        let reason = format!(
                            "lane {} of road {own} leads to lane {id} of road {}, which leads to \
                             lane {}",
                            lane.id, road.id, back[0]
                        );
                        report.error(lane.declared.offset, reason);
                    }
                }
            }
        }
    }

    /// Returns whether a lane beside `lane`, which `back` names, leads to lane `id` as well.
    fn merges(&self, lane: &Lane, at_start: bool, id: i32, back: &[i32]) -> bool {
        let own = &self.network.roads[lane.road as usize];
        back.iter().any(|named| {
            let named = self.network.lane_of(own, lane.section as usize, *named);
            named.is_some_and(|named| {
                let links = &self.network.lane(named).declared;
                let ids = if at_start { &links.predecessors } else { &links.successors };
                ids.contains(&id)
            })
        })
    }

    /// Returns road, section and end beyond a lane's end, if that is a single road and not a
    /// junction.
    fn beyond(&self, lane: &Lane, at_start: bool) -> Option<(u32, usize, bool)> {
        let road = &self.network.roads[lane.road as usize];
        let section = lane.section as usize;
        let inner = if at_start { section.checked_sub(1) } else { Some(section + 1) };
        if let Some(inner) = inner.filter(|inner| *inner < road.sections.len()) {
            return Some((lane.road, inner, !at_start));
        }
        match self.link(lane.road, at_start)? {
            RoadLink::Road { road, at_start } => {
                let last = self.network.roads[road as usize].sections.len() - 1;
                Some((road, if at_start { 0 } else { last }, at_start))
            }
            RoadLink::Junction(_) => None,
        }
    }

    fn junctions(&self, report: &mut Report) {
        for (junction, index) in self.network.junctions.iter().zip(0..) {
            let positions = &self.positions.junctions[index as usize];
            let id = &junction.id;
            if junction.connections.is_empty() && positions.connections.is_empty() {
                report.warn(positions.offset, format!("junction {id} has no connections"));
            }
            for connection in &junction.connections {
                let offset = connection.offset;
                let roads = &self.network.roads;
                let incoming = &roads[connection.incoming as usize];
                let way = &roads[connection.connecting as usize];
                if junction.kind == JunctionKind::Common && way.junction != Some(index) {
                    let reason = format!(
                        "junction {id} has a connection on road {}, which does not belong to it",
                        way.id
                    );
                    report.error(offset, reason);
                }
                if junction.kind != JunctionKind::Common {
                    continue;
                }
                let back = self.link(connection.connecting, connection.at_start);
                let leads_here = matches!(back, Some(RoadLink::Road { road, .. })
                    if road == connection.incoming);
                if !leads_here {
                    let end = if connection.at_start { "start" } else { "end" };
                    let reason = format!(
                        "junction {id} leads from road {} to the {end} of road {}, which does not \
                         lead back",
                        incoming.id, way.id
                    );
                    report.error(offset, reason);
                    continue;
                }
                let Some(RoadLink::Road { at_start, .. }) = back else { continue };
                let section = if at_start { 0 } else { incoming.sections.len() - 1 };
                for (from, _) in &connection.lane_links {
                    if self.network.lane_of(incoming, section, *from).is_none() {
                        let reason = format!(
                            "junction {id} leads from lane {from} of road {}, which has no such \
                             lane there",
                            incoming.id
                        );
                        report.error(offset, reason);
                    }
                }
            }
            for road in &junction.roads {
                let is_used = junction.connections.iter().any(|way| way.connecting == *road);
                if !is_used && junction.kind == JunctionKind::Common {
                    let reason = format!(
                        "road {} lies in junction {id}, but no connection uses it",
                        self.network.roads[*road as usize].id
                    );
                    report.warn(self.positions.roads[*road as usize].offset, reason);
                }
            }
        }
    }
}
