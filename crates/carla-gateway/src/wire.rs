//! CARLA's structs as lists of their fields: metres, degrees, left-handed axes.

use client_lib::{
    Pose,
    carla_axes::{CarlaTransform, degrees},
};
use glam::Vec3;

use crate::{
    args::{Args, RpcError},
    msgpack::Pack,
};

/// An attribute of an actor: name, type, and value as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Attribute {
    pub(crate) id: String,
    /// 1 bool, 2 int, 3 float, 4 string, 5 color.
    pub(crate) kind: u8,
    pub(crate) value: String,
}

/// Most bytes of a description, which is kept and sent as long as its actor exists.
const DESCRIPTION_MAX: usize = 64 << 10;

/// The blueprint and attributes from which an actor was spawned.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Description {
    pub(crate) uid: u32,
    pub(crate) id: String,
    pub(crate) attributes: Vec<Attribute>,
}

impl Description {
    pub(crate) fn read(args: &mut Args) -> Result<Description, RpcError> {
        let mut fields = args.list()?;
        let (uid, id) = (fields.u32()?, fields.text()?.to_owned());
        let mut list = fields.list()?;
        let (mut attributes, mut bytes) = (Vec::new(), id.len());
        while list.len() > 0 {
            let mut one = list.list()?;
            bytes += one.text_bytes() + size_of::<Attribute>();
            if bytes > DESCRIPTION_MAX {
                let most = DESCRIPTION_MAX >> 10;
                return Err(format!("the attributes of {id} take more than {most} KiB").into());
            }
            attributes.push(Attribute {
                id: one.text()?.to_owned(),
                kind: one.int()? as u8,
                value: one.text()?.to_owned(),
            });
        }
        Ok(Description { uid, id, attributes })
    }

    pub(crate) fn write(&self, out: &mut Pack) {
        out.list(3).uint(self.uid.into()).text(&self.id).list(self.attributes.len());
        for attribute in &self.attributes {
            out.list(3).text(&attribute.id).uint(attribute.kind.into()).text(&attribute.value);
        }
    }

    /// Returns the value of an attribute.
    pub(crate) fn get(&self, id: &str) -> Option<&str> {
        self.attributes.iter().find(|a| a.id == id).map(|a| a.value.as_str())
    }

    /// Returns whether an attribute is true.
    pub(crate) fn flag(&self, id: &str) -> bool {
        self.get(id).is_some_and(|text| text.eq_ignore_ascii_case("true") || text == "1")
    }

    /// Returns an attribute as a number, or `otherwise` if it is absent. As in CARLA, it may end with
    /// an `f`.
    ///
    /// # Errors
    ///
    /// Returns an error if the value is not a finite number.
    pub(crate) fn number(&self, id: &str, otherwise: f32) -> Result<f32, RpcError> {
        let Some(text) = self.get(id) else { return Ok(otherwise) };
        match text.trim().trim_end_matches('f').parse::<f32>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                Err(format!("attribute {id} of {} is {text:?}, which is not a number", self.id)
                    .into())
            }
        }
    }
}

/// An actor as clients know it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Actor {
    pub(crate) id: u32,
    /// The id of the parent; 0: none.
    pub(crate) parent: u32,
    pub(crate) description: Description,
    pub(crate) bounds: Bounds,
    pub(crate) tag: u8,
    /// The token of the stream, for sensors whose measurements are streamed.
    pub(crate) token: Option<[u8; 24]>,
}

impl Actor {
    pub(crate) fn write(&self, out: &mut Pack) {
        out.list(6).uint(self.id.into()).uint(self.parent.into());
        self.description.write(out);
        self.bounds.write(out);
        out.bin(&[self.tag]).bin(self.token.as_ref().map_or(&[], |t| &t[..]));
    }
}

/// A bounding box in our axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) center_m: [f32; 3],
    pub(crate) half_extents_m: [f32; 3],
    pub(crate) yaw_rad: f32,
    pub(crate) actor: u32,
}

impl Bounds {
    pub(crate) fn write(&self, out: &mut Pack) {
        out.list(4).vector(flip(self.center_m)).vector(self.half_extents_m);
        out.vector([0.0, degrees(f64::from(-self.yaw_rad)), 0.0]).uint(self.actor.into());
    }
}

/// Converts a vector between our axes and CARLA's, in either direction.
pub(crate) fn flip([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, -y, z]
}

/// Converts an angular velocity between our axes and CARLA's, in either direction. A reflection
/// reverses the rotation about every axis but the reflected one.
pub(crate) fn flip_turn([x, y, z]: [f32; 3]) -> [f32; 3] {
    [-x, y, -z]
}

/// Reads a transform.
pub(crate) fn transform(args: &mut Args) -> Result<Pose, RpcError> {
    let mut fields = args.list()?;
    let location_m = fields.vector()?;
    let [pitch_deg, yaw_deg, roll_deg] = fields.vector()?;
    Ok(CarlaTransform { location_m, pitch_deg, yaw_deg, roll_deg }.to_pose())
}

pub(crate) fn write_transform(pose: &Pose, out: &mut Pack) {
    let carla = CarlaTransform::from_pose(pose);
    out.list(2).vector(carla.location_m).vector([carla.pitch_deg, carla.yaw_deg, carla.roll_deg]);
}

/// Reads a location.
pub(crate) fn location(args: &mut Args) -> Result<Vec3, RpcError> {
    args.vector().map(|v| Vec3::from_array(flip(v)))
}

/// A stream's message that is being written: little-endian numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bytes(pub(crate) Vec<u8>);

impl Bytes {
    pub(crate) fn with_capacity(len: usize) -> Bytes {
        Bytes(Vec::with_capacity(len))
    }

    pub(crate) fn put<const N: usize>(&mut self, bytes: [u8; N]) -> &mut Bytes {
        self.0.extend_from_slice(&bytes);
        self
    }

    pub(crate) fn u32(&mut self, value: u32) -> &mut Bytes {
        self.put(value.to_le_bytes())
    }

    pub(crate) fn f32(&mut self, value: f32) -> &mut Bytes {
        self.put(value.to_le_bytes())
    }

    pub(crate) fn vector(&mut self, [x, y, z]: [f32; 3]) -> &mut Bytes {
        self.f32(x).f32(y).f32(z)
    }

    pub(crate) fn transform(&mut self, pose: &Pose) -> &mut Bytes {
        let carla = CarlaTransform::from_pose(pose);
        self.vector(carla.location_m).vector([carla.pitch_deg, carla.yaw_deg, carla.roll_deg])
    }

    /// Writes the length of the rest into the first four bytes.
    pub(crate) fn into_message(mut self) -> crate::stream::Message {
        let len = (self.0.len() - 4) as u32;
        self.0[..4].copy_from_slice(&len.to_le_bytes());
        std::sync::Arc::new(self.0)
    }
}

/// Begins a stream's message: four bytes for its length, and the header that all messages have.
pub(crate) fn message(
    type_id: u64,
    frame: u64,
    sim_time_nanos: u64,
    pose: &Pose,
    body: usize,
) -> Bytes {
    let mut bytes = Bytes::with_capacity(4 + 48 + body);
    bytes.u32(0).put(type_id.to_le_bytes()).put(frame.to_le_bytes());
    bytes.put((sim_time_nanos as f64 * 1e-9).to_le_bytes()).transform(pose);
    bytes
}
