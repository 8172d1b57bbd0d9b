//! Snapshots: the world at one frame, as one array of all actors.

use std::sync::Arc;

use bytemuck::{bytes_of, cast_slice, pod_read_unaligned};
use client_lib::{
    ActorId,
    glam::Vec3,
    wire::{SnapshotHeader, Stamp},
};
use protocol::ActorState;
use pyo3::{
    exceptions::{PyKeyError, PyValueError},
    prelude::*,
    sync::PyOnceLock,
    types::{PyBytes, PyType},
};

use crate::{
    array::{Bytes, ItemType},
    owned::Owned,
    storage::{Copied, Held},
};

/// The fields of `protocol::ActorState`.
static ACTOR: ItemType = ItemType::records(&[
    ("actor_id", "<u4", &[]),
    ("blueprint", "<u4", &[]),
    ("kind", "<u4", &[]),
    ("flags", "<u4", &[]),
    ("position_m", "<f4", &[3]),
    ("rotation_xyzw", "<f4", &[4]),
    ("velocity_mps", "<f4", &[3]),
    ("angular_velocity_radps", "<f4", &[3]),
    ("acceleration_mps2", "<f4", &[3]),
    ("throttle", "<f4", &[]),
    ("brake", "<f4", &[]),
    ("steer", "<f4", &[]),
    ("gear", "<i4", &[]),
    ("engine_rpm", "<f4", &[]),
    ("wheel_steer_rad", "<f4", &[]),
    ("wheel_spin_rad", "<f4", &[]),
    ("phase", "<u4", &[]),
    ("signal", "<u4", &[]),
    ("color_rgba", "|u1", &[4]),
    ("lights", "<u4", &[]),
    ("doors", "<u4", &[]),
]);

const _: () = assert!(size_of::<ActorState>() == 128);

/// Snapshots in shared memory that Python may hold: with the newest and the one that arrives, all
/// that a reader may borrow.
pub(crate) const VIEWS_MAX: usize = 2;

enum Place {
    View(Owned<Arc<client_lib::World>>, #[expect(dead_code, reason = "held for its drop")] Held),
    Copy(Copied),
}

/// A snapshot, and where it lies.
pub(crate) struct Snapshot {
    header: SnapshotHeader,
    place: Place,
}

impl Snapshot {
    pub(crate) fn view(world: Arc<client_lib::World>, held: Held) -> Snapshot {
        let header = *world.header();
        Snapshot { header, place: Place::View(Owned::new(world), held) }
    }

    pub(crate) fn copy(world: &client_lib::World) -> Snapshot {
        let header = *world.header();
        Snapshot { header, place: Place::Copy(Copied::new(cast_slice(world.states()))) }
    }

    pub(crate) fn is_at(&self, header: &SnapshotHeader) -> bool {
        self.header.stamp == header.stamp
    }

    fn states(&self) -> &[ActorState] {
        cast_slice(self.bytes())
    }
}

impl Bytes for Snapshot {
    fn bytes(&self) -> &[u8] {
        match &self.place {
            Place::View(world, _) => cast_slice(world.read().states()),
            Place::Copy(copied) => copied.bytes(),
        }
    }
}

#[pyclass(frozen, module = "omnibus")]
pub(crate) struct World {
    snapshot: Arc<Snapshot>,
    actors: PyOnceLock<Py<PyAny>>,
}

impl World {
    pub(crate) fn new(snapshot: Arc<Snapshot>) -> World {
        World { snapshot, actors: PyOnceLock::new() }
    }

    pub(crate) fn stamp(&self) -> Stamp {
        self.snapshot.header.stamp
    }

    /// The velocity of an actor in world space; zero if there is none of this id.
    pub(crate) fn velocity_of(&self, id: ActorId) -> Vec3 {
        let states = self.snapshot.states();
        let found = states.binary_search_by_key(&id, |state| state.actor_id);
        found.map_or(Vec3::ZERO, |index| states[index].velocity())
    }

    fn array<'py>(&self, py: Python<'py>) -> PyResult<&Bound<'py, PyAny>> {
        let array = self.actors.get_or_try_init(py, || {
            let owner: Arc<dyn Bytes> = Arc::clone(&self.snapshot) as _;
            let count = self.snapshot.states().len();
            ACTOR.array(py, owner, 0, &[count]).map(Bound::unbind)
        })?;
        Ok(array.bind(py))
    }
}

#[pymethods]
impl World {
    #[getter]
    fn frame(&self) -> u64 {
        self.snapshot.header.stamp.frame.0
    }

    #[getter]
    fn sim_time_nanos(&self) -> u64 {
        self.snapshot.header.stamp.sim_time_nanos
    }

    #[getter]
    fn sim_time_secs(&self) -> f64 {
        self.snapshot.header.stamp.sim_time_nanos as f64 * 1e-9
    }

    #[getter]
    fn delta_nanos(&self) -> u64 {
        self.snapshot.header.delta_nanos
    }

    #[getter]
    fn episode(&self) -> u32 {
        self.snapshot.header.stamp.episode
    }

    #[getter]
    fn state_hash(&self) -> u64 {
        self.snapshot.header.state_hash
    }

    #[getter]
    fn published_nanos(&self) -> u64 {
        self.snapshot.header.published_nanos
    }

    #[getter]
    fn is_view(&self) -> bool {
        matches!(self.snapshot.place, Place::View(..))
    }

    #[getter]
    fn actors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py).cloned()
    }

    fn actor<'py>(&self, py: Python<'py>, actor_id: u32) -> PyResult<Bound<'py, PyAny>> {
        let states = self.snapshot.states();
        let found = states.binary_search_by_key(&actor_id, |state| state.actor_id.0);
        let index = found.map_err(|_| {
            PyKeyError::new_err(format!(
                "actor {actor_id} does not exist at frame {}: it was not spawned yet, or was \
                 destroyed",
                self.frame()
            ))
        })?;
        self.array(py)?.get_item(index)
    }

    fn __contains__(&self, actor_id: u32) -> bool {
        let states = self.snapshot.states();
        states.binary_search_by_key(&actor_id, |state| state.actor_id.0).is_ok()
    }

    fn __len__(&self) -> usize {
        self.snapshot.states().len()
    }

    fn copy(&self) -> World {
        let Snapshot { header, .. } = *self.snapshot;
        let place = Place::Copy(Copied::new(self.snapshot.bytes()));
        World::new(Arc::new(Snapshot { header, place }))
    }

    #[classmethod]
    fn _from_bytes(_cls: &Bound<'_, PyType>, header: &[u8], actors: &[u8]) -> PyResult<World> {
        let is_whole = header.len() == size_of::<SnapshotHeader>()
            && actors.len().is_multiple_of(size_of::<ActorState>());
        if !is_whole {
            return Err(PyValueError::new_err(
                "the bytes are no World of this build; unpickle it with the package that pickled it",
            ));
        }
        let (header, place) = (pod_read_unaligned(header), Place::Copy(Copied::new(actors)));
        Ok(World::new(Arc::new(Snapshot { header, place })))
    }

    #[expect(clippy::type_complexity, reason = "what pickle asks for")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>, Bound<'py, PyBytes>))> {
        let (py, snapshot) = (slf.py(), &slf.get().snapshot);
        let header = PyBytes::new(py, bytes_of(&snapshot.header));
        let actors = PyBytes::new(py, snapshot.bytes());
        Ok((slf.get_type().getattr("_from_bytes")?, (header, actors)))
    }

    fn __repr__(&self) -> String {
        format!("World(frame={}, actors={})", self.frame(), self.__len__())
    }
}
