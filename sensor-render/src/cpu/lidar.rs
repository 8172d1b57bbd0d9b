use glam::Vec3;

use super::ray_packet::RayPacket;
use super::traversal::Stack;
use crate::lidar_return::LidarReturn;
use crate::outputs::Tile;
use crate::rays::Lidar;
use crate::scene::Scene;
use crate::simd::{Float, Kernel, LANES, Mask, V3, Word};
use crate::surface_sample::SurfaceSample;
use crate::world::World;

/// Kernel that measures some columns of a lidar.
pub(crate) struct LidarColumns<'a, 'b> {
    pub(crate) scene: &'a Scene,
    pub(crate) world: &'a World,
    pub(crate) lidar: &'a Lidar,
    pub(crate) tile: &'a mut Tile<'b>,
}

impl Kernel for LidarColumns<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Float>(self) {
        columns::<F>(self.scene, self.world, self.lidar, self.tile);
    }
}

#[inline(always)]
fn columns<F: Float>(scene: &Scene, world: &World, lidar: &Lidar, tile: &mut Tile) {
    let mut stack = Stack::new();
    let across = lidar.packet_columns;
    let down = LANES as u32 / across;
    for column in (0..tile.count).step_by(across as usize) {
        for channel in (0..lidar.channels).step_by(down as usize) {
            let beams = Beams { lidar, tile_column: column, channel, across, count: tile.count };
            beams.listen::<F>(scene, world, &mut stack, tile);
        }
    }
}

/// Sixteen neighbouring beams.
struct Beams<'a> {
    lidar: &'a Lidar,
    /// First column, relative to the tile.
    tile_column: u32,
    /// First channel.
    channel: u32,
    across: u32,
    /// Number of columns of the tile.
    count: u32,
}

impl Beams<'_> {
    /// Returns the column in the tile and the channel of a lane; `None` if there is no such beam.
    #[inline(always)]
    fn beam(&self, lane: u32) -> Option<(u32, u32)> {
        let column = self.tile_column + lane % self.across;
        let channel = self.channel + lane / self.across;
        (column < self.count && channel < self.lidar.channels).then_some((column, channel))
    }

    #[inline(always)]
    fn listen<F: Float>(&self, scene: &Scene, world: &World, stack: &mut Stack, tile: &mut Tile) {
        let lidar = self.lidar;
        let mut in_sensor = [Vec3::ZERO; LANES];
        let mut on = 0u16;
        for lane in 0..LANES as u32 {
            if let Some((column, channel)) = self.beam(lane) {
                let azimuth = lidar.azimuths[(tile.first + column) as usize];
                let elevation = lidar.elevations[channel as usize];
                if azimuth != [0.0; 2] {
                    let [cos, sin] = elevation;
                    in_sensor[lane as usize] = Vec3::new(cos * azimuth[0], cos * azimuth[1], sin);
                    on |= 1 << lane;
                }
            }
        }
        let in_world = in_sensor.map(|direction| lidar.axes * direction);
        let mut sample: Option<SurfaceSample<F>> = None;
        let mut cosines = [0.0; LANES];
        let mut left = on;
        // One packet if the beams are close together, else one packet per beam.
        while left != 0 {
            let (members, packet) = packet::<F>(lidar, &in_world, left, on == left);
            let hits = packet.closest(scene, world, stack, lidar.range_m);
            let looked =
                SurfaceSample::new(scene, world, hits.t[0], hits.triangle[0], hits.instance[0]);
            let cosine = looked.normal.dot(packet.directions[0]).abs().to_array();
            let members_mask = F::Mask::from_bits(members);
            sample = Some(match sample {
                None => looked,
                Some(before) => looked.or(members_mask, &before),
            });
            for lane in 0..LANES {
                if members >> lane & 1 != 0 {
                    cosines[lane] = cosine[lane];
                }
            }
            left &= !members;
        }
        self.write(&in_sensor, on, sample.as_ref(), &cosines, tile);
    }

    #[inline(always)]
    fn write<F: Float>(
        &self,
        in_sensor: &[Vec3; LANES],
        on: u16,
        sample: Option<&SurfaceSample<F>>,
        cosines: &[f32; LANES],
        tile: &mut Tile,
    ) {
        let lidar = self.lidar;
        let hit = sample.map_or(0, |sample| sample.hit.bits()) & on;
        let t = sample.map_or([0.0; LANES], |sample| sample.t.to_array());
        let face = sample.map_or([0; LANES], |sample| sample.face.to_array());
        let id = sample.map_or([0; LANES], |sample| sample.id.to_array());
        for lane in 0..LANES {
            let Some((column, channel)) = self.beam(lane as u32) else { continue };
            let at = (column * lidar.channels + channel) as usize;
            let beam = (tile.first + column) * lidar.channels + channel;
            let returned = if hit >> lane & 1 != 0 {
                LidarReturn::of(lidar, beam, t[lane], cosines[lane], (face[lane] >> 8) as u8)
            } else {
                None
            };
            if let Some(point) = tile.slices.points.get_mut(at) {
                *point = returned.map_or([0.0; 4], |returned| {
                    let [x, y, z] = (in_sensor[lane] * returned.distance_m).to_array();
                    [x, y, z, returned.intensity]
                });
            }
            if let Some(label) = tile.slices.labels.get_mut(at) {
                *label = if returned.is_some() { [id[lane], face[lane] & 0xff] } else { [0; 2] };
            }
        }
    }
}

/// Returns a packet of the lanes in `wanted`, and the lanes that it contains: all of them if
/// `together` and they fit one narrow beam, else only the first. The other lanes repeat one of
/// them.
#[inline(always)]
fn packet<F: Float>(
    lidar: &Lidar,
    in_world: &[Vec3; LANES],
    wanted: u16,
    together: bool,
) -> (u16, RayPacket<F, 1>) {
    let first = in_world[wanted.trailing_zeros() as usize % LANES];
    let held = |lane: usize, members: u16| {
        if members >> lane & 1 != 0 { in_world[lane] } else { first }
    };
    let mut sum = Vec3::ZERO;
    for lane in 0..LANES {
        sum += held(lane, wanted);
    }
    let mut members = wanted;
    let mut middle = sum.normalize_or(first);
    let mut least = 1.0f32;
    for lane in 0..LANES {
        least = least.min(held(lane, wanted).dot(middle));
    }
    if !together || least < 0.9 {
        members = wanted & wanted.wrapping_neg();
        middle = first;
    }
    // Bounds of the beams on the plane at distance 1 along their mean direction.
    let across = middle.any_orthonormal_vector();
    let up = middle.cross(across);
    let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    let mut longest = 0.0f32;
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let direction = held(lane, members);
        [x[lane], y[lane], z[lane]] = direction.to_array();
        let along = direction.dot(middle);
        longest = longest.max(along);
        for (axis, of) in [across, up].into_iter().enumerate() {
            let at = direction.dot(of) / along;
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    let wide = |from: f32, to: f32| 1e-5 + 0.01 * (to - from);
    let (wide_x, wide_y) = (wide(low[0], high[0]), wide(low[1], high[1]));
    let corner = |x: f32, y: f32| middle + across * x + up * y;
    let packet = RayPacket {
        origin: lidar.origin,
        corners: [
            corner(low[0] - wide_x, low[1] - wide_y),
            corner(high[0] + wide_x, low[1] - wide_y),
            corner(high[0] + wide_x, high[1] + wide_y),
            corner(low[0] - wide_x, high[1] + wide_y),
        ],
        axis: middle / (longest * 1.000_001),
        directions: [V3 { x: F::from_array(x), y: F::from_array(y), z: F::from_array(z) }],
    };
    (members, packet)
}
