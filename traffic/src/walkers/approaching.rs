//! The vehicles that approach crossings.

use super::view::View;
use crate::grid::Pass;
use crate::tracks::NONE;

/// Distance along lanes up to which vehicles are looked for. Metres.
const AHEAD_M: f32 = 90.0;
/// Most lanes that one vehicle is followed over.
const LANES_MAX: usize = 24;
/// Cosine of the largest angle between a vehicle and the lane on which it drives.
const ALIGNED: f32 = 0.7;

/// A vehicle on its way to a crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Approach {
    pub(super) crossing: u32,
    /// From its front bumper to the middle of the crossing; negative when that is passed.
    pub(super) ahead_m: f32,
    pub(super) speed_mps: f32,
    pub(super) length_m: f32,
    /// Whether this planner drives it, so that it waits for walkers on the crossing.
    pub(super) is_planned: bool,
}

/// All approaches of a frame, by crossing.
#[derive(Default)]
pub(super) struct Approaching(Vec<Approach>);

impl Approaching {
    /// Finds the approaches of all vehicles: along the route of those that this planner drives, and
    /// along every way that the others may take.
    pub(super) fn find(&mut self, view: &View<'_>) {
        self.0.clear();
        let agents = view.agents;
        for agent in 0..agents.count() {
            if agents.walks[agent] || agents.is_prop[agent] {
                continue;
            }
            let row = agents.row[agent] as usize;
            if agents.row[agent] != NONE && view.vehicles[row].located == 1 {
                let lanes = view.vehicles[row].route.lanes();
                let mut start_m = -view.vehicles[row].arc_m;
                for &lane in lanes {
                    if start_m > AHEAD_M {
                        break;
                    }
                    self.add(view, agent, lane, start_m, true);
                    start_m += view.map.tracks.length(lane);
                }
            } else {
                self.follow(view, agent);
            }
        }
        self.0.sort_by_key(|approach| approach.crossing);
    }

    /// Returns the approaches of one crossing.
    pub(super) fn of(&self, crossing: u32) -> &[Approach] {
        let begin = self.0.partition_point(|approach| approach.crossing < crossing);
        let count = self.0[begin..].partition_point(|approach| approach.crossing == crossing);
        &self.0[begin..begin + count]
    }

    /// Adds the crossings of a lane that begins `start_m` before the origin of a vehicle.
    fn add(&mut self, view: &View<'_>, agent: usize, lane: u32, start_m: f32, is_planned: bool) {
        let body = view.agents.body[agent];
        for &(_, crossing, arc_m) in view.ground.on_lane(lane) {
            let ahead_m = start_m + arc_m - body.front_m;
            let half_m = view.ground.crossings[crossing as usize].half_width_m;
            if ahead_m > -body.length_m() - half_m && ahead_m < AHEAD_M {
                self.0.push(Approach {
                    crossing,
                    ahead_m,
                    speed_mps: view.agents.speed(agent).max(0.0),
                    length_m: body.length_m(),
                    is_planned,
                });
            }
        }
    }

    /// Adds the crossings on all ways of a vehicle whose route is unknown.
    fn follow(&mut self, view: &View<'_>, agent: usize) {
        let tracks = &view.map.tracks;
        let at = view.agents.position[agent].truncate();
        let mut open: Vec<(u32, f32)> = Vec::new();
        for &Pass { lane, hint_m, .. } in view.map.grid.near(at) {
            let on = tracks.project(lane, at, hint_m);
            let is_on = (0.0..=tracks.length(lane)).contains(&on.arc_m);
            let along = on.tangent.dot(view.agents.forward[agent]);
            if is_on && on.left_m.abs() < 2.5 && along > ALIGNED {
                open.push((lane, -on.arc_m));
            }
        }
        let mut seen = 0;
        while let Some((lane, start_m)) = open.pop() {
            seen += 1;
            if seen > LANES_MAX {
                return;
            }
            self.add(view, agent, lane, start_m, false);
            let next_m = start_m + tracks.length(lane);
            if next_m < AHEAD_M {
                open.extend(tracks.next(lane).iter().map(|next| (*next, next_m)));
            }
        }
    }
}
