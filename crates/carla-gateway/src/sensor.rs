//! Sensors that CARLA's clients spawn, and what of the simulator measures for them.

use std::{collections::BTreeMap, f32::consts::TAU};

use client_lib::{
    EventCamera, EventCameraSpec, Pose, SensorBundle, SensorSpec, camera, lidar, output,
    point_attribute,
};

use crate::{args::Refusal, born, stream::Streams, textures, wire::Description};

/// What a sensor's measurements are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Rgb,
    Depth,
    Semantic,
    Instance,
    Normals,
    Flow,
    Events,
    Lidar,
    SemanticLidar,
    Radar,
    Imu,
    Gnss,
    Collision,
    Obstacle,
    LaneInvasion,
    V2x,
    V2xCustom,
}

impl Kind {
    fn of(id: &str) -> Option<Kind> {
        Some(match id {
            "sensor.camera.rgb" => Kind::Rgb,
            "sensor.camera.depth" => Kind::Depth,
            "sensor.camera.semantic_segmentation" => Kind::Semantic,
            "sensor.camera.instance_segmentation" => Kind::Instance,
            "sensor.camera.normals" => Kind::Normals,
            "sensor.camera.optical_flow" => Kind::Flow,
            "sensor.camera.dvs" => Kind::Events,
            "sensor.lidar.ray_cast" => Kind::Lidar,
            "sensor.lidar.ray_cast_semantic" => Kind::SemanticLidar,
            "sensor.other.radar" => Kind::Radar,
            "sensor.other.imu" => Kind::Imu,
            "sensor.other.gnss" => Kind::Gnss,
            "sensor.other.collision" => Kind::Collision,
            "sensor.other.obstacle" => Kind::Obstacle,
            "sensor.other.lane_invasion" => Kind::LaneInvasion,
            "sensor.other.v2x" => Kind::V2x,
            "sensor.other.v2x_custom" => Kind::V2xCustom,
            _ => return None,
        })
    }

    /// The number by which a client knows how to read a message. A wrong one ends the client.
    pub(crate) fn type_id(self) -> u64 {
        match self {
            Kind::Collision => 0,
            Kind::Depth => 1,
            Kind::Normals => 2,
            Kind::Events => 3,
            Kind::Gnss => 4,
            Kind::Imu => 5,
            Kind::LaneInvasion => 6,
            Kind::Obstacle => 7,
            Kind::Flow => 8,
            Kind::Radar => 9,
            Kind::SemanticLidar => 10,
            Kind::Lidar => 11,
            Kind::Rgb => 13,
            Kind::Semantic => 14,
            Kind::Instance => 15,
            Kind::V2x => 20,
            Kind::V2xCustom => 21,
        }
    }

    fn outputs(self) -> u32 {
        match self {
            Kind::Rgb | Kind::Events => output::COLOR,
            Kind::Normals => output::NORMAL,
            Kind::Flow => output::FLOW,
            Kind::Depth => output::DEPTH,
            Kind::Semantic => output::TAG,
            Kind::Instance => output::TAG | output::INSTANCE,
            Kind::Lidar => output::POINTS,
            Kind::SemanticLidar | Kind::Radar => output::POINTS | output::LABELS,
            _ => 0,
        }
    }
}

/// How far apart the rays lie among which a radar's points are drawn: a quarter of a degree.
const RADAR_STEP_RAD: f32 = 0.25 * TAU / 360.0;

/// A sensor.
pub(crate) struct Sensor {
    pub(crate) kind: Kind,
    pub(crate) stream: u32,
    pub(crate) description: Description,
    pub(crate) period_nanos: u64,
    /// What measures, while somebody listens.
    pub(crate) bundle: Option<SensorBundle>,
    /// The length of a tick for which the bundle was made.
    pub(crate) rig_delta_nanos: u64,
    /// Frames for which nobody listened.
    pub(crate) idle_frames: u32,
    /// Of a camera: the streams of its textures, by their numbers.
    pub(crate) textures: BTreeMap<u32, u32>,
    /// What the bundle was made to give.
    pub(crate) rig_outputs: u32,
    /// Of a sensor of events: what it has seen.
    pub(crate) events: Option<EventCamera>,
}

impl Sensor {
    /// Not measuring yet; refused are those that nothing here can measure.
    pub(crate) fn new(description: Description, stream: u32) -> Result<Sensor, Refusal> {
        let Some(kind) = Kind::of(&description.id) else {
            let id = &description.id;
            return Err(format!("{id} is not measured by this simulator").into());
        };
        let period_nanos = (description.number("sensor_tick", 0.0)?.max(0.0) * 1e9) as u64;
        let mut sensor = Sensor {
            kind,
            stream,
            period_nanos,
            bundle: None,
            rig_delta_nanos: 0,
            idle_frames: 0,
            textures: BTreeMap::new(),
            rig_outputs: 0,
            events: None,
            description,
        };
        // What is wrong with an attribute is said now, not when somebody listens.
        sensor.spec(Pose::IDENTITY, 50_000_000, 9.81)?;
        if kind == Kind::Events {
            sensor.events = Some(EventCamera::new(event_spec(&sensor.description)?));
        }
        Ok(sensor)
    }

    /// Whether somebody listens to it, or to one of its textures.
    pub(crate) fn is_wanted(&self, streams: &Streams) -> bool {
        let mut all = std::iter::once(&self.stream).chain(self.textures.values());
        all.any(|stream| streams.is_wanted(*stream))
    }

    /// What its textures take beyond its own image.
    pub(crate) fn texture_outputs(&self, streams: &Streams) -> u32 {
        let wanted = self.textures.iter().filter(|(_, stream)| streams.is_wanted(**stream));
        wanted.fold(0, |sum, (texture, _)| sum | textures::outputs(*texture))
    }

    /// Fields of view of a radar, across and up.
    pub(crate) fn radar_fov_rad(&self) -> Result<[f32; 2], Refusal> {
        let number = |id: &str, most: f32| {
            self.description.number(id, 30.0).map(|fov| fov.clamp(1.0, most).to_radians())
        };
        Ok([number("horizontal_fov", 170.0)?, number("vertical_fov", 170.0)?])
    }

    /// How many points a radar throws in one of its measurements.
    pub(crate) fn radar_points(&self) -> Result<usize, Refusal> {
        let secs = self.rig_delta_nanos.max(self.period_nanos) as f32 * 1e-9;
        let points = self.description.number("points_per_second", 1500.0)? * secs;
        Ok(points.clamp(0.0, 1e6) as usize)
    }

    /// Whether rays measure it.
    pub(crate) fn is_of_rays(&self) -> bool {
        self.kind.outputs() != 0
    }

    /// Whether its measurements go through a stream; lane invasions are found by the clients.
    pub(crate) fn is_streamed(&self) -> bool {
        self.kind != Kind::LaneInvasion
    }

    /// What the renderer or the host is to measure for it; nothing if its clients do that.
    pub(crate) fn spec(
        &self,
        parent_from_sensor: Pose,
        delta_nanos: u64,
        gravity_mps2: f32,
    ) -> Result<Option<SensorSpec>, Refusal> {
        let d = &self.description;
        let number = |id: &str, otherwise: f32| d.number(id, otherwise);
        let spec = match self.kind {
            Kind::Rgb
            | Kind::Depth
            | Kind::Semantic
            | Kind::Instance
            | Kind::Normals
            | Kind::Flow
            | Kind::Events => camera(
                "camera",
                parent_from_sensor,
                number("image_size_x", 800.0)? as u32,
                number("image_size_y", 600.0)? as u32,
                number("fov", 90.0)?.clamp(1.0, 170.0).to_radians(),
                self.kind.outputs(),
            ),
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
                // From one turn in a tick on, the whole field of view is seen in each.
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
            Kind::Radar => {
                let [h, v] = self.radar_fov_rad()?;
                let lines = |fov: f32| ((fov / RADAR_STEP_RAD) as u32).clamp(16, 1024);
                let mut spec = lidar(
                    "radar",
                    parent_from_sensor,
                    lines(v),
                    lines(h),
                    [-v / 2.0, v / 2.0],
                    number("range", 100.0)?,
                );
                spec.fov_rad = h;
                spec.outputs = self.kind.outputs();
                spec
            }
            born => match born::spec(born, d, parent_from_sensor, gravity_mps2)? {
                Some(spec) => spec,
                None => return Ok(None),
            },
        };
        Ok(Some(SensorSpec { period_nanos: self.period_nanos, ..spec }))
    }
}

/// How a sensor of events sees.
fn event_spec(d: &Description) -> Result<EventCameraSpec, Refusal> {
    let threshold = |id: &str| -> Result<f32, Refusal> {
        let value = d.number(id, 0.3)?;
        if value > 0.0 { Ok(value) } else { Err(format!("{id} is {value}, not above 0").into()) }
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
