//! Elements of byte payloads.

use bytemuck::{Pod, Zeroable};

/// 64 bytes of payload, aligned to 64 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[repr(align(64))]
pub struct Block(pub [u8; 64]);

/// 4096 bytes of payload, aligned to a page so that a GPU can import and write them.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[repr(align(4096))]
pub struct Page(pub [u8; 4096]);
