//! The settings of an episode, in CARLA's terms.

use client_lib::wire::Settings;

use crate::{
    args::{Args, RpcError},
    msgpack::Pack,
};

/// CARLA's episode settings. Those without a counterpart on the bus are stored and returned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EpisodeSettings {
    pub(crate) is_synchronous: bool,
    pub(crate) no_rendering: bool,
    /// Simulated seconds of a tick; `None`: the server chooses.
    pub(crate) fixed_delta_secs: Option<f64>,
    substepping: bool,
    substep_max_secs: f64,
    substeps_max: i64,
    culling_distance_m: f32,
    deterministic_ragdolls: bool,
    tile_stream_distance_m: f32,
    actor_active_distance_m: f32,
    spectator_as_ego: bool,
}

/// The length of a tick without a fixed delta. Nanoseconds.
const DELTA_NANOS: u64 = 50_000_000;

impl EpisodeSettings {
    /// Returns the settings of a client that has set none.
    pub(crate) fn of(bus: &Settings) -> EpisodeSettings {
        let is_synchronous = bus.synchronous != 0;
        EpisodeSettings {
            is_synchronous,
            no_rendering: bus.no_rendering != 0,
            fixed_delta_secs: is_synchronous.then_some(bus.delta_nanos as f64 * 1e-9),
            substepping: true,
            substep_max_secs: bus.substep_max_nanos as f64 * 1e-9,
            substeps_max: 10,
            culling_distance_m: 0.0,
            deterministic_ragdolls: true,
            tile_stream_distance_m: 3000.0,
            actor_active_distance_m: 2000.0,
            spectator_as_ego: true,
        }
    }

    /// Takes over what other clients of the bus have changed.
    pub(crate) fn follow(&mut self, bus: &Settings) {
        self.is_synchronous = bus.synchronous != 0;
        self.no_rendering = bus.no_rendering != 0;
        if self.fixed_delta_secs.is_some() {
            self.fixed_delta_secs = Some(bus.delta_nanos as f64 * 1e-9);
        }
    }

    /// Converts the settings for the bus. The pace of an asynchronous world stays as it is.
    ///
    /// # Errors
    ///
    /// Returns an error if the fixed delta is out of range.
    pub(crate) fn to_bus(self, now: &Settings) -> Result<Settings, RpcError> {
        let nanos = |secs: f64| (secs * 1e9).round() as u64;
        let mut delta_nanos = DELTA_NANOS;
        if let Some(secs) = self.fixed_delta_secs.filter(|secs| *secs > 0.0) {
            if !(1e-4..=10.0).contains(&secs) {
                return Err(format!("fixed_delta_seconds is {secs}, must be 0.0001 to 10").into());
            }
            delta_nanos = nanos(secs);
        }
        let substep_max_nanos = if self.substepping {
            nanos(self.substep_max_secs.clamp(1e-4, 0.1))
        } else {
            delta_nanos.min(100_000_000)
        };
        Ok(Settings {
            synchronous: self.is_synchronous.into(),
            no_rendering: self.no_rendering.into(),
            delta_nanos,
            substep_max_nanos,
            ..*now
        })
    }

    pub(crate) fn read(args: &mut Args) -> Result<EpisodeSettings, RpcError> {
        let mut f = args.list()?;
        Ok(EpisodeSettings {
            is_synchronous: f.bool()?,
            no_rendering: f.bool()?,
            fixed_delta_secs: f.optional()?.map(|mut v| v.f64()).transpose()?,
            substepping: f.bool()?,
            substep_max_secs: f.f64()?,
            substeps_max: f.int()?,
            culling_distance_m: f.f32()?,
            deterministic_ragdolls: f.bool()?,
            tile_stream_distance_m: f.f32()?,
            actor_active_distance_m: f.f32()?,
            spectator_as_ego: f.bool()?,
        })
    }

    pub(crate) fn write(&self, out: &mut Pack) {
        out.list(11).bool(self.is_synchronous).bool(self.no_rendering);
        match self.fixed_delta_secs {
            Some(secs) => out.list(2).bool(true).f64(secs),
            None => out.list(1).bool(false),
        };
        out.bool(self.substepping).f64(self.substep_max_secs).int(self.substeps_max);
        out.f32(self.culling_distance_m).bool(self.deterministic_ragdolls);
        out.f32(self.tile_stream_distance_m).f32(self.actor_active_distance_m);
        out.bool(self.spectator_as_ego);
    }
}
