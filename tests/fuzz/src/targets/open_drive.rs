//! OpenDRIVE maps, and the towns of those that are accepted.

use glam::{DVec3, Vec3};
use mesh::RandomStream;
use road::{
    LaneIndex, LanePoint, LaneTypes, Network, object_paint, structures, surface_mesh, validate,
};

/// The longest sum of roads around which a town is generated. Metres.
const TOWN_MAX_M: f64 = 2000.0;
/// The longest sum of roads whose surface is generated. Metres.
const SURFACE_MAX_M: f64 = 3e4;

/// Parses a map, calls every query, and generates the town of a small one.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let network = match Network::parse(&text) {
        Ok(network) => network,
        Err(error) => {
            assert!(error.line >= 1 && !error.reason.is_empty());
            return false;
        }
    };
    query(&network, &mut RandomStream::from_state(bytes.len() as u64));
    let findings = validate(&text).expect("it was parsed");
    assert!(findings.iter().all(|finding| !finding.reason.is_empty()));
    let length_m: f64 = network.roads().iter().map(|road| road.length_m).sum();
    if length_m < TOWN_MAX_M {
        check_town(&network);
    }
    true
}

/// Calls every query of a network a few times.
fn query(network: &Network, random: &mut RandomStream) {
    let lanes = network.lanes().len();
    let (low, high) = network.bounds();
    let middle = (low + high) * 0.5;
    for point in [middle, DVec3::ZERO, DVec3::splat(1e12), DVec3::NAN] {
        let Some(at) = network.nearest(point, LaneTypes::ANY) else { continue };
        let _ = (network.place(at), network.width(at), network.marks(at), network.waypoint_id(at));
        let _ = (network.advance(at, 30.0), network.retreat(at, 30.0));
        let _ = network.landmarks_ahead(at, 100.0, false);
        let _ = (network.advance_to_end(at, 50.0), network.geo(point));
        let other = LaneIndex(random.below(lanes) as u32);
        if let Some(route) = network.route(at, LanePoint { lane: other, along_m: 1.0 }) {
            assert!(route.length_m.is_finite() && !route.legs.is_empty());
        }
    }
    let total: f64 = network.roads().iter().map(|road| road.length_m).sum();
    let _ = network.waypoints(total / 200.0 + 1.0, LaneTypes::ANY);
    let _ = (network.topology(), network.landmarks().count(), network.crosswalks().count());
    if total < SURFACE_MAX_M {
        for spawn in network.spawn_points() {
            let at = network.place(spawn).position;
            assert!(at.is_finite(), "a spawn point at {at}");
        }
        let _ = surface_mesh(network, 10.0);
    }
    let _ = (structures(network), object_paint(network));
}

/// Generates the town and checks that everything in it is finite.
fn check_town(network: &Network) {
    let town = town::furnish(network, 1);
    let check = |what: &str, at: Vec3| assert!(at.is_finite(), "{what} at {at}");
    town.mesh.positions.iter().for_each(|at| check("a vertex", Vec3::from_array(*at)));
    town.objects.iter().for_each(|object| check("an object", object.center));
    town.lamps.iter().for_each(|lamp| check("a lamp", lamp.position));
    town.parked.iter().for_each(|car| check("a parked car", car.position));
    for collider in &town.colliders {
        check("a collider", collider.center);
        check("a collider's size", collider.half_extents_m + collider.yaw_rad);
    }
    for head in &town.heads {
        check("a traffic light", head.position + head.yaw_rad);
    }
}
