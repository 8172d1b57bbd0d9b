use std::{collections::BTreeMap, sync::Mutex};

use crate::shared_bridge::{LockedBridge, lock};

/// Which traffic manager has registered which vehicle: the last one that did.
#[derive(Default)]
pub(crate) struct Owners(Mutex<BTreeMap<u32, Option<u16>>>);

impl Owners {
    /// Registers a vehicle with a manager, and forgets those that exist no longer.
    pub(crate) fn register(&self, bridge: &LockedBridge, id: u32, manager: Option<u16>) {
        let mut owners = lock(&self.0);
        owners.retain(|id, _| bridge.exists(*id));
        owners.insert(id, manager);
    }

    /// Ends the registration of a vehicle; returns false if another manager has it.
    pub(crate) fn unregister(&self, id: u32, manager: Option<u16>) -> bool {
        let mut owners = lock(&self.0);
        let is_own = owners.get(&id).is_none_or(|owner| *owner == manager);
        if is_own {
            owners.remove(&id);
        }
        is_own
    }

    /// Returns the vehicles of a manager.
    pub(crate) fn of(&self, manager: Option<u16>) -> Vec<u32> {
        let owners = lock(&self.0);
        owners.iter().filter(|(_, owner)| **owner == manager).map(|(id, _)| *id).collect()
    }
}
