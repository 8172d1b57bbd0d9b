//! Signs that RoadRunner writes as objects. CARLA's towns give their speed limits this way.

use crate::{
    object::RoadObject,
    placement::Placement,
    records::Records,
    road::Road,
    signal::{Orientation, Signal, SignalUse},
};

/// Adds a signal for each object from index `first` on whose name says that it is a sign:
/// "Speed_30" is the German sign 274 with a limit in miles per hour.
pub(super) fn signs(road: &Road, first: usize, records: &mut Records) {
    for index in first..records.objects.len() {
        let object = &records.objects[index];
        let text = object.name.strip_prefix("Speed_").or(object.name.strip_prefix("speed_"));
        let Some(text) = text else { continue };
        let Some(limit) = text.parse().ok().filter(|limit: &f64| limit.is_finite()) else {
            continue;
        };
        let signal = signal(road, object, text, limit, records);
        records.signals.push(signal);
    }
}

fn signal(road: &Road, object: &RoadObject, text: &str, limit: f64, records: &Records) -> Signal {
    // Here the orientation says on which side of the reference line the lanes lie, not in which
    // direction they are driven.
    let section = &road.sections[road.section_at(object.s)];
    let ids = || section.lanes.iter().map(|lane| records.lanes[lane.0 as usize].id);
    let left = ids().max().filter(|id| *id > 0).map(|last| (1, last));
    let right = ids().min().filter(|id| *id < 0).map(|last| (last, -1));
    let validity = match object.orientation {
        Orientation::Forward => vec![left],
        Orientation::Backward => vec![right],
        Orientation::Both => vec![left, right],
    };
    let rules = SignalUse {
        road: object.road,
        s: object.s,
        t: object.t,
        orientation: object.orientation,
        validity: validity.into_iter().flatten().collect(),
        is_reference: false,
    };
    Signal {
        id: object.id.clone(),
        name: object.name.clone(),
        road: object.road,
        s: object.s,
        t: object.t,
        z_offset_m: object.z_offset_m,
        h_offset_rad: object.heading_rad,
        pitch_rad: 0.0,
        roll_rad: 0.0,
        kind: "274".to_string(),
        subtype: text.to_string(),
        country: "OpenDRIVE".to_string(),
        value: Some(limit),
        unit: "mph".to_string(),
        text: text.to_string(),
        dynamic: false,
        orientation: object.orientation,
        width_m: object.width_m,
        height_m: object.height_m,
        pose: Placement::default(),
        lanes: Vec::new(),
        controller: None,
        uses: vec![rules],
        dependencies: Vec::new(),
        references: Vec::new(),
        position: None,
    }
}
