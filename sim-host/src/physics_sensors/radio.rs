//! Radio transmissions of a frame, and their reception.

use glam::Vec3;
use protocol::{
    ActorId, CamReading, MessageReading, MessageSpec, Pose, RadioSpec, Refusal, TEXT_BYTES, kind,
};

use super::{
    cam::Cam,
    noise::Noise,
    path_loss::{Sight, Span, loss_db},
    scene::Scene,
};
use crate::world::World;

/// Height of an antenna above the collision box of its carrier.
const ABOVE_M: f32 = 0.02;
/// Most texts that may wait at one sensor.
const TEXTS_MAX: usize = 64;

/// A radio station.
pub(super) enum Station {
    Cam(Box<Cam>),
    Text { spec: MessageSpec, waiting: Vec<[u8; TEXT_BYTES]> },
}

/// A transmission of this frame.
pub(super) struct Transmission {
    from: ActorId,
    antenna: Antenna,
    power_dbm: f32,
    message: Payload,
}

enum Payload {
    Cam(Box<CamReading>),
    Text([u8; TEXT_BYTES]),
}

#[derive(Clone, Copy, PartialEq)]
pub(super) struct Antenna {
    at: Vec3,
    ground_m: f32,
}

impl Antenna {
    /// Returns the antenna above the carrier's box; without a carrier it is at the sensor.
    pub(super) fn of(world: &World, carrier: ActorId, world_from_sensor: &Pose) -> Antenna {
        match world.state(carrier) {
            Some(state) => Antenna { at: top(world, carrier), ground_m: state.pose.position().z },
            None => {
                let at = world_from_sensor.position();
                Antenna { at, ground_m: at.z - 2.0 }
            }
        }
    }
}

fn top(world: &World, id: ActorId) -> Vec3 {
    let Some(state) = world.state(id) else { return Vec3::ZERO };
    let blueprint = &town::catalogue()[state.blueprint as usize];
    let height = blueprint.center_m.z + blueprint.half_extents_m.z + ABOVE_M;
    state.pose.position() + Vec3::Z * height
}

impl Station {
    pub(super) fn radio(&self) -> &RadioSpec {
        match self {
            Station::Cam(cam) => &cam.spec.radio,
            Station::Text { spec, .. } => &spec.radio,
        }
    }

    /// Queues a text for the next frame.
    ///
    /// # Errors
    ///
    /// The station sends no texts, or its queue is full.
    pub(super) fn queue(&mut self, text: [u8; TEXT_BYTES]) -> Result<(), Refusal> {
        match self {
            Station::Cam(_) => {
                Err(Refusal::wrong_kind("a CAM station sends standard messages only, no texts"))
            }
            Station::Text { waiting, .. } if waiting.len() >= TEXTS_MAX => Err(Refusal::full(
                format!("{TEXTS_MAX} texts wait already; they are sent with the next frame"),
            )),
            Station::Text { waiting, .. } => {
                waiting.push(text);
                Ok(())
            }
        }
    }

    /// Appends the transmissions of this frame.
    pub(super) fn send(
        &mut self,
        scene: &Scene,
        world_from_sensor: &Pose,
        noise: &mut Noise,
        air: &mut Vec<Transmission>,
    ) {
        let (world, from) = (scene.world, scene.parent);
        let power_dbm = self.radio().transmit_power_dbm;
        let antenna = Antenna::of(world, from, world_from_sensor);
        let now_secs = scene.header.stamp.sim_time_nanos as f64 * 1e-9;
        match self {
            Station::Cam(cam) => {
                let Some(network) = scene.network else { return };
                let carrier = world.state(from);
                if let Some(message) =
                    cam.generate(carrier, world_from_sensor, now_secs, network, noise)
                {
                    let message = Payload::Cam(Box::new(message));
                    air.push(Transmission { from, antenna, power_dbm, message });
                }
            }
            Station::Text { waiting, .. } => {
                let texts = waiting.drain(..).map(Payload::Text);
                air.extend(texts.map(|message| Transmission { from, antenna, power_dbm, message }));
            }
        }
    }

    /// Returns the received messages as the bytes of readings.
    pub(super) fn receive(
        &self,
        scene: &Scene,
        world_from_sensor: &Pose,
        seed: u64,
        air: &[Transmission],
        most: usize,
    ) -> Vec<u8> {
        let (world, own) = (scene.world, scene.parent);
        let here = Antenna::of(world, own, world_from_sensor);
        let spec = self.radio();
        let mut bytes = Vec::new();
        let mut count = 0;
        for (index, sent) in air.iter().enumerate() {
            let is_own = if own == ActorId::NONE { sent.antenna == here } else { sent.from == own };
            let is_of_kind = matches!(
                (self, &sent.message),
                (Station::Cam(_), Payload::Cam(_)) | (Station::Text { .. }, Payload::Text(_))
            );
            let is_near = sent.antenna.at.distance(here.at) < spec.range_m;
            if is_own || !is_of_kind || !is_near || count >= most {
                continue;
            }
            let nanos = scene.header.stamp.sim_time_nanos;
            let mut noise = Noise::at(seed ^ (index as u64 + 1).wrapping_mul(0x9e37_79b9), nanos);
            let power_dbm = received(world, spec, (own, here), sent, &mut noise);
            if power_dbm < spec.sensitivity_dbm {
                continue;
            }
            count += 1;
            match &sent.message {
                Payload::Cam(message) => {
                    let reading = CamReading { power_dbm, ..**message };
                    bytes.extend_from_slice(bytemuck::bytes_of(&reading));
                }
                Payload::Text(text) => {
                    let station_id = sent.from.0;
                    let reading = MessageReading { power_dbm, station_id, text: *text };
                    bytes.extend_from_slice(bytemuck::bytes_of(&reading));
                }
            }
        }
        bytes
    }
}

fn received(
    world: &World,
    spec: &RadioSpec,
    (own, here): (ActorId, Antenna),
    sent: &Transmission,
    noise: &mut Noise,
) -> f32 {
    let there = sent.antenna;
    let span = Span { from: here.at, to: there.at, ground_m: here.ground_m.min(there.ground_m) };
    let (is_blocked, between) = world.physics().line_of_sight(here.at, there.at, [own, sent.from]);
    let is_vehicle =
        |id: &ActorId| world.state(*id).is_some_and(|state| state.kind == kind::VEHICLE);
    let tops: Vec<Vec3> = between.into_iter().filter(is_vehicle).map(|id| top(world, id)).collect();
    let sight = match (is_blocked, tops.is_empty()) {
        (true, _) => Sight::Blocked,
        (false, true) => Sight::Clear,
        (false, false) => Sight::Vehicles(tops),
    };
    let loss = loss_db(spec, &span, &sight, noise);
    sent.power_dbm + spec.antenna_gain_db - loss as f32
}
