//! Vehicles that nothing is near: each moves through the whole frame alone, on any thread.
//!
//! Most vehicles touch nothing for most of the time. Such a vehicle needs no contact solver, so
//! its body is disabled in the rigid-body world, and one thread moves it through all substeps of a
//! frame while its state is in the cache. A vehicle is *solo* in a frame if the box that it can reach
//! during the frame touches neither that of another solid body nor a static box. Which vehicles
//! are solo follows from the state at the beginning of the frame, and no result depends on the
//! number of threads.

use glam::{Mat3, Quat, Vec3};
use rapier3d::prelude::{Pose, RigidBody, RigidBodySet};

use super::{
    actor::{Actor, Kind, put_back, take_out},
    body_state::BodyState,
    bound::Bound,
    model::GRAVITY_MPS2,
    motion::{Motion, Twist},
    parallel::for_each,
    rigid_body::origin_mps,
    wheels::Surface,
    world::Physics,
};

/// Free space around a vehicle below which it is no longer solo. Metres.
const LEAVE_M: f32 = 0.1;
/// Free space around a vehicle in the rigid-body world from which on it is solo. Metres.
const ENTER_M: f32 = 0.3;
/// Smallest z of the upward axis of a solo vehicle.
const UPRIGHT_MIN: f32 = 0.5;
/// How far a limb lies from the middle of a ragdoll at most, and how fast it may move. Metres.
const RAGDOLL_M: f32 = 2.5;
/// Bounds per thread that are worth a thread: about half a millisecond.
const LEAST_BOUNDS: usize = 1000;
/// Vehicles times substeps per thread that are worth a thread.
const LEAST_SUBSTEPS: usize = 400;

/// A body that may be in the way of a vehicle.
struct Neighbour {
    /// Index of the actor.
    actor: usize,
    bound: Bound,
    /// Whether the actor is a vehicle that is solo unless another body is near.
    may_be_solo: bool,
}

impl Physics {
    /// Finds the vehicles that are solo in the coming frame, and enables the bodies of the others.
    pub(super) fn separate(&mut self, frame_s: f32) {
        let Physics { world, actors, statics, threads, .. } = &*self;
        if !actors.awake().any(|actor| matches!(actor.kind, Kind::Vehicle(_))) {
            return;
        }
        let bodies = &world.bodies;
        let mut neighbours: Vec<Neighbour> = Vec::with_capacity(actors.len());
        let nowhere = Bound::ball(Vec3::ZERO, 0.0);
        let is_solid = |actor: &Actor| actor.far.is_none() && !actor.dormant;
        let solid = actors.iter().enumerate().filter(|(_, actor)| is_solid(actor));
        neighbours.extend(solid.map(|(actor, _)| Neighbour {
            actor,
            bound: nowhere,
            may_be_solo: false,
        }));
        for_each(&mut neighbours, *threads, LEAST_BOUNDS, |neighbour| {
            let actor = &actors[neighbour.actor];
            let body = &bodies[actor.body];
            let slack_m = if body.is_enabled() { ENTER_M } else { LEAVE_M };
            neighbour.bound = bound_of(actor, body, frame_s, slack_m);
            neighbour.may_be_solo = may_be_solo(actor, body)
                && (actor.collisions_disabled || {
                    let (pose, shape) = neighbour.bound.cuboid();
                    statics.touching(&pose, &shape).is_none()
                });
        });
        let is_in_the_way = |neighbour: &Neighbour| {
            let actor = &actors[neighbour.actor];
            !actor.collisions_disabled && !actor.kind.is_passable()
        };
        let mut order: Vec<usize> =
            (0..neighbours.len()).filter(|index| is_in_the_way(&neighbours[*index])).collect();
        order.sort_by(|a, b| {
            neighbours[*a].bound.low.x.total_cmp(&neighbours[*b].bound.low.x).then(a.cmp(b))
        });
        let mut is_near = vec![false; neighbours.len()];
        for (place, first) in order.iter().enumerate() {
            let one = &neighbours[*first];
            for second in &order[place + 1..] {
                let other = &neighbours[*second];
                if other.bound.low.x > one.bound.high.x {
                    break;
                }
                if (one.may_be_solo || other.may_be_solo) && one.bound.overlaps(&other.bound) {
                    (is_near[*first], is_near[*second]) = (true, true);
                }
            }
        }
        let decided = (neighbours.iter().zip(is_near))
            .map(|(neighbour, is_near)| (neighbour.actor, neighbour.may_be_solo && !is_near));
        let dormant = actors.iter().enumerate().filter(|(_, actor)| actor.dormant);
        let decided: Vec<(usize, bool)> =
            decided.chain(dormant.map(|(index, _)| (index, true))).collect();
        for (index, is_solo) in decided {
            let actor = &self.actors[index];
            if !matches!(actor.kind, Kind::Vehicle(_)) {
                continue;
            }
            let is_out = !self.world.bodies[actor.body].is_enabled();
            if actor.solo == is_solo && is_out == is_solo {
                continue;
            }
            let Physics { world, actors, .. } = self;
            let actor = actors.wake(index);
            actor.solo = is_solo;
            match (is_out, is_solo) {
                (false, true) => take_out(world, actor),
                (true, false) => put_back(world, actor),
                _ => {}
            }
        }
    }

    /// Moves the solo vehicles through `count` substeps of `dt` seconds. Their bodies stay at the
    /// beginning of the frame until [`Physics::end_solo`].
    pub(super) fn move_solo(&mut self, dt: f32, count: u64) {
        let Physics { world, ground, grip, actors, threads, .. } = self;
        let surface = Surface { ground, grip: *grip };
        let bodies = &world.bodies;
        let mut solo: Vec<&mut Actor> = actors.awake_mut().filter(|actor| actor.solo).collect();
        let least = LEAST_SUBSTEPS.div_ceil(count.max(1) as usize);
        for_each(&mut solo, *threads, least, |actor| {
            move_through(actor, bodies, &surface, dt, count)
        });
    }

    /// Writes the states of solo vehicles at the end of the frame into their bodies.
    pub(super) fn end_solo(&mut self) {
        self.substeps_done = 0;
        let Physics { world, actors, .. } = self;
        for actor in actors.awake_mut().filter(|actor| actor.solo) {
            if let Some(last) = actor.path.last() {
                last.write(&mut world.bodies[actor.body]);
            }
            actor.path.clear();
        }
    }

    /// Returns the state of an actor's body at the end of the newest substep.
    pub(super) fn body_state(&self, actor: &Actor) -> BodyState {
        // A dormant vehicle moves once a frame.
        let done = (self.substeps_done as usize).checked_sub(1).filter(|_| !actor.dormant);
        let on_path = done.and_then(|index| actor.path.get(index)).copied();
        on_path.unwrap_or_else(|| BodyState::of(self.body(actor)))
    }

    /// Returns the velocity of an actor's origin at the end of the newest substep.
    pub(super) fn origin_mps(&self, actor: &Actor) -> Vec3 {
        let body = self.body(actor);
        if actor.path.is_empty() || actor.dormant {
            return origin_mps(body);
        }
        self.body_state(actor).origin_mps(body.local_center_of_mass())
    }
}

fn may_be_solo(actor: &Actor, body: &RigidBody) -> bool {
    let Kind::Vehicle(vehicle) = &actor.kind else { return false };
    let is_upright = (*body.rotation() * Vec3::Z).z > UPRIGHT_MIN;
    !actor.kinematic && is_upright && vehicle.state.doors.is_empty()
}

/// Returns the bound of the places that a body reaches during a frame.
fn bound_of(actor: &Actor, body: &RigidBody, frame_s: f32, slack_m: f32) -> Bound {
    let velocity = if actor.kinematic {
        actor.kinematic_velocity
    } else {
        Twist { linear_mps: body.linvel(), angular_radps: body.angvel() }
    };
    let way_m = velocity.linear_mps.length() * frame_s;
    match &actor.kind {
        Kind::Vehicle(vehicle) => {
            let model = &vehicle.own;
            let doors = vehicle.open_doors().map(|door| {
                (door.middle_m - model.box_center_m).abs() + door.half_extents_m.length()
            });
            let half_m = doors.fold(model.box_half_m, Vec3::max);
            Bound::swept(body.position(), model.box_center_m, half_m, &velocity, frame_s, slack_m)
        }
        Kind::Prop(prop) => {
            let half_m = prop.model.half_extents_m;
            let middle_m = Vec3::Z * half_m.z;
            Bound::swept(body.position(), middle_m, half_m, &velocity, frame_s, slack_m)
        }
        Kind::Walker(walker) => {
            let reach_m = if walker.has_fallen() {
                RAGDOLL_M
            } else {
                walker.model.height_m + walker.desired_speed_mps.length() * frame_s
            };
            Bound::ball(body.translation(), reach_m + way_m + slack_m)
        }
    }
}

fn move_through(actor: &mut Actor, bodies: &RigidBodySet, surface: &Surface, dt: f32, count: u64) {
    let Actor { kind: Kind::Vehicle(vehicle), path, .. } = actor else { return };
    let body = &bodies[actor.body];
    let com_m = body.local_center_of_mass();
    let gravity_mps2 = if actor.gravity_disabled { 0.0 } else { GRAVITY_MPS2 };
    let mut state = BodyState::of(body);
    path.clear();
    if actor.dormant {
        path.push(vehicle.advance_dormant(surface, &state, com_m, dt * count as f32));
        return;
    }
    for _ in 0..count {
        let start = Motion {
            com_m: state.pose * com_m,
            axes: Mat3::from_quat(state.pose.rotation),
            velocity_mps: state.velocity.linear_mps,
            spin_radps: state.velocity.angular_radps,
            gravity_mps2,
        };
        let (_, end) = vehicle.advance(surface, &start, &actor.external_force, dt);
        let rotation = Quat::from_mat3(&end.axes).normalize();
        let translation = end.com_m - rotation * com_m;
        let velocity = Twist { linear_mps: end.velocity_mps, angular_radps: end.spin_radps };
        state = BodyState { pose: Pose::from_parts(translation, rotation), velocity };
        path.push(state);
    }
}
