//! The messages of Foxglove's schemas in protobuf: what the MCAP files of `omnibus export` and the
//! WebSocket of `omnibus view` have in common.
//!
//! Source: <https://docs.foxglove.dev/docs/sdk/schemas>. Positions are right-handed, in metres;
//! times are nanoseconds of simulated time.

mod message;
mod schema;
mod sensors;
mod shapes;

pub use message::{Message, timestamp};
pub use schema::descriptor;
pub use sensors::{Calibration, Distortion, compressed_image, point_cloud};
pub use shapes::{
    Entity, Form, WORLD, color, light_color, line, pose, pose_in_frame, rigid, scene, transform,
};
