//! What cameras and lidars measure, in the messages of Foxglove.

use glam::DAffine3;

use crate::{message::Message, shapes::pose};

/// The distortion of a lens, with its coefficients in the order of OpenCV.
#[derive(Clone, Debug, PartialEq)]
pub enum Distortion {
    /// Brown and Conrady's: k1, k2, p1, p2, k3.
    PlumbBob(Vec<f64>),
    /// Of a fisheye: k1 to k4.
    KannalaBrandt(Vec<f64>),
}

/// The projection of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// The intrinsic matrix by rows, pixels; whole coordinates are the centres of pixels.
    pub intrinsics_px: [[f64; 3]; 3],
    /// `None`: a pinhole.
    pub distortion: Option<Distortion>,
}

impl Calibration {
    /// Returns `foxglove.CameraCalibration` of a camera in optical space `space`.
    #[must_use]
    pub fn message(&self, time: &Message, space: &str) -> Message {
        let (model, coefficients) = match &self.distortion {
            None => ("plumb_bob", &[0.0; 5][..]),
            Some(Distortion::PlumbBob(coefficients)) => ("plumb_bob", &coefficients[..]),
            Some(Distortion::KannalaBrandt(coefficients)) => ("kannala_brandt", &coefficients[..]),
        };
        let projection = self.intrinsics_px.map(|row| [row[0], row[1], row[2], 0.0]);
        Message::new()
            .message(1, time)
            .text(9, space)
            .fixed32(2, self.size[0])
            .fixed32(3, self.size[1])
            .text(4, model)
            .doubles(5, coefficients)
            .doubles(6, self.intrinsics_px.as_flattened())
            .doubles(7, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
            .doubles(8, projection.as_flattened())
    }
}

/// Returns `foxglove.CompressedImage` without its file, which goes into field 2. The format is `jpeg`
/// or `png`.
#[must_use]
pub fn compressed_image(time: &Message, space: &str, format: &str) -> Message {
    Message::new().message(1, time).text(4, space).text(3, format)
}

/// The fields of a point: name, offset, `PackedElementField.NumericType`.
const POINT: [(&str, u32, u64); 6] =
    [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("id", 16, 5), ("tag", 20, 5)];

/// Returns `foxglove.PointCloud`: of each point x, y, z and intensity as four f32, and id and tag as
/// two u32, little-endian, in the space of the sensor.
#[must_use]
pub fn point_cloud(time: &Message, space: &str, points: &[u8], labels: &[u8]) -> Message {
    let mut cloud = Message::new().message(1, time).text(2, space);
    cloud = cloud.message(3, &pose(&DAffine3::IDENTITY)).fixed32(4, 24);
    for (name, offset, kind) in POINT {
        let field = Message::new().text(1, name).fixed32(2, offset).integer(3, kind);
        cloud = cloud.message(5, &field);
    }
    let data = cloud.begin_bytes(6, points.len() + labels.len());
    let begin = data.len();
    data.resize(begin + points.len() + labels.len(), 0);
    let records = data[begin..].as_chunks_mut::<24>().0;
    let returns = points.as_chunks::<16>().0.iter().zip(labels.as_chunks::<8>().0);
    for (record, (point, label)) in records.iter_mut().zip(returns) {
        record[..16].copy_from_slice(point);
        record[16..].copy_from_slice(label);
    }
    cloud
}
