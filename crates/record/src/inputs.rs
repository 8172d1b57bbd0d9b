//! Encodes everything in a segment except the actors: stamps, journal, decisions of traffic,
//! contacts.

use bytemuck::{Pod, Zeroable};
use protocol::{Frame, JournalEntry, Stamp, TrafficHeader, WalkerLimbs};

use crate::{
    columns::ByteReader,
    error::Damage,
    recorded_frame::{Collision, Decision, RecordedFrame},
};

/// The numbers of a frame. They are written column by column as second differences, so that
/// counters become zeros.
const COLUMNS: usize = 13;

fn numbers(recorded_frame: &RecordedFrame) -> [u64; COLUMNS] {
    [
        recorded_frame.stamp.frame.0,
        recorded_frame.stamp.sim_time_nanos,
        recorded_frame.stamp.episode.into(),
        recorded_frame.delta_nanos,
        recorded_frame.substep_max_nanos,
        recorded_frame.decision.frame.0,
        recorded_frame.decision.whole.as_ref().map_or(0, |(_, payload)| 1 + payload.len() as u64),
        u64::from(recorded_frame.early) << 32 | recorded_frame.journal.len() as u64,
        recorded_frame.collisions.len() as u64,
        recorded_frame.limbs.len() as u64,
        // Hashes do not compress.
        recorded_frame.state_hash,
        recorded_frame.shown,
        recorded_frame.decision.hash,
    ]
}

/// The first column of hashes.
const HASHES: usize = 10;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Lengths {
    frames: u32,
    reserved: u32,
}

/// Encodes everything except `actors` and `world`. With `whole`, also journal, decision and
/// collisions.
pub(crate) fn encode(recorded_frames: &[RecordedFrame], whole: bool) -> Vec<u8> {
    let lengths = Lengths { frames: recorded_frames.len() as u32, reserved: 0 };
    let mut bytes = bytemuck::bytes_of(&lengths).to_vec();
    let mut rows: Vec<_> = recorded_frames.iter().map(numbers).collect();
    if !whole {
        for row in &mut rows {
            (row[5], row[6], row[7], row[8], row[11], row[12]) = (0, 0, 0, 0, 0, 0);
        }
    }
    for column in 0..COLUMNS {
        let (mut last, mut step) = (0u64, 0u64);
        for row in &rows {
            let difference = row[column].wrapping_sub(last);
            let told = if column < HASHES { difference.wrapping_sub(step) } else { row[column] };
            bytes.extend_from_slice(&told.to_le_bytes());
            (last, step) = (row[column], difference);
        }
    }
    for recorded_frame in recorded_frames {
        bytes.extend_from_slice(bytemuck::cast_slice(&recorded_frame.limbs));
    }
    if whole {
        for recorded_frame in recorded_frames {
            bytes.extend_from_slice(bytemuck::cast_slice(&recorded_frame.journal));
            bytes.extend_from_slice(bytemuck::cast_slice(&recorded_frame.collisions));
            if let Some((header, payload)) = &recorded_frame.decision.whole {
                bytes.extend_from_slice(bytemuck::bytes_of(header));
                bytes.extend_from_slice(payload);
            }
        }
    }
    bytes
}

/// Decodes recorded_frames without actors.
pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<RecordedFrame>, Damage> {
    let mut front = ByteReader(bytes);
    let lengths: Lengths = pod(front.bytes(size_of::<Lengths>())?);
    let frames = lengths.frames as usize;
    if frames > bytes.len() {
        return Err(Damage("it has more frames than bytes"));
    }
    let mut rows = vec![[0u64; COLUMNS]; frames];
    for column in 0..COLUMNS {
        let (mut last, mut step) = (0u64, 0u64);
        for row in &mut rows {
            let told: u64 = pod(front.bytes(8)?);
            let value =
                if column < HASHES { last.wrapping_add(step).wrapping_add(told) } else { told };
            (step, last) = (value.wrapping_sub(last), value);
            row[column] = value;
        }
    }
    let limbs: Vec<_> =
        rows.iter().map(|row| list(&mut front, row[9])).collect::<Result<_, _>>()?;
    rows.iter().zip(limbs).map(|(row, limbs)| recorded_frame(row, limbs, &mut front)).collect()
}

fn recorded_frame(
    row: &[u64; COLUMNS],
    limbs: Vec<WalkerLimbs>,
    front: &mut ByteReader,
) -> Result<RecordedFrame, Damage> {
    let stamp =
        Stamp { frame: Frame(row[0]), sim_time_nanos: row[1], episode: row[2] as u32, reserved: 0 };
    let journal = list::<JournalEntry>(front, row[7] & 0xffff_ffff)?;
    let collisions = list::<Collision>(front, row[8])?;
    let whole = match row[6] {
        0 => None,
        len => {
            let header: TrafficHeader = pod(front.bytes(size_of::<TrafficHeader>())?);
            Some((header, front.bytes((len - 1) as usize)?.to_vec()))
        }
    };
    Ok(RecordedFrame {
        stamp,
        delta_nanos: row[3],
        substep_max_nanos: row[4],
        state_hash: row[10],
        decision: Decision { frame: Frame(row[5]), hash: row[12], whole },
        early: (row[7] >> 32) as u32,
        journal,
        collisions,
        actors: Vec::new(),
        limbs,
        shown: row[11],
        world: None,
    })
}

fn list<T: Pod>(front: &mut ByteReader, count: u64) -> Result<Vec<T>, Damage> {
    let len = (count as usize).checked_mul(size_of::<T>()).ok_or(Damage("a count is absurd"))?;
    let bytes = front.bytes(len)?;
    Ok(bytes.chunks_exact(size_of::<T>()).map(pod).collect())
}

fn pod<T: Pod>(bytes: &[u8]) -> T {
    bytemuck::pod_read_unaligned(bytes)
}
