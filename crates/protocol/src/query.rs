//! Queries: what a client may ask about an actor or the world beyond the snapshot, and what it is
//! answered.
//!
//! A query changes nothing. It goes through the `query` channel and is answered on `response`,
//! between two frames or before the commands of the next one; no journal, keyframe or recording
//! holds it. A query does not wait for commands that were sent for the next tick.

use bytemuck::{Pod, Zeroable};

use crate::{
    AckermannSettings, ActorId, BlendPose, Name, SetBones, Stamp, VehicleBody, VehicleEngine,
    VehicleGearbox, VehicleSteering, VehicleTelemetry, VehicleWheel, Weather, WheelTelemetry,
    refusal::{Refusal, RefusalCode, reason, text},
};

/// Header of a batch of [`Query`]s of one client, and of the [`Response`]s to them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct QueryHeader {
    /// The newest frame that the sender had seen; in a response, the frame that it is about.
    pub stamp: Stamp,
    /// The client that asks.
    pub client: Name,
    /// The number of the batch among the client's.
    pub sequence: u64,
}

const _: () = assert!(size_of::<QueryHeader>() == 72);

/// A question about an actor, or about the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Query {
    /// The actor.
    pub actor_id: ActorId,
    /// A [`QueryKind`].
    pub kind: u32,
    /// Which wheel, or the first of the bones.
    pub index: u32,
    /// Zero.
    pub reserved: u32,
}

impl Query {
    /// A query about an actor; `index` names the wheel or the first bone, where there are several.
    pub fn new(kind: QueryKind, actor_id: ActorId, index: u32) -> Query {
        Query { actor_id, kind: kind as u32, index, reserved: 0 }
    }
}

/// Bytes of a [`Response`] that hold its body.
const BODY_BYTES: usize = 184;

/// The answer to a [`Query`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Response {
    /// The [`QueryKind`] of the body; 0: the query was refused.
    kind: u32,
    /// The number of the [`RefusalCode`](crate::RefusalCode) of a refused query; else 0.
    refusal_code: u32,
    /// The body of that kind, or the reason of the refusal as UTF-8; padded with zeros.
    body: [u8; BODY_BYTES],
}

const _: () = assert!(size_of::<Response>() == 192);

impl Response {
    /// A response with this body.
    pub fn new<T: ResponseBody>(body: &T) -> Response {
        let mut response =
            Response { kind: T::KIND as u32, refusal_code: 0, body: [0; BODY_BYTES] };
        response.body[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(body));
        response
    }

    /// The response to a query that was refused. The reason is cut after 184 bytes.
    pub fn refused(refusal: &Refusal) -> Response {
        Response { kind: 0, refusal_code: refusal.code as u32, body: text(&refusal.reason) }
    }

    /// Returns the body.
    ///
    /// # Errors
    /// The refusal; one with [`RefusalCode::Other`](crate::RefusalCode::Other) if the response is of
    /// another kind than `T`.
    pub fn body<T: ResponseBody>(&self) -> Result<T, Refusal> {
        match self.kind {
            0 => Err(Refusal {
                code: RefusalCode::from_number(self.refusal_code),
                reason: reason(&self.body),
            }),
            kind if kind == T::KIND as u32 => {
                Ok(bytemuck::pod_read_unaligned(&self.body[..size_of::<T>()]))
            }
            kind => Err(Refusal::other(format!("response of kind {kind}, expected {:?}", T::KIND))),
        }
    }
}

/// What a [`Response`] may hold: the body of exactly one [`QueryKind`].
pub trait ResponseBody: Pod {
    /// The kind of query that it answers.
    const KIND: QueryKind;
}

macro_rules! queries {
    ($($(#[$doc:meta])* $name:ident -> $body:ty = $kind:literal,)*) => {
        /// What is asked, and the type of the body that answers it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u32)]
        pub enum QueryKind { $($(#[$doc])* $name = $kind,)* }

        impl QueryKind {
            /// Returns the kind of this number, or `None` if it is unknown.
            pub fn of(kind: u32) -> Option<QueryKind> {
                match kind {
                    $($kind => Some(QueryKind::$name),)*
                    _ => None,
                }
            }
        }

        $(
            const _: () = assert!(size_of::<$body>() <= BODY_BYTES);

            impl ResponseBody for $body {
                const KIND: QueryKind = QueryKind::$name;
            }
        )*
    };
}

queries! {
    /// A vehicle's mass, air and centre of mass.
    VehicleBody -> VehicleBody = 1,
    /// A vehicle's engine.
    VehicleEngine -> VehicleEngine = 2,
    /// A vehicle's gearbox.
    VehicleGearbox -> VehicleGearbox = 3,
    /// How far a vehicle's steering goes at speed.
    VehicleSteering -> VehicleSteering = 4,
    /// One of a vehicle's wheels.
    VehicleWheel -> VehicleWheel = 5,
    /// How a vehicle drives.
    VehicleTelemetry -> VehicleTelemetry = 6,
    /// The forces on one of a vehicle's wheels.
    WheelTelemetry -> WheelTelemetry = 7,
    /// The gains of a vehicle's Ackermann controller.
    AckermannSettings -> AckermannSettings = 8,
    /// Bones of the pose that a walker was given, from the one of this index on.
    Bones -> SetBones = 9,
    /// How much of a walker's given pose shows.
    Blend -> BlendPose = 10,
    /// The weather. It concerns no actor: the query names [`ActorId::NONE`].
    Weather -> Weather = 11,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_is_read_only_as_what_it_is() {
        let blend = BlendPose { actor_id: ActorId(3), weight: 0.5 };
        let response = Response::new(&blend);
        assert_eq!(response.body::<BlendPose>(), Ok(blend));
        let why = response.body::<SetBones>().unwrap_err();
        assert_eq!(why.reason, "response of kind 10, expected Bones");
        let refusal = Refusal::unknown_actor("actor 7 was never spawned");
        assert_eq!(Response::refused(&refusal).body::<BlendPose>(), Err(refusal));
    }
}
