//! Connecting roads, and the junctions that list them.

use std::fmt::Write as _;

use crate::{
    curve,
    junction::{Arm, Rule, Turn},
    street::Class,
    write::document::{Document, cubic_rise, put, street_id, width},
};

impl Document<'_> {
    pub(super) fn connecting(&mut self, number: usize, turn: usize) {
        let (junctions, layout) = (self.junctions, self.layout);
        let junction = &junctions[number];
        let Turn { from, to, lanes, edges, ref pieces } = junction.turns[turn];
        let (from, to) = (&junction.arms[from], &junction.arms[to]);
        let length = curve::length(pieces);
        put!(
            self,
            "<road name=\"\" length=\"{length:.9}\" id=\"{}\" junction=\"{}\">",
            self.numbers.connecting_id(number, turn),
            self.numbers.junction_id(number)
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
        let limit = from.profile.limit_kmh.min(to.profile.limit_kmh);
        self.limit(from.profile.class.min(to.profile.class), limit);
        self.plan_view(pieces);
        let height = layout.height(junction.node);
        self.elevation(&[[0.0, height, 0.0], [length, height, 0.0]]);
        put!(self, "<lanes><laneSection s=\"0\">");
        if edges[1] {
            put!(self, "<left>");
            let ids = (from.edge_lane(from.out_side()), to.edge_lane(to.in_side()));
            self.edge(1, ids, (from, from.out_side()), (to, to.in_side()), length);
            put!(self, "</left>");
        }
        put!(self, "<center><lane id=\"0\" type=\"none\" level=\"false\">");
        // The line of the shoulder continues.
        if edges[1] {
            self.mark("solid", "white", 0.15, "none");
        }
        put!(self, "</lane></center><right>");
        let mut next = -1;
        if let Some((from_lane, to_lane)) = lanes {
            let (c, d) = cubic_rise(to.profile.lane - from.profile.lane, length);
            put!(self, "<lane id=\"-1\" type=\"driving\" level=\"false\">");
            self.links((from.incoming(from_lane), to.outgoing(to_lane)));
            put!(self, "{}", width(0.0, from.profile.lane, c, d));
            let fast = from.profile.class >= Class::Rural && to.profile.class >= Class::Rural;
            let beside =
                from.profile.class == Class::Motorway && to.profile.class == Class::Motorway;
            let kind = match (edges[0] && fast, beside) {
                (true, _) => "solid",
                (false, true) => "broken",
                (false, false) => "none",
            };
            self.mark(kind, "white", 0.12, "none");
            put!(self, "</lane>");
            next = -2;
        }
        if edges[0] {
            let ids = (from.edge_lane(from.in_side()), to.edge_lane(to.out_side()));
            self.edge(next, ids, (from, from.in_side()), (to, to.out_side()), length);
        }
        put!(self, "</right></laneSection></lanes>");
        put!(self, "</road>");
    }

    fn links(&mut self, (before, after): (i32, i32)) {
        put!(self, "<link><predecessor id=\"{before}\"/><successor id=\"{after}\"/></link>");
    }

    /// Writes a sidewalk or shoulder along a corner.
    fn edge(
        &mut self,
        id: i32,
        links: (i32, i32),
        (from, out): (&Arm, usize),
        (to, into): (&Arm, usize),
        length: f64,
    ) {
        let streets = &self.layout.streets;
        let (a, b) = (from.edge(streets, out), to.edge(streets, into));
        let (c, d) = cubic_rise(b - a, length);
        let walk = from.profile.sidewalk[out] > 0.0;
        let kind = if walk { "sidewalk" } else { "shoulder" };
        put!(self, "<lane id=\"{id}\" type=\"{kind}\" level=\"false\">");
        self.links(links);
        put!(self, "{}", width(0.0, a, c, d));
        self.mark("none", "standard", 0.0, "none");
        if walk {
            self.raised();
        }
        put!(self, "</lane>");
    }

    /// Writes one controller for each group of arms that have green together.
    pub(super) fn controllers(&mut self, number: usize) {
        let junctions = self.junctions;
        let junction = &junctions[number];
        let Rule::Signals(groups) = &junction.rule else { return };
        for (group, arms) in groups.iter().enumerate() {
            let id = self.numbers.controller_id(number, group);
            put!(self, "<controller id=\"{id}\" name=\"ctrl{id}\" sequence=\"{group}\">");
            for arm in arms {
                let arm = &junction.arms[*arm];
                let signal = self.numbers.signal_id(arm.street, arm.end);
                put!(self, "<control signalId=\"{signal}\" type=\"0\"/>");
            }
            put!(self, "</controller>");
        }
    }

    pub(super) fn junction(&mut self, number: usize) {
        let junctions = self.junctions;
        let junction = &junctions[number];
        put!(
            self,
            "<junction id=\"{}\" name=\"junction{}\">",
            self.numbers.junction_id(number),
            number
        );
        for (index, turn) in junction.turns.iter().enumerate() {
            let from = &junction.arms[turn.from];
            put!(
                self,
                "<connection id=\"{index}\" incomingRoad=\"{}\" connectingRoad=\"{}\" \
                 contactPoint=\"start\">",
                street_id(from.street),
                self.numbers.connecting_id(number, index)
            );
            if let Some((lane, _)) = turn.lanes {
                put!(self, "<laneLink from=\"{}\" to=\"-1\"/>", from.incoming(lane));
            } else {
                put!(self, "<laneLink from=\"{}\" to=\"-1\"/>", from.edge_lane(from.in_side()));
            }
            put!(self, "</connection>");
        }
        if let Rule::Signals(groups) = &junction.rule {
            for group in 0..groups.len() {
                let id = self.numbers.controller_id(number, group);
                put!(self, "<controller id=\"{id}\" type=\"0\" sequence=\"{group}\"/>");
            }
        }
        put!(self, "</junction>");
    }
}
