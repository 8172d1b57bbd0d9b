//! Automatic vehicle lights.
//!
//! The conditions for lights by day are those of CARLA's traffic manager (its `VehicleLightStage`).

use protocol::{VehicleControl, Weather, flag, lamp};

use crate::{
    tracks::{TURN_RAD, Tracks},
    vehicle_table::Vehicle,
};

/// Sun altitude below which the low beam is on, radians (15 degrees).
const DUSK_RAD: f32 = 0.262;
/// Sun altitude below which the position lights are on, radians (35 degrees).
const LOW_SUN_RAD: f32 = 0.611;
/// Precipitation above which lights are on, percent.
const HEAVY_RAIN: f32 = 80.0;
/// Fog density above which lights are on, percent.
const THICK_FOG: f32 = 20.0;
/// Brake pedal position above which brake lights are on.
const BRAKES: f32 = 0.05;
/// Time before a turn at which the indicator is switched on.
const INDICATE_S: f32 = 4.0;
/// Least distance before a turn at which the indicator is switched on.
const INDICATE_M: f32 = 25.0;

/// Lateral offset beside a prop from which a vehicle indicates that it pulls out and returns.
const PULLS_OUT_M: f32 = 1.2;

/// Returns the lights of the vehicle of a row as bits of [`lamp`]; `mps` is its speed.
pub(crate) fn lamps(
    vehicle: &Vehicle,
    tracks: &Tracks,
    weather: &Weather,
    control: &VehicleControl,
    mps: f32,
) -> u32 {
    let mut on = 0;
    let fog = weather.fog_density > THICK_FOG;
    if weather.sun_altitude_rad < DUSK_RAD || weather.precipitation > HEAVY_RAIN || fog {
        on |= lamp::POSITION | lamp::LOW_BEAM;
    } else if weather.sun_altitude_rad < LOW_SUN_RAD {
        on |= lamp::POSITION;
    }
    if fog {
        on |= lamp::FOG;
    }
    if control.brake > BRAKES {
        on |= lamp::BRAKE;
    }
    if control.flags & flag::REVERSE != 0 {
        on |= lamp::REVERSE;
    }
    on | match turn_side(vehicle, tracks, mps) {
        turn_side if turn_side > 0.0 => lamp::LEFT_BLINKER,
        turn_side if turn_side < 0.0 => lamp::RIGHT_BLINKER,
        _ => 0,
    }
}

/// Returns the side to which the vehicle turns or changes lanes: positive left, negative right, 0
/// neither.
fn turn_side(vehicle: &Vehicle, tracks: &Tracks, mps: f32) -> f32 {
    if vehicle.shift_m != 0.0 {
        // `shift_m` is where the change began, left of the lane that it goes to.
        return -vehicle.shift_m;
    }
    if vehicle.pass_left_m.abs() > PULLS_OUT_M {
        let (done_m, over_m) = (vehicle.pass_done_m, vehicle.pass_over_m);
        if done_m < over_m {
            return vehicle.pass_left_m;
        }
        return if done_m < vehicle.pass_hold_m { 0.0 } else { -vehicle.pass_left_m };
    }
    if vehicle.u_turn == 1 {
        return 1.0;
    }
    let reach_m = (INDICATE_S * mps).max(INDICATE_M);
    let mut begins_m = -vehicle.arc_m;
    for &lane in vehicle.route.lanes() {
        if begins_m > reach_m {
            return 0.0;
        }
        if tracks.in_junction(lane) {
            let turn = tracks.turn_rad(lane);
            return if turn.abs() > TURN_RAD { turn } else { 0.0 };
        }
        begins_m += tracks.length(lane);
    }
    0.0
}
