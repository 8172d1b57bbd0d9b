//! From records to a network: ids become indices, lanes get their neighbours.

mod findings;
mod links;
mod neighbours;
mod scenery;

use std::collections::HashMap;

use glam::DVec3;

use crate::{
    MapError,
    contradictions::Contradictions,
    grid::{LaneIndexGrid, SLACK_M, Segment},
    index::lane_grid,
    junction::{Connection, Joint, Junction, JunctionGroup},
    lane::LaneIndex,
    network::Network,
    parallel::threads,
    parse,
    records::{RawController, RawGroup, RawJunction, Records},
    signal::Controller,
    xml::line_of,
};
use findings::Findings;

/// Roads farther from the file's origin than this get a local origin, metres: f32 still resolves 2
/// mm at this distance.
const FAR_M: f64 = 20_000.0;

/// Longer maps are errors in the file, metres: the streets of a metropolis.
const TOTAL_MAX_M: f64 = 5e6;

/// Wider maps are errors in the file, metres: what is built around the roads grows with the area.
const SPAN_MAX_M: f64 = 2e5;

/// Higher maps are errors in the file, metres: more than from the sea to the highest mountain.
const HEIGHT_MAX_M: f64 = 1e4;

/// Wider lanes are errors in the file, metres: a polynomial that grows without bound.
const WIDTH_MAX_M: f64 = 200.0;

impl Network {
    /// Parses an OpenDRIVE text.
    ///
    /// # Errors
    ///
    /// Returns the first error that makes the file unusable, with its line. Contradictions that can
    /// be worked around are in [`Network::findings`].
    pub fn parse(xml: &str) -> Result<Network, MapError> {
        // A broken file may have any number of findings; a simulation needs only the first ones.
        built(xml, 1000, threads())
    }
}

/// Parses a text on up to `threads` threads; the result does not depend on their number.
pub(crate) fn built(text: &str, findings_max: usize, threads: usize) -> Result<Network, MapError> {
    let mut records = parse::records(text, threads)?;
    let mut findings = Findings::new(findings_max);
    let road_ids = unique_roads(&records, text)?;
    let origin = local_origin(&mut records);
    for (road, extra) in records.roads.iter().zip(&records.road_extras) {
        if let Some(declared) = extra.too_long {
            let (id, end) = (&road.id, road.length_m);
            let reason = format!("road {id} is {declared} m long, but its geometry ends at {end}");
            findings.add(extra.offset, reason);
        }
        if let Some(start) = extra.sections_beyond {
            let (id, end) = (&road.id, road.length_m);
            let reason = format!(
                "a lane section of road {id} begins at s {start}, but the road ends at {end}; \
                 the section is left out"
            );
            findings.add(extra.offset, reason);
        }
    }
    let total_m: f64 = records.roads.iter().map(|road| road.length_m).sum();
    if total_m > TOTAL_MAX_M {
        let reason = format!(
            "all roads together are {total_m:.0} m long; at most {TOTAL_MAX_M:.0} m are allowed"
        );
        return Err(MapError { line: 1, reason });
    }
    let junctions = junctions(&mut records, &road_ids, &mut findings);
    links::join(&mut records, &road_ids, &junctions, &mut findings);
    neighbours::connect(&mut records);
    let mut network = Network {
        header: records.header,
        origin,
        lanes: records.lanes,
        roads: records.roads,
        junctions,
        signals: records.signals,
        controllers: Vec::new(),
        objects: records.objects,
        spans: records.spans,
        object_references: Vec::new(),
        junction_groups: Vec::new(),
        user_data: records.user_data,
        uses: Vec::new(),
        findings: Vec::new(),
        grid: LaneIndexGrid::default(),
        bounds: (DVec3::ZERO, DVec3::ZERO),
        contradictions: Contradictions::default(),
    };
    scenery::resolve_signal_references(&mut network, records.references, &mut findings);
    scenery::resolve_object_references(&mut network, records.object_references, &mut findings);
    group(&mut network, records.groups, &mut findings);
    for (file, offset) in records.includes {
        let reason = format!(
            "unsupported <include> of \"{file}\"; insert its text here, because only one file is read"
        );
        findings.add(offset, reason);
    }
    control(&mut network, &records.controllers, &records.junctions, &mut findings);
    scenery::compute_poses(&mut network);
    network.uses = network.sorted_uses();
    network.grid = lane_grid(&network, threads);
    network.bounds = network.grid.bounds().unwrap_or_default();
    if let Some((road, reason)) = too_large(&network) {
        let line = road.map_or(1, |road| line_of(text, records.road_extras[road].offset));
        return Err(MapError { line, reason });
    }
    network.findings = findings.with_lines(text);
    Ok(network)
}

/// Says which lane, or which size of the map, no road has. What is built around the roads grows with
/// them, and a polynomial with a wrong coefficient is kilometres wide or high after a few metres.
fn too_large(network: &Network) -> Option<(Option<usize>, String)> {
    // Half of the width, without what is added for bends.
    let half_m = |segment: &Segment| segment.outside_m - segment.sag_m - SLACK_M as f32;
    let mut segments = network.grid.segments.iter();
    if let Some(segment) = segments.find(|segment| half_m(segment) > 0.5 * WIDTH_MAX_M as f32) {
        let lane = network.lane(LaneIndex(segment.lane));
        let road = &network.roads()[lane.road as usize];
        let (id, start_m) = (lane.id, road.sections[lane.section as usize].start_m);
        let width_m = 2.0 * half_m(segment);
        let reason = format!(
            "lane {id} of the section at s {start_m} of road {} becomes {width_m:.0} m wide; at \
             most {WIDTH_MAX_M:.0} m are allowed; are its <width> coefficients right?",
            road.id
        );
        return Some((Some(lane.road as usize), reason));
    }
    let (low, high) = network.bounds;
    let (span_m, height_m) = ((high - low).truncate().max_element(), high.z - low.z);
    if span_m > SPAN_MAX_M {
        let reason = format!(
            "the lanes of the map span {span_m:.0} m; at most {SPAN_MAX_M:.0} m are allowed"
        );
        return Some((None, reason));
    }
    (height_m > HEIGHT_MAX_M).then(|| {
        let reason = format!(
            "the highest lane of the map is {height_m:.0} m above the lowest one; at most \
             {HEIGHT_MAX_M:.0} m are allowed; are the <elevation> coefficients right?"
        );
        (None, reason)
    })
}

fn unique_roads(records: &Records, text: &str) -> Result<HashMap<String, u32>, MapError> {
    let mut ids = HashMap::with_capacity(records.roads.len());
    for (index, road) in records.roads.iter().enumerate() {
        if let Some(other) = ids.insert(road.id.clone(), index as u32) {
            let line = line_of(text, records.road_extras[index].offset);
            let first = line_of(text, records.road_extras[other as usize].offset);
            let id = &road.id;
            return Err(MapError {
                line,
                reason: format!(
                    "duplicate road id {id}; the first road with it begins on line {first}"
                ),
            });
        }
    }
    Ok(ids)
}

/// Moves distant roads to a local origin and returns its position in the file's coordinates.
fn local_origin(records: &mut Records) -> DVec3 {
    let starts = records.roads.iter().flat_map(|road| &road.curves).map(|curve| curve.start());
    let (mut low, mut high) = (glam::DVec2::INFINITY, glam::DVec2::NEG_INFINITY);
    for start in starts {
        low = low.min(start);
        high = high.max(start);
    }
    if low.abs().max(high.abs()).max_element() <= FAR_M {
        return DVec3::ZERO;
    }
    let middle = ((low + high) * 0.5 / 100.0).round() * 100.0;
    for curve in records.roads.iter_mut().flat_map(|road| &mut road.curves) {
        curve.shift(-middle);
    }
    middle.extend(0.0)
}

fn junctions(
    records: &mut Records,
    road_ids: &HashMap<String, u32>,
    findings: &mut Findings,
) -> Vec<Junction> {
    let ids: HashMap<&str, u32> =
        records.junctions.iter().zip(0..).map(|(junction, index)| (&*junction.id, index)).collect();
    let mut junctions = Vec::new();
    let joint = |raw: &Option<(String, f64, bool)>| {
        let (id, s, forward) = raw.as_ref()?;
        Some(Joint { road: *road_ids.get(id)?, s: *s, forward: *forward })
    };
    for raw in &records.junctions {
        let mut connections = Vec::new();
        for connection in &raw.connections {
            let (incoming, connecting) =
                (road_ids.get(&connection.incoming), road_ids.get(&connection.connecting));
            if let (Some(&incoming), Some(&connecting)) = (incoming, connecting) {
                connections.push(Connection {
                    incoming,
                    connecting,
                    at_start: connection.at_start,
                    lane_links: connection.lane_links.clone(),
                    predecessor: joint(&connection.predecessor),
                    successor: joint(&connection.successor),
                    offset: connection.offset,
                });
            } else {
                findings.add(
                    connection.offset,
                    format!(
                        "junction {} connects road \"{}\" to road \"{}\", of which at least one does not exist",
                        raw.id, connection.incoming, connection.connecting
                    ),
                );
            }
        }
        let priorities = raw.priorities.iter().filter_map(|(high, low)| {
            Some((*road_ids.get(high.as_str())?, *road_ids.get(low.as_str())?))
        });
        junctions.push(Junction {
            id: raw.id.clone(),
            name: raw.name.clone(),
            kind: raw.kind,
            connections,
            roads: Vec::new(),
            controllers: Vec::new(),
            priorities: priorities.collect(),
        });
    }
    for (index, extra) in records.road_extras.iter().enumerate() {
        let Some(id) = &extra.junction else { continue };
        match ids.get(id.as_str()) {
            Some(&junction) => {
                records.roads[index].junction = Some(junction);
                junctions[junction as usize].roads.push(index as u32);
            }
            None => findings.add(
                extra.offset,
                format!(
                    "road {} lies in junction {id}, which does not exist",
                    records.roads[index].id
                ),
            ),
        }
    }
    for lane in &mut records.lanes {
        lane.junction = records.roads[lane.road as usize].junction;
    }
    junctions
}

fn group(network: &mut Network, groups: Vec<RawGroup>, findings: &mut Findings) {
    for raw in groups {
        let mut junctions = Vec::new();
        for id in &raw.junctions {
            match network.junctions.iter().position(|junction| junction.id == *id) {
                Some(junction) => junctions.push(junction as u32),
                None => findings.add(
                    raw.offset,
                    format!(
                        "junction group {} refers to junction {id}, which does not exist",
                        raw.id
                    ),
                ),
            }
        }
        let RawGroup { id, name, kind, .. } = raw;
        network.junction_groups.push(JunctionGroup { id, name, kind, junctions });
    }
}

fn control(
    network: &mut Network,
    raw: &[RawController],
    junctions: &[RawJunction],
    findings: &mut Findings,
) {
    let signals: HashMap<String, u32> =
        network.signals.iter().zip(0..).map(|(signal, index)| (signal.id.clone(), index)).collect();
    for (controller, index) in raw.iter().zip(0..) {
        let mut signals_of_controller: Vec<u32> = Vec::new();
        for id in &controller.signals {
            let Some(&signal) = signals.get(id) else {
                let reason = format!(
                    "controller {} refers to signal {id}, which does not exist",
                    controller.id
                );
                findings.add(controller.offset, reason);
                continue;
            };
            if !signals_of_controller.contains(&signal) {
                signals_of_controller.push(signal);
                network.signals[signal as usize].controller.get_or_insert(index);
            }
        }
        network.controllers.push(Controller {
            id: controller.id.clone(),
            name: controller.name.clone(),
            sequence: controller.sequence,
            signals: signals_of_controller,
        });
    }
    let ids: HashMap<&str, u32> =
        raw.iter().zip(0..).map(|(controller, index)| (&*controller.id, index)).collect();
    for (junction, raw) in network.junctions.iter_mut().zip(junctions) {
        for id in &raw.controllers {
            match ids.get(id.as_str()) {
                Some(controller) => junction.controllers.push(*controller),
                None => findings.add(
                    raw.offset,
                    format!("junction {} refers to controller {id}, which does not exist", raw.id),
                ),
            }
        }
    }
}
