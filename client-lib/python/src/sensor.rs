//! Sensors: Python's dataclasses of `omnibus.sensors` as those of the client library.

use std::time::Duration;

use client_lib::{
    CameraEffects, CameraOptions, CameraOutputs, Elevations, Exposure, GnssOptions, ImuOptions,
    Intrinsics, Lens, LidarModel, LidarOptions, LidarOutputs, ObstacleOptions, OdometryOptions,
    PointAttribute, Quality, Sensor, SensorKind, ToneCurve,
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{fields::Fields, pose::PyPose, radar, wait::seconds};

/// Combines the outputs of these names.
fn outputs<T: Copy>(
    names: &[String],
    known: &[(&str, T)],
    none: T,
    with: impl Fn(T, T) -> T,
) -> PyResult<T> {
    let one = |name: &String| {
        let found = known.iter().find(|(known, _)| known == name).map(|(_, output)| *output);
        found.ok_or_else(|| {
            let all = known.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            PyValueError::new_err(format!("unknown output {name:?}; use {all}"))
        })
    };
    names.iter().map(one).try_fold(none, |sum, output| Ok(with(sum, output?)))
}

/// Returns the client library's sensor of a Python dataclass.
pub(crate) fn sensor(object: &Bound<'_, PyAny>) -> PyResult<Sensor> {
    let fields = Fields(object);
    let kind: String = object.getattr("kind").and_then(|kind| kind.extract()).map_err(|_| {
        PyValueError::new_err(format!("{object} is no sensor; use the classes of omnibus.sensors"))
    })?;
    let kind: SensorKind = match kind.as_str() {
        "camera" => camera(&fields)?.into(),
        "lidar" => lidar(&fields)?.into(),
        "radar" => radar::Model::of(&fields)?.radar.lidar().into(),
        "imu" => ImuOptions::default()
            .accelerometer_stddev(fields.vector("accelerometer_stddev_mps2")?)
            .gyroscope_stddev(fields.vector("gyroscope_stddev_radps")?)
            .gyroscope_bias(fields.vector("gyroscope_bias_radps")?)
            .accelerometer_walk(fields.get("accelerometer_walk")?)
            .gyroscope_walk(fields.get("gyroscope_walk")?)
            .gravity_mps2(fields.get("gravity_mps2")?)
            .accelerometer_max_mps2(fields.get("accelerometer_max_mps2")?)
            .into(),
        "gnss" => GnssOptions::default()
            .latitude_stddev_deg(fields.get("latitude_stddev_deg")?)
            .latitude_bias_deg(fields.get("latitude_bias_deg")?)
            .longitude_stddev_deg(fields.get("longitude_stddev_deg")?)
            .longitude_bias_deg(fields.get("longitude_bias_deg")?)
            .altitude_stddev_m(fields.get("altitude_stddev_m")?)
            .altitude_bias_m(fields.get("altitude_bias_m")?)
            .wander_m(fields.get("wander_m")?)
            .wander_up_m(fields.get("wander_up_m")?)
            .wander_time(seconds("wander_secs", fields.get("wander_secs")?)?)
            .into(),
        "odometry" => OdometryOptions::default()
            .scale_error(fields.get("scale_error")?)
            .stddev_mps(fields.get("stddev_mps")?)
            .step_mps(fields.get("step_mps")?)
            .into(),
        "collision" => SensorKind::Collision,
        "lane_invasion" => SensorKind::LaneInvasion,
        "obstacle" => ObstacleOptions::default()
            .distance_m(fields.get("distance_m")?)
            .hit_radius_m(fields.get("hit_radius_m")?)
            .only_actors(fields.get("only_actors")?)
            .into(),
        other => return Err(PyValueError::new_err(format!("unknown kind of sensor {other:?}"))),
    };
    let pose = object.getattr("pose")?.extract::<PyPose>()?;
    let mut sensor = Sensor::new(&fields.get::<String>("name")?, pose.into(), kind);
    sensor.seed = fields.get("seed")?;
    let period: f64 = fields.get("period_secs")?;
    sensor.period = Some(seconds("period_secs", period)?).filter(|period| *period > Duration::ZERO);
    Ok(sensor)
}

/// Returns the radar of a Python dataclass; `None` for other sensors.
pub(crate) fn radar(object: &Bound<'_, PyAny>) -> PyResult<Option<radar::Model>> {
    let kind = object.getattr("kind").and_then(|kind| kind.extract::<String>());
    match kind.as_deref() {
        Ok("radar") => radar::Model::of(&Fields(object)).map(Some),
        // What is no sensor at all is an error elsewhere.
        _ => Ok(None),
    }
}

fn camera(fields: &Fields<'_, '_>) -> PyResult<CameraOptions> {
    let known = [
        ("color", CameraOutputs::COLOR),
        ("depth", CameraOutputs::DEPTH),
        ("tags", CameraOutputs::TAG),
        ("instances", CameraOutputs::INSTANCE),
        ("normals", CameraOutputs::NORMAL),
        ("flow", CameraOutputs::FLOW),
    ];
    let names = fields.names("outputs")?;
    let outputs = outputs(&names, &known, CameraOutputs::empty(), CameraOutputs::union)?;
    let (width, height) = (fields.get("width")?, fields.get("height")?);
    let quality: String = fields.get("quality")?;
    let quality = match quality.as_str() {
        "default" => Quality::Default,
        "low" => Quality::Low,
        "standard" => Quality::Standard,
        "epic" => Quality::Epic,
        other => {
            return Err(PyValueError::new_err(format!(
                "unknown quality {other:?}; use default, low, standard or epic"
            )));
        }
    };
    let options = CameraOptions::new(width, height, fields.get("fov_rad")?);
    let intrinsics: Option<[f32; 4]> = fields.get("intrinsics_px")?;
    let intrinsics = intrinsics.map(|[fx, fy, cx, cy]| Intrinsics::new([fx, fy], [cx, cy]));
    let lens = lens(&Fields(&fields.0.getattr("lens")?))?;
    let effects = effects(&Fields(&fields.0.getattr("effects")?))?;
    let options = options.outputs(outputs).quality(quality).intrinsics(intrinsics).lens(lens);
    Ok(options.effects(effects))
}

fn effects(fields: &Fields<'_, '_>) -> PyResult<CameraEffects> {
    if fields.0.is_none() {
        return Ok(CameraEffects::NONE);
    }
    let exposure: String =
        fields.0.getattr("exposure").and_then(|exposure| exposure.extract()).map_err(|_| {
            let given = fields.0;
            PyValueError::new_err(format!(
                "{given} is no effects; use CameraEffects of omnibus.sensors, or None"
            ))
        })?;
    let exposure = match exposure.as_str() {
        "weather" => Exposure::Weather,
        "automatic" => {
            let [ev_min, ev_max] = fields.get("ev_limits")?;
            Exposure::Automatic { ev_min, ev_max }
        }
        "manual" => Exposure::Manual {
            iso: fields.get("iso")?,
            shutter_secs: fields.get("shutter_secs")?,
            f_number: fields.get("f_number")?,
        },
        other => {
            return Err(PyValueError::new_err(format!(
                "unknown exposure {other:?}; use weather, automatic or manual"
            )));
        }
    };
    let filmic: Option<[f32; 5]> = fields.get("filmic")?;
    let tone_curve = match filmic {
        None => ToneCurve::Hable,
        Some([slope, toe, shoulder, black_clip, white_clip]) => {
            ToneCurve::Filmic { slope, toe, shoulder, black_clip, white_clip }
        }
    };
    Ok(CameraEffects::NONE
        .exposure(exposure)
        .compensation_ev(fields.get("compensation_ev")?)
        .vignette(fields.get("vignette")?)
        .bloom(fields.get("bloom")?)
        .bloom_radius(fields.get("bloom_radius")?)
        .chromatic_aberration(fields.get("chromatic_aberration")?)
        .white_electrons(fields.get("white_electrons")?)
        .read_electrons(fields.get("read_electrons")?)
        .temperature_k(fields.get("temperature_k")?)
        .tint(fields.get("tint")?)
        .gamma(fields.get("gamma")?)
        .tone_curve(tone_curve)
        .readout_secs(fields.get("readout_secs")?)
        .blur_secs(fields.get("blur_secs")?)
        .aperture_m(fields.get("aperture_m")?)
        .focus_m(fields.get("focus_m")?))
}

fn lens(fields: &Fields<'_, '_>) -> PyResult<Lens> {
    if fields.0.is_none() {
        return Ok(Lens::Pinhole);
    }
    let model: String =
        fields.0.getattr("model").and_then(|model| model.extract()).map_err(|_| {
            let given = fields.0;
            PyValueError::new_err(format!(
                "{given} is no lens; use BrownConrady or Fisheye of omnibus.sensors, or None"
            ))
        })?;
    match model.as_str() {
        "brown_conrady" => Ok(Lens::BrownConrady {
            k1: fields.get("k1")?,
            k2: fields.get("k2")?,
            p1: fields.get("p1")?,
            p2: fields.get("p2")?,
            k3: fields.get("k3")?,
        }),
        "fisheye" => Ok(Lens::Fisheye {
            k: [fields.get("k1")?, fields.get("k2")?, fields.get("k3")?, fields.get("k4")?],
            max_angle_rad: fields.get("max_angle_rad")?,
        }),
        other => Err(PyValueError::new_err(format!("unknown model of a lens {other:?}"))),
    }
}

fn lidar(fields: &Fields<'_, '_>) -> PyResult<LidarOptions> {
    let known = [
        ("points", LidarOutputs::POINTS),
        ("labels", LidarOutputs::LABELS),
        ("last_points", LidarOutputs::LAST_POINTS),
        ("last_labels", LidarOutputs::LAST_LABELS),
    ];
    let names = fields.names("outputs")?;
    let outputs = outputs(&names, &known, LidarOutputs::empty(), LidarOutputs::union)?;
    let elevations = [fields.get("lower_rad")?, fields.get("upper_rad")?];
    let options = LidarOptions::new(
        fields.get("channels")?,
        fields.get("columns")?,
        elevations,
        fields.get("range_m")?,
    );
    let attribute: String = fields.get("point_attribute")?;
    let attribute = match attribute.as_str() {
        "intensity" => PointAttribute::Intensity,
        "cos_incidence" => PointAttribute::CosIncidence,
        other => {
            return Err(PyValueError::new_err(format!(
                "unknown point_attribute {other:?}; use intensity or cos_incidence"
            )));
        }
    };
    let elevations: Option<Vec<f32>> = fields.get("elevations_rad")?;
    Ok(options
        .elevations(elevations.as_deref().map(Elevations::from))
        .prism_hz(fields.get("prism_hz")?)
        .sweep(fields.get("sweep")?)
        .divergence_rad(fields.get("divergence_rad")?)
        .weather(fields.get("weather")?)
        .fov_rad(fields.get("fov_rad")?)
        .noise_m(fields.get("noise_m")?)
        .dropoff(fields.get("dropoff")?)
        .attenuation_per_m(fields.get("attenuation_per_m")?)
        .rotation_rate_hz(fields.get("rotation_rate_hz")?)
        .point_attribute(attribute)
        .outputs(outputs))
}

/// Returns the fields of `omnibus.sensors.Lidar` for a model of a maker.
#[pyfunction]
pub(crate) fn lidar_model<'py>(
    py: Python<'py>,
    model: &str,
    period_secs: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let model: LidarModel = model.parse().map_err(|why| PyValueError::new_err(format!("{why}")))?;
    let options = model.options(seconds("period_secs", period_secs)?);
    let fields = PyDict::new(py);
    fields.set_item("channels", options.channels)?;
    fields.set_item("columns", options.columns)?;
    fields.set_item("lower_rad", options.lower_rad)?;
    fields.set_item("upper_rad", options.upper_rad)?;
    fields.set_item("elevations_rad", model.elevations_rad())?;
    fields.set_item("range_m", options.range_m)?;
    fields.set_item("fov_rad", options.fov_rad)?;
    fields.set_item("noise_m", options.noise_m)?;
    fields.set_item("rotation_rate_hz", options.rotation_rate_hz)?;
    fields.set_item("prism_hz", options.prism_hz)?;
    Ok(fields)
}
