//! The connection to a running simulator.

use std::sync::Arc;

use client_lib::{
    ActorId, Command, Frame, Pace, Sensor, Spawn, Strategy, VehicleControl, Weather, glam::Vec3,
};
use pyo3::{
    exceptions::PyValueError,
    prelude::*,
    types::{PyBytes, PyDict, PyList},
};

use crate::{
    bundle::{Bundle, BundleState, Bundles},
    core::Core,
    error::error,
    keypoints::Keypoints,
    map::Map,
    measurement::Measurement,
    pose::PyPose,
    recorder::Recorder,
    sensor,
    traffic::Traffic,
    wait::{Cancel, Limit, seconds, wait},
    world::World,
};

#[pyclass(frozen, subclass, module = "omnibus._omnibus")]
pub(crate) struct Client {
    core: Arc<Core>,
    open_bundles: Arc<Bundles>,
    name: String,
    instance: String,
    blueprints: Vec<client_lib::BlueprintInfo>,
}

/// A Python tuple of three numbers.
type Vector = (f32, f32, f32);

/// A frame's number, its world, and what each bundle measured.
type Ticked = (u64, World, Vec<(String, Option<Measurement>)>);

impl Client {
    fn bundle(&self, state: Arc<BundleState>) -> Bundle {
        let bundles = Arc::clone(&self.open_bundles);
        Bundle { state, bundles, core: Arc::clone(&self.core) }
    }
}

#[pymethods]
impl Client {
    #[new]
    #[pyo3(signature = (name="python", instance=None, *, wait_strategy=None))]
    fn new(
        py: Python<'_>,
        name: &str,
        instance: Option<&str>,
        wait_strategy: Option<&str>,
    ) -> PyResult<Client> {
        let mut options = client_lib::Client::options(name);
        if let Some(instance) = instance {
            options = options.instance(instance);
        }
        if let Some(wanted) = wait_strategy {
            options = options.wait_strategy(Strategy::by_name(wanted).ok_or_else(|| {
                PyValueError::new_err(format!(
                    "wait_strategy is {wanted:?}; use latency, balanced or batch"
                ))
            })?);
        }
        let client = py.detach(|| options.connect()).map_err(error)?;
        Ok(Client {
            name: name.to_owned(),
            instance: client.instance().id().to_owned(),
            blueprints: client.blueprints().to_vec(),
            core: Arc::new(Core::new(client)),
            open_bundles: Arc::default(),
        })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn instance(&self) -> &str {
        &self.instance
    }

    #[getter]
    fn is_open(&self) -> PyResult<bool> {
        self.core.is_open()
    }

    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.core.check_process()?;
        py.detach(|| self.open_bundles.close());
        self.core.close(py)
    }

    #[getter]
    fn frame(&self, py: Python<'_>) -> PyResult<u64> {
        self.core.with(py, |client| Ok(client.frame().0))
    }

    #[getter]
    fn episode(&self, py: Python<'_>) -> PyResult<u32> {
        self.core.with(py, |client| Ok(client.episode()))
    }

    /// Id, semantic tag, half extents and centre of each blueprint.
    fn _blueprints(&self) -> Vec<(&str, u8, Vector, Vector)> {
        let blueprints = self.blueprints.iter();
        blueprints
            .map(|b| (b.id.as_str(), b.tag, b.half_extents_m.into(), b.center_m.into()))
            .collect()
    }

    #[getter]
    fn world(&self, py: Python<'_>) -> PyResult<World> {
        self.core.world(py).map(World::new)
    }

    fn snapshot(&self, py: Python<'_>) -> PyResult<World> {
        self.core.refreshed(py).map(World::new)
    }

    /// Advances the world and collects what every bundle measured.
    fn _tick(
        &self,
        py: Python<'_>,
        timeout_secs: Option<f64>,
        cancel: Option<&Cancel>,
    ) -> PyResult<Ticked> {
        let limit = Limit::new(timeout_secs, cancel)?;
        self.core.check_process()?;
        let bundles = self.open_bundles.all();
        bundles.iter().try_for_each(|bundle| bundle.check_room())?;
        let ticked = self.core.tick(py, &limit);
        // A frame that ended without a part is taken in nevertheless.
        let world = World::new(self.core.refreshed(py)?);
        let frame = ticked?;
        let episode = self.core.with(py, |client| Ok(client.episode()))?;
        let mut measured = Vec::with_capacity(bundles.len());
        for bundle in bundles {
            let data = py.detach(|| bundle.at(frame, episode)).inspect_err(|_| {
                // Its end is reported once.
                self.open_bundles.remove(&bundle);
            })?;
            measured.push((bundle.name().to_owned(), data.map(|data| Measurement { data })));
        }
        Ok((frame, world, measured))
    }

    #[pyo3(signature = (timeout_secs=None, *, cancel=None))]
    fn await_frame(
        &self,
        py: Python<'_>,
        timeout_secs: Option<f64>,
        cancel: Option<&Cancel>,
    ) -> PyResult<World> {
        let limit = Limit::new(timeout_secs, cancel)?;
        let waiter = self.core.waiter(py)?;
        let waiter = waiter.get()?;
        let done = Frame(self.frame(py)?);
        wait(py, "the next frame", &limit, |slice| waiter.next_frame(done, slice))?;
        self.snapshot(py)
    }

    fn synchronise(&self, py: Python<'_>, delta_secs: f64) -> PyResult<()> {
        let delta = seconds("delta_secs", delta_secs)?;
        self.core.with(py, |client| client.synchronise(delta))
    }

    /// The settings by their names.
    fn _settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let settings = self.core.with(py, |client| Ok(client.settings()))?;
        let (is_synchronous, real_time_factor) = match settings.pace {
            Pace::Synchronous => (true, None),
            Pace::RealTime(factor) => (false, Some(factor)),
            Pace::Unpaced => (false, None),
        };
        let dict = PyDict::new(py);
        dict.set_item("delta_secs", settings.delta.as_secs_f64())?;
        dict.set_item("substep_max_secs", settings.substep_max.as_secs_f64())?;
        dict.set_item("synchronous", is_synchronous)?;
        dict.set_item("real_time_factor", real_time_factor)?;
        dict.set_item("pipeline", settings.pipeline)?;
        dict.set_item("rendering", settings.rendering)?;
        Ok(dict)
    }

    fn _apply_settings(
        &self,
        py: Python<'_>,
        delta_secs: f64,
        substep_max_secs: f64,
        synchronous: bool,
        real_time_factor: Option<f32>,
        pipeline: u32,
        rendering: bool,
    ) -> PyResult<()> {
        let pace = match (synchronous, real_time_factor) {
            (true, _) => Pace::Synchronous,
            (false, Some(factor)) => Pace::RealTime(factor),
            (false, None) => Pace::Unpaced,
        };
        let settings = client_lib::Settings::default()
            .with_delta(seconds("delta_secs", delta_secs)?)
            .with_substep_max(seconds("substep_max_secs", substep_max_secs)?)
            .with_pace(pace)
            .with_pipeline(pipeline)
            .with_rendering(rendering);
        self.core.with(py, |client| client.apply_settings(settings))
    }

    fn take_tick(&self, py: Python<'_>) -> PyResult<()> {
        self.core.with(py, client_lib::Client::take_tick)
    }

    #[getter]
    fn holds_tick(&self, py: Python<'_>) -> PyResult<bool> {
        self.core.with(py, |client| Ok(client.holds_tick()))
    }

    fn leave_tick(&self, py: Python<'_>) -> PyResult<()> {
        self.core.with(py, |client| {
            client.leave_tick();
            Ok(())
        })
    }

    fn hand_tick_to(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.core.with(py, |client| client.hand_tick_to(name))
    }

    fn join_barrier(&self, py: Python<'_>) -> PyResult<()> {
        self.core.with(py, client_lib::Client::join_barrier)
    }

    fn leave_barrier(&self, py: Python<'_>) -> PyResult<()> {
        self.core.with(py, client_lib::Client::leave_barrier)
    }

    fn arrive(&self, py: Python<'_>) -> PyResult<()> {
        self.core.with(py, |client| {
            client.arrive();
            Ok(())
        })
    }

    #[pyo3(signature = (blueprint, pose, *, autopilot=false, kinematic=false, color=None, role=None))]
    fn spawn(
        &self,
        py: Python<'_>,
        blueprint: &str,
        pose: PyPose,
        autopilot: bool,
        kinematic: bool,
        color: Option<[u8; 3]>,
        role: Option<&str>,
    ) -> PyResult<u32> {
        let mut spawn = Spawn::new(blueprint, pose.into());
        if autopilot {
            spawn = spawn.autopilot();
        }
        if kinematic {
            spawn = spawn.kinematic();
        }
        if let Some(color) = color {
            spawn = spawn.color(color);
        }
        if let Some(role) = role {
            spawn = spawn.role(role);
        }
        self.core.request(py, "spawn", spawn)
    }

    fn destroy(&self, py: Python<'_>, actor_id: u32) -> PyResult<()> {
        self.core.request(py, "destroy", Command::destroy(ActorId(actor_id))).map(drop)
    }

    fn teleport(&self, py: Python<'_>, actor_id: u32, pose: PyPose) -> PyResult<()> {
        let command = Command::teleport(ActorId(actor_id), pose.into());
        self.core.request(py, "teleport", command).map(drop)
    }

    #[pyo3(signature = (actor_id, velocity_mps, angular_velocity_radps=[0.0; 3]))]
    fn set_velocity(
        &self,
        py: Python<'_>,
        actor_id: u32,
        velocity_mps: [f32; 3],
        angular_velocity_radps: [f32; 3],
    ) -> PyResult<()> {
        let (v, w) = (Vec3::from_array(velocity_mps), Vec3::from_array(angular_velocity_radps));
        let command = Command::set_velocity(ActorId(actor_id), v, w);
        self.core.request(py, "set_velocity", command).map(drop)
    }

    fn set_kinematic(&self, py: Python<'_>, actor_id: u32, on: bool) -> PyResult<()> {
        let command = Command::set_kinematic(ActorId(actor_id), on);
        self.core.request(py, "set_kinematic", command).map(drop)
    }

    #[pyo3(signature = (actor_id, *, throttle=0.0, brake=0.0, steer=0.0, handbrake=false, reverse=false, gear=None))]
    fn control(
        &self,
        py: Python<'_>,
        actor_id: u32,
        throttle: f32,
        brake: f32,
        steer: f32,
        handbrake: bool,
        reverse: bool,
        gear: Option<i32>,
    ) -> PyResult<()> {
        let actor_id = ActorId(actor_id);
        let control = VehicleControl { actor_id, throttle, brake, steer, handbrake, reverse, gear };
        self.core.with(py, |client| client.control(&[control]))
    }

    fn keypoints(&self, py: Python<'_>, actor_id: u32) -> PyResult<Keypoints> {
        self.core.with(py, |client| client.keypoints(ActorId(actor_id))).map(Keypoints)
    }

    fn set_weather(&self, py: Python<'_>, weather: &Bound<'_, PyAny>) -> PyResult<()> {
        let field = |name: &str| weather.getattr(name)?.extract::<f32>();
        let weather = Weather {
            cloudiness: field("cloudiness")?,
            precipitation: field("precipitation")?,
            precipitation_deposits: field("precipitation_deposits")?,
            wind_intensity: field("wind_intensity")?,
            sun_azimuth_rad: field("sun_azimuth_rad")?,
            sun_altitude_rad: field("sun_altitude_rad")?,
            fog_density: field("fog_density")?,
            fog_distance_m: field("fog_distance_m")?,
            wetness: field("wetness")?,
        };
        self.core.request(py, "set_weather", Command::set_weather(weather)).map(drop)
    }

    #[pyo3(signature = (name, sensors, parent=None, *, view_mib=64.0, when_full="copy"))]
    fn create_bundle(
        &self,
        py: Python<'_>,
        name: &str,
        sensors: Vec<Bound<'_, PyAny>>,
        parent: Option<u32>,
        view_mib: f64,
        when_full: &str,
    ) -> PyResult<Bundle> {
        let radars = sensors.iter().map(sensor::radar).collect::<PyResult<_>>()?;
        let sensors: Vec<Sensor> = sensors.iter().map(sensor::sensor).collect::<PyResult<_>>()?;
        let core = &self.core;
        let state =
            BundleState::create(core, py, name, parent, sensors, radars, view_mib, when_full)?;
        self.open_bundles.add(&state);
        Ok(self.bundle(state))
    }

    #[getter]
    fn bundles(&self, py: Python<'_>) -> PyResult<Py<PyList>> {
        self.core.check_process()?;
        let states = self.open_bundles.all().into_iter();
        let bundles = states.map(|state| Py::new(py, self.bundle(state)));
        Ok(PyList::new(py, bundles.collect::<PyResult<Vec<_>>>()?)?.unbind())
    }

    #[getter]
    fn map(&self, py: Python<'_>) -> PyResult<Map> {
        let network = self.core.with(py, |client| client.map())?;
        Ok(Map { network })
    }

    fn available_maps(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.core.with(py, |client| client.available_maps())
    }

    #[pyo3(signature = (name="", *, seed=None))]
    fn load_map(&self, py: Python<'_>, name: &str, seed: Option<u64>) -> PyResult<World> {
        self.core.with(py, |client| client.load_world(name, seed, client_lib::Layers::empty()))?;
        self.core.world(py).map(World::new)
    }

    fn save_state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let state = self.core.with(py, client_lib::Client::save_state)?;
        Ok(PyBytes::new(py, &state))
    }

    fn load_state(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        self.core.with(py, |client| client.load_state(state))
    }

    #[getter]
    fn traffic(&self) -> Traffic {
        Traffic { core: Arc::clone(&self.core) }
    }

    #[getter]
    fn recorder(&self) -> Recorder {
        Recorder { core: Arc::clone(&self.core) }
    }

    /// Nanoseconds of the clock of `World.published_nanos`.
    #[staticmethod]
    fn clock_nanos() -> u64 {
        client_lib::clock::now_nanos()
    }

    fn __repr__(&self) -> String {
        format!("Client({:?}, instance={:?})", self.name, self.instance)
    }
}
