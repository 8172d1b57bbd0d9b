use glam::Vec3;

use super::ray_packet::RayPacket;
use super::traversal::Stack;
use crate::lidar::{Lidar, Place};
use crate::lidar_echo::{Echoes, LabelledReturn, Met, SUB_RAYS};
use crate::lidar_return::{LidarReturn, reflected};
use crate::outputs::Tile;
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
        let mut angles = [[[0.0; 2]; 2]; LANES];
        let mut on = 0u16;
        for lane in 0..LANES as u32 {
            if let Some((column, channel)) = self.beam(lane)
                && let Some(found) = lidar.angles(tile.first + column, channel)
            {
                angles[lane as usize] = found;
                on |= 1 << lane;
            }
        }
        let along_axis = |[azimuth, elevation]: [[f32; 2]; 2]| {
            let [cos, sin] = elevation;
            Vec3::new(cos * azimuth[0], cos * azimuth[1], sin)
        };
        // The lanes of a packet are of one column if the columns have places of their own.
        let place = lidar.place(tile.first + self.tile_column);
        let Some(echoes) = &lidar.echoes else {
            let mut in_sensor = [Vec3::ZERO; LANES];
            for lane in 0..LANES {
                if on >> lane & 1 != 0 {
                    in_sensor[lane] = along_axis(angles[lane]);
                }
            }
            let in_world = in_sensor.map(|direction| place.axes * direction);
            let seen = self.look::<F>(scene, world, stack, place.origin, &in_world, on);
            self.write(&in_sensor, on, &seen, tile);
            return;
        };
        let mut met = [[Met::default(); SUB_RAYS]; LANES];
        let mut counts = [0usize; LANES];
        for ray in 0..echoes.rays {
            let mut in_world = [Vec3::ZERO; LANES];
            for lane in 0..LANES {
                if on >> lane & 1 != 0 {
                    in_world[lane] = place.axes * echoes.direction(angles[lane], ray);
                }
            }
            let seen = self.look::<F>(scene, world, stack, place.origin, &in_world, on);
            for lane in 0..LANES {
                if seen.hit >> lane & 1 != 0 {
                    met[lane][counts[lane]] = seen.met(lane);
                    counts[lane] += 1;
                }
            }
        }
        for lane in 0..LANES {
            let is_on = on >> lane & 1 != 0;
            let axis = if is_on { along_axis(angles[lane]) } else { Vec3::ZERO };
            let met = if is_on { Some(&mut met[lane][..counts[lane]]) } else { None };
            self.write_echoes(echoes, lane, axis, &place, met, tile);
        }
    }

    /// Traces sixteen rays from one origin.
    #[inline(always)]
    fn look<F: Float>(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        origin: Vec3,
        in_world: &[Vec3; LANES],
        on: u16,
    ) -> Seen {
        let mut sample: Option<SurfaceSample<F>> = None;
        let mut cosines = [0.0; LANES];
        let mut left = on;
        // One packet if the beams are close together, else one packet per beam.
        while left != 0 {
            let range_m = self.lidar.receiver.range_m;
            let (members, packet, hits);
            if self.lidar.is_coarse {
                (members, packet) = (left, apart::<F>(origin, in_world, left));
                hits = packet.closest_separately(scene, world, stack, range_m);
            } else {
                (members, packet) = self::packet::<F>(origin, in_world, left, on == left);
                hits = packet.closest(scene, world, stack, range_m);
            }
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
        let sample = sample.as_ref();
        Seen {
            hit: sample.map_or(0, |sample| sample.hit.bits()) & on,
            t: sample.map_or([0.0; LANES], |sample| sample.t.to_array()),
            face: sample.map_or([0; LANES], |sample| sample.face.to_array()),
            id: sample.map_or([0; LANES], |sample| sample.id.to_array()),
            cosines,
        }
    }

    #[inline(always)]
    fn write(&self, in_sensor: &[Vec3; LANES], on: u16, seen: &Seen, tile: &mut Tile) {
        let lidar = self.lidar;
        for (lane, direction) in in_sensor.iter().enumerate() {
            let Some((column, channel)) = self.beam(lane as u32) else { continue };
            let at = (column * lidar.channels + channel) as usize;
            let beam = (tile.first + column) * lidar.channels + channel;
            let returned = if seen.hit & on & 1 << lane != 0 {
                let material = (seen.face[lane] >> 8) as u8;
                let receiver = &lidar.receiver;
                LidarReturn::of(receiver, beam, seen.t[lane], seen.cosines[lane], material)
            } else {
                None
            };
            if let Some(point) = tile.slices.points.get_mut(at) {
                *point = returned.map_or([0.0; 4], |returned| {
                    let [x, y, z] = (*direction * returned.distance_m).to_array();
                    [x, y, z, returned.intensity]
                });
            }
            if let Some(label) = tile.slices.labels.get_mut(at) {
                *label = match returned {
                    Some(_) => [seen.id[lane], seen.face[lane] & 0xff],
                    None => [0; 2],
                };
            }
        }
    }

    /// Writes the returns of a beam that met `met`; `None` if its laser is off.
    fn write_echoes(
        &self,
        echoes: &Echoes,
        lane: usize,
        axis: Vec3,
        place: &Place,
        met: Option<&mut [Met]>,
        tile: &mut Tile,
    ) {
        let Some((column, channel)) = self.beam(lane as u32) else { return };
        let at = (column * self.lidar.channels + channel) as usize;
        let beam = (tile.first + column) * self.lidar.channels + channel;
        let returns = match met {
            Some(met) => {
                let in_world = [place.origin, place.axes * axis];
                echoes.returns(&self.lidar.receiver, beam, in_world, met)
            }
            None => [None; 2],
        };
        let slices = &mut tile.slices;
        let put = |points: &mut [[f32; 4]], labels: &mut [[u32; 2]], of: Option<LabelledReturn>| {
            if let Some(point) = points.get_mut(at) {
                *point = of.map_or([0.0; 4], |(returned, _)| {
                    let [x, y, z] = (axis * returned.distance_m).to_array();
                    [x, y, z, returned.intensity]
                });
            }
            if let Some(label) = labels.get_mut(at) {
                *label = of.map_or([0; 2], |(_, label)| label);
            }
        };
        let [strongest, last] = returns;
        put(slices.points, slices.labels, strongest);
        put(slices.last_points, slices.last_labels, last);
    }
}

/// What sixteen rays met.
struct Seen {
    /// Bit for each ray that hit a surface.
    hit: u16,
    t: [f32; LANES],
    /// Tag in bits 0 to 7, material in bits 8 to 15.
    face: [u32; LANES],
    id: [u32; LANES],
    /// Cosines of the angles of incidence.
    cosines: [f32; LANES],
}

impl Seen {
    #[inline(always)]
    fn met(&self, lane: usize) -> Met {
        let [reflectivity, share] = reflected(self.cosines[lane], (self.face[lane] >> 8) as u8);
        Met {
            t: self.t[lane],
            reflectivity: reflectivity * share,
            cosine: self.cosines[lane],
            label: [self.id[lane], self.face[lane] & 0xff],
        }
    }
}

/// Returns the lanes in `wanted` as rays without bounds; the other lanes repeat one of them.
#[inline(always)]
fn apart<F: Float>(origin: Vec3, in_world: &[Vec3; LANES], wanted: u16) -> RayPacket<F, 1> {
    let first = in_world[wanted.trailing_zeros() as usize % LANES];
    let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let direction = if wanted >> lane & 1 != 0 { in_world[lane] } else { first };
        [x[lane], y[lane], z[lane]] = direction.to_array();
    }
    let directions = [V3 { x: F::from_array(x), y: F::from_array(y), z: F::from_array(z) }];
    RayPacket { origin, corners: [first; 4], axis: first, directions }
}

/// Returns a packet of the lanes in `wanted`, and the lanes that it contains: all of them if
/// `together` and they fit one narrow beam, else only the first. The other lanes repeat one of
/// them.
#[inline(always)]
fn packet<F: Float>(
    origin: Vec3,
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
        origin,
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
