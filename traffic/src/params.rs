//! Traffic parameters that clients set.

use bytemuck::Zeroable;
use protocol::{ActorId, TrafficParam, param};

use crate::random::{Purpose, mixed, unit};

/// Default gap at standstill, metres (the IDM's s0).
pub(crate) const GAP_M: f32 = 2.0;

/// All parameters that were set, sorted by actor and parameter; actor 0 stands for all vehicles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Params {
    values: Vec<TrafficParam>,
}

impl Params {
    /// Sets one parameter. Values that are not finite are ignored.
    pub(crate) fn set(&mut self, param: TrafficParam) {
        if !param.value.is_finite() {
            return;
        }
        if let Some(other) = param::displaces(param.param) {
            self.remove(param.actor_id.0, other);
        }
        let key = (param.actor_id, param.param);
        match self.values.binary_search_by_key(&key, |d| (d.actor_id, d.param)) {
            Ok(at) => self.values[at] = param,
            Err(at) => self.values.insert(at, param),
        }
    }

    /// Removes the parameters of a destroyed actor.
    pub(crate) fn remove_actor(&mut self, actor: ActorId) {
        self.values.retain(|set| !param::ends_with(set.actor_id, set.param, actor));
    }

    /// Returns the seed of all random decisions in a world with this seed.
    pub(crate) fn random_seed(&self, seed: u64) -> u64 {
        self.find(0, param::SEED).map_or(seed, |value| mixed(seed, value as u64))
    }

    /// Returns the fraction by which this vehicle drives below the speed limit.
    pub(crate) fn speed_reduction(&self, id: u32) -> f32 {
        self.get(id, param::SPEED_REDUCTION, 0.0).clamp(-3.0, 1.0)
    }

    /// Returns by how much drivers differ: 0 not at all, 1 as in the field.
    pub(crate) fn driver_spread(&self) -> f32 {
        self.find(0, param::DRIVER_SPREAD).unwrap_or(1.0).clamp(0.0, 3.0)
    }

    /// Returns whether a client has set the speed of this vehicle, absolutely or by the limit.
    pub(crate) fn sets_speed(&self, id: u32) -> bool {
        [id, 0].into_iter().any(|id| {
            self.find(id, param::SPEED_MPS)
                .or_else(|| self.find(id, param::SPEED_REDUCTION))
                .is_some()
        })
    }

    /// Returns the gap that this vehicle keeps at standstill, metres.
    pub(crate) fn gap_m(&self, id: u32) -> f32 {
        self.get(id, param::GAP_M, GAP_M).clamp(0.5, 100.0)
    }

    /// Returns the fraction of red lights that this vehicle ignores.
    pub(crate) fn ignore_lights(&self, id: u32) -> f32 {
        self.get(id, param::IGNORE_LIGHTS, 0.0)
    }

    /// Returns the speed to drive whatever the limit is, metres per second.
    pub(crate) fn speed_mps(&self, id: u32) -> Option<f32> {
        let own = self.find(id, param::SPEED_MPS);
        let mps = match self.find(id, param::SPEED_REDUCTION) {
            Some(_) => own,
            None => own.or_else(|| self.find(0, param::SPEED_MPS)),
        };
        mps.map(|mps| mps.clamp(0.0, 100.0))
    }

    /// Returns the seed of the random decisions of walkers in a world with this seed.
    pub(crate) fn walker_seed(&self, seed: u64) -> u64 {
        self.find(0, param::WALKER_SEED).map_or(seed, |value| mixed(seed, value as u64))
    }

    /// Returns the speed that a client has set for this walker, metres per second.
    pub(crate) fn walker_speed_mps(&self, id: u32) -> Option<f32> {
        self.find(id, param::SPEED_MPS).map(|mps| mps.clamp(0.0, 10.0))
    }

    /// Returns the fraction of walkers that cross quiet streets away from crosswalks.
    pub(crate) fn cross_factor(&self) -> f32 {
        self.find(0, param::CROSS_FACTOR).unwrap_or(0.0)
    }

    /// Returns the walker with which this one goes.
    pub(crate) fn walks_with(&self, id: u32) -> Option<u32> {
        self.find(id, param::WALKS_WITH).filter(|with| *with >= 1.0).map(|with| with as u32)
    }

    /// Returns the lateral offset from the centre of the lane, positive to the left, metres.
    pub(crate) fn offset_left_m(&self, id: u32) -> f32 {
        self.get(id, param::OFFSET_LEFT_M, 0.0).clamp(-5.0, 5.0)
    }

    /// Returns whether this vehicle makes discretionary lane changes.
    pub(crate) fn changes_lanes(&self, id: u32) -> bool {
        self.get(id, param::CHANGES_LANES, 1.0) != 0.0
    }

    /// Returns the side of a commanded lane change: 1 left, -1 right, 0 none.
    pub(crate) fn change_now(&self, id: u32) -> f32 {
        self.find(id, param::CHANGE_NOW)
            .map_or(0.0, |side| if side == 0.0 { 0.0 } else { side.signum() })
    }

    /// Removes the commanded lane change after it has been made.
    pub(crate) fn clear_change_now(&mut self, id: u32) {
        self.remove(id, param::CHANGE_NOW);
    }

    /// Returns the probabilities of a random lane change to the left and to the right.
    pub(crate) fn random_changes(&self, id: u32) -> [f32; 2] {
        let fraction = |param| self.get(id, param, 0.0).clamp(0.0, 1.0);
        let right = fraction(param::KEEP_RIGHT) + fraction(param::CHANGE_RIGHT);
        [fraction(param::CHANGE_LEFT), right.min(1.0)]
    }

    /// Returns whether this vehicle switches its lights automatically.
    pub(crate) fn lamps(&self, id: u32) -> bool {
        self.get(id, param::LAMPS, 0.0) != 0.0
    }

    /// Returns the fraction of stop and yield signs that this vehicle ignores.
    pub(crate) fn ignore_signs(&self, id: u32) -> f32 {
        self.get(id, param::IGNORE_SIGNS, 0.0)
    }

    /// Returns whether any vehicle may ignore any agent.
    pub(crate) fn any_ignores(&self) -> bool {
        self.values.iter().any(|set| {
            let param = set.param;
            let ignores = param == param::IGNORE_VEHICLES || param == param::IGNORE_WALKERS;
            (ignores || param >= param::IGNORE_ACTOR) && set.value > 0.0
        })
    }

    /// Returns whether this vehicle ignores the agent `other`.
    pub(crate) fn ignores(&self, seed: u64, id: u32, other: u32, is_walker: bool) -> bool {
        if let Some(value) = self.find(id, param::IGNORE_ACTOR.saturating_add(other)) {
            return value != 0.0;
        }
        let param = if is_walker { param::IGNORE_WALKERS } else { param::IGNORE_VEHICLES };
        let fraction = self.get(id, param, 0.0);
        fraction > 0.0 && unit(seed, id, Purpose::Ignore, u64::from(other)) < fraction
    }

    /// Returns the value of the vehicle, else that of all vehicles, else the default.
    fn get(&self, id: u32, param: u32, default: f32) -> f32 {
        self.find(id, param).or_else(|| self.find(0, param)).unwrap_or(default)
    }

    fn find(&self, id: u32, param: u32) -> Option<f32> {
        let at =
            self.values.binary_search_by_key(&(id, param), |d| (d.actor_id.0, d.param)).ok()?;
        Some(self.values[at].value)
    }

    fn remove(&mut self, id: u32, param: u32) {
        self.values.retain(|set| (set.actor_id.0, set.param) != (id, param));
    }

    /// Returns all parameters, for saving.
    pub(crate) fn all(&self) -> &[TrafficParam] {
        &self.values
    }

    /// Reads parameters that were saved.
    pub(crate) fn from_saved(bytes: &[u8]) -> Params {
        let mut set = vec![TrafficParam::zeroed(); bytes.len() / size_of::<TrafficParam>()];
        bytemuck::cast_slice_mut(&mut set).copy_from_slice(bytes);
        Params { values: set }
    }
}
