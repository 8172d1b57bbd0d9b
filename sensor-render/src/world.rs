use std::iter::repeat;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec3};
use protocol::{ActorState, GivenPoses, STRIDE, Stamp, WalkerLimbs, Weather, flag, kind, lamp};
use town::{GivenPose, Lighting, Posture, StreetLightState};

use crate::bvh::{Hierarchy, Link, Node, moved_box};
use crate::motion::Motions;
use crate::wide::{WideNode, widen};
use crate::{Overlay, Scene};

/// Bits of [`Instance::lights`]: those of [`protocol::lamp`], indicators and beacons while they shine;
/// and a traffic light's.
pub(crate) mod lights {
    /// It is a traffic light, whose phase begins at [`PHASE_SHIFT`].
    pub(crate) const SIGNAL: u32 = 1 << 31;
    /// Where the phase begins.
    pub(crate) const PHASE_SHIFT: u32 = 16;
    /// Of the phase.
    pub(crate) const PHASE_MASK: u32 = 3;
}

/// One piece of an actor, ready for rays. The shaders read the same 80 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Instance {
    /// Rows of `piece_from_world`, where a piece's space is its actor's at rest.
    pub(crate) actor_from_world: [[f32; 4]; 3],
    /// Of the piece's bottom level.
    pub(crate) root: Link,
    /// The actor's id.
    pub(crate) id: u32,
    /// Red in bits 0 to 7, green, blue; sRGB.
    pub(crate) color: u32,
    /// Bits of [`lights`].
    pub(crate) lights: u32,
    /// Index into the scene's levels.
    pub(crate) level: u32,
    pub(crate) reserved: [u32; 3],
}

const _: () = assert!(size_of::<Instance>() == 80);

/// How a street lamp shines that was told so. The shaders read the same 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Lamp {
    pub(crate) number: u32,
    pub(crate) mode: u32,
    /// sRGB, as [`Instance::color`]; 0: its own.
    pub(crate) color: u32,
    pub(crate) share: f32,
}

impl Lamp {
    fn of((number, shine): (u32, &StreetLightState)) -> Lamp {
        let StreetLightState { mode, color, share } = *shine;
        Lamp { number, mode, color, share }
    }
}

/// What moves: one frame's actors, its weather and its time.
#[derive(Debug, Default)]
pub struct World {
    pub(crate) stamp: Stamp,
    pub(crate) delta_nanos: u64,
    pub(crate) weather: Weather,
    /// In the order of the top level's leaves.
    pub(crate) instances: Vec<Instance>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Option<Link>,
    /// The same top level, eight children to a node.
    pub(crate) wide: Vec<WideNode>,
    pub(crate) wide_root: Option<Link>,
    /// How each instance has moved, if anybody asked.
    pub(crate) motions: Motions,
    /// What is drawn over all that.
    pub(crate) overlay: Arc<Overlay>,
    /// The poses that clients gave walkers.
    pub(crate) poses: GivenPoses,
    /// Those of the frame before, if they were others.
    pub(crate) poses_before: Option<GivenPoses>,
    /// The limbs of fallen walkers, by id.
    pub(crate) limbs: Vec<WalkerLimbs>,
    /// Those of the frame before.
    pub(crate) limbs_before: Vec<WalkerLimbs>,
    /// Street lamps that do not shine as their own, rising by their numbers.
    pub(crate) lamps: Arc<Vec<Lamp>>,
}

impl World {
    /// An empty world, before its first frame.
    pub fn new() -> World {
        World::default()
    }

    /// The frame that the actors stand in.
    pub fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// From now on cameras' colours show this over what is there.
    pub fn draw(&mut self, overlay: Arc<Overlay>) {
        self.overlay = overlay;
    }

    /// From now on street lamps shine as they were told.
    pub fn light(&mut self, lighting: &Lighting) {
        self.lamps = Arc::new(lighting.lamps().map(Lamp::of).collect());
    }

    /// Puts the actors of one snapshot where they are, and rebuilds the top level over them.
    ///
    /// `delta_nanos` is the simulated time that the frame took; spinning lidars sweep as far.
    /// `paint` says the paint of a vehicle as red, green and blue. Actors whose blueprint has no
    /// mesh, or is not in the scene, are not seen; nor are those with an invalid pose.
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
        let lamps = Lamps::at(stamp.sim_time_nanos);
        for (actor, is_parked) in
            actors.iter().zip(repeat(false)).chain(scene.parked.iter().zip(repeat(true)))
        {
            let [red, green, blue] = paint(actor);
            let looks = Instance {
                actor_from_world: [[0.0; 4]; 3],
                root: Link::EMPTY,
                id: actor.actor_id.0,
                color: u32::from_le_bytes([red, green, blue, 255]),
                lights: lamps.of(actor),
                level: 0,
                reserved: [0; 3],
            };
            let limbs = WalkerLimbs::find(&self.limbs, actor.actor_id);
            pieces(scene, actor, (&self.poses, limbs), is_parked, |level, world_from_piece| {
                let bottom = &scene.levels[level as usize];
                boxes.push(moved_box(world_from_piece, bottom.low, bottom.high));
                let actor_from_world = rows(&world_from_piece.inverse());
                instances.push(Instance { actor_from_world, root: bottom.root, level, ..looks });
            });
        }
        let top = Hierarchy::over_boxes(&boxes);
        self.instances.clear();
        self.instances.extend(top.order.iter().map(|&at| instances[at as usize]));
        self.root = (!instances.is_empty()).then_some(top.root);
        self.wide.clear();
        let wide_root = widen(&top.nodes, top.root, &mut self.wide);
        self.wide_root = (!instances.is_empty()).then_some(wide_root);
        self.nodes = top.nodes;
    }
}

/// Says where each piece of an actor that has a surface is: its level, and `world_from_piece`.
pub(crate) fn pieces(
    scene: &Scene,
    actor: &ActorState,
    (poses, limbs): (&GivenPoses, Option<&WalkerLimbs>),
    is_parked: bool,
    mut show: impl FnMut(u32, &Affine3A),
) {
    let Some(figure) = scene.figures.get(actor.blueprint as usize) else { return };
    if !actor.pose.is_valid() {
        return;
    }
    let world_from_actor = actor.pose.affine();
    let mut show = |level: u32, world_from_piece: &Affine3A| {
        if !scene.levels[level as usize].is_empty() {
            show(level, world_from_piece);
        }
    };
    let first = figure.first_level;
    match (&figure.rig, figure.whole.filter(|_| is_parked)) {
        (_, Some(whole)) => show(whole, &world_from_actor),
        (None, None) => show(first, &world_from_actor),
        (Some(rig), None) => {
            rig.place(&posture_of(actor, poses, limbs), |piece, actor_from_piece| {
                let level = first + piece as u32;
                if actor_from_piece == Affine3A::IDENTITY {
                    show(level, &world_from_actor);
                } else {
                    show(level, &(world_from_actor * actor_from_piece));
                }
            })
        }
    }
}

/// How an actor holds itself.
fn posture_of<'a>(
    actor: &ActorState,
    poses: &'a GivenPoses,
    limbs: Option<&WalkerLimbs>,
) -> Posture<'a> {
    let is_walker = actor.kind == kind::WALKER;
    Posture {
        steer_rad: actor.wheel_steer_rad,
        spin_rad: actor.wheel_spin_rad,
        doors: actor.doors,
        stride: if is_walker { actor.phase as f32 / STRIDE as f32 } else { 0.0 },
        speed_mps: if is_walker { actor.velocity().truncate().length() } else { 0.0 },
        limbs: limbs.map(WalkerLimbs::rotations),
        given: if actor.has(flag::POSED) {
            poses.of(actor.actor_id).map(|to| GivenPose { weight: to.weight, bones: &to.bones })
        } else {
            None
        },
    }
}

/// What blinks, at one time.
struct Lamps {
    /// Bits of [`lamp`] that are dark just now.
    dark: u32,
}

impl Lamps {
    /// Indicators blink 90 times a minute, beacons in turns twice as fast.
    fn at(sim_time_nanos: u64) -> Lamps {
        let half = |nanos: u64| sim_time_nanos / nanos % 2 == 1;
        let mut dark = 0;
        if half(333_333_333) {
            dark |= lamp::LEFT_BLINKER | lamp::RIGHT_BLINKER;
        }
        dark |= if half(166_666_667) { lamp::SPECIAL1 } else { lamp::SPECIAL2 };
        Lamps { dark }
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

/// The three rows of an affine transform.
fn rows(affine: &Affine3A) -> [[f32; 4]; 3] {
    let (m, t) = (&affine.matrix3, affine.translation);
    [0, 1, 2].map(|row| [m.x_axis[row], m.y_axis[row], m.z_axis[row], t[row]])
}
