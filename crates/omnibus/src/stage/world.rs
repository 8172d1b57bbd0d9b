//! `omnibus stage world`: the time to build a world from the text of a map.

use anyhow::anyhow;
use bus::clock;
use protocol::Episode;
use sensor_render::Scene;

use crate::{
    launch::WorldArgs,
    stage::{memory::peak_mb, percentile::percentile_ms},
};

/// The parts of a world, and the times of building each.
pub(super) struct Built {
    /// Nanoseconds of network, town and scene, by round.
    nanos: [Vec<u64>; 3],
    megabytes: f64,
    triangles: usize,
    objects: usize,
    peak_mb: f64,
}

const PARTS: [&str; 3] = ["network", "town", "scene"];

/// Builds the world `rounds` times, without the cache.
pub(super) fn measure(world: &WorldArgs, rounds: u64) -> anyhow::Result<Built> {
    world.expect_no_simulator("a stage alone; `stage tick` runs a whole simulator")?;
    let Episode { map, open_drive, seed } = world.episode()?;
    let mut built = Built {
        nanos: Default::default(),
        megabytes: open_drive.len() as f64 / 1e6,
        triangles: 0,
        objects: 0,
        peak_mb: 0.0,
    };
    // The catalogue is built once per process, for all maps.
    town::catalogue();
    for _ in 0..rounds {
        let mut begin = clock::now_nanos();
        let mut lap = |part: usize| {
            let now = clock::now_nanos();
            built.nanos[part].push(now - begin);
            begin = now;
        };
        let network = road::Network::parse(&open_drive).map_err(|e| anyhow!("{map}: {e}"))?;
        lap(0);
        let town = town::furnish(&network, seed);
        lap(1);
        let scene = Scene::of_town(&town)?;
        lap(2);
        (built.triangles, built.objects) = (scene.triangle_count(), town.objects.len());
    }
    built.peak_mb = peak_mb();
    Ok(built)
}

impl Built {
    /// Returns the median of each part, in milliseconds.
    fn medians(&self) -> [f64; 3] {
        self.nanos.each_ref().map(|nanos| percentile_ms(&sorted(nanos.clone()), 0.5))
    }

    pub(super) fn sentence(&self) -> String {
        let [network, town, scene] = self.medians();
        format!(
            "world, {:.2} MB of OpenDRIVE, {} rounds: network {network:.1} ms, town {town:.1} ms, \
             scene {scene:.1} ms; {} triangles, {} objects; at most {:.0} MB of memory",
            self.megabytes,
            self.nanos[0].len(),
            self.triangles,
            self.objects,
            self.peak_mb,
        )
    }

    pub(super) fn json(&self, map: Option<&str>) -> serde_json::Value {
        let mut json = serde_json::json!({
            "stage": "world",
            "map": map,
            "megabytes": self.megabytes,
            "n": self.nanos[0].len(),
            "triangles": self.triangles,
            "objects": self.objects,
            "peak_mb": self.peak_mb,
        });
        let sum: Vec<u64> = (0..self.nanos[0].len())
            .map(|round| self.nanos.iter().map(|part| part[round]).sum())
            .collect();
        let sum = sorted(sum);
        for (key, share) in [("p50_ms", 0.5), ("p90_ms", 0.9), ("p99_ms", 0.99)] {
            json[key] = percentile_ms(&sum, share).into();
        }
        for (part, median) in PARTS.iter().zip(self.medians()) {
            json[format!("{part}_ms")] = median.into();
        }
        json
    }
}

fn sorted(mut nanos: Vec<u64>) -> Vec<u64> {
    nanos.sort_unstable();
    nanos
}
