use glam::DVec2;

use super::{
    elements::{anywhere, cubic, cubics, limit},
    lanes, objects, roadrunner, signals,
};
use crate::{
    MapError,
    cubic::{Cubic, Profile},
    curve::{Curve, Shape as CurveShape},
    records::{BEYOND_M, Owner, RawLink, Records, RoadExtra},
    road::{Road, RoadType, Shape, Switch},
    surface_strips::{CrossSection, Strip},
    xml::Cursor,
};

/// A geometry shorter than this has no length, metres.
const SHORTEST_M: f64 = 1e-9;

/// Longer roads are errors in the file, metres: the work that a map needs grows with their length.
const LONGEST_M: f64 = 1e5;

/// Roads that turn further are errors in the file, radians: 50 times round, a hundred levels of a car
/// park. A spiral of a few numbers can wind itself thousands of times about one place.
const TURN_MAX_RAD: f64 = 50.0 * std::f64::consts::TAU;

pub(super) fn road(xml: &mut Cursor, records: &mut Records) -> Result<(), MapError> {
    let mut extra = RoadExtra {
        junction: xml.raw("junction").filter(|id| *id != "-1").map(|_| xml.string("junction")),
        offset: xml.offset(),
        ..RoadExtra::default()
    };
    let index = records.roads.len() as u32;
    let first_object = records.objects.len();
    let mut road = Road {
        id: xml.required("id")?,
        name: xml.string("name"),
        length_m: xml.number("length")?,
        junction: None,
        left_hand: xml.raw("rule") == Some("LHT"),
        sections: Vec::new(),
        predecessor: None,
        successor: None,
        types: Vec::new(),
        switches: Vec::new(),
        curves: Vec::new(),
        elevation: Profile::default(),
        superelevation: Profile::default(),
        crossfall: Default::default(),
        shapes: Vec::new(),
        cross_section: CrossSection::default(),
        lane_offset: Profile::default(),
    };
    if !(0.0..=LONGEST_M).contains(&road.length_m) {
        return Err(xml.error(format!(
            "road {} is {} m long; lengths from 0 to {LONGEST_M} are allowed",
            road.id, road.length_m
        )));
    }
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "link" => links(xml, &mut extra)?,
            "type" => {
                let kind = road_type(xml)?;
                road.types.push(kind);
            }
            "planView" => {
                plan_view(xml, &mut road)?;
                extra.too_long = shorten(&mut road);
                let turn_rad: f64 = road.curves.iter().map(Curve::turn_rad).sum();
                if turn_rad > TURN_MAX_RAD {
                    return Err(xml.error_at(
                        extra.offset,
                        format!(
                            "road {} turns by {:.0} degrees in all; at most {:.0} are allowed",
                            road.id,
                            turn_rad.to_degrees(),
                            TURN_MAX_RAD.to_degrees()
                        ),
                    ));
                }
            }
            "elevationProfile" => road.elevation = cubics(xml, "elevation", "s")?,
            "lateralProfile" => lateral_profile(xml, &mut road)?,
            "lanes" => extra.sections_beyond = lanes::lanes(xml, &mut road, index, records)?,
            "objects" => objects::objects(xml, index, records)?,
            "signals" => signals::signals(xml, index, records)?,
            "railroad" => railroad(xml, &mut road)?,
            _ => anywhere(xml, name, Owner::Road(index), records),
        }
    }
    if road.curves.is_empty() {
        return Err(xml.error_at(
            extra.offset,
            format!("road {} has no <geometry> in its <planView>", road.id),
        ));
    }
    if road.sections.is_empty() {
        return Err(xml.error_at(extra.offset, format!("road {} has no <laneSection>", road.id)));
    }
    road.types.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    roadrunner::signs(&road, first_object, records);
    records.roads.push(road);
    records.road_extras.push(extra);
    Ok(())
}

/// Shortens a road to its geometry. Returns the declared length if it was well beyond.
fn shorten(road: &mut Road) -> Option<f64> {
    let end = road.curves.last().map(|curve| curve.from_m + curve.length_m)?;
    let declared = road.length_m;
    (declared > end + BEYOND_M).then(|| {
        road.length_m = end;
        declared
    })
}

fn links(xml: &mut Cursor, extra: &mut RoadExtra) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        let link = match name {
            "predecessor" => &mut extra.predecessor,
            "successor" => &mut extra.successor,
            _ => continue,
        };
        *link = Some(RawLink {
            junction: xml.raw("elementType") == Some("junction"),
            id: xml.required("elementId")?,
            at_start: xml.raw("contactPoint") != Some("end"),
        });
    }
    Ok(())
}

fn road_type(xml: &mut Cursor) -> Result<RoadType, MapError> {
    let mut kind =
        RoadType { from_m: xml.number_or("s", 0.0)?, kind: xml.string("type"), limit_mps: None };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "speed" {
            kind.limit_mps = limit(xml)?;
        }
    }
    Ok(kind)
}

fn plan_view(xml: &mut Cursor, road: &mut Road) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "geometry" {
            let offset = xml.offset();
            let curve = geometry(xml)?;
            if let Some(last) = road.curves.last()
                && curve.from_m < last.from_m
            {
                return Err(xml.error_at(
                    offset,
                    format!(
                        "a geometry of road {} begins at s {}, but the previous one at {}",
                        road.id, curve.from_m, last.from_m
                    ),
                ));
            }
            road.curves.push(curve);
        }
    }
    Ok(())
}

fn geometry(xml: &mut Cursor) -> Result<Curve, MapError> {
    let from_m = xml.number("s")?;
    let start = DVec2::new(xml.number("x")?, xml.number("y")?);
    let heading = xml.number("hdg")?;
    let length_m = xml.number("length")?;
    if !(0.0..=LONGEST_M).contains(&length_m) {
        return Err(xml.error(format!(
            "a <geometry> is {length_m} m long; lengths from 0 to {LONGEST_M} are allowed"
        )));
    }
    // The rates of a curve are divided by its length.
    let length_m = if length_m < SHORTEST_M { 0.0 } else { length_m };
    let mut shape = None;
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        shape = Some(match name {
            "line" => CurveShape::Line,
            "arc" => match xml.number("curvature")? {
                curvature if curvature.abs() < 1e-14 => CurveShape::Line,
                curvature => CurveShape::Arc { curvature: bounded(xml, curvature)? },
            },
            "spiral" => {
                let from = bounded(xml, xml.number("curvStart")?)?;
                let to = bounded(xml, xml.number("curvEnd")?)?;
                CurveShape::spiral(from, to, length_m)
            }
            "poly3" => {
                let factors =
                    [xml.number("a")?, xml.number("b")?, xml.number("c")?, xml.number("d")?];
                CurveShape::poly3(factors, length_m)
            }
            "paramPoly3" => {
                let u =
                    [xml.number("aU")?, xml.number("bU")?, xml.number("cU")?, xml.number("dU")?];
                let v =
                    [xml.number("aV")?, xml.number("bV")?, xml.number("cV")?, xml.number("dV")?];
                let p_end = if xml.raw("pRange") == Some("arcLength") { length_m } else { 1.0 };
                CurveShape::cubic(u, v, p_end, length_m)
            }
            _ => continue,
        });
    }
    match shape {
        Some(shape) => Ok(Curve::new(from_m, length_m, start, heading, shape)),
        None => Err(xml.error(
            "unsupported <geometry>: it has no line, arc, spiral, poly3 or paramPoly3".into(),
        )),
    }
}

/// Rejects curvatures of radii below one centimetre.
fn bounded(xml: &Cursor, curvature: f64) -> Result<f64, MapError> {
    if curvature.abs() <= 100.0 {
        return Ok(curvature);
    }
    Err(xml
        .error(format!("the curvature {curvature} is out of range; the smallest radius is 1 cm")))
}

fn lateral_profile(xml: &mut Cursor, road: &mut Road) -> Result<(), MapError> {
    let mut banks = Vec::new();
    let mut falls: [Vec<Cubic>; 2] = Default::default();
    let mut shapes: Vec<(f64, Vec<Cubic>)> = Vec::new();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "crossSectionSurface" => road.cross_section = cross_section(xml)?,
            "superelevation" => banks.push(cubic(xml, "s")?),
            "crossfall" => {
                let fall = cubic(xml, "s")?;
                let side = xml.raw("side").unwrap_or("both");
                if side != "right" {
                    falls[0].push(fall);
                }
                if side != "left" {
                    falls[1].push(fall);
                }
            }
            "shape" => {
                let s = xml.number("s")?;
                let over_t = cubic(xml, "t")?;
                match shapes.iter_mut().find(|(at, _)| *at == s) {
                    Some((_, pieces)) => pieces.push(over_t),
                    None => shapes.push((s, vec![over_t])),
                }
            }
            _ => {}
        }
    }
    road.superelevation = Profile::new(banks);
    road.crossfall = falls.map(Profile::new);
    shapes.sort_by(|a, b| a.0.total_cmp(&b.0));
    road.shapes = shapes
        .into_iter()
        .map(|(from_m, pieces)| Shape { from_m, over_t: Profile::new(pieces) })
        .collect();
    Ok(())
}

fn cross_section(xml: &mut Cursor) -> Result<CrossSection, MapError> {
    let mut section = CrossSection::default();
    let mut strips = Vec::new();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "tOffset" => section.t_offset = cubics(xml, "coefficients", "s")?,
            "surfaceStrips" => {
                let inside = xml.depth();
                while let Some(name) = xml.child(inside)? {
                    if name == "strip" {
                        strips.push(strip(xml)?);
                    }
                }
            }
            _ => {}
        }
    }
    strips.sort_by_key(|strip: &Strip| strip.id.abs());
    (section.left, section.right) = strips.into_iter().partition(|strip| strip.id > 0);
    Ok(section)
}

fn strip(xml: &mut Cursor) -> Result<Strip, MapError> {
    let mut strip = Strip {
        id: xml.integer("id")?,
        is_relative: xml.raw("mode") == Some("relative"),
        ..Strip::default()
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        let profile = match name {
            "width" => &mut strip.width,
            "constant" => &mut strip.factors[0],
            "linear" => &mut strip.factors[1],
            "quadratic" => &mut strip.factors[2],
            "cubic" => &mut strip.factors[3],
            _ => continue,
        };
        *profile = cubics(xml, "coefficients", "s")?;
    }
    Ok(strip)
}

fn railroad(xml: &mut Cursor, road: &mut Road) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name != "switch" {
            continue;
        }
        let mut switch = Switch {
            id: xml.string("id"),
            name: xml.string("name"),
            position: xml.string("position"),
            s: 0.0,
            side_track: (String::new(), 0.0),
        };
        let inside = xml.depth();
        while let Some(name) = xml.child(inside)? {
            match name {
                "mainTrack" => switch.s = xml.number_or("s", 0.0)?,
                "sideTrack" => switch.side_track = (xml.string("id"), xml.number_or("s", 0.0)?),
                _ => {}
            }
        }
        road.switches.push(switch);
    }
    Ok(())
}
