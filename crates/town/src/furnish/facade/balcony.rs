//! Balconies.

use mesh::Material;

use crate::furnish::facade::{
    book::{BalconyPart, Paint, Railing, Slot},
    grow::{Area, Facade, Fineness},
};

/// The height of a railing, and the distance between its bars. Metres.
const RAIL_M: f32 = 1.0;
const BAR_M: f32 = 0.2;

impl Facade<'_> {
    /// Adds a slab with a railing at the foot of the area.
    pub(super) fn balcony(&mut self, area: Area, part: &BalconyPart) {
        let [l, r] = [area.u[0] + part.inset, area.u[1] - part.inset];
        if r - l < 1.0 || self.fine == Fineness::Flat {
            return;
        }
        let (z, out) = (area.z[0], part.out);
        self.canvas.paint(self.paint(Slot::Trim));
        self.canvas.ledge([l, r], [z - 0.14, z + 0.02], [0.0, out]);
        let top = z + RAIL_M;
        let rail = self.paint(Slot::Rail);
        let plate = match part.rail {
            Railing::Bars if self.fine == Fineness::Full => None,
            Railing::Bars | Railing::Plate => Some(self.paint(Slot::Accent)),
            Railing::Glass => Some(Paint { material: Material::Glass, rgb: [120, 140, 142] }),
        };
        let (edge, low) = (out - 0.04, z + 0.08);
        match plate {
            Some(plate) => {
                self.canvas.paint(plate);
                self.canvas.rect([l + 0.04, r - 0.04], [low, top], edge);
                for (u, flip) in [(l + 0.04, true), (r - 0.04, false)] {
                    let (a, b) = if flip { (0.02, edge) } else { (edge, 0.02) };
                    self.canvas.quad([[u, low, a], [u, low, b], [u, top, b], [u, top, a]]);
                }
            }
            None => self.bars([l + 0.04, r - 0.04], [low, top], edge),
        }
        self.canvas.paint(rail);
        self.canvas.ledge([l, r], [top, top + 0.05], [edge - 0.03, out]);
        for u in [[l, l + 0.05], [r - 0.05, r]] {
            self.canvas.ledge(u, [top, top + 0.05], [0.0, edge]);
            self.canvas.ledge(u, [z, top], [edge - 0.02, out - 0.01]);
        }
        // What stands on it: pots, a chair, washing.
        if self.fine == Fineness::Full && self.random.chance(0.4) {
            let u = self.random.between(l + 0.3, r - 0.3);
            self.canvas.paint(Paint { material: Material::Concrete, rgb: [158, 92, 62] });
            self.post([u, edge - 0.25], [z, z + 0.35], 0.14, 6);
            self.canvas.paint(Paint { material: Material::Leaves, rgb: [66, 100, 46] });
            let (center, radius) =
                (self.canvas.at([u, z + 0.62, edge - 0.25]), glam::Vec3::splat(0.27));
            self.canvas.builder().ball(center, radius, 4, 6);
        }
    }

    /// Adds upright bars along the front and both ends, as flat strips.
    fn bars(&mut self, [l, r]: [f32; 2], z: [f32; 2], edge: f32) {
        self.canvas.paint(self.paint(Slot::Rail));
        let count = ((r - l) / BAR_M).round().max(2.0) as u32;
        for bar in 0..=count {
            let u = l + (r - l) * bar as f32 / count as f32;
            self.canvas.rect([u - 0.011, u + 0.011], z, edge);
        }
        let count = (edge / BAR_M).round().max(2.0) as u32;
        for bar in 1..count {
            let o = edge * bar as f32 / count as f32;
            for u in [l, r] {
                let ([low, high], w) = (z, 0.011);
                self.canvas.quad([
                    [u, low, o - w],
                    [u, high, o - w],
                    [u, high, o + w],
                    [u, low, o + w],
                ]);
            }
        }
    }
}
