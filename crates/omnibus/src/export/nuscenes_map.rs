//! The map of nuScenes: a picture of roads and sidewalks from above, ten pixels a metre.

use std::{collections::BTreeMap, fs, io::BufWriter, path::Path};

use anyhow::Context;
use bake::Cache;
use glam::{DVec2, DVec3};
use road::{Lane, LanePoint, LaneType, LaneTypes, Network};

use crate::export::{
    parallel::Threads,
    set::{Scene, Set},
};

/// The scale that readers of nuScenes assume.
const PIXELS_PER_M: f64 = 10.0;
/// Drawn around the way of the ego.
const MARGIN_M: f64 = 120.0;
/// The corners of the area are multiples of this, so that similar scenes have the same.
const GRID_M: f64 = 100.0;
/// The distance of the points where the width of a lane is taken.
const STEP_M: f64 = 1.0;
/// Rows that are drawn at a time.
const BAND: usize = 256;

/// The part of a map that egos drove in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Area {
    /// The south-west corner, the origin of nuScenes' world. At height 0.
    pub(crate) low: DVec3,
    high: DVec3,
}

/// Returns the area of each map, by its hash.
pub(crate) fn areas(set: &Set, threads: Threads) -> anyhow::Result<BTreeMap<String, Area>> {
    let mut areas: BTreeMap<String, Area> = BTreeMap::new();
    let read = |index: usize| {
        let frame = set.frame(index)?;
        let at = frame.line.ego.world_from_vehicle.position_m.map(f64::from);
        Ok((&frame.scene.metadata.settings.map_fnv1a64, DVec3::from_array(at)))
    };
    threads.in_order(set.frames(), read, |_, (map, at)| {
        let area = areas.entry(map.clone()).or_insert(Area { low: at, high: at });
        (area.low, area.high) = (area.low.min(at), area.high.max(at));
        Ok(())
    })?;
    for area in areas.values_mut() {
        let flat = DVec3::new(1.0, 1.0, 0.0);
        area.low = ((area.low - MARGIN_M) / GRID_M).floor() * GRID_M * flat;
        area.high = ((area.high + MARGIN_M) / GRID_M).ceil() * GRID_M * flat;
    }
    Ok(areas)
}

/// Draws roads and sidewalks white on black.
pub(crate) fn draw(scene: &Scene, area: &Area, path: &Path) -> anyhow::Result<()> {
    let map = scene.map();
    let text = fs::read_to_string(&map).with_context(|| map.display().to_string())?;
    let name = &scene.metadata.settings.map;
    let network = Cache::from_environment().network(name, &text)?;
    let size = ((area.high - area.low) * PIXELS_PER_M).truncate();
    let [width, height] = [size.x as usize, size.y as usize];
    // Each piece of lane by the bands that it reaches.
    let mut bands: Vec<Vec<[DVec2; 4]>> = vec![Vec::new(); height.div_ceil(BAND)];
    for lane in network.lanes().iter().filter(|lane| is_drawn(lane)) {
        for piece in pieces(&network, lane) {
            // Rows are counted from the north.
            let piece = piece.map(|at| {
                let at = (at - area.low.truncate()) * PIXELS_PER_M;
                DVec2::new(at.x, height as f64 - at.y)
            });
            let [top, bottom] = span(piece.map(|at| at.y));
            let [left, right] = span(piece.map(|at| at.x));
            if bottom < 0.0 || top >= height as f64 || right < 0.0 || left >= width as f64 {
                continue;
            }
            let last = (bottom as usize).min(height - 1) / BAND;
            for band in &mut bands[top.max(0.0) as usize / BAND..=last] {
                band.push(piece);
            }
        }
    }
    let write = || {
        let file = BufWriter::new(fs::File::create(path)?);
        let mut encoder = png::Encoder::new(file, width as u32, height as u32);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header()?;
        let mut stream = writer.stream_writer()?;
        for (number, pieces) in bands.iter().enumerate() {
            let first = number * BAND;
            let mut rows = vec![0; BAND.min(height - first) * width];
            for (row, line) in (first..).zip(rows.chunks_exact_mut(width)) {
                pieces.iter().for_each(|piece| fill(piece, row, line));
            }
            std::io::Write::write_all(&mut stream, &rows)?;
        }
        stream.finish()?;
        anyhow::Ok(())
    };
    write().with_context(|| path.display().to_string())
}

fn is_drawn(lane: &Lane) -> bool {
    LaneTypes::DRIVABLE.contains(lane.kind)
        || matches!(
            lane.kind,
            LaneType::Sidewalk | LaneType::Shoulder | LaneType::Parking | LaneType::Biking
        )
}

/// Returns the four-sided pieces of a lane.
fn pieces(network: &Network, lane: &Lane) -> Vec<[DVec2; 4]> {
    let steps = (lane.length_m / STEP_M).ceil().clamp(1.0, 1e5) as usize;
    let sides: Vec<[DVec2; 2]> = (0..=steps)
        .map(|step| {
            let along_m = lane.length_m * step as f64 / steps as f64;
            let half = 0.5 * network.width(LanePoint { lane: lane.index, along_m });
            let side = |left: f64| network.place_at(lane.index, along_m, left).position.truncate();
            [side(half), side(-half)]
        })
        .collect();
    sides.windows(2).map(|pair| [pair[0][0], pair[0][1], pair[1][1], pair[1][0]]).collect()
}

fn span(values: [f64; 4]) -> [f64; 2] {
    let least = values.into_iter().fold(f64::INFINITY, f64::min);
    let most = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
    [least, most]
}

/// Sets the pixels of a row whose centres lie in a convex piece.
fn fill(piece: &[DVec2; 4], row: usize, line: &mut [u8]) {
    let y = row as f64 + 0.5;
    let mut crossings = [f64::INFINITY, f64::NEG_INFINITY];
    for corner in 0..4 {
        let (a, b) = (piece[corner], piece[(corner + 1) % 4]);
        if (a.y <= y) != (b.y <= y) {
            let x = a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
            crossings = [crossings[0].min(x), crossings[1].max(x)];
        }
    }
    let [from, to] = crossings.map(|x| (x - 0.5).ceil().clamp(0.0, line.len() as f64) as usize);
    if crossings[0] < crossings[1] {
        line[from..to].fill(255);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_covers_the_pixels_whose_centres_lie_in_it() {
        let piece = [[1.0, 1.0], [4.0, 1.0], [4.0, 3.0], [1.0, 3.0]].map(DVec2::from_array);
        let drawn = [0, 1, 2, 3].map(|row| {
            let mut line = [0; 6];
            fill(&piece, row, &mut line);
            line.map(|value| value / 255)
        });
        let full = [0, 1, 1, 1, 0, 0];
        assert_eq!(drawn, [[0; 6], full, full, [0; 6]]);
    }
}
