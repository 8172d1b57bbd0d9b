//! The agents of a snapshot: vehicles, walkers and props.

use glam::{Vec2, Vec3};
use protocol::{ActorState, flag, kind};

use crate::{
    body::{Bodies, Body},
    neighbours::Neighbours,
    tracks::NONE,
};

/// Speed below which an obstacle stands, metres per second.
const STANDING_MPS: f32 = 0.3;

/// The bits of everything that decides which stretches of tracks an agent occupies.
pub(crate) type PoseBits = [u32; 13];

/// All agents of a snapshot as a structure of arrays, ascending by actor id.
#[derive(Default)]
pub(crate) struct Agents {
    /// Actor id.
    pub(crate) id: Vec<u32>,
    /// Position of the origin in world space, metres.
    pub(crate) position: Vec<Vec3>,
    /// Unit vector along the vehicle's x axis, projected onto the ground plane.
    pub(crate) forward: Vec<Vec2>,
    /// By how much the body shifts for each metre of height: the unit vector along the vehicle's z axis,
    /// projected onto the ground plane.
    pub(crate) lean: Vec<Vec2>,
    /// Velocity in the ground plane of world space, metres per second.
    pub(crate) velocity: Vec<Vec2>,
    /// Yaw rate about the world's z axis, radians per second.
    pub(crate) yaw_rate: Vec<f32>,
    /// Coordinate acceleration along `forward`, metres per second squared.
    pub(crate) acceleration: Vec<f32>,
    /// Sine of the pitch angle, positive with the nose up.
    pub(crate) pitch_sin: Vec<f32>,
    /// Dimensions.
    pub(crate) body: Vec<Body>,
    /// Whether it is a walker.
    pub(crate) walks: Vec<bool>,
    /// Whether it is a prop.
    pub(crate) is_prop: Vec<bool>,
    /// Bits of [`flag`].
    pub(crate) flags: Vec<u32>,
    /// Row in the vehicle table for vehicles that this planner drives, else [`NONE`].
    pub(crate) row: Vec<u32>,
    /// For each row of the vehicle table: the index of its agent.
    pub(crate) driven: Vec<u32>,
    /// The walkers on autopilot.
    pub(crate) led: Vec<u32>,
    /// The traffic lights of the snapshot: their indices in it.
    pub(crate) lights: Vec<u32>,
    /// All walkers, and all wide agents.
    walkers: Vec<u32>,
    wide: Vec<u32>,
    /// All walkers by place.
    pub(crate) foot_places: Neighbours,
    /// All agents by place.
    pub(crate) places: Neighbours,
    /// The wide agents by place.
    pub(crate) wide_places: Neighbours,
    /// Largest distance from an agent's origin to a corner of its body, metres.
    pub(crate) reach_max_m: f32,
}

impl Agents {
    /// Returns the number of agents.
    pub(crate) fn count(&self) -> usize {
        self.id.len()
    }

    /// Reads a snapshot. Rows are numbered in the order of the snapshot.
    pub(crate) fn read(&mut self, actors: &[ActorState], bodies: &Bodies) {
        self.clear();
        for (index, actor) in actors.iter().enumerate() {
            if actor.kind == kind::TRAFFIC_LIGHT {
                self.lights.push(index as u32);
            }
            let vehicle = actor.kind == kind::VEHICLE;
            // Vehicles drive over passable props.
            let is_prop = actor.kind == kind::PROP && !bodies.is_passable(actor.blueprint);
            let thing = actor.kind == kind::WALKER || is_prop;
            if !(vehicle || thing) || !actor.pose.position().is_finite() {
                continue;
            }
            let ours = vehicle && actor.has(flag::AUTOPILOT) && !actor.has(flag::KINEMATIC);
            let rotation = actor.pose.rotation();
            let forward = rotation * Vec3::X;
            let flat = forward.truncate().try_normalize().unwrap_or(Vec2::X);
            let acceleration = Vec3::from_array(actor.acceleration_mps2);
            let (agent, body) = (self.id.len() as u32, bodies.of(actor.blueprint));
            if body.is_wide() {
                self.wide.push(agent);
            }
            self.id.push(actor.actor_id.0);
            self.position.push(actor.pose.position());
            self.forward.push(flat);
            self.lean.push((rotation * Vec3::Z).truncate());
            self.velocity.push(actor.velocity().truncate());
            self.yaw_rate.push(actor.angular_velocity_radps[2]);
            self.acceleration.push(acceleration.dot(forward));
            self.pitch_sin.push(forward.z);
            self.body.push(body);
            self.walks.push(actor.kind == kind::WALKER);
            self.is_prop.push(is_prop);
            self.flags.push(actor.flags);
            self.row.push(if ours { self.driven.len() as u32 } else { NONE });
            if ours {
                self.driven.push(agent);
            }
            const NOT_LED: u32 = flag::KINEMATIC | flag::FALLEN;
            if actor.kind == kind::WALKER {
                self.walkers.push(agent);
                if actor.has(flag::AUTOPILOT) && actor.flags & NOT_LED == 0 {
                    self.led.push(agent);
                }
            }
        }
        let at = |agent: u32| (agent, self.position[agent as usize].truncate());
        self.wide_places.rebuild(self.wide.iter().copied().map(at));
        self.foot_places.rebuild(self.walkers.iter().copied().map(at));
        self.places.rebuild((0..self.id.len() as u32).map(at));
        self.reach_max_m = 0.0;
        let mut largest = (0.0, 0.0);
        for body in &self.body {
            let corner = (body.front_m.max(body.rear_m), body.half_width_m);
            if corner.0 > largest.0 || corner.1 > largest.1 {
                self.reach_max_m = self.reach_max_m.max(corner.0.hypot(corner.1));
                largest = corner;
            }
        }
    }

    fn clear(&mut self) {
        self.id.clear();
        self.position.clear();
        self.forward.clear();
        self.lean.clear();
        self.velocity.clear();
        self.yaw_rate.clear();
        self.acceleration.clear();
        self.pitch_sin.clear();
        self.body.clear();
        self.walks.clear();
        self.is_prop.clear();
        self.flags.clear();
        self.row.clear();
        self.driven.clear();
        self.led.clear();
        self.lights.clear();
        self.walkers.clear();
        self.wide.clear();
    }

    /// Returns the bits of everything that decides which stretches of tracks the agent occupies.
    pub(crate) fn pose_bits(&self, agent: usize) -> PoseBits {
        let [x, y, z] = self.position[agent].to_array();
        let [ahead_x, ahead_y] = self.forward[agent].to_array();
        let [to_x, to_y] = self.velocity[agent].to_array();
        // The class follows from the blueprint, as the other properties of the body do. No height counts.
        let Body {
            front_m,
            rear_m,
            half_width_m,
            wheelbase_m,
            max_steer_rad,
            cruise_speed_mps,
            height_m: _,
            class: _,
        } = self.body[agent];
        [
            x,
            y,
            z,
            ahead_x,
            ahead_y,
            to_x,
            to_y,
            front_m,
            rear_m,
            half_width_m,
            wheelbase_m,
            max_steer_rad,
            cruise_speed_mps,
        ]
        .map(f32::to_bits)
    }

    /// Returns whether an agent is a prop that stands, which will not drive on; `u32::MAX` is none.
    pub(crate) fn is_standing_prop(&self, agent: u32) -> bool {
        let agent = agent as usize;
        self.is_prop.get(agent).is_some_and(|is_prop| *is_prop)
            && self.velocity[agent].length() < STANDING_MPS
    }

    /// Returns by how much the body of one agent is shifted against that of another at the lower of the two
    /// roofs: in a dip, and where they brake, bodies pitch towards each other.
    pub(crate) fn roof_shift(&self, one: usize, other: usize) -> Vec2 {
        let roof_m = self.body[one].height_m.min(self.body[other].height_m);
        (self.lean[one] - self.lean[other]) * roof_m
    }

    /// Returns the signed speed along `forward`, metres per second.
    pub(crate) fn speed(&self, agent: usize) -> f32 {
        self.velocity[agent].dot(self.forward[agent])
    }
}
