//! A camera's image as CARLA's GBuffer textures: 8-bit images beside the image itself.
//!
//! Clients receive Unreal's textures as blue, green, red and alpha of 8 bits, whatever they
//! contain. A texture that a scene does not have is black; here, those are the textures of Unreal's
//! shading model.

use std::sync::OnceLock;

use client_lib::{Measurement, wire::output};
use glam::{Mat3, Vec3};

use crate::{
    pixels::{bgra, pixels},
    stream::Message,
    wire::{flip, message},
};

/// The number of textures.
pub(crate) const COUNT: u32 = 13;
/// The number of the message type.
const TYPE_ID: u64 = 18;
/// The depth that is white in Unreal. Metres.
const WHITE_M: f32 = 160.0;

const SCENE_COLOR: u32 = 0;
const SCENE_DEPTH: u32 = 1;
const SCENE_STENCIL: u32 = 2;
/// Normals.
const A: u32 = 3;
const VELOCITY: u32 = 9;
const CUSTOM_DEPTH: u32 = 11;
const CUSTOM_STENCIL: u32 = 12;

/// Returns the output that the renderer must measure for a texture.
pub(crate) fn outputs(texture: u32) -> u32 {
    match texture {
        SCENE_DEPTH | CUSTOM_DEPTH => output::DEPTH,
        SCENE_STENCIL | CUSTOM_STENCIL => output::TAG,
        A => output::NORMAL,
        VELOCITY => output::FLOW,
        _ => output::COLOR,
    }
}

/// Returns the message of a texture, or `None` if the bundle lacks its output.
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
                let fraction = (depth * (1.0 / WHITE_M)).clamp(0.0, 1.0);
                bgra([greys[(fraction * GREYS as f32) as usize]; 4])
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
            // Positive upwards, as in Unreal.
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

/// The resolution of the table of greys.
const GREYS: usize = 1 << 14;

/// Returns the grey of each step from black to white.
fn greys() -> &'static [u8] {
    static TABLE: OnceLock<Vec<u8>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=GREYS).map(|step| grey(step as f32 / GREYS as f32)).collect())
}

/// Returns a linear intensity as a byte of sRGB (IEC 61966-2-1).
fn grey(intensity: f32) -> u8 {
    let linear = intensity.clamp(0.0, 1.0);
    let curved =
        if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (curved * 255.0 + 0.5) as u8
}

/// Returns −1 to 1 as 0 to 255.
fn signed(value: f32) -> u8 {
    ((value * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Returns a velocity of −2 to 2 half images as a byte, in Unreal's encoding: 127.5 is no motion.
fn velocity(halves: f32) -> u8 {
    ((halves.clamp(-2.0, 2.0) * 0.499 * 0.5 + 0.5) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_encoded_as_srgb_grey() {
        assert_eq!([0.0, 0.5, 1.0, 9.0].map(grey), [0, 188, 255, 255]);
        assert_eq!(signed(-1.0), 0);
        assert_eq!(signed(1.0), 255);
        assert_eq!([-2.0, 0.0, 2.0].map(velocity), [0, 128, 255]);
    }

    #[test]
    fn every_texture_needs_exactly_one_output() {
        assert!((0..COUNT).all(|texture| outputs(texture).count_ones() == 1));
    }
}
