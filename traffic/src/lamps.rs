//! Automatic vehicle lights.
//!
//! The conditions for lights by day are those of CARLA's traffic manager (its `VehicleLightStage`).

use protocol::{VehicleControl, Weather, flag, lamp};

use crate::{
    tracks::{TURN_RAD, Tracks},
    vehicle_table::VehicleTable,
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
    vehicles: &VehicleTable,
    row: usize,
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
    on | match turn_side(vehicles, row, tracks, mps) {
        turn_side if turn_side > 0.0 => lamp::LEFT_BLINKER,
        turn_side if turn_side < 0.0 => lamp::RIGHT_BLINKER,
        _ => 0,
    }
}

/// Returns the side to which the vehicle turns or changes lanes: positive left, negative right, 0
/// neither.
fn turn_side(vehicles: &VehicleTable, row: usize, tracks: &Tracks, mps: f32) -> f32 {
    if vehicles.shift_m[row] != 0.0 {
        // `shift_m` is where the change began, left of the lane that it goes to.
        return -vehicles.shift_m[row];
    }
    if vehicles.pass_left_m[row].abs() > PULLS_OUT_M {
        let (done_m, over_m) = (vehicles.pass_done_m[row], vehicles.pass_over_m[row]);
        if done_m < over_m {
            return vehicles.pass_left_m[row];
        }
        return if done_m < vehicles.pass_hold_m[row] { 0.0 } else { -vehicles.pass_left_m[row] };
    }
    if vehicles.u_turn[row] == 1 {
        return 1.0;
    }
    let reach_m = (INDICATE_S * mps).max(INDICATE_M);
    let mut begins_m = -vehicles.arc_m[row];
    for &lane in vehicles.route[row].lanes() {
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
