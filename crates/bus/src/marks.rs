//! The stage clock of a control page: how instants are stored, and how those of a frame are read.

use protocol::Frame;

use crate::{
    ControlPage, Role, SLOTS, SlotState, clock,
    stage_clock::{DeviceInstant, HostInstant, SlotInstant, StageClock},
};

impl ControlPage {
    /// For the host: stores an instant of a frame.
    pub fn mark_host(&self, instant: HostInstant, frame: Frame, nanos: u64) {
        self.clocks.of_host(instant).store(frame, nanos);
    }

    /// For the renderer: stores an instant of a frame.
    pub fn mark_device(&self, instant: DeviceInstant, frame: Frame, nanos: u64) {
        self.clocks.of_device(instant).store(frame, nanos);
    }

    /// For the holder of `slot`: stores an instant of a frame.
    pub fn mark(&self, slot: usize, instant: SlotInstant, frame: Frame, nanos: u64) {
        self.clocks.of_slot(slot, instant).store(frame, nanos);
    }

    /// For the holder of `slot`: stores that an instant of a frame is now.
    pub fn mark_now(&self, slot: usize, instant: SlotInstant, frame: Frame) {
        self.mark(slot, instant, frame, clock::now_nanos());
    }

    /// Returns an instant of a frame that the host stored.
    pub fn host_instant(&self, instant: HostInstant, frame: Frame) -> Option<u64> {
        self.clocks.of_host(instant).load(frame)
    }

    /// Returns an instant of a frame that the holder of `slot` stored.
    pub fn instant(&self, slot: usize, instant: SlotInstant, frame: Frame) -> Option<u64> {
        self.clocks.of_slot(slot, instant).load(frame)
    }

    /// Returns the stage clock of a frame, with the instants of the client in slot `client`.
    pub fn stage_clock(&self, frame: Frame, client: Option<usize>) -> StageClock {
        let host = |instant| self.host_instant(instant, frame);
        let device = |instant| self.clocks.of_device(instant).load(frame);
        let of = |slot: Option<usize>, instant| self.instant(slot?, instant, frame);
        let live = |role| {
            let is_it = |slot: &usize| {
                let words = self.slot(*slot);
                words.role() == Some(role) && words.state() == SlotState::Live
            };
            (0..SLOTS).find(is_it)
        };
        let (traffic, render) = (live(Role::Traffic), live(Role::Render));
        StageClock {
            frame,
            requested_nanos: of(client, SlotInstant::Requested),
            begun_nanos: host(HostInstant::Begun),
            physics_begun_nanos: host(HostInstant::PhysicsBegun),
            physics_ended_nanos: host(HostInstant::PhysicsEnded),
            published_nanos: host(HostInstant::Published),
            plan_begun_nanos: of(traffic, SlotInstant::Begun),
            planned_nanos: of(traffic, SlotInstant::Worked),
            plan_delivered_nanos: of(traffic, SlotInstant::Arrived),
            trace_begun_nanos: of(render, SlotInstant::Begun),
            device_begun_nanos: device(DeviceInstant::Begun),
            device_traced_nanos: device(DeviceInstant::Traced),
            device_copied_nanos: device(DeviceInstant::Copied),
            traced_nanos: of(render, SlotInstant::Worked),
            delivered_nanos: of(render, SlotInstant::Arrived),
            read_nanos: of(client, SlotInstant::Read),
            control_sent_nanos: of(client, SlotInstant::ControlSent),
            control_applied_nanos: host(HostInstant::ControlApplied),
            closed_nanos: host(HostInstant::Closed),
        }
    }
}
