//! What users set: how fast, how near, how lawful.

use bytemuck::Zeroable;
use protocol::{ActorId, TrafficParam, param};

use crate::random::{Purpose, mixed, unit};

/// Free distance kept at standstill, unless set otherwise.
pub(crate) const GAP_M: f32 = 2.0;

/// All params that were ever turned, sorted by actor and param; actor 0 is everybody.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Params {
    values: Vec<TrafficParam>,
}

impl Params {
    /// Sets one, in place of what it was.
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

    /// An actor is no more.
    pub(crate) fn remove_actor(&mut self, actor: ActorId) {
        self.values.retain(|set| !param::ends_with(set.actor_id, set.param, actor));
    }

    /// What random turns and whims are drawn from in a world of this seed.
    pub(crate) fn random_seed(&self, seed: u64) -> u64 {
        self.find(0, param::SEED).map_or(seed, |drawn| mixed(seed, drawn as u64))
    }

    /// How much slower than the limit this vehicle drives, as a share.
    pub(crate) fn speed_reduction(&self, id: u32) -> f32 {
        self.get(id, param::SPEED_REDUCTION, 0.0).clamp(-3.0, 1.0)
    }

    /// Free distance that this vehicle keeps at standstill, metres.
    pub(crate) fn gap_m(&self, id: u32) -> f32 {
        self.get(id, param::GAP_M, GAP_M).clamp(0.5, 100.0)
    }

    /// Share of red lights that this vehicle ignores.
    pub(crate) fn ignore_lights(&self, id: u32) -> f32 {
        self.get(id, param::IGNORE_LIGHTS, 0.0)
    }

    /// The speed to drive at whatever the limit is, metres per second.
    pub(crate) fn speed_mps(&self, id: u32) -> Option<f32> {
        let own = self.find(id, param::SPEED_MPS);
        let mps = match self.find(id, param::SPEED_REDUCTION) {
            Some(_) => own,
            None => own.or_else(|| self.find(0, param::SPEED_MPS)),
        };
        mps.map(|mps| mps.clamp(0.0, 100.0))
    }

    /// How far left of the middle of its lane this vehicle drives, metres.
    pub(crate) fn offset_left_m(&self, id: u32) -> f32 {
        self.get(id, param::OFFSET_LEFT_M, 0.0).clamp(-5.0, 5.0)
    }

    /// Whether this vehicle changes lanes for its own ends.
    pub(crate) fn changes_lanes(&self, id: u32) -> bool {
        self.get(id, param::CHANGES_LANES, 1.0) != 0.0
    }

    /// Where this vehicle has been told to change to: 1 left, -1 right, 0 nowhere.
    pub(crate) fn change_now(&self, id: u32) -> f32 {
        self.find(id, param::CHANGE_NOW)
            .map_or(0.0, |side| if side == 0.0 { 0.0 } else { side.signum() })
    }

    /// It has changed as it was told.
    pub(crate) fn clear_change_now(&mut self, id: u32) {
        self.remove(id, param::CHANGE_NOW);
    }

    /// With what probabilities this vehicle changes to the left and to the right for no reason.
    pub(crate) fn random_changes(&self, id: u32) -> [f32; 2] {
        let share = |param| self.get(id, param, 0.0).clamp(0.0, 1.0);
        let right = share(param::KEEP_RIGHT) + share(param::CHANGE_RIGHT);
        [share(param::CHANGE_LEFT), right.min(1.0)]
    }

    /// Whether this vehicle switches its lamps by itself.
    pub(crate) fn lamps(&self, id: u32) -> bool {
        self.get(id, param::LAMPS, 0.0) != 0.0
    }

    /// Share of stop and yield signs that this vehicle ignores.
    pub(crate) fn ignore_signs(&self, id: u32) -> f32 {
        self.get(id, param::IGNORE_SIGNS, 0.0)
    }

    /// Whether anybody may be ignored at all.
    pub(crate) fn any_ignores(&self) -> bool {
        self.values.iter().any(|set| {
            let param = set.param;
            let ignores = param == param::IGNORE_VEHICLES || param == param::IGNORE_WALKERS;
            (ignores || param >= param::IGNORE_ACTOR) && set.value > 0.0
        })
    }

    /// Whether this vehicle drives as if `other` were not there.
    pub(crate) fn ignores(&self, seed: u64, id: u32, other: u32, is_walker: bool) -> bool {
        if let Some(value) = self.find(id, param::IGNORE_ACTOR.saturating_add(other)) {
            return value != 0.0;
        }
        let param = if is_walker { param::IGNORE_WALKERS } else { param::IGNORE_VEHICLES };
        let share = self.get(id, param, 0.0);
        share > 0.0 && unit(seed, id, Purpose::Ignore, u64::from(other)) < share
    }

    /// A vehicle's own setting, else everybody's, else the given one.
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

    /// The settings, for saving.
    pub(crate) fn all(&self) -> &[TrafficParam] {
        &self.values
    }

    /// From settings that were saved.
    pub(crate) fn from_saved(bytes: &[u8]) -> Params {
        let mut set = vec![TrafficParam::zeroed(); bytes.len() / size_of::<TrafficParam>()];
        bytemuck::cast_slice_mut(&mut set).copy_from_slice(bytes);
        Params { values: set }
    }
}
