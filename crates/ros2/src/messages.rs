//! Messages of ROS 2 in CDR, field by field in the order of their definitions
//! (rosgraph_msgs, std_msgs, geometry_msgs, nav_msgs, sensor_msgs, tf2_msgs, carla_msgs).

use std::time::Duration;

use client_lib::{
    Gnss, Imu, PointCloud, Pose, Projection, VehicleState,
    glam::{Quat, Vec3},
    wire::lens_model,
};

use crate::cdr::{CdrReader, CdrWriter};

/// Room for a message without data of variable length.
const SMALL: usize = 1024;
/// The number of `float32` among the types of the fields of a point.
const FLOAT32: u8 = 7;

/// What most messages begin with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header<'a> {
    /// Simulated time.
    pub(crate) stamp: Duration,
    /// The coordinate frame.
    pub(crate) frame_id: &'a str,
}

impl Header<'_> {
    fn write(&self, cdr: &mut CdrWriter) {
        time(cdr, self.stamp);
        cdr.string(self.frame_id);
    }

    /// Begins a message with this header.
    fn begin(&self, capacity: usize) -> CdrWriter {
        let mut cdr = CdrWriter::with_capacity(SMALL + capacity);
        self.write(&mut cdr);
        cdr
    }
}

fn time(cdr: &mut CdrWriter, stamp: Duration) {
    cdr.i32(stamp.as_secs() as i32);
    cdr.u32(stamp.subsec_nanos());
}

fn vector(cdr: &mut CdrWriter, vector: Vec3) {
    cdr.f64s(&vector.as_dvec3().to_array());
}

fn quaternion(cdr: &mut CdrWriter, rotation: Quat) {
    cdr.f64s(&rotation.as_dquat().to_array());
}

/// `rosgraph_msgs/msg/Clock`.
pub(crate) fn clock(stamp: Duration) -> Vec<u8> {
    let mut cdr = CdrWriter::with_capacity(SMALL);
    time(&mut cdr, stamp);
    cdr.finish()
}

/// `carla_msgs/msg/CarlaStatus`.
pub(crate) fn status(frame: u64, delta: Duration, is_synchronous: bool) -> Vec<u8> {
    let mut cdr = CdrWriter::with_capacity(SMALL);
    cdr.u64(frame);
    cdr.f32(delta.as_secs_f32());
    cdr.bool(is_synchronous);
    // Frames pass, or this would not be published.
    cdr.bool(true);
    cdr.finish()
}

/// `std_msgs/msg/Float32`.
pub(crate) fn float32(value: f32) -> Vec<u8> {
    let mut cdr = CdrWriter::with_capacity(SMALL);
    cdr.f32(value);
    cdr.finish()
}

/// Motion of a vehicle: position and rotation in world space, the rest in the space that is named.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// `world_from_vehicle`.
    pub(crate) pose: Pose,
    /// In vehicle space, m/s.
    pub(crate) velocity: Vec3,
    /// In vehicle space, rad/s.
    pub(crate) angular_velocity: Vec3,
}

/// `nav_msgs/msg/Odometry`, without uncertainty.
pub(crate) fn odometry(header: Header<'_>, child_frame_id: &str, motion: &Motion) -> Vec<u8> {
    let mut cdr = header.begin(0);
    cdr.string(child_frame_id);
    vector(&mut cdr, motion.pose.position());
    quaternion(&mut cdr, motion.pose.rotation());
    cdr.f64s(&[0.0; 36]);
    vector(&mut cdr, motion.velocity);
    vector(&mut cdr, motion.angular_velocity);
    cdr.f64s(&[0.0; 36]);
    cdr.finish()
}

/// `tf2_msgs/msg/TFMessage`: `frame_from_child` of each child.
pub(crate) fn transforms<'a>(all: &[(Header<'a>, &'a str, Pose)]) -> Vec<u8> {
    let mut cdr = CdrWriter::with_capacity(SMALL);
    cdr.u32(all.len() as u32);
    for (header, child_frame_id, pose) in all {
        header.write(&mut cdr);
        cdr.string(child_frame_id);
        vector(&mut cdr, pose.position());
        quaternion(&mut cdr, pose.rotation());
    }
    cdr.finish()
}

/// `carla_msgs/msg/CarlaEgoVehicleStatus`: speed in m/s, acceleration in world space in m/s².
pub(crate) fn vehicle_status(
    header: Header<'_>,
    speed_mps: f32,
    acceleration: Vec3,
    rotation: Quat,
    state: &VehicleState,
) -> Vec<u8> {
    let mut cdr = header.begin(0);
    cdr.f32(speed_mps);
    vector(&mut cdr, acceleration);
    vector(&mut cdr, Vec3::ZERO);
    quaternion(&mut cdr, rotation);
    header.write(&mut cdr);
    cdr.f32(state.throttle);
    // CARLA counts to the right.
    cdr.f32(-state.steer);
    cdr.f32(state.brake);
    cdr.bool(false);
    cdr.bool(state.gear < 0);
    cdr.i32(state.gear);
    cdr.bool(false);
    cdr.finish()
}

/// `sensor_msgs/msg/Imu`, without uncertainty.
pub(crate) fn imu(header: Header<'_>, rotation: Quat, reading: &Imu) -> Vec<u8> {
    let mut cdr = header.begin(0);
    quaternion(&mut cdr, rotation);
    cdr.f64s(&[0.0; 9]);
    vector(&mut cdr, reading.gyroscope);
    cdr.f64s(&[0.0; 9]);
    vector(&mut cdr, reading.accelerometer);
    cdr.f64s(&[0.0; 9]);
    cdr.finish()
}

/// `sensor_msgs/msg/NavSatFix`: a fix by GPS, without uncertainty.
pub(crate) fn fix(header: Header<'_>, reading: &Gnss) -> Vec<u8> {
    let mut cdr = header.begin(0);
    cdr.u8(0);
    cdr.u16(1);
    cdr.f64s(&[reading.latitude_deg, reading.longitude_deg, reading.altitude_m]);
    cdr.f64s(&[0.0; 9]);
    cdr.u8(0);
    cdr.finish()
}

/// `sensor_msgs/msg/Image` of `len` bytes that `fill` appends, row by row from the top.
pub(crate) fn image(
    header: Header<'_>,
    [width, height]: [u32; 2],
    encoding: &str,
    len: usize,
    fill: impl FnOnce(&mut Vec<u8>),
) -> Vec<u8> {
    let mut cdr = header.begin(len);
    cdr.u32(height);
    cdr.u32(width);
    cdr.string(encoding);
    cdr.u8(0);
    cdr.u32(len as u32 / height.max(1));
    cdr.bytes_with(len, fill);
    cdr.finish()
}

/// `sensor_msgs/msg/CameraInfo`.
pub(crate) fn camera_info(
    header: Header<'_>,
    [width, height]: [u32; 2],
    projection: &Projection,
) -> Vec<u8> {
    let [[fx, fy], [cx, cy]] = [projection.focal_px(), projection.center_px()]
        .map(|pair| pair.map(|px| f64::from(px as f32)));
    let (model, count) = match projection.model() {
        lens_model::FISHEYE => ("equidistant", 4),
        _ => ("plumb_bob", 5),
    };
    let mut cdr = header.begin(0);
    cdr.u32(height);
    cdr.u32(width);
    cdr.string(model);
    cdr.u32(count as u32);
    cdr.f64s(&projection.coefficients()[..count]);
    cdr.f64s(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    cdr.f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    cdr.f64s(&[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    // No binning, and no region of interest: offsets, sizes, whether it is rectified.
    [0; 6].iter().for_each(|number| cdr.u32(*number));
    cdr.bool(false);
    cdr.finish()
}

/// `sensor_msgs/msg/PointCloud2` of the points that were hit: x, y, z in metres and intensity.
pub(crate) fn point_cloud(header: Header<'_>, cloud: &PointCloud<'_>) -> Vec<u8> {
    const STEP: usize = 16;
    let count = cloud.hits().count();
    let mut cdr = header.begin(STEP * count);
    cdr.u32(1);
    cdr.u32(count as u32);
    cdr.u32(4);
    for (name, offset) in [("x", 0), ("y", 4), ("z", 8), ("intensity", 12)] {
        cdr.string(name);
        cdr.u32(offset);
        cdr.u8(FLOAT32);
        cdr.u32(1);
    }
    cdr.bool(false);
    cdr.u32(STEP as u32);
    cdr.u32((STEP * count) as u32);
    cdr.bytes_with(STEP * count, |bytes| {
        for (Vec3 { x, y, z }, intensity) in cloud.hits() {
            [x, y, z, intensity].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        }
    });
    cdr.bool(true);
    cdr.finish()
}

/// `carla_msgs/msg/CarlaEgoVehicleControl`, with CARLA's signs: steering is positive to the right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EgoControl {
    pub(crate) throttle: f32,
    pub(crate) steer: f32,
    pub(crate) brake: f32,
    pub(crate) hand_brake: bool,
    pub(crate) reverse: bool,
    pub(crate) gear: i32,
    pub(crate) manual_gear_shift: bool,
}

impl EgoControl {
    /// Reads a message; `None` if it is none, or a number is not finite.
    pub(crate) fn read(message: &[u8]) -> Option<EgoControl> {
        let mut cdr = CdrReader::of_message(message)?;
        let (_seconds, _nanos, _frame_id) = (cdr.i32()?, cdr.u32()?, cdr.string()?);
        let control = EgoControl {
            throttle: cdr.f32()?,
            steer: cdr.f32()?,
            brake: cdr.f32()?,
            hand_brake: cdr.bool()?,
            reverse: cdr.bool()?,
            gear: cdr.i32()?,
            manual_gear_shift: cdr.bool()?,
        };
        let numbers = [control.throttle, control.steer, control.brake];
        numbers.iter().all(|number| number.is_finite()).then_some(control)
    }
}

/// Reads `std_msgs/msg/Bool`.
pub(crate) fn read_bool(message: &[u8]) -> Option<bool> {
    CdrReader::of_message(message)?.bool()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_is_read_and_what_is_not_finite_is_none() {
        let message = |throttle: f32| {
            let mut cdr = Header { stamp: Duration::new(3, 5), frame_id: "map" }.begin(0);
            [throttle, -0.25, 0.0].iter().for_each(|number| cdr.f32(*number));
            cdr.bool(false);
            cdr.bool(true);
            cdr.i32(2);
            cdr.bool(true);
            cdr.finish()
        };
        let expected = EgoControl {
            throttle: 0.5,
            steer: -0.25,
            reverse: true,
            gear: 2,
            manual_gear_shift: true,
            ..EgoControl::default()
        };
        assert_eq!(EgoControl::read(&message(0.5)), Some(expected));
        assert_eq!(EgoControl::read(&message(f32::NAN)), None);
        let whole = message(0.5);
        for end in 0..whole.len() {
            assert_eq!(EgoControl::read(&whole[..end]), None);
        }
    }
}
