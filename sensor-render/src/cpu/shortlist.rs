//! Parts of a hierarchy near the rays of a block of pixels.
//!
//! The rays from neighbouring points to the sun and the sky visit almost the same nodes. These are searched once
//! for all of a block; each packet then tests the boxes of what was found.

use glam::Vec3;

use super::beam::{Beam, Region, bounds};
use super::traversal::{Probe, Stack, Visitor, walk_in_any_order};
use crate::bvh::Link;
use crate::light::{OCCLUSION_FADE_M, OCCLUSION_REACH_M};
use crate::scene::Scene;
use crate::simd::{Float, Float8, Mask, V3};
use crate::wide::WideNode;
use crate::world::World;

/// Rows of eight links that a list holds.
const ROWS: usize = 8;
const ENTRIES: usize = ROWS * 8;

/// Links of a hierarchy with their boxes, eight in a row.
#[derive(Clone, Debug)]
pub(crate) struct Shortlist {
    rows: [WideNode; ROWS],
    len: usize,
}

impl Shortlist {
    fn new() -> Shortlist {
        Shortlist { rows: [WideNode::EMPTY; ROWS], len: 0 }
    }

    /// Lists what `probe` touches below `root`: leaves, and inner nodes where there is no room for what is below
    /// them.
    #[inline(always)]
    fn search<E: Float8, P: Probe>(&mut self, nodes: &[WideNode], root: Link, probe: &P) {
        self.len = 0;
        if root.is_leaf() {
            self.push(&WideNode::EVERYWHERE, 0, root);
            return;
        }
        // Nodes, with their parents and their places among the children of these.
        let mut pending = [(0u32, 0u32); ENTRIES];
        let mut height = 0;
        let mut at = root.0;
        loop {
            let node = &nodes[at as usize];
            let (mut touched, _) = probe.touch::<E>(node, 0.0);
            while touched != 0 {
                let slot = touched.trailing_zeros();
                touched &= touched - 1;
                let link = node.children[slot as usize & 7];
                if link.is_leaf() {
                    self.push(node, slot, link);
                } else {
                    pending[height % ENTRIES] = (at, slot);
                    height += 1;
                }
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                let (parent, slot) = pending[height % ENTRIES];
                let parent = &nodes[parent as usize];
                let link = parent.children[slot as usize & 7];
                if self.len + height + 8 > ENTRIES {
                    self.push(parent, slot, link);
                    continue;
                }
                at = link.0;
                break;
            }
        }
    }

    #[inline(always)]
    fn push(&mut self, node: &WideNode, slot: u32, link: Link) {
        let (row, own) = (self.len / 8 % ROWS, self.len % 8);
        if own == 0 {
            self.rows[row] = WideNode::EMPTY;
        }
        self.rows[row].copy_child(own, node, slot as usize & 7, link);
        self.len += 1;
    }

    /// Calls `visitor` for the leaves of the list, and those below its nodes, that `probe` touches.
    #[inline(always)]
    pub(crate) fn walk<E: Float8, P: Probe, V: Visitor>(
        &self,
        nodes: &[WideNode],
        probe: &P,
        stack: &mut Stack,
        visitor: &mut V,
    ) {
        for row in &self.rows[..self.len.div_ceil(8)] {
            let (mut touched, _) = probe.touch::<E>(row, 0.0);
            while touched != 0 {
                let link = row.children[touched.trailing_zeros() as usize & 7];
                touched &= touched - 1;
                if walk_in_any_order::<E, P, V>(nodes, link, probe, stack, visitor) < 0.0 {
                    return;
                }
            }
        }
    }
}

/// Lists of the town and of the top level of the world.
#[derive(Clone, Debug)]
pub(crate) struct Shortlists {
    pub(crate) town: Shortlist,
    pub(crate) world: Shortlist,
}

impl Shortlists {
    #[inline(always)]
    fn search<E: Float8, P: Probe>(&mut self, scene: &Scene, world: &World, probe: &P) {
        self.town.search::<E, P>(&scene.wide, scene.town_blas.wide_root, probe);
        match world.wide_root {
            Some(root) => self.world.search::<E, P>(&world.wide, root, probe),
            None => self.world.len = 0,
        }
    }
}

/// What lies between the points of a block, which four rays of each pixel hit, and the sun or the sky. It is
/// searched when it is needed.
pub(crate) struct Surroundings<F: Float> {
    points: [V3<F>; 4],
    /// Those that the rays hit.
    hit: [F::Mask; 4],
    /// Those at which ambient occlusion counts.
    near: [F::Mask; 4],
    /// Directions of the rays to the sun and to the sky.
    to_sun: [Vec3; 4],
    to_sky: [Vec3; 4],
    lists: Box<[Shortlists; 2]>,
    state: [State; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    New,
    Searched,
    /// The points lie too far apart, or the rays are in different worlds.
    Apart,
}

impl<F: Float> Surroundings<F> {
    #[inline(always)]
    pub(crate) fn new() -> Surroundings<F> {
        let lists = || Shortlists { town: Shortlist::new(), world: Shortlist::new() };
        Surroundings {
            points: [V3::splat(Vec3::ZERO); 4],
            hit: [F::Mask::from_bits(0); 4],
            near: [F::Mask::from_bits(0); 4],
            to_sun: [Vec3::Z; 4],
            to_sky: [Vec3::Z; 4],
            lists: Box::new([lists(), lists()]),
            state: [State::Apart; 2],
        }
    }

    /// Begins a block. `t` are the depths of the points, `in_one_world` whether all rays are in the same world.
    #[inline(always)]
    pub(crate) fn begin(
        &mut self,
        points: [V3<F>; 4],
        t: &[F; 4],
        hit: [F::Mask; 4],
        directions: [[Vec3; 4]; 2],
        in_one_world: bool,
    ) {
        let far = F::splat(OCCLUSION_FADE_M[1]);
        for group in 0..4 {
            self.near[group] = hit[group] & t[group].lt(far);
        }
        (self.points, self.hit) = (points, hit);
        [self.to_sun, self.to_sky] = directions;
        self.state = [if in_one_world { State::New } else { State::Apart }; 2];
    }

    /// Returns what the rays to the sun may meet from origins within `lift` of the points; `None` if these lie
    /// more than `apart` metres apart.
    #[inline(always)]
    pub(crate) fn towards_sun(
        &mut self,
        scene: &Scene,
        world: &World,
        lift: f32,
        apart: f32,
    ) -> Option<&Shortlists> {
        if self.state[0] == State::New {
            self.state[0] = State::Apart;
            if extent(&self.points, &self.hit) <= apart {
                let beam =
                    Beam::spreading(&self.points, &self.hit, &self.to_sun, lift, scene.reach);
                self.lists[0].search::<F::Float8, _>(scene, world, &beam);
                self.state[0] = State::Searched;
            }
        }
        (self.state[0] == State::Searched).then_some(&self.lists[0])
    }

    /// As [`Surroundings::towards_sun`], for the rays to the sky.
    #[inline(always)]
    pub(crate) fn towards_sky(
        &mut self,
        scene: &Scene,
        world: &World,
        lift: f32,
        apart: f32,
    ) -> Option<&Shortlists> {
        if self.state[1] == State::New {
            self.state[1] = State::Apart;
            if extent(&self.points, &self.near) <= apart {
                let steps = self.to_sky.map(|direction| direction * OCCLUSION_REACH_M);
                let region = Region::around(&self.points, &self.near, &steps, lift, scene.reach);
                self.lists[1].search::<F::Float8, _>(scene, world, &region);
                self.state[1] = State::Searched;
            }
        }
        (self.state[1] == State::Searched).then_some(&self.lists[1])
    }
}

/// Returns the longest side of the bounding box of points. Metres.
#[inline(always)]
fn extent<F: Float>(points: &[V3<F>; 4], active: &[F::Mask; 4]) -> f32 {
    let (low, high) = bounds(points, active);
    (high - low).max_element()
}
