//! Lane centres against those of esmini, from `reference/<map>.esmini.csv` beside the maps.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{maps_folder, shared_maps};
use crate::{Network, Road, placement::wrapped};

struct Row {
    road: String,
    lane: i32,
    s: f64,
    width: f64,
    position: DVec3,
    heading: f64,
}

fn rows(text: &str) -> Vec<Row> {
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |at: usize| cells[at].parse::<f64>().expect("a number");
        Row {
            road: cells[0].to_string(),
            lane: cells[1].parse().expect("a lane id"),
            s: number(2),
            width: number(4),
            position: DVec3::new(number(5), number(6), number(7)),
            heading: number(8),
        }
    };
    text.lines().skip(1).map(row).collect()
}

fn percentile(sorted: &[f64], share: f64) -> f64 {
    sorted.get(((sorted.len() as f64 - 1.0) * share) as usize).copied().unwrap_or(0.0)
}

/// Groups rows of one section at one s. Two sections may share an s when it is rounded.
fn stations(rows: &[Row]) -> Vec<&[Row]> {
    let same = |a: &Row, b: &Row| a.road == b.road && a.s == b.s && a.lane > b.lane;
    rows.chunk_by(same).collect()
}

/// Returns the section with exactly the lanes of `rows`; the file's s is rounded, and sections may
/// be shorter than that.
fn section_of(network: &Network, road: &Road, s: f64, rows: &[Row]) -> Option<usize> {
    [s, s - 6e-5, s + 6e-5].into_iter().map(|s| road.section_at(s)).find(|section| {
        let lanes = &road.sections[*section].lanes;
        let has = |row: &Row| lanes.iter().any(|lane| network.lane(*lane).id == row.lane);
        lanes.len() == rows.len() && rows.iter().all(has)
    })
}

#[test]
fn lane_centres_lie_within_5_mm_of_the_reference() {
    let Some(folder) = maps_folder() else { return };
    println!(
        "{:<52} {:>6} {:>6} | position mm p50 p99 max | width mm p99 max | heading rad p99 max",
        "map", "rows", "missed"
    );
    let mut failed = Vec::new();
    for (name, text) in shared_maps() {
        let reference = folder.join(format!("reference/{name}.esmini.csv"));
        let Ok(reference) = std::fs::read_to_string(reference) else { continue };
        let network = Network::parse(&text).expect("a map that loads");
        let roads: BTreeMap<&str, &Road> =
            network.roads().iter().map(|road| (road.id.as_str(), road)).collect();
        let (mut away, mut widths, mut headings) = (Vec::new(), Vec::new(), Vec::new());
        let mut missed = 0;
        let mut worst = (0.0, String::new());
        let mut worst_heading = (0.0, String::new());
        for rows in stations(&rows(&reference)) {
            let (road, s) = (roads[rows[0].road.as_str()], rows[0].s);
            let Some(section) = section_of(&network, road, s, rows) else {
                missed += 1;
                continue;
            };
            for row in rows {
                let lane = network.lane_of(road, section, row.lane).expect("a lane of the section");
                let lane = network.lane(lane);
                let at = network.point_at_s(lane, row.s);
                // As the file describes the lane: esmini does not blend heights.
                let (pose, _) = network.lane_pose(at.lane, at.along_m, 0.0);
                let ours = network.to_projected(pose.position);
                let error = ours.distance(row.position);
                if error > worst.0 {
                    let (id, s, theirs) = (row.lane, row.s, row.position);
                    worst =
                        (error, format!("road {} lane {id} s {s}: {ours} for {theirs}", road.id));
                }
                away.push(error * 1e3);
                widths.push((network.width(at) - row.width).abs() * 1e3);
                let turn = if lane.forward { 0.0 } else { std::f64::consts::PI };
                let he = wrapped(pose.heading_rad + turn - row.heading).abs();
                if he > worst_heading.0 {
                    worst_heading = (
                        he,
                        format!(
                            "road {} lane {} s {}: {} for {}",
                            road.id,
                            row.lane,
                            row.s,
                            pose.heading_rad + turn,
                            row.heading
                        ),
                    );
                }
                headings.push(he);
            }
        }
        for list in [&mut away, &mut widths, &mut headings] {
            list.sort_by(f64::total_cmp);
        }
        println!(
            "{name:<52} {:>6} {missed:>6} | {:>9.3} {:>9.3} {:>9.3} | {:>8.3} {:>8.3} | {:.5} {:.5}",
            away.len(),
            percentile(&away, 0.5),
            percentile(&away, 0.99),
            percentile(&away, 1.0),
            percentile(&widths, 0.99),
            percentile(&widths, 1.0),
            percentile(&headings, 0.99),
            percentile(&headings, 1.0)
        );
        if percentile(&away, 1.0) > 5.0 {
            println!("    worst: {}", worst.1);
        }
        if worst_heading.0 > 1e-3 {
            println!("    heading: {}", worst_heading.1);
        }
        if missed > 0 || percentile(&away, 0.99) > 5.0 {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "beyond 5 mm or with other lanes: {failed:?}");
}
