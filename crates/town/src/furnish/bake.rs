//! A town as bytes, so that the next start need not build it again.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use mesh::{Face, Mesh, Tag};

use super::{Collider, Head, Lamp, Layer, Object, Parked, Town};

/// Changes whenever the layout below or what is built from a map changes.
pub const BAKE_VERSION: u64 = 5;

const MAGIC: [u8; 8] = *b"omnitown";

/// Why bytes are not a town.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    /// They begin otherwise.
    #[error("these bytes are no baked town; delete the file and it will be baked again")]
    Foreign,
    /// They are of another version.
    #[error(
        "this town was baked by version {found}, this build reads {BAKE_VERSION}; delete the file \
         and it will be baked again"
    )]
    Version {
        /// What the bytes say.
        found: u64,
    },
    /// They end early, go on too long, or refer to what is not there.
    #[error("the baked town is damaged in its {part}; delete the file and it will be baked again")]
    Damaged {
        /// Which of its lists.
        part: &'static str,
    },
}

/// The beginning of the bytes; the lists follow in this order without gaps.
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

impl Town {
    /// All of it, to be read by the same version on the same kind of machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let row = |object: &Object| ObjectRow {
            tag: object.tag as u8,
            layer: object.layer as u8,
            color: object.color,
            reserved: [0; 3],
            center: object.center,
            half_extents_m: object.half_extents_m,
            yaw_rad: object.yaw_rad,
        };
        let rows: Vec<ObjectRow> = self.objects.iter().map(row).collect();
        let header = Header {
            magic: MAGIC,
            version: BAKE_VERSION,
            positions: self.mesh.positions.len() as u64,
            triangles: self.mesh.triangles.len() as u64,
            faces: self.mesh.faces.len() as u64,
            objects: rows.len() as u64,
            colliders: self.colliders.len() as u64,
            lamps: self.lamps.len() as u64,
            parked: self.parked.len() as u64,
            heads: self.heads.len() as u64,
        };
        let parts: [&[u8]; 9] = [
            bytemuck::bytes_of(&header),
            bytemuck::cast_slice(&self.mesh.positions),
            bytemuck::cast_slice(&self.mesh.triangles),
            bytemuck::cast_slice(&self.mesh.faces),
            bytemuck::cast_slice(&rows),
            bytemuck::cast_slice(&self.colliders),
            bytemuck::cast_slice(&self.lamps),
            bytemuck::cast_slice(&self.parked),
            bytemuck::cast_slice(&self.heads),
        ];
        parts.concat()
    }

    /// The town that [`Town::to_bytes`] wrote.
    pub fn from_bytes(bytes: &[u8]) -> Result<Town, BakeError> {
        let mut rest = bytes;
        let header = take::<Header>(&mut rest, 1, "header").map_err(|_| BakeError::Foreign)?[0];
        if header.magic != MAGIC {
            return Err(BakeError::Foreign);
        }
        if header.version != BAKE_VERSION {
            return Err(BakeError::Version { found: header.version });
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
            heads: take::<Head>(&mut rest, header.heads, "heads")?,
        };
        let corners = town.mesh.positions.len() as u32;
        if town.mesh.triangles.iter().flatten().any(|corner| *corner >= corners) {
            return Err(damaged("triangles"));
        }
        let objects = town.objects.len() as u32;
        let known = |face: &Face| face.object <= objects && Tag::from_code(face.tag).is_some();
        if town.mesh.faces.len() != town.mesh.triangles.len() || !town.mesh.faces.iter().all(known)
        {
            return Err(damaged("faces"));
        }
        let blueprints = crate::catalogue().len() as u32;
        let known = |one: &Parked| one.object < objects && one.blueprint < blueprints;
        if !town.parked.iter().all(known) {
            return Err(damaged("parked cars"));
        }
        if !town.colliders.iter().all(|one| one.object < objects) {
            return Err(damaged("colliders"));
        }
        if !town.lamps.iter().all(|one| one.object < objects) {
            return Err(damaged("lamps"));
        }
        if rest.is_empty() { Ok(town) } else { Err(damaged("end")) }
    }
}

fn damaged(part: &'static str) -> BakeError {
    BakeError::Damaged { part }
}

/// The next `count` things.
fn take<T: Pod>(rest: &mut &[u8], count: u64, part: &'static str) -> Result<Vec<T>, BakeError> {
    let length = usize::try_from(count).ok().and_then(|count| count.checked_mul(size_of::<T>()));
    let (head, tail) =
        length.and_then(|length| rest.split_at_checked(length)).ok_or(damaged(part))?;
    *rest = tail;
    let mut things = vec![T::zeroed(); head.len() / size_of::<T>()];
    bytemuck::cast_slice_mut(&mut things).copy_from_slice(head);
    Ok(things)
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
