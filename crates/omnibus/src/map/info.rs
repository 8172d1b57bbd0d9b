//! `omnibus map info`.

use std::{collections::BTreeMap, time::Instant};

use crate::map::source::{Loaded, Source};
use road::{JunctionKind, Network};

/// Prints what a map contains.
pub(super) fn info(source: &Source) -> anyhow::Result<()> {
    let Loaded { name, text, network } = source.load()?;
    let begun = Instant::now();
    Network::parse(&text).map_err(anyhow::Error::from)?;
    let took = begun.elapsed();
    let header = network.header();
    let (low, high) = network.bounds();
    let size = high - low;
    print_line!("{name}: {:.0} m by {:.0} m, {:.1} m high", size.x, size.y, size.z);
    print_line!(
        "OpenDRIVE {}.{}, {:.2} MB, read in {:.1} ms; name {:?}, by {:?}",
        header.revision.0,
        header.revision.1,
        text.len() as f64 / 1e6,
        took.as_secs_f64() * 1e3,
        header.name,
        header.vendor,
    );
    let length_m: f64 = network.roads().iter().map(|road| road.length_m).sum();
    print_line!(
        "{} roads, {:.2} km; {} lanes:",
        network.roads().len(),
        length_m / 1e3,
        network.lanes().len()
    );
    let mut kinds: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for lane in network.lanes() {
        let (count, length_m) = kinds.entry(lane.kind.text()).or_default();
        *count += 1;
        *length_m += lane.length_m;
    }
    for (kind, (count, length_m)) in kinds {
        print_line!("  {kind:<14} {count:>6}, {:>9.2} km", length_m / 1e3);
    }
    let of_kind = |kind| network.junctions().iter().filter(|j| j.kind == kind).count();
    print_line!(
        "{} junctions: {} common, {} direct, {} virtual",
        network.junctions().len(),
        of_kind(JunctionKind::Common),
        of_kind(JunctionKind::Direct),
        of_kind(JunctionKind::Virtual),
    );
    let dynamic = network.signals().iter().filter(|signal| signal.dynamic).count();
    print_line!(
        "{} signals ({dynamic} lights), {} controllers, {} objects, {} crosswalks",
        network.signals().len(),
        network.controllers().len(),
        network.objects().len(),
        network.crosswalks().count(),
    );
    print_line!("{} spawn points", network.spawn_points().len());
    match network.geo((low + high) * 0.5) {
        Some(middle) => {
            print_line!(
                "middle at latitude {:.6}, longitude {:.6}",
                middle.latitude_deg,
                middle.longitude_deg
            );
        }
        None if header.geo_reference.is_empty() => print_line!("says not where on Earth it lies"),
        None => {
            print_line!(
                "lies on Earth by a projection that is not known here: {}",
                header.geo_reference
            )
        }
    }
    if !network.findings().is_empty() {
        print_line!(
            "{} findings: `omnibus map validate {name}` lists them",
            network.findings().len()
        );
    }
    Ok(())
}
