//! Shops: display window, door, sign board with lettering, awning.

use mesh::Material;

use crate::furnish::facade::{
    book::{Book, Paint, ShopPart, Slot},
    grow::{Area, Facade, Fineness},
    letters,
};

/// The width of a shop's door. Metres.
const DOOR_M: f32 = 1.05;
/// The narrowest shop. Metres.
const LEAST_M: f32 = 2.4;

/// The colours of sign boards and awnings, sRGB, each with a colour of letters on it.
const SIGNS: [([u8; 3], [u8; 3]); 10] = [
    ([122, 28, 30], [240, 228, 200]),
    ([28, 52, 88], [240, 240, 236]),
    ([30, 74, 52], [236, 222, 170]),
    ([236, 232, 222], [60, 44, 36]),
    ([40, 40, 44], [232, 196, 96]),
    ([196, 148, 44], [44, 34, 28]),
    ([226, 226, 222], [176, 32, 36]),
    ([88, 50, 86], [240, 230, 236]),
    ([44, 106, 116], [244, 244, 240]),
    ([66, 44, 34], [236, 214, 176]),
];
/// The colours of goods in a display window, sRGB.
const GOODS: [[u8; 3]; 6] =
    [[168, 60, 48], [60, 96, 140], [204, 176, 110], [88, 120, 78], [196, 190, 180], [70, 58, 66]];

impl Facade<'_> {
    /// Adds a shop; wall where it is too narrow.
    pub(super) fn shop(&mut self, area: Area, part: &ShopPart) {
        let foot = area.z[0];
        if area.width() < LEAST_M || foot + part.head + part.sign + 0.1 > area.z[1] {
            self.canvas.wall(area.u, area.z, 0.0, self.paint(part.wall));
            return;
        }
        let (board, ink) = *self.random.pick(&SIGNS);
        let [l, r] = [area.u[0] + 0.12, area.u[1] - 0.12];
        let top = foot + part.head;
        let hole = Area { u: [l, r], z: [foot, top] };
        self.around(area, hole, part.wall);
        let (d, full) = (part.depth, self.fine == Fineness::Full);
        let joinery = match self.random.chance(0.5) {
            true => Paint { material: Material::Wood, rgb: board },
            false => self.paint(Slot::Frame),
        };
        self.canvas.paint(self.paint(part.wall));
        self.canvas.reveal(hole.u, hole.z, 0.0, d);
        // The door is on one side, and stands farther back than the window.
        let left = self.random.chance(0.5);
        let (door, show) = match left {
            true => ([l, l + DOOR_M], [l + DOOR_M, r]),
            false => ([r - DOOR_M, r], [l, r - DOOR_M]),
        };
        self.note("window", Area { u: show, z: [foot + part.riser, top] });
        self.note("door", Area { u: door, z: [foot, top] });
        self.canvas.paint(joinery).rect(door, hole.z, -d);
        self.pane(
            [door[0] + 0.12, door[1] - 0.12],
            [foot + 0.25, foot + 2.1],
            0.012 - d,
            [40, 44, 46],
        );
        self.pane(
            [door[0] + 0.12, door[1] - 0.12],
            [foot + 2.2, top - 0.06],
            0.012 - d,
            [40, 44, 46],
        );
        if full {
            self.canvas.paint(Paint { material: Material::Metal, rgb: [190, 184, 170] });
            let side = if left { door[1] - 0.17 } else { door[0] + 0.17 };
            let z = [foot + 0.85, foot + 1.35];
            self.canvas.ledge([side - 0.02, side + 0.02], z, [0.02 - d, 0.07 - d]);
        }
        self.canvas.paint(joinery);
        self.canvas.ledge(show, [foot, foot + part.riser], [-d, -0.02]);
        self.display(show, [foot + part.riser, top], -d, joinery);
        self.sign(area, [top + 0.06, top + part.sign], board, ink);
        self.canvas.paint(self.paint(Slot::Plinth));
        self.canvas.ledge(hole.u, [-0.6, 0.02], [-d, 0.03]);
        if full && self.random.chance(part.awning) {
            let cloth = if self.random.chance(0.6) { board } else { [196, 186, 164] };
            self.awning([l, r], top + 0.04, part.shade, cloth);
        }
    }

    /// Adds a display window of several panes, with goods behind them.
    fn display(&mut self, u: [f32; 2], z: [f32; 2], o: f32, joinery: Paint) {
        self.canvas.paint(joinery).rect(u, z, o);
        let panes = ((u[1] - u[0]) / 1.7).ceil().max(1.0) as u32;
        let width = (u[1] - u[0] - 0.06) / panes as f32;
        for pane in 0..panes {
            let from = u[0] + 0.06 + width * pane as f32;
            let (l, r) = (from, from + width - 0.06);
            self.pane([l, r], [z[0] + 0.06, z[1] - 0.06], o + 0.012, [50, 48, 44]);
            if self.fine != Fineness::Full {
                continue;
            }
            // Goods and posters, as they are seen through the glass; no two in one plane.
            for good in 0..3 {
                let half = self.random.between(0.08, 0.22);
                let m = self.random.between(l + half + 0.02, r - half - 0.02);
                let high = self.random.between(0.15, (z[1] - z[0]) * 0.55);
                let rgb = *self.random.pick(&GOODS);
                let foot = z[0] + 0.08;
                if r - l > 2.5 * half {
                    self.pane(
                        [m - half, m + half],
                        [foot, foot + high],
                        o + 0.014 + 0.002 * good as f32,
                        rgb,
                    );
                }
            }
        }
    }

    /// Adds a sign board with a name on it.
    fn sign(&mut self, area: Area, z: [f32; 2], board: [u8; 3], ink: [u8; 3]) {
        let u = [area.u[0] + 0.06, area.u[1] - 0.06];
        self.canvas.paint(Paint { material: Material::Plastic, rgb: board });
        self.canvas.ledge(u, z, [0.0, 0.09]);
        let words = &Book::embedded().words;
        if words.is_empty() || self.fine == Fineness::Flat {
            return;
        }
        let name = self.random.pick(words);
        let height = (z[1] - z[0]) * 0.52;
        self.canvas.paint(Paint { material: Material::Sign, rgb: ink });
        let (m, middle) = (area.middle(), (z[0] + z[1]) * 0.5);
        for quad in letters::write(name, (u[1] - u[0]) * 0.86, height) {
            self.canvas.quad(quad.map(|point| [m + point.x, middle + point.y, 0.098]));
        }
    }

    /// Adds an awning with a valance, striped or plain.
    fn awning(&mut self, u: [f32; 2], z: f32, out: f32, cloth: [u8; 3]) {
        let drop = out * 0.42;
        let stripes = if self.random.chance(0.55) { ((u[1] - u[0]) / 0.32) as u32 } else { 1 };
        let width = (u[1] - u[0]) / stripes as f32;
        for stripe in 0..stripes {
            let rgb = if stripe % 2 == 0 { cloth } else { [228, 222, 206] };
            self.canvas.paint(Paint { material: Material::Cloth, rgb });
            let (l, r) = (u[0] + width * stripe as f32, u[0] + width * (stripe + 1) as f32);
            let low = z - drop;
            self.canvas.quad([[l, low, out], [r, low, out], [r, z, 0.02], [l, z, 0.02]]);
            self.canvas.rect([l, r], [low - 0.2, low], out);
        }
        self.canvas.paint(self.paint(Slot::Rail));
        for side in u {
            let [wall, edge] = [[side, z - drop - 0.1, 0.02], [side, z - drop, out]]
                .map(|point| self.canvas.at(point));
            self.canvas.builder().rod(wall, edge, 0.015, 4);
        }
    }
}
