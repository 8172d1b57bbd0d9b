use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use wgpu::{BindGroup, Buffer, BufferDescriptor, BufferUsages, Device, Queue};

use super::batch::Batch;
use super::bounds;
use super::kernels::Kernels;
use super::open::Gpu;
use super::top_levels;
use crate::bvh::Link;
use crate::film::Development;
use crate::glyphs::GLYPHS;
use crate::instance::StreetLight;
use crate::lamps::{LampGrid, SceneLamps};
use crate::lidar_return::REFLECTIVITIES;
use crate::light::Light;
use crate::quality::{SAMPLES, SKY_DIRECTIONS, Sample};
use crate::surface_material::MATERIALS;
use crate::{error::TraceError, overlay::Overlay, scene::Scene, world::World};

/// Workgroups in one row of a dispatch; every device supports at least 65 535.
pub(crate) const GROUPS_ACROSS: u32 = 32_768;

/// Uniforms of one frame. Twin of `FrameUniforms` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct FrameUniforms {
    light: Light,
    roots: [u32; 4],
    groups: [u32; 4],
    overlay: [u32; 4],
    town: [u32; 4],
    samples: [Sample; SAMPLES.len()],
    sky_directions: [Vec4; SAMPLES.len()],
}

/// Buffers on the device.
#[derive(Debug)]
pub(crate) struct GpuResources {
    /// Serial of the uploaded scene.
    scene: Option<u64>,
    /// Serial of the scene of the uploaded parked vehicles and plants.
    parked: Option<u64>,
    buffers: [GrowableBuffer; super::kernels::BINDINGS],
    group: Option<BindGroup>,
    /// Uploaded street lights.
    street_lights: Arc<Vec<StreetLight>>,
    lamps: SceneLamps,
    /// Whether the last batch was uploaded with lamps that shine.
    has_lamps: bool,
}

/// Binding numbers of the shaders.
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
    pub(super) const VIEWS_BEFORE: usize = 10;
    pub(super) const REFLECTIVITIES: usize = 11;
    pub(super) const MATERIALS: usize = 12;
    pub(super) const OVERLAY: usize = 13;
    pub(super) const STREET_LIGHTS: usize = 14;
    pub(super) const LAMPS: usize = 15;
    pub(super) const CORNER_NORMALS: usize = 16;
    pub(super) const FILMS: usize = 17;
    pub(super) const DEVELOPMENTS: usize = 18;
    pub(super) const RAINFALLS: usize = 19;
}

impl GpuResources {
    pub(crate) fn new(gpu: &Gpu) -> GpuResources {
        let buffers = std::array::from_fn(|binding| {
            let usage = match binding {
                at::FRAME | at::REFLECTIVITIES | at::MATERIALS => BufferUsages::UNIFORM,
                _ => BufferUsages::STORAGE,
            };
            GrowableBuffer::new(&gpu.device, usage | BufferUsages::COPY_DST)
        });
        let mut resources = GpuResources {
            scene: None,
            parked: None,
            buffers,
            group: None,
            street_lights: Arc::default(),
            lamps: SceneLamps::default(),
            has_lamps: false,
        };
        let reflectivities: Vec<[f32; 4]> =
            REFLECTIVITIES.iter().map(|[rho, diffuse]| [*rho, *diffuse, 0.0, 0.0]).collect();
        resources.upload(gpu, at::REFLECTIVITIES, bytemuck::cast_slice(&reflectivities));
        resources.upload(gpu, at::MATERIALS, bytemuck::cast_slice(MATERIALS.as_flattened()));
        // A binding holds at least one element.
        resources.grow(gpu, at::DEVELOPMENTS, size_of::<Development>() as u64);
        resources
    }

    /// Uploads the scene unless it is on the device already.
    ///
    /// # Errors
    /// [`TraceError::Gpu`] if a buffer exceeds the limits of the device or the scene violates
    /// `bounds`.
    pub(crate) fn upload_scene(&mut self, gpu: &Gpu, scene: &Scene) -> Result<(), TraceError> {
        if self.scene == Some(scene.serial) {
            return Ok(());
        }
        bounds::check_scene(scene).map_err(|why| gpu.error(why))?;
        let bytes_max = gpu.device.limits().max_storage_buffer_binding_size;
        let parts: [(&str, usize, &[u8]); 4] = [
            ("normals", at::CORNER_NORMALS, bytemuck::cast_slice(&scene.smooth)),
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
            self.upload(gpu, binding, bytes);
        }
        self.scene = Some(scene.serial);
        Ok(())
    }

    /// Uploads one frame's world and one batch's sensors, and grows the buffers of films and tags.
    pub(crate) fn upload_batch(&mut self, gpu: &Gpu, scene: &Scene, world: &World, batch: &Batch) {
        let [cameras, lidars, packing] = batch.groups;
        let light = world.light();
        let lamps = self.lamps.grid(scene, world, &light);
        self.has_lamps = !lamps.lamps.is_empty();
        self.upload_lamps(gpu, &lamps);
        let joined = top_levels::joined(world);
        let (nodes, instances) = match &joined {
            Some((nodes, instances)) => (nodes, instances),
            None => (&world.nodes, &world.instances),
        };
        let motions = if batch.has_flow() { world.motions.rows() } else { Vec::new() };
        let first_motion = if motions.is_empty() { 0 } else { instances.len() as u32 };
        let frame = FrameUniforms {
            light,
            roots: [
                scene.town_blas.root.0,
                world.root.unwrap_or(Link::EMPTY).0,
                batch.cameras.len() as u32,
                batch.lidars.len() as u32,
            ],
            groups: [cameras, lidars, packing, GROUPS_ACROSS],
            overlay: self.upload_overlay(gpu, &world.overlay, &batch.text_places),
            town: [scene.smooth_from, first_motion, 0, 0],
            samples: SAMPLES,
            sky_directions: SKY_DIRECTIONS,
        };
        if !Arc::ptr_eq(&self.street_lights, &world.street_lights) {
            let mut overrides = vec![StreetLight {
                number: world.street_lights.len() as u32,
                ..StreetLight::zeroed()
            }];
            overrides.extend_from_slice(&world.street_lights);
            self.upload(gpu, at::STREET_LIGHTS, bytemuck::cast_slice(&overrides));
            self.street_lights = Arc::clone(&world.street_lights);
        }
        self.upload(gpu, at::FRAME, bytemuck::bytes_of(&frame));
        // Those of parked vehicles and plants are the same in every frame, but for the node that joins.
        let placed_in = world.scene_serial();
        let is_known = placed_in == Some(scene.serial) && self.parked == placed_in;
        let [known_nodes, known_instances] = if is_known { world.parked_counts() } else { [0; 2] };
        self.parked = placed_in;
        self.upload_after(gpu, at::TOP_NODES, nodes, known_nodes);
        write(
            &gpu.queue,
            &self.buffers[at::TOP_NODES].buffer,
            0,
            bytemuck::cast_slice(&nodes[..nodes.len().min(1)]),
        );
        if motions.is_empty() {
            self.upload_after(gpu, at::INSTANCES, instances, known_instances);
        } else {
            let both = [instances.as_slice(), &motions].concat();
            self.upload_after(gpu, at::INSTANCES, &both, known_instances);
        }
        self.upload(gpu, at::CAMERAS, bytemuck::cast_slice(&batch.cameras));
        self.upload(gpu, at::LIDARS, bytemuck::cast_slice(&batch.lidars));
        self.upload(gpu, at::CIRCLES, bytemuck::cast_slice(&batch.circles));
        self.upload(gpu, at::DEVELOPMENTS, bytemuck::cast_slice(&batch.developments));
        self.upload(gpu, at::RAINFALLS, bytemuck::cast_slice(&batch.rainfalls));
        self.upload(gpu, at::VIEWS_BEFORE, bytemuck::cast_slice(&batch.views_before));
        self.grow(gpu, at::FILMS, batch.film_len * 16);
        self.grow(gpu, at::TAGS, u64::from(batch.tag_len) * 4);
    }

    /// Uploads the lamps: corner and cells per metre, columns, rows and offset of the lamps, then the
    /// cells, then the lamps.
    fn upload_lamps(&mut self, gpu: &Gpu, grid: &LampGrid) {
        let lamps = 2 + size_of_val(&grid.cells[..]) / 16;
        let place = [grid.low.x, grid.low.y, 1.0 / grid.side.max(1.0), 0.0];
        let counts = [grid.columns, grid.rows, lamps as u32, 0];
        let parts: [&[u8]; 4] = [
            bytemuck::cast_slice(&place),
            bytemuck::cast_slice(&counts),
            bytemuck::cast_slice(&grid.cells),
            bytemuck::cast_slice(&grid.lamps),
        ];
        self.upload(gpu, at::LAMPS, &parts.concat());
    }

    /// Uploads the debug shapes, if there are any, and the places of the texts in each image. Returns the root, the offsets of capsules and
    /// texts in units of 16 bytes, and the number of texts.
    fn upload_overlay(
        &mut self,
        gpu: &Gpu,
        overlay: &Overlay,
        text_places: &[[f32; 4]],
    ) -> [u32; 4] {
        if overlay.is_empty() {
            return [Link::EMPTY.0, 0, 0, 0];
        }
        let head = [overlay.pixels, 0.0, 0.0, 0.0];
        let parts: [&[u8]; 6] = [
            bytemuck::cast_slice(&head),
            bytemuck::cast_slice(&GLYPHS),
            bytemuck::cast_slice(&overlay.nodes),
            bytemuck::cast_slice(&overlay.capsules),
            bytemuck::cast_slice(&overlay.texts),
            bytemuck::cast_slice(text_places),
        ];
        self.upload(gpu, at::OVERLAY, &parts.concat());
        let ends = |count: usize| parts[..count].iter().map(|part| part.len() / 16).sum::<usize>();
        [overlay.root.0, ends(3) as u32, ends(4) as u32, overlay.texts.len() as u32]
    }

    /// Returns whether any lamp shines in the last batch.
    pub(crate) fn has_lamps(&self) -> bool {
        self.has_lamps
    }

    /// Returns the bind group of all buffers.
    pub(crate) fn group(&mut self, gpu: &Gpu, kernels: &Kernels) -> &BindGroup {
        let buffers = &self.buffers;
        self.group.get_or_insert_with(|| {
            let whole = |binding: usize| buffers[binding].buffer.as_entire_buffer_binding();
            kernels.bind(&gpu.device, std::array::from_fn(whole))
        })
    }

    fn upload(&mut self, gpu: &Gpu, binding: usize, bytes: &[u8]) {
        self.upload_after(gpu, binding, bytes, 0);
    }

    /// Uploads all elements but the first `known`, which are on the device already unless the buffer grows.
    fn upload_after<T: Pod>(&mut self, gpu: &Gpu, binding: usize, elements: &[T], known: usize) {
        let has_grown = self.grow(gpu, binding, size_of_val(elements) as u64);
        let known = if has_grown { 0 } else { known.min(elements.len()) };
        let bytes = bytemuck::cast_slice(&elements[known..]);
        let offset = (known * size_of::<T>()) as u64;
        write(&gpu.queue, &self.buffers[binding].buffer, offset, bytes);
    }

    /// Grows a buffer to at least `byte_len`; returns whether it is a new one.
    fn grow(&mut self, gpu: &Gpu, binding: usize, byte_len: u64) -> bool {
        let limits = gpu.device.limits();
        let bytes_max = limits.max_storage_buffer_binding_size;
        let has_grown = self.buffers[binding].grow(&gpu.device, byte_len, bytes_max);
        if has_grown {
            self.group = None;
        }
        has_grown
    }
}

fn write(queue: &Queue, buffer: &Buffer, offset: u64, bytes: &[u8]) {
    if !bytes.is_empty() {
        queue.write_buffer(buffer, offset, bytes);
    }
}

/// Buffer that is replaced by a larger one when needed.
#[derive(Debug)]
pub(crate) struct GrowableBuffer {
    pub(crate) buffer: Buffer,
    usage: BufferUsages,
}

impl GrowableBuffer {
    pub(crate) fn new(device: &Device, usage: BufferUsages) -> GrowableBuffer {
        GrowableBuffer { buffer: GrowableBuffer::buffer(device, usage, 1024), usage }
    }

    fn buffer(device: &Device, usage: BufferUsages, size: u64) -> Buffer {
        let label = Some("rays");
        device.create_buffer(&BufferDescriptor { label, size, usage, mapped_at_creation: false })
    }

    /// Grows the buffer to at least `byte_len`, with some spare space but at most `bytes_max`.
    /// Returns whether a new buffer was created.
    pub(crate) fn grow(&mut self, device: &Device, byte_len: u64, bytes_max: u64) -> bool {
        if byte_len <= self.buffer.size() {
            return false;
        }
        let spare = (byte_len + byte_len / 4).min(bytes_max).max(byte_len).next_multiple_of(256);
        self.buffer = GrowableBuffer::buffer(device, self.usage, spare);
        true
    }
}
