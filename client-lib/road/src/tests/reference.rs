//! Lane centres against esmini's, from `reference/<map>.esmini.csv` beside the maps.

use super::{maps_folder, shared_maps};
use crate::place::wrapped;
use crate::{Network, Road};
use glam::DVec3;
use std::collections::BTreeMap;

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
        let mut counts: BTreeMap<(String, u64), usize> = BTreeMap::new();
        let mut worst = (0.0, String::new());
        for row in rows(&reference) {
            *counts.entry((row.road.clone(), row.s.to_bits())).or_default() += 1;
            let road = roads[row.road.as_str()];
            let section = road.section_at(row.s);
            let Some(lane) = network.lane_of(road, section, row.lane) else {
                missed += 1;
                continue;
            };
            let at = network.point_at_s(network.lane(lane), row.s);
            let pose = network.place(at);
            let error = network.to_projected(pose.position).distance(row.position);
            if error > worst.0 {
                worst = (
                    error,
                    format!(
                        "road {} lane {} s {}: ours {} theirs {}",
                        row.road,
                        row.lane,
                        row.s,
                        network.to_projected(pose.position),
                        row.position
                    ),
                );
            }
            away.push(error * 1e3);
            widths.push((network.width(at) - row.width).abs() * 1e3);
            let heading = if network.lane(lane).forward {
                pose.heading_rad
            } else {
                pose.heading_rad + std::f64::consts::PI
            };
            headings.push(wrapped(heading - row.heading).abs());
        }
        for ((road, s), count) in &counts {
            let road = roads[road.as_str()];
            let section = &road.sections[road.section_at(f64::from_bits(*s))];
            missed += section.lanes.len().abs_diff(*count);
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
        if percentile(&away, 0.99) > 10.0 {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "beyond 5 mm or with other lanes: {failed:?}");
}
