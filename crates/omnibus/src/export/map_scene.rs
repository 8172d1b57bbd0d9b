//! The lines of a map as `foxglove.SceneUpdate`.

use std::collections::BTreeMap;

use foxglove::{Form, Message, WORLD, color, line, scene, timestamp};

use crate::collect::map_lines::LaneMap;

/// The width of lines that are not painted. Metres.
const THIN_M: f64 = 0.05;

/// Returns the message that draws a map: an entity for each kind of mark in each colour, as
/// `solid white`, and the edges without a mark, the crosswalks and the stop lines.
pub(crate) fn map_scene(map: &LaneMap, time_nanos: u64) -> Message {
    let mut entities: BTreeMap<String, Vec<Message>> = BTreeMap::new();
    let mut add = |id: String, line| entities.entry(id).or_default().push(line);
    for boundary in &map.boundaries {
        let has_mark = boundary.kind != "none";
        let id =
            if has_mark { format!("{} {}", boundary.kind, boundary.color) } else { "edge".into() };
        let shade = match &boundary.color[..] {
            _ if !has_mark => color([90; 3], 1.0),
            "yellow" => color([230, 190, 40], 1.0),
            "red" => color([200, 40, 40], 1.0),
            "blue" => color([60, 110, 220], 1.0),
            "green" => color([60, 170, 80], 1.0),
            _ => color([235; 3], 1.0),
        };
        let width_m = if has_mark { boundary.width_m.max(THIN_M) } else { THIN_M };
        add(id, line(Form::Strip, &boundary.points_m, width_m, &shade));
    }
    for walk in &map.crosswalks {
        add("crosswalk".into(), line(Form::Loop, &walk.corners_m, THIN_M, &color([235; 3], 1.0)));
    }
    for stop in &map.stop_lines {
        add("stop line".into(), line(Form::Strip, &stop.points_m, 0.3, &color([235; 3], 1.0)));
    }
    let time = timestamp(time_nanos);
    let entity = |(id, lines): (&String, &Vec<Message>)| {
        let entity = Message::new().message(1, &time).text(2, WORLD).text(3, id);
        lines.iter().fold(entity, |entity, line| entity.message(11, line))
    };
    scene(&time, entities.iter().map(entity))
}
