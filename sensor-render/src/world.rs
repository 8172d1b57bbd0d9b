use std::iter::repeat;
use std::sync::Arc;

use glam::{Affine3A, Vec3};
use protocol::{
    ActorId, ActorState, GivenPoses, Stamp, StreetLights, WalkerLimbs, Weather, kind, lamp,
};

use crate::{
    bvh::{Link, Node, transformed_box},
    instance::{Instance, StreetLight, lights},
    light::Light,
    motion::Motions,
    overlay::Overlay,
    pieces::pieces,
    quality::Quality,
    sah_build::over_boxes,
    scene::Scene,
    wide::{WideNode, widen},
};

/// What changes every frame: actors, weather and time.
#[derive(Debug, Default)]
pub struct World {
    pub(crate) stamp: Stamp,
    pub(crate) delta_nanos: u64,
    pub(crate) weather: Weather,
    /// Pieces of actors, in the order of the leaves of the top-level hierarchy.
    pub(crate) instances: Vec<Instance>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Option<Link>,
    /// The same top-level hierarchy with eight children per node.
    pub(crate) wide: Vec<WideNode>,
    pub(crate) wide_root: Option<Link>,
    /// Motion of each instance since the previous frame; empty unless a sensor measures optical
    /// flow.
    pub(crate) motions: Motions,
    /// Debug shapes, drawn over the images.
    pub(crate) overlay: Arc<Overlay>,
    /// Poses of walkers' bones that clients have set.
    pub(crate) poses: GivenPoses,
    /// Poses of the previous frame, if they differ.
    pub(crate) poses_before: Option<GivenPoses>,
    /// Limbs of fallen walkers, by actor id.
    pub(crate) limbs: Vec<WalkerLimbs>,
    /// Limbs in the previous frame.
    pub(crate) limbs_before: Vec<WalkerLimbs>,
    /// Street lights that a command has set, in ascending order of their numbers.
    pub(crate) street_lights: Arc<Vec<StreetLight>>,
    /// Quality of cameras that ask for none.
    pub(crate) quality: Quality,
    /// Whether no shadow rays are traced.
    is_shadowless: bool,
}

impl World {
    /// Returns an empty world, before its first frame.
    pub fn new() -> World {
        World::default()
    }

    /// Returns the stamp of the frame that was placed last.
    pub fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// Sets the debug shapes that colour images show.
    pub fn set_overlay(&mut self, overlay: Arc<Overlay>) {
        self.overlay = overlay;
    }

    /// Sets whether surfaces lie in the shadow of others, as at first. Without shadows the images are
    /// brighter; for measuring the time of shadow rays.
    pub fn set_shadows(&mut self, has_shadows: bool) {
        self.is_shadowless = !has_shadows;
    }

    /// Sets the quality of the cameras that ask for none, [`Quality::Low`] at first.
    pub fn set_quality(&mut self, quality: Quality) {
        self.quality = quality;
    }

    /// Returns the light of the frame.
    pub(crate) fn light(&self) -> Light {
        let mut light = Light::new(&self.weather, self.stamp.sim_time_nanos);
        if self.is_shadowless {
            light.sun.w = 0.0;
        }
        light
    }

    /// Sets the states of the street lights.
    pub fn set_street_lights(&mut self, lights: &StreetLights) {
        self.street_lights = Arc::new(lights.lamps().map(StreetLight::of).collect());
    }

    /// Places the actors of one snapshot and rebuilds the top-level hierarchy over them.
    ///
    /// `delta_nanos` is the simulated time of the frame; it determines the sweep of spinning
    /// lidars. `paint` returns the colour of a vehicle as red, green and blue. Actors are invisible
    /// if their blueprint has no mesh or is not in the scene, or if their pose is invalid.
    pub fn place(
        &mut self,
        scene: &Scene,
        stamp: Stamp,
        delta_nanos: u64,
        weather: &Weather,
        actors: &[ActorState],
        paint: impl Fn(&ActorState) -> [u8; 3],
    ) {
        self.stamp = stamp;
        self.delta_nanos = delta_nanos;
        self.weather = *weather;
        self.motions = Motions::default();
        let mut instances = Vec::with_capacity(actors.len() + scene.parked.len());
        let mut boxes: Vec<(Vec3, Vec3)> = Vec::with_capacity(actors.len() + scene.parked.len());
        let blink = BlinkPhase::at(stamp.sim_time_nanos);
        for (actor, is_parked) in
            actors.iter().zip(repeat(false)).chain(scene.parked.iter().zip(repeat(true)))
        {
            let [red, green, blue] = paint(actor);
            let geometry = Instance {
                actor_from_world: [[0.0; 4]; 3],
                root: Link::EMPTY,
                id: actor.actor_id.0,
                color: u32::from_le_bytes([red, green, blue, 255]),
                lights: blink.of(actor),
                blas: 0,
                reserved: [0; 3],
            };
            let limbs = WalkerLimbs::find(&self.limbs, actor.actor_id);
            pieces(scene, actor, (&self.poses, limbs), is_parked, |blas, world_from_piece| {
                let bottom = &scene.blases[blas as usize];
                boxes.push(transformed_box(world_from_piece, bottom.low, bottom.high));
                let actor_from_world = rows(&world_from_piece.inverse());
                instances.push(Instance { actor_from_world, root: bottom.root, blas, ..geometry });
            });
        }
        let top = over_boxes(&boxes);
        self.instances.clear();
        self.instances.extend(top.order.iter().map(|&at| instances[at as usize]));
        self.root = (!instances.is_empty()).then_some(top.root);
        self.wide.clear();
        let wide_root = widen(&top.nodes, top.root, &mut self.wide);
        self.wide_root = (!instances.is_empty()).then_some(wide_root);
        self.nodes = top.nodes;
    }

    /// Computes the motion of `actors` since `before`, for optical flow. Call it after
    /// [`World::place`]. Actors that did not exist before, or were teleported since, count as not
    /// moved.
    pub fn track_motion(&mut self, scene: &Scene, before: &[ActorState], actors: &[ActorState]) {
        let poses = self.poses_before.as_ref().unwrap_or(&self.poses);
        let joints = (poses, &self.limbs_before[..]);
        self.motions = Motions::between(scene, joints, before, actors, &self.instances);
    }

    /// Returns `before_from_now` of an actor in world space; `None` if it has not moved or motion
    /// was not computed.
    pub(crate) fn motion_of(&self, carrier: ActorId) -> Option<&Affine3A> {
        self.motions.of_actor(carrier)
    }
}

/// State of blinking lamps at one time.
struct BlinkPhase {
    /// Bits of [`lamp`] that are dark at this moment.
    dark: u32,
}

impl BlinkPhase {
    /// Returns the state at a simulated time. Indicators blink 90 times per minute; the two beacons
    /// alternate at twice that rate.
    fn at(sim_time_nanos: u64) -> BlinkPhase {
        let half = |nanos: u64| sim_time_nanos / nanos % 2 == 1;
        let mut dark = 0;
        if half(333_333_333) {
            dark |= lamp::LEFT_BLINKER | lamp::RIGHT_BLINKER;
        }
        dark |= if half(166_666_667) { lamp::SPECIAL1 } else { lamp::SPECIAL2 };
        BlinkPhase { dark }
    }

    fn of(&self, actor: &ActorState) -> u32 {
        match actor.kind {
            kind::VEHICLE => {
                let mut on = actor.lamps & lamp::ALL;
                if actor.brake > 0.02 {
                    on |= lamp::BRAKE;
                }
                if actor.gear < 0 {
                    on |= lamp::REVERSE;
                }
                if actor.doors != 0 {
                    on |= lamp::INTERIOR;
                }
                on & !self.dark
            }
            kind::TRAFFIC_LIGHT => {
                lights::SIGNAL | actor.phase.min(lights::PHASE_MASK) << lights::PHASE_SHIFT
            }
            _ => 0,
        }
    }
}

/// Returns the three rows of an affine transform.
fn rows(affine: &Affine3A) -> [[f32; 4]; 3] {
    let (m, t) = (&affine.matrix3, affine.translation);
    [0, 1, 2].map(|row| [m.x_axis[row], m.y_axis[row], m.z_axis[row], t[row]])
}
