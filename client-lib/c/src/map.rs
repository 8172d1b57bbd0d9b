//! The map: where vehicles can be spawned, and where a lane leads.
#![expect(unsafe_code, reason = "names of C functions")]

use std::mem::MaybeUninit;

use client_lib::{
    glam::Vec3,
    road::{LanePoint, LaneTypes, Network},
};

use crate::{
    argument::{fill, place, values},
    client::{OmnibusClient, enter},
    status::{Fault, OmnibusStatus, call},
    world::OmnibusPose,
};

/// The most points of one call of omnibus_lane_ahead().
pub const OMNIBUS_LANE_POINTS_MAX: usize = 10000;

/// Writes up to `capacity` poses for vehicles, half a metre above the road, to `poses`, and the
/// number of all to `*count`. With a capacity of 0, `poses` may be NULL.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_spawn_points(
    client: Option<&OmnibusClient>,
    poses: *mut MaybeUninit<OmnibusPose>,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> OmnibusStatus {
    call("omnibus_spawn_points", || {
        let place = place(count, "count")?;
        let points = enter(client)?.spawn_points()?;
        let points: Vec<_> = points.into_iter().map(OmnibusPose::from).collect();
        fill(poses, "poses", capacity, &points)?;
        place.write(points.len());
        Ok(())
    })
}

/// Writes up to `capacity` poses on the centre of the driving lane that is nearest to
/// `position_m` (three numbers, world space, metres): the first abeam of it, then every `spacing_m`
/// metres in driving direction, x along the lane. Where lanes fork, the first branch; fewer than
/// `capacity` where the lane ends. `*count` is the number written. The first call reads the map.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_lane_ahead(
    client: Option<&OmnibusClient>,
    position_m: *const f32,
    spacing_m: f64,
    poses: *mut MaybeUninit<OmnibusPose>,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> OmnibusStatus {
    call("omnibus_lane_ahead", || {
        let place = place(count, "count")?;
        let position = Vec3::from_slice(values(position_m, "position_m", 3)?);
        if !position.is_finite() {
            return Err(Fault::argument(format!("position_m is {position}, not finite")));
        }
        if !(0.01..=1000.0).contains(&spacing_m) {
            return Err(Fault::argument(format!("spacing_m is {spacing_m}, not 0.01 to 1000")));
        }
        if capacity > OMNIBUS_LANE_POINTS_MAX {
            return Err(Fault::argument(format!(
                "capacity is {capacity}, more than OMNIBUS_LANE_POINTS_MAX, \
                 {OMNIBUS_LANE_POINTS_MAX}"
            )));
        }
        let network = enter(client)?.map()?;
        let lane = network.nearest(position.as_dvec3(), LaneTypes::DRIVABLE);
        let points: Vec<_> = ahead(&network, lane, spacing_m).take(capacity).collect();
        fill(poses, "poses", capacity, &points)?;
        place.write(points.len());
        Ok(())
    })
}

/// The points from one on, as poses.
fn ahead(
    network: &Network,
    from: Option<LanePoint>,
    spacing_m: f64,
) -> impl Iterator<Item = OmnibusPose> {
    let next = move |at: &LanePoint| network.advance(*at, spacing_m).first().copied();
    std::iter::successors(from, next).map(|at| {
        let place = network.place(at);
        OmnibusPose {
            position_m: place.position.as_vec3().to_array(),
            rotation_xyzw: place.rotation().as_quat().to_array(),
        }
    })
}
