//! Poses of signals and objects, and the lanes that signals apply to.

use std::{collections::HashMap, f64::consts::PI};

use glam::{DVec2, DVec3};

use super::findings::Findings;
use crate::{
    cubic::Jet,
    lane::{LaneIndex, LaneTypes},
    network::Network,
    object::{Corner, ObjectPlace, ObjectReference, Repeat, RoadObject},
    place::Lateral,
    placement::{Placement, wrapped},
    records::{RawObjectReference, RawReference},
    signal::{Orientation, Signal, SignalPosition, SignalUse},
};

/// Adds the signal references to the signals that they name.
pub(super) fn resolve_signal_references(
    network: &mut Network,
    references: Vec<RawReference>,
    findings: &mut Findings,
) {
    let ids: HashMap<String, usize> = network
        .signals
        .iter()
        .enumerate()
        .map(|(index, signal)| (signal.id.clone(), index))
        .collect();
    for signal in &mut network.signals {
        for rules in &mut signal.uses {
            rules.s = rules.s.clamp(0.0, network.roads[rules.road as usize].length_m);
        }
    }
    for mut reference in references {
        let road = &network.roads[reference.rules.road as usize];
        reference.rules.s = reference.rules.s.clamp(0.0, road.length_m);
        match ids.get(&reference.signal) {
            Some(&signal) => network.signals[signal].uses.push(reference.rules),
            None => findings.add(
                reference.offset,
                format!(
                    "road {} refers to signal {}, which does not exist",
                    network.roads[reference.rules.road as usize].id, reference.signal
                ),
            ),
        }
    }
}

/// Resolves the objects that object references name.
pub(super) fn resolve_object_references(
    network: &mut Network,
    references: Vec<RawObjectReference>,
    findings: &mut Findings,
) {
    if references.is_empty() {
        return;
    }
    let objects = network.objects.iter().zip(0..);
    let ids: HashMap<String, u32> =
        objects.map(|(object, index)| (object.id.clone(), index)).collect();
    for RawObjectReference { id, offset, reference } in references {
        match ids.get(&id) {
            Some(&object) => {
                network.object_references.push(ObjectReference { object, ..reference });
            }
            None => {
                let road = &network.roads[reference.road as usize].id;
                let reason = format!("road {road} refers to object {id}, which does not exist");
                findings.add(offset, reason);
            }
        }
    }
}

/// Computes the poses of signals and objects in world space.
pub(super) fn compute_poses(network: &mut Network) {
    for index in 0..network.signals.len() {
        let signal = &network.signals[index];
        let mut pose = signal_pose(network, signal);
        // A signal faces the traffic that it applies to.
        let turn = if signal.orientation == Orientation::Forward { PI } else { 0.0 };
        pose.heading_rad = wrapped(pose.heading_rad + turn);
        pose.pitch_rad = signal.pitch_rad;
        pose.roll_rad = signal.roll_rad;
        let mut lanes: Vec<(LaneIndex, f64)> = Vec::new();
        for rules in &signal.uses {
            for lane in lanes_of_use(network, rules) {
                if !lanes.iter().any(|(known, _)| *known == lane.0) {
                    lanes.push(lane);
                }
            }
        }
        if faces_away(network, &pose, &lanes) {
            pose.heading_rad = wrapped(pose.heading_rad + PI);
        }
        let signal = &mut network.signals[index];
        signal.pose = pose;
        signal.lanes = lanes;
    }
    for index in 0..network.objects.len() {
        let (places, runs) = object_places(network, index);
        let outlines = outlines(network, index);
        let object = &mut network.objects[index];
        for (shape, outline) in object.shapes.iter_mut().zip(&outlines) {
            shape.heights_m.truncate(outline.len());
        }
        (object.places, object.runs, object.outlines) = (places, runs, outlines);
    }
}

/// Returns the pose of a signal before it is turned to its traffic.
fn signal_pose(network: &Network, signal: &Signal) -> Placement {
    let beside = |road: u32, s: f64, t: f64, up: f64, turn: f64| {
        let pose = on_road(network, road, s, t, up);
        Placement { heading_rad: pose.heading_rad + turn, ..pose }
    };
    let own = |_| beside(signal.road, signal.s, signal.t, signal.z_offset_m, signal.h_offset_rad);
    match &signal.position {
        Some(SignalPosition::Road { road, s, t, z_offset_m, h_offset_rad }) => {
            let other = network.roads.iter().position(|other| other.id == *road);
            let stand = |road| beside(road as u32, *s, *t, *z_offset_m, *h_offset_rad);
            other.map_or_else(|| own(()), stand)
        }
        Some(SignalPosition::Inertial { position, heading_rad }) => Placement {
            position: *position - network.origin,
            heading_rad: *heading_rad,
            ..Placement::default()
        },
        None => own(()),
    }
}

/// Returns whether traffic on the lanes of a signal would see its back. Authoring tools disagree
/// about what a heading offset is relative to: RoadRunner's is relative to the road whatever the
/// orientation.
fn faces_away(network: &Network, pose: &Placement, lanes: &[(LaneIndex, f64)]) -> bool {
    let ways = lanes.iter().map(|(lane, along_m)| {
        // A lane through a junction may end in any direction; at its beginning drivers see the
        // signal.
        let along_m = if network.lane(*lane).junction.is_some() { 0.0 } else { *along_m };
        DVec2::from_angle(network.lane_pose(*lane, along_m, 0.0).0.heading_rad)
    });
    let way = ways.sum::<DVec2>();
    way.dot(DVec2::from_angle(pose.heading_rad)) > SIDEWAYS * way.length()
}

/// Cosine of the angle within which a signal that faces sideways is left as it is.
const SIDEWAYS: f64 = 0.3;

/// Returns the lanes that a signal applies to at one place, and its distance along each.
fn lanes_of_use(network: &Network, rules: &SignalUse) -> Vec<(LaneIndex, f64)> {
    let road = &network.roads[rules.road as usize];
    let s = rules.s.clamp(0.0, road.length_m);
    let section = &road.sections[road.section_at(s)];
    let mut lanes = Vec::new();
    for index in &section.lanes {
        let lane = network.lane(*index);
        if !LaneTypes::DRIVABLE.contains(lane.kind) {
            continue;
        }
        // CARLA's towns write "0 to 0" for no lane at all.
        let valid = rules.validity.is_empty()
            || rules.validity.iter().any(|(from, to)| (*from..=*to).contains(&lane.id));
        let faces = match rules.orientation {
            Orientation::Forward => lane.forward,
            Orientation::Backward => !lane.forward,
            Orientation::Both => true,
        };
        if valid {
            lanes.push((faces, (*index, network.point_at_s(lane, s).along_m)));
        }
    }
    // CARLA's towns name lanes that are driven against the orientation; then the lanes take
    // precedence.
    let contradicted = !rules.validity.is_empty() && lanes.iter().all(|(faces, _)| !faces);
    lanes.into_iter().filter(|(faces, _)| *faces || contradicted).map(|(_, lane)| lane).collect()
}

/// Returns the pose at (s, t) of a road, along rising s.
fn on_road(network: &Network, road: u32, s: f64, t: f64, up: f64) -> Placement {
    let road = &network.roads[road as usize];
    let s = s.clamp(0.0, road.length_m);
    let lateral = Lateral { t: Jet::constant(t), level: Jet::default(), flat: false, rise_m: up };
    road.pose(&road.station(s), s, &lateral)
}

/// Most repetitions of one object.
const REPEATS_MAX: usize = 10_000;

/// Returns the poses of an object, and the stations of its continuous repetitions.
fn object_places(network: &Network, index: usize) -> (Vec<ObjectPlace>, Vec<Vec<ObjectPlace>>) {
    let object = &network.objects[index];
    let (mut places, mut runs) = (Vec::new(), Vec::new());
    for repeat in &object.repeats {
        let share = |along: f64| (along / repeat.length_m.max(1e-9)).clamp(0.0, 1.0);
        if repeat.distance_m > 0.0 {
            let steps = (repeat.length_m / repeat.distance_m).floor() as usize;
            for step in 0..=steps.min(REPEATS_MAX) {
                let along = repeat.distance_m * step as f64;
                places.push(repeated(network, object, repeat, along, share(along)));
            }
            continue;
        }
        let stations = (repeat.length_m / RoadObject::STATION_M).ceil().max(1.0) as usize;
        let stations = stations.min(REPEATS_MAX);
        let run = (0..=stations).map(|station| {
            let share = station as f64 / stations as f64;
            repeated(network, object, repeat, repeat.length_m * share, share)
        });
        let run: Vec<ObjectPlace> = run.collect();
        places.extend([run[0], run[stations]]);
        runs.push(run);
    }
    if places.is_empty() {
        places.push(own_place(network, object));
    }
    (places, runs)
}

fn own_place(network: &Network, object: &RoadObject) -> ObjectPlace {
    let pose = on_road(network, object.road, object.s, object.t, object.z_offset_m);
    ObjectPlace {
        position: pose.position,
        heading_rad: wrapped(pose.heading_rad + object.heading_rad),
        length_m: object.length_m,
        width_m: object.width_m,
        height_m: object.height_m,
        radius_m: object.radius_m,
    }
}

/// Returns the object at `along` metres of a repetition, which is the fraction `share` of it.
fn repeated(
    network: &Network,
    object: &RoadObject,
    repeat: &Repeat,
    along: f64,
    share: f64,
) -> ObjectPlace {
    let mix = |ends: [f64; 2]| ends[0] + (ends[1] - ends[0]) * share;
    let (t, up) = (mix(repeat.t), mix(repeat.z_offset_m));
    let pose = on_road(network, object.road, repeat.s + along, t, up);
    let [length_m, width_m, height_m, radius_m] = repeat.sizes_m.map(mix);
    let heading_rad = wrapped(pose.heading_rad + object.heading_rad);
    ObjectPlace { position: pose.position, heading_rad, length_m, width_m, height_m, radius_m }
}

fn outlines(network: &Network, index: usize) -> Vec<Vec<DVec3>> {
    let object = &network.objects[index];
    let own = own_place(network, object);
    let (sin, cos) = own.heading_rad.sin_cos();
    let outlines = object.corners.iter().map(|corners| {
        let corner = |corner: &Corner| match *corner {
            Corner::Road { s, t, dz } => on_road(network, object.road, s, t, dz).position,
            Corner::Local { u, v, z } => {
                own.position + DVec3::new(cos * u - sin * v, sin * u + cos * v, z)
            }
        };
        let mut outline: Vec<DVec3> = corners.iter().map(corner).collect();
        // Some files repeat the first corner at the end.
        if let [first, .., last] = outline.as_slice()
            && outline.len() > 3
            && first.distance(*last) < 1e-3
        {
            outline.pop();
        }
        outline
    });
    outlines.collect()
}
