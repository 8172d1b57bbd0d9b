//! Windows and glazing.

use mesh::Material;

use crate::furnish::facade::{
    book::{GlazingPart, Paint, Slot, WindowPart},
    grow::{Area, Facade, Fineness},
};

/// The least wall beside an opening. Metres.
const MARGIN_M: f32 = 0.08;
/// How far panes stand in front of the sheet of their frame. Metres.
const PROUD_M: f32 = 0.012;

/// What is seen in a pane by day, sRGB: rooms, curtains, blinds.
const ROOMS: [[u8; 3]; 4] = [[34, 38, 44], [26, 30, 36], [44, 46, 48], [54, 50, 46]];
const CURTAINS: [[u8; 3]; 4] = [[150, 144, 132], [128, 120, 104], [120, 128, 130], [140, 118, 104]];
const BLINDS: [[u8; 3]; 3] = [[186, 182, 170], [158, 156, 150], [122, 112, 98]];

impl Facade<'_> {
    /// Adds a window and the wall round it; only wall where it does not fit.
    pub(super) fn window(&mut self, area: Area, part: &WindowPart) {
        let wide = if part.size[0] > 0.0 { part.size[0] } else { area.width() };
        let half = wide.min(area.width()) * 0.5;
        let u = [area.middle() - half, area.middle() + half];
        let z = [area.z[0] + part.sill, area.z[0] + part.sill + part.size[1]];
        let hole = Area { u, z };
        let full = part.size[0] <= 0.0;
        let fits = z[1] <= area.z[1] && (full || area.width() - wide >= 2.0 * MARGIN_M);
        if !fits || half < 0.2 {
            self.canvas.wall(area.u, area.z, 0.0, self.paint(part.wall));
            return;
        }
        self.note("window", hole);
        let frame = self.paint(Slot::Frame);
        if self.fine == Fineness::Flat {
            self.canvas.wall(area.u, area.z, 0.0, self.paint(part.wall));
            self.canvas.paint(frame).rect(u, z, 0.012);
            self.panes(hole, 0.012, part, 1);
            return;
        }
        self.around(area, hole, part.wall);
        self.joints(area, part.joint);
        self.canvas.paint(self.paint(part.wall));
        self.canvas.reveal(u, z, 0.0, part.depth);
        self.canvas.paint(frame).rect(u, z, -part.depth);
        self.panes(hole, -part.depth, part, part.panes[0].max(1));
        if part.surround > 0.0 {
            let (s, trim) = (part.surround, self.paint(Slot::Trim));
            self.canvas.paint(trim);
            let (low, high) = ([u[0] - s, u[0]], [u[1], u[1] + s]);
            for side in [low, high] {
                self.canvas.ledge(side, z, [0.0, 0.03]);
            }
            self.canvas.ledge([u[0] - s, u[1] + s], [z[1], z[1] + s * 1.2], [0.0, 0.04]);
        }
        if part.lintel > 0.0 {
            self.canvas.paint(self.paint(Slot::Trim));
            let reach = [u[0] - 0.14, u[1] + 0.14];
            self.canvas.ledge(reach, [z[1] + 0.02, z[1] + part.lintel], [0.0, 0.03]);
        }
        if part.ledge > 0.0 && (self.fine == Fineness::Full || part.surround > 0.0) {
            self.canvas.paint(self.paint(Slot::Trim));
            let reach = if full { u } else { [u[0] - 0.08, u[1] + 0.08] };
            self.canvas.ledge(reach, [z[0] - 0.09, z[0] + 0.005], [-0.04, part.ledge]);
        }
        if self.fine == Fineness::Full {
            self.extras(hole, area, part);
        }
    }

    /// Adds the panes of a window in front of the sheet of its frame.
    fn panes(&mut self, hole: Area, o: f32, part: &WindowPart, columns: u32) {
        let (b, o) = (part.frame.max(0.03), o + PROUD_M);
        let curtained = self.random.chance(part.blind);
        let dice = self.random.unit();
        // All panes of a window have one colour, by which a renderer furnishes and lights the room behind.
        let mut room = *self.random.pick(&ROOMS);
        for (channel, by) in room.iter_mut().zip([113.0, 397.0, 997.0]) {
            *channel = (f32::from(*channel) + (dice * by).fract() * 28.0 - 14.0).max(8.0) as u8;
        }
        let cloth = *self.random.pick(if dice < 0.5 { &CURTAINS[..] } else { &BLINDS[..] });
        let width = (hole.width() - b) / columns as f32;
        let rows = if self.fine != Fineness::Full { 1 } else { part.panes[1].max(1) };
        for column in 0..columns {
            let from = hole.u[0] + b + width * column as f32;
            let u = [from, from + width - b];
            let (low, high) = (hole.z[0] + b, hole.z[1] - b);
            let bar = low + (high - low) * if rows > 1 { part.lower } else { 1.0 };
            // A curtain hangs on one side of the window, a blind down to some height.
            let drawn = curtained && (dice >= 0.5 || column == 0 || columns > 3);
            let drop = match drawn {
                false => high,
                true if dice < 0.5 => low,
                true => low + (high - low) * ((dice - 0.5) * 1.7),
            };
            let sashes = [[low, bar], [bar + b, high]];
            for z in &sashes[..rows.min(2) as usize] {
                let edge = drop.clamp(z[0], z[1]);
                if edge - z[0] > 0.02 {
                    self.glass(u, [z[0], edge], o, room);
                }
                if z[1] - edge > 0.02 {
                    self.pane(u, [edge, z[1]], o, cloth);
                }
            }
        }
    }

    /// Adds shutters, a flower box or an air conditioner.
    fn extras(&mut self, hole: Area, area: Area, part: &WindowPart) {
        let ([l, r], [b, t]) = (hole.u, hole.z);
        // Shutters are on all windows of a building or on none.
        let mut whole = mesh::RandomStream::named(self.look.seed, 0x5477);
        let room = (area.width() - hole.width()) * 0.5;
        let leaf = (hole.width() * 0.5).min(room - 0.03);
        if whole.chance(part.shutters) && leaf > 0.25 {
            for (from, to) in [(l - leaf - 0.02, l - 0.02), (r + 0.02, r + leaf + 0.02)] {
                self.canvas.paint(self.paint(Slot::Accent));
                self.canvas.ledge([from, to], [b, t], [0.005, 0.05]);
                let [red, green, blue] =
                    self.paint(Slot::Accent).rgb.map(|c| (f32::from(c) * 0.6) as u8);
                let shade = Paint { material: Material::Wood, rgb: [red, green, blue] };
                self.canvas.paint(shade);
                for half in 0..2 {
                    let from_z = b + (t - b) * (0.06 + 0.48 * half as f32);
                    let to_z = from_z + (t - b) * 0.4;
                    self.canvas.rect([from + 0.06, to - 0.06], [from_z, to_z], 0.054);
                }
            }
        } else if self.random.chance(part.flowers) {
            let wood = Paint { material: Material::Wood, rgb: [96, 66, 44] };
            self.canvas.paint(wood);
            self.canvas.ledge([l + 0.05, r - 0.05], [b - 0.02, b + 0.16], [0.02, 0.2]);
            let hue = *self.random.pick(&[[186, 40, 56], [206, 92, 130], [226, 196, 70]]);
            let count = ((r - l) / 0.09) as u32;
            for flower in 0..count {
                let u =
                    l + 0.1 + (r - l - 0.2) * (flower as f32 + self.random.unit()) / count as f32;
                let z = b + 0.14 + self.random.between(0.0, 0.14);
                let (half, o) = (self.random.between(0.05, 0.09), self.random.between(0.05, 0.2));
                let (material, rgb) = match self.random.chance(0.4) {
                    true => (Material::Cloth, hue),
                    false => (Material::Leaves, [70, 104, 48]),
                };
                self.canvas.paint(Paint { material, rgb });
                let turn = self.random.between(-0.06, 0.06);
                self.canvas.quad([
                    [u - half, z, o - turn],
                    [u, z - half, o],
                    [u + half, z, o + turn],
                    [u, z + half, o],
                ]);
            }
        } else if self.random.chance(part.cooler) && b - area.z[0] > 0.6 {
            let middle = hole.middle();
            self.canvas.paint(Paint { material: Material::Metal, rgb: [206, 206, 200] });
            let (u, z) = ([middle - 0.42, middle + 0.42], [b - 0.72, b - 0.14]);
            self.canvas.ledge(u, z, [0.04, 0.36]);
            // The grille of the fan.
            let dark = Paint { material: Material::Plastic, rgb: [58, 60, 62] };
            self.canvas.paint(dark);
            let hub = self.canvas.at([middle - 0.12, b - 0.43, 0.362]);
            let ahead = self.canvas.at([middle - 0.12, b - 0.43, 0.372]) - hub;
            self.canvas.builder().rod(hub, hub + ahead, 0.22, 10);
            self.canvas.rect([middle + 0.2, middle + 0.36], [b - 0.62, b - 0.24], 0.364);
        }
    }

    /// Adds a pane over the whole area with a spandrel below it, and a mullion on its left.
    pub(super) fn glazing(&mut self, area: Area, part: &GlazingPart) {
        let ([l, r], [b, t]) = (area.u, area.z);
        let head = b + part.spandrel;
        let frame = self.paint(Slot::Frame);
        if part.spandrel > 0.0 {
            self.canvas.wall(area.u, [b, head], 0.0, self.paint(part.paint));
        }
        self.canvas.wall(area.u, [head, t], -0.02, frame);
        self.note("window", Area { u: area.u, z: [head, t] });
        let w = part.frame;
        // Panes of one building have nearly one colour.
        let mut whole = mesh::RandomStream::named(self.look.seed, 0x91a5);
        let hue = *whole.pick(&[[40, 66, 84], [52, 74, 78], [34, 46, 60], [66, 82, 92]]);
        let dice = self.random.unit();
        let rgb = if dice < 0.16 { BLINDS[(dice * 18.0) as usize % 3] } else { hue };
        self.pane([l + w, r - w], [head + w, t - w], -0.01, rgb);
        if part.fin > 0.0 && self.fine != Fineness::Flat {
            self.canvas.paint(frame);
            let ([l, r], o) = ([l - 0.03, l + 0.03], part.fin);
            self.canvas.rect([l, r], area.z, o);
            self.canvas.quad([[l, b, o], [l, t, o], [l, t, 0.0], [l, b, 0.0]]);
            self.canvas.quad([[r, b, 0.0], [r, t, 0.0], [r, t, o], [r, b, o]]);
        }
    }

    /// Adds a vertical cylinder at (u, o) between two heights.
    pub(super) fn post(&mut self, [u, o]: [f32; 2], z: [f32; 2], radius: f32, sides: u32) {
        let [foot, head] = z.map(|z| self.canvas.at([u, z, o]));
        self.canvas.builder().rod(foot, head, radius, sides);
    }
}
