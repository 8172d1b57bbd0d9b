//! The triangles of one lane section.

use glam::DVec3;
use mesh::{Face, Mesh};

use super::{
    columns::{Look, Profile, Row, Strip},
    cover::Cover,
    faces::ASPHALT,
    seam::Rim,
    stations::{NEAR_M, stations},
};
use crate::{blend::Blend, network::Network, road::Section};

/// How far a surface reaches below the one that it meets, and how deep its end lies, metres.
const TONGUE_M: f64 = 0.15;
const TONGUE_DEPTH_M: f64 = 0.02;

/// Longest cells where strips may have to yield, and where heights are blended, metres.
const YIELD_SPACING_M: f64 = 1.5;
const BLEND_SPACING_M: f64 = 0.9;

/// A strip narrower than this does not separate its neighbours, metres.
const RIM_M: f64 = 0.02;

pub(super) fn section(
    network: &Network,
    road_index: usize,
    section_index: usize,
    spacing: f64,
    blend: Option<&Blend>,
    mesh: &mut Mesh,
    rims: &mut Vec<Rim>,
) {
    let road = &network.roads()[road_index];
    let section = &road.sections[section_index];
    let profile = Profile::new(network, road, section, blend);
    if profile.strips.is_empty() || section.length_m <= 0.0 {
        return;
    }
    let wanted: Vec<f64> =
        profile.paints.iter().flat_map(|paint| &paint.lines).map(|line| line.from_m).collect();
    let yields = road.junction.is_some() && profile.strips.iter().any(|strip| !strip.paved);
    let spacing = match (yields, blend) {
        (_, Some(_)) => spacing.min(BLEND_SPACING_M),
        (true, None) => spacing.min(YIELD_SPACING_M),
        (false, None) => spacing,
    };
    let at = stations(network, road, section, spacing, wanted);
    let rows: Vec<Row> = at.iter().map(|s| profile.row(*s)).collect();
    let cover = Cover::new(network, road_index as u32);
    let flat = yielding(&profile, &rows, &cover);
    let mut weaver = Weaver {
        profile: &profile,
        rows: &rows,
        flat: &flat,
        corners: vec![[None; 2]; profile.lines.len() * rows.len()],
        rims: vec![Vec::new(); profile.lines.len()],
        road: road_index as u32,
        tint: if road.junction.is_some() { 0 } else { age(road_index) },
        stops: profile.strips.iter().map(|strip| stop(network, section, strip)).collect(),
        oil: 0,
        mesh,
        done: rims,
    };
    let further: Vec<Vec<Vec<Row>>> =
        profile.paints.iter().map(|paint| further_rows(&profile, &rows, &paint.ends)).collect();
    for interval in 0..rows.len() - 1 {
        weaver.interval(interval, &further, &cover);
    }
    weaver.oil = 0;
    weaver.close_rims();
    weaver.steps_along();
    let first = section_index == 0;
    weaver.end(&rows[0], 0, -1.0, first);
    weaver.end(&rows[rows.len() - 1], rows.len() - 2, 1.0, true);
}

/// Returns the tint of a road's asphalt, which is paler the older it is.
fn age(road: usize) -> u16 {
    const TONES: [[u8; 3]; 4] = [[74, 73, 74], [82, 81, 82], [82, 81, 82], [90, 89, 90]];
    Face::tint(TONES[(road.wrapping_mul(0x9e37_79b1) >> 20) % TONES.len()])
}

/// Distances from the end of a lane in front of a junction up to which vehicles lose much, more and most oil while
/// they wait. Metres.
const WAIT_M: [f64; 3] = [12.5, 8.5, 4.5];

/// Returns the s at which vehicles on a strip wait for a junction.
fn stop(network: &Network, section: &Section, strip: &Strip) -> Option<f64> {
    let lane = network.lane(section.lanes[strip.lane?]);
    let mut next = lane.successors.iter().map(|next| network.lane(*next).junction);
    let waits = strip.paved && lane.junction.is_none() && next.any(|junction| junction.is_some());
    waits.then_some(section.start_m + if lane.forward { section.length_m } else { 0.0 })
}

/// Returns for each interval between stations the strips that lie where vehicles of another road
/// drive.
fn yielding(profile: &Profile, rows: &[Row], cover: &Cover) -> Vec<Vec<bool>> {
    let covered = |from: &Row, to: &Row, strip: usize| {
        if profile.strips[strip].paved {
            return false;
        }
        let across = |row: &Row, share: f64| profile.across(row, strip, share, true);
        let middle = across(from, 0.5).lerp(across(to, 0.5), 0.5);
        let reach = middle.distance(across(from, 0.0)).max(middle.distance(across(to, 1.0)));
        let near = cover.near(middle, reach);
        if near.is_empty() {
            return false;
        }
        // Near the edges at the depth of a touch, and every half metre between them.
        let width = profile.strip_width(from, strip).max(profile.strip_width(to, strip));
        let inset = (0.03 / width.max(0.06)).min(0.5);
        let steps = (width / 0.5).ceil().clamp(1.0, 64.0) as usize;
        (0..=steps).any(|step| {
            let share = inset + (1.0 - 2.0 * inset) * step as f64 / steps as f64;
            let (a, b) = (across(from, share), across(to, share));
            [0.02, 0.35, 0.65, 0.98].iter().any(|along| near.paved(a.lerp(b, *along)))
        })
    };
    let of_interval = |pair: &[Row]| {
        (0..profile.strips.len()).map(|strip| covered(&pair[0], &pair[1], strip)).collect()
    };
    rows.windows(2).map(of_interval).collect()
}

/// Returns for each interval between stations the rows at the ends of paint inside it.
fn further_rows(profile: &Profile, rows: &[Row], ends: &[f64]) -> Vec<Vec<Row>> {
    let mut next = 0;
    rows.windows(2)
        .map(|pair| {
            let mut found: Vec<Row> = Vec::new();
            while next < ends.len() && ends[next] < pair[1].s - NEAR_M {
                let before = found.last().map_or(pair[0].s, |row| row.s);
                if ends[next] > before + NEAR_M {
                    found.push(profile.row(ends[next]));
                }
                next += 1;
            }
            found
        })
        .collect()
}

struct Weaver<'a> {
    profile: &'a Profile<'a>,
    rows: &'a [Row],
    flat: &'a [Vec<bool>],
    /// Vertices at stations by line and station, as they are and flat.
    corners: Vec<[Option<u32>; 2]>,
    /// For each line the rim along it that is still being extended.
    rims: Vec<Vec<u32>>,
    road: u32,
    /// Tint of asphalt; 0 in a junction.
    tint: u16,
    /// For each strip where vehicles wait on it.
    stops: Vec<Option<f64>>,
    /// How much oil lies on the present cells, up to 3: added to the blue of their tint, for renderers.
    oil: u16,
    mesh: &'a mut Mesh,
    done: &'a mut Vec<Rim>,
}

impl Weaver<'_> {
    fn corner(&mut self, line: usize, station: usize, flat: bool) -> u32 {
        let at = line * self.rows.len() + station;
        if let Some(vertex) = self.corners[at][usize::from(flat)] {
            return vertex;
        }
        let vertex = self.vertex(self.profile.point(&self.rows[station], line, flat));
        self.corners[at][usize::from(flat)] = Some(vertex);
        vertex
    }

    fn vertex(&mut self, point: DVec3) -> u32 {
        self.mesh.vertex(point.as_vec3().to_array())
    }

    /// Adds a triangle unless two of its corners are equal.
    fn triangle(&mut self, corners: [u32; 3], face: Face) {
        let [a, b, c] = corners.map(|corner| self.mesh.positions[corner as usize]);
        let tint = if face != ASPHALT {
            face.tint
        } else if self.tint == 0 {
            0
        } else {
            self.tint + self.oil
        };
        if a != b && b != c && c != a {
            self.mesh.triangle(corners, Face { tint, ..face });
        }
    }

    /// Adds all cells between two stations.
    fn interval(&mut self, interval: usize, further: &[Vec<Vec<Row>>], cover: &Cover) {
        let profile = self.profile;
        let mut right = self.chain(0, interval, further);
        for (index, column) in profile.columns.iter().enumerate() {
            let left = right;
            right = self.chain(index + 1, interval, further);
            let flat = self.flat[interval][column.strip];
            let middle = 0.5 * (self.rows[interval].s + self.rows[interval + 1].s);
            let stop = self.stops[column.strip].map_or(f64::INFINITY, |s| (s - middle).abs());
            self.oil = WAIT_M.iter().filter(|reach| stop < **reach).count() as u16;
            if matches!(column.look, Look::Step | Look::Skirt) {
                self.rim(index, interval, &left, true);
                self.rim(index, interval, &right, false);
            }
            if let Look::Paint(paint, _) = column.look
                && left.len() == right.len()
            {
                let ends = &further[paint][interval];
                for cell in 0..left.len() - 1 {
                    let from = if cell == 0 { &self.rows[interval] } else { &ends[cell - 1] };
                    let to = ends.get(cell).unwrap_or(&self.rows[interval + 1]);
                    let s = 0.5 * (from.s + to.s);
                    let middle = profile
                        .point(from, index, flat)
                        .lerp(profile.point(to, index + 1, flat), 0.5);
                    let face = profile.face(column, s, flat, !flat && !cover.paved(middle));
                    self.triangle([left[cell], right[cell], right[cell + 1]], face);
                    self.triangle([left[cell], right[cell + 1], left[cell + 1]], face);
                }
            } else {
                let s = 0.5 * (self.rows[interval].s + self.rows[interval + 1].s);
                let face = profile.face(column, s, flat, false);
                self.zip(&left, &right, face);
            }
        }
    }

    /// Extends the rim on one side of an upright column, if the surface for vehicles ends there.
    fn rim(&mut self, column: usize, interval: usize, chain: &[u32], is_left: bool) {
        let columns = &self.profile.columns;
        let strip_at = |column: Option<usize>| column.and_then(|at| columns.get(at));
        let (inner, outer) = (column.checked_sub(1), Some(column + 1));
        let (inner, outer) = if is_left { (inner, outer) } else { (outer, inner) };
        let line = column + usize::from(!is_left);
        let drives = |strip: usize| self.profile.strips[strip].paved || self.flat[interval][strip];
        let ends = strip_at(inner).is_some_and(|inner| drives(inner.strip));
        // A strip without width beyond it does not count.
        let closed = strip_at(outer).is_some_and(|outer| {
            let rows = &self.rows[interval..interval + 2];
            rows.iter().any(|row| self.profile.strip_width(row, outer.strip) > RIM_M)
        });
        if !ends || closed {
            return self.close_rim(line);
        }
        let rim = &mut self.rims[line];
        if rim.last() != chain.first() {
            self.close_rim(line);
        }
        let rim = &mut self.rims[line];
        rim.extend(&chain[usize::from(!rim.is_empty())..]);
    }

    fn close_rims(&mut self) {
        (0..self.rims.len()).for_each(|line| self.close_rim(line));
    }

    fn close_rim(&mut self, line: usize) {
        let chain = std::mem::take(&mut self.rims[line]);
        let at = |corner: &u32| DVec3::from(self.mesh.positions[*corner as usize].map(f64::from));
        let mut points: Vec<DVec3> = chain.iter().map(at).collect();
        points.dedup();
        // The upright column before a surface has it on the right of its direction.
        let is_left = line > 0 && {
            let before = &self.profile.columns[line - 1];
            !matches!(before.look, Look::Step | Look::Skirt)
        };
        if !is_left {
            points.reverse();
        }
        if points.len() > 1 {
            self.done.push(Rim { road: self.road, points });
        }
    }

    /// Returns the vertices of a line from one station to the next.
    fn chain(&mut self, line: usize, interval: usize, further: &[Vec<Vec<Row>>]) -> Vec<u32> {
        let spec = &self.profile.lines[line];
        let flat = self.flat[interval][spec.strip];
        let mut chain = vec![self.corner(line, interval, flat)];
        if let Some(paint) = spec.paint {
            for row in &further[paint][interval] {
                chain.push(self.vertex(self.profile.point(row, line, flat)));
            }
        }
        chain.push(self.corner(line, interval + 1, flat));
        chain
    }

    /// Fills the area between two chains of vertices, left and right of it. The first edge of each triangle
    /// lies along the road: renderers draw the tracks of wheels along it.
    fn zip(&mut self, left: &[u32], right: &[u32], face: Face) {
        let (mut l, mut r) = (0, 0);
        while l + 1 < left.len() || r + 1 < right.len() {
            // Advances on the side that has progressed less.
            let left_share = (l + 1) as f64 / left.len() as f64;
            let right_share = (r + 1) as f64 / right.len() as f64;
            let step_left =
                r + 1 >= right.len() || (l + 1 < left.len() && left_share < right_share);
            if step_left {
                self.triangle([left[l + 1], left[l], right[r]], face);
                l += 1;
            } else {
                self.triangle([right[r], right[r + 1], left[l]], face);
                r += 1;
            }
        }
    }

    /// Adds upright faces across the road where a strip begins or ends to yield.
    fn steps_along(&mut self) {
        for station in 1..self.rows.len() - 1 {
            for index in 0..self.profile.columns.len() {
                let column = self.profile.columns[index];
                let (before, after) =
                    (self.flat[station - 1][column.strip], self.flat[station][column.strip]);
                if before == after || matches!(column.look, Look::Step | Look::Skirt) {
                    continue;
                }
                let face = self.profile.face(&column, 0.0, false, false);
                let quad = [
                    self.corner(index, station, before),
                    self.corner(index + 1, station, before),
                    self.corner(index + 1, station, after),
                    self.corner(index, station, after),
                ];
                self.triangle([quad[0], quad[1], quad[2]], face);
                self.triangle([quad[0], quad[2], quad[3]], face);
            }
        }
    }

    /// Closes an end of the section: `way` is +1 at its end and -1 at its start. Raised strips get
    /// an upright face, and where `tongue` is set, every strip continues below the next surface.
    fn end(&mut self, row: &Row, interval: usize, way: f64, tongue: bool) {
        let onward = row.axes.ahead() * (way * TONGUE_M) - DVec3::Z * TONGUE_DEPTH_M;
        for strip in 0..self.profile.strips.len() {
            if self.profile.strip_width(row, strip) < 1e-3 {
                continue;
            }
            let flat = self.flat[interval][strip];
            // As finely as the surface that it continues; otherwise it might stand above that.
            let pieces = self.profile.pieces(strip);
            let share = |piece: usize| piece as f64 / pieces as f64;
            for piece in 0..pieces {
                let at = [share(piece), share(piece + 1)];
                let feet = at.map(|share| self.profile.across(row, strip, share, true));
                if self.profile.raised(row, strip) && !flat {
                    let tops = at.map(|share| self.profile.across(row, strip, share, false));
                    self.upright(feet, tops, way, self.profile.strip_face(strip));
                }
                if tongue {
                    let face = if self.profile.strips[strip].paved {
                        ASPHALT
                    } else {
                        self.profile.strip_face(strip)
                    };
                    let [left, right] = feet;
                    let [a, b, c, d] = [left, right, right + onward, left + onward]
                        .map(|point| self.vertex(point));
                    let corners = if way > 0.0 { [a, b, c, d] } else { [d, c, b, a] };
                    self.triangle([corners[0], corners[1], corners[2]], face);
                    self.triangle([corners[0], corners[2], corners[3]], face);
                }
            }
        }
    }

    fn upright(&mut self, feet: [DVec3; 2], tops: [DVec3; 2], way: f64, face: Face) {
        let corners = if way > 0.0 {
            [feet[1], feet[0], tops[0], tops[1]]
        } else {
            [feet[0], feet[1], tops[1], tops[0]]
        };
        let [a, b, c, d] = corners.map(|point| self.vertex(point));
        self.triangle([a, b, c], face);
        self.triangle([a, c, d], face);
    }
}
