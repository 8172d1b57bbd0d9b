//! What a camera's image is made of, as CARLA's GBuffer textures: 8-bit images beside the image.
//!
//! Unreal's textures come to clients as blue, green, red, alpha of 8 bits, whatever they hold. One
//! that a scene does not have comes black; here that are those that hold how Unreal shades.

use std::sync::OnceLock;

use client_lib::{Measurement, output};
use glam::{Mat3, Vec3};

use crate::{
    measure::{bgra, pixels},
    stream::Message,
    wire::{flip, message},
};

/// How many textures there are.
pub(crate) const COUNT: u32 = 13;
/// The number by which clients know how to read them.
const TYPE_ID: u64 = 18;
/// Depth that is white, as Unreal has it.
const WHITE_M: f32 = 160.0;

const SCENE_COLOR: u32 = 0;
const SCENE_DEPTH: u32 = 1;
const SCENE_STENCIL: u32 = 2;
/// Normals.
const A: u32 = 3;
const VELOCITY: u32 = 9;
const CUSTOM_DEPTH: u32 = 11;
const CUSTOM_STENCIL: u32 = 12;

/// What is to be measured for a texture.
pub(crate) fn outputs(texture: u32) -> u32 {
    match texture {
        SCENE_DEPTH | CUSTOM_DEPTH => output::DEPTH,
        SCENE_STENCIL | CUSTOM_STENCIL => output::TAG,
        A => output::NORMAL,
        VELOCITY => output::FLOW,
        _ => output::COLOR,
    }
}

/// A texture of what was measured; nothing if the bundle lacks it.
pub(crate) fn message_of(texture: u32, measured: &Measurement, fov_deg: f32) -> Option<Message> {
    let plane = measured.planes().first()?;
    let stamp = measured.header().stamp;
    let (pose, count) = (plane.world_from_sensor, plane.width as usize * plane.height as usize);
    let (frame, nanos) = (stamp.frame.0, stamp.sim_time_nanos);
    let mut bytes = message(TYPE_ID, frame, nanos, &pose, 12 + 4 * count);
    bytes.u32(plane.width).u32(plane.height).f32(fov_deg);
    let bytes = match texture {
        SCENE_COLOR => pixels(bytes, measured.color(0)?.iter(), |rgba| bgra(*rgba)),
        SCENE_DEPTH | CUSTOM_DEPTH => {
            let greys = greys();
            let grey = |depth: &f32| {
                let share = (depth * (1.0 / WHITE_M)).clamp(0.0, 1.0);
                bgra([greys[(share * GREYS as f32) as usize]; 4])
            };
            pixels(bytes, measured.depth(0)?.iter(), grey)
        }
        SCENE_STENCIL | CUSTOM_STENCIL => {
            pixels(bytes, measured.tags(0)?.iter(), |tag| bgra([*tag; 4]))
        }
        A => {
            let turn = Mat3::from_quat(pose.rotation());
            pixels(bytes, measured.normals(0)?.iter(), |normal| {
                let [r, g, b] = flip((turn * Vec3::from_array(*normal)).to_array()).map(signed);
                bgra(if *normal == [0.0; 3] { [0; 4] } else { [r, g, b, 0] })
            })
        }
        VELOCITY => {
            // Upwards, as Unreal counts.
            let scale = [2.0 / plane.width as f32, -2.0 / plane.height as f32];
            pixels(bytes, measured.flow(0)?.iter(), |flow| {
                let [x, y] = [0, 1].map(|axis| velocity(flow[axis] * scale[axis]));
                bgra([x, y, 0, 0])
            })
        }
        _ => pixels(bytes, 0..count, |_| bgra([0; 4])),
    };
    Some(bytes.into_message())
}

/// Steps from black to white that are told apart.
const GREYS: usize = 1 << 14;

/// Of each step its grey.
fn greys() -> &'static [u8] {
    static TABLE: OnceLock<Vec<u8>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=GREYS).map(|step| grey(step as f32 / GREYS as f32)).collect())
}

/// A share of light as a byte of sRGB.
fn grey(share: f32) -> u8 {
    let share = share.clamp(0.0, 1.0);
    let curved =
        if share <= 0.003_130_8 { share * 12.92 } else { 1.055 * share.powf(1.0 / 2.4) - 0.055 };
    (curved * 255.0 + 0.5) as u8
}

/// -1 as 0, 1 as 255.
fn signed(share: f32) -> u8 {
    ((share * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// -2 to 2 of half an image as a byte: Unreal's code, a half where nothing moves.
fn velocity(halves: f32) -> u8 {
    ((halves.clamp(-2.0, 2.0) * 0.499 * 0.5 + 0.5) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_light_and_light_is_curved() {
        assert_eq!([0.0, 0.5, 1.0, 9.0].map(grey), [0, 188, 255, 255]);
        assert_eq!(signed(-1.0), 0);
        assert_eq!(signed(1.0), 255);
        assert_eq!([-2.0, 0.0, 2.0].map(velocity), [0, 128, 255]);
    }

    #[test]
    fn every_texture_has_something_to_be_measured() {
        assert!((0..COUNT).all(|texture| outputs(texture).count_ones() == 1));
    }
}
