//! The stretches of tracks that agents occupy.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

use crate::{
    agents::{Agents, PoseBits},
    grid::{Grid, Pass, REACH_M},
    params::Params,
    spread::Spread,
    tracks::{HINT_M, NONE, Tracks, lookup::FlatPlace},
};

/// Half the width of the corridor along a track that must be free: half of a wide car, and a
/// clearance.
const CORRIDOR_M: f32 = 1.35;
/// Largest height difference between an agent and its track.
const STOREY_M: f32 = 3.0;
/// Largest distance at which parameters to ignore agents are evaluated.
const IGNORE_RANGE_M: f32 = 300.0;

/// The stretch of a track that an agent occupies.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Occupant {
    pub(crate) lane: u32,
    /// Index into the agents.
    pub(crate) agent: u32,
    /// Arc length of its rearmost point on the track.
    pub(crate) rear_m: f32,
    /// Arc length of its foremost point on the track.
    pub(crate) front_m: f32,
    /// Speed along the track.
    pub(crate) speed_mps: f32,
    /// Cosine of the angle between the agent's heading and the track.
    pub(crate) aligned: f32,
}

/// All occupants, those of a lane side by side and sorted by arc length of the rear.
#[derive(Default)]
pub(crate) struct Occupancy {
    list: Vec<Occupant>,
    /// By lane: begin and end of its occupants in the list.
    spans: Vec<(u32, u32)>,
    /// Lanes that have occupants.
    used: Vec<u32>,
    /// Pairs of a vehicle and an agent that it ignores; sorted.
    ignored: Vec<(u32, u32)>,
    /// The occupants of all agents in this frame and in the frame before.
    placed: [Placed; 2],
}

/// The occupants of agents, in the order of the agents. Those of a standing agent are the same in the
/// next frame.
#[derive(Default)]
struct Placed {
    id: Vec<u32>,
    /// By agent: the bits that decide which stretches it occupies, if it stands.
    key: Vec<Option<PoseBits>>,
    /// By agent: the index of its first occupant, and the number of all.
    first: Vec<u32>,
    occupants: Vec<Occupant>,
}

impl Placed {
    /// Returns the occupants of an agent.
    fn of(&self, agent: usize) -> &[Occupant] {
        &self.occupants[self.first[agent] as usize..self.first[agent + 1] as usize]
    }
}

impl Occupancy {
    /// Returns whether `own` reacts to `other`: another agent that it does not ignore.
    pub(crate) fn reacts_to(&self, own: u32, other: u32) -> bool {
        own != other
            && (self.ignored.is_empty() || self.ignored.binary_search(&(own, other)).is_err())
    }

    /// Determines which agents each vehicle ignores by its parameters.
    pub(crate) fn apply_ignores(&mut self, agents: &Agents, params: &Params, seed: u64) {
        self.ignored.clear();
        if !params.any_ignores() {
            return;
        }
        for &own in &agents.driven {
            let place = agents.position[own as usize];
            for other in agents.places.near(place.truncate(), IGNORE_RANGE_M) {
                let other = other as usize;
                let near = agents.position[other].distance_squared(place)
                    < IGNORE_RANGE_M * IGNORE_RANGE_M;
                let id = agents.id[own as usize];
                if near && params.ignores(seed, id, agents.id[other], agents.walks[other]) {
                    self.ignored.push((own, other as u32));
                }
            }
        }
        self.ignored.sort_unstable();
    }

    /// Makes vehicles ignore agents: pairs of both, as indices into the agents.
    pub(crate) fn ignore(&mut self, pairs: &[(u32, u32)]) {
        if !pairs.is_empty() {
            self.ignored.extend_from_slice(pairs);
            self.ignored.sort_unstable();
        }
    }

    /// Determines the stretches of tracks that each agent occupies.
    ///
    /// `claims` are (agent, lane, arc length of the origin): stretches of lanes that a vehicle is
    /// changing to.
    pub(crate) fn rebuild(
        &mut self,
        tracks: &Tracks,
        grid: &Grid,
        agents: &Agents,
        claims: &[(u32, u32, f32)],
        spread: Spread,
    ) {
        self.spans.resize(tracks.count(), (0, 0));
        for lane in self.used.drain(..) {
            self.spans[lane as usize] = (0, 0);
        }
        self.place_agents(tracks, grid, agents, spread);
        let claims = claims.iter().map(|&(agent, lane, arc_m)| {
            let index = agent as usize;
            let size = agents.body[index];
            let tangent = tracks.at(lane, arc_m).1;
            Occupant {
                lane,
                agent,
                rear_m: arc_m - size.rear_m,
                front_m: arc_m + size.front_m,
                speed_mps: agents.velocity[index].dot(tangent),
                aligned: 1.0,
            }
        });
        let claims: Vec<Occupant> = claims.collect();
        self.sort(&claims, spread);
    }

    /// Sorts the occupants of agents and `claims` by lane, and those of a lane by arc length.
    fn sort(&mut self, claims: &[Occupant], spread: Spread) {
        let Occupancy { list, spans, used, placed: [placed, _], .. } = self;
        let all = || placed.occupants.iter().chain(claims);
        for occupant in all() {
            let span = &mut spans[occupant.lane as usize];
            if span.1 == 0 {
                used.push(occupant.lane);
            }
            span.1 += 1;
        }
        let mut begin = 0;
        for &lane in &*used {
            let span = &mut spans[lane as usize];
            let count = span.1;
            *span = (begin, begin);
            begin += count;
        }
        list.resize(begin as usize, Occupant::zeroed());
        for occupant in all() {
            let span = &mut spans[occupant.lane as usize];
            list[span.1 as usize] = *occupant;
            span.1 += 1;
        }
        // Equal ones are in the order of the agents, which no thread changes.
        let sort = |of_lane: &mut [Occupant]| of_lane.sort_by_key(|o| (ordered(o.rear_m), o.agent));
        spread.groups(list, |a, b| a.lane == b.lane, sort);
    }

    /// Returns the occupants of `lane`, ascending by arc length of the rear.
    pub(crate) fn on(&self, lane: u32) -> &[Occupant] {
        let (begin, end) = self.spans[lane as usize];
        &self.list[begin as usize..end as usize]
    }

    /// Determines the stretches of all agents; those of standing agents are kept.
    fn place_agents(&mut self, tracks: &Tracks, grid: &Grid, agents: &Agents, spread: Spread) {
        let [before, mut now] = std::mem::take(&mut self.placed);
        let rows_before = before.rows_of(&agents.id);
        let stands = |agent: usize| agents.velocity[agent] == Vec2::ZERO;
        let key = |agent: usize| stands(agent).then(|| agents.pose_bits(agent));
        spread.map_into(agents.count(), &mut now.key, key);
        let placed = (&mut now.occupants, &mut now.first);
        spread.ragged(agents.count(), placed, |agent, occupants| {
            let row = rows_before.as_ref().map_or(agent as u32, |rows| rows[agent]);
            let key = &now.key[agent];
            if key.is_some() && row != NONE && before.key[row as usize] == *key {
                let agent = agent as u32;
                let kept = before.of(row as usize).iter();
                occupants.extend(kept.map(|kept| Occupant { agent, ..*kept }));
            } else {
                add_agent(tracks, grid, agents, agent, occupants);
            }
        });
        now.id.clone_from(&agents.id);
        self.placed = [now, before];
    }
}

impl Placed {
    /// Returns for each id the agent that it had in this frame, or [`NONE`]; nothing if all agents
    /// are the same. Both lists ascend.
    fn rows_of(&self, ids: &[u32]) -> Option<Vec<u32>> {
        if self.id == ids {
            return None;
        }
        let mut at = 0;
        let rows = ids.iter().map(|&id| {
            while self.id.get(at).is_some_and(|&other| other < id) {
                at += 1;
            }
            if self.id.get(at) == Some(&id) { at as u32 } else { NONE }
        });
        Some(rows.collect())
    }
}

/// Adds the stretches of one agent.
fn add_agent(
    tracks: &Tracks,
    grid: &Grid,
    agents: &Agents,
    agent: usize,
    occupants: &mut Vec<Occupant>,
) {
    let position = agents.position[agent];
    let (flat, forward) = (position.truncate(), agents.forward[agent]);
    let size = agents.body[agent];
    let begin = occupants.len();
    let reach = REACH_M - CORRIDOR_M - 0.5;
    // A long vehicle is looked up at several points along it.
    let points = (size.length_m() / (2.0 * reach)).ceil().max(1.0) as usize;
    for point in 0..points {
        let part = (point as f32 + 0.5) / points as f32;
        let along = size.length_m() * part - size.rear_m;
        let at = flat + forward * along;
        for pass in grid.near(at) {
            let lane = pass.lane;
            let is_listed = points > 1 && occupants[begin..].iter().any(|o| o.lane == lane);
            if is_listed {
                continue;
            }
            if let Some(occupant) = occupied_stretch(tracks, agents, agent, pass, at)
                && (tracks.is_level_with(lane, position.z, STOREY_M)
                    || (tracks.height_at(lane, occupant.rear_m) - position.z).abs() < STOREY_M)
            {
                occupants.push(occupant);
            }
        }
    }
}

/// Returns the stretch of `lane`'s corridor that an agent covers; the track is taken as straight
/// under it.
fn occupied_stretch(
    tracks: &Tracks,
    agents: &Agents,
    agent: usize,
    pass: &Pass,
    near: Vec2,
) -> Option<Occupant> {
    // Most tracks around are too far away, which needs no exact projection.
    let size = agents.body[agent];
    let FlatPlace { centre, tangent, .. } = pass.place;
    let offset = near - centre;
    let (along_m, left_m) = (tangent.dot(offset), tangent.perp_dot(offset));
    let off_m = along_m.abs();
    let is_beyond = pass.end * along_m > size.length_m() + size.half_width_m;
    let bend_m = pass.bend_per_m * off_m * (off_m + size.length_m());
    let reach_m = reach_m(agents, agent, tangent) + bend_m;
    if is_beyond || (off_m < HINT_M && left_m.abs() > reach_m) {
        return None;
    }
    exact_stretch(tracks, agents, agent, pass, near)
}

/// Returns how far beside a track of this direction an agent can be that covers its corridor.
fn reach_m(agents: &Agents, agent: usize, tangent: Vec2) -> f32 {
    let (size, forward) = (agents.body[agent], agents.forward[agent]);
    let (along, across) = (tangent.dot(forward).abs(), tangent.perp_dot(forward).abs());
    size.length_m() * across + size.half_width_m * along + CORRIDOR_M
}

/// As [`occupied_stretch`], without the early exit.
fn exact_stretch(
    tracks: &Tracks,
    agents: &Agents,
    agent: usize,
    pass: &Pass,
    near: Vec2,
) -> Option<Occupant> {
    let (size, lane) = (agents.body[agent], pass.lane);
    let projection = tracks.project_from(lane, near, pass.hint_m, pass.place);
    let forward = agents.forward[agent];
    let (cos, sin) = (projection.tangent.dot(forward), projection.tangent.perp_dot(forward));
    if projection.left_m.abs() > reach_m(agents, agent, projection.tangent) {
        return None;
    }
    let offset = agents.position[agent].truncate() - near;
    let origin_arc = projection.arc_m + projection.tangent.dot(offset);
    let origin_left = projection.left_m + projection.tangent.perp_dot(offset);
    let corner = |along: f32, left: f32| {
        (origin_arc + along * cos - left * sin, origin_left + along * sin + left * cos)
    };
    let (front, rear, half) = (size.front_m, -size.rear_m, size.half_width_m);
    let corners =
        [corner(front, half), corner(rear, half), corner(rear, -half), corner(front, -half)];
    let (low, high) = clip(&corners, CORRIDOR_M)?;
    if high < 0.0 || low > tracks.length(lane) {
        return None;
    }
    Some(Occupant {
        lane,
        agent: agent as u32,
        rear_m: low,
        front_m: high,
        speed_mps: agents.velocity[agent].dot(projection.tangent),
        aligned: cos,
    })
}

/// Returns the extent along the first axis of the part of a box whose second axis is within
/// ±`half`.
fn clip(corners: &[(f32, f32); 4], half: f32) -> Option<(f32, f32)> {
    let mut extent = (f32::INFINITY, f32::NEG_INFINITY);
    let mut take = |along: f32| extent = (extent.0.min(along), extent.1.max(along));
    for k in 0..4 {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        if a.1.abs() <= half {
            take(a.0);
        }
        for edge in [-half, half] {
            if (a.1 - edge) * (b.1 - edge) < 0.0 {
                take(a.0 + (b.0 - a.0) * (edge - a.1) / (b.1 - a.1));
            }
        }
    }
    (extent.0 <= extent.1).then_some(extent)
}

/// Returns an integer that orders like the number.
pub(crate) fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Bodies;
    use protocol::{ActorState, kind};

    #[test]
    fn only_the_part_of_a_box_inside_the_corridor_counts() {
        // A car across the track whose front just reaches into the corridor.
        let across = [(1.0, 3.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, 3.0)];
        assert_eq!(clip(&across, 1.35), Some((-1.0, 1.0)));
        assert_eq!(clip(&across, 0.5), None);
        // A car on the track.
        let along = [(2.0, 1.0), (-2.0, 1.0), (-2.0, -1.0), (2.0, -1.0)];
        assert_eq!(clip(&along, 1.35), Some((-2.0, 2.0)));
    }

    #[test]
    fn the_early_exit_loses_no_stretch() {
        use crate::tests::maps;
        use mesh::RandomStream;
        use protocol::{ActorId, Pose};

        let tracks = Tracks::new(&maps::town());
        let (grid, bodies) = (Grid::new(&tracks), Bodies::from_catalogue());
        let mut draws = RandomStream::from_state(1);
        let (mut agents, mut covered, mut skipped) = (Agents::default(), 0, 0);
        for lane in (0..tracks.count() as u32).filter(|&lane| tracks.has(lane)) {
            for _ in 0..8 {
                let (point, tangent, _) = tracks.at(lane, draws.unit() * tracks.length(lane));
                let beside = tangent.perp() * draws.between(-6.0, 6.0);
                let yaw = tangent.to_angle() + draws.between(-0.4, 0.4);
                let pose = Pose::level(point + beside.extend(0.0), yaw);
                let (blueprint, kind) = (u32::MAX, kind::VEHICLE);
                let actor_id = ActorId(1);
                let actor = ActorState { actor_id, kind, blueprint, pose, ..Default::default() };
                agents.read(&[actor], &bodies);
                let near = agents.position[0].truncate();
                for pass in grid.near(near) {
                    let exact = exact_stretch(&tracks, &agents, 0, pass, near).is_some();
                    let found = occupied_stretch(&tracks, &agents, 0, pass, near).is_some();
                    assert!(found || !exact, "lane {lane} at {near} {yaw}");
                    covered += usize::from(exact);
                    skipped += usize::from(!found);
                }
            }
        }
        assert!(covered > 1000 && skipped > 1000, "{covered} {skipped}");
    }

    #[test]
    fn cached_occupants_of_standing_agents_equal_fresh_ones() {
        use crate::tests::maps;
        use protocol::{ActorId, Pose};

        let tracks = Tracks::new(&maps::loop_road(40.0, 60.0));
        let (grid, bodies) = (Grid::new(&tracks), Bodies::from_catalogue());
        let (blueprint, _) =
            town::blueprint("vehicle.tesla.model3").expect("a blueprint of the catalogue");
        let along = |k: u32, shift_m: f32| {
            let arc_m = (7.0 * k as f32 + shift_m) % tracks.length(0);
            tracks.at(0, arc_m).0
        };
        let mut actors: Vec<_> = (1..40)
            .map(|k| ActorState {
                actor_id: ActorId(k),
                kind: if k % 3 == 0 { kind::PROP } else { kind::VEHICLE },
                blueprint: blueprint + k % 2,
                pose: Pose::level(along(k, 0.0), 0.3 * k as f32),
                ..ActorState::default()
            })
            .collect();
        let mut kept = Occupancy::default();
        for frame in 0..6 {
            let (agents, fresh) = (&mut Agents::default(), &mut Occupancy::default());
            agents.read(&actors, &bodies);
            kept.rebuild(&tracks, &grid, agents, &[], Spread::Alone);
            fresh.rebuild(&tracks, &grid, agents, &[], Spread::Alone);
            assert!(kept.list.len() >= actors.len() / 2, "half of the agents lie on the road");
            assert_eq!(format!("{:?}", kept.list), format!("{:?}", fresh.list), "frame {frame}");
            // Some agents move, one leaves, one is added.
            actors[10].pose = Pose::level(along(10, frame as f32), 0.0);
            actors[20].velocity_mps = [frame as f32, 0.0, 0.0];
            actors[15].blueprint += 1;
            actors.remove(5);
            let last = *actors.last().expect("at least one actor");
            actors.push(ActorState { actor_id: ActorId(last.actor_id.0 + 1), ..last });
        }
    }

    #[test]
    fn numbers_keep_their_order_as_integers() {
        let numbers = [-10.0, -0.5, 0.0, 0.25, 3.0, 100.0];
        assert!(numbers.windows(2).all(|w| ordered(w[0]) < ordered(w[1])));
    }
}
