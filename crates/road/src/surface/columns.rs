//! The cross-section of a lane section: strips, the lines between them, and the columns of cells
//! between the lines. From left to right, that is by falling t.

use glam::DVec3;
use mesh::{Face, Material, Tag};

use super::{
    faces::ASPHALT,
    paint::{self, Line},
};
use crate::{
    axes::RoadAxes,
    blend::Blend,
    lane::{Lane, LaneType, LaneTypes},
    mark::{MarkKind, RoadMark},
    network::Network,
    road::{Road, Section},
};

/// Height of a kerb where the file does not say, metres.
const KERB_M: f64 = 0.12;
/// Width of a kerb stone, metres.
const STONE_M: f64 = 0.15;
/// Widest cells where heights are blended or bend across the road, metres.
const FINE_M: f64 = 0.9;
/// How deep the outer edge of the surface reaches into the ground, metres.
const SKIRT_M: f64 = 0.4;

/// A lane, or the kerb stone at the road's outer edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strip {
    /// Position in the section's lanes.
    pub(super) lane: Option<usize>,
    face: Face,
    /// Whether it is a surface for vehicles, which does not yield.
    pub(super) paved: bool,
    /// How far it is raised beyond the file's height, metres.
    raise_m: f64,
    /// Whether it has heights of its own.
    uneven: bool,
}

/// A line along the road.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridLine {
    border: usize,
    offset_m: f64,
    /// Additional offset to the right, as a fraction of the strip's width.
    share: f64,
    /// The strip whose surface it lies on.
    pub(super) strip: usize,
    drop_m: f64,
    /// Index into [`Profile::paints`] of the paint that requires further stations.
    pub(super) paint: Option<usize>,
}

/// What the cells between two lines show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Look {
    /// The face of the strip.
    Plain,
    /// Top of a kerb stone.
    Stone,
    /// Upright face between strips of different heights.
    Step,
    /// Upright face at the road's outer edge.
    Skirt,
    /// Paint of one of [`Profile::paints`], at this offset from its border.
    Paint(usize, f64),
}

/// Cells between line `n` and line `n + 1`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) strip: usize,
    pub(super) look: Look,
}

/// The marks on one border.
#[derive(Debug)]
pub(super) struct Paint {
    pub(super) lines: Vec<Line>,
    /// Where paint begins and ends, in rising s.
    pub(super) ends: Vec<f64>,
}

/// The whole cross-section.
pub(super) struct Profile<'a> {
    network: &'a Network,
    road: &'a Road,
    section: &'a Section,
    pub(super) strips: Vec<Strip>,
    pub(super) lines: Vec<GridLine>,
    pub(super) columns: Vec<Column>,
    pub(super) paints: Vec<Paint>,
    /// Number of strips before the first lane.
    ahead: usize,
    /// Present where the junction's roads contradict each other in height.
    blend: Option<&'a Blend<'a>>,
}

impl<'a> Profile<'a> {
    pub(super) fn new(
        network: &'a Network,
        road: &'a Road,
        section: &'a Section,
        blend: Option<&'a Blend<'a>>,
    ) -> Profile<'a> {
        let mut profile = Profile {
            network,
            road,
            section,
            strips: Vec::new(),
            lines: Vec::new(),
            columns: Vec::new(),
            paints: Vec::new(),
            ahead: 0,
            blend,
        };
        profile.lay_strips();
        if !profile.strips.is_empty() {
            profile.draw_lines();
        }
        profile
    }

    fn lane(&self, position: usize) -> &'a Lane {
        self.network.lane(self.section.lanes[position])
    }

    fn lay_strips(&mut self) {
        let count = self.section.lanes.len();
        if count == 0 {
            return;
        }
        let own_heights = self.road.sections.iter().flat_map(|section| &section.lanes);
        let own_heights = own_heights
            .map(|lane| self.network.lane(*lane))
            .any(|lane| lane.heights.iter().any(|h| h.inner_m.max(h.outer_m) > 0.01));
        let in_junction = self.road.junction.is_some();
        let stone = Strip {
            lane: None,
            face: Face::new(Tag::SideWalks, Material::Kerb, 0),
            paved: false,
            raise_m: KERB_M,
            uneven: false,
        };
        let kerbed = |marks: &[RoadMark]| marks.iter().any(|mark| mark.kind == MarkKind::Curb);
        // A kerb beyond the last lane is a strip of its own.
        let edge = |position: usize| {
            let lane = self.lane(position);
            LaneTypes::PAVED.contains(lane.kind)
                && kerbed(&lane.marks)
                && !in_junction
                && !own_heights
        };
        let left_stone = self.section.left > 0 && edge(0);
        let right_stone = self.section.left < count && edge(count - 1);
        if left_stone {
            self.strips.push(stone);
            self.ahead = 1;
        }
        for position in 0..count {
            let lane = self.lane(position);
            let inner =
                if position < self.section.left { position + 1 } else { position.wrapping_sub(1) };
            let inner = (inner < count
                && (inner < self.section.left) == (position < self.section.left))
                .then(|| self.lane(inner));
            let behind_kerb = match inner {
                Some(inner) => kerbed(&inner.marks),
                None => kerbed(&self.section.marks),
            };
            let raised = match lane.kind {
                LaneType::Sidewalk | LaneType::Median => true,
                LaneType::None => behind_kerb && !in_junction,
                _ => false,
            };
            // A border or cycle track that the file itself raises is treated like a sidewalk.
            let island = !LaneTypes::DRIVABLE.contains(lane.kind)
                && !lane.heights.is_empty()
                && lane.heights.iter().all(|height| height.inner_m.min(height.outer_m) > 0.05);
            let paved = LaneTypes::PAVED.contains(lane.kind)
                || (lane.kind == LaneType::None && in_junction);
            self.strips.push(Strip {
                lane: Some(position),
                face: if island { PAVEMENT } else { face(lane.kind, in_junction) },
                paved: paved && !island,
                raise_m: if raised && !own_heights { KERB_M } else { 0.0 },
                uneven: !lane.heights.is_empty(),
            });
        }
        if right_stone {
            self.strips.push(stone);
        }
    }

    fn draw_lines(&mut self) {
        let last = self.strips.len();
        for border in 0..=last {
            let left = border.checked_sub(1);
            let right = (border < last).then_some(border);
            let lower = self.lower(left, right);
            let paint = self.paint(border, left, right, lower);
            match (left, right) {
                (Some(left), Some(right)) if lower.is_none() => {
                    self.shared_border(border, paint, left, right);
                }
                _ => {
                    let on =
                        |strip| if lower.is_none_or(|lower| lower == strip) { paint } else { None };
                    if let Some(left) = left {
                        self.border_from_left(border, on(left), left, right.is_some());
                    } else if let Some(right) = right {
                        self.line(border, 0.0, right, SKIRT_M, None);
                        self.column(right, Look::Skirt);
                    }
                    if let Some(right) = right {
                        self.border_to_right(border, on(right), right, left.is_some());
                    } else if let Some(left) = left {
                        self.line(border, 0.0, left, SKIRT_M, None);
                    }
                }
            }
            if let Some(right) = right {
                self.column(right, Look::Plain);
                self.fine_lines(border, right);
            }
        }
    }

    /// Returns how many cells a plain strip is wide.
    pub(super) fn pieces(&self, strip: usize) -> usize {
        let follows = self.blend.is_some() || self.road.bends_across();
        let Some(position) = self.strips[strip].lane.filter(|_| follows) else { return 1 };
        let lane = self.lane(position);
        let widths =
            [0.0, 0.5, 1.0].map(|share| lane.width_from(0.0, share * self.section.length_m));
        let width = widths.into_iter().fold(0.0, f64::max);
        (width / FINE_M).ceil().clamp(1.0, 32.0) as usize
    }

    /// Adds lines inside a strip whose height follows other roads or bends by itself.
    fn fine_lines(&mut self, border: usize, strip: usize) {
        let pieces = self.pieces(strip);
        for piece in 1..pieces {
            let share = piece as f64 / pieces as f64;
            let line = GridLine { border, offset_m: 0.0, share, strip, drop_m: 0.0, paint: None };
            self.lines.push(line);
            self.column(strip, Look::Plain);
        }
    }

    /// Adds a border in the middle of one surface.
    fn shared_border(&mut self, border: usize, paint: Option<usize>, left: usize, right: usize) {
        let Some(index) = paint else { return self.line(border, 0.0, left, 0.0, None) };
        let offsets = self.offsets(index);
        for (at, offset) in offsets.iter().enumerate() {
            let strip = if *offset >= 0.0 { left } else { right };
            self.line(border, *offset, strip, 0.0, paint);
            if let Some(next) = offsets.get(at + 1) {
                self.column(strip, Look::Paint(index, 0.5 * (offset + next)));
            }
        }
    }

    /// Adds what lies left of a border at which the left strip's surface ends, and the upright
    /// column that begins there.
    fn border_from_left(&mut self, border: usize, paint: Option<usize>, strip: usize, step: bool) {
        if step && self.has_stone(strip) {
            self.line(border, STONE_M, strip, 0.0, None);
            self.column(strip, Look::Stone);
        }
        if let Some(index) = paint {
            let mut offsets = self.offsets(index);
            offsets.retain(|offset| *offset > 1e-3);
            for (at, offset) in offsets.iter().enumerate() {
                let next = offsets.get(at + 1).unwrap_or(&0.0);
                self.line(border, *offset, strip, 0.0, paint);
                self.column(strip, Look::Paint(index, 0.5 * (offset + next)));
            }
        }
        self.line(border, 0.0, strip, 0.0, paint);
        self.column(strip, if step { Look::Step } else { Look::Skirt });
    }

    /// Adds what lies right of a border at which the right strip's surface begins.
    fn border_to_right(&mut self, border: usize, paint: Option<usize>, strip: usize, step: bool) {
        self.line(border, 0.0, strip, 0.0, paint);
        if let Some(index) = paint {
            let mut before = 0.0;
            for offset in self.offsets(index) {
                if offset < -1e-3 {
                    self.column(strip, Look::Paint(index, 0.5 * (before + offset)));
                    self.line(border, offset, strip, 0.0, paint);
                    before = offset;
                }
            }
        }
        if step && self.has_stone(strip) {
            self.column(strip, Look::Stone);
            self.line(border, -STONE_M, strip, 0.0, None);
        }
    }

    /// Returns whether the strip's edge has a kerb stone.
    fn has_stone(&self, strip: usize) -> bool {
        let strip = &self.strips[strip];
        strip.lane.is_some() && !strip.paved && (strip.raise_m > 0.0 || strip.uneven)
    }

    /// Returns the edges of a border's lines, from left to right.
    fn offsets(&self, paint: usize) -> Vec<f64> {
        let lines = &self.paints[paint].lines;
        let mut offsets: Vec<f64> =
            lines.iter().flat_map(|line| [line.left_m, line.right_m]).collect();
        offsets.sort_by(|a, b| b.total_cmp(a));
        offsets.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
        offsets
    }

    fn line(
        &mut self,
        border: usize,
        offset_m: f64,
        strip: usize,
        drop_m: f64,
        paint: Option<usize>,
    ) {
        self.lines.push(GridLine { border, offset_m, share: 0.0, strip, drop_m, paint });
    }

    /// Adds the column from the previous line to the next one.
    fn column(&mut self, strip: usize, look: Look) {
        self.columns.push(Column { strip, look });
    }

    /// Returns the strip whose surface is the lower one at their common border, if they need a line
    /// each.
    fn lower(&self, left: Option<usize>, right: Option<usize>) -> Option<usize> {
        let (left, right) = (left?, right?);
        let (a, b) = (&self.strips[left], &self.strips[right]);
        if a.raise_m == b.raise_m
            && !a.uneven
            && !b.uneven
            && a.face == b.face
            && a.paved == b.paved
        {
            return None;
        }
        Some(match (a.paved, b.paved) {
            (true, false) => left,
            (false, true) => right,
            _ if a.raise_m <= b.raise_m => left,
            _ => right,
        })
    }

    /// Adds the marks of a border, moved beside it where it is a kerb or the road's edge.
    fn paint(
        &mut self,
        border: usize,
        left: Option<usize>,
        right: Option<usize>,
        lower: Option<usize>,
    ) -> Option<usize> {
        let (start, end) = (self.section.start_m, self.section.start_m + self.section.length_m);
        let centre = self.ahead + self.section.left;
        let (marks, inwards): (&[RoadMark], f64) = if border == centre {
            (&self.section.marks, 1.0)
        } else if border < centre {
            let position = self.strips.get(border)?.lane?;
            (&self.lane(position).marks, -1.0)
        } else {
            let position = self.strips.get(border - 1)?.lane?;
            (&self.lane(position).marks, 1.0)
        };
        let fast = self.road.type_at(start).is_some_and(|kind| kind.kind == "motorway");
        let mut lines = paint::lines(marks, start, end, inwards, fast);
        if lines.is_empty() {
            return None;
        }
        let only = match (left, right) {
            (None, only) | (only, None) => only,
            _ => lower,
        };
        if let Some(only) = only {
            if !self.strips[only].paved {
                return None;
            }
            let low = lines.iter().map(|line| line.right_m).fold(f64::INFINITY, f64::min);
            let high = lines.iter().map(|line| line.left_m).fold(f64::NEG_INFINITY, f64::max);
            let shift = if Some(only) == left { -low } else { -high };
            for line in &mut lines {
                line.left_m += shift;
                line.right_m += shift;
            }
        } else if !left.is_some_and(|strip| self.strips[strip].paved) {
            return None;
        }
        let mut ends = Vec::new();
        lines.iter().for_each(|line| line.ends(&mut ends));
        ends.sort_by(f64::total_cmp);
        self.paints.push(Paint { lines, ends });
        Some(self.paints.len() - 1)
    }
}

/// The cross-section at one station.
pub(super) struct Row {
    pub(super) s: f64,
    pub(super) axes: RoadAxes,
    /// For each border: t, and the part of it on level lanes.
    t: Vec<f64>,
    level: Vec<f64>,
    /// For each strip: heights of its surface above the road's, at its left and right border.
    rise: Vec<[f64; 2]>,
    /// For each line: t.
    lines: Vec<f64>,
}

impl Profile<'_> {
    pub(super) fn row(&self, s: f64) -> Row {
        let ds = s - self.section.start_m;
        let lanes = self.network.lanes();
        let centre = self.section.lane_offset(self.road, s).value;
        let count = self.section.lanes.len();
        let (mut t, mut level) = (vec![centre; count + 1], vec![0.0; count + 1]);
        let mut lay = |position: usize, inner: usize, outer: usize, sign: f64| {
            let lane = &lanes[self.section.lanes[position].0 as usize];
            let width = lane.width_from((t[inner] - centre).abs(), ds);
            t[outer] = t[inner] + sign * width;
            level[outer] = level[inner] + if lane.level { sign * width } else { 0.0 };
        };
        for position in (0..self.section.left).rev() {
            lay(position, position + 1, position, 1.0);
        }
        for position in self.section.left..count {
            lay(position, position, position + 1, -1.0);
        }
        if self.ahead > 0 {
            t.insert(0, t[0] + STONE_M);
            level.insert(0, level[0]);
        }
        if t.len() < self.strips.len() + 1 {
            t.push(t[t.len() - 1] - STONE_M);
            level.push(level[level.len() - 1]);
        }
        let rise = self.strips.iter().map(|strip| {
            let Some(position) = strip.lane else { return [strip.raise_m; 2] };
            let (inner, outer) = lanes[self.section.lanes[position].0 as usize].rise(ds);
            let sides = if position < self.section.left { [outer, inner] } else { [inner, outer] };
            sides.map(|side| side + strip.raise_m)
        });
        let mut row = Row {
            s,
            axes: RoadAxes::new(self.road.station(s)),
            rise: rise.collect(),
            t,
            level,
            lines: Vec::with_capacity(self.lines.len()),
        };
        let mut before = f64::INFINITY;
        for line in &self.lines {
            let (left, right) = (row.t[line.strip], row.t[line.strip + 1]);
            let wanted = row.t[line.border] + line.offset_m - line.share * (left - right);
            let t = wanted.clamp(right, left).min(before);
            row.lines.push(t);
            before = t;
        }
        row
    }

    /// Returns a point of a line; `flat` where its strip has yielded to another road.
    pub(super) fn point(&self, row: &Row, line: usize, flat: bool) -> DVec3 {
        let GridLine { strip, drop_m, .. } = self.lines[line];
        self.strip_point(row, strip, row.lines[line], flat, -drop_m)
    }

    /// Returns a point of a strip's surface at a fraction of its width from the left.
    pub(super) fn across(&self, row: &Row, strip: usize, share: f64, flat: bool) -> DVec3 {
        let t = row.t[strip] + (row.t[strip + 1] - row.t[strip]) * share;
        self.strip_point(row, strip, t, flat, 0.0)
    }

    fn strip_point(&self, row: &Row, strip: usize, t: f64, flat: bool, up: f64) -> DVec3 {
        let (left, right) = (row.t[strip], row.t[strip + 1]);
        let share = if left > right { (left - t) / (left - right) } else { 0.0 };
        let mix = |from: f64, to: f64| from + (to - from) * share;
        let level = mix(row.level[strip], row.level[strip + 1]);
        let rise = if flat { 0.0 } else { mix(row.rise[strip][0], row.rise[strip][1]) };
        let uneven = self.road.unevenness(row.s, t);
        let base = row.axes.point(t, level, uneven);
        let height = self.blend.map_or(base.z, |blend| blend.height(base));
        DVec3::new(base.x, base.y, height + rise + up)
    }

    /// Returns the width of a strip.
    pub(super) fn strip_width(&self, row: &Row, strip: usize) -> f64 {
        row.t[strip] - row.t[strip + 1]
    }

    /// Returns whether a strip's surface stands above the road's.
    pub(super) fn raised(&self, row: &Row, strip: usize) -> bool {
        row.rise[strip].iter().any(|rise| *rise > 0.01)
    }

    /// Returns the face of a cell of `column` whose middle is at `s`.
    pub(super) fn face(&self, column: &Column, s: f64, flat: bool, painted: bool) -> Face {
        let strip = &self.strips[column.strip];
        match column.look {
            Look::Step => Face::new(Tag::SideWalks, Material::Kerb, 0),
            Look::Skirt if strip.raise_m > 0.0 => Face::new(Tag::SideWalks, Material::Kerb, 0),
            Look::Skirt => Face::new(Tag::Terrain, Material::Soil, 0),
            _ if flat => ASPHALT,
            Look::Stone => Face::new(Tag::SideWalks, Material::Kerb, 0),
            Look::Paint(paint, offset) if painted => {
                let line = self.paints[paint]
                    .lines
                    .iter()
                    .find(|line| (line.right_m..line.left_m).contains(&offset) && line.paints(s));
                line.map_or(strip.face, |line| Face::new(Tag::RoadLine, line.material, 0))
            }
            _ => strip.face,
        }
    }

    /// Returns the face of a strip's plain cells.
    pub(super) fn strip_face(&self, strip: usize) -> Face {
        self.strips[strip].face
    }
}

/// The face of sidewalks.
const PAVEMENT: Face =
    Face { tag: Tag::SideWalks as u8, material: Material::Paving as u8, tint: 0, object: 0 };

fn face(kind: LaneType, in_junction: bool) -> Face {
    let (tag, material) = match kind {
        LaneType::Sidewalk => return PAVEMENT,
        LaneType::None if !in_junction => (Tag::Terrain, Material::Grass),
        LaneType::Median => (Tag::Terrain, Material::Grass),
        LaneType::Rail => (Tag::RailTrack, Material::Soil),
        _ => return ASPHALT,
    };
    Face::new(tag, material, 0)
}
