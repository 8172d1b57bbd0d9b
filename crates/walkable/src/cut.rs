//! Splits line segments at their intersections.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3Swizzles};

/// Edge of a cell within which lines are compared. Metres.
const CELL_M: f64 = 4.0;
/// An end that lies this near to another line lies on it. Metres.
const TOUCH_M: f64 = 0.02;

/// Returns each line as a list of points, its ends and intersections included. The height of an
/// intersection is NaN, unless it is the end of a line.
pub(crate) fn cut(lines: &[(DVec3, DVec3)]) -> Vec<Vec<DVec3>> {
    let mut cells: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for (index, (a, b)) in lines.iter().enumerate() {
        let [low, high] = [a.xy().min(b.xy()), a.xy().max(b.xy())];
        let ([x, y], [u, v]) = (cell(low - TOUCH_M), cell(high + TOUCH_M));
        for column in x..=u {
            for row in y..=v {
                cells.entry([column, row]).or_default().push(index);
            }
        }
    }
    // By line: the fraction of the line, and the point.
    let mut cuts: Vec<Vec<(f64, DVec3)>> = vec![Vec::new(); lines.len()];
    for lines_of_cell in cells.values() {
        for (at, first) in lines_of_cell.iter().enumerate() {
            for second in &lines_of_cell[at + 1..] {
                for (one, other) in [(first, second), (second, first)] {
                    let (line, through) = (lines[*one], lines[*other]);
                    for end in [through.0, through.1] {
                        if let Some(along) = touch(line, end.xy()) {
                            cuts[*one].push((along, end));
                        }
                    }
                }
                if let Some((along, beside)) = cross(lines[*first], lines[*second]) {
                    let (a, b) = lines[*first];
                    let point = a.xy().lerp(b.xy(), along).extend(f64::NAN);
                    cuts[*first].push((along, point));
                    cuts[*second].push((beside, point));
                }
            }
        }
    }
    let whole = lines.iter().zip(cuts).map(|((a, b), mut cuts)| {
        cuts.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let inner = cuts.into_iter().map(|(_, point)| point);
        [*a].into_iter().chain(inner).chain([*b]).collect()
    });
    whole.collect()
}

fn cell(at: DVec2) -> [i64; 2] {
    (at / CELL_M).floor().to_array().map(|v| v as i64)
}

/// Returns the fraction of a line at which a point lies on it, unless the point is at an end.
fn touch((a, b): (DVec3, DVec3), at: DVec2) -> Option<f64> {
    let way = b.xy() - a.xy();
    let along = (at - a.xy()).dot(way) / way.length_squared().max(1e-12);
    let near = a.xy() + way * along;
    let is_inner = near.distance(a.xy()) > TOUCH_M && near.distance(b.xy()) > TOUCH_M;
    ((0.0..=1.0).contains(&along) && is_inner && near.distance(at) < TOUCH_M).then_some(along)
}

/// Returns the fractions of two lines at which they cross, if both cross between their ends.
fn cross(one: (DVec3, DVec3), other: (DVec3, DVec3)) -> Option<(f64, f64)> {
    let (a, c) = (one.0.xy(), other.0.xy());
    let (way, through) = (one.1.xy() - a, other.1.xy() - c);
    let turn = way.perp_dot(through);
    if turn.abs() < 1e-9 {
        return None;
    }
    let along = (c - a).perp_dot(through) / turn;
    let beside = (c - a).perp_dot(way) / turn;
    let is_inner = |share: f64, length_m: f64| {
        share * length_m > TOUCH_M && (1.0 - share) * length_m > TOUCH_M
    };
    (is_inner(along, way.length()) && is_inner(beside, through.length())).then_some((along, beside))
}
