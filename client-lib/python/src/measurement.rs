//! What a bundle measured at one frame, as arrays over the renderer's memory.

use std::sync::Arc;

use bytemuck::{Pod, bytes_of, cast_slice, pod_read_unaligned};
use client_lib::{
    ActorId, KeypointView, LidarOutputs, Projection, Radar, RadarRays,
    glam::Vec3,
    wire::{BundleHeader, Plane, SensorSpec, output, sensor},
};
use pyo3::{
    exceptions::{PyAttributeError, PyKeyError, PyValueError},
    prelude::*,
    types::{PyBytes, PyType},
};

use crate::{
    array::{Bytes, F32, ItemType, U8, U32},
    owned::Owned,
    pose, radar,
    storage::{Copied, Held},
    world::World,
};

enum Place {
    View(Owned<client_lib::Measurement>, #[expect(dead_code, reason = "held for its drop")] Held),
    Copy(Copied),
}

/// A measurement, and where it lies.
pub(crate) struct Data {
    header: BundleHeader,
    sensors: Arc<[SensorSpec]>,
    /// By sensor; `None` for those that are no radars.
    radars: Arc<[Option<radar::Model>]>,
    place: Place,
}

impl Data {
    pub(crate) fn view(
        measured: client_lib::Measurement,
        sensors: Arc<[SensorSpec]>,
        radars: Arc<[Option<radar::Model>]>,
        held: Held,
    ) -> Data {
        let header = *measured.header();
        Data { header, sensors, radars, place: Place::View(Owned::new(measured), held) }
    }

    pub(crate) fn copy(
        measured: &client_lib::Measurement,
        sensors: Arc<[SensorSpec]>,
        radars: Arc<[Option<radar::Model>]>,
    ) -> Data {
        let header = *measured.header();
        let used = &measured.bytes()[..header.byte_len as usize];
        Data { header, sensors, radars, place: Place::Copy(Copied::new(used)) }
    }

    pub(crate) fn frame(&self) -> u64 {
        self.header.stamp.frame.0
    }

    fn planes(&self) -> &[Plane] {
        cast_slice(&self.bytes()[..self.header.plane_count as usize * size_of::<Plane>()])
    }
}

impl Bytes for Data {
    fn bytes(&self) -> &[u8] {
        match &self.place {
            Place::View(measured, _) => &measured.read().bytes()[..self.header.byte_len as usize],
            Place::Copy(copied) => copied.bytes(),
        }
    }
}

/// A sensor's name, or its index in the bundle.
#[derive(FromPyObject)]
pub(crate) enum Key {
    Name(String),
    Index(usize),
}

#[pyclass(frozen, module = "omnibus")]
pub(crate) struct Measurement {
    pub(crate) data: Arc<Data>,
}

impl Measurement {
    fn index(&self, key: &Key) -> PyResult<usize> {
        let sensors = &self.data.sensors;
        let found = match key {
            Key::Name(name) => sensors.iter().position(|sensor| sensor.name.as_str() == name),
            Key::Index(index) => Some(*index).filter(|index| *index < sensors.len()),
        };
        found.ok_or_else(|| {
            let key = match key {
                Key::Name(name) => format!("{name:?}"),
                Key::Index(index) => index.to_string(),
            };
            let names = self.keys().join(", ");
            PyKeyError::new_err(format!("no sensor {key} in this bundle; it has {names}"))
        })
    }

    fn reading(&self, index: usize) -> Option<Reading> {
        // Without an event there is no plane.
        let kind = self.data.sensors[index].kind;
        let is_there = matches!(kind, sensor::COLLISION | sensor::LANE_INVASION | sensor::OBSTACLE)
            || self.data.planes().iter().any(|plane| plane.sensor as usize == index);
        is_there.then(|| Reading { data: Arc::clone(&self.data), index })
    }
}

#[pymethods]
impl Measurement {
    #[getter]
    fn frame(&self) -> u64 {
        self.data.frame()
    }

    #[getter]
    fn sim_time_nanos(&self) -> u64 {
        self.data.header.stamp.sim_time_nanos
    }

    #[getter]
    fn episode(&self) -> u32 {
        self.data.header.stamp.episode
    }

    #[getter]
    fn state_hash(&self) -> u64 {
        self.data.header.state_hash
    }

    #[getter]
    fn parent(&self) -> Option<u32> {
        Some(self.data.header.parent).filter(|parent| *parent != ActorId::NONE).map(|id| id.0)
    }

    #[getter]
    fn world_from_parent<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        pose::object(py, &self.data.header.world_from_parent)
    }

    #[getter]
    fn is_view(&self) -> bool {
        matches!(self.data.place, Place::View(..))
    }

    #[getter]
    fn nbytes(&self) -> u64 {
        self.data.header.byte_len
    }

    fn keys(&self) -> Vec<String> {
        self.data.sensors.iter().map(|sensor| sensor.name.to_string()).collect()
    }

    fn get(&self, key: Key) -> PyResult<Option<Reading>> {
        Ok(self.reading(self.index(&key)?))
    }

    fn __getitem__(&self, key: Key) -> PyResult<Reading> {
        let index = self.index(&key)?;
        self.reading(index).ok_or_else(|| {
            PyKeyError::new_err(format!(
                "sensor {:?} did not measure at frame {}: its period is longer; get() returns None \
                 then",
                self.data.sensors[index].name.as_str(),
                self.frame()
            ))
        })
    }

    fn __contains__(&self, key: Key) -> bool {
        self.index(&key).is_ok_and(|index| self.reading(index).is_some())
    }

    fn __len__(&self) -> usize {
        self.data.sensors.len()
    }

    fn copy(&self) -> Measurement {
        let Data { header, ref sensors, ref radars, .. } = *self.data;
        let (sensors, radars) = (Arc::clone(sensors), Arc::clone(radars));
        let place = Place::Copy(Copied::new(self.data.bytes()));
        Measurement { data: Arc::new(Data { header, sensors, radars, place }) }
    }

    #[classmethod]
    #[pyo3(signature = (header, sensors, bytes, radars=Vec::new()))]
    fn _from_bytes(
        _cls: &Bound<'_, PyType>,
        header: &[u8],
        sensors: &[u8],
        bytes: &[u8],
        radars: Vec<Option<radar::Numbers>>,
    ) -> PyResult<Measurement> {
        let refuse = || {
            PyValueError::new_err(
                "the bytes are no Measurement of this build; unpickle it with the package that \
                 pickled it",
            )
        };
        if header.len() != size_of::<BundleHeader>()
            || sensors.len() != radars.len() * size_of::<SensorSpec>()
        {
            return Err(refuse());
        }
        let header: BundleHeader = pod_read_unaligned(header);
        let table = u64::from(header.plane_count) * size_of::<Plane>() as u64;
        if header.byte_len != bytes.len() as u64 || table > header.byte_len {
            return Err(refuse());
        }
        let sensors = sensors.chunks_exact(size_of::<SensorSpec>()).map(pod_read_unaligned);
        let radars = radars.into_iter().map(|numbers| numbers.map(radar::Model::from_numbers));
        let data = Data {
            header,
            sensors: sensors.collect(),
            radars: radars.collect(),
            place: Place::Copy(Copied::new(bytes)),
        };
        let fits = |plane: &Plane| {
            (plane.sensor as usize) < data.sensors.len()
                && plane
                    .offset
                    .checked_add(plane.byte_len)
                    .is_some_and(|end| end <= header.byte_len)
        };
        if !data.planes().iter().all(fits) {
            return Err(refuse());
        }
        Ok(Measurement { data: Arc::new(data) })
    }

    #[expect(clippy::type_complexity, reason = "what pickle asks for")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(
        Bound<'py, PyAny>,
        (
            Bound<'py, PyBytes>,
            Bound<'py, PyBytes>,
            Bound<'py, PyBytes>,
            Vec<Option<radar::Numbers>>,
        ),
    )> {
        let (py, data) = (slf.py(), &slf.get().data);
        let header = PyBytes::new(py, bytes_of(&data.header));
        let sensors = PyBytes::new(py, cast_slice(&data.sensors));
        let bytes = PyBytes::new(py, data.bytes());
        let radars = data.radars.iter().map(|model| model.map(|model| model.numbers())).collect();
        Ok((slf.get_type().getattr("_from_bytes")?, (header, sensors, bytes, radars)))
    }

    fn __repr__(&self) -> String {
        format!("Measurement(frame={}, sensors={:?})", self.frame(), self.keys())
    }
}

static IMU: ItemType = ItemType::records(&[
    ("accelerometer_mps2", "<f4", &[3]),
    ("gyroscope_radps", "<f4", &[3]),
    ("compass_rad", "<f4", &[]),
    ("over_secs", "<f4", &[]),
]);
static GNSS: ItemType = ItemType::records(&[
    ("latitude_deg", "<f8", &[]),
    ("longitude_deg", "<f8", &[]),
    ("altitude_m", "<f8", &[]),
]);
static ODOMETRY: ItemType = ItemType::records(&[
    ("speed_mps", "<f4", &[]),
    ("wheel_speed_mps", "<f4", &[]),
    ("yaw_rate_radps", "<f4", &[]),
    ("steer_rad", "<f4", &[]),
    ("distance_m", "<f8", &[]),
]);
static COLLISION: ItemType = ItemType::records(&[
    ("other", "<u4", &[]),
    ("object", "<u4", &[]),
    ("tag", "<u4", &[]),
    ("began", "<u4", &[]),
    ("impulse_ns", "<f4", &[3]),
]);
static LANE_INVASION: ItemType = ItemType::records(&[
    ("kind", "<u4", &[]),
    ("color", "<u4", &[]),
    ("change", "<u4", &[]),
    ("width_m", "<f4", &[]),
    ("corner", "<u4", &[]),
    ("to_left", "<u4", &[]),
    ("from_lane", "<u4", &[]),
    ("from_lane_id", "<i4", &[]),
]);
static OBSTACLE: ItemType = ItemType::records(&[
    ("other", "<u4", &[]),
    ("object", "<u4", &[]),
    ("tag", "<u4", &[]),
    ("distance_m", "<f4", &[]),
]);

/// The type of the records of a physics sensor, and their size in bytes.
fn records(output: u32) -> Option<(&'static ItemType, usize)> {
    Some(match output {
        output::IMU => (&IMU, size_of::<client_lib::wire::ImuReading>()),
        output::GNSS => (&GNSS, size_of::<client_lib::wire::GnssReading>()),
        output::ODOMETRY => (&ODOMETRY, size_of::<client_lib::wire::OdometryReading>()),
        output::COLLISION => (&COLLISION, size_of::<client_lib::wire::CollisionReading>()),
        output::LANE_INVASION => {
            (&LANE_INVASION, size_of::<client_lib::wire::LaneInvasionReading>())
        }
        output::OBSTACLE => (&OBSTACLE, size_of::<client_lib::wire::ObstacleReading>()),
        _ => return None,
    })
}

#[pyclass(frozen, module = "omnibus")]
pub(crate) struct Reading {
    data: Arc<Data>,
    index: usize,
}

impl Reading {
    fn plane(&self, is_it: impl Fn(&Plane) -> bool) -> Option<&Plane> {
        self.data.planes().iter().find(|p| p.sensor as usize == self.index && is_it(p))
    }

    /// An output of `channels` numbers per pixel or ray; 0: one number, without an axis of its own.
    fn array<'py>(
        &self,
        py: Python<'py>,
        what: &str,
        output: u32,
        kind: &ItemType,
        channels: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let plane = self.plane(|plane| plane.output == output).ok_or_else(|| {
            PyAttributeError::new_err(format!(
                "sensor {:?} does not measure {what}; add it to the sensor's outputs",
                self.name()
            ))
        })?;
        let (width, height) = (plane.width as usize, plane.height as usize);
        let is_lidar = output & LidarOutputs::all().bits() != 0;
        let shape = if is_lidar { [width, height, channels] } else { [height, width, channels] };
        let shape = if channels == 0 { &shape[..2] } else { &shape[..] };
        kind.array(py, Arc::clone(&self.data) as _, plane.offset as usize, shape)
    }

    /// The plane and the values of an output, if the sensor measured it.
    fn values<T: Pod>(&self, output: u32) -> Option<(&Plane, &[T])> {
        let plane = self.plane(|plane| plane.output == output)?;
        let bytes = &self.data.bytes()[plane.offset as usize..][..plane.byte_len as usize];
        Some((plane, cast_slice(bytes)))
    }

    /// Calls `look` with the images of a camera that say what it shows.
    pub(crate) fn with_keypoint_view<T>(
        &self,
        look: impl FnOnce(&KeypointView<'_>) -> T,
    ) -> PyResult<T> {
        let spec = &self.data.sensors[self.index];
        if spec.kind != sensor::CAMERA {
            let why = format!("sensor {:?} is no camera", self.name());
            return Err(PyAttributeError::new_err(why));
        }
        let (plane, instances) = self.values(output::INSTANCE).ok_or_else(|| {
            PyAttributeError::new_err(format!(
                "sensor {:?} does not measure instances; add it to the sensor's outputs",
                self.name()
            ))
        })?;
        let projection = Projection::of(spec).map_err(PyValueError::new_err)?;
        Ok(look(&KeypointView {
            projection: &projection,
            world_from_sensor: plane.world_from_sensor,
            size_px: [plane.width, plane.height],
            instances,
            depth: self.values(output::DEPTH).map(|(_, depth)| depth),
        }))
    }

    fn radar(&self) -> PyResult<&radar::Model> {
        self.data.radars[self.index].as_ref().ok_or_else(|| {
            PyAttributeError::new_err(format!("sensor {:?} is no radar", self.name()))
        })
    }

    /// What a radar met, with the velocities of `world`.
    fn met<'a>(
        &'a self,
        radar: &Radar,
        world: &'a World,
    ) -> PyResult<radar::Met<'a, impl Fn(ActorId) -> Vec3 + 'a>> {
        let header = &self.data.header;
        if world.stamp() != header.stamp {
            return Err(PyValueError::new_err(format!(
                "the world is at frame {}, the reading of frame {}; use both of one tick",
                world.stamp().frame.0,
                header.stamp.frame.0
            )));
        }
        let (points, labels) = (self.values(output::POINTS), self.values(output::LABELS));
        let (Some((plane, points)), Some((_, labels))) = (points, labels) else {
            let why = format!("sensor {:?} did not measure at this frame", self.name());
            return Err(PyAttributeError::new_err(why));
        };
        Ok(radar::Met {
            rays: RadarRays { plane, fov_rad: radar.fov_rad, points, labels },
            time_nanos: header.stamp.sim_time_nanos,
            velocity_of: |id| world.velocity_of(id),
            carrier: header.parent,
        })
    }
}

#[pymethods]
impl Reading {
    #[getter]
    fn name(&self) -> &str {
        self.data.sensors[self.index].name.as_str()
    }

    #[getter]
    fn frame(&self) -> u64 {
        self.data.frame()
    }

    #[getter]
    fn world_from_sensor<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let plane = self.plane(|_| true);
        plane.map(|plane| pose::object(py, &plane.world_from_sensor)).transpose()
    }

    #[getter]
    fn first_azimuth_rad(&self) -> Option<f32> {
        self.plane(|plane| plane.output == output::POINTS).map(|plane| plane.first_azimuth_rad)
    }

    #[getter]
    fn color<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "color", output::COLOR, &U8, 4)
    }

    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "depth", output::DEPTH, &F32, 0)
    }

    #[getter]
    fn tags<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "tags", output::TAG, &U8, 0)
    }

    #[getter]
    fn instances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "instances", output::INSTANCE, &U32, 0)
    }

    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "normals", output::NORMAL, &F32, 3)
    }

    #[getter]
    fn flow<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "flow", output::FLOW, &F32, 2)
    }

    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "points", output::POINTS, &F32, 4)
    }

    #[getter]
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "labels", output::LABELS, &U32, 2)
    }

    #[getter]
    fn last_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "last_points", output::LAST_POINTS, &F32, 4)
    }

    #[getter]
    fn last_labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "last_labels", output::LAST_LABELS, &U32, 2)
    }

    /// Radar: what it detected in its random directions.
    fn detections<'py>(&self, py: Python<'py>, world: &World) -> PyResult<Bound<'py, PyAny>> {
        let radar = &self.radar()?.radar;
        self.met(radar, world)?.detections(py, radar)
    }

    /// Radar with a receiver: the cells that it detected.
    fn targets<'py>(&self, py: Python<'py>, world: &World) -> PyResult<Bound<'py, PyAny>> {
        let radar::Model { radar, receiver } = self.radar()?;
        let receiver = receiver.as_ref().ok_or_else(|| {
            PyAttributeError::new_err(format!(
                "radar {:?} has no receiver; set it when the radar is created",
                self.name()
            ))
        })?;
        self.met(radar, world)?.targets(py, receiver)
    }

    #[getter]
    fn readings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Some((kind, item)) = records(self.data.sensors[self.index].outputs) else {
            return Err(PyAttributeError::new_err(format!(
                "sensor {:?} gives images or points, not readings; use color, depth, points and \
                 their siblings",
                self.name()
            )));
        };
        let (offset, bytes) = self.plane(|_| true).map_or((0, 0), |p| (p.offset, p.byte_len));
        kind.array(py, Arc::clone(&self.data) as _, offset as usize, &[bytes as usize / item])
    }

    /// The measurement's item of this sensor.
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Measurement, usize))> {
        let Reading { data, index } = slf.get();
        let getitem = slf.py().import("operator")?.getattr("getitem")?;
        Ok((getitem, (Measurement { data: Arc::clone(data) }, *index)))
    }

    fn __repr__(&self) -> String {
        format!("Reading({:?}, frame={})", self.name(), self.frame())
    }
}
