//! Commands and controls that wait to be sent.

use std::collections::BTreeMap;

use client_lib::{
    Client,
    wire::{Command, VehicleControl},
};

/// Most batches that are sent within one frame of an asynchronous world.
const BATCHES_PER_FRAME_MAX: u32 = 6;

/// Most commands that wait for the next tick of a synchronous world.
pub(crate) const WAITING_MAX: usize = 1 << 18;

/// Commands without an awaited outcome, and the newest control of each vehicle.
#[derive(Default)]
pub(crate) struct Outbox {
    commands: Vec<Command>,
    /// The newest control of each vehicle, and for how many frames it has been sent.
    controls: BTreeMap<u32, (VehicleControl, u32)>,
    /// Batches sent since the last frame.
    batches: u32,
    has_unsent: bool,
}

impl Outbox {
    /// Queues a command whose outcome is not awaited.
    pub(crate) fn command(&mut self, command: Command) {
        self.commands.push(command);
        self.has_unsent = true;
    }

    /// Queues commands that follow from a new frame rather than from a call.
    pub(crate) fn extend(&mut self, commands: impl IntoIterator<Item = Command>) {
        self.commands.extend(commands);
    }

    /// Sets the control of a vehicle; the newest one holds.
    pub(crate) fn control(&mut self, control: VehicleControl) {
        self.controls.insert(control.actor_id.0, (control, 0));
        self.has_unsent = true;
    }

    /// Removes and returns all queued commands.
    pub(crate) fn take_commands(&mut self) -> Vec<Command> {
        std::mem::take(&mut self.commands)
    }

    /// Returns whether a call has queued something and this frame has room for another batch.
    pub(crate) fn is_due(&self) -> bool {
        self.has_unsent && self.batches < BATCHES_PER_FRAME_MAX
    }

    /// Returns whether so many commands wait that no more are accepted.
    pub(crate) fn is_full(&self) -> bool {
        self.commands.len() >= WAITING_MAX
    }

    /// Starts counting the batches of another frame.
    pub(crate) fn begin_frame(&mut self) {
        self.batches = 0;
    }

    /// Sends everything that is queued.
    ///
    /// The bus keeps the newest control batches only. Controls are therefore sent again for two
    /// frames, so that each batch contains everything that is new.
    pub(crate) fn flush(&mut self, client: &mut Client, frame: u64) {
        self.has_unsent = false;
        if !self.controls.is_empty() {
            let controls: Vec<_> = self.controls.values().map(|(control, _)| *control).collect();
            self.batches += 1;
            if let Err(e) = client.control(&controls) {
                log::warn!("{frame} {} controls are lost: {e}", controls.len());
            }
        }
        if !self.commands.is_empty() {
            let commands = self.take_commands();
            self.batches += 1;
            if let Err(e) = client.send(&commands) {
                log::warn!("{frame} {} commands are lost: {e}", commands.len());
            }
        }
    }

    /// Ages the controls by a frame and drops those older than `keep` frames.
    ///
    /// The pedals of a vehicle that is not sticky are released after one frame.
    pub(crate) fn age_controls(&mut self, keep: u32, is_sticky: impl Fn(u32) -> bool) {
        self.controls.retain(|id, (control, age)| {
            *age += 1;
            let released =
                VehicleControl { actor_id: control.actor_id, ..VehicleControl::default() };
            if *age > keep && *control != released && !is_sticky(*id) {
                (*control, *age) = (released, 0);
            }
            *age <= keep
        });
    }

    /// Drops everything that is queued.
    pub(crate) fn clear(&mut self) {
        self.commands.clear();
        self.controls.clear();
    }
}
