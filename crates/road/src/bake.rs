//! A network as bytes, so that the next start need not parse the text again.
//!
//! There are two kinds of parts. The index is used in place, from the bytes themselves. Everything
//! else is decoded field by field, lanes and roads on several threads. Any bytes may be given:
//! whatever is not a network is rejected, and no memory is reserved for a declared length before as
//! many bytes are present.

mod fields;
mod rows;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::{
    grid::LaneIndexGrid, lane::Lane, network::Network, parallel::threads, road::Road,
    slab::SharedBytes,
};
use fields::Field;
/// Increases whenever the layout changes.
const VERSION: u64 = 2;

const MAGIC: [u8; 8] = *b"omniroad";

/// Number of lanes or roads in one block.
const BLOCK: usize = 512;

/// Alignment of the parts, in bytes.
const ALIGN: usize = 16;

/// The header: says where blocks and slabs lie.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    magic: [u8; 8],
    version: u64,
    /// Total length in bytes.
    length: u64,
    lanes: u64,
    roads: u64,
    /// Begin and end of the block table: lanes first, then roads, then the rest.
    blocks: [u64; 2],
    /// Begin and end of the index's slabs: segments, starts, entries.
    slabs: [[u64; 2]; 3],
}

impl Network {
    /// Returns the whole network as bytes for [`Network::from_bytes`] of the same version on a
    /// machine of the same byte order.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut head = Head {
            magic: MAGIC,
            version: VERSION,
            lanes: self.lanes.len() as u64,
            roads: self.roads.len() as u64,
            ..Head::zeroed()
        };
        let mut bytes = bytemuck::bytes_of(&head).to_vec();
        for (slab, place) in self.grid.slabs().into_iter().zip(&mut head.slabs) {
            *place = append(&mut bytes, slab);
        }
        let mut table = Vec::new();
        let mut block = |put: &dyn Fn(&mut Vec<u8>)| {
            table.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
            put(&mut bytes);
        };
        for lanes in self.lanes.chunks(BLOCK) {
            block(&|bytes| lanes.iter().for_each(|lane| lane.put(bytes)));
        }
        for roads in self.roads.chunks(BLOCK) {
            block(&|bytes| roads.iter().for_each(|road| road.put(bytes)));
        }
        block(&|bytes| rows::put_rest(self, bytes));
        table.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
        head.blocks = append(&mut bytes, &table);
        head.length = bytes.len() as u64;
        bytes[..size_of::<Head>()].copy_from_slice(bytemuck::bytes_of(&head));
        bytes
    }

    /// Restores the network that [`Network::to_bytes`] wrote. It keeps `bytes` and answers queries
    /// from them.
    ///
    /// Returns `None` if they are anything else or do not begin at a multiple of 8 in memory.
    pub fn from_bytes(bytes: SharedBytes) -> Option<Network> {
        read(bytes, threads())
    }
}

/// Restores a network on up to `threads` threads; the result does not depend on their number.
pub(crate) fn read(lent: SharedBytes, threads: usize) -> Option<Network> {
    let bytes = (*lent).as_ref();
    let head: Head = bytemuck::pod_read_unaligned(bytes.get(..size_of::<Head>())?);
    let is_ours = head.magic == MAGIC && head.version == VERSION;
    if !is_ours || head.length != bytes.len() as u64 {
        return None;
    }
    let blocks = blocks(bytes, &head)?;
    let (lanes, roads) = (usize::try_from(head.lanes).ok()?, usize::try_from(head.roads).ok()?);
    let (own, others) = blocks.split_at_checked(lanes.div_ceil(BLOCK))?;
    let (others, rest) = others.split_at_checked(roads.div_ceil(BLOCK))?;
    let [rest] = rest else { return None };
    let slabs = head.slabs.map(|[from, to]| from as usize..to as usize);
    // Roads take about as long as everything else together.
    let others_of = |threads: usize| {
        let mut network = rows::take_rest(rest)?;
        network.grid = LaneIndexGrid::shared(&lent, slabs.clone(), &network.grid, lanes)?;
        network.lanes = many::<Lane>(own, lanes, threads)?;
        Some(network)
    };
    let (network, roads) = std::thread::scope(|scope| {
        let helper = (threads > 1).then(|| {
            let read = || others_of(threads / 2);
            std::thread::Builder::new().name("road-read".to_owned()).spawn_scoped(scope, read)
        });
        let roads = many::<Road>(others, roads, threads - threads / 2);
        let network = match helper {
            Some(Ok(helper)) => helper.join().ok().flatten(),
            _ => others_of(1),
        };
        (network, roads)
    });
    Some(Network { roads: roads?, ..network? })
}

/// Returns the bytes of each block.
fn blocks<'a>(bytes: &'a [u8], head: &Head) -> Option<Vec<&'a [u8]>> {
    let [from, to] = head.blocks.map(|at| usize::try_from(at).unwrap_or(usize::MAX));
    let (ends, []) = bytes.get(from..to)?.as_chunks::<8>() else { return None };
    let end = |at: &[u8; 8]| usize::try_from(u64::from_le_bytes(*at)).ok();
    ends.windows(2)
        .map(|pair| bytes.get(Range { start: end(&pair[0])?, end: end(&pair[1])? }))
        .collect()
}

/// Decodes `count` values from their blocks on up to `threads` threads.
fn many<T: Field + Send>(blocks: &[&[u8]], count: usize, threads: usize) -> Option<Vec<T>> {
    // The first thread decodes into the vector that receives all values.
    let share = blocks.len().div_ceil(threads.max(1)).max(1);
    let (first, later) = blocks.split_at(share.min(blocks.len()));
    let of = |mut things: Vec<T>, blocks: &[&[u8]], before: usize| {
        for (block, at) in blocks.iter().zip(before..) {
            let mut rest = *block;
            for _ in 0..count.saturating_sub(at * BLOCK).min(BLOCK) {
                things.push(T::take(&mut rest)?);
            }
            if !rest.is_empty() {
                return None;
            }
        }
        Some(things)
    };
    // There are enough blocks for `count` values, and each value takes at least one byte.
    let least: usize = blocks.iter().map(|block| block.len()).sum();
    let room = |count: usize| Vec::with_capacity(count.min(least));
    std::thread::scope(|scope| {
        let helpers: Vec<_> = later
            .chunks(share)
            .zip(1..)
            .map(|(part, number)| {
                let read = move || of(room(part.len() * BLOCK), part, number * share);
                let name = "road-read".to_owned();
                (part, number, std::thread::Builder::new().name(name).spawn_scoped(scope, read))
            })
            .collect();
        let mut things = of(room(count), first, 0)?;
        for (part, number, helper) in helpers {
            let read = helper.ok().and_then(|helper| helper.join().ok());
            things.append(&mut read.unwrap_or_else(|| of(Vec::new(), part, number * share))?);
        }
        Some(things)
    })
}

/// Appends a part and returns where it begins and ends.
fn append(bytes: &mut Vec<u8>, part: &[u8]) -> [u64; 2] {
    bytes.resize(bytes.len().next_multiple_of(ALIGN), 0);
    let from = bytes.len() as u64;
    bytes.extend_from_slice(part);
    [from, bytes.len() as u64]
}
