use super::elements::{cubic, limit};
use crate::{
    MapError,
    cubic::Profile,
    lane::{
        Lane, LaneAccess, LaneHeight, LaneIndex, LaneLinks, LaneMaterial, LaneRule, LaneSpeed,
        LaneType,
    },
    mark::{MarkChange, MarkColor, MarkKind, MarkLine, MarkSway, RoadMark},
    records::{BEYOND_M, Records},
    road::{Road, Section},
    xml::Cursor,
};

/// Reads the lanes of a road. Returns where the first section begins that lies beyond the end of the
/// road, if there is one; such sections are left out.
pub(super) fn lanes(
    xml: &mut Cursor,
    road: &mut Road,
    road_index: u32,
    records: &mut Records,
) -> Result<Option<f64>, MapError> {
    let mut offsets = Vec::new();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "laneOffset" => offsets.push(cubic(xml, "s")?),
            "laneSection" => section(xml, road, road_index, records)?,
            _ => {}
        }
    }
    road.lane_offset = Profile::new(offsets);
    let beyond = drop_beyond(road, &mut records.lanes);
    close_sections(road, &mut records.lanes);
    Ok(beyond)
}

fn drop_beyond(road: &mut Road, lanes: &mut Vec<Lane>) -> Option<f64> {
    let end = road.length_m + BEYOND_M;
    // A road needs one section.
    let first = road.sections.iter().skip(1).position(|section| section.start_m > end)? + 1;
    let start = road.sections[first].start_m;
    let count: usize = road.sections.drain(first..).map(|section| section.lanes.len()).sum();
    // They were read last.
    lanes.truncate(lanes.len() - count);
    Some(start)
}

/// Derives the lengths of sections and lanes from where the next section begins.
fn close_sections(road: &mut Road, lanes: &mut [Lane]) {
    for index in 0..road.sections.len() {
        let end = match road.sections.get(index + 1) {
            Some(next) => next.start_m,
            None => road.length_m,
        };
        let section = &mut road.sections[index];
        section.length_m = (end - section.start_m).max(0.0);
        for lane in &section.lanes {
            lanes[lane.0 as usize].length_m = section.length_m;
        }
    }
}

fn section(
    xml: &mut Cursor,
    road: &mut Road,
    road_index: u32,
    records: &mut Records,
) -> Result<(), MapError> {
    let start_m = xml.number("s")?;
    if let Some(last) = road.sections.last()
        && start_m < last.start_m
    {
        return Err(xml.error(format!(
            "a lane section of road {} begins at s {start_m}, but the previous one at {}",
            road.id, last.start_m
        )));
    }
    let section_index = road.sections.len() as u32;
    let mut marks = Vec::new();
    let mut found: Vec<Lane> = Vec::new();
    let here = xml.depth();
    while let Some(side) = xml.child(here)? {
        if !matches!(side, "left" | "center" | "right") {
            continue;
        }
        let inside = xml.depth();
        while let Some(name) = xml.child(inside)? {
            if name != "lane" {
                continue;
            }
            let lane = lane(xml, road, road_index, section_index)?;
            let fits = match side {
                "left" => lane.id > 0,
                "right" => lane.id < 0,
                _ => lane.id == 0,
            };
            if !fits {
                return Err(xml.error_at(
                    lane.declared.offset,
                    format!(
                        "lane {} of road {} stands on the side <{side}>; \
                     left lanes count up from 1, right lanes down from -1",
                        lane.id, road.id
                    ),
                ));
            }
            if lane.id == 0 {
                marks = lane.marks;
            } else if found.iter().any(|other| other.id == lane.id) {
                return Err(xml.error_at(
                    lane.declared.offset,
                    format!("duplicate lane {} of road {} in one section", lane.id, road.id),
                ));
            } else {
                found.push(lane);
            }
        }
    }
    found.sort_by_key(|lane| -lane.id);
    let base = records.lanes.len() as u32;
    for (lane, index) in found.iter_mut().zip(base..) {
        lane.index = LaneIndex(index);
    }
    road.sections.push(Section {
        start_m,
        length_m: 0.0,
        left: found.iter().filter(|lane| lane.id > 0).count(),
        lanes: found.iter().map(|lane| lane.index).collect(),
        marks,
    });
    records.lanes.append(&mut found);
    Ok(())
}

fn lane(xml: &mut Cursor, road: &Road, road_index: u32, section: u32) -> Result<Lane, MapError> {
    let id = xml.integer("id")?;
    let mut lane = Lane {
        index: LaneIndex(0),
        road: road_index,
        section,
        id,
        kind: xml.raw("type").and_then(LaneType::from_text).unwrap_or(LaneType::None),
        length_m: 0.0,
        forward: (id < 0) != road.left_hand,
        junction: None,
        successors: Vec::new(),
        predecessors: Vec::new(),
        left: None,
        right: None,
        left_change: false,
        right_change: false,
        speed_limit_mps: None,
        marks: Vec::new(),
        level: matches!(xml.raw("level"), Some("true" | "1")),
        materials: Vec::new(),
        access: Vec::new(),
        rules: Vec::new(),
        widths: Profile::default(),
        borders: Profile::default(),
        heights: Vec::new(),
        speeds: Vec::new(),
        declared: LaneLinks { offset: xml.offset(), ..LaneLinks::default() },
    };
    if xml.raw("direction") == Some("reversed") {
        lane.forward = !lane.forward;
    }
    let (mut widths, mut borders) = (Vec::new(), Vec::new());
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "link" => {
                let inside = xml.depth();
                while let Some(name) = xml.child(inside)? {
                    match name {
                        "predecessor" => lane.declared.predecessors.push(xml.integer("id")?),
                        "successor" => lane.declared.successors.push(xml.integer("id")?),
                        _ => {}
                    }
                }
            }
            "width" => widths.push(cubic(xml, "sOffset")?),
            "border" => borders.push(cubic(xml, "sOffset")?),
            "height" => lane.heights.push(LaneHeight {
                from_m: xml.number_or("sOffset", 0.0)?,
                inner_m: xml.number_or("inner", 0.0)?,
                outer_m: xml.number_or("outer", 0.0)?,
            }),
            "speed" => lane
                .speeds
                .push(LaneSpeed { from_m: xml.number_or("sOffset", 0.0)?, limit_mps: limit(xml)? }),
            "material" => lane.materials.push(LaneMaterial {
                from_m: xml.number_or("sOffset", 0.0)?,
                surface: xml.string("surface"),
                friction: xml.number_or("friction", 0.0)?,
                roughness: xml.number_or("roughness", 0.0)?,
            }),
            "rule" => lane.rules.push(LaneRule {
                from_m: xml.number_or("sOffset", 0.0)?,
                text: xml.string("value"),
            }),
            "access" => {
                let access = access(xml)?;
                lane.access.push(access);
            }
            "roadMark" => {
                let mark = road_mark(xml, id)?;
                lane.marks.push(mark);
            }
            _ => {}
        }
    }
    lane.widths = Profile::new(widths);
    lane.borders = Profile::new(borders);
    lane.heights.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    lane.speeds.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    lane.materials.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    lane.access.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    lane.rules.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    lane.marks.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    Ok(lane)
}

fn access(xml: &mut Cursor) -> Result<LaneAccess, MapError> {
    let rule = xml.raw("rule").unwrap_or("deny").to_string();
    let own = xml.raw("restriction").map(|_| xml.string("restriction"));
    let from_m = xml.number_or("sOffset", 0.0)?;
    let mut access = LaneAccess { from_m, rule, restrictions: own.into_iter().collect() };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "restriction" {
            access.restrictions.push(xml.string("type"));
        }
    }
    Ok(access)
}

fn road_mark(xml: &mut Cursor, lane_id: i32) -> Result<RoadMark, MapError> {
    let kind = MarkKind::from_text(xml.raw("type").unwrap_or("none"));
    let bold = xml.raw("weight") == Some("bold");
    let usual_width = if bold { 0.25 } else { 0.12 };
    let mut mark = RoadMark {
        from_m: xml.number_or("sOffset", 0.0)?,
        kind,
        color: MarkColor::from_text(xml.raw("color").unwrap_or_default()),
        width_m: match xml.optional_number("width")? {
            Some(width) => width.clamp(0.0, 5.0),
            None => usual_width,
        },
        bold,
        change: match xml.raw("laneChange") {
            Some("none") => MarkChange::None,
            Some("increase") => MarkChange::Increase,
            Some("decrease") => MarkChange::Decrease,
            Some("both") => MarkChange::Both,
            _ => kind.usual_change(lane_id <= 0),
        },
        lines: Vec::new(),
        sways: Vec::new(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "sway" {
            let sway = cubic(xml, "ds")?;
            mark.sways.push(MarkSway { from_m: sway.from_m, factors: sway.factors });
        }
        if !matches!(name, "type" | "explicit") {
            continue;
        }
        let once = name == "explicit";
        let inside = xml.depth();
        while let Some(name) = xml.child(inside)? {
            if name == "line" {
                mark.lines.push(MarkLine {
                    length_m: xml.number_or("length", 0.0)?.max(0.0),
                    space_m: xml.number_or("space", 0.0)?.max(0.0),
                    offset_t_m: xml.number_or("tOffset", 0.0)?,
                    offset_s_m: xml.number_or("sOffset", 0.0)?,
                    width_m: match xml.optional_number("width")? {
                        Some(width) if width > 0.0 => width.min(5.0),
                        _ => mark.width_m,
                    },
                    once,
                });
            }
        }
    }
    Ok(mark)
}
