//! The stretches of tracks that agents occupy.

use glam::Vec2;

use crate::{
    agents::Crowd,
    grid::{Grid, REACH_M},
    params::Dials,
    tracks::Tracks,
};

/// Half the width of the corridor along a track that must be free of others: half of a wide car,
/// and a hand's breadth.
const CORRIDOR_M: f32 = 1.35;
/// Who is farther from a track in height is on another storey.
const STOREY_M: f32 = 3.0;
/// Nobody heeds who is farther away.
const HEEDED_M: f32 = 300.0;

/// A stretch of a track that a body occupies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Occupant {
    pub(crate) lane: u32,
    /// Index into the crowd.
    pub(crate) body: u32,
    /// Arc length of its hindmost point on the track.
    pub(crate) rear_m: f32,
    /// Arc length of its foremost point on the track.
    pub(crate) front_m: f32,
    /// Along the track.
    pub(crate) speed_mps: f32,
    /// Cosine of the angle between its nose and the track.
    pub(crate) aligned: f32,
}

/// All occupants, sorted by lane and from behind to the front.
#[derive(Default)]
pub(crate) struct Occupancy {
    list: Vec<Occupant>,
    /// By lane: where its occupants begin and end in the list.
    spans: Vec<(u32, u32)>,
    /// Whom somebody ignores: who, and whom; sorted.
    unseen: Vec<(u32, u32)>,
    /// How those lie who stand, in this plan and in the one before.
    standing: [Standing; 2],
}

/// Who stands still lies as in the plan before: bodies by id, what decides how they lie, and how
/// many of the occupants are theirs.
#[derive(Default)]
struct Standing {
    bodies: Vec<(u32, [u32; 13], u32)>,
    occupants: Vec<Occupant>,
}

impl Standing {
    fn keep(&mut self, id: u32, how: [u32; 13], occupants: &[Occupant]) {
        self.bodies.push((id, how, occupants.len() as u32));
        self.occupants.extend_from_slice(occupants);
    }

    fn clear(&mut self) {
        self.bodies.clear();
        self.occupants.clear();
    }
}

impl Occupancy {
    /// Whether one body heeds another, which must be another than itself.
    pub(crate) fn minds(&self, own: u32, other: u32) -> bool {
        own != other
            && (self.unseen.is_empty() || self.unseen.binary_search(&(own, other)).is_err())
    }

    /// Takes down whom everybody ignores.
    pub(crate) fn overlook(&mut self, crowd: &Crowd, params: &Dials, seed: u64) {
        self.unseen.clear();
        if !params.some_ignore() {
            return;
        }
        for &own in &crowd.driven {
            let place = crowd.position[own as usize];
            for other in 0..crowd.count() {
                let near = crowd.position[other].distance_squared(place) < HEEDED_M * HEEDED_M;
                let id = crowd.id[own as usize];
                if near && params.ignores(seed, id, crowd.id[other], crowd.walks[other]) {
                    self.unseen.push((own, other as u32));
                }
            }
        }
        self.unseen.sort_unstable();
    }

    /// Lays every body onto the tracks that it touches.
    ///
    /// `claims` are (body, lane, arc length of the origin): stretches that a vehicle is about to
    /// use though it is not there yet.
    pub(crate) fn lay(
        &mut self,
        tracks: &Tracks,
        grid: &Grid,
        crowd: &Crowd,
        claims: &[(u32, u32, f32)],
    ) {
        self.spans.resize(tracks.count(), (0, 0));
        for occupant in &self.list {
            self.spans[occupant.lane as usize] = (0, 0);
        }
        self.list.clear();
        self.lay_bodies(tracks, grid, crowd);
        for &(body, lane, arc_m) in claims {
            let crowd_index = body as usize;
            let size = crowd.body[crowd_index];
            let tangent = tracks.at(lane, arc_m).1;
            self.list.push(Occupant {
                lane,
                body,
                rear_m: arc_m - size.rear_m,
                front_m: arc_m + size.front_m,
                speed_mps: crowd.velocity[crowd_index].dot(tangent),
                aligned: 1.0,
            });
        }
        self.list.sort_unstable_by_key(|o| (o.lane, ordered(o.rear_m), o.body));
        let mut begin = 0;
        for end in 1..=self.list.len() {
            if end == self.list.len() || self.list[end].lane != self.list[begin].lane {
                self.spans[self.list[begin].lane as usize] = (begin as u32, end as u32);
                begin = end;
            }
        }
    }

    /// Occupants of `lane`, from behind to the front.
    pub(crate) fn on(&self, lane: u32) -> &[Occupant] {
        let (begin, end) = self.spans[lane as usize];
        &self.list[begin as usize..end as usize]
    }

    fn lay_bodies(&mut self, tracks: &Tracks, grid: &Grid, crowd: &Crowd) {
        let [mut before, mut now] = std::mem::take(&mut self.standing);
        now.clear();
        let (mut known, mut theirs) = (before.bodies.iter().peekable(), &before.occupants[..]);
        for body in 0..crowd.count() {
            if crowd.velocity[body] != Vec2::ZERO {
                self.lay_body(tracks, grid, crowd, body);
                continue;
            }
            let (id, how) = (crowd.id[body], crowd.lies(body));
            let begin = self.list.len();
            let mut is_known = false;
            // Both are sorted by id.
            while let Some(&(other, was, count)) = known.next_if(|(other, ..)| *other <= id) {
                let (first, rest) = theirs.split_at(count as usize);
                theirs = rest;
                if other == id && was == how {
                    let body = body as u32;
                    self.list.extend(first.iter().map(|was| Occupant { body, ..*was }));
                    is_known = true;
                }
            }
            if !is_known {
                self.lay_body(tracks, grid, crowd, body);
            }
            now.keep(id, how, &self.list[begin..]);
        }
        before.clear();
        self.standing = [now, before];
    }

    fn lay_body(&mut self, tracks: &Tracks, grid: &Grid, crowd: &Crowd, body: usize) {
        let position = crowd.position[body];
        let (flat, forward) = (position.truncate(), crowd.forward[body]);
        let size = crowd.body[body];
        let begin = self.list.len();
        let reach = REACH_M - CORRIDOR_M - 0.5;
        // A long vehicle is looked up from several points along it.
        let points = (size.length_m() / (2.0 * reach)).ceil().max(1.0) as usize;
        for point in 0..points {
            let part = (point as f32 + 0.5) / points as f32;
            let along = size.length_m() * part - size.rear_m;
            let at = flat + forward * along;
            for &(lane, hint_m) in grid.near(at) {
                let seen = points > 1 && self.list[begin..].iter().any(|o| o.lane == lane);
                if seen {
                    continue;
                }
                if let Some(occupant) = lay_on(tracks, crowd, body, lane, at, hint_m)
                    && (tracks.at(lane, occupant.rear_m).0.z - position.z).abs() < STOREY_M
                {
                    self.list.push(occupant);
                }
            }
        }
    }
}

/// The stretch of `lane`'s corridor that a body covers; the track is taken as straight under it.
fn lay_on(
    tracks: &Tracks,
    crowd: &Crowd,
    body: usize,
    lane: u32,
    near: Vec2,
    hint_m: f32,
) -> Option<Occupant> {
    let size = crowd.body[body];
    let seat = tracks.project(lane, near, hint_m);
    let forward = crowd.forward[body];
    let (cos, sin) = (seat.tangent.dot(forward), seat.tangent.perp_dot(forward));
    // Quickly out: farther from the track than the body reaches.
    let reach = size.length_m() * sin.abs() + size.half_width_m * cos.abs() + CORRIDOR_M;
    if seat.left_m.abs() > reach {
        return None;
    }
    let offset = crowd.position[body].truncate() - near;
    let origin_arc = seat.arc_m + seat.tangent.dot(offset);
    let origin_left = seat.left_m + seat.tangent.perp_dot(offset);
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
        body: body as u32,
        rear_m: low,
        front_m: high,
        speed_mps: crowd.velocity[body].dot(seat.tangent),
        aligned: cos,
    })
}

/// The extent along the first axis of the part of a box whose second axis is within ±`half`.
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

/// A number's place in the order of all numbers, as an integer.
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
        // A car across the track whose nose just reaches into the corridor.
        let across = [(1.0, 3.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, 3.0)];
        assert_eq!(clip(&across, 1.35), Some((-1.0, 1.0)));
        assert_eq!(clip(&across, 0.5), None);
        // A car on the track.
        let along = [(2.0, 1.0), (-2.0, 1.0), (-2.0, -1.0), (2.0, -1.0)];
        assert_eq!(clip(&along, 1.35), Some((-2.0, 2.0)));
    }

    #[test]
    fn who_stands_lies_as_if_looked_at_for_the_first_time() {
        use crate::tests::maps;
        use protocol::{ActorId, Pose};

        let tracks = Tracks::new(&maps::loop_road(40.0, 60.0));
        let (grid, bodies) = (Grid::new(&tracks), Bodies::from_catalogue());
        let (blueprint, _) = town::blueprint("vehicle.tesla.model3").expect("it is there");
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
            let (crowd, afresh) = (&mut Crowd::default(), &mut Occupancy::default());
            crowd.read(&actors, &bodies);
            kept.lay(&tracks, &grid, crowd, &[]);
            afresh.lay(&tracks, &grid, crowd, &[]);
            assert!(kept.list.len() >= actors.len() / 2, "they lie on the road");
            assert_eq!(format!("{:?}", kept.list), format!("{:?}", afresh.list), "frame {frame}");
            // Some move, one goes, one comes.
            actors[10].pose = Pose::level(along(10, frame as f32), 0.0);
            actors[20].velocity_mps = [frame as f32, 0.0, 0.0];
            actors[15].blueprint += 1;
            actors.remove(5);
            let last = *actors.last().expect("some");
            actors.push(ActorState { actor_id: ActorId(last.actor_id.0 + 1), ..last });
        }
    }

    #[test]
    fn numbers_keep_their_order_as_integers() {
        let numbers = [-10.0, -0.5, 0.0, 0.25, 3.0, 100.0];
        assert!(numbers.windows(2).all(|w| ordered(w[0]) < ordered(w[1])));
    }
}
