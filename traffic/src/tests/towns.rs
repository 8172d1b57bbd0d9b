//! A hundred vehicles on real maps, where the folder of maps is at hand.

use std::path::Path;
use std::sync::Arc;

use road::Network;

use super::course::Course;

/// The map of this name in the folder that `OMNIBUS_MAPS` names, if there is one.
fn map(name: &str) -> Option<Arc<Network>> {
    let folder = std::env::var_os("OMNIBUS_MAPS")?;
    let text = std::fs::read_to_string(Path::new(&folder).join(name)).ok()?;
    Some(Arc::new(Network::parse(&text).expect("a map of the folder parses")))
}

/// Simulated seconds: five minutes, unless asked otherwise.
fn seconds() -> usize {
    std::env::var("OMNIBUS_TRAFFIC_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(300)
}

fn drive(name: &str, count: usize) {
    let Some(network) = map(name) else { return };
    let mut course = Course::new(network, 1, count);
    if std::env::var_os("OMNIBUS_PLAN").is_some() {
        course.mind.map.signals.describe();
    }
    let whom: Vec<usize> = std::env::var("OMNIBUS_WHOM")
        .map_or(Vec::new(), |s| s.split(',').map(|w| w.parse::<usize>().unwrap() - 1).collect());
    for tick in 0..seconds() * 20 {
        course.tick();
        if tick % 10 == 0 && tick + 200 > seconds() * 20 {
            for &row in &whom {
                println!("{:.2} {}", tick as f32 * 0.05, course.describe(row));
            }
        }
    }
    println!("{name}: {}", course.summary());
    for (time, a, b, at) in course.collisions.iter().take(10) {
        println!("  {time:.1} s: {} touches {} at {at:.1}", a + 1, b + 1);
    }
    let mut stands: Vec<_> = course.records.iter().enumerate().collect();
    stands.sort_by(|a, b| b.1.longest_stand_s.total_cmp(&a.1.longest_stand_s));
    for (index, record) in stands.iter().take(6) {
        println!(
            "  {} stood {:.0} s at {:.1}, drove {:.0}",
            index + 1,
            record.longest_stand_s,
            record.stand_at,
            record.driven_m
        );
    }
    for (row, record) in course.records.iter().enumerate() {
        if record.stood_s > 60.0
            && (course.mind.memory.rows.order[row] > 0 || course.mind.leader_of(row).is_none())
        {
            println!("  STUCK {}", course.describe(row));
        }
    }
    stands.sort_by(|a, b| b.1.worst_offset_m.total_cmp(&a.1.worst_offset_m));
    for (index, record) in stands.iter().take(6) {
        println!(
            "  {} off by {:.2} m at {:.1}",
            index + 1,
            record.worst_offset_m,
            record.offset_at
        );
    }
}

#[test]
fn traffic_flows_on_town10() {
    drive("carla2021-scenic__Town10HD.xodr", 100);
}

#[test]
fn traffic_flows_on_town04() {
    drive("carla2021-scenic__Town04.xodr", 100);
}

#[test]
fn traffic_flows_on_town01() {
    drive("carla2021-scenic__Town01.xodr", 100);
}

#[test]
fn traffic_flows_on_fabriksgatan() {
    drive("esmini__fabriksgatan_traffic_lights.xodr", 20);
}

#[test]
fn traffic_flows_on_multi_intersections() {
    drive("esmini__multi_intersections.xodr", 100);
}
