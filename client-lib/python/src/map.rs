//! The road network of the running map.

use std::sync::Arc;

use client_lib::{
    Pose,
    glam::DVec3,
    road::{self, LaneIndex, LaneTypes, Network},
    spawn_poses,
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::pose;

/// A Python tuple of three numbers.
type Vector = (f64, f64, f64);

#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Map {
    pub(crate) network: Arc<Network>,
}

#[pymethods]
impl Map {
    #[getter]
    fn name(&self) -> &str {
        &self.network.header().name
    }

    #[getter]
    fn spawn_points<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let poses = py.detach(|| spawn_poses(&self.network));
        poses.iter().map(|pose| pose::object(py, pose)).collect()
    }

    /// Smallest and largest coordinates of the roads, metres.
    #[getter]
    fn bounds_m(&self) -> (Vector, Vector) {
        let (low, high) = self.network.bounds();
        (low.into(), high.into())
    }

    #[pyo3(signature = (position_m, *, drivable=true))]
    fn nearest(&self, position_m: [f64; 3], drivable: bool) -> Option<LanePoint> {
        let types = if drivable { LaneTypes::DRIVABLE } else { LaneTypes::ANY };
        let at = self.network.nearest(DVec3::from_array(position_m), types)?;
        Some(LanePoint { network: Arc::clone(&self.network), at })
    }

    /// Points every `every_m` metres along the shortest way; none if there is no way.
    fn route(
        &self,
        py: Python<'_>,
        from_point: &LanePoint,
        to_point: &LanePoint,
        every_m: f64,
    ) -> PyResult<Vec<LanePoint>> {
        if !(every_m.is_finite() && every_m > 0.0) {
            return Err(PyValueError::new_err(format!("every_m is {every_m}, not above 0")));
        }
        for point in [from_point, to_point] {
            if !Arc::ptr_eq(&point.network, &self.network) {
                return Err(PyValueError::new_err(
                    "a lane point is of another map; find it with nearest() of this one",
                ));
            }
        }
        let route = py.detach(|| self.network.route(from_point.at, to_point.at));
        let points = route.map(|route| route.points(every_m)).unwrap_or_default();
        Ok(points.into_iter().map(|at| from_point.beside(at)).collect())
    }

    fn __repr__(&self) -> String {
        format!("Map({:?})", self.name())
    }
}

#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct LanePoint {
    network: Arc<Network>,
    at: road::LanePoint,
}

impl LanePoint {
    fn lane(&self) -> &road::Lane {
        self.network.lane(self.at.lane)
    }

    fn beside(&self, at: road::LanePoint) -> LanePoint {
        LanePoint { network: Arc::clone(&self.network), at }
    }

    fn neighbour(&self, lane: Option<LaneIndex>) -> Option<LanePoint> {
        let lane = lane?;
        let neighbour = self.network.lane(lane);
        let is_same_way = neighbour.forward == self.lane().forward;
        let share = self.at.along_m / self.lane().length_m.max(1e-9);
        let share = if is_same_way { share } else { 1.0 - share };
        Some(self.beside(road::LanePoint { lane, along_m: share * neighbour.length_m }))
    }
}

#[pymethods]
impl LanePoint {
    #[getter]
    fn road_id(&self) -> &str {
        &self.network.road_space(self.at).0.id
    }

    #[getter]
    fn section(&self) -> usize {
        self.network.road_space(self.at).1
    }

    #[getter]
    fn lane_id(&self) -> i32 {
        self.network.road_space(self.at).2
    }

    #[getter]
    fn s_m(&self) -> f64 {
        self.network.road_space(self.at).3
    }

    #[getter]
    fn lane_type(&self) -> &'static str {
        self.lane().kind.text()
    }

    #[getter]
    fn is_junction(&self) -> bool {
        self.lane().junction.is_some()
    }

    #[getter]
    fn width_m(&self) -> f64 {
        self.network.width(self.at)
    }

    #[getter]
    fn speed_limit_mps(&self) -> Option<f64> {
        self.lane().speed_limit_mps
    }

    #[getter]
    fn curvature_per_m(&self) -> f64 {
        self.network.place(self.at).curvature_per_m
    }

    #[getter]
    fn position_m(&self) -> Vector {
        self.network.place(self.at).position.into()
    }

    #[getter]
    fn heading_rad(&self) -> f64 {
        self.network.place(self.at).heading_rad
    }

    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let place = self.network.place(self.at);
        pose::object(py, &Pose::new(place.position.as_vec3(), place.rotation().as_quat()))
    }

    fn advance(&self, distance_m: f64) -> Vec<LanePoint> {
        let points = self.network.advance(self.at, distance_m);
        points.into_iter().map(|at| self.beside(at)).collect()
    }

    #[getter]
    fn left(&self) -> Option<LanePoint> {
        self.neighbour(self.lane().left)
    }

    #[getter]
    fn right(&self) -> Option<LanePoint> {
        self.neighbour(self.lane().right)
    }

    fn __repr__(&self) -> String {
        let (road, _, lane_id, s_m) = self.network.road_space(self.at);
        format!("LanePoint(road_id={:?}, lane_id={lane_id}, s_m={s_m:.2})", road.id)
    }
}
