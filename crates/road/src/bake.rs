//! A network as bytes, so that the next start need not read the text again.
//!
//! Two kinds of part: what the index is made of stays in the bytes and is used from there, and
//! everything else is read field by field, lanes and roads on several cores. Bytes of any kind may
//! be given; what does not fit is no network, and nothing is believed of a length before as many
//! bytes are there.

mod fields;
mod rows;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::{
    grid::LaneIndexGrid, lane::Lane, network::Network, parallel::threads, road::Road, slab::Lent,
};
use fields::Field;
/// Changes whenever the layout changes.
const VERSION: u64 = 2;

const MAGIC: [u8; 8] = *b"omniroad";

/// So many lanes or roads are read in one go.
const BLOCK: usize = 512;

/// Parts begin at multiples of this.
const ALIGN: usize = 16;

/// The beginning of the bytes; blocks and slabs lie where it says.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    magic: [u8; 8],
    version: u64,
    /// How many bytes there are.
    length: u64,
    lanes: u64,
    roads: u64,
    /// Where the table of blocks begins and ends: first lanes, then roads, then the rest.
    blocks: [u64; 2],
    /// Where the slabs of the index begin and end: segments, starts, entries.
    slabs: [[u64; 2]; 3],
}

impl Network {
    /// All of it, to be read by the same version on the same kind of machine.
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

    /// The network that [`Network::to_bytes`] wrote, which keeps `bytes` and answers from them; none
    /// if they are anything else, or do not begin at a multiple of 8 in memory.
    pub fn from_bytes(bytes: Lent) -> Option<Network> {
        read(bytes, threads())
    }
}

/// The same network for any number of threads.
pub(crate) fn read(lent: Lent, threads: usize) -> Option<Network> {
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
    // Roads have about as much in them as everything else.
    let others_of = |threads: usize| {
        let mut network = rows::take_rest(rest)?;
        network.grid = LaneIndexGrid::lent(&lent, slabs.clone(), &network.grid, lanes)?;
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

/// The bytes of each block.
fn blocks<'a>(bytes: &'a [u8], head: &Head) -> Option<Vec<&'a [u8]>> {
    let [from, to] = head.blocks.map(|at| usize::try_from(at).unwrap_or(usize::MAX));
    let (ends, []) = bytes.get(from..to)?.as_chunks::<8>() else { return None };
    let end = |at: &[u8; 8]| usize::try_from(u64::from_le_bytes(*at)).ok();
    ends.windows(2)
        .map(|pair| bytes.get(Range { start: end(&pair[0])?, end: end(&pair[1])? }))
        .collect()
}

/// So many things out of their blocks, on so many threads.
fn many<T: Field + Send>(blocks: &[&[u8]], count: usize, threads: usize) -> Option<Vec<T>> {
    // The first thread reads to where all shall lie in the end.
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
    // There are blocks for all of them, and at least a byte for each.
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

/// Appends a part, and says where it begins and ends.
fn append(bytes: &mut Vec<u8>, part: &[u8]) -> [u64; 2] {
    bytes.resize(bytes.len().next_multiple_of(ALIGN), 0);
    let from = bytes.len() as u64;
    bytes.extend_from_slice(part);
    [from, bytes.len() as u64]
}
