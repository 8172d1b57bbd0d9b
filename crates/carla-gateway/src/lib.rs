//! The CARLA door: the official `carla` 0.9.16 package connects here and finds a CARLA server.
//!
//! ```text
//!  carla.Client ──calls, 2000──▶ rpc ─▶ calls ─▶ Bridge ──▶ bus
//!  sensor.listen ◀─streams, 2001── stream ◀─ state, measure ◀─ Bridge ◀── bus
//!  traffic manager ──calls──▶ rpc ─▶ manager ─▶ Bridge
//! ```
//!
//! A client of the bus like any other. CARLA's left hand, degrees and centimetres are spoken here
//! and in `client_lib::carla_axes`, nowhere else.

mod args;
mod batch;
mod blueprints;
mod born;
mod bridge;
mod calls;
mod cast;
mod lights;
pub mod log;
mod manager;
mod measure;
mod motion;
pub mod msgpack;
mod navigation;
mod radio;
mod rays;
mod replay;
mod roadside;
mod rpc;
mod sensor;
mod settings;
mod state;
mod statics;
mod stream;
mod street;
pub mod tables;
mod textures;
mod weather;
mod wire;

use std::{
    io,
    net::{IpAddr, SocketAddr, TcpListener},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use client_lib::{Client, ClientError, Frame, Interrupted, clock};

use crate::{
    bridge::Bridge,
    calls::{Desk, Ports},
    manager::Manager,
    statics::Statics,
    stream::Streams,
};

/// Where to listen.
#[derive(Clone, Copy, Debug)]
pub struct DoorConfig {
    /// Calls; streams go through the next port. 0: the system chooses both.
    pub port: u16,
    /// Address of all ports.
    pub listen: IpAddr,
}

/// Where CARLA's traffic manager is by habit. Clients are told where ours is; if somebody else is
/// there, it is elsewhere.
const MANAGER_PORT: u16 = 8000;
/// How often the world is looked after at least.
const LOOK_NANOS: u64 = 100_000_000;
/// How often bundles are asked in a world that runs on its own clock.
const RIGS_NANOS: u64 = 1_000_000;

/// Why there is no door.
#[derive(Debug, thiserror::Error)]
pub enum DoorError {
    /// A port cannot be listened on.
    #[error("{address} cannot be listened on: {why}; another --carla-port, or --no-carla")]
    Listen {
        /// Which.
        address: SocketAddr,
        /// The system's words.
        why: io::Error,
    },
    /// No thread could be started.
    #[error("no thread for CARLA's clients: {0}")]
    Thread(io::Error),
    /// The bus.
    #[error(transparent)]
    Client(#[from] ClientError),
}

/// The ports, open before anybody answers on them.
pub struct Door {
    calls: TcpListener,
    streams: TcpListener,
    manager: TcpListener,
}

impl Door {
    /// Takes the ports.
    pub fn open(config: &DoorConfig) -> Result<Door, DoorError> {
        let bind = |port: u16| {
            let address = SocketAddr::new(config.listen, port);
            TcpListener::bind(address).map_err(|why| DoorError::Listen { address, why })
        };
        let calls = bind(config.port)?;
        let streams = bind(if config.port == 0 { 0 } else { config.port.wrapping_add(1) })?;
        let manager = if config.port == 0 { bind(0) } else { bind(MANAGER_PORT) };
        let manager = manager.or_else(|_| bind(0))?;
        if !config.listen.is_loopback() {
            ::log::warn!(
                "CARLA's protocol has no authentication: whoever reaches {} can do anything to this simulator",
                config.listen
            );
        }
        Ok(Door { calls, streams, manager })
    }

    /// Serves CARLA's clients through this client of the bus, until its host ends.
    pub fn serve(self, client: Client) -> Result<(), DoorError> {
        let port = |listener: &TcpListener| {
            listener.local_addr().map(|a| a.port()).map_err(DoorError::Thread)
        };
        let ports = Ports { streams: port(&self.streams)?, manager: port(&self.manager)? };
        let address = self.calls.local_addr().map_err(DoorError::Thread)?;
        let (watch, strategy) = (client.watch(), client.strategy());
        let network = client.map()?;
        let episode = client.instance().episode().map_err(ClientError::Bus)?;
        let statics = Arc::new(Statics::new(episode, network));
        statics.prepare();
        let streams = Arc::new(Streams::default());
        let bridge = Bridge::new(client, Arc::clone(&streams), statics, ports.streams)?;
        let bridge = Arc::new(Mutex::new(bridge));
        streams.serve(self.streams).map_err(DoorError::Thread)?;
        let manager = Arc::new(Manager { bridge: Arc::clone(&bridge) });
        rpc::serve(self.manager, "carla-manager", strategy, manager).map_err(DoorError::Thread)?;
        let desk = Arc::new(Desk { bridge: Arc::clone(&bridge), ports });
        rpc::serve(self.calls, "carla-calls", strategy, desk).map_err(DoorError::Thread)?;
        ::log::info!("CARLA's clients connect to {address}");
        look_on(&bridge, &watch);
        Ok(())
    }
}

/// Shows clients what they did not tick themselves, until the host ends.
fn look_on(bridge: &Mutex<Bridge>, watch: &client_lib::Watch) {
    let mut shown = Frame(0);
    let mut pause = LOOK_NANOS;
    loop {
        let deadline = clock::now_nanos() + pause;
        if let Err(Interrupted::HostEnds) = watch.next_frame(shown, Some(deadline)) {
            return;
        }
        let mut bridge = bridge.lock().unwrap_or_else(PoisonError::into_inner);
        bridge.look();
        shown = Frame(bridge.shown());
        pause = if bridge.has_rigs() { RIGS_NANOS } else { LOOK_NANOS };
        let is_ticked_here = bridge.is_ticking();
        drop(bridge);
        if is_ticked_here {
            // Who ticks shows the frame at once; this thread would only be in the way.
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}
