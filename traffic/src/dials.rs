//! What users set: how fast, how near, how lawful.

use bus::{Command, TrafficDial, Wish, dial, status};
use bytemuck::Zeroable;

use crate::follow::GAP_M;

/// All dials that were ever turned, sorted by actor and dial; actor 0 is everybody.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Dials {
    set: Vec<TrafficDial>,
}

impl Dials {
    /// Takes over what one line of the journal asks for, if it was granted.
    pub(crate) fn turn(&mut self, command: &Command, outcome: u32) {
        if outcome != status::DONE {
            return;
        }
        match command.wish() {
            Some(Wish::TrafficDial(dial)) if dial.value.is_finite() => {
                let key = (dial.actor_id, dial.dial);
                match self.set.binary_search_by_key(&key, |d| (d.actor_id, d.dial)) {
                    Ok(at) => self.set[at] = dial,
                    Err(at) => self.set.insert(at, dial),
                }
            }
            Some(Wish::Destroy(actor)) if actor.0 != 0 => {
                self.set.retain(|dial| dial.actor_id != actor);
            }
            _ => {}
        }
    }

    /// How much slower than the limit this vehicle drives, as a share.
    pub(crate) fn slower(&self, id: u32) -> f32 {
        self.get(id, dial::SLOWER_THAN_LIMIT, 0.0).clamp(-3.0, 1.0)
    }

    /// Free distance that this vehicle keeps at standstill, metres.
    pub(crate) fn gap_m(&self, id: u32) -> f32 {
        self.get(id, dial::GAP_M, GAP_M).clamp(0.5, 100.0)
    }

    /// Share of red lights that this vehicle ignores.
    pub(crate) fn ignore_lights(&self, id: u32) -> f32 {
        self.get(id, dial::IGNORE_LIGHTS, 0.0)
    }

    /// A vehicle's own setting, else everybody's, else the given one.
    fn get(&self, id: u32, dial: u32, otherwise: f32) -> f32 {
        let find = |id: u32| {
            let at = self.set.binary_search_by_key(&(id, dial), |d| (d.actor_id.0, d.dial)).ok()?;
            Some(self.set[at].value)
        };
        find(id).or_else(|| find(0)).unwrap_or(otherwise)
    }

    /// The settings, for saving.
    pub(crate) fn all(&self) -> &[TrafficDial] {
        &self.set
    }

    /// From settings that were saved.
    pub(crate) fn from_saved(bytes: &[u8]) -> Dials {
        let mut set = vec![TrafficDial::zeroed(); bytes.len() / size_of::<TrafficDial>()];
        bytemuck::cast_slice_mut(&mut set).copy_from_slice(bytes);
        Dials { set }
    }
}
