//! Flat wall, courses, corner stones and downpipes.

use crate::furnish::facade::{
    book::{LedgePart, PipePart, QuoinPart, Slot, WallPart},
    grow::{Area, Facade, Fineness},
};

impl Facade<'_> {
    /// Adds wall, flush or projecting.
    pub(super) fn flat(&mut self, area: Area, part: &WallPart) {
        let paint = self.paint(part.paint);
        if part.out > 0.0 {
            self.canvas.paint(paint).ledge(area.u, area.z, [0.0, part.out]);
        } else {
            self.canvas.wall(area.u, area.z, 0.0, paint);
            self.joints(area, part.joint);
        }
    }

    /// Adds a course, with blocks below it if it is a cornice.
    pub(super) fn course(&mut self, area: Area, part: &LedgePart) {
        let middle = if part.at < 0.0 { area.z[1] + part.at } else { area.z[0] + part.at };
        let z = [middle - part.height * 0.5, middle + part.height * 0.5];
        self.canvas.paint(self.paint(part.paint)).ledge(area.u, z, [0.0, part.out]);
        if part.blocks <= 0.0 || self.fine != Fineness::Full {
            return;
        }
        let count = (area.width() / part.blocks).round().max(1.0) as u32;
        for block in 0..count {
            let m = area.u[0] + area.width() * (block as f32 + 0.5) / count as f32;
            let (half, low) = (part.blocks * 0.22, z[0] - part.height * 0.7);
            self.canvas.ledge([m - half, m + half], [low, z[0]], [0.0, part.out * 0.7]);
        }
    }

    /// Adds corner stones at both edges of the wall.
    pub(super) fn quoins(&mut self, area: Area, part: &QuoinPart) {
        if self.fine == Fineness::Flat {
            return;
        }
        self.canvas.paint(self.paint(part.paint));
        let [wide, high] = part.size;
        let count = (area.height() / high).floor() as u32;
        for stone in 0..count {
            let long = if stone % 2 == 0 { wide } else { wide * 0.62 };
            let from = area.z[0] + high * stone as f32;
            let z = [from + 0.012, from + high - 0.012];
            for u in [[area.u[0], area.u[0] + long], [area.u[1] - long, area.u[1]]] {
                self.canvas.ledge(u, z, [0.0, part.out]);
            }
        }
    }

    /// Adds a downpipe with a hopper at its head.
    pub(super) fn pipe(&mut self, area: Area, part: &PipePart) {
        if self.fine == Fineness::Flat {
            return;
        }
        self.canvas.paint(self.paint(Slot::Rail));
        let (u, o) = (area.middle(), part.radius + 0.04);
        self.post([u, o], [area.z[0] - 0.3, area.z[1]], part.radius, 6);
        let r = part.radius * 1.9;
        self.canvas.ledge([u - r, u + r], [area.z[1] - 0.3, area.z[1] - 0.08], [0.01, o + r]);
    }
}
