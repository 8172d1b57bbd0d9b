//! A node of ROS 2 that needs no installation of ROS: a client of the simulator that publishes the
//! state and the sensors of one vehicle under the names of CARLA's ROS bridge, and drives it by
//! control messages.
//!
//! ROS 2 speaks RTPS, the wire protocol of DDS, over UDP. This crate has the part of it that a node
//! with fixed topics needs: discovery, writers and readers that repeat what was lost, and fragments
//! of large samples. Positions are metres in right-handed spaces, x forward, y left, z up, as
//! REP 103 asks; camera frames are optical.
//!
//! ```text
//! omnibus run ──frames, measurements──▶ Node ──RTPS──▶ ros2 topic, rviz2, other nodes
//!      ▲                                 │ ▲
//!      └─────────────control─────────────┘ └──RTPS── vehicle_control_cmd
//! ```

mod cdr;
mod guid;
mod submessage;

mod discovery;
mod error;
mod reader;
mod sockets;
mod writer;

mod participant;

mod messages;
mod topics;

mod node;

pub use error::Ros2Error;
pub use node::{Node, NodeOptions, Published, Vehicle};
pub use sockets::DOMAIN_MAX;
