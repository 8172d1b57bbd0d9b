//! Measurements as bytes for a page: JPEG images and points of 8 bytes.

use client_lib::{DEPTH_FAR_M, Image, Measurement, Tag};
use image_file::{JpegError, Pixels};

use crate::{
    data_set::Measured,
    message::{Output, binary, kind},
};

/// Quality of the JPEG images: artefacts are not visible on a screen at this one.
const QUALITY: u8 = 85;
/// Points are in units of this many metres, which reaches 327 m in 16 bits.
const POINT_UNIT_M: f32 = 0.01;

/// Returns the message of one output of sensor `sensor`; `None` if it rested at this frame.
///
/// # Errors
///
/// [`JpegError`] if the image is too large for JPEG.
pub(crate) fn message(
    measured: &Measurement,
    sensor: usize,
    output: Output,
    channel: u32,
) -> Result<Option<Vec<u8>>, JpegError> {
    let frame = measured.frame().0;
    let jpeg = |size, pixels: Pixels<'_>| jpeg(binary(kind::IMAGE, channel, frame), size, pixels);
    let encoded = match output {
        Output::Color => measured
            .color_image(sensor)
            .map(|image| color(binary(kind::IMAGE, channel, frame), &image)),
        Output::Depth => measured
            .depth_image(sensor)
            .map(|image| jpeg([image.width, image.height], Pixels::Grey(&greys(image.data)))),
        Output::Tags => measured
            .tag_image(sensor)
            .map(|image| jpeg([image.width, image.height], Pixels::Rgb(&tag_colors(image.data)))),
        Output::Instances => measured.instance_image(sensor).map(|image| {
            jpeg([image.width, image.height], Pixels::Rgb(&instance_colors(image.data)))
        }),
        Output::Lidar => measured.point_cloud(sensor).map(|cloud| {
            Ok(points(binary(kind::POINTS, channel, frame), cloud.points, cloud.labels))
        }),
    };
    encoded.transpose()
}

/// Returns the message of one output of a data set.
///
/// # Errors
///
/// [`JpegError`] if the image is too large for JPEG.
pub(crate) fn stored(measured: &Measured, channel: u32, frame: u64) -> Result<Vec<u8>, JpegError> {
    let head = || binary(kind::IMAGE, channel, frame);
    match measured {
        Measured::Color(file) => {
            let mut bytes = head();
            bytes.extend(file);
            Ok(bytes)
        }
        Measured::Depth { size, depths_m } => jpeg(head(), *size, Pixels::Grey(&greys(depths_m))),
        Measured::Tags { size, codes } => jpeg(head(), *size, Pixels::Rgb(&tag_colors(codes))),
        Measured::Instances { size, ids } => {
            jpeg(head(), *size, Pixels::Rgb(&instance_colors(ids)))
        }
        Measured::Points { points: cloud, labels } => {
            Ok(points(binary(kind::POINTS, channel, frame), cloud, labels))
        }
    }
}

/// Returns a colour image as a JPEG file.
///
/// # Errors
///
/// [`JpegError`] if the image is too large for JPEG.
pub(crate) fn color_jpeg(image: &Image<[u8; 4]>) -> Result<Vec<u8>, JpegError> {
    color(Vec::new(), image)
}

fn color(head: Vec<u8>, image: &Image<[u8; 4]>) -> Result<Vec<u8>, JpegError> {
    jpeg(head, [image.width, image.height], Pixels::Rgbx(image.data.as_flattened()))
}

/// Appends a JPEG file.
fn jpeg(mut bytes: Vec<u8>, size: [u32; 2], pixels: Pixels<'_>) -> Result<Vec<u8>, JpegError> {
    image_file::jpeg(size, pixels, QUALITY, &mut bytes).map(|()| bytes)
}

fn greys(depths_m: &[f32]) -> Vec<u8> {
    depths_m.iter().map(|depth| grey_of(*depth)).collect()
}

fn tag_colors(codes: &[u8]) -> Vec<u8> {
    codes.iter().flat_map(|code| color_of_tag(*code)).collect()
}

fn instance_colors(ids: &[u32]) -> Vec<u8> {
    ids.iter().flat_map(|id| color_of_instance(*id)).collect()
}

/// Returns CARLA's logarithmic grey of a depth: black near, white at [`DEPTH_FAR_M`].
fn grey_of(depth_m: f32) -> u8 {
    let share = 1.0 + (depth_m / DEPTH_FAR_M).max(1e-6).ln() / 5.703_78;
    (share.clamp(0.0, 1.0) * 255.0) as u8
}

fn color_of_tag(code: u8) -> [u8; 3] {
    Tag::from_code(code).map_or([0; 3], Tag::color)
}

/// Returns a colour that differs between neighbouring ids; black for none.
fn color_of_instance(id: u32) -> [u8; 3] {
    if id == 0 {
        return [0; 3];
    }
    // The finaliser of MurmurHash3 (Appleby 2008).
    let mut hash = id;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    let [r, g, b, _] = (hash ^ hash >> 16).to_le_bytes();
    [r | 0x20, g | 0x20, b | 0x20]
}

/// Appends the points that were hit: x, y, z as i16 in centimetres, tag, and attribute of 0 to 255.
fn points(mut bytes: Vec<u8>, points: &[[f32; 4]], labels: &[[u32; 2]]) -> Vec<u8> {
    for (index, [x, y, z, attribute]) in points.iter().enumerate() {
        if [*x, *y, *z] == [0.0; 3] {
            continue;
        }
        for coordinate in [x, y, z] {
            bytes.extend(((coordinate / POINT_UNIT_M).round() as i16).to_le_bytes());
        }
        let tag = labels.get(index).map_or(0, |[_, tag]| *tag as u8);
        bytes.extend([tag, (attribute.clamp(0.0, 1.0) * 255.0) as u8]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_a_hit_are_left_out_and_the_rest_are_in_centimetres() {
        let measured = [[0.0; 4], [1.0, -2.5, 400.0, 0.5]];
        let bytes = points(Vec::new(), &measured, &[[0, 0], [9, 14]]);
        let expected = [100i16, -250, i16::MAX].map(i16::to_le_bytes).concat();
        assert_eq!(bytes, [expected, vec![14, 127]].concat());
    }

    #[test]
    fn depth_is_darker_the_nearer_it_is() {
        let greys = [0.0, 1.0, 10.0, 100.0, DEPTH_FAR_M, f32::INFINITY].map(grey_of);
        assert!(greys.is_sorted() && greys[0] == 0 && greys[4] == 255, "{greys:?}");
    }
}
