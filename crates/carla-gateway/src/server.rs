//! Opens CARLA's ports and serves them through one client of the bus.

use std::{
    io,
    net::{IpAddr, SocketAddr, TcpListener},
    path::PathBuf,
    sync::Arc,
    time::Duration,
};

use client_lib::{Client, ClientError, Frame, Interrupted, Watch, clock};

use crate::{
    bridge::Bridge,
    calls::{Ports, RpcServer},
    connections::Connections,
    msgpack::Pool,
    recordings::Recordings,
    rpc,
    shared_bridge::SharedBridge,
    statics::{SharedStatics, Statics},
    stream::Streams,
    traffic_managers::{DEFAULT_PORT, TrafficManagers},
};

/// Where the server listens, and what its clients may write.
#[derive(Clone, Debug)]
pub struct CarlaServerConfig {
    /// Port of remote calls; streams use the next port. 0: the system chooses both.
    pub port: u16,
    /// Address of all ports.
    pub listen: IpAddr,
    /// The folder in which clients write and read recordings; `None`: they cannot.
    pub recordings: Option<PathBuf>,
}

/// The open ports of remote calls and of streams. Clients that connect wait until they are served.
#[derive(Debug)]
pub struct CarlaPorts {
    /// The port of remote calls.
    pub calls: TcpListener,
    /// The port of streams.
    pub streams: TcpListener,
}

impl CarlaPorts {
    /// Opens the ports.
    ///
    /// # Errors
    ///
    /// Returns an error if a port cannot be listened on.
    pub fn open(config: &CarlaServerConfig) -> Result<CarlaPorts, CarlaServerError> {
        let calls = bind(config, config.port)?;
        let port = if config.port == 0 { 0 } else { config.port.wrapping_add(1) };
        Ok(CarlaPorts { calls, streams: bind(config, port)? })
    }
}

fn bind(config: &CarlaServerConfig, port: u16) -> Result<TcpListener, CarlaServerError> {
    let address = SocketAddr::new(config.listen, port);
    TcpListener::bind(address).map_err(|why| CarlaServerError::Listen { address, why })
}

/// Memory that requests of more than a MiB may take together.
const LARGE_REQUESTS_MIB: usize = 1024;
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
    #[error(
        "cannot listen on {address} for CARLA's clients: {why}; does another simulator run? use \
         another --carla-port (streams use the port after it), or --no-carla"
    )]
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
    ports: CarlaPorts,
    traffic_manager: TcpListener,
    recordings: Recordings,
}

impl CarlaServer {
    /// Creates the server of open ports, and opens the port of the traffic manager.
    ///
    /// # Errors
    ///
    /// Returns an error if no port can be listened on for the traffic manager.
    pub fn new(
        ports: CarlaPorts,
        config: &CarlaServerConfig,
    ) -> Result<CarlaServer, CarlaServerError> {
        let wanted = if config.port == 0 { 0 } else { DEFAULT_PORT };
        let traffic_manager = bind(config, wanted).or_else(|_| bind(config, 0))?;
        let recordings = Recordings::in_folder(config.recordings.clone());
        Ok(CarlaServer { ports, traffic_manager, recordings })
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
        let ports = Ports { streams: port(&self.ports.streams)? };
        let manager_port = port(&self.traffic_manager)?;
        let address = self.ports.calls.local_addr().map_err(CarlaServerError::Thread)?;
        if !address.ip().is_loopback() {
            log::warn!(
                "CARLA's protocol has no authentication or encryption: every host that reaches {} on \
                 port {}, {} or {} can load maps, control and destroy all actors, change time and \
                 weather, receive all sensors, and write and read recordings in {}; use a firewall, \
                 or --listen 127.0.0.1 and an SSH tunnel",
                address.ip(),
                address.port(),
                ports.streams,
                manager_port,
                self.recordings.describe()
            );
        }
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
        let connections = Arc::new(Connections::new());
        let shared = (&connections, &Arc::new(Pool::of_mib(LARGE_REQUESTS_MIB)));
        streams.serve(self.ports.streams, &connections).map_err(CarlaServerError::Thread)?;
        let managers =
            TrafficManagers::serve(Arc::clone(&bridge), self.traffic_manager, strategy, shared)
                .map_err(CarlaServerError::Thread)?;
        let server = Arc::new(RpcServer {
            bridge: Arc::clone(&bridge),
            statics,
            ports,
            managers,
            recordings: self.recordings,
        });
        rpc::serve(self.ports.calls, "carla-calls", shared, strategy, server)
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
