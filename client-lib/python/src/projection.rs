//! The projection of a camera.

use client_lib::{
    SensorKind,
    glam::{Vec2, Vec3},
    wire::SensorSpec,
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::sensor::sensor;

#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Projection(client_lib::Projection);

#[pymethods]
impl Projection {
    #[new]
    fn new(camera: &Bound<'_, PyAny>) -> PyResult<Projection> {
        let camera_sensor = sensor(camera)?;
        if !matches!(camera_sensor.kind, SensorKind::Camera(_)) {
            return Err(PyValueError::new_err(format!("{camera} is no omnibus.sensors.Camera")));
        }
        let spec = SensorSpec::from(&camera_sensor);
        let name = camera_sensor.name;
        client_lib::Projection::check(&spec)
            .and_then(|()| client_lib::Projection::of(&spec))
            .map(Projection)
            .map_err(|why| PyValueError::new_err(format!("camera {name:?}: {why}")))
    }

    fn project(&self, point: [f32; 3]) -> Option<(f32, f32)> {
        let pixel = self.0.project(Vec3::from_array(point))?;
        Some((pixel.x, pixel.y))
    }

    fn unproject(&self, pixel: [f32; 2], depth_m: f32) -> Option<(f32, f32, f32)> {
        let point = self.0.unproject(Vec2::from_array(pixel), depth_m)?;
        Some((point.x, point.y, point.z))
    }

    #[getter]
    fn focal_px(&self) -> (f32, f32) {
        self.0.focal_px().map(|px| px as f32).into()
    }

    #[getter]
    fn center_px(&self) -> (f32, f32) {
        self.0.center_px().map(|px| px as f32).into()
    }
}
