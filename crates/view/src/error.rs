use std::{io, net::SocketAddr};

use client_lib::ClientError;

/// Why the viewer cannot start, or has ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The simulator.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The address cannot be listened on.
    #[error("{address}: {source}; --port 0 takes any free port")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The reason.
        source: io::Error,
    },
    /// A page drives a vehicle that it does not have.
    #[error("this page has no vehicle of its own; spawn one")]
    NoVehicle,
    /// No spawn point is free.
    #[error("each of the {count} spawn points of the map is occupied; destroy a vehicle")]
    NoPlace {
        /// How many there are.
        count: usize,
    },
    /// A page requests too many pictures.
    #[error("{count} tiles; a page has at most {most}")]
    Tiles {
        /// How many it requests.
        count: usize,
        /// How many it may have.
        most: usize,
    },
    /// A page requests a picture of no size, or too large a one.
    #[error("a tile of {} by {}; use 1 by 1 to {} by {}", size[0], size[1], most[0], most[1])]
    TileSize {
        /// The size that it requests: pixels, or columns and channels of a lidar.
        size: [u32; 2],
        /// The largest size.
        most: [u32; 2],
    },
    /// A page of a data set requests what a simulator does.
    #[error("a data set has no simulator; omnibus run starts one")]
    NoSimulator,
    /// A page of a simulator requests sensors of a data set.
    #[error("a simulator has no sensors by name; request tiles")]
    NoDataSet,
    /// There is no frame after the last of a recording or a data set.
    #[error("this is the last frame")]
    LastFrame,
    /// What is shown has no length.
    #[error("a running simulator has no other part to be shown; seek in a recording or a data set")]
    NoLength,
    /// The server cannot be started, or has failed.
    #[error("server: {0}")]
    Server(#[from] io::Error),
}
