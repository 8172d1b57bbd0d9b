//! Demand for green, by signal cycle and phase.

/// For each cycle, one bit for each phase.
#[derive(Default)]
pub(crate) struct Demand {
    waits: Vec<u64>,
    comes: Vec<u64>,
    priority: Vec<u64>,
}

impl Demand {
    /// Removes all demand, and sets the number of cycles.
    pub(crate) fn reset(&mut self, cycles: usize) {
        for bits in [&mut self.waits, &mut self.comes, &mut self.priority] {
            bits.clear();
            bits.resize(cycles, 0);
        }
    }

    /// Whether a vehicle waits at a light of this phase or approaches it.
    pub(crate) fn waits(&self, cycle: usize, phase: u64) -> bool {
        self.waits.get(cycle).is_some_and(|bits| bits >> phase.min(63) & 1 == 1)
    }

    /// Whether a vehicle is so near to a light of this phase that green is extended for it.
    pub(crate) fn comes(&self, cycle: usize, phase: u64) -> bool {
        self.comes.get(cycle).is_some_and(|bits| bits >> phase.min(63) & 1 == 1)
    }

    /// Whether this phase has priority.
    pub(crate) fn has_priority(&self, cycle: usize, phase: u64) -> bool {
        self.priority.get(cycle).is_some_and(|bits| bits >> phase.min(63) & 1 == 1)
    }

    /// Registers a vehicle for a phase with priority: it comes next, as soon as the present one may end,
    /// and stays.
    pub(crate) fn prefer(&mut self, cycle: usize, phase: u64) {
        self.add(cycle, phase, false);
        self.priority[cycle] |= 1 << phase.min(63);
    }

    /// Registers a vehicle for a phase; `comes` asks to extend its green.
    pub(crate) fn add(&mut self, cycle: usize, phase: u64, comes: bool) {
        let bit = 1 << phase.min(63);
        self.waits[cycle] |= bit;
        if comes {
            self.comes[cycle] |= bit;
        }
    }

    /// The demand of one cycle with these phases waited for and approached.
    #[cfg(test)]
    pub(crate) fn of(waits: &[u64], comes: &[u64]) -> Demand {
        let bits = |phases: &[u64]| vec![phases.iter().fold(0, |bits, phase| bits | 1 << phase)];
        Demand { waits: bits(waits), comes: bits(comes), priority: bits(&[]) }
    }
}
