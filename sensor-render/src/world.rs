use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{Affine3A, Vec3};
use protocol::{
    ActorId, ActorState, GivenPoses, SensorSpec, Stamp, StreetLights, WalkerLimbs, Weather, kind,
    lamp, sensor,
};

use crate::{
    bvh::{Box3, Hierarchy, Link, Node, node_of},
    instance::{Instance, StreetLight, lights},
    light::Light,
    motion::Motions,
    overlay::Overlay,
    parked::ParkedHierarchy,
    pieces::pieces,
    quality::Quality,
    rain::Puff,
    rays::Camera,
    sah_build::over_boxes,
    scene::Scene,
    time_slices::{actors_at, shares},
    wide::{WideNode, widen},
};

/// What changes every frame: actors, weather and time.
#[derive(Debug, Default)]
pub struct World {
    pub(crate) stamp: Stamp,
    pub(crate) delta_nanos: u64,
    pub(crate) weather: Weather,
    /// Pieces of the parked vehicles and of actors, in the order of the leaves of the top-level hierarchy.
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
    /// The same world at other times, for cameras with motion blur.
    slices: Vec<TimeSlices>,
    /// Those of the frame before, whose parked vehicles are used again.
    spare_slices: Vec<TimeSlices>,
    /// [`Scene::serial`] of the scene of the last frame, and its parked vehicles.
    parked: Option<(u64, ParkedHierarchy)>,
    /// Whether no shadow rays are traced.
    is_shadowless: bool,
    /// Velocities of the actors in wet weather, by id, in m/s; else empty.
    pub(crate) velocities: Vec<(ActorId, Vec3)>,
    /// Spray behind vehicles.
    pub(crate) puffs: Vec<Puff>,
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

    /// Places the actors of one snapshot, and builds the top-level hierarchy over them and the parked
    /// vehicles of the scene.
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
        self.spare_slices.append(&mut self.slices);
        self.place_rain(actors);
        let (mut instances, mut boxes) = (Vec::new(), Vec::new());
        let blink = BlinkPhase::at(stamp.sim_time_nanos);
        for actor in actors {
            let [red, green, blue] = paint(actor);
            let geometry = Instance {
                id: actor.actor_id.0,
                color: u32::from_le_bytes([red, green, blue, 255]),
                lights: blink.of(actor),
                ..Instance::zeroed()
            };
            let limbs = WalkerLimbs::find(&self.limbs, actor.actor_id);
            pieces(scene, actor, (&self.poses, limbs), false, |blas, world_from_piece| {
                let (bounds, piece) = geometry.placed(scene, blas, world_from_piece);
                boxes.push(bounds);
                instances.push(piece);
            });
        }
        let top = over_boxes(&boxes);
        let around = boxes.into_iter().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        self.join(scene, &top, around, top.order.iter().map(|&at| instances[at as usize]));
    }

    /// Computes what the rain before a camera depends on.
    fn place_rain(&mut self, actors: &[ActorState]) {
        self.velocities.clear();
        self.puffs.clear();
        let wetness = self.light().ground.w;
        if wetness > 0.0 {
            let velocity = |actor: &ActorState| (actor.actor_id, actor.velocity());
            self.velocities.extend(actors.iter().map(velocity));
            self.puffs.extend(actors.iter().filter_map(|actor| Puff::of(actor, wetness)));
        }
    }

    /// Joins the hierarchy over the actors with that over the parked vehicles, which stay in front.
    fn join(
        &mut self,
        scene: &Scene,
        actors: &Hierarchy,
        around: Option<Box3>,
        instances: impl Iterator<Item = Instance>,
    ) {
        let known = self.parked.take().filter(|(serial, _)| *serial == scene.serial);
        let (_, parked) = self.parked.insert(known.unwrap_or_else(|| {
            let parked = ParkedHierarchy::of(scene);
            self.instances.clone_from(&parked.instances);
            self.nodes.clone_from(&parked.nodes);
            self.wide.clone_from(&parked.wide);
            (scene.serial, parked)
        }));
        let (base, first) = (parked.nodes.len() as u32, parked.instances.len() as u32);
        self.instances.truncate(parked.instances.len());
        self.instances.extend(instances);
        self.nodes.truncate(parked.nodes.len());
        self.nodes.extend(actors.nodes.iter().map(|node| node.moved(base, first)));
        let root = actors.root.moved(base, first);
        self.wide.truncate(parked.wide.len());
        let wide_root = widen(&self.nodes, root, &mut self.wide);
        let has_parked = !parked.instances.is_empty();
        // Links of the frame before may lead nowhere now.
        (self.nodes[0], self.wide[0]) = (Node::JOIN, WideNode::EMPTY);
        (self.root, self.wide_root) = match (has_parked, around) {
            (false, None) => (None, None),
            (true, None) => (Some(parked.root), Some(parked.wide_root)),
            (false, Some(_)) => (Some(root), Some(wide_root)),
            (true, Some(around)) => {
                let (by_parked, own) = (parked.around, around);
                let boxes = node_of(by_parked.0, by_parked.1, own.0, own.1);
                self.nodes[0] = Node { child0: parked.root, child1: root, ..boxes };
                self.wide[0] = WideNode::join([(parked.wide_root, by_parked), (wide_root, own)]);
                (Some(Link(0)), Some(Link(0)))
            }
        };
    }

    /// Computes the motion of `actors` since `before`, for optical flow. Call it after
    /// [`World::place`]. Actors that did not exist before, or were teleported since, count as not
    /// moved.
    pub fn track_motion(&mut self, scene: &Scene, before: &[ActorState], actors: &[ActorState]) {
        let poses = self.poses_before.as_ref().unwrap_or(&self.poses);
        let joints = (poses, &self.limbs_before[..]);
        self.motions = Motions::between(scene, joints, before, actors, &self.instances);
    }

    /// Places the actors at the times of the rays of those of `sensors` that are cameras with motion blur.
    /// Call it after [`World::place`], with the same actors and those of the previous frame.
    pub fn place_slices<'a>(
        &mut self,
        scene: &Scene,
        before: &[ActorState],
        actors: &[ActorState],
        sensors: impl IntoIterator<Item = &'a SensorSpec>,
        paint: impl Fn(&ActorState) -> [u8; 3],
    ) {
        let mut spare = std::mem::take(&mut self.spare_slices);
        for spec in sensors.into_iter().filter(|spec| spec.kind == sensor::CAMERA) {
            let rays = self.quality.or_own(spec.quality).samples().len();
            let blur_secs = spec.effects.blur_secs;
            let is_same =
                |slices: &TimeSlices| slices.blur_secs == blur_secs && slices.worlds.len() == rays;
            if blur_secs <= 0.0 || rays == 1 || self.slices.iter().any(is_same) {
                continue;
            }
            let mut slices = match spare.iter().position(is_same) {
                Some(at) => spare.swap_remove(at),
                None => TimeSlices { blur_secs, worlds: (0..rays).map(|_| World::new()).collect() },
            };
            let shares = shares(&spec.effects, rays, self.delta_nanos);
            for (world, share) in slices.worlds.iter_mut().zip(shares) {
                world.street_lights = Arc::clone(&self.street_lights);
                world.poses.clone_from(&self.poses);
                world.limbs.clone_from(&self.limbs);
                (world.quality, world.is_shadowless) = (self.quality, self.is_shadowless);
                let actors = actors_at(share, before, actors);
                let (stamp, delta_nanos, weather) = (self.stamp, self.delta_nanos, self.weather);
                world.place(scene, stamp, delta_nanos, &weather, &actors, &paint);
            }
            self.slices.push(slices);
        }
    }

    /// Returns the worlds at the times of the rays of a camera; `None` without motion blur.
    pub(crate) fn slices_of(&self, camera: &Camera) -> Option<&[World]> {
        let (blur_secs, rays) = (camera.effects.blur_secs, camera.quality.samples().len());
        let is_of =
            |slices: &&TimeSlices| slices.blur_secs == blur_secs && slices.worlds.len() == rays;
        self.slices.iter().find(is_of).map(|slices| &slices.worlds[..])
    }

    /// Returns all worlds at other times.
    pub(crate) fn all_slices(&self) -> impl Iterator<Item = &World> {
        self.slices.iter().flat_map(|slices| &slices.worlds)
    }

    /// Returns the numbers of nodes and instances that belong to the parked vehicles and plants, which are
    /// the first ones in every world of a scene.
    pub(crate) fn parked_counts(&self) -> [usize; 2] {
        match &self.parked {
            Some((_, parked)) => [parked.nodes.len(), parked.instances.len()],
            None => [0; 2],
        }
    }

    /// Returns the serial of the scene that the world was placed in.
    pub(crate) fn scene_serial(&self) -> Option<u64> {
        Some(self.parked.as_ref()?.0)
    }

    /// Returns `before_from_now` of an actor in world space; `None` if it has not moved or motion
    /// was not computed.
    pub(crate) fn motion_of(&self, carrier: ActorId) -> Option<&Affine3A> {
        self.motions.of_actor(carrier)
    }
}

/// Worlds at the times of the rays of a pixel, for cameras of one exposure time and number of rays.
#[derive(Debug)]
struct TimeSlices {
    blur_secs: f32,
    worlds: Vec<World>,
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
