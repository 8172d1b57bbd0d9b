use glam::{DVec2, Vec2, dvec2, vec2};

/// The use of a cell, as bits.
pub(super) mod ground {
    /// Carriageways.
    pub(crate) const CARRIAGEWAY: u8 = 1;
    /// Sidewalks.
    pub(crate) const WALK: u8 = 2;
    /// Verges and islands that belong to a road.
    pub(crate) const VERGE: u8 = 4;
    /// A building, or its yard.
    pub(crate) const BUILT: u8 = 8;
    /// A tree, a pole, a bench.
    pub(crate) const FURNITURE: u8 = 16;
    /// Ground that stays free for sight or for walking.
    pub(crate) const CLEAR: u8 = 32;

    /// Paved ground, on which objects may stand.
    pub(crate) const PAVED: u8 = 64;
    /// Ground that buses sweep where they turn.
    pub(crate) const SWEPT: u8 = 128;

    /// All parts of a road.
    pub(crate) const ROAD: u8 = CARRIAGEWAY | WALK | VERGE;
    /// Everything that blocks an object.
    pub(crate) const ANY: u8 = ROAD | BUILT | FURNITURE | CLEAR | SWEPT;
    /// Everything that blocks an object that may stand on sidewalks and verges.
    pub(crate) const BESIDE: u8 = ANY & !(WALK | VERGE);
}

/// The plan of the town as small square cells. An object covers every cell that it touches, so a
/// free cell is entirely free.
#[derive(Debug)]
pub(super) struct Raster {
    low: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    cells: Vec<u8>,
}

/// The smallest cell size. Metres.
const FINEST_M: f32 = 0.5;
/// The most cells; larger towns have larger cells.
const CELLS_MAX: f32 = 3.2e7;

/// The number of corners up to which outlines need no allocation.
const FEW: usize = 8;

/// Returns the size of the cells with which a plan has as many cells as it may have.
pub(super) fn coarsest_m(size: Vec2) -> f32 {
    (size.x * size.y / CELLS_MAX).sqrt()
}

impl Raster {
    pub(super) fn new(low: Vec2, high: Vec2) -> Raster {
        let size = high - low;
        let cell_m = FINEST_M.max(coarsest_m(size));
        let columns = (size.x / cell_m).ceil() as usize + 1;
        let rows = (size.y / cell_m).ceil() as usize + 1;
        Raster { low, cell_m, columns, rows, cells: vec![0; columns * rows] }
    }

    /// Calls `visit` with each run of cells that a convex outline touches, until it returns false;
    /// returns false if the outline leaves the raster.
    fn runs(
        &self,
        outline: &[Vec2],
        mut visit: impl FnMut(std::ops::Range<usize>) -> bool,
    ) -> bool {
        let mut few = [Vec2::ZERO; FEW];
        let mut many = Vec::new();
        let points = if outline.len() <= FEW {
            &mut few[..outline.len()]
        } else {
            many.resize(outline.len(), Vec2::ZERO);
            &mut many[..]
        };
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        for (point, corner) in points.iter_mut().zip(outline) {
            *point = (*corner - self.low) / self.cell_m;
            (low, high) = (low.min(*point), high.max(*point));
        }
        let limit = vec2(self.columns as f32, self.rows as f32);
        if !(low.cmpge(Vec2::ZERO).all() && high.cmplt(limit).all()) {
            return false;
        }
        for row in low.y as usize..=high.y as usize {
            let (band_low, band_high) = (row as f32, row as f32 + 1.0);
            let (mut left, mut right) = (f32::MAX, f32::MIN);
            for index in 0..points.len() {
                let (a, b) = (points[index], points[(index + 1) % points.len()]);
                let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
                if b.y < band_low || a.y > band_high {
                    continue;
                }
                // A clipped edge has its extreme x where it enters or leaves the band.
                for y in [a.y.max(band_low), b.y.min(band_high)] {
                    let fraction = if b.y > a.y { (y - a.y) / (b.y - a.y) } else { 0.0 };
                    let x = a.x + (b.x - a.x) * fraction;
                    (left, right) = (left.min(x), right.max(x));
                }
                if a.y == b.y {
                    (left, right) = (left.min(b.x), right.max(b.x));
                }
            }
            if left <= right {
                let start = row * self.columns;
                let last = (right as usize).min(self.columns - 1);
                if !visit(start + left.max(0.0) as usize..start + last + 1) {
                    break;
                }
            }
        }
        true
    }

    /// Marks every cell that a convex outline touches.
    pub(super) fn stamp(&mut self, outline: &[Vec2], bits: u8) {
        let mut cells = std::mem::take(&mut self.cells);
        self.runs(outline, |run| {
            cells[run].iter_mut().for_each(|cell| *cell |= bits);
            true
        });
        self.cells = cells;
    }

    /// Whether a convex outline lies on the raster and touches no cell with any of `bits`.
    pub(super) fn is_free(&self, outline: &[Vec2], bits: u8) -> bool {
        let mut free = true;
        let inside = self.runs(outline, |run| {
            free = self.cells[run].iter().all(|cell| cell & bits == 0);
            free
        });
        free && inside
    }

    /// The bits of the cell at a point; 0 outside.
    pub(super) fn at(&self, point: Vec2) -> u8 {
        let p = ((point - self.low) / self.cell_m).floor();
        if p.x < 0.0 || p.y < 0.0 || p.x >= self.columns as f32 || p.y >= self.rows as f32 {
            return 0;
        }
        self.cells[p.y as usize * self.columns + p.x as usize]
    }

    /// How many columns and rows of cells there are.
    pub(super) fn size(&self) -> (i32, i32) {
        (self.columns as i32, self.rows as i32)
    }

    /// The bits of a cell; 0 outside.
    pub(super) fn cell(&self, column: i32, row: i32) -> u8 {
        let inside =
            (0..self.columns as i32).contains(&column) && (0..self.rows as i32).contains(&row);
        if inside { self.cells[row as usize * self.columns + column as usize] } else { 0 }
    }

    /// The position of the corner of cells at this column and row.
    pub(super) fn corner(&self, at: Vec2) -> Vec2 {
        self.low + at * self.cell_m
    }

    /// Marks the free cells of each area enclosed by roads with the bits that `bits` returns for
    /// its size in square metres and its middle.
    pub(super) fn stamp_patches(&mut self, bits: impl Fn(f32, Vec2) -> u8) {
        let runs = self.free_runs();
        // Each run points to another run of its area, and finally to the first one.
        let mut first: Vec<usize> = (0..runs.len()).collect();
        let mut above = 0;
        for (number, run) in runs.iter().enumerate() {
            while above < number
                && (runs[above].row + 1 < run.row
                    || (runs[above].row + 1 == run.row && runs[above].end <= run.start))
            {
                above += 1;
            }
            let neighbours = runs[above..number].iter().zip(above..);
            for (_, other) in
                neighbours.take_while(|(other, _)| other.row < run.row && other.start < run.end)
            {
                let (a, b) = (root(&mut first, other), root(&mut first, number));
                first[a.max(b)] = a.min(b);
            }
        }
        let mut sums = vec![(0.0f64, DVec2::ZERO); runs.len()];
        for (number, run) in runs.iter().enumerate() {
            let (count, middle) =
                ((run.end - run.start) as f64, (run.start + run.end) as f64 * 0.5);
            let sum = &mut sums[root(&mut first, number)];
            sum.0 += count;
            sum.1 += count * dvec2(middle, run.row as f64 + 0.5);
        }
        for (number, run) in runs.iter().enumerate() {
            let (count, sum) = sums[root(&mut first, number)];
            let area = count as f32 * self.cell_m * self.cell_m;
            let bits = bits(area, self.corner((sum / count).as_vec2()));
            if bits != 0 {
                let row = run.row * self.columns;
                self.cells[row + run.start..row + run.end]
                    .iter_mut()
                    .for_each(|cell| *cell |= bits);
            }
        }
    }

    /// The longest runs of cells that no road touches, row by row.
    fn free_runs(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for (row, cells) in self.cells.chunks_exact(self.columns).enumerate() {
            let mut start = 0;
            for stretch in cells.chunk_by(|a, b| (a & ground::ROAD == 0) == (b & ground::ROAD == 0))
            {
                let end = start + stretch.len();
                if stretch[0] & ground::ROAD == 0 {
                    runs.push(Run { row, start, end });
                }
                start = end;
            }
        }
        runs
    }
}

/// Adjacent cells of one row.
struct Run {
    row: usize,
    start: usize,
    end: usize,
}

/// The first run of the area that contains `run`.
fn root(first: &mut [usize], mut run: usize) -> usize {
    while first[run] != run {
        first[run] = first[first[run]];
        run = first[run];
    }
    run
}

/// The corners of a rectangle about `center`, counter-clockwise.
pub(super) fn rectangle(center: Vec2, half: Vec2, yaw_rad: f32) -> [Vec2; 4] {
    let (x, y) = (Vec2::from_angle(yaw_rad) * half.x, Vec2::from_angle(yaw_rad).perp() * half.y);
    [center - x - y, center + x - y, center + x + y, center - x + y]
}

/// A square about `center`, for round objects.
pub(super) fn square(center: Vec2, half: f32) -> [Vec2; 4] {
    rectangle(center, Vec2::splat(half), 0.0)
}
