//! The sensors that CARLA's clients spawn, and the bundles that measure for them.

use std::{
    collections::BTreeMap,
    f32::consts::TAU,
    sync::{Arc, Mutex},
};

use client_lib::{
    EventCamera, EventCameraSpec, Pose, Radar, SensorBundle,
    wire::{SensorSpec, camera, lidar, point_attribute},
};

use crate::{
    args::RpcError, camera_effects, physics_sensors, sensor_kind::Kind, stream::Streams, textures,
    wire::Description,
};

/// A sensor of one of CARLA's clients.
pub(crate) struct Sensor {
    pub(crate) kind: Kind,
    pub(crate) stream: u32,
    pub(crate) description: Arc<Description>,
    pub(crate) period_nanos: u64,
    /// The bundle that measures while a client listens.
    pub(crate) bundle: Option<SensorBundle>,
    /// The length of a tick for which the bundle was created. Nanoseconds.
    pub(crate) bundle_delta_nanos: u64,
    /// The number of frames without a listener.
    pub(crate) idle_frames: u32,
    /// The streams of a camera's textures, by texture.
    pub(crate) textures: BTreeMap<u32, u32>,
    /// The outputs with which the bundle was created.
    pub(crate) bundle_outputs: u32,
    /// The state of an event camera.
    pub(crate) events: Option<Arc<Mutex<EventCamera>>>,
}

impl Sensor {
    /// Creates a sensor without a bundle.
    ///
    /// # Errors
    ///
    /// Returns an error if the simulator cannot measure this sensor or an attribute is invalid.
    pub(crate) fn new(description: Description, stream: u32) -> Result<Sensor, RpcError> {
        let Some(kind) = Kind::of(&description.id) else {
            let id = &description.id;
            return Err(format!("unsupported sensor type {id}").into());
        };
        let period_nanos = (description.number("sensor_tick", 0.0)?.max(0.0) * 1e9) as u64;
        let mut sensor = Sensor {
            kind,
            stream,
            period_nanos,
            bundle: None,
            bundle_delta_nanos: 0,
            idle_frames: 0,
            textures: BTreeMap::new(),
            bundle_outputs: 0,
            events: None,
            description: Arc::new(description),
        };
        // Invalid attributes are reported now rather than when a client listens.
        sensor.spec(Pose::IDENTITY, 50_000_000, 9.81)?;
        if kind == Kind::Events {
            let camera = EventCamera::new(event_spec(&sensor.description)?);
            sensor.events = Some(Arc::new(Mutex::new(camera)));
        }
        Ok(sensor)
    }

    /// Returns whether a client listens to the sensor or to one of its textures.
    pub(crate) fn is_wanted(&self, streams: &Streams) -> bool {
        let mut all = std::iter::once(&self.stream).chain(self.textures.values());
        all.any(|stream| streams.is_wanted(*stream))
    }

    /// Returns the outputs that its textures need in addition to its own image.
    pub(crate) fn texture_outputs(&self, streams: &Streams) -> u32 {
        let wanted = self.textures.iter().filter(|(_, stream)| streams.is_wanted(**stream));
        wanted.fold(0, |sum, (texture, _)| sum | textures::outputs(*texture))
    }

    /// Returns the parameters of a radar.
    pub(crate) fn radar(&self) -> Result<Radar, RpcError> {
        let d = &self.description;
        let fov = |id: &str| d.number(id, 30.0).map(|fov| fov.clamp(1.0, 170.0).to_radians());
        let secs = self.bundle_delta_nanos.max(self.period_nanos) as f32 * 1e-9;
        let points = d.number("points_per_second", 1500.0)? * secs;
        Ok(Radar {
            fov_rad: [fov("horizontal_fov")?, fov("vertical_fov")?],
            range_m: d.number("range", 100.0)?,
            points: points.clamp(0.0, 1e6) as usize,
            seed: d.number("noise_seed", 0.0)? as u64,
        })
    }

    /// Returns whether the renderer measures this sensor.
    pub(crate) fn is_rendered(&self) -> bool {
        self.kind.outputs() != 0
    }

    /// Returns whether the measurements are streamed; clients find lane invasions themselves.
    pub(crate) fn is_streamed(&self) -> bool {
        self.kind != Kind::LaneInvasion
    }

    /// Returns what the renderer or the host measures for the sensor, or `None` if its clients
    /// measure it.
    pub(crate) fn spec(
        &self,
        parent_from_sensor: Pose,
        delta_nanos: u64,
        gravity_mps2: f32,
    ) -> Result<Option<SensorSpec>, RpcError> {
        let d = &self.description;
        let number = |id: &str, otherwise: f32| d.number(id, otherwise);
        let spec = match self.kind {
            Kind::Rgb
            | Kind::Depth
            | Kind::Semantic
            | Kind::Instance
            | Kind::Normals
            | Kind::Flow
            | Kind::Events
            | Kind::Cosmos => {
                let spec = camera(
                    "camera",
                    parent_from_sensor,
                    number("image_size_x", 800.0)? as u32,
                    number("image_size_y", 600.0)? as u32,
                    number("fov", 90.0)?.clamp(1.0, 170.0).to_radians(),
                    self.kind.outputs(),
                );
                if self.kind == Kind::Rgb {
                    SensorSpec { effects: camera_effects::effects(d)?, ..spec }
                } else {
                    spec
                }
            }
            Kind::Lidar | Kind::SemanticLidar => {
                let secs = delta_nanos.max(self.period_nanos) as f32 * 1e-9;
                let channels = number("channels", 32.0)?.clamp(1.0, 1024.0);
                let columns = number("points_per_second", 56_000.0)? * secs / channels;
                let fov = number("horizontal_fov", 360.0)?.clamp(1.0, 360.0) / 360.0;
                let elevations = [number("lower_fov", -30.0)?, number("upper_fov", 10.0)?];
                let mut spec = lidar(
                    "lidar",
                    parent_from_sensor,
                    channels as u32,
                    (columns.round() as u32).clamp(1, 8192),
                    elevations.map(f32::to_radians),
                    number("range", 10.0)?,
                );
                spec.fov_rad = fov * TAU;
                let rate_hz = number("rotation_frequency", 10.0)?.max(0.0);
                // With one rotation per tick or more, each tick covers the whole field of view.
                spec.rotation_rate_hz = if rate_hz * secs < 0.9999 { rate_hz } else { 0.0 };
                spec.attenuation_per_m = number("atmosphere_attenuation_rate", 0.004)?;
                if self.kind == Kind::Lidar {
                    spec.noise_m = number("noise_stddev", 0.0)?;
                    spec.dropoff = number("dropoff_general_rate", 0.45)?.clamp(0.0, 1.0);
                }
                if self.kind == Kind::SemanticLidar {
                    spec.point_attribute = point_attribute::COS_INCIDENCE;
                }
                spec.seed = number("noise_seed", 0.0)? as u64;
                spec.outputs = self.kind.outputs();
                spec
            }
            Kind::Radar => self.radar()?.grid("radar", parent_from_sensor),
            kind => match physics_sensors::spec(kind, d, parent_from_sensor, gravity_mps2)? {
                Some(spec) => spec,
                None => return Ok(None),
            },
        };
        Ok(Some(SensorSpec { period_nanos: self.period_nanos, ..spec }))
    }
}

/// Returns the specification of an event camera.
fn event_spec(d: &Description) -> Result<EventCameraSpec, RpcError> {
    let threshold = |id: &str| -> Result<f32, RpcError> {
        let value = d.number(id, 0.3)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(format!("attribute {id} is {value}, must be greater than 0").into())
        }
    };
    let log_eps = d.number("log_eps", 0.001)?.max(1e-9);
    let is_linear = d.get("use_log").is_some() && !d.flag("use_log");
    Ok(EventCameraSpec {
        positive_threshold: threshold("positive_threshold")?,
        negative_threshold: threshold("negative_threshold")?,
        positive_sigma: d.number("sigma_positive_threshold", 0.0)?.max(0.0),
        negative_sigma: d.number("sigma_negative_threshold", 0.0)?.max(0.0),
        refractory_nanos: d.number("refractory_period_ns", 0.0)?.max(0.0) as u64,
        log_eps: (!is_linear).then_some(log_eps),
        seed: 0,
    })
}
