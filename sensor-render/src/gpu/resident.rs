use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use wgpu::{BindGroup, Buffer, BufferDescriptor, BufferUsages, Device, Queue};

use super::batch::Batch;
use super::kernels::Kernels;
use super::open::Gpu;
use crate::bvh::Link;
use crate::coat::MATERIALS;
use crate::echo::REFLECTIVITIES;
use crate::glyphs::GLYPHS;
use crate::light::Light;
use crate::world::Lamp;
use crate::{Overlay, Scene, TraceError, World};

/// Workgroups in one row of a dispatch: no device takes fewer than 65 535.
pub(crate) const GROUPS_ACROSS: u32 = 32_768;

/// The twin of `Frame` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Frame {
    light: Light,
    roots: [u32; 4],
    groups: [u32; 4],
    overlay: [u32; 4],
}

/// Everything on the device but the shaders.
#[derive(Debug)]
pub(crate) struct Resident {
    /// The scene that is uploaded.
    scene: Option<u64>,
    buffers: [Growing; super::kernels::BINDINGS],
    group: Option<BindGroup>,
    /// The windows of the last batch: if they change, gaps between planes are cleared.
    planned: u64,
    /// The street lamps that are uploaded.
    lamps: Arc<Vec<Lamp>>,
}

/// Names of the bindings, by number.
mod at {
    pub(super) const FRAME: usize = 0;
    pub(super) const NODES: usize = 1;
    pub(super) const TRIANGLES: usize = 2;
    pub(super) const WALLS: usize = 3;
    pub(super) const TOP_NODES: usize = 4;
    pub(super) const INSTANCES: usize = 5;
    pub(super) const CAMERAS: usize = 6;
    pub(super) const LIDARS: usize = 7;
    pub(super) const CIRCLES: usize = 8;
    pub(super) const TAGS: usize = 9;
    pub(super) const OUT: usize = 10;
    pub(super) const REFLECTIVITIES: usize = 11;
    pub(super) const MATERIALS: usize = 12;
    pub(super) const OVERLAY: usize = 13;
    pub(super) const LAMPS_TOLD: usize = 14;
}

impl Resident {
    pub(crate) fn new(gpu: &Gpu) -> Resident {
        let buffers = std::array::from_fn(|binding| {
            let usage = match binding {
                at::FRAME | at::REFLECTIVITIES | at::MATERIALS => BufferUsages::UNIFORM,
                at::OUT => BufferUsages::STORAGE | BufferUsages::COPY_SRC,
                _ => BufferUsages::STORAGE,
            };
            Growing::new(&gpu.device, usage | BufferUsages::COPY_DST)
        });
        let mut resident =
            Resident { scene: None, buffers, group: None, planned: 0, lamps: Arc::default() };
        let reflectivities: Vec<[f32; 4]> =
            REFLECTIVITIES.iter().map(|[rho, diffuse]| [*rho, *diffuse, 0.0, 0.0]).collect();
        resident.put(gpu, at::REFLECTIVITIES, bytemuck::cast_slice(&reflectivities));
        resident.put(gpu, at::MATERIALS, bytemuck::cast_slice(MATERIALS.as_flattened()));
        resident
    }

    /// Uploads the scene, unless it is there.
    pub(crate) fn take_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Result<(), TraceError> {
        if self.scene == Some(scene.serial) {
            return Ok(());
        }
        let bytes_max = gpu.device.limits().max_storage_buffer_binding_size;
        let parts: [(&str, usize, &[u8]); 3] = [
            ("nodes", at::NODES, bytemuck::cast_slice(&scene.nodes)),
            ("triangles", at::TRIANGLES, bytemuck::cast_slice(&scene.triangles)),
            ("walls", at::WALLS, bytemuck::cast_slice(&scene.walls)),
        ];
        for (what, binding, bytes) in parts {
            if bytes.len() as u64 > bytes_max {
                return Err(gpu.error(format!(
                    "the scene's {what} take {} bytes, the device binds at most {bytes_max}; try --device cpu",
                    bytes.len()
                )));
            }
            self.put(gpu, binding, bytes);
        }
        self.scene = Some(scene.serial);
        Ok(())
    }

    /// Uploads one frame's world and one batch's sensors, and makes room for what they give.
    pub(crate) fn take_batch(&mut self, gpu: &Gpu, scene: &Scene, world: &World, batch: &Batch) {
        let [cameras, lidars, packing] = batch.groups;
        let frame = Frame {
            light: Light::new(&world.weather, world.stamp.sim_time_nanos),
            roots: [
                scene.ground.root.0,
                world.root.unwrap_or(Link::EMPTY).0,
                batch.cameras.len() as u32,
                batch.lidars.len() as u32,
            ],
            groups: [cameras, lidars, packing, GROUPS_ACROSS],
            overlay: self.take_overlay(gpu, &world.overlay),
        };
        if !Arc::ptr_eq(&self.lamps, &world.lamps) {
            let mut told = vec![Lamp { number: world.lamps.len() as u32, ..Lamp::zeroed() }];
            told.extend_from_slice(&world.lamps);
            self.put(gpu, at::LAMPS_TOLD, bytemuck::cast_slice(&told));
            self.lamps = Arc::clone(&world.lamps);
        }
        self.put(gpu, at::FRAME, bytemuck::bytes_of(&frame));
        self.put(gpu, at::TOP_NODES, bytemuck::cast_slice(&world.nodes));
        self.put(gpu, at::INSTANCES, bytemuck::cast_slice(&world.instances));
        self.put(gpu, at::CAMERAS, bytemuck::cast_slice(&batch.cameras));
        self.put(gpu, at::LIDARS, bytemuck::cast_slice(&batch.lidars));
        self.put(gpu, at::CIRCLES, bytemuck::cast_slice(&batch.circles));
        self.grow(gpu, at::TAGS, u64::from(batch.tag_len) * 4);
        self.grow(gpu, at::OUT, batch.byte_len);
    }

    /// Uploads what is drawn, if anything is; where its parts begin, as words of 16 bytes.
    fn take_overlay(&mut self, gpu: &Gpu, overlay: &Overlay) -> [u32; 4] {
        if overlay.is_empty() {
            return [Link::EMPTY.0, 0, 0, 0];
        }
        let head = [overlay.pixels, 0.0, 0.0, 0.0];
        let parts: [&[u8]; 5] = [
            bytemuck::cast_slice(&head),
            bytemuck::cast_slice(&GLYPHS),
            bytemuck::cast_slice(&overlay.nodes),
            bytemuck::cast_slice(&overlay.rods),
            bytemuck::cast_slice(&overlay.texts),
        ];
        self.put(gpu, at::OVERLAY, &parts.concat());
        let ends = |count: usize| parts[..count].iter().map(|part| part.len() / 16).sum::<usize>();
        [overlay.root.0, ends(3) as u32, ends(4) as u32, overlay.texts.len() as u32]
    }

    /// All buffers, bound.
    pub(crate) fn group(&mut self, gpu: &Gpu, kernels: &Kernels) -> &BindGroup {
        let buffers = &self.buffers;
        self.group.get_or_insert_with(|| {
            kernels.bind(&gpu.device, std::array::from_fn(|binding| &buffers[binding].buffer))
        })
    }

    /// Whether the output is laid out otherwise than before, so that stale bytes may lie between
    /// its planes.
    pub(crate) fn is_new_plan(&mut self, batch: &Batch) -> bool {
        let plan = batch.plan();
        std::mem::replace(&mut self.planned, plan) != plan
    }

    /// Where measurements are written.
    pub(crate) fn out(&self) -> &Buffer {
        &self.buffers[at::OUT].buffer
    }

    fn put(&mut self, gpu: &Gpu, binding: usize, bytes: &[u8]) {
        self.grow(gpu, binding, bytes.len() as u64);
        write(&gpu.queue, &self.buffers[binding].buffer, bytes);
    }

    fn grow(&mut self, gpu: &Gpu, binding: usize, byte_len: u64) {
        let limits = gpu.device.limits();
        if self.buffers[binding].grow(&gpu.device, byte_len, limits.max_storage_buffer_binding_size)
        {
            self.group = None;
            self.planned = 0;
        }
    }
}

fn write(queue: &Queue, buffer: &Buffer, bytes: &[u8]) {
    if !bytes.is_empty() {
        queue.write_buffer(buffer, 0, bytes);
    }
}

/// A buffer that is replaced by a larger one when it gets too small.
#[derive(Debug)]
struct Growing {
    buffer: Buffer,
    usage: BufferUsages,
}

impl Growing {
    fn new(device: &Device, usage: BufferUsages) -> Growing {
        Growing { buffer: Growing::buffer(device, usage, 1024), usage }
    }

    fn buffer(device: &Device, usage: BufferUsages, size: u64) -> Buffer {
        let label = Some("rays");
        device.create_buffer(&BufferDescriptor { label, size, usage, mapped_at_creation: false })
    }

    /// Makes room for `byte_len`, with some to spare but never beyond `bytes_max`. Says whether
    /// that took a new buffer.
    fn grow(&mut self, device: &Device, byte_len: u64, bytes_max: u64) -> bool {
        if byte_len <= self.buffer.size() {
            return false;
        }
        let spare = (byte_len + byte_len / 4).min(bytes_max).max(byte_len).next_multiple_of(256);
        self.buffer = Growing::buffer(device, self.usage, spare);
        true
    }
}
