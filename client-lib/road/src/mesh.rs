//! The road surface as triangles.

use crate::cubic::Jet;
use crate::lane::{Lane, LaneType};
use crate::network::Network;
use crate::place::Lateral;
use crate::surface::{Face, Material, Mesh, Tag};

/// Every road's surface, with stations at most `spacing_m` apart.
pub fn surface_mesh(network: &Network, spacing_m: f64) -> Mesh {
    let spacing = if spacing_m.is_finite() { spacing_m.clamp(0.25, 20.0) } else { 5.0 };
    let mut mesh = Mesh::default();
    for lane in network.lanes() {
        strip(network, lane, spacing, &mut mesh);
    }
    mesh
}

fn strip(network: &Network, lane: &Lane, spacing: f64, mesh: &mut Mesh) {
    let road = &network.roads()[lane.road as usize];
    let section = &road.sections[lane.section as usize];
    let pieces = (lane.length_m / spacing).ceil().clamp(1.0, 1e5) as usize;
    let face = face(lane.kind);
    let mut last: Option<[u32; 2]> = None;
    for piece in 0..=pieces {
        let ds = lane.length_m * piece as f64 / pieces as f64;
        let s = section.start_m + ds;
        let station = road.station(s);
        let borders = network.borders(lane, s);
        let (inner_rise, outer_rise) = lane.rise(ds);
        let sign = lane.sign();
        let ends =
            [(borders.inner, inner_rise), (borders.outer, outer_rise)].map(|(border, rise)| {
                let t = road.lane_offset.at(s) + sign * border.value;
                let lateral = Lateral {
                    t: Jet::constant(t),
                    level: Jet::default(),
                    flat: false,
                    rise_m: rise,
                };
                mesh.vertex(road.pose(&station, s, &lateral).position.as_vec3().to_array())
            });
        // From right to left, so that the quads turn counter-clockwise.
        let [right, left] = if sign > 0.0 { ends } else { [ends[1], ends[0]] };
        if let Some([last_right, last_left]) = last {
            mesh.triangle([last_right, right, left], face);
            mesh.triangle([last_right, left, last_left], face);
        }
        last = Some([right, left]);
    }
}

fn face(kind: LaneType) -> Face {
    let (tag, material) = match kind {
        LaneType::Sidewalk => (Tag::SideWalks, Material::Paving),
        LaneType::Median => (Tag::Terrain, Material::Grass),
        LaneType::None => (Tag::Terrain, Material::Grass),
        _ => (Tag::Roads, Material::Asphalt),
    };
    Face::new(tag, material, 0)
}
