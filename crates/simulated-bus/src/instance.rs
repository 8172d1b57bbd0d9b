//! The instance that the processes of a schedule share, without files.

use std::{cell::RefCell, collections::BTreeMap};

use protocol::{BlueprintInfo, Episode};

use crate::{BusError, BusNode, ControlPageMapping, port, scheduler};

/// What the files of an instance would hold.
#[derive(Default)]
struct Files {
    control: Option<ControlPageMapping>,
    episode: Option<(u32, Episode)>,
    exit_messages: BTreeMap<usize, String>,
}

thread_local! {
    static FILES: RefCell<Files> = RefCell::default();
}

/// The instance of this thread's schedule.
#[derive(Clone, Debug)]
pub struct Instance;

/// The instance as its host creates it.
#[derive(Debug)]
pub struct OwnedInstance(Instance);

impl Instance {
    /// Creates the instance anew: a blank control page and no channels.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn create(_id: Option<&str>) -> Result<OwnedInstance, BusError> {
        port::remove_all();
        FILES.set(Files { control: Some(ControlPageMapping::blank()), ..Files::default() });
        Ok(OwnedInstance(Instance))
    }

    /// The name of the instance.
    pub fn id(&self) -> &str {
        "simulated"
    }

    /// The control page.
    ///
    /// # Errors
    ///
    /// There is no valid page.
    pub fn control(&self) -> Result<ControlPageMapping, BusError> {
        let control = page()?;
        control.check()?;
        Ok(control)
    }

    /// Opens a node.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn node(&self, _name: &str, _in_process: bool) -> Result<BusNode, BusError> {
        Ok(BusNode)
    }

    /// For the host: stores the inputs of the world.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn write_episode(&self, number: u32, episode: &Episode) -> Result<(), BusError> {
        if scheduler::point("write episode") {
            FILES.with_borrow_mut(|files| files.episode = Some((number, episode.clone())));
        }
        Ok(())
    }

    /// The number of the current episode, and its inputs.
    ///
    /// # Errors
    ///
    /// The host has not stored them.
    pub fn numbered_episode(&self) -> Result<(u32, Episode), BusError> {
        scheduler::point("read episode");
        let episode = FILES.with_borrow(|files| files.episode.clone());
        episode.ok_or_else(|| BusError::Instance("there is no episode".into()))
    }

    /// For the host: stores nothing.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn write_maps(&self, _names: &[String]) -> Result<(), BusError> {
        Ok(())
    }

    /// For the host: stores nothing.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn write_blueprints(&self, _blueprints: &[BlueprintInfo]) -> Result<(), BusError> {
        Ok(())
    }

    /// Stores the reason why the process in `slot` is about to end, for the host.
    pub fn write_exit_message(&self, slot: usize, words: &str) {
        if scheduler::point("write exit message") {
            FILES.with_borrow_mut(|files| files.exit_messages.insert(slot, words.to_owned()));
        }
    }

    /// Returns and removes the reason that the process in `slot` stored.
    pub fn take_exit_message(&self, slot: usize) -> Option<String> {
        FILES.with_borrow_mut(|files| files.exit_messages.remove(&slot))
    }

    /// There are no files.
    pub fn sweep_unfinished_segments(&self) -> usize {
        0
    }

    /// There are no files.
    pub fn sweep_stuck_nodes(&self, _spared: &[u32]) -> usize {
        0
    }
}

impl OwnedInstance {
    /// The instance.
    pub fn instance(&self) -> &Instance {
        &self.0
    }

    /// The blank control page, for the host to initialise.
    ///
    /// # Errors
    ///
    /// There is none.
    pub fn control(&self) -> Result<ControlPageMapping, BusError> {
        page()
    }

    /// Opens the host's node.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn node(&self, _in_process: bool) -> Result<BusNode, BusError> {
        Ok(BusNode)
    }
}

fn page() -> Result<ControlPageMapping, BusError> {
    let page = FILES.with_borrow(|files| files.control.clone());
    page.ok_or_else(|| BusError::Instance("there is no control page".into()))
}
