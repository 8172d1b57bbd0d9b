use glam::{Vec2, Vec3};
use road::Mesh;

/// Finds the triangles over or under a point of the plan.
#[derive(Debug)]
pub(super) struct TriangleIndex {
    low: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// Where each cell's list begins in `members`.
    starts: Vec<u32>,
    members: Vec<u32>,
    corners: Vec<[Vec3; 3]>,
}

impl TriangleIndex {
    /// Over the triangles of `mesh` that face up and that `keep` wants, by their number.
    pub(super) fn new(mesh: &Mesh, keep: impl Fn(usize) -> bool) -> TriangleIndex {
        let mut corners = Vec::new();
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            if keep(number) && (b - a).truncate().perp_dot((c - a).truncate()) > 1e-6 {
                corners.push([a, b, c]);
            }
        }
        let (mut low, mut high) = (Vec2::splat(1e9), Vec2::splat(-1e9));
        for corner in corners.iter().flatten() {
            (low, high) = (low.min(corner.truncate()), high.max(corner.truncate()));
        }
        let size = (high - low).max(Vec2::ONE);
        // Roads fill a small part of the plan, in several layers where they meet.
        let cell_m = (size.x * size.y / (corners.len() as f32 + 1.0) * 0.4).sqrt().clamp(0.8, 25.0);
        let (columns, rows) = ((size.x / cell_m) as usize + 1, (size.y / cell_m) as usize + 1);
        let mut index = TriangleIndex {
            low,
            cell_m,
            columns,
            rows,
            starts: Vec::new(),
            members: Vec::new(),
            corners,
        };
        let mut counts = vec![0u32; columns * rows + 1];
        for number in 0..index.corners.len() {
            index.cells(number, |cell| counts[cell + 1] += 1);
        }
        for cell in 0..columns * rows {
            counts[cell + 1] += counts[cell];
        }
        let mut members = vec![0u32; counts[columns * rows] as usize];
        let mut next = counts.clone();
        for number in 0..index.corners.len() {
            index.cells(number, |cell| {
                members[next[cell] as usize] = number as u32;
                next[cell] += 1;
            });
        }
        index.starts = counts;
        index.members = members;
        index
    }

    fn cells(&self, number: usize, mut visit: impl FnMut(usize)) {
        let [a, b, c] = self.corners[number].map(|p| (p.truncate() - self.low) / self.cell_m);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for row in low.y as usize..=(high.y as usize).min(self.rows - 1) {
            for column in low.x as usize..=(high.x as usize).min(self.columns - 1) {
                visit(row * self.columns + column);
            }
        }
    }

    /// Calls `visit` with the height of every triangle that covers `point`, its border included.
    pub(super) fn heights(&self, point: Vec2, mut visit: impl FnMut(f32)) {
        let p = (point - self.low) / self.cell_m;
        if p.x < 0.0 || p.y < 0.0 || p.x as usize >= self.columns || p.y as usize >= self.rows {
            return;
        }
        let cell = p.y as usize * self.columns + p.x as usize;
        for number in &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            let [a, b, c] = self.corners[*number as usize];
            let (ab, ac, ap) = ((b - a).truncate(), (c - a).truncate(), point - a.truncate());
            let area = ab.perp_dot(ac);
            let (v, w) = (ap.perp_dot(ac) / area, ab.perp_dot(ap) / area);
            if v >= -1e-5 && w >= -1e-5 && v + w <= 1.0 + 1e-5 {
                visit(a.z + (b.z - a.z) * v + (c.z - a.z) * w);
            }
        }
    }

    /// Whether any triangle covers `point`.
    pub(super) fn covers(&self, point: Vec2) -> bool {
        let mut found = false;
        self.heights(point, |_| found = true);
        found
    }

    /// The lowest triangle's height at `point`.
    pub(super) fn lowest(&self, point: Vec2) -> Option<f32> {
        let mut lowest = None;
        self.heights(point, |z| lowest = Some(lowest.map_or(z, |other: f32| other.min(z))));
        lowest
    }

    /// The highest triangle's height at `point` that is not above `limit`.
    pub(super) fn topmost(&self, point: Vec2, limit: f32) -> Option<f32> {
        let mut topmost: Option<f32> = None;
        self.heights(point, |z| {
            if z <= limit && topmost.is_none_or(|other| z > other) {
                topmost = Some(z);
            }
        });
        topmost
    }

    /// The height at `point` of the triangle nearest to `z`.
    pub(super) fn nearest(&self, point: Vec2, z: f32) -> Option<f32> {
        let mut nearest: Option<f32> = None;
        self.heights(point, |height| {
            if nearest.is_none_or(|other| (height - z).abs() < (other - z).abs()) {
                nearest = Some(height);
            }
        });
        nearest
    }
}
