use protocol::{ActorId, Plane, SensorSpec};

/// One bundle to measure, and the memory for its measurements.
#[derive(Debug)]
pub struct BundleJob<'a> {
    /// Actor that carries the bundle; [`ActorId::NONE`] if the bundle is fixed in the world.
    pub parent: ActorId,
    /// Sensors of the bundle.
    pub sensors: &'a [SensorSpec],
    /// Planes from [`protocol::layout`], with `world_from_sensor` set by [`crate::pose_planes`].
    pub planes: &'a [Plane],
    /// Payload of the bundle: the table of planes, then the planes.
    pub out: &'a mut [u8],
}
