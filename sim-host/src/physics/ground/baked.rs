//! The ground in the cache of baked maps.

use bake::{Cache, Key, Parts};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use mesh::Mesh;
use town::Detail;

use super::{Ground, grid::Grid, topmost::TopmostCache};

/// Source code that determines the bytes. It is part of the cache key, so that the ground of other
/// code is not used.
const CODE: &str = concat!(
    include_str!("baked.rs"),
    include_str!("cell.rs"),
    include_str!("grid.rs"),
    include_str!("triangle.rs"),
    include_str!("../ground.rs"),
);

/// The numbers beside the lists.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    origin: Vec2,
    blocks: [u32; 2],
    floor_m: f32,
}

impl Ground {
    /// Returns the ground of a map, from the cache if possible: processes share its memory, and only
    /// what they use of it is resident. Otherwise it is created from the mesh that `mesh` returns, and
    /// kept.
    pub fn cached(
        cache: &Cache,
        open_drive: &str,
        seed: u64,
        mesh: impl FnOnce() -> Mesh,
    ) -> Ground {
        let key = Key::new("ground-cells", CODE, open_drive, seed, Detail::Standard);
        if let Some(ground) = cache.find(key).and_then(|mut parts| load(&mut parts)) {
            return ground;
        }
        let ground = Ground::new(&mesh());
        let Ground { grid, floor_m, .. } = &ground;
        let blocks = grid.blocks.map(|count| count as u32);
        let head = Head { origin: grid.origin, blocks, floor_m: *floor_m };
        cache.keep(
            key,
            &[
                bytemuck::bytes_of(&head),
                bytemuck::cast_slice(&grid.triangles),
                bytemuck::cast_slice(&grid.block_numbers),
                bytemuck::cast_slice(&grid.cell_starts),
                bytemuck::cast_slice(&grid.lists),
                bytemuck::cast_slice(&grid.bounds),
            ],
        );
        ground
    }
}

fn load(parts: &mut Parts) -> Option<Ground> {
    let Head { origin, blocks, floor_m } = *parts.take::<Head>()?.first()?;
    let grid = Grid {
        origin,
        blocks: blocks.map(|count| count as usize),
        triangles: parts.share()?,
        block_numbers: parts.share()?,
        cell_starts: parts.share()?,
        lists: parts.share()?,
        bounds: parts.share()?,
    };
    let topmost = TopmostCache::unknown(grid.lists.len());
    Some(Ground { grid, topmost, floor_m })
}
