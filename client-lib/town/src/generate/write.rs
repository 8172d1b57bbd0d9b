//! The plan as OpenDRIVE text.

use std::fmt::Write as _;

use super::Plan;
use super::curve::{self, Piece};
use super::junction::{Arm, Junction, Rule, Turn};
use super::layout::{Layout, Profile, Street};

/// From the mouth of a junction to the line where vehicles stop. Metres.
const STOP_M: f64 = 6.5;
/// From the mouth to the middle of the crosswalk, and its depth. Metres.
const CROSSWALK_M: (f64, f64) = (3.4, 3.2);
/// Connecting roads are numbered from here, per junction.
const CONNECTING: usize = 1000;
/// Of the sidewalk above the road. Metres.
const KERB_M: f64 = 0.12;

/// Writes one file.
struct Sheet<'a> {
    layout: &'a Layout,
    junctions: &'a [Junction],
    /// Each street's reference line, between the mouths of its junctions.
    lines: Vec<Vec<Piece>>,
    /// By street: the junction at its start and at its end, and its arm there.
    seats: Vec<[(usize, usize); 2]>,
    text: String,
}

macro_rules! put {
    ($sheet:expr, $($format:tt)*) => {
        // Writing to a String cannot fail.
        let _ = writeln!($sheet.text, $($format)*);
    };
}

/// The whole document.
pub(super) fn document(plan: &Plan, layout: &Layout, junctions: &[Junction]) -> String {
    let mut seats = vec![[(0, 0); 2]; layout.streets.len()];
    for (number, junction) in junctions.iter().enumerate() {
        for (index, arm) in junction.arms.iter().enumerate() {
            seats[arm.street][arm.end] = (number, index);
        }
    }
    let lines = layout.streets.iter().enumerate().map(|(index, street)| {
        let mut corners = vec![layout.nodes[street.ends[0]].position];
        corners.extend(&street.via);
        corners.push(layout.nodes[street.ends[1]].position);
        for (end, corner) in [(0, 0), (1, corners.len() - 1)] {
            let (number, arm) = seats[index][end];
            let arm = &junctions[number].arms[arm];
            corners[corner] += glam::DVec2::from_angle(arm.bearing) * arm.mouth;
        }
        curve::rounded(&corners, &street.radii)
    });
    let lines = lines.collect();
    let mut sheet = Sheet { layout, junctions, lines, seats, text: String::new() };
    sheet.header(plan);
    for street in 0..layout.streets.len() {
        sheet.street(street);
    }
    for (number, junction) in junctions.iter().enumerate() {
        for turn in 0..junction.turns.len() {
            sheet.connecting(number, turn);
        }
    }
    for number in 0..junctions.len() {
        sheet.controllers(number);
    }
    for number in 0..junctions.len() {
        sheet.junction(number);
    }
    put!(sheet, "</OpenDRIVE>");
    sheet.text
}

impl Sheet<'_> {
    fn header(&mut self, plan: &Plan) {
        let (mut low, mut high) = (glam::DVec2::MAX, glam::DVec2::MIN);
        for node in &self.layout.nodes {
            (low, high) = (low.min(node.position), high.max(node.position));
        }
        put!(self, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>");
        put!(self, "<OpenDRIVE>");
        put!(
            self,
            "<header revMajor=\"1\" revMinor=\"4\" name=\"{}\" version=\"1\" \
             date=\"2026-01-01T00:00:00\" north=\"{:.2}\" south=\"{:.2}\" east=\"{:.2}\" \
             west=\"{:.2}\" vendor=\"Omnibus\">",
            escaped(&plan.name),
            high.y + 30.0,
            low.y - 30.0,
            high.x + 30.0,
            low.x - 30.0
        );
        put!(
            self,
            "<geoReference><![CDATA[+proj=tmerc +lat_0=52.52 +lon_0=13.4 +k=1 +x_0=0 +y_0=0 \
             +datum=WGS84 +units=m +no_defs]]></geoReference>"
        );
        put!(self, "</header>");
    }

    fn street(&mut self, index: usize) {
        let street = &self.layout.streets[index];
        let length = curve::length(&self.lines[index]);
        let junction = |end: usize| junction_id(self.seats[index][end].0);
        let (from, to) = (junction(0), junction(1));
        put!(
            self,
            "<road name=\"{}\" length=\"{length:.9}\" id=\"{}\" junction=\"-1\" rule=\"RHT\">",
            escaped(&street.name),
            street_id(index)
        );
        put!(self, "<link>");
        put!(self, "<predecessor elementType=\"junction\" elementId=\"{from}\"/>");
        put!(self, "<successor elementType=\"junction\" elementId=\"{to}\"/>");
        put!(self, "</link>");
        self.limit(street.profile.limit_kmh);
        self.plan_view(&self.lines[index].clone());
        let heights = street.ends.map(|end| self.layout.nodes[end].height);
        let climb = heights[1] - heights[0];
        self.elevation(heights[0], 3.0 * climb / length.powi(2), -2.0 * climb / length.powi(3));
        put!(self, "<lateralProfile/>");
        self.street_lanes(street, length);
        self.crosswalks(index, street, length);
        self.street_signals(index, street, length);
        put!(self, "</road>");
    }

    fn limit(&mut self, kmh: f64) {
        put!(self, "<type s=\"0\" type=\"town\"><speed max=\"{kmh}\" unit=\"km/h\"/></type>");
    }

    fn plan_view(&mut self, pieces: &[Piece]) {
        put!(self, "<planView>");
        let mut s = 0.0;
        for piece in pieces {
            let (position, heading) = (piece.start.position, piece.start.heading);
            let shape = if piece.curvature == 0.0 {
                "<line/>".to_string()
            } else {
                format!("<arc curvature=\"{:.12}\"/>", piece.curvature)
            };
            put!(
                self,
                "<geometry s=\"{s:.9}\" x=\"{:.9}\" y=\"{:.9}\" hdg=\"{:.12}\" \
                 length=\"{:.9}\">{shape}</geometry>",
                position.x,
                position.y,
                heading,
                piece.length
            );
            s += piece.length;
        }
        put!(self, "</planView>");
    }

    fn elevation(&mut self, a: f64, c: f64, d: f64) {
        put!(
            self,
            "<elevationProfile><elevation s=\"0\" a=\"{a:.9}\" b=\"0\" c=\"{c:.12}\" \
             d=\"{d:.14}\"/></elevationProfile>"
        );
    }

    fn street_lanes(&mut self, street: &Street, length: f64) {
        let profile = street.profile;
        let two = profile.lanes > 1;
        put!(self, "<lanes><laneSection s=\"0\">");
        for side in ["left", "center", "right"] {
            put!(self, "<{side}>");
            if side == "center" {
                let mark = if two { "solid solid" } else { "broken" };
                put!(self, "<lane id=\"0\" type=\"none\" level=\"false\">");
                self.mark(mark, if two { "yellow" } else { "white" }, 0.12, "none");
                put!(self, "</lane>");
            } else {
                let sign = if side == "left" { 1 } else { -1 };
                let mut lanes: Vec<i32> = (1..=profile.sidewalk_id()).collect();
                if side == "left" {
                    lanes.reverse();
                }
                for lane in lanes {
                    self.street_lane(sign, lane, &profile, length);
                }
            }
            put!(self, "</{side}>");
        }
        put!(self, "</laneSection></lanes>");
    }

    fn street_lane(&mut self, sign: i32, lane: i32, profile: &Profile, length: f64) {
        let (driving, walk) = (profile.lanes as i32, profile.sidewalk_id());
        let kind = match lane {
            _ if lane <= driving => "driving",
            _ if lane == walk => "sidewalk",
            _ => "parking",
        };
        put!(self, "<lane id=\"{}\" type=\"{kind}\" level=\"false\">", sign * lane);
        put!(self, "<link/>");
        match kind {
            "driving" => {
                put!(self, "{}", width(0.0, profile.lane, 0.0, 0.0));
                if lane < driving {
                    self.mark("broken", "white", 0.12, "both");
                } else if walk > driving + 1 {
                    self.mark("none", "white", 0.12, "none");
                } else {
                    self.mark("curb", "standard", 0.15, "none");
                }
            }
            "parking" => {
                // The kerb comes forward at both ends, so that crossings are short.
                let (clear, taper) = ((length * 0.2).min(12.0), (length * 0.12).min(7.0));
                let (c, d) = swell(profile.parking, taper);
                put!(self, "{}", width(0.0, 0.0, 0.0, 0.0));
                put!(self, "{}", width(clear, 0.0, c, d));
                put!(self, "{}", width(clear + taper, profile.parking, 0.0, 0.0));
                put!(self, "{}", width(length - clear - taper, profile.parking, -c, -d));
                put!(self, "{}", width(length - clear, 0.0, 0.0, 0.0));
                self.mark("curb", "standard", 0.15, "none");
            }
            _ => {
                put!(self, "{}", width(0.0, profile.sidewalk, 0.0, 0.0));
                self.mark("none", "standard", 0.0, "none");
                self.raised();
            }
        }
        put!(self, "</lane>");
    }

    fn mark(&mut self, kind: &str, color: &str, wide: f64, change: &str) {
        put!(
            self,
            "<roadMark sOffset=\"0\" type=\"{kind}\" weight=\"standard\" color=\"{color}\" \
             width=\"{wide:.2}\" laneChange=\"{change}\"/>"
        );
    }

    fn raised(&mut self) {
        put!(self, "<height sOffset=\"0\" inner=\"{KERB_M}\" outer=\"{KERB_M}\"/>");
    }

    fn crosswalks(&mut self, index: usize, street: &Street, length: f64) {
        let (middle, depth) = CROSSWALK_M;
        let half = street.profile.half();
        put!(self, "<objects>");
        for (end, s) in [(0, middle), (1, length - middle)] {
            put!(
                self,
                "<object type=\"crosswalk\" id=\"{}\" name=\"Crosswalk\" s=\"{s:.6}\" t=\"0\" \
                 zOffset=\"0\" orientation=\"none\" length=\"{:.3}\" width=\"{depth:.3}\" \
                 hdg=\"1.570796326794897\" pitch=\"0\" roll=\"0\" height=\"0\" validLength=\"0\">",
                3000 + 2 * index + end,
                half * 2.0
            );
            put!(self, "<outline>");
            let corners = [(-half, -depth), (half, -depth), (half, depth), (-half, depth)];
            for (u, v) in corners.into_iter().chain([(-half, -depth)]) {
                put!(self, "<cornerLocal u=\"{u:.3}\" v=\"{:.3}\" z=\"0\"/>", v * 0.5);
            }
            put!(self, "</outline></object>");
        }
        put!(self, "</objects>");
    }

    fn street_signals(&mut self, index: usize, street: &Street, length: f64) {
        put!(self, "<signals>");
        for end in [0, 1] {
            let (number, arm) = self.arm(index, end);
            let (s, t) = beside(street, end, length, STOP_M);
            let name = signal_id(index, end);
            let lanes = (arm.incoming(0), arm.incoming(street.profile.lanes - 1));
            match &self.junctions[number].rule {
                Rule::Signals(_) => {
                    self.signal(&name, "Signal", (s, t, 2.8), end, ("1000001", true, None), lanes);
                }
                Rule::Stop(stopped) => {
                    let stops = stopped.iter().any(|arm| {
                        let arm = &self.junctions[number].arms[*arm];
                        (arm.street, arm.end) == (index, end)
                    });
                    if stops {
                        let kind = ("206", false, None);
                        self.signal(&name, "Stop", (s, t, 2.0), end, kind, lanes);
                    }
                }
            }
            // Who turns in here reads the limit a little further on.
            if index.is_multiple_of(3) {
                let (s, across) = beside(street, 1 - end, length, 22.0);
                let t = -across - street.profile.parking * across.signum();
                let kind = ("274", false, Some(street.profile.limit_kmh));
                let name = format!("{}", 8000 + 2 * index + end);
                self.signal(&name, "Speed", (s, t, 2.0), end, kind, lanes);
            }
        }
        put!(self, "</signals>");
    }

    fn signal(
        &mut self,
        id: &str,
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

    fn connecting(&mut self, number: usize, turn: usize) {
        let (junctions, layout) = (self.junctions, self.layout);
        let junction = &junctions[number];
        let Turn { from, to, from_lane, to_lane, sidewalk, ref pieces } = junction.turns[turn];
        let (from, to) = (&junction.arms[from], &junction.arms[to]);
        let length = curve::length(pieces);
        put!(
            self,
            "<road name=\"\" length=\"{length:.9}\" id=\"{}\" junction=\"{}\" rule=\"RHT\">",
            connecting_id(number, turn),
            junction_id(number)
        );
        put!(self, "<link>");
        for (tag, arm) in [("predecessor", from), ("successor", to)] {
            put!(
                self,
                "<{tag} elementType=\"road\" elementId=\"{}\" contactPoint=\"{}\"/>",
                street_id(arm.street),
                if arm.end == 0 { "start" } else { "end" }
            );
        }
        put!(self, "</link>");
        self.limit(from.profile.limit_kmh.min(to.profile.limit_kmh));
        self.plan_view(pieces);
        self.elevation(layout.nodes[junction.node].height, 0.0, 0.0);
        put!(self, "<lateralProfile/>");
        put!(self, "<lanes><laneSection s=\"0\"><center>");
        put!(self, "<lane id=\"0\" type=\"none\" level=\"false\"/>");
        put!(self, "</center><right>");
        self.connecting_lane(
            ("driving", -1),
            (from.incoming(from_lane), to.outgoing(to_lane)),
            (from.profile.lane, to.profile.lane),
            length,
        );
        if sidewalk {
            let walk = |arm: &Arm| arm.profile.sidewalk_id() * arm.incoming(0).signum();
            self.connecting_lane(
                ("sidewalk", -2),
                (walk(from), -walk(to)),
                (from.profile.sidewalk, to.profile.sidewalk),
                length,
            );
        }
        put!(self, "</right></laneSection></lanes>");
        put!(self, "</road>");
    }

    fn connecting_lane(
        &mut self,
        (kind, id): (&str, i32),
        (before, after): (i32, i32),
        (from, to): (f64, f64),
        length: f64,
    ) {
        let (c, d) = swell(to - from, length);
        put!(self, "<lane id=\"{id}\" type=\"{kind}\" level=\"false\">");
        put!(self, "<link><predecessor id=\"{before}\"/><successor id=\"{after}\"/></link>");
        put!(self, "{}", width(0.0, from, c, d));
        if kind == "sidewalk" {
            self.mark("none", "standard", 0.0, "none");
            self.raised();
        } else {
            self.mark("none", "white", 0.12, "none");
        }
        put!(self, "</lane>");
    }

    /// One controller for each group of arms that have green together.
    fn controllers(&mut self, number: usize) {
        let junctions = self.junctions;
        let junction = &junctions[number];
        let Rule::Signals(groups) = &junction.rule else { return };
        for (group, arms) in groups.iter().enumerate() {
            put!(
                self,
                "<controller id=\"{}\" name=\"ctrl{}\" sequence=\"{group}\">",
                controller_id(number, group),
                controller_id(number, group)
            );
            for arm in arms {
                let arm = &junction.arms[*arm];
                put!(self, "<control signalId=\"{}\" type=\"0\"/>", signal_id(arm.street, arm.end));
            }
            put!(self, "</controller>");
        }
    }

    fn junction(&mut self, number: usize) {
        let junctions = self.junctions;
        let junction = &junctions[number];
        put!(
            self,
            "<junction id=\"{}\" name=\"junction{}\" type=\"default\">",
            junction_id(number),
            number
        );
        for (index, turn) in junction.turns.iter().enumerate() {
            let from = &junction.arms[turn.from];
            put!(
                self,
                "<connection id=\"{index}\" incomingRoad=\"{}\" connectingRoad=\"{}\" \
                 contactPoint=\"start\">",
                street_id(from.street),
                connecting_id(number, index)
            );
            put!(self, "<laneLink from=\"{}\" to=\"-1\"/>", from.incoming(turn.from_lane));
            put!(self, "</connection>");
        }
        if let Rule::Signals(groups) = &junction.rule {
            for group in 0..groups.len() {
                put!(
                    self,
                    "<controller id=\"{}\" type=\"0\" sequence=\"{group}\"/>",
                    controller_id(number, group)
                );
            }
        }
        put!(self, "</junction>");
    }

    /// The junction at a street's end, and the street's arm of it.
    fn arm(&self, street: usize, end: usize) -> (usize, Arm) {
        let (number, arm) = self.seats[street][end];
        (number, self.junctions[number].arms[arm].clone())
    }
}

/// Where a pole for those who arrive at `end` stands: `s`, and `t` just behind their kerb.
fn beside(street: &Street, end: usize, length: f64, before_m: f64) -> (f64, f64) {
    let t = street.profile.half() + 0.7;
    if end == 1 { (length - before_m, -t) } else { (before_m, t) }
}

fn street_id(index: usize) -> usize {
    index + 1
}

fn junction_id(number: usize) -> usize {
    500 + number
}

fn connecting_id(number: usize, turn: usize) -> usize {
    CONNECTING + number * 32 + turn
}

fn signal_id(street: usize, end: usize) -> String {
    format!("{}", 6000 + 2 * street + end)
}

fn controller_id(number: usize, group: usize) -> usize {
    7000 + number * 4 + group
}

/// Coefficients c and d of a cubic that grows by `by` over `length` with level ends.
fn swell(by: f64, length: f64) -> (f64, f64) {
    (3.0 * by / length.powi(2), -2.0 * by / length.powi(3))
}

fn width(offset: f64, a: f64, c: f64, d: f64) -> String {
    format!("<width sOffset=\"{offset:.6}\" a=\"{a:.6}\" b=\"0\" c=\"{c:.12}\" d=\"{d:.14}\"/>")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
