//! Reads and writes logs in CARLA's format.

use std::io::{self, ErrorKind, Read, Write};

use crate::carla_log::frame::{
    Collision, CreatedActor, Frame, Header, Kinematics, Position, TrafficLight, VehicleAnimation,
};

const MAGIC: &str = "CARLA_RECORDER";
/// Most bytes of a packet.
const PACKET_MAX: u32 = 1 << 28;

/// The numbers of packets; others are skipped.
mod id {
    pub(super) const FRAME_START: u8 = 0;
    pub(super) const FRAME_END: u8 = 1;
    pub(super) const EVENT_ADD: u8 = 2;
    pub(super) const EVENT_DEL: u8 = 3;
    pub(super) const EVENT_PARENT: u8 = 4;
    pub(super) const COLLISION: u8 = 5;
    pub(super) const POSITION: u8 = 6;
    pub(super) const STATE: u8 = 7;
    pub(super) const ANIM_VEHICLE: u8 = 8;
    pub(super) const ANIM_WALKER: u8 = 9;
    pub(super) const VEHICLE_LIGHT: u8 = 10;
    pub(super) const KINEMATICS: u8 = 12;
    pub(super) const VEHICLE_DOOR: u8 = 21;
}

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file system has failed.
    #[error(transparent)]
    File(#[from] io::Error),
    /// The file is not a log of CARLA.
    #[error("bad magic: not a log of CARLA's recorder")]
    BadMagic,
    /// A packet is invalid.
    #[error("packet {packet} of frame {frame} is damaged: {why}")]
    Damaged {
        /// The number of the packet.
        packet: u8,
        /// The number of the frame.
        frame: u64,
        /// What is wrong with the packet.
        why: &'static str,
    },
}

/// An element of the list in a packet.
trait Item: Sized {
    fn put(&self, to: &mut Vec<u8>);
    fn take(from: &mut Bytes) -> Option<Self>;
}

/// The rest of a packet.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (front, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*front)
    }

    fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[byte]| byte)
    }

    fn bool(&mut self) -> Option<bool> {
        Some(self.u8()? != 0)
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits)
    }

    fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }

    fn vector(&mut self) -> Option<[f32; 3]> {
        Some([self.f32()?, self.f32()?, self.f32()?])
    }

    fn text(&mut self) -> Option<String> {
        let len = usize::from(self.u16()?);
        let (front, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(String::from_utf8_lossy(front).into_owned())
    }

    fn list<T: Item>(&mut self, into: &mut Vec<T>) -> Option<()> {
        for _ in 0..self.u16()? {
            into.push(T::take(self)?);
        }
        Some(())
    }
}

fn put_u32(to: &mut Vec<u8>, value: u32) {
    to.extend_from_slice(&value.to_le_bytes());
}

fn put_vector(to: &mut Vec<u8>, vector: &[f32; 3]) {
    vector.iter().for_each(|v| put_u32(to, v.to_bits()));
}

/// Appends a text with its length; longer texts than the length can express are truncated.
fn put_text(to: &mut Vec<u8>, text: &str) {
    let len = text.len().min(u16::MAX.into());
    to.extend_from_slice(&(len as u16).to_le_bytes());
    to.extend_from_slice(&text.as_bytes()[..len]);
}

impl Item for CreatedActor {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.id);
        to.push(self.kind);
        put_vector(to, &self.location);
        put_vector(to, &self.rotation);
        put_u32(to, self.uid);
        put_text(to, &self.blueprint);
        to.extend_from_slice(&(self.attributes.len() as u16).to_le_bytes());
        for (kind, name, value) in &self.attributes {
            to.push(*kind);
            put_text(to, name);
            put_text(to, value);
        }
    }

    fn take(from: &mut Bytes) -> Option<CreatedActor> {
        let mut created = CreatedActor {
            id: from.u32()?,
            kind: from.u8()?,
            location: from.vector()?,
            rotation: from.vector()?,
            uid: from.u32()?,
            blueprint: from.text()?,
            attributes: Vec::new(),
        };
        for _ in 0..from.u16()? {
            created.attributes.push((from.u8()?, from.text()?, from.text()?));
        }
        Some(created)
    }
}

impl Item for u32 {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, *self);
    }

    fn take(from: &mut Bytes) -> Option<u32> {
        from.u32()
    }
}

impl Item for [u32; 2] {
    fn put(&self, to: &mut Vec<u8>) {
        self.iter().for_each(|value| put_u32(to, *value));
    }

    fn take(from: &mut Bytes) -> Option<[u32; 2]> {
        Some([from.u32()?, from.u32()?])
    }
}

impl Item for Collision {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.id);
        self.actors.put(to);
        to.extend(self.heroes.map(u8::from));
    }

    fn take(from: &mut Bytes) -> Option<Collision> {
        Some(Collision {
            id: from.u32()?,
            actors: Item::take(from)?,
            heroes: [from.bool()?, from.bool()?],
        })
    }
}

impl Item for Position {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.id);
        put_vector(to, &self.location);
        put_vector(to, &self.rotation);
    }

    fn take(from: &mut Bytes) -> Option<Position> {
        Some(Position { id: from.u32()?, location: from.vector()?, rotation: from.vector()? })
    }
}

impl Item for TrafficLight {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.id);
        to.push(self.frozen.into());
        put_u32(to, self.elapsed_s.to_bits());
        to.push(self.state);
    }

    fn take(from: &mut Bytes) -> Option<TrafficLight> {
        let (id, frozen) = (from.u32()?, from.bool()?);
        Some(TrafficLight { id, frozen, elapsed_s: from.f32()?, state: from.u8()? })
    }
}

impl Item for VehicleAnimation {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.id);
        put_vector(to, &[self.steer, self.throttle, self.brake]);
        to.push(self.handbrake.into());
        put_u32(to, self.gear as u32);
    }

    fn take(from: &mut Bytes) -> Option<VehicleAnimation> {
        let (id, [steer, throttle, brake]) = (from.u32()?, from.vector()?);
        let (handbrake, gear) = (from.bool()?, from.u32()? as i32);
        Some(VehicleAnimation { id, steer, throttle, brake, handbrake, gear })
    }
}

impl Item for (u32, f32) {
    fn put(&self, to: &mut Vec<u8>) {
        [self.0, self.1.to_bits()].put(to);
    }

    fn take(from: &mut Bytes) -> Option<(u32, f32)> {
        Some((from.u32()?, from.f32()?))
    }
}

impl Item for (u32, u32) {
    fn put(&self, to: &mut Vec<u8>) {
        [self.0, self.1].put(to);
    }

    fn take(from: &mut Bytes) -> Option<(u32, u32)> {
        Some((from.u32()?, from.u32()?))
    }
}

impl Item for (u32, u8, bool) {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.0);
        to.extend([self.1, self.2.into()]);
    }

    fn take(from: &mut Bytes) -> Option<(u32, u8, bool)> {
        Some((from.u32()?, from.u8()?, from.bool()?))
    }
}

impl Item for Kinematics {
    fn put(&self, to: &mut Vec<u8>) {
        put_u32(to, self.id);
        put_vector(to, &self.velocity);
        put_vector(to, &self.spin);
    }

    fn take(from: &mut Bytes) -> Option<Kinematics> {
        Some(Kinematics { id: from.u32()?, velocity: from.vector()?, spin: from.vector()? })
    }
}

/// Writes a log.
pub struct Writer<W: Write> {
    to: W,
    bytes: Vec<u8>,
}

impl<W: Write> Writer<W> {
    /// Writes the header.
    ///
    /// # Errors
    ///
    /// Returns an error if the output fails.
    pub fn new(mut to: W, head: &Header) -> io::Result<Writer<W>> {
        let mut bytes = head.version.to_le_bytes().to_vec();
        put_text(&mut bytes, MAGIC);
        bytes.extend_from_slice(&head.date_secs.to_le_bytes());
        put_text(&mut bytes, &head.map);
        to.write_all(&bytes)?;
        Ok(Writer { to, bytes })
    }

    /// Writes a frame: packets in CARLA's order, without empty lists.
    ///
    /// # Errors
    ///
    /// Returns an error if the output fails.
    pub fn put(&mut self, frame: &Frame) -> io::Result<()> {
        self.bytes.clear();
        let mut start = frame.number.to_le_bytes().to_vec();
        start.extend_from_slice(&frame.duration_s.to_le_bytes());
        start.extend_from_slice(&frame.elapsed_s.to_le_bytes());
        self.packet(id::FRAME_START, |to| to.extend_from_slice(&start));
        self.list(id::EVENT_ADD, &frame.created);
        self.list(id::EVENT_DEL, &frame.destroyed);
        self.list(id::EVENT_PARENT, &frame.parents);
        self.list(id::COLLISION, &frame.collisions);
        self.list(id::POSITION, &frame.places);
        self.list(id::STATE, &frame.lights);
        self.list(id::ANIM_VEHICLE, &frame.pedals);
        self.list(id::ANIM_WALKER, &frame.walkers);
        self.list(id::VEHICLE_LIGHT, &frame.lamps);
        self.list(id::VEHICLE_DOOR, &frame.doors);
        self.list(id::KINEMATICS, &frame.motions);
        self.packet(id::FRAME_END, |_| {});
        self.to.write_all(&self.bytes)
    }

    fn packet(&mut self, number: u8, fill: impl FnOnce(&mut Vec<u8>)) {
        self.bytes.push(number);
        let at = self.bytes.len();
        put_u32(&mut self.bytes, 0);
        fill(&mut self.bytes);
        let len = (self.bytes.len() - at - 4) as u32;
        self.bytes[at..at + 4].copy_from_slice(&len.to_le_bytes());
    }

    /// Appends a list; one that exceeds a count of 16 bits is split into several packets.
    fn list<T: Item>(&mut self, number: u8, items: &[T]) {
        for items in items.chunks(u16::MAX.into()) {
            self.packet(number, |to| {
                to.extend_from_slice(&(items.len() as u16).to_le_bytes());
                items.iter().for_each(|item| item.put(to));
            });
        }
    }

    /// Flushes and returns the output.
    ///
    /// # Errors
    ///
    /// Returns an error if the output fails.
    pub fn finish(mut self) -> io::Result<W> {
        self.to.flush()?;
        Ok(self.to)
    }
}

/// Reads a log.
pub struct Reader<R: Read> {
    from: R,
    head: Header,
    frame: u64,
}

impl<R: Read> Reader<R> {
    /// Reads the header.
    ///
    /// # Errors
    ///
    /// Returns an error if the input fails or is not a log of CARLA.
    pub fn new(mut from: R) -> Result<Reader<R>, LogError> {
        let version = u16::from_le_bytes(array(&mut from)?);
        if text(&mut from)? != MAGIC {
            return Err(LogError::BadMagic);
        }
        let date_secs = i64::from_le_bytes(array(&mut from)?);
        let map = text(&mut from)?;
        Ok(Reader { from, head: Header { version, date_secs, map }, frame: 0 })
    }

    /// Returns the header.
    pub fn header(&self) -> &Header {
        &self.head
    }

    /// Reads the next frame; `None` at the end of the log. A truncated last frame is ignored.
    ///
    /// # Errors
    ///
    /// Returns an error if the input fails or a packet is damaged.
    pub fn frame(&mut self) -> Result<Option<Frame>, LogError> {
        let mut begun: Option<Frame> = None;
        loop {
            let (packet, bytes) = match self.packet() {
                Ok(found) => found,
                Err(LogError::File(e)) if e.kind() == ErrorKind::UnexpectedEof => return Ok(None),
                Err(e) => return Err(e),
            };
            let damaged = |why| LogError::Damaged { packet, frame: self.frame, why };
            let mut bytes = Bytes(&bytes);
            if packet == id::FRAME_START {
                let (number, duration_s, elapsed_s) =
                    (|| Some((bytes.u64()?, bytes.f64()?, bytes.f64()?)))()
                        .ok_or(damaged("it is shorter than its contents"))?;
                if !(elapsed_s.is_finite() && duration_s.is_finite() && duration_s >= 0.0) {
                    return Err(damaged("its time is not finite or its duration is negative"));
                }
                self.frame = number;
                begun = Some(Frame { number, duration_s, elapsed_s, ..Frame::default() });
                continue;
            }
            // Packets before the first frame belong to none.
            let Some(mut open) = begun.take() else { continue };
            if packet == id::FRAME_END {
                return Ok(Some(open));
            }
            match packet {
                id::EVENT_ADD => bytes.list(&mut open.created),
                id::EVENT_DEL => bytes.list(&mut open.destroyed),
                id::EVENT_PARENT => bytes.list(&mut open.parents),
                id::COLLISION => bytes.list(&mut open.collisions),
                id::POSITION => bytes.list(&mut open.places),
                id::STATE => bytes.list(&mut open.lights),
                id::ANIM_VEHICLE => bytes.list(&mut open.pedals),
                id::ANIM_WALKER => bytes.list(&mut open.walkers),
                id::VEHICLE_LIGHT => bytes.list(&mut open.lamps),
                id::VEHICLE_DOOR => bytes.list(&mut open.doors),
                id::KINEMATICS => bytes.list(&mut open.motions),
                _ => Some(()),
            }
            .ok_or(damaged("it is shorter than its contents"))?;
            begun = Some(open);
        }
    }

    fn packet(&mut self) -> Result<(u8, Vec<u8>), LogError> {
        let [packet] = array(&mut self.from)?;
        let len = u32::from_le_bytes(array(&mut self.from)?);
        if len > PACKET_MAX {
            let why = "its length exceeds the limit";
            return Err(LogError::Damaged { packet, frame: self.frame, why });
        }
        let mut bytes = Vec::new();
        let read = (&mut self.from).take(len.into()).read_to_end(&mut bytes)?;
        if read < len as usize {
            return Err(io::Error::from(ErrorKind::UnexpectedEof).into());
        }
        Ok((packet, bytes))
    }
}

fn array<const N: usize>(from: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    from.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn text(from: &mut impl Read) -> io::Result<String> {
    let mut bytes = vec![0; u16::from_le_bytes(array(from)?).into()];
    from.read_exact(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
