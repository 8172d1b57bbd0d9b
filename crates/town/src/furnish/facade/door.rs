//! Doors and gates.

use mesh::Material;

use crate::furnish::facade::{
    book::{DoorPart, GatePart, Paint, Slot},
    grow::{Area, Facade, Fineness},
};

/// The greatest height of a step, and its depth. Metres.
const RISE_M: f32 = 0.17;
const TREAD_M: f32 = 0.30;
/// How far the foot of steps lies below the ground, for slopes. Metres.
const BELOW_M: f32 = 0.6;

impl Facade<'_> {
    /// Adds a door in a recess at the foot of the area, with steps down to the ground.
    pub(super) fn door(&mut self, area: Area, part: &DoorPart) {
        let half = part.size[0] * 0.5;
        let (m, foot) = (area.middle(), area.z[0]);
        let leaf_top = foot + part.size[1];
        let hole = Area { u: [m - half, m + half], z: [foot, leaf_top + part.light] };
        if area.width() < part.size[0] + 0.1 || hole.z[1] > area.z[1] {
            self.canvas.wall(area.u, area.z, 0.0, self.paint(part.wall));
            return;
        }
        self.note("door", hole);
        self.around(area, hole, part.wall);
        let (u, depth) = (hole.u, part.depth);
        self.canvas.paint(self.paint(part.wall));
        self.canvas.reveal(u, hole.z, 0.0, depth);
        self.canvas.paint(self.paint(Slot::Frame)).rect(u, hole.z, -depth);
        if part.light > 0.0 {
            self.pane(
                [u[0] + 0.07, u[1] - 0.07],
                [leaf_top + 0.06, hole.z[1] - 0.06],
                -depth + 0.012,
                [64, 66, 66],
            );
        }
        let leaves = part.leaves.max(1);
        let width = (hole.width() - 0.12) / leaves as f32;
        for leaf in 0..leaves {
            let l = u[0] + 0.06 + width * leaf as f32;
            self.leaf([l + 0.008, l + width - 0.008], [foot + 0.02, leaf_top - 0.04], part);
            // The handle.
            let side = if leaf + 1 == leaves { l + 0.08 } else { l + width - 0.08 };
            if self.fine == Fineness::Full {
                self.canvas.paint(Paint { material: Material::Metal, rgb: [176, 172, 160] });
                let z = [foot + 0.95, foot + 1.2];
                self.canvas.ledge([side - 0.018, side + 0.018], z, [-depth + 0.04, 0.09 - depth]);
            }
        }
        if part.surround > 0.0 {
            self.canvas.paint(self.paint(Slot::Trim));
            let s = part.surround;
            for side in [[u[0] - s, u[0]], [u[1], u[1] + s]] {
                self.canvas.ledge(side, hole.z, [0.0, 0.07]);
            }
            let head = [hole.z[1], hole.z[1] + s * 1.1];
            self.canvas.ledge([u[0] - s, u[1] + s], head, [0.0, 0.09]);
            let cap = [head[1], head[1] + 0.08];
            self.canvas.ledge([u[0] - s - 0.06, u[1] + s + 0.06], cap, [0.0, 0.2]);
        }
        if part.canopy > 0.0 {
            let z = hole.z[1] + part.surround * 1.1 + 0.12;
            self.canvas.paint(self.paint(Slot::Accent));
            self.canvas.ledge([u[0] - 0.35, u[1] + 0.35], [z, z + 0.1], [0.0, part.canopy]);
            self.canvas.paint(self.paint(Slot::Rail));
            for side in [u[0] - 0.2, u[1] + 0.2] {
                // A tie rod up to the wall.
                let [low, high] = [[side, z + 0.1, part.canopy - 0.12], [side, z + 0.75, 0.0]]
                    .map(|point| self.canvas.at(point));
                self.canvas.builder().rod(low, high, 0.015, 4);
            }
        }
        self.steps(hole, foot, depth);
        if self.fine == Fineness::Full {
            // A lamp, a bell and a letter box beside the door.
            let side = u[1] + part.surround + 0.16;
            if side + 0.15 < area.u[1] {
                self.canvas.paint(Paint { material: Material::Metal, rgb: [60, 60, 62] });
                self.canvas.ledge(
                    [side - 0.06, side + 0.06],
                    [foot + 1.35, foot + 1.6],
                    [0.0, 0.02],
                );
                let z = [foot + 1.95, foot + 2.2];
                self.canvas.ledge([side - 0.07, side + 0.07], z, [0.0, 0.14]);
            }
        }
    }

    /// Adds a leaf with panels or panes.
    fn leaf(&mut self, u: [f32; 2], z: [f32; 2], part: &DoorPart) {
        let (o, door) = (-part.depth, self.paint(Slot::Door));
        self.canvas.paint(door).ledge(u, z, [o, o + 0.04]);
        let (l, r) = (u[0] + 0.11, u[1] - 0.11);
        if r - l < 0.1 {
            return;
        }
        let height = z[1] - z[0];
        if part.glazed {
            let from = if part.leaves > 1 { 0.12 } else { 0.42 };
            self.pane([l, r], [z[0] + height * from, z[1] - 0.12], o + 0.045, [48, 52, 54]);
            return;
        }
        let [red, green, blue] = door.rgb.map(|c| (f32::from(c) * 0.72) as u8);
        for (from, to) in [(0.06, 0.36), (0.42, 0.93)] {
            self.canvas.paint(Paint { material: door.material, rgb: [red, green, blue] });
            self.canvas.rect([l, r], [z[0] + height * from, z[0] + height * to], o + 0.045);
        }
    }

    /// Adds steps from a door down to the ground at z = 0.
    fn steps(&mut self, hole: Area, foot: f32, depth: f32) {
        self.canvas.paint(self.paint(Slot::Plinth));
        let u = [hole.u[0] - 0.22, hole.u[1] + 0.22];
        let count = (foot / RISE_M).ceil() as u32;
        if count == 0 {
            // A threshold.
            self.canvas.ledge(hole.u, [-BELOW_M, 0.02], [-depth, 0.06]);
            return;
        }
        for step in 0..count {
            let top = foot - RISE_M * step as f32;
            let out = 0.45 + TREAD_M * step as f32;
            let inner = if step == 0 { -depth } else { 0.1 };
            self.canvas.ledge(u, [-BELOW_M, top], [inner, out]);
        }
        if self.fine == Fineness::Full && count > 2 {
            self.canvas.paint(self.paint(Slot::Rail));
            let (near, far) = (0.2, 0.35 + TREAD_M * (count - 1) as f32);
            for side in [u[0] + 0.06, u[1] - 0.06] {
                self.post([side, near], [foot, foot + 0.9], 0.018, 4);
                self.post([side, far], [0.0, 0.95], 0.018, 4);
                let [from, to] = [[side, foot + 0.9, near], [side, 0.95, far]]
                    .map(|point| self.canvas.at(point));
                self.canvas.builder().rod(from, to, 0.022, 4);
            }
        }
    }

    /// Adds a gate of slats.
    pub(super) fn gate(&mut self, area: Area, part: &GatePart) {
        let half = part.size[0].min(area.width() - 0.2) * 0.5;
        let top = area.z[0] + part.size[1];
        if half < 0.8 || top > area.z[1] {
            self.canvas.wall(area.u, area.z, 0.0, self.paint(part.wall));
            return;
        }
        let m = area.middle();
        let hole = Area { u: [m - half, m + half], z: [area.z[0], top] };
        self.note("door", hole);
        self.around(area, hole, part.wall);
        self.canvas.paint(self.paint(part.wall));
        self.canvas.reveal(hole.u, hole.z, 0.0, part.depth);
        let o = -part.depth;
        let door = self.paint(Slot::Accent);
        let [red, green, blue] = door.rgb.map(|c| (f32::from(c) * 0.5) as u8);
        self.canvas.paint(Paint { material: Material::Metal, rgb: [red, green, blue] });
        self.canvas.rect(hole.u, hole.z, o);
        let slats = (part.size[1] / 0.5).round().max(1.0) as u32;
        let pitch = part.size[1] / slats as f32;
        for slat in 0..slats {
            let from = hole.z[0] + pitch * slat as f32;
            let z = [from + 0.012, from + pitch - 0.012];
            self.canvas.paint(door).ledge([hole.u[0] + 0.03, hole.u[1] - 0.03], z, [o, o + 0.03]);
        }
        // A lip that keeps water out.
        self.canvas.paint(self.paint(Slot::Plinth));
        self.canvas.ledge(hole.u, [-BELOW_M, 0.02], [o, 0.05]);
    }
}
