//! Which lamps a vehicle switches on by itself.
//!
//! When lamps are lit by day is what CARLA's traffic manager does (its `VehicleLightStage`).

use protocol::{VehicleControl, Weather, flag, lamp};

use crate::{
    tracks::{TURN_RAD, Tracks},
    vehicle_table::VehicleTable,
};

/// The sun stands so low when head lamps are lit, radians (15 degrees); and position lamps (35).
const DUSK_RAD: f32 = 0.262;
const LOW_SUN_RAD: f32 = 0.611;
/// Rain and fog that ask for lamps, out of 100.
const HEAVY_RAIN: f32 = 80.0;
const THICK_FOG: f32 = 20.0;
/// The pedal is down.
const BRAKES: f32 = 0.05;
/// Indicators are on so many seconds before a turn, and so many metres at least.
const INDICATE_S: f32 = 4.0;
const INDICATE_M: f32 = 25.0;

/// The lamps of a row's vehicle, which does this and drives `mps`: bits of [`lamp`].
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
    on | match bend(vehicles, row, tracks, mps) {
        bend if bend > 0.0 => lamp::LEFT_BLINKER,
        bend if bend < 0.0 => lamp::RIGHT_BLINKER,
        _ => 0,
    }
}

/// To which side it is about to go, or goes: positive to the left, 0 nowhere.
fn bend(vehicles: &VehicleTable, row: usize, tracks: &Tracks, mps: f32) -> f32 {
    if vehicles.shift_m[row] != 0.0 {
        // It began left of the lane that it changes to.
        return -vehicles.shift_m[row];
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
