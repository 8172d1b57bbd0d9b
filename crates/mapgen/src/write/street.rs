//! Streets: their lanes, crosswalks, signals and signs.

use std::fmt::Write as _;

use crate::{
    curve,
    junction::{Rule, Sign},
    street::{Class, Profile, Street},
    write::document::{Document, escaped, put, street_id, widths},
};

/// The distance from the mouth of a junction to the stop line. Metres.
const STOP_M: f64 = 6.5;
/// The distance where no crosswalk lies before the junction. Metres.
const BARE_STOP_M: f64 = 1.5;
/// The distance from the mouth to the middle of the crosswalk, and the crosswalk's depth. Metres.
const CROSSWALK_M: (f64, f64) = (3.4, 3.2);
/// The length from which on streets have crosswalks. Metres.
const CROSSED_MIN_M: f64 = 24.0;
/// The length over which a shoulder widens next to a ramp. Metres.
const GORE_M: f64 = 60.0;

/// Half the length of the bridge where a motorway crosses itself. Metres.
const HUMP_BRIDGE_M: f64 = 40.0;

/// A part of a street with the same lanes throughout.
#[derive(Clone, Copy)]
struct Stretch {
    from: f64,
    to: f64,
    /// The additional lane of this part, if it has one.
    beside: ExtraLane,
    /// The additional lanes of the parts before and after this one, where there are such parts.
    before: Option<ExtraLane>,
    after: Option<ExtraLane>,
}

/// A lane to the right of all others.
#[derive(Clone, Copy, PartialEq)]
enum ExtraLane {
    Nothing,
    /// The lane ends with the part.
    Acceleration,
    /// The lane begins with the part.
    Deceleration,
}

impl ExtraLane {
    fn lanes(self) -> i32 {
        i32::from(self != ExtraLane::Nothing)
    }
}

impl Document<'_> {
    pub(super) fn street(&mut self, index: usize) {
        let layout = self.layout;
        let street = &layout.streets[index];
        let line = self.lines[index].clone();
        let length = curve::length(&line);
        let [from, to] =
            [0, 1].map(|end| self.numbers.junction_id(self.arms_of_streets[index][end].0));
        put!(
            self,
            "<road name=\"{}\" length=\"{length:.9}\" id=\"{}\" junction=\"-1\">",
            escaped(&street.name),
            street_id(index)
        );
        put!(self, "<link>");
        put!(self, "<predecessor elementType=\"junction\" elementId=\"{from}\"/>");
        put!(self, "<successor elementType=\"junction\" elementId=\"{to}\"/>");
        put!(self, "</link>");
        self.limit(street.profile.class, street.profile.limit_kmh);
        self.plan_view(&line);
        self.elevation(&layout.heights(street, &line));
        self.lanes(street, length);
        self.objects(index, street, length);
        self.street_signals(index, street, length);
        put!(self, "</road>");
    }

    fn lanes(&mut self, street: &Street, length: f64) {
        put!(self, "<lanes>");
        let division = street.profile.division();
        if division != 0.0 {
            put!(self, "<laneOffset s=\"0\" a=\"{division:.6}\" b=\"0\" c=\"0\" d=\"0\"/>");
        }
        let stretches = stretches(street, length);
        for (at, (from, to, beside)) in stretches.iter().enumerate() {
            let other =
                |at: Option<usize>| at.and_then(|at| stretches.get(at)).map(|stretch| stretch.2);
            let (before, after) = (other(at.checked_sub(1)), other(Some(at + 1)));
            let (from, to, beside) = (*from, *to, *beside);
            self.section(street, Stretch { from, to, beside, before, after });
        }
        put!(self, "</lanes>");
    }

    fn section(&mut self, street: &Street, stretch: Stretch) {
        let profile = &street.profile;
        put!(self, "<laneSection s=\"{:.9}\">", stretch.from);
        let left = profile.lanes[1] > 0 || profile.edge(1) > 0.0;
        if left {
            put!(self, "<left>");
            let last = self.outermost(profile, 1, 0);
            (1..=last).rev().for_each(|lane| self.lane(street, 1, lane, stretch));
            put!(self, "</left>");
        }
        put!(self, "<center><lane id=\"0\" type=\"none\" level=\"false\">");
        let (kind, color, wide) = middle(profile);
        self.mark(kind, color, wide, "none");
        put!(self, "</lane></center><right>");
        let last = self.outermost(profile, 0, stretch.beside.lanes());
        (1..=last).for_each(|lane| self.lane(street, 0, lane, stretch));
        put!(self, "</right></laneSection>");
    }

    fn outermost(&self, profile: &Profile, side: usize, more: i32) -> i32 {
        let edge = if profile.edge(side) > 0.0 { 0 } else { -1 };
        profile.edge_id(side) + edge + more
    }

    fn lane(&mut self, street: &Street, side: usize, lane: i32, stretch: Stretch) {
        let profile = &street.profile;
        let length = stretch.to - stretch.from;
        let driving = profile.lanes[side] as i32;
        let beside = if side == 0 { stretch.beside } else { ExtraLane::Nothing };
        let extra = beside.lanes();
        let edge = profile.edge_id(side) + extra;
        let kind = match lane {
            _ if lane <= driving + extra => "driving",
            _ if lane < edge => "parking",
            _ if profile.sidewalk[side] > 0.0 => "sidewalk",
            _ => "shoulder",
        };
        let sign = if side == 0 { -1 } else { 1 };
        put!(self, "<lane id=\"{}\" type=\"{kind}\" level=\"false\">", sign * lane);
        put!(self, "<link>");
        let added = extra > 0 && lane == driving + 1;
        // The shoulder has another lane id where an additional lane lies inside it.
        let moves = side == 0 && lane > driving + extra;
        let number = |other: ExtraLane| lane + if moves { other.lanes() - extra } else { 0 };
        if let Some(before) = stretch.before.filter(|_| !added) {
            put!(self, "<predecessor id=\"{}\"/>", sign * number(before));
        }
        if let Some(after) = stretch.after.filter(|_| !added) {
            put!(self, "<successor id=\"{}\"/>", sign * number(after));
        }
        put!(self, "</link>");
        match kind {
            "driving" if added => {
                let wide = profile.lane;
                let places = if beside == ExtraLane::Acceleration {
                    let (full, taper) = street.acceleration.unwrap_or_default();
                    let full = full.min(length * 0.7);
                    [(0.0, wide), (full, wide), ((full + taper).min(length), 0.0)]
                } else {
                    let (taper, _) = street.deceleration.unwrap_or_default();
                    [(0.0, 0.0), (taper.min(length * 0.3), wide), (length, wide)]
                };
                put!(self, "{}", widths(&places).trim_end());
                self.mark("solid", "white", 0.15, "none");
            }
            "driving" => {
                put!(self, "{}", widths(&[(0.0, profile.lane), (length, profile.lane)]).trim_end());
                let fast = profile.class >= Class::Rural;
                if lane < driving || extra > 0 {
                    self.mark("broken", "white", 0.12, "both");
                } else if lane + 1 < edge {
                    self.mark("none", "white", 0.12, "none");
                } else if fast || profile.edge(side) == 0.0 {
                    self.mark("solid", "white", 0.15, "none");
                } else {
                    self.mark("curb", "standard", 0.15, "none");
                }
            }
            "parking" => {
                // The kerb extends into the parking lane at both ends, which shortens crossings.
                let (clear, taper) = ((length * 0.2).min(12.0), (length * 0.12).min(7.0));
                let wide = profile.parking[side];
                let places = [
                    (0.0, 0.0),
                    (clear, 0.0),
                    (clear + taper, wide),
                    (length - clear - taper, wide),
                    (length - clear, 0.0),
                    (length, 0.0),
                ];
                put!(self, "{}", widths(&places).trim_end());
                self.mark("curb", "standard", 0.15, "none");
            }
            _ => {
                put!(self, "{}", widths(&edge_places(street, side, stretch)).trim_end());
                self.mark("none", "standard", 0.0, "none");
                if kind == "sidewalk" {
                    self.raised();
                }
            }
        }
        put!(self, "</lane>");
    }

    fn objects(&mut self, index: usize, street: &Street, length: f64) {
        put!(self, "<objects>");
        let (middle, depth) = CROSSWALK_M;
        let half = street.profile.half();
        for (end, s) in [(0, middle), (1, length - middle)] {
            if !is_crossed(street, length) {
                continue;
            }
            put!(
                self,
                "<object type=\"crosswalk\" id=\"{}\" name=\"Crosswalk\" s=\"{s:.6}\" t=\"0\" \
                 zOffset=\"0\" orientation=\"none\" length=\"{:.3}\" width=\"{depth:.3}\" \
                 hdg=\"1.570796326794897\" pitch=\"0\" roll=\"0\" height=\"0\" validLength=\"0\">",
                self.numbers.crosswalk + 2 * index + end,
                half * 2.0
            );
            put!(self, "<outline>");
            let corners = [(-half, -depth), (half, -depth), (half, depth), (-half, depth)];
            for (u, v) in corners.into_iter().chain([(-half, -depth)]) {
                put!(self, "<cornerLocal u=\"{u:.3}\" v=\"{:.3}\" z=\"0\"/>", v * 0.5);
            }
            put!(self, "</outline></object>");
        }
        // A motorway that crosses itself passes over its lower level on a bridge.
        let hump = street.hump.map(|(middle, ..)| (middle, HUMP_BRIDGE_M));
        let own = (street.bridge > 0.0).then_some((length * 0.5, street.bridge));
        for (middle, half) in hump.into_iter().chain(own) {
            let (from, to) = ((middle - half).max(0.0), (middle + half).min(length));
            if from < to {
                put!(
                    self,
                    "<bridge s=\"{from:.6}\" length=\"{:.6}\" id=\"{index}\" name=\"Overpass\" \
                     type=\"concrete\"/>",
                    to - from
                );
            }
        }
        put!(self, "</objects>");
    }

    fn street_signals(&mut self, index: usize, street: &Street, length: f64) {
        put!(self, "<signals>");
        for end in [0, 1] {
            let (number, arm) = self.arm(index, end);
            let arm = arm.clone();
            let crossed = is_crossed(street, length);
            let stop = if crossed { STOP_M } else { BARE_STOP_M };
            let (s, t) = beside(street, end, length, stop);
            let name = self.numbers.signal_id(index, end);
            if arm.ins() > 0 {
                let lanes = (arm.incoming(0), arm.incoming(arm.ins() - 1));
                let junctions = self.junctions;
                let junction = &junctions[number];
                match &junction.rule {
                    Rule::Signals(_) => {
                        let kind = ("1000001", true, None);
                        self.signal(name, "Signal", (s, t, 2.8), end, kind, lanes);
                    }
                    Rule::Signs(sign, arms) => {
                        let obeys = arms.iter().any(|arm| {
                            let arm = &junction.arms[*arm];
                            (arm.street, arm.end) == (index, end)
                        });
                        let (number, word) = match sign {
                            Sign::Yield => ("205", "Yield"),
                            Sign::Stop => ("206", "Stop"),
                        };
                        if obeys {
                            self.signal(name, word, (s, t, 2.0), end, (number, false, None), lanes);
                        }
                    }
                }
            }
            // Traffic that turns into the street sees the speed limit a little further on.
            let told = index.is_multiple_of(3) || street.profile.class >= Class::Rural;
            if told && arm.outs() > 0 && length > 60.0 {
                let last = arm.outs() - 1 - street.extra(end);
                let lanes = (arm.outgoing(0), arm.outgoing(last));
                let (s, across) = beside(street, 1 - end, length, length - 22.0);
                let side = arm.out_side();
                let t = across + street.profile.parking[side] * across.signum();
                let kind = ("274", false, Some(street.profile.limit_kmh));
                let number = self.numbers.sign + 2 * index + end;
                self.signal(number, "Speed", (s, t, 2.0), 1 - end, kind, lanes);
            }
        }
        put!(self, "</signals>");
    }

    fn signal(
        &mut self,
        id: usize,
        name: &str,
        (s, t, z): (f64, f64, f64),
        end: usize,
        (kind, dynamic, value): (&str, bool, Option<f64>),
        lanes: (i32, i32),
    ) {
        let value = value.map_or("-1".to_string(), |value| format!("{value}"));
        put!(
            self,
            "<signal s=\"{s:.6}\" t=\"{t:.6}\" id=\"{id}\" name=\"{name}\" dynamic=\"{}\" \
             orientation=\"{}\" zOffset=\"{z}\" country=\"OpenDRIVE\" type=\"{kind}\" \
             subtype=\"-1\" value=\"{value}\" height=\"0.96\" width=\"0.36\" hOffset=\"0\" \
             pitch=\"0\" roll=\"0\">",
            if dynamic { "yes" } else { "no" },
            if end == 1 { "+" } else { "-" }
        );
        put!(
            self,
            "<validity fromLane=\"{}\" toLane=\"{}\"/>",
            lanes.0.min(lanes.1),
            lanes.0.max(lanes.1)
        );
        put!(self, "</signal>");
    }
}

/// The marking between the two directions, or on the left of a one-way street.
fn middle(profile: &Profile) -> (&'static str, &'static str, f64) {
    match profile.class {
        Class::Motorway | Class::Ramp => ("solid", "white", 0.15),
        Class::Ring => ("none", "white", 0.12),
        _ if profile.lanes[1] == 0 => ("curb", "standard", 0.15),
        Class::Rural => ("broken", "white", 0.12),
        Class::Town if profile.all_lanes() > 2 => ("solid solid", "yellow", 0.12),
        // The street is too narrow for a centre line.
        Class::Town if profile.lane < 3.4 => ("none", "white", 0.12),
        Class::Town => ("broken", "white", 0.12),
    }
}

/// The parts of a street, each with its additional lane.
fn stretches(street: &Street, length: f64) -> Vec<(f64, f64, ExtraLane)> {
    let (mut from, mut to) = (0.0, length);
    let mut found = Vec::new();
    if let Some((full, taper)) = street.acceleration {
        from = (full + taper).min(length);
        found.push((0.0, from, ExtraLane::Acceleration));
    }
    if let Some((taper, full)) = street.deceleration {
        to = length - taper - full;
    }
    // A short street consists of its acceleration lane only.
    if to - from > 1.0 || found.is_empty() {
        found.push((from, to, ExtraLane::Nothing));
    } else if let Some(last) = found.last_mut() {
        last.1 = to;
    }
    if street.deceleration.is_some() {
        found.push((to, length, ExtraLane::Deceleration));
    }
    found
}

/// The width of a sidewalk or shoulder along the street.
fn edge_places(street: &Street, side: usize, stretch: Stretch) -> Vec<(f64, f64)> {
    let (profile, length) = (&street.profile, stretch.to - stretch.from);
    let wide = profile.edge(side);
    if street.extra_sidewalk[side] > 0.0 {
        let (clear, taper) = (length * 0.08, length * 0.14);
        let broad = wide + street.extra_sidewalk[side];
        return vec![
            (0.0, wide),
            (clear, wide),
            (clear + taper, broad),
            (length - clear - taper, broad),
            (length - clear, wide),
            (length, wide),
        ];
    }
    let gore = GORE_M.min(length * 0.4);
    let mut places = Vec::new();
    if side == 0 && street.without_shoulder[0] && stretch.before.is_none() {
        places.extend([(0.0, 0.0), (gore, wide)]);
    } else {
        places.push((0.0, wide));
    }
    if side == 0 && street.without_shoulder[1] && stretch.after.is_none() {
        places.extend([(length - gore, wide), (length, 0.0)]);
    } else {
        places.push((length, wide));
    }
    places
}

/// Whether the street has crosswalks at its ends.
fn is_crossed(street: &Street, length: f64) -> bool {
    let profile = &street.profile;
    let walked = profile.sidewalk.iter().all(|wide| *wide > 0.0);
    profile.class == Class::Town && walked && length > CROSSED_MIN_M
}

/// The position of a pole for traffic that arrives at `end`: `s`, and `t` just behind the kerb.
fn beside(street: &Street, end: usize, length: f64, before_m: f64) -> (f64, f64) {
    let profile = &street.profile;
    let side = 1 - end;
    let t = profile.half() + 0.7 + profile.shoulder[side];
    if end == 1 { (length - before_m, -t) } else { (before_m, t) }
}
