use protocol::{Pose, Refusal};
use sensor_render::RenderError;

/// Why an environment cannot be made, begun or advanced.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// The map cannot be read.
    #[error(transparent)]
    Map(#[from] bake::MapError),
    /// A value of the configuration is out of its range.
    #[error("{name} is {value}, must be {range}")]
    Config {
        /// The field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// The pose of the camera is not a rigid transform.
    #[error(
        "camera.mount has position {:?} m and rotation {:?}; the position must be finite and the \
         rotation a quaternion x, y, z, w of length 1", .0.position_m, .0.rotation
    )]
    Mount(Pose),
    /// The camera cannot render.
    #[error(transparent)]
    Camera(#[from] RenderError),
    /// A number of an action is out of its range.
    #[error("{name} in the action of ego vehicle {ego} is {value}, must be {range}")]
    Action {
        /// The index of the ego vehicle.
        ego: usize,
        /// The number.
        name: &'static str,
        /// Its value.
        value: f32,
        /// What it may be.
        range: &'static str,
    },
    /// There are more or fewer actions than ego vehicles.
    #[error("{given} actions for {egos} ego vehicles; give one to each")]
    Actions {
        /// The actions.
        given: usize,
        /// The ego vehicles.
        egos: usize,
    },
    /// No spawn point begins a route.
    #[error(
        "none of the {places} spawn points of the map begins a route of {route_m} m; \
         use a shorter route_m, or a larger map"
    )]
    NoRoute {
        /// The spawn points.
        places: usize,
        /// The length that was requested.
        route_m: f32,
    },
    /// Too few spawn points begin a route.
    #[error(
        "{found} of {wanted} ego vehicles find a start of a route of {route_m} m; use fewer, a \
         shorter route_m, or a larger map"
    )]
    NoStart {
        /// The starts that were found.
        found: usize,
        /// The ego vehicles that were requested.
        wanted: usize,
        /// The length that was requested. Metres.
        route_m: f32,
    },
    /// There are too few places for vehicles.
    #[error("{found} of {wanted} vehicles find a place on the map; use fewer, or a larger map")]
    NoPlace {
        /// The vehicles that were spawned.
        found: usize,
        /// The vehicles that were requested.
        wanted: usize,
    },
    /// The simulation refused a command.
    #[error(transparent)]
    Refused(#[from] Refusal),
}
