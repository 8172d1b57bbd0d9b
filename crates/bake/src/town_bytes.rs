//! A furnished town as bytes.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use mesh::{Face, Mesh, Tag};
use town::{Collider, Head, Lamp, Layer, Object, Parked, Plant, Town};

/// The version of the layout below. It changes with the layout, and with every change of what is
/// built from a map.
pub const TOWN_VERSION: u64 = 6;

const MAGIC: [u8; 8] = *b"omnitown";

/// Why bytes are not a baked town.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TownError {
    /// The magic number differs.
    #[error("bad magic: not a baked town; delete the file, and the town is baked again")]
    Foreign,
    /// The bytes have another version.
    #[error(
        "unsupported version {found} of a baked town, this build reads {TOWN_VERSION}; delete the \
         file, and the town is baked again"
    )]
    Version {
        /// The version in the bytes.
        found: u64,
    },
    /// The bytes end early, go on after the last list, or refer to items that do not exist.
    #[error("damaged baked town: bad {part}; delete the file, and the town is baked again")]
    Damaged {
        /// The list that is damaged.
        part: &'static str,
    },
}

/// The beginning of the bytes. The lists follow in this order without gaps.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 8],
    version: u64,
    positions: u64,
    triangles: u64,
    faces: u64,
    objects: u64,
    colliders: u64,
    lamps: u64,
    parked: u64,
    plants: u64,
    heads: u64,
}

/// An [`Object`] as bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ObjectRow {
    tag: u8,
    layer: u8,
    color: [u8; 3],
    reserved: [u8; 3],
    center: Vec3,
    half_extents_m: Vec3,
    yaw_rad: f32,
}

/// The bytes of a town, for the same version on a machine of the same byte order.
pub fn town_to_bytes(town: &Town) -> Vec<u8> {
    let row = |object: &Object| ObjectRow {
        tag: object.tag as u8,
        layer: object.layer as u8,
        color: object.color,
        reserved: [0; 3],
        center: object.center,
        half_extents_m: object.half_extents_m,
        yaw_rad: object.yaw_rad,
    };
    let rows: Vec<ObjectRow> = town.objects.iter().map(row).collect();
    let header = Header {
        magic: MAGIC,
        version: TOWN_VERSION,
        positions: town.mesh.positions.len() as u64,
        triangles: town.mesh.triangles.len() as u64,
        faces: town.mesh.faces.len() as u64,
        objects: rows.len() as u64,
        colliders: town.colliders.len() as u64,
        lamps: town.lamps.len() as u64,
        parked: town.parked.len() as u64,
        plants: town.plants.len() as u64,
        heads: town.heads.len() as u64,
    };
    let parts: [&[u8]; 10] = [
        bytemuck::bytes_of(&header),
        bytemuck::cast_slice(&town.mesh.positions),
        bytemuck::cast_slice(&town.mesh.triangles),
        bytemuck::cast_slice(&town.mesh.faces),
        bytemuck::cast_slice(&rows),
        bytemuck::cast_slice(&town.colliders),
        bytemuck::cast_slice(&town.lamps),
        bytemuck::cast_slice(&town.parked),
        bytemuck::cast_slice(&town.plants),
        bytemuck::cast_slice(&town.heads),
    ];
    parts.concat()
}

/// The town that [`town_to_bytes`] wrote.
///
/// # Errors
///
/// The bytes are of another kind or version, or damaged.
pub fn town_from_bytes(bytes: &[u8]) -> Result<Town, TownError> {
    let mut rest = bytes;
    let header = take::<Header>(&mut rest, 1, "header").map_err(|_| TownError::Foreign)?[0];
    if header.magic != MAGIC {
        return Err(TownError::Foreign);
    }
    if header.version != TOWN_VERSION {
        return Err(TownError::Version { found: header.version });
    }
    let mesh = Mesh {
        positions: take::<[f32; 3]>(&mut rest, header.positions, "positions")?,
        triangles: take::<[u32; 3]>(&mut rest, header.triangles, "triangles")?,
        faces: take::<Face>(&mut rest, header.faces, "faces")?,
    };
    let rows = take::<ObjectRow>(&mut rest, header.objects, "objects")?;
    let town = Town {
        mesh,
        objects: rows.iter().map(object).collect::<Option<_>>().ok_or(damaged("objects"))?,
        colliders: take::<Collider>(&mut rest, header.colliders, "colliders")?,
        lamps: take::<Lamp>(&mut rest, header.lamps, "lamps")?,
        parked: take::<Parked>(&mut rest, header.parked, "parked cars")?,
        plants: take::<Plant>(&mut rest, header.plants, "plants")?,
        heads: take::<Head>(&mut rest, header.heads, "heads")?,
    };
    let corners = town.mesh.positions.len() as u32;
    if town.mesh.triangles.iter().flatten().any(|corner| *corner >= corners) {
        return Err(damaged("triangles"));
    }
    let objects = town.objects.len() as u32;
    let known = |face: &Face| face.object <= objects && Tag::from_code(face.tag).is_some();
    if town.mesh.faces.len() != town.mesh.triangles.len() || !town.mesh.faces.iter().all(known) {
        return Err(damaged("faces"));
    }
    let blueprints = town::catalogue().len() as u32;
    let known = |one: &Parked| one.object < objects && one.blueprint < blueprints;
    if !town.parked.iter().all(known) {
        return Err(damaged("parked cars"));
    }
    let known =
        |one: &Plant| one.object < objects && one.scale > 0.0 && one.model < town::plant_count();
    if !town.plants.iter().all(known) {
        return Err(damaged("plants"));
    }
    if !town.colliders.iter().all(|one| one.object < objects) {
        return Err(damaged("colliders"));
    }
    if !town.lamps.iter().all(|one| one.object < objects) {
        return Err(damaged("lamps"));
    }
    if rest.is_empty() { Ok(town) } else { Err(damaged("end")) }
}

fn damaged(part: &'static str) -> TownError {
    TownError::Damaged { part }
}

/// Copies the next `count` values out of `rest`.
fn take<T: Pod>(rest: &mut &[u8], count: u64, part: &'static str) -> Result<Vec<T>, TownError> {
    let length = usize::try_from(count).ok().and_then(|count| count.checked_mul(size_of::<T>()));
    let (head, tail) =
        length.and_then(|length| rest.split_at_checked(length)).ok_or(damaged(part))?;
    *rest = tail;
    let mut values = vec![T::zeroed(); head.len() / size_of::<T>()];
    bytemuck::cast_slice_mut(&mut values).copy_from_slice(head);
    Ok(values)
}

fn object(row: &ObjectRow) -> Option<Object> {
    Some(Object {
        tag: Tag::from_code(row.tag)?,
        layer: *Layer::ALL.get(usize::from(row.layer))?,
        center: row.center,
        half_extents_m: row.half_extents_m,
        yaw_rad: row.yaw_rad,
        color: row.color,
    })
}
