//! What a schedule is about, from its seed.

use bus::{Strategy, scheduler::Random};
use protocol::{PIPELINE_MAX, Settings};

use crate::OnStall;

/// The circumstances of a schedule.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) strategy: Strategy,
    pub(super) settings: Settings,
    pub(super) deadline_nanos: Option<u64>,
    pub(super) on_stall: OnStall,
    /// Frames before the faults end.
    pub(super) frames: u64,
    /// Stages that are killed.
    pub(super) kills: u64,
    /// Whether processes are stopped for a time.
    pub(super) stops: bool,
    /// Clients that take part in the barrier.
    pub(super) members: u64,
    /// Clients that are killed.
    pub(super) mortals: u64,
    /// Clients that join and leave, one after the other.
    pub(super) visitors: u64,
    /// Whether the world is asynchronous for some frames.
    pub(super) modes: bool,
    /// Whether the map is loaded again.
    pub(super) maps: bool,
    /// Whether a stage is stopped for more frames than its channel has room for.
    pub(super) flood: bool,
}

impl Plan {
    pub(super) fn new(seed: u64) -> Plan {
        let mut random = Random::new(!seed);
        let mut one_in = |n: u64| random.below(n) == 0;
        let spins = one_in(2);
        let has_kills = !one_in(4);
        let (stops, modes, maps, flood) = (one_in(3), one_in(4), one_in(8), one_in(64));
        let (has_members, has_mortals, has_deadline) = (one_in(3), one_in(4), one_in(8));
        let (restarts, has_visitors) = (one_in(2), one_in(4));
        let spin_nanos = if spins { 1000 << random.below(6) } else { 0 };
        let settings = Settings {
            delta_nanos: 1_000_000,
            substep_max_nanos: 1_000_000,
            synchronous: 1,
            pipeline: if random.below(2) == 0 {
                0
            } else {
                random.below(u64::from(PIPELINE_MAX) + 1) as u32
            },
            real_time_permille: if random.below(2) == 0 { 0 } else { 1000 },
            no_rendering: 0,
        };
        Plan {
            strategy: Strategy { spin_nanos },
            settings,
            deadline_nanos: has_deadline.then(|| 1_000_000 << random.below(6)),
            on_stall: if restarts { OnStall::Restart } else { OnStall::Late },
            frames: 3 + random.below(8),
            kills: if has_kills { 1 + random.below(4) } else { 0 },
            stops,
            members: if has_members { 1 + random.below(2) } else { 0 },
            mortals: if has_mortals { 1 + random.below(2) } else { 0 },
            visitors: if has_visitors { 1 + random.below(4) } else { 0 },
            modes: modes || flood,
            maps,
            flood,
        }
    }

    /// Whether processes may sleep while there is something to do: until the time of the next frame,
    /// until the host looks for clients that died while joining, or until the driver ticks again.
    pub(super) fn may_idle(&self) -> bool {
        self.may_be_overtaken() || self.deadline_nanos.is_some()
    }

    /// Whether a frame that the driver requests may be one that is under way, of the asynchronous world,
    /// of another client or of a map that is loaded. It does not have the driver's commands then.
    pub(super) fn may_be_overtaken(&self) -> bool {
        self.modes || self.mortals > 0 || self.maps
    }

    /// Whether frames may end before all participants have arrived.
    pub(super) fn may_be_late(&self) -> bool {
        self.deadline_nanos.is_some()
    }
}
