//! Furnishing: a whole town from a road network and a seed.
//!
//! Roads are stamped into a raster of the plan. Everything else is placed only where the raster is
//! free, and then marked there, so no object stands on a road or inside another object.

mod bridge;
mod building;
mod density;
mod facade;
mod frontage;
mod green;
mod index;
mod leisure;
mod litter;
mod lots;
mod outline;
mod parked;
mod plan;
mod prop;
mod raster;
mod relief;
mod roof;
mod scene;
mod signals;
mod street;
mod structures;
mod swept_path;
mod terrain;
mod window;
mod works;

#[cfg(test)]
mod tests;

use road::Network;

use crate::{
    furnish::{plan::Plan, scene::Scene},
    static_world::{Detail, Town},
};

/// The total road length from which on a map is furnished in low detail. Metres.
const CITY_M: f64 = 60_000.0;

/// Returns the town around these roads: the same network and seed give the same bytes.
pub fn furnish(network: &Network, seed: u64) -> Town {
    let length_m: f64 = network.roads().iter().map(|road| road.length_m).sum();
    furnish_with(network, seed, if length_m < CITY_M { Detail::Standard } else { Detail::Low })
}

/// As [`furnish`], in a given detail. The positions of objects do not depend on the detail.
pub fn furnish_with(network: &Network, seed: u64, detail: Detail) -> Town {
    let mut plan = Plan::new(network, seed, detail);
    let mut scene = Scene::new(plan.take_ground());
    structures::raise(&mut plan, &mut scene, road::structures(network));
    structures::paint(&plan, &mut scene, road::object_paint(network));
    let frontages = frontage::frontages(network);
    let outlines = std::mem::take(&mut plan.outlines);
    let density = std::mem::take(&mut plan.density);

    swept_path::keep_clear(&mut plan);
    // Earlier steps have priority: signals stand where the map says.
    signals::furnish(&mut plan, &mut scene);
    let gardens = lots::build(&mut plan, &mut scene, &outlines, &density);
    works::diggings(&mut plan, &mut scene, &frontages, &density);
    street::furnish(&mut plan, &mut scene, &frontages, &density);
    parked::park(&mut plan, &mut scene, &gardens);
    works::sites(&mut plan, &mut scene, &gardens);
    leisure::backyards(&mut plan, &mut scene, &gardens);
    leisure::parks(&mut plan, &mut scene, &density);
    green::gardens(&mut plan, &mut scene, &gardens);
    green::open_ground(&mut plan, &mut scene, &density);
    litter::strew(&plan, &mut scene, &frontages, &density);
    scene.finish()
}
