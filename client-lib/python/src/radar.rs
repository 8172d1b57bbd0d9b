//! Radars: what they make of the rays of their grid.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable, cast_slice};
use client_lib::{ActorId, Radar, RadarRays, RadarReceiver, glam::Vec3};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{
    array::{Bytes, ItemType},
    fields::Fields,
    storage::Copied,
};

/// A radar and its receiver, if it has one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Model {
    pub(crate) radar: Radar,
    pub(crate) receiver: Option<RadarReceiver>,
}

/// The numbers of a receiver, as pickle takes them.
type ReceiverNumbers = ([f32; 5], [f32; 3], bool);

/// The numbers of a radar, as pickle takes them.
pub(crate) type Numbers = ([f32; 2], f32, usize, u64, Option<ReceiverNumbers>);

impl Model {
    /// Reads `omnibus.sensors.Radar`.
    pub(crate) fn of(fields: &Fields<'_, '_>) -> PyResult<Model> {
        let radar = Radar {
            fov_rad: [fields.get("horizontal_fov_rad")?, fields.get("vertical_fov_rad")?],
            range_m: fields.get("range_m")?,
            points: fields.get("points")?,
            seed: fields.get("seed")?,
        };
        let given = fields.0.getattr("receiver")?;
        let receiver = if given.is_none() { None } else { Some(receiver(&Fields(&given))?) };
        radar
            .check()
            .and_then(|()| receiver.map_or(Ok(()), |receiver| receiver.check()))
            .map_err(|why| PyValueError::new_err(format!("{}: {why}", fields.0)))?;
        Ok(Model { radar, receiver })
    }

    pub(crate) fn numbers(&self) -> Numbers {
        let Radar { fov_rad, range_m, points, seed } = self.radar;
        let receiver = self.receiver.map(|one| {
            let powers = [
                one.frequency_hz,
                one.transmit_power_dbm,
                one.antenna_gain_db,
                one.noise_dbm,
                one.snr_min_db,
            ];
            (powers, one.cell, one.has_ghosts)
        });
        (fov_rad, range_m, points, seed, receiver)
    }

    pub(crate) fn from_numbers((fov_rad, range_m, points, seed, receiver): Numbers) -> Model {
        let receiver = receiver.map(|(powers, cell, has_ghosts)| {
            let [frequency_hz, transmit_power_dbm, antenna_gain_db, noise_dbm, snr_min_db] = powers;
            RadarReceiver {
                frequency_hz,
                transmit_power_dbm,
                antenna_gain_db,
                noise_dbm,
                snr_min_db,
                cell,
                has_ghosts,
            }
        });
        Model { radar: Radar { fov_rad, range_m, points, seed }, receiver }
    }
}

fn receiver(fields: &Fields<'_, '_>) -> PyResult<RadarReceiver> {
    if !fields.0.hasattr("frequency_hz")? {
        let given = fields.0;
        return Err(PyValueError::new_err(format!(
            "{given} is no receiver; use RadarReceiver of omnibus.sensors, or None"
        )));
    }
    Ok(RadarReceiver {
        frequency_hz: fields.get("frequency_hz")?,
        transmit_power_dbm: fields.get("transmit_power_dbm")?,
        antenna_gain_db: fields.get("antenna_gain_db")?,
        noise_dbm: fields.get("noise_dbm")?,
        snr_min_db: fields.get("snr_min_db")?,
        cell: fields.get("cell")?,
        has_ghosts: fields.get("has_ghosts")?,
    })
}

/// An item of `Reading.detections`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Detection {
    /// Range rate, azimuth, altitude, distance.
    numbers: [f32; 4],
    /// Instance and tag.
    label: [u32; 2],
}

static DETECTION: ItemType = ItemType::records(&[
    ("velocity_mps", "<f4", &[]),
    ("azimuth_rad", "<f4", &[]),
    ("altitude_rad", "<f4", &[]),
    ("depth_m", "<f4", &[]),
    ("instance", "<u4", &[]),
    ("tag", "<u4", &[]),
]);

/// An item of `Reading.targets`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Target {
    /// Range rate, azimuth, altitude, distance.
    numbers: [f32; 4],
    /// Instance and tag.
    label: [u32; 2],
    /// Power, ratio of signal to noise, cross-section.
    powers: [f32; 3],
    is_ghost: u32,
}

static TARGET: ItemType = ItemType::records(&[
    ("velocity_mps", "<f4", &[]),
    ("azimuth_rad", "<f4", &[]),
    ("altitude_rad", "<f4", &[]),
    ("depth_m", "<f4", &[]),
    ("instance", "<u4", &[]),
    ("tag", "<u4", &[]),
    ("power_dbm", "<f4", &[]),
    ("snr_db", "<f4", &[]),
    ("cross_section_dbsm", "<f4", &[]),
    ("is_ghost", "<u4", &[]),
]);

/// What a radar met at one frame.
pub(crate) struct Met<'a, V: Fn(ActorId) -> Vec3> {
    pub(crate) rays: RadarRays<'a>,
    pub(crate) time_nanos: u64,
    pub(crate) velocity_of: V,
    pub(crate) carrier: ActorId,
}

impl<V: Fn(ActorId) -> Vec3> Met<'_, V> {
    /// Returns the detections of a radar as an array.
    pub(crate) fn detections<'py>(
        &self,
        py: Python<'py>,
        radar: &Radar,
    ) -> PyResult<Bound<'py, PyAny>> {
        let RadarRays { plane, points, labels, .. } = self.rays;
        let found = radar.detections(
            self.time_nanos,
            plane,
            points,
            labels,
            &self.velocity_of,
            self.carrier,
        );
        let items: Vec<_> = found
            .map(|(one, label)| Detection {
                numbers: [one.velocity_mps, one.azimuth_rad, one.altitude_rad, one.depth_m],
                label,
            })
            .collect();
        array(py, &DETECTION, &items)
    }

    /// Returns the targets of a receiver as an array.
    pub(crate) fn targets<'py>(
        &self,
        py: Python<'py>,
        receiver: &RadarReceiver,
    ) -> PyResult<Bound<'py, PyAny>> {
        let found = receiver.targets(self.rays, &self.velocity_of, self.carrier);
        let items: Vec<_> = found
            .iter()
            .map(|one| Target {
                numbers: [one.velocity_mps, one.azimuth_rad, one.altitude_rad, one.depth_m],
                label: one.label,
                powers: [one.power_dbm, one.snr_db, one.cross_section_dbsm],
                is_ghost: one.is_ghost.into(),
            })
            .collect();
        array(py, &TARGET, &items)
    }
}

impl Bytes for Copied {
    fn bytes(&self) -> &[u8] {
        Copied::bytes(self)
    }
}

fn array<'py, T: Pod>(
    py: Python<'py>,
    kind: &ItemType,
    items: &[T],
) -> PyResult<Bound<'py, PyAny>> {
    kind.array(py, Arc::new(Copied::new(cast_slice(items))), 0, &[items.len()])
}
