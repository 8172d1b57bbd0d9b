//! The lines that the Cosmos visualization shows: lanes, stop lines, crosswalks and boxes of actors on
//! black, which world models take as the description of a scene.
//!
//! What is drawn, its colours and widths are those of CARLA's `CosmosControlSensor.cpp`. Nothing but
//! lines hides a line.

use client_lib::{BlueprintInfo, Pose, World};
use glam::{DVec3, Quat, Vec2, Vec3};
use mesh::Tag;
use road::{LaneType, Network};
use town::Town;

use crate::{
    pixels::{OPAQUE, bgra},
    trigger_volumes::{HALF_LENGTH_M, SignalPlace},
};

/// A straight line of a width. World space; the colour is a word of blue, green, red and alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stroke {
    ends: [Vec3; 2],
    width_m: f32,
    color: u32,
}

/// The width of lines on the ground and of poles. Metres.
const WIDE_M: f32 = 0.2;
/// The width of the edges of boxes. Metres.
const NARROW_M: f32 = 0.1;
/// The step along the middle of a lane. Metres.
const LANE_STEP_M: f64 = 2.0;
/// What is nearer to the camera is not drawn. Metres.
const NEAR_M: f32 = 0.1;

const LANE: [u8; 3] = [71, 134, 183];
const CROSSWALK: [u8; 3] = [202, 132, 58];
const STOP_LINE: [u8; 3] = [255, 0, 0];
const POLE: [u8; 3] = [58, 4, 124];

fn word([r, g, b]: [u8; 3]) -> u32 {
    bgra([r, g, b, 255])
}

/// Returns the colour of boxes around what has this tag; `None`: it has no box. CARLA gives trucks no
/// colour of their own.
fn box_color(tag: u8) -> Option<[u8; 3]> {
    const VEHICLES: [Tag; 6] =
        [Tag::Car, Tag::Truck, Tag::Bus, Tag::Train, Tag::Motorcycle, Tag::Bicycle];
    match tag {
        _ if VEHICLES.iter().any(|one| *one as u8 == tag) => Some([255, 0, 0]),
        _ if tag == Tag::Pedestrian as u8 => Some([0, 255, 0]),
        _ if tag == Tag::TrafficLight as u8 => Some([109, 144, 136]),
        _ if tag == Tag::TrafficSign as u8 => Some([214, 144, 137]),
        _ => None,
    }
}

/// Returns the lines of a map and its town.
pub(crate) fn of_map(network: &Network, town: &Town) -> Vec<Stroke> {
    let mut strokes = Vec::new();
    let mut draw = |a: DVec3, b: DVec3, color| {
        let ends = [a.as_vec3(), b.as_vec3()];
        strokes.push(Stroke { ends, width_m: WIDE_M, color: word(color) });
    };
    let lanes = network.lanes().iter();
    for lane in lanes.filter(|one| one.kind == LaneType::Driving && one.junction.is_none()) {
        let steps = (lane.length_m / LANE_STEP_M).ceil().max(1.0) as usize;
        let at = |step: usize| {
            let along_m = lane.length_m * step as f64 / steps as f64;
            network.place_at(lane.index, along_m, 0.0).position
        };
        (0..steps).for_each(|step| draw(at(step), at(step + 1), LANE));
    }
    for walk in network.crosswalks() {
        let next = walk.corners.iter().cycle().skip(1);
        walk.corners.iter().zip(next).for_each(|(a, b)| draw(*a, *b, CROSSWALK));
    }
    for signal in network.signals().iter().filter(|signal| signal.dynamic) {
        for volume in SignalPlace::new(network, signal).volumes {
            let middle = volume.center + (volume.along * HALF_LENGTH_M).extend(0.0);
            let half = (volume.along.perp() * volume.half_width_m).extend(0.0);
            draw((middle - half).as_dvec3(), (middle + half).as_dvec3(), STOP_LINE);
        }
    }
    for object in &town.objects {
        let half = object.half_extents_m;
        if let Some(color) = box_color(object.tag as u8) {
            let turn = Quat::from_rotation_z(object.yaw_rad);
            strokes.extend(edges(object.center, turn, half, color));
        } else if object.tag == Tag::Pole && half.x.max(half.y) <= half.z {
            let ends = [-half.z, half.z].map(|z| object.center + Vec3::Z * z);
            strokes.push(Stroke { ends, width_m: WIDE_M, color: word(POLE) });
        }
    }
    strokes
}

/// Returns the boxes of the actors.
pub(crate) fn of_actors(world: &World, blueprints: &[BlueprintInfo]) -> Vec<Stroke> {
    let boxes = world.states().iter().filter_map(|actor| {
        let info = blueprints.get(actor.blueprint as usize)?;
        let turn = actor.pose.rotation();
        let center = actor.pose.position() + turn * Vec3::from(info.center_m);
        Some(edges(center, turn, info.half_extents_m.into(), box_color(info.tag)?))
    });
    boxes.flatten().collect()
}

/// Returns the twelve edges of a box.
fn edges(center: Vec3, turn: Quat, half: Vec3, color: [u8; 3]) -> [Stroke; 12] {
    let color = word(color);
    std::array::from_fn(|index| {
        // Four edges along each axis, one at each corner of the other two.
        let (axis, corner) = (index / 4, index % 4);
        let mut end = half;
        let side = |bit: usize| if corner & bit == 0 { -1.0 } else { 1.0 };
        end[(axis + 1) % 3] *= side(1);
        end[(axis + 2) % 3] *= side(2);
        let mut begin = end;
        begin[axis] = -begin[axis];
        let ends = [begin, end].map(|local| center + turn * local);
        Stroke { ends, width_m: NARROW_M, color }
    })
}

/// An image of lines.
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    focal_px: f32,
    world_from_camera: Pose,
    /// Words of blue, green, red and alpha.
    pub(crate) pixels: Vec<u32>,
    /// The inverse of the depth of each pixel. 1/m.
    nearness: Vec<f32>,
}

impl Canvas {
    /// Returns a black image. `fov_deg` is the horizontal field of view.
    pub(crate) fn new([width, height]: [usize; 2], fov_deg: f32, pose: &Pose) -> Canvas {
        Canvas {
            width,
            height,
            focal_px: width as f32 / (2.0 * (0.5 * fov_deg.clamp(1.0, 170.0).to_radians()).tan()),
            world_from_camera: *pose,
            pixels: vec![OPAQUE; width * height],
            nearness: vec![0.0; width * height],
        }
    }

    /// Draws a line, where it is nearer than those before.
    pub(crate) fn draw(&mut self, stroke: &Stroke) {
        let (eye, turn) =
            (self.world_from_camera.position(), self.world_from_camera.rotation().inverse());
        let [a, b] = stroke.ends.map(|end| turn * (end - eye));
        if a.x < NEAR_M && b.x < NEAR_M {
            return;
        }
        let clipped = |from: Vec3, to: Vec3| {
            if from.x >= NEAR_M { from } else { from.lerp(to, (NEAR_M - from.x) / (to.x - from.x)) }
        };
        let ends = [clipped(a, b), clipped(b, a)];
        let middle = 0.5 * Vec2::new(self.width as f32, self.height as f32);
        let [from, to] = ends.map(|at| middle - self.focal_px * Vec2::new(at.y, at.z) / at.x);
        // Between the ends, the inverse of the depth is linear in the image, and so is the width.
        let near = ends.map(|at| at.x.recip());
        let half_px = 0.5 * stroke.width_m * self.focal_px;
        let most_px = half_px * near[0].max(near[1]);
        let along = to - from;
        let length = along.length().max(1e-6);
        let way = along / length;
        let row = |y: f32| y.clamp(0.0, self.height as f32) as usize;
        let rows =
            row((from.y.min(to.y) - most_px).floor())..row((from.y.max(to.y) + most_px).ceil());
        let reach = [from.x.min(to.x) - most_px, from.x.max(to.x) + most_px];
        for y in rows {
            let rise = y as f32 + 0.5 - from.y;
            let mut span = reach;
            if way.y.abs() > 1e-3 {
                // Where this row is within the largest width of the line.
                let (at, wide) = (from.x + rise * way.x / way.y, most_px / way.y.abs());
                span = [span[0].max(at - wide), span[1].min(at + wide)];
            }
            let column = |x: f32| x.clamp(0.0, self.width as f32) as usize;
            for x in column(span[0].floor())..column(span[1].ceil()) {
                let point = Vec2::new(x as f32 + 0.5 - from.x, rise);
                let part = point.dot(way) / length;
                let near = near[0] + (near[1] - near[0]) * part.clamp(0.0, 1.0);
                let pixel = y * self.width + x;
                let is_on =
                    (0.0..=1.0).contains(&part) && point.perp_dot(way).abs() <= half_px * near;
                if is_on && near > self.nearness[pixel] {
                    self.nearness[pixel] = near;
                    self.pixels[pixel] = stroke.color;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(strokes: &[Stroke]) -> Canvas {
        let mut canvas = Canvas::new([200, 100], 90.0, &Pose::level(Vec3::new(0.0, 0.0, 1.0), 0.0));
        strokes.iter().for_each(|stroke| canvas.draw(stroke));
        canvas
    }

    fn across(distance_m: f32, color: u32) -> Stroke {
        let at = |y| Vec3::new(distance_m, y, 1.0);
        Stroke { ends: [at(-50.0), at(50.0)], width_m: 0.2, color }
    }

    #[test]
    fn a_line_is_as_wide_as_its_distance_says_and_nearer_ones_hide_it() {
        // With a focal length of 100 pixels, 0.2 m at 5 m are 4 pixels.
        let canvas = shown(&[across(5.0, 7)]);
        let column = |x: usize| (0..100).filter(|y| canvas.pixels[y * 200 + x] == 7).count();
        assert_eq!([0, 50, 199].map(column), [4; 3]);
        let both = [across(5.0, 7), across(10.0, 8)];
        for order in [[0, 1], [1, 0]] {
            let canvas = shown(&order.map(|index| both[index]));
            assert!(!canvas.pixels.contains(&8), "the farther line shows through");
        }
        assert!(shown(&[across(-5.0, 7)]).pixels.iter().all(|pixel| *pixel == OPAQUE));
    }

    #[test]
    fn a_lane_below_the_camera_narrows_to_the_horizon() {
        let lane = Stroke { ends: [Vec3::X * -10.0, Vec3::X * 1000.0], width_m: 0.2, color: 7 };
        let canvas = shown(&[lane]);
        let row = |y: usize| canvas.pixels[y * 200..][..200].iter().filter(|p| **p == 7).count();
        // One metre below the camera, row 50 + 100 / d shows what lies d metres ahead.
        assert_eq!([row(99), row(75), row(60), row(49)], [10, 6, 2, 0]);
    }

    #[test]
    fn a_box_has_three_edges_at_each_corner() {
        let all = edges(Vec3::ZERO, Quat::IDENTITY, Vec3::new(1.0, 2.0, 3.0), [1, 2, 3]);
        for corner in 0..8 {
            let side = |bit: i32| if corner & bit == 0 { -1.0 } else { 1.0 };
            let at = Vec3::new(side(1), 2.0 * side(2), 3.0 * side(4));
            let count = all.iter().filter(|edge| edge.ends.contains(&at)).count();
            assert_eq!(count, 3, "{at}");
        }
    }
}
