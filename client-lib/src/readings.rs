//! Typed readings of the sensors of motion and contact.

use std::time::Duration;

use bytemuck::TransparentWrapper;
use glam::Vec3;
use mesh::Tag;
use protocol::{
    ActorId, CollisionReading, GnssReading, ImuReading, LaneInvasionReading, ObstacleReading,
    OdometryReading,
};
use road::{LaneIndex, MarkChange, MarkColor, MarkKind};

use crate::Measurement;

/// The reading of an inertial measurement unit: means over the time since its last reading, in
/// sensor space (x forward, y left, z up).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Imu {
    /// Specific force, m/s²; at rest it points upwards with the magnitude of gravity.
    pub accelerometer: Vec3,
    /// Angular velocity, rad/s.
    pub gyroscope: Vec3,
    /// Heading clockwise from north (world y), radians, 0 to 2π.
    pub compass_rad: f32,
    /// Simulated time over which the means were taken, to the precision of an `f32` in seconds.
    pub averaged_over: Duration,
}

impl From<&ImuReading> for Imu {
    fn from(reading: &ImuReading) -> Imu {
        Imu {
            accelerometer: Vec3::from_array(reading.accelerometer_mps2),
            gyroscope: Vec3::from_array(reading.gyroscope_radps),
            compass_rad: reading.compass_rad,
            averaged_over: Duration::try_from_secs_f32(reading.over_secs).unwrap_or_default(),
        }
    }
}

/// The reading of a GNSS receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Gnss {
    /// Latitude, degrees, positive to the north.
    pub latitude_deg: f64,
    /// Longitude, degrees, positive to the east.
    pub longitude_deg: f64,
    /// Altitude above the map's zero, metres.
    pub altitude_m: f64,
}

impl From<&GnssReading> for Gnss {
    fn from(reading: &GnssReading) -> Gnss {
        let GnssReading { latitude_deg, longitude_deg, altitude_m } = *reading;
        Gnss { latitude_deg, longitude_deg, altitude_m }
    }
}

/// The reading of a speedometer and odometer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Odometry {
    /// Speed of the sensor along its x axis, m/s; negative: backwards.
    pub speed_mps: f32,
    /// Mean rim speed of all wheels, m/s, which differs from `speed_mps` when wheels spin or lock;
    /// equal to `speed_mps` for actors without wheels.
    pub wheel_speed_mps: f32,
    /// Angular velocity about the sensor's z axis, rad/s, positive to the left.
    pub yaw_rate_radps: f32,
    /// Steering angle of the front wheels, radians, positive to the left.
    pub steer_rad: f32,
    /// Integral of `wheel_speed_mps` since the sensor was created, metres; backwards counts
    /// negative.
    pub distance_m: f64,
}

impl From<&OdometryReading> for Odometry {
    fn from(reading: &OdometryReading) -> Odometry {
        let OdometryReading { speed_mps, wheel_speed_mps, yaw_rate_radps, steer_rad, distance_m } =
            *reading;
        Odometry { speed_mps, wheel_speed_mps, yaw_rate_radps, steer_rad, distance_m }
    }
}

/// What a carrier touched, or what lies ahead of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DetectedObject {
    /// An actor.
    Actor(ActorId),
    /// A static object of the town; its id, as in instance images.
    StaticObject(u32),
    /// The ground.
    Ground,
}

impl DetectedObject {
    /// Returns the actor; `None` for a static object and the ground.
    #[must_use]
    pub fn actor(self) -> Option<ActorId> {
        match self {
            DetectedObject::Actor(actor) => Some(actor),
            DetectedObject::StaticObject(_) | DetectedObject::Ground => None,
        }
    }

    fn from_wire(actor: ActorId, object: u32) -> DetectedObject {
        match (actor, object) {
            (ActorId::NONE, 0) => DetectedObject::Ground,
            (ActorId::NONE, object) => DetectedObject::StaticObject(object),
            (actor, _) => DetectedObject::Actor(actor),
        }
    }
}

/// Returns the semantic tag of a record; [`Tag::Unlabeled`] for a code that has no tag.
fn tag(code: u32) -> Tag {
    u8::try_from(code).ok().and_then(Tag::from_code).unwrap_or(Tag::Unlabeled)
}

/// A contact of the carrier with one actor or static object during one frame: a view of the
/// measurement's memory. [`Measurement::frame`] and [`Measurement::sim_time`] say when.
#[derive(Clone, Copy, Debug, PartialEq, TransparentWrapper)]
#[repr(transparent)]
pub struct Collision(CollisionReading);

impl Collision {
    /// Returns the actor or static object that the carrier touched.
    #[must_use]
    pub fn other(&self) -> DetectedObject {
        DetectedObject::from_wire(self.0.other, self.0.object)
    }

    /// Returns the semantic tag of the other.
    #[must_use]
    pub fn tag(&self) -> Tag {
        tag(self.0.tag)
    }

    /// Returns whether the two did not touch in the frame before.
    #[must_use]
    pub fn is_first_contact(&self) -> bool {
        self.0.began != 0
    }

    /// Returns the impulse on the carrier over the frame, in world space, newton seconds.
    #[must_use]
    pub fn impulse(&self) -> Vec3 {
        Vec3::from_array(self.0.impulse_ns)
    }
}

/// A corner of a vehicle's bounding box, seen from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Corner {
    /// Front left.
    FrontLeft,
    /// Front right.
    FrontRight,
    /// Rear left.
    RearLeft,
    /// Rear right.
    RearRight,
}

/// A side of a lane, in its direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LaneSide {
    /// Left.
    Left,
    /// Right.
    Right,
}

/// A lane marking that a corner of the carrier crossed during one frame: a view of the
/// measurement's memory.
#[derive(Clone, Copy, Debug, PartialEq, TransparentWrapper)]
#[repr(transparent)]
pub struct LaneInvasion(LaneInvasionReading);

impl LaneInvasion {
    /// Returns the type of the marking.
    #[must_use]
    pub fn marking(&self) -> MarkKind {
        MarkKind::from_number(self.0.kind).unwrap_or(MarkKind::Other)
    }

    /// Returns the colour of the marking.
    #[must_use]
    pub fn color(&self) -> MarkColor {
        MarkColor::from_number(self.0.color).unwrap_or(MarkColor::Other)
    }

    /// Returns the lane changes that the marking permits.
    #[must_use]
    pub fn permitted_change(&self) -> MarkChange {
        match self.0.change {
            0 => MarkChange::None,
            1 => MarkChange::Increase,
            2 => MarkChange::Decrease,
            _ => MarkChange::Both,
        }
    }

    /// Returns the width of a single line of the marking, metres.
    #[must_use]
    pub fn width_m(&self) -> f32 {
        self.0.width_m
    }

    /// Returns the corner of the carrier that crossed the marking.
    #[must_use]
    pub fn corner(&self) -> Corner {
        match self.0.corner {
            0 => Corner::FrontLeft,
            1 => Corner::FrontRight,
            2 => Corner::RearLeft,
            _ => Corner::RearRight,
        }
    }

    /// Returns the side of the lane that the corner left on which the marking lies.
    #[must_use]
    pub fn side(&self) -> LaneSide {
        if self.0.to_left != 0 { LaneSide::Left } else { LaneSide::Right }
    }

    /// Returns the lane that the corner left: an index into `road::Network::lanes`.
    #[must_use]
    pub fn from_lane(&self) -> LaneIndex {
        LaneIndex(self.0.from_lane)
    }

    /// Returns the OpenDRIVE id of the lane that the corner left.
    #[must_use]
    pub fn from_lane_id(&self) -> i32 {
        self.0.from_lane_id
    }
}

/// The nearest obstacle ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Obstacle {
    /// What it is.
    pub object: DetectedObject,
    /// Its semantic tag.
    pub tag: Tag,
    /// Distance that the sphere moved along the sensor's x axis until it touched the obstacle,
    /// metres.
    pub distance_m: f32,
}

impl From<&ObstacleReading> for Obstacle {
    fn from(reading: &ObstacleReading) -> Obstacle {
        Obstacle {
            object: DetectedObject::from_wire(reading.other, reading.object),
            tag: tag(reading.tag),
            distance_m: reading.distance_m,
        }
    }
}

impl Measurement {
    /// Returns the reading of an inertial measurement unit.
    #[must_use]
    pub fn imu(&self, sensor: usize) -> Option<Imu> {
        self.readings(sensor).first().map(Imu::from)
    }

    /// Returns the reading of a GNSS receiver.
    #[must_use]
    pub fn gnss(&self, sensor: usize) -> Option<Gnss> {
        self.readings(sensor).first().map(Gnss::from)
    }

    /// Returns the reading of a speedometer and odometer.
    #[must_use]
    pub fn odometry(&self, sensor: usize) -> Option<Odometry> {
        self.readings(sensor).first().map(Odometry::from)
    }

    /// Returns the contacts of the carrier during this frame.
    #[must_use]
    pub fn collisions(&self, sensor: usize) -> &[Collision] {
        Collision::wrap_slice(self.readings(sensor))
    }

    /// Returns the lane markings that the carrier crossed during this frame.
    #[must_use]
    pub fn lane_invasions(&self, sensor: usize) -> &[LaneInvasion] {
        LaneInvasion::wrap_slice(self.readings(sensor))
    }

    /// Returns the nearest obstacle ahead; `None` if there is none in range.
    #[must_use]
    pub fn obstacle(&self, sensor: usize) -> Option<Obstacle> {
        self.readings(sensor).first().map(Obstacle::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_is_with_an_actor_or_a_static_object() {
        let reading = CollisionReading {
            other: ActorId(7),
            tag: Tag::Car as u32,
            began: 1,
            impulse_ns: [1.0, -2.0, 3.0],
            ..CollisionReading::default()
        };
        let hit = Collision::wrap_ref(&reading);
        assert_eq!((hit.other(), hit.tag()), (DetectedObject::Actor(ActorId(7)), Tag::Car));
        assert_eq!(hit.other().actor(), Some(ActorId(7)));
        assert_eq!((hit.is_first_contact(), hit.impulse()), (true, Vec3::new(1.0, -2.0, 3.0)));
        let object = 1 << 31 | 5;
        let reading = CollisionReading { object, tag: 200, ..CollisionReading::default() };
        let hit = Collision::wrap_ref(&reading);
        assert_eq!(hit.other(), DetectedObject::StaticObject(object));
        assert_eq!((hit.other().actor(), hit.tag()), (None, Tag::Unlabeled));
        let seen = Obstacle::from(&ObstacleReading { distance_m: 2.0, ..Default::default() });
        assert_eq!((seen.object, seen.distance_m), (DetectedObject::Ground, 2.0));
    }

    #[test]
    fn a_crossed_marking_has_type_side_and_lane() {
        let reading = LaneInvasionReading {
            kind: MarkKind::SolidBroken as u32,
            color: MarkColor::Yellow as u32,
            change: MarkChange::Increase as u32,
            width_m: 0.15,
            corner: 2,
            to_left: 1,
            from_lane: 12,
            from_lane_id: -2,
        };
        let crossed = LaneInvasion::wrap_ref(&reading);
        assert_eq!(
            (crossed.marking(), crossed.color(), crossed.permitted_change(), crossed.width_m()),
            (MarkKind::SolidBroken, MarkColor::Yellow, MarkChange::Increase, 0.15)
        );
        assert_eq!(
            (crossed.corner(), crossed.side(), crossed.from_lane(), crossed.from_lane_id()),
            (Corner::RearLeft, LaneSide::Left, LaneIndex(12), -2)
        );
    }
}
