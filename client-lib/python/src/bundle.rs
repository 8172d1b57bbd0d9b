//! Bundles: sensors that are measured together, and the stream of their measurements.

use std::sync::{Arc, Mutex};

use client_lib::{
    ActorId, Command, Frame, Sensor, SensorBundle, bundle_commands, wire::SensorSpec,
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{
    core::{Core, lock},
    error::{NotAllowedError, ViewLimitError, error},
    measurement::{Data, Measurement},
    owned::Owned,
    radar,
    storage::HeldCount,
    wait::{Cancel, Limit, wait},
};

/// The most measurements of one bundle that a reader may borrow.
const BORROWED_MAX: u64 = 8;

/// What happens to a measurement when as many views are held as the bundle allows.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum WhenFull {
    /// It is copied.
    Copy,
    /// Receiving it is an error.
    Error,
}

impl WhenFull {
    fn parse(text: &str) -> PyResult<WhenFull> {
        match text {
            "copy" => Ok(WhenFull::Copy),
            "error" => Ok(WhenFull::Error),
            other => {
                Err(PyValueError::new_err(format!("when_full is {other:?}; use copy or error")))
            }
        }
    }
}

/// A bundle, as the client and its Python object share it.
pub(crate) struct BundleState {
    name: String,
    sensors: Arc<[SensorSpec]>,
    /// By sensor; `None` for those that are no radars.
    radars: Arc<[Option<radar::Model>]>,
    stream: Mutex<Option<Owned<SensorBundle>>>,
    held: HeldCount,
    views_max: usize,
    when_full: WhenFull,
}

impl BundleState {
    pub(crate) fn create(
        core: &Core,
        py: Python<'_>,
        name: &str,
        parent: Option<u32>,
        sensors: Vec<Sensor>,
        radars: Vec<Option<radar::Model>>,
        view_mib: f64,
        when_full: &str,
    ) -> PyResult<Arc<BundleState>> {
        let when_full = WhenFull::parse(when_full)?;
        let sensors: Arc<[SensorSpec]> = sensors.into_iter().map(SensorSpec::from).collect();
        let (_, bytes) = protocol::layout(&sensors);
        let room = (view_mib.max(0.0) * f64::from(1 << 20)) as u64 / bytes.max(1);
        // One more than may be held: the one that arrives.
        let borrowed = room.clamp(1, BORROWED_MAX - 1) + 1;
        let parent = parent.map_or(ActorId::NONE, ActorId);
        let commands = bundle_commands(name, parent, sensors.iter(), borrowed as u32);
        let commands: Vec<Command> = commands.into_iter().map(Command::from).collect();
        let id = core.try_request(py, "create_bundle", &commands)?[0].id().map_err(error)?;
        let specs = sensors.to_vec();
        let stream = core
            .with(py, |client| client.open_bundle(protocol::BundleId(id), specs).map(Owned::new))?;
        Ok(Arc::new(BundleState {
            name: name.to_owned(),
            sensors,
            radars: radars.into(),
            stream: Mutex::new(Some(stream)),
            held: HeldCount::default(),
            views_max: borrowed as usize - 1,
            when_full,
        }))
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Ends the stream; the host destroys the bundle.
    pub(crate) fn close(&self) {
        let stream = lock(&self.stream).take();
        drop(stream);
    }

    /// Calls `work` with the stream.
    fn with<T>(&self, work: impl FnOnce(&mut SensorBundle) -> PyResult<T>) -> PyResult<T> {
        let mut stream = lock(&self.stream);
        let stream = stream.as_mut().ok_or_else(|| {
            NotAllowedError::new_err(format!("bundle {:?} is closed; create another", self.name))
        })?;
        work(stream.get_mut()?)
    }

    /// Checks that a measurement has room, if the bundle does not copy.
    pub(crate) fn check_room(&self) -> PyResult<()> {
        if self.when_full == WhenFull::Copy || self.held.get() < self.views_max {
            return Ok(());
        }
        Err(ViewLimitError::new_err(format!(
            "{} measurements of bundle {:?} are held, its limit; delete arrays and frames that \
             are no longer used, raise view_mib (8 measurements at most), or use when_full=\"copy\"",
            self.held.get(),
            self.name
        )))
    }

    fn take(&self, measured: client_lib::Measurement) -> PyResult<Arc<Data>> {
        let (sensors, radars) = (Arc::clone(&self.sensors), Arc::clone(&self.radars));
        if self.held.get() < self.views_max {
            return Ok(Arc::new(Data::view(measured, sensors, radars, self.held.hold())));
        }
        self.check_room()?;
        Ok(Arc::new(Data::copy(&measured, sensors, radars)))
    }

    /// What was measured at `frame`, in the world of number `episode`.
    pub(crate) fn at(&self, frame: u64, episode: u32) -> PyResult<Option<Arc<Data>>> {
        self.with(|stream| {
            stream.check(episode).map_err(error)?;
            let measured = stream.receive_at(Frame(frame)).map_err(error)?;
            measured.map(|measured| self.take(measured)).transpose()
        })
    }

    /// The oldest measurement that was not received, or an error if another world was loaded.
    fn receive_in(&self, episode: u32) -> PyResult<Option<Arc<Data>>> {
        let received = self.receive(false)?;
        if received.is_none() {
            self.with(|stream| stream.check(episode).map_err(error))?;
        }
        Ok(received)
    }

    fn receive(&self, newest: bool) -> PyResult<Option<Arc<Data>>> {
        self.check_room()?;
        self.with(|stream| {
            let measured = if newest { stream.latest() } else { stream.receive() };
            measured.map_err(error)?.map(|measured| self.take(measured)).transpose()
        })
    }
}

/// The open bundles of a client, in the order of their creation.
#[derive(Default)]
pub(crate) struct Bundles(Mutex<Vec<Arc<BundleState>>>);

impl Bundles {
    pub(crate) fn all(&self) -> Vec<Arc<BundleState>> {
        lock(&self.0).clone()
    }

    pub(crate) fn add(&self, bundle: &Arc<BundleState>) {
        lock(&self.0).push(Arc::clone(bundle));
    }

    pub(crate) fn remove(&self, bundle: &Arc<BundleState>) {
        lock(&self.0).retain(|other| !Arc::ptr_eq(other, bundle));
    }

    /// Ends every stream.
    pub(crate) fn close(&self) {
        std::mem::take(&mut *lock(&self.0)).iter().for_each(|bundle| bundle.close());
    }
}

#[pyclass(frozen, module = "omnibus")]
pub(crate) struct Bundle {
    pub(crate) state: Arc<BundleState>,
    /// Those of its client.
    pub(crate) bundles: Arc<Bundles>,
    pub(crate) core: Arc<Core>,
}

impl Bundle {
    fn receive_one(&self, py: Python<'_>, newest: bool) -> PyResult<Option<Measurement>> {
        self.core.check_process()?;
        let received = py.detach(|| self.state.receive(newest))?;
        Ok(received.map(|data| Measurement { data }))
    }
}

#[pymethods]
impl Bundle {
    #[getter]
    fn name(&self) -> &str {
        self.state.name()
    }

    #[getter]
    fn sensors(&self) -> Vec<String> {
        self.state.sensors.iter().map(|sensor| sensor.name.to_string()).collect()
    }

    #[getter]
    fn views_held(&self) -> usize {
        self.state.held.get()
    }

    #[getter]
    fn views_max(&self) -> usize {
        self.state.views_max
    }

    #[getter]
    fn missed(&self, py: Python<'_>) -> PyResult<u64> {
        self.core.check_process()?;
        py.detach(|| self.state.with(|stream| Ok(stream.missed())))
    }

    /// The oldest measurement that was not received, or `None`.
    fn receive(&self, py: Python<'_>) -> PyResult<Option<Measurement>> {
        self.receive_one(py, false)
    }

    fn latest(&self, py: Python<'_>) -> PyResult<Option<Measurement>> {
        self.receive_one(py, true)
    }

    #[pyo3(signature = (timeout_secs=None, *, cancel=None))]
    fn wait(
        &self,
        py: Python<'_>,
        timeout_secs: Option<f64>,
        cancel: Option<&Cancel>,
    ) -> PyResult<Measurement> {
        let limit = Limit::new(timeout_secs, cancel)?;
        let waiter = self.core.waiter(py)?;
        let waiter = waiter.get()?;
        let what = format!("a measurement of bundle {:?}", self.state.name());
        let received = wait(py, &what, &limit, |slice| {
            waiter.until(slice, || self.state.receive_in(waiter.episode()).transpose())
        })?;
        Ok(Measurement { data: received? })
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Measurement> {
        self.wait(py, None, None)
    }

    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.core.check_process()?;
        py.detach(|| {
            self.bundles.remove(&self.state);
            self.state.close();
        });
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("Bundle({:?}, sensors={:?})", self.state.name(), self.sensors())
    }
}
