//! Opens CARLA's ports and serves them through one client of the bus.

use std::{
    io,
    net::{IpAddr, SocketAddr, TcpListener},
    sync::Arc,
    time::Duration,
};

use client_lib::{Client, ClientError, Frame, Interrupted, Watch, clock};

use crate::{
    bridge::Bridge,
    calls::{Ports, RpcServer},
    rpc,
    shared_bridge::SharedBridge,
    statics::{SharedStatics, Statics},
    stream::Streams,
    traffic_manager::TrafficManager,
};

/// The address and port to listen on.
#[derive(Clone, Copy, Debug)]
pub struct CarlaServerConfig {
    /// Port of remote calls; streams use the next port. 0: the system chooses both.
    pub port: u16,
    /// Address of all ports.
    pub listen: IpAddr,
}

/// CARLA's default port of the traffic manager. Clients receive the actual port, which is another
/// one if this is taken.
const TRAFFIC_MANAGER_PORT: u16 = 8000;
/// Longest time between two updates of a world that no client of this server ticks.
const UPDATE_NANOS: u64 = 100_000_000;
/// The same while there are sensor bundles to receive from.
const BUNDLE_UPDATE_NANOS: u64 = 1_000_000;
/// Time between two checks while a client of this server ticks the world.
const TICKED_PAUSE: Duration = Duration::from_millis(50);

/// Why the server cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum CarlaServerError {
    /// A port cannot be listened on.
    #[error("cannot listen on {address}: {why}; use another --carla-port, or --no-carla")]
    Listen {
        /// The address and port.
        address: SocketAddr,
        /// The error of the system.
        why: io::Error,
    },
    /// A thread cannot be started.
    #[error("cannot start a thread for CARLA's clients: {0}")]
    Thread(io::Error),
    /// The bus client has failed.
    #[error(transparent)]
    Client(#[from] ClientError),
}

/// A server for CARLA's clients whose ports are open.
pub struct CarlaServer {
    calls: TcpListener,
    streams: TcpListener,
    traffic_manager: TcpListener,
}

impl CarlaServer {
    /// Opens the ports. Connections wait until [`CarlaServer::serve`] is called.
    ///
    /// # Errors
    ///
    /// Returns an error if a port cannot be listened on.
    pub fn open(config: &CarlaServerConfig) -> Result<CarlaServer, CarlaServerError> {
        let bind = |port: u16| {
            let address = SocketAddr::new(config.listen, port);
            TcpListener::bind(address).map_err(|why| CarlaServerError::Listen { address, why })
        };
        let calls = bind(config.port)?;
        let streams = bind(if config.port == 0 { 0 } else { config.port.wrapping_add(1) })?;
        let traffic_manager = if config.port == 0 { bind(0) } else { bind(TRAFFIC_MANAGER_PORT) };
        let traffic_manager = traffic_manager.or_else(|_| bind(0))?;
        if !config.listen.is_loopback() {
            log::warn!(
                "CARLA's protocol has no authentication: every host that reaches {} \
                 can control this simulator",
                config.listen
            );
        }
        Ok(CarlaServer { calls, streams, traffic_manager })
    }

    /// Serves CARLA's clients through this client of the bus, until its host ends.
    ///
    /// # Errors
    ///
    /// Returns an error if the map cannot be loaded or a thread cannot be started.
    pub fn serve(self, client: Client) -> Result<(), CarlaServerError> {
        let port = |listener: &TcpListener| {
            listener.local_addr().map(|a| a.port()).map_err(CarlaServerError::Thread)
        };
        let ports = Ports { streams: port(&self.streams)?, manager: port(&self.traffic_manager)? };
        let address = self.calls.local_addr().map_err(CarlaServerError::Thread)?;
        let (watch, strategy) = (client.watch(), client.strategy());
        let network = client.map()?;
        let episode = client.instance().episode().map_err(ClientError::Bus)?;
        let statics = Arc::new(Statics::new(episode, network));
        statics.prepare();
        let statics = Arc::new(SharedStatics::new(statics));
        let streams = Arc::new(Streams::default());
        let bridge =
            Bridge::new(client, Arc::clone(&streams), Arc::clone(&statics), ports.streams)?;
        let bridge = Arc::new(SharedBridge::new(bridge));
        streams.serve(self.streams).map_err(CarlaServerError::Thread)?;
        let manager = Arc::new(TrafficManager { bridge: Arc::clone(&bridge) });
        rpc::serve(self.traffic_manager, "carla-manager", strategy, manager)
            .map_err(CarlaServerError::Thread)?;
        let server = Arc::new(RpcServer { bridge: Arc::clone(&bridge), statics, ports });
        rpc::serve(self.calls, "carla-calls", strategy, server)
            .map_err(CarlaServerError::Thread)?;
        log::info!("CARLA's clients connect to {address}");
        follow_world(&bridge, &watch);
        Ok(())
    }
}

/// Publishes the frames that clients of this server have not ticked, until the host ends.
fn follow_world(bridge: &SharedBridge, watch: &Watch) {
    let mut published = Frame(0);
    let mut pause = UPDATE_NANOS;
    loop {
        let deadline = clock::now_nanos() + pause;
        if let Err(Interrupted::HostEnds) = watch.next_frame(published, Some(deadline)) {
            return;
        }
        let mut bridge = bridge.lock();
        bridge.update();
        published = Frame(bridge.published_frame());
        pause = if bridge.has_bundles() { BUNDLE_UPDATE_NANOS } else { UPDATE_NANOS };
        let is_ticked_here = bridge.is_ticking();
        drop(bridge);
        if is_ticked_here {
            // The connection that ticks publishes the frame; this thread would compete with it.
            std::thread::sleep(TICKED_PAUSE);
        }
    }
}
