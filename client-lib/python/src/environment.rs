//! Driving environments in this process, for `omnibus.gym`.

use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use environment::{
    Action, BIRDS_EYE_CHANNELS, BirdsEye, Cache, Camera, CameraOutput, Config, Ego, Ending,
    EnvironmentError, Physics, Reward,
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{
    array::{fresh, fresh_values},
    error::{NotAllowedError, OmnibusError, RefusedError},
    pose::PyPose,
};

fn error(error: EnvironmentError) -> PyErr {
    let text = error.to_string();
    match error {
        EnvironmentError::Map(_) | EnvironmentError::Camera(_) => OmnibusError::new_err(text),
        EnvironmentError::Refused(_) => RefusedError::new_err((text, "Other")),
        _ => PyValueError::new_err(text),
    }
}

#[pyclass(frozen, weakref, module = "omnibus._omnibus")]
pub(crate) struct EnvironmentMap {
    map: Arc<environment::EnvironmentMap>,
    name: String,
    seed: u64,
}

#[pymethods]
impl EnvironmentMap {
    #[new]
    #[pyo3(signature = (map=None, *, seed=1))]
    fn new(py: Python<'_>, map: Option<String>, seed: u64) -> PyResult<EnvironmentMap> {
        py.detach(|| {
            let (name, text) = match map {
                None => {
                    let (name, text) = mapgen::default_map();
                    (name.to_owned(), text)
                }
                Some(name) => {
                    let text = maps::text(&name, None)
                        .map_err(|why| OmnibusError::new_err(why.to_string()))?;
                    (name, text)
                }
            };
            let cache = Cache::from_environment();
            let map =
                environment::EnvironmentMap::load(&cache, &name, &text, seed).map_err(error)?;
            Ok(EnvironmentMap { map: Arc::new(map), name, seed })
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.seed
    }
}

#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Environment {
    inner: Mutex<environment::Environment>,
    egos: usize,
    waypoints: bool,
}

/// The attributes of a Python `omnibus.gym.Camera`.
#[derive(FromPyObject)]
pub(crate) struct PyCamera {
    width_px: u32,
    height_px: u32,
    fov_rad: f32,
    pose: PyPose,
    output: String,
}

impl PyCamera {
    fn camera(self) -> PyResult<Camera> {
        let PyCamera { width_px, height_px, fov_rad, pose, output } = self;
        let output = match &*output {
            "color" => CameraOutput::Color,
            "tags" => CameraOutput::Tags,
            "depth" => CameraOutput::Depth,
            _ => {
                let message = format!("camera.output is {output}, must be color, tags or depth");
                return Err(PyValueError::new_err(message));
            }
        };
        Ok(Camera { width_px, height_px, fov_rad, mount: pose.into(), output })
    }
}

fn ending_text(ending: Ending) -> &'static str {
    match ending {
        Ending::Arrival => "arrival",
        Ending::Collision => "collision",
        Ending::OffRoute => "off_route",
        Ending::Steps => "steps",
    }
}

impl Environment {
    /// Locks the environment. A lock that is held is an error and is not waited for: in a forked
    /// child the thread that held it may not exist.
    fn lock(&self) -> PyResult<MutexGuard<'_, environment::Environment>> {
        match self.inner.try_lock() {
            Ok(inner) => Ok(inner),
            // A panic of the simulation: the world may be half a step further.
            Err(TryLockError::Poisoned(_)) => Err(OmnibusError::new_err(
                "an earlier call of this environment failed inside the simulation; make another",
            )),
            Err(TryLockError::WouldBlock) => Err(NotAllowedError::new_err(
                "this environment is in use by another thread; give each thread one of its own",
            )),
        }
    }

    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut environment::Environment) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| work(&mut *self.lock()?))
    }

    fn with_ego<T: Send>(
        &self,
        py: Python<'_>,
        ego: usize,
        work: impl FnOnce(&Ego) -> T + Send,
    ) -> PyResult<T> {
        self.check_ego(ego)?;
        self.with(py, |inner| Ok(work(&inner.egos()[ego])))
    }

    fn check_ego(&self, ego: usize) -> PyResult<()> {
        if ego < self.egos {
            return Ok(());
        }
        Err(PyValueError::new_err(format!("ego is {ego}, and there are {}", self.egos)))
    }
}

#[pymethods]
impl Environment {
    #[new]
    #[pyo3(signature = (
        map, *, seed=1, waypoints=false, egos=1, vehicles=12, kinematic_traffic=false,
        frame_s=0.05, frames_per_step=2, route_m=300.0, steps_max=1000, lidar_rays=0,
        lidar_range_m=50.0, birds_eye_px=84, birds_eye_pixel_m=0.5, camera=None, off_route_m=0.5,
        rewards=None,
    ))]
    fn new(
        py: Python<'_>,
        map: &EnvironmentMap,
        seed: u64,
        waypoints: bool,
        egos: usize,
        vehicles: usize,
        kinematic_traffic: bool,
        frame_s: f32,
        frames_per_step: u32,
        route_m: f32,
        steps_max: u32,
        lidar_rays: usize,
        lidar_range_m: f32,
        birds_eye_px: usize,
        birds_eye_pixel_m: f32,
        camera: Option<PyCamera>,
        off_route_m: f32,
        rewards: Option<[f32; 8]>,
    ) -> PyResult<Environment> {
        let reward = rewards.map_or_else(Reward::default, reward_of);
        let birds_eye = BirdsEye { size_px: birds_eye_px, pixel_m: birds_eye_pixel_m };
        let camera = camera.map(PyCamera::camera).transpose()?.unwrap_or_default();
        let observed = Config { lidar_rays, lidar_range_m, birds_eye, camera, ..Config::default() };
        let physics = if kinematic_traffic { Physics::Ego } else { Physics::All };
        let config = Config {
            egos,
            vehicles,
            physics,
            frame_s,
            frames_per_step,
            route_m,
            steps_max,
            off_route_m,
            reward,
            ..observed
        };
        let map = Arc::clone(&map.map);
        let inner =
            py.detach(|| environment::Environment::new(map, config, seed).map_err(error))?;
        Ok(Environment { inner: Mutex::new(inner), egos, waypoints })
    }

    fn reset(&self, py: Python<'_>, seed: u64) -> PyResult<()> {
        self.with(py, |inner| inner.reset(seed).map_err(error))
    }

    fn step(
        &self,
        py: Python<'_>,
        actions: Vec<(f32, f32)>,
    ) -> PyResult<Vec<(f32, Option<&'static str>)>> {
        let action = |(first, second)| match self.waypoints {
            false => Action::Pedals { steer: first, pedal: second },
            true => Action::Waypoint { left_m: first, speed_mps: second },
        };
        self.with(py, |inner| {
            let actions: Vec<Action> = actions.into_iter().map(action).collect();
            let steps = inner.step(&actions).map_err(error)?;
            Ok(steps.iter().map(|step| (step.reward, step.ending.map(ending_text))).collect())
        })
    }

    #[pyo3(signature = (ego=0))]
    fn state<'py>(&self, py: Python<'py>, ego: usize) -> PyResult<Bound<'py, PyAny>> {
        let state = self.with_ego(py, ego, Ego::state)?;
        fresh(py, &state)
    }

    #[pyo3(signature = (ego=0))]
    fn lidar<'py>(&self, py: Python<'py>, ego: usize) -> PyResult<Bound<'py, PyAny>> {
        self.check_ego(ego)?;
        let mut distances = Vec::new();
        self.with(py, |inner| {
            inner.lidar(ego, &mut distances);
            Ok(())
        })?;
        fresh(py, &distances)
    }

    #[pyo3(signature = (ego=0))]
    fn birds_eye<'py>(&self, py: Python<'py>, ego: usize) -> PyResult<Bound<'py, PyAny>> {
        self.check_ego(ego)?;
        let mut pixels = Vec::new();
        let size_px = self.with(py, |inner| {
            inner.birds_eye(ego, &mut pixels);
            Ok(inner.config().birds_eye.size_px)
        })?;
        fresh_values(py, &pixels, "|u1", [BIRDS_EYE_CHANNELS, size_px, size_px])
    }

    #[pyo3(signature = (ego=0))]
    fn camera<'py>(&self, py: Python<'py>, ego: usize) -> PyResult<Bound<'py, PyAny>> {
        self.check_ego(ego)?;
        let mut pixels = Vec::new();
        let Camera { width_px, height_px, output, .. } = self.with(py, |inner| {
            inner.camera(ego, &mut pixels).map_err(error)?;
            Ok(inner.config().camera)
        })?;
        let (typestr, channels) = match output {
            CameraOutput::Color => ("|u1", 3),
            CameraOutput::Tags => ("|u1", 1),
            CameraOutput::Depth => ("<f4", 1),
        };
        fresh_values(py, &pixels, typestr, [height_px as usize, width_px as usize, channels])
    }

    /// Distance along the route and its length, metres; forward speed, metres per second; distance
    /// to the left of the lane's middle, metres.
    #[pyo3(signature = (ego=0))]
    fn progress(&self, py: Python<'_>, ego: usize) -> PyResult<(f32, f32, f32, f32)> {
        self.with_ego(py, ego, |ego| {
            let (along_m, length_m) = ego.progress_m();
            (along_m, length_m, ego.forward_mps(), ego.left_m())
        })
    }

    #[getter]
    fn state_hash(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |inner| Ok(inner.simulation().sim().state_hash()))
    }
}

/// The order of the fields of `omnibus.gym.Rewards`.
fn reward_of(values: [f32; 8]) -> Reward {
    let [per_metre, speed, speeding, off_centre, steering, arrival, collision, off_route] = values;
    Reward { per_metre, speed, speeding, off_centre, steering, arrival, collision, off_route }
}
