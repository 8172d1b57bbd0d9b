//! Elements of payloads that are slices of bytes.

use bytemuck::{Pod, Zeroable};

/// 64 bytes of payload at a 64-byte edge.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[repr(align(64))]
pub struct Block(pub [u8; 64]);

/// 4096 bytes of payload at a page's edge, so that a graphics card can write them.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[repr(align(4096))]
pub struct Page(pub [u8; 4096]);
