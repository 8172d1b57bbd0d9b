//! Road marks as lines with offsets, widths and dashes.

use mesh::Material;

use crate::mark::{MarkColor, MarkKind, RoadMark};

/// One painted line on a border, where one mark applies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// Begin and end of the mark, metres of s.
    pub(super) from_m: f64,
    pub(super) to_m: f64,
    /// Edges of the line, metres of t from the border.
    pub(super) right_m: f64,
    pub(super) left_m: f64,
    dash: Option<Dash>,
    pub(super) material: Material,
}

/// Painted for `length_m` at `phase_m` and every `period_m` after it; once if the period is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Dash {
    phase_m: f64,
    length_m: f64,
    period_m: f64,
}

/// Lengths of dashes and gaps where the file does not say, on motorways and elsewhere, metres.
const DASH_FAST_M: (f64, f64) = (6.0, 12.0);
const DASH_M: (f64, f64) = (3.0, 6.0);
const DOT_M: (f64, f64) = (0.12, 0.9);

/// Returns the lines of a border's marks. `inwards` is +1 where the road's middle lies left of the
/// border.
pub(super) fn lines(
    marks: &[RoadMark],
    start_m: f64,
    end_m: f64,
    inwards: f64,
    fast: bool,
) -> Vec<Line> {
    let mut lines = Vec::new();
    for (index, mark) in marks.iter().enumerate() {
        let from_m = (start_m + mark.from_m).max(start_m);
        let to_m = match marks.get(index + 1) {
            Some(next) => (start_m + next.from_m).min(end_m),
            None => end_m,
        };
        if to_m - from_m < 0.05 {
            continue;
        }
        let material = match mark.color {
            MarkColor::Yellow | MarkColor::Orange => Material::PaintYellow,
            _ => Material::PaintWhite,
        };
        let mut add = |middle: f64, width: f64, dash: Option<Dash>| {
            if width > 1e-3 {
                let (right_m, left_m) = (middle - 0.5 * width, middle + 0.5 * width);
                lines.push(Line { from_m, to_m, right_m, left_m, dash, material });
            }
        };
        if mark.lines.iter().any(|line| line.width_m > 0.0) && drawn(mark.kind) {
            for line in &mark.lines {
                let dash = (line.once || line.space_m > 0.0).then_some(Dash {
                    phase_m: from_m + line.offset_s_m,
                    length_m: line.length_m,
                    period_m: if line.once { 0.0 } else { line.length_m + line.space_m },
                });
                add(line.offset_t_m, line.width_m, dash);
            }
            continue;
        }
        let (length, space) = match (mark.kind, fast) {
            (MarkKind::BottsDots, _) => DOT_M,
            (_, true) => DASH_FAST_M,
            _ => DASH_M,
        };
        // Counted from the road's start, so that the pattern continues over sections.
        let dashes = Some(Dash { phase_m: 0.0, length_m: length, period_m: length + space });
        let width = mark.width_m;
        // Two lines have a gap of one line's width; the first of the name is on the inner side.
        let (inner, outer) = (inwards * width, -inwards * width);
        match mark.kind {
            MarkKind::Solid => add(0.0, width, None),
            MarkKind::Broken | MarkKind::BottsDots => add(0.0, width, dashes),
            MarkKind::SolidSolid => {
                add(inner, width, None);
                add(outer, width, None);
            }
            MarkKind::SolidBroken => {
                add(inner, width, None);
                add(outer, width, dashes);
            }
            MarkKind::BrokenSolid => {
                add(inner, width, dashes);
                add(outer, width, None);
            }
            MarkKind::BrokenBroken => {
                add(inner, width, dashes);
                add(outer, width, dashes);
            }
            MarkKind::None
            | MarkKind::Grass
            | MarkKind::Curb
            | MarkKind::Edge
            | MarkKind::Other => {}
        }
    }
    lines
}

fn drawn(kind: MarkKind) -> bool {
    !matches!(kind, MarkKind::None | MarkKind::Grass | MarkKind::Curb | MarkKind::Edge)
}

impl Line {
    /// Returns whether there is paint at `s`.
    pub(super) fn paints(&self, s: f64) -> bool {
        if s < self.from_m || s > self.to_m {
            return false;
        }
        match self.dash {
            None => true,
            Some(dash) if dash.period_m <= 0.0 => {
                (dash.phase_m..dash.phase_m + dash.length_m).contains(&s)
            }
            Some(dash) => (s - dash.phase_m).rem_euclid(dash.period_m) < dash.length_m,
        }
    }

    /// Appends where paint begins and ends within the section.
    pub(super) fn ends(&self, out: &mut Vec<f64>) {
        out.push(self.from_m);
        out.push(self.to_m);
        let Some(dash) = self.dash else { return };
        if dash.period_m <= 0.0 {
            out.push(dash.phase_m);
            out.push(dash.phase_m + dash.length_m);
            return;
        }
        // Dashes shorter than this are drawn as one line; a file may ask for millions.
        let period = dash.period_m.max(0.2);
        let first = ((self.from_m - dash.phase_m) / period).floor() as i64;
        let last = ((self.to_m - dash.phase_m) / period).ceil() as i64;
        for dash_index in first..=last.min(first + 1_000_000) {
            let at = dash.phase_m + dash_index as f64 * period;
            for end in [at, at + dash.length_m] {
                if end > self.from_m && end < self.to_m {
                    out.push(end);
                }
            }
        }
    }
}
