//! What the function of a call works with.

use std::sync::Arc;

use crate::{
    args::{Args, RpcError},
    msgpack::Pack,
    recordings::Recordings,
    rpc::Peer,
    shared_bridge::LockedBridge,
    statics::Statics,
};

/// A call that reads or changes the world, through the bridge, which is locked except while the call waits for the host.
pub(crate) struct Call<'a> {
    pub(crate) bridge: LockedBridge<'a>,
    pub(crate) args: Args<'a>,
    /// The value of the answer, if it has one.
    pub(crate) out: &'a mut Pack,
    pub(crate) peer: &'a Peer,
    pub(crate) ports: Ports,
    pub(crate) recordings: &'a Recordings,
}

/// A call that depends on the map at most, and that needs no bridge.
pub(crate) struct StaticCall<'a> {
    pub(crate) statics: Arc<Statics>,
    pub(crate) args: Args<'a>,
    /// The value of the answer, if it has one.
    pub(crate) out: &'a mut Pack,
    pub(crate) peer: &'a Peer,
    /// Returns the actual port of the traffic manager of the port that a client asks for.
    pub(crate) manager_port: &'a dyn Fn(u16) -> Result<u16, RpcError>,
}

/// The ports on which this process listens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ports {
    pub(crate) streams: u16,
}
