//! The traffic managers of clients, one for each port that they ask for.

use std::{
    collections::BTreeMap,
    io,
    net::{IpAddr, SocketAddr, TcpListener},
    sync::{Arc, Mutex},
};

use client_lib::Strategy;

use crate::{
    args::RpcError,
    connections::Connections,
    msgpack::Pool,
    rpc,
    shared_bridge::{SharedBridge, lock},
    traffic_manager::TrafficManager,
    vehicle_owners::Owners,
};

/// CARLA's default port of the traffic manager. Clients receive the actual port, which is another one if this is
/// taken.
pub(crate) const DEFAULT_PORT: u16 = 8000;
/// Traffic managers besides that of the default port.
const OTHERS_MAX: usize = 16;

/// What opens and serves the ports of traffic managers.
pub(crate) struct TrafficManagers {
    bridge: Arc<SharedBridge>,
    listen: IpAddr,
    strategy: Strategy,
    connections: Arc<Connections>,
    pool: Arc<Pool>,
    /// The actual port of that of the default port.
    main: u16,
    /// Actual ports of the others, by the port that clients ask for.
    others: Mutex<BTreeMap<u16, u16>>,
    owners: Arc<Owners>,
}

impl TrafficManagers {
    /// Serves the traffic manager of the default port on `listener`.
    pub(crate) fn serve(
        bridge: Arc<SharedBridge>,
        listener: TcpListener,
        strategy: Strategy,
        (connections, pool): (&Arc<Connections>, &Arc<Pool>),
    ) -> io::Result<TrafficManagers> {
        let address = listener.local_addr()?;
        let managers = TrafficManagers {
            bridge,
            listen: address.ip(),
            strategy,
            connections: Arc::clone(connections),
            pool: Arc::clone(pool),
            main: address.port(),
            others: Mutex::default(),
            owners: Arc::default(),
        };
        managers.serve_one(listener, DEFAULT_PORT)?;
        Ok(managers)
    }

    fn serve_one(&self, listener: TcpListener, number: u16) -> io::Result<()> {
        let manager = TrafficManager::new(
            Arc::clone(&self.bridge),
            Arc::clone(&self.owners),
            (number != DEFAULT_PORT).then_some(number),
        );
        let shared = (&self.connections, &self.pool);
        rpc::serve(listener, "carla-manager", shared, self.strategy, Arc::new(manager))
    }

    /// Returns the actual port of the traffic manager of this one, which begins to run if it does not yet.
    pub(crate) fn port(&self, wanted: u16) -> Result<u16, RpcError> {
        if wanted == DEFAULT_PORT || wanted == self.main || wanted == 0 {
            return Ok(self.main);
        }
        let mut others = lock(&self.others);
        if let Some(port) = others.get(&wanted) {
            return Ok(*port);
        }
        if others.len() == OTHERS_MAX {
            return Err(format!(
                "traffic manager {wanted}: {OTHERS_MAX} run besides that of port {DEFAULT_PORT}; use one of them"
            )
            .into());
        }
        let bind = |port: u16| TcpListener::bind(SocketAddr::new(self.listen, port));
        let open = bind(wanted).or_else(|_| bind(0)).and_then(|listener| {
            let port = listener.local_addr()?.port();
            self.serve_one(listener, wanted)?;
            Ok(port)
        });
        let port = open.map_err(|why| format!("traffic manager {wanted}: {why}"))?;
        others.insert(wanted, port);
        Ok(port)
    }
}
