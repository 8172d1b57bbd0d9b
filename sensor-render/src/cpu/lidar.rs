use glam::Vec3;

use super::ray_group::RayGroup;
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
    let across = lidar.group_columns;
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
        // The lanes of a group are of one column if the columns have places of their own.
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
        let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for (lane, direction) in in_world.iter().enumerate() {
            [x[lane], y[lane], z[lane]] = direction.to_array();
        }
        let directions = V3 { x: F::from_array(x), y: F::from_array(y), z: F::from_array(z) };
        let active = F::Mask::from_bits(on);
        let rays = RayGroup { origins: V3::splat(origin), directions, active };
        let hits = rays.closest(scene, world, stack, self.lidar.receiver.range_m);
        let sample = SurfaceSample::new(scene, world, hits.t, hits.triangle, hits.instance);
        Seen {
            hit: sample.hit.bits(),
            t: sample.t.to_array(),
            face: sample.face.to_array(),
            id: sample.id.to_array(),
            cosines: sample.normal.dot(directions).abs().to_array(),
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
