//! Queries: requests that change nothing and that the host answers between two ticks.

use std::{sync::Arc, time::Duration};

use protocol::{
    AckermannSettings, ActorId, BONES, BONES_PER_COMMAND, BlendPose, Pose, Query, QueryKind,
    Refusal, Response, ResponseBody, SetBones, VehicleBody, VehiclePhysics, VehicleTelemetry,
    Weather, WheelTelemetry,
};

use crate::{ClientError, connection::Connection};

/// The queries of a client, for any thread: `Clone`, `Send` and `Sync`. The client is not needed to
/// await a response and may serve other threads meanwhile. See [`Client::queries`].
///
/// Each method fails with [`ClientError::Refused`] if the host cannot answer it, with
/// [`ClientError::Timeout`] after [`Deadlines::answer`](crate::Deadlines::answer), and with
/// [`ClientError::HostEnded`].
///
/// [`Client::queries`]: crate::Client::queries
#[derive(Clone, Debug)]
pub struct Queries {
    connection: Arc<Connection>,
    deadline: Duration,
}

impl Queries {
    pub(crate) fn new(connection: &Arc<Connection>, deadline: Duration) -> Queries {
        Queries { connection: Arc::clone(connection), deadline }
    }

    /// Returns the physics parameters of a vehicle.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    pub fn vehicle_physics(&self, actor_id: ActorId) -> Result<VehiclePhysics, ClientError> {
        let what = "vehicle_physics";
        let kinds = [
            QueryKind::VehicleBody,
            QueryKind::VehicleEngine,
            QueryKind::VehicleGearbox,
            QueryKind::VehicleSteering,
        ];
        let parts = kinds.map(|kind| Query::new(kind, actor_id, 0));
        let responses = self.connection.query(what, &parts, self.deadline)?;
        let [body, engine, gearbox, steering] = &responses[..] else {
            let why = format!("{} responses to {} queries", responses.len(), parts.len());
            return Err(ClientError::refused(what, Refusal::other(why)));
        };
        let body: VehicleBody = read(what, body)?;
        let wheel = |index| Query::new(QueryKind::VehicleWheel, actor_id, index);
        let wheels: Vec<_> = (0..body.wheels).map(wheel).collect();
        Ok(VehiclePhysics {
            body,
            engine: read(what, engine)?,
            gearbox: read(what, gearbox)?,
            steering: read(what, steering)?,
            wheels: self.all(what, &wheels)?,
        })
    }

    /// Returns the motion of a vehicle, and the forces and slips of each wheel.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    pub fn telemetry(
        &self,
        actor_id: ActorId,
    ) -> Result<(VehicleTelemetry, Vec<WheelTelemetry>), ClientError> {
        let vehicle: VehicleTelemetry = self.one("telemetry", actor_id, 0)?;
        let query = |index| Query::new(QueryKind::WheelTelemetry, actor_id, index);
        let queries: Vec<_> = (0..vehicle.wheels).map(query).collect();
        Ok((vehicle, self.all("telemetry", &queries)?))
    }

    /// Returns the gains of a vehicle's Ackermann controller.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    pub fn ackermann_settings(&self, actor_id: ActorId) -> Result<AckermannSettings, ClientError> {
        self.one("ackermann_settings", actor_id, 0)
    }

    /// Returns the pose that clients have set for a walker: `parent_from_bone` of every bone, and
    /// the weight of the pose.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    pub fn given_pose(&self, actor_id: ActorId) -> Result<(Vec<Pose>, f32), ClientError> {
        let blend: BlendPose = self.one("given_pose", actor_id, 0)?;
        let blocks = (0..BONES.len()).step_by(BONES_PER_COMMAND);
        let query = |first| Query::new(QueryKind::Bones, actor_id, first as u32);
        let queries: Vec<_> = blocks.map(query).collect();
        let sets: Vec<SetBones> = self.all("given_pose", &queries)?;
        let bones = sets.iter().flat_map(|set| set.bones().map(|(_, pose)| *pose)).collect();
        Ok((bones, blend.weight))
    }

    /// Returns the weather.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    pub fn weather(&self) -> Result<Weather, ClientError> {
        self.one("weather", ActorId::NONE, 0)
    }

    /// Sends one query and waits for its response.
    pub(crate) fn one<T: ResponseBody>(
        &self,
        what: &'static str,
        actor_id: ActorId,
        index: u32,
    ) -> Result<T, ClientError> {
        let mut bodies = self.all(what, &[Query::new(T::KIND, actor_id, index)])?;
        bodies
            .pop()
            .ok_or_else(|| ClientError::refused(what, Refusal::other("there is no response")))
    }

    /// Sends queries of one kind and waits for their responses, in their order.
    fn all<T: ResponseBody>(
        &self,
        what: &'static str,
        queries: &[Query],
    ) -> Result<Vec<T>, ClientError> {
        if queries.is_empty() {
            return Ok(Vec::new());
        }
        let responses = self.connection.query(what, queries, self.deadline)?;
        responses.iter().map(|one| read(what, one)).collect()
    }
}

/// Reads a response of the kind that was asked for.
fn read<T: ResponseBody>(what: &'static str, response: &Response) -> Result<T, ClientError> {
    response.body().map_err(|refusal| ClientError::refused(what, refusal))
}
