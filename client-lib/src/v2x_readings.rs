//! Typed messages that V2X stations receive.

use std::time::Duration;

use bytemuck::TransparentWrapper;
use glam::Vec3;
use protocol::{ActorId, CamReading, MessageReading};

use crate::{Measurement, VehicleLights};

/// The type of a V2X station: the numbers of ETSI TS 102 894-2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum V2xStationType {
    /// Unknown.
    Unknown,
    /// A pedestrian.
    Pedestrian,
    /// A cyclist.
    Cyclist,
    /// A motorcycle.
    Motorcycle,
    /// A passenger car.
    PassengerCar,
    /// A bus.
    Bus,
    /// A light truck.
    LightTruck,
    /// A special vehicle, as of police or ambulance.
    SpecialVehicle,
    /// A tram.
    Tram,
    /// A roadside unit.
    RoadsideUnit,
    /// Another number.
    Other(u32),
}

impl V2xStationType {
    fn from_wire(number: u32) -> V2xStationType {
        match number {
            0 => V2xStationType::Unknown,
            1 => V2xStationType::Pedestrian,
            2 => V2xStationType::Cyclist,
            4 => V2xStationType::Motorcycle,
            5 => V2xStationType::PassengerCar,
            6 => V2xStationType::Bus,
            7 => V2xStationType::LightTruck,
            10 => V2xStationType::SpecialVehicle,
            11 => V2xStationType::Tram,
            15 => V2xStationType::RoadsideUnit,
            other => V2xStationType::Other(other),
        }
    }
}

/// The role of a vehicle: the numbers of ETSI TS 102 894-2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum V2xVehicleRole {
    /// Default.
    Default,
    /// Public transport.
    PublicTransport,
    /// Emergency.
    Emergency,
    /// Another number.
    Other(u32),
}

impl V2xVehicleRole {
    fn from_wire(number: u32) -> V2xVehicleRole {
        match number {
            0 => V2xVehicleRole::Default,
            1 => V2xVehicleRole::PublicTransport,
            6 => V2xVehicleRole::Emergency,
            other => V2xVehicleRole::Other(other),
        }
    }
}

/// The low-frequency container of a cooperative awareness message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct V2xLowFrequency {
    /// Role of the vehicle.
    pub role: V2xVehicleRole,
    /// Exterior lights that are on.
    pub lights: VehicleLights,
}

/// A cooperative awareness message (ETSI EN 302 637-2) that was received in one frame: a view of
/// the measurement's memory. Its values are those of the sender, with the sender's errors.
#[derive(Clone, Copy, Debug, PartialEq, TransparentWrapper)]
#[repr(transparent)]
pub struct V2xAwarenessMessage(CamReading);

impl V2xAwarenessMessage {
    /// Returns the received power, dBm.
    #[must_use]
    pub fn power_dbm(&self) -> f32 {
        self.0.power_dbm
    }

    /// Returns the actor that carries the sender: its station id.
    #[must_use]
    pub fn sender(&self) -> ActorId {
        ActorId(self.0.station_id)
    }

    /// Returns the type of the sending station.
    #[must_use]
    pub fn station_type(&self) -> V2xStationType {
        V2xStationType::from_wire(self.0.station_type)
    }

    /// Returns the simulated time at which the message was generated, modulo 65.536 s and to the
    /// millisecond.
    #[must_use]
    pub fn generation_time(&self) -> Duration {
        Duration::from_millis(self.0.generation_delta_ms.into())
    }

    /// Returns the latitude, degrees, positive to the north.
    #[must_use]
    pub fn latitude_deg(&self) -> f64 {
        self.0.latitude_deg
    }

    /// Returns the longitude, degrees, positive to the east.
    #[must_use]
    pub fn longitude_deg(&self) -> f64 {
        self.0.longitude_deg
    }

    /// Returns the altitude above the map's zero, metres.
    #[must_use]
    pub fn altitude_m(&self) -> f64 {
        self.0.altitude_m
    }

    /// Returns the heading clockwise from north, radians, 0 to 2π.
    #[must_use]
    pub fn heading_rad(&self) -> f32 {
        self.0.heading_rad
    }

    /// Returns the speed along the vehicle's x axis, m/s, never negative.
    #[must_use]
    pub fn speed_mps(&self) -> f32 {
        self.0.speed_mps
    }

    /// Returns whether the vehicle drives backwards.
    #[must_use]
    pub fn is_reversing(&self) -> bool {
        self.0.drive_direction != 0
    }

    /// Returns the length of the vehicle's bounding box, metres.
    #[must_use]
    pub fn length_m(&self) -> f32 {
        self.0.length_m
    }

    /// Returns the width of the vehicle's bounding box, metres.
    #[must_use]
    pub fn width_m(&self) -> f32 {
        self.0.width_m
    }

    /// Returns the acceleration in vehicle space (x forward, y left, z up), without gravity, m/s².
    #[must_use]
    pub fn acceleration(&self) -> Vec3 {
        Vec3::from_array(self.0.acceleration_mps2)
    }

    /// Returns the yaw rate, rad/s, positive to the left.
    #[must_use]
    pub fn yaw_rate_radps(&self) -> f32 {
        self.0.yaw_rate_radps
    }

    /// Returns role and lights, which are sent twice a second; `None` if this message has none.
    #[must_use]
    pub fn low_frequency(&self) -> Option<V2xLowFrequency> {
        (self.0.has_low_frequency != 0).then(|| V2xLowFrequency {
            role: V2xVehicleRole::from_wire(self.0.role),
            lights: VehicleLights::from_bits_truncate(self.0.lamps),
        })
    }
}

/// A text that was received by radio in one frame: a view of the measurement's memory.
#[derive(Clone, Copy, Debug, PartialEq, TransparentWrapper)]
#[repr(transparent)]
pub struct V2xTextMessage(MessageReading);

impl V2xTextMessage {
    /// Returns the received power, dBm.
    #[must_use]
    pub fn power_dbm(&self) -> f32 {
        self.0.power_dbm
    }

    /// Returns the actor that carries the sender: its station id.
    #[must_use]
    pub fn sender(&self) -> ActorId {
        ActorId(self.0.station_id)
    }

    /// Returns the text up to the first zero byte, as far as it is UTF-8.
    #[must_use]
    pub fn text(&self) -> &str {
        self.0.text()
    }
}

impl Measurement {
    /// Returns the cooperative awareness messages that a V2X station received in this frame.
    #[must_use]
    pub fn awareness_messages(&self, sensor: usize) -> &[V2xAwarenessMessage] {
        V2xAwarenessMessage::wrap_slice(self.readings(sensor))
    }

    /// Returns the texts that a V2X station received in this frame.
    #[must_use]
    pub fn text_messages(&self, sensor: usize) -> &[V2xTextMessage] {
        V2xTextMessage::wrap_slice(self.readings(sensor))
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    #[test]
    fn an_awareness_message_has_typed_values() {
        let reading = CamReading {
            power_dbm: -70.0,
            station_id: 3,
            station_type: 10,
            generation_delta_ms: 1500,
            drive_direction: 1,
            acceleration_mps2: [1.0, 2.0, 3.0],
            has_low_frequency: 1,
            role: 6,
            lamps: protocol::lamp::SPECIAL1,
            ..CamReading::default()
        };
        let message = V2xAwarenessMessage::wrap_ref(&reading);
        assert_eq!((message.power_dbm(), message.sender()), (-70.0, ActorId(3)));
        assert_eq!(message.station_type(), V2xStationType::SpecialVehicle);
        assert_eq!(message.generation_time(), Duration::from_millis(1500));
        assert!(message.is_reversing());
        assert_eq!(message.acceleration(), Vec3::new(1.0, 2.0, 3.0));
        let low = message.low_frequency().unwrap();
        assert_eq!((low.role, low.lights), (V2xVehicleRole::Emergency, VehicleLights::SPECIAL1));
        let other = CamReading { station_type: 99, ..CamReading::default() };
        let message = V2xAwarenessMessage::wrap_ref(&other);
        assert_eq!(message.station_type(), V2xStationType::Other(99));
        assert_eq!(message.low_frequency(), None);
    }

    #[test]
    fn a_text_ends_at_the_first_zero_byte() {
        let mut reading = MessageReading { station_id: 4, ..MessageReading::zeroed() };
        reading.text[..5].copy_from_slice(b"hello");
        let message = V2xTextMessage::wrap_ref(&reading);
        assert_eq!((message.sender(), message.text()), (ActorId(4), "hello"));
    }
}
