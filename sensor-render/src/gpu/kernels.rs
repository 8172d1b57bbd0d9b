use std::num::NonZeroU32;
use std::sync::OnceLock;

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, BufferBinding, BufferBindingType,
    ComputePipeline, ComputePipelineDescriptor, Device, PipelineCompilationOptions, PipelineLayout,
    PipelineLayoutDescriptor, ShaderModule, ShaderModuleDescriptor, ShaderRuntimeChecks,
    ShaderSource, ShaderStages,
};

use super::open::ARRAY_FEATURES;

/// Number of bindings of the first group of the shaders (scene.wgsl, lidar_return.wgsl, surface_material.wgsl,
/// overlay_raster.wgsl, lamplight.wgsl and develop.wgsl).
pub(crate) const BINDINGS: usize = 20;

/// Buffers that shaders can write measurements to. Twin of outputs.wgsl.
pub(crate) const OUTPUTS_MAX: usize = 256;

/// Where measurements are written: to one buffer, or to one of several.
const OUTPUT: &str = include_str!("../shader/output.wgsl");
const OUTPUTS: &str = include_str!("../shader/outputs.wgsl");

const SHADER: &str = concat!(
    include_str!("../shader/scene.wgsl"),
    include_str!("../shader/reference.wgsl"),
    include_str!("../shader/lidar_return.wgsl"),
    include_str!("../shader/grain.wgsl"),
    include_str!("../shader/sky.wgsl"),
    include_str!("../shader/surface_material.wgsl"),
    include_str!("../shader/plate.wgsl"),
    include_str!("../shader/pattern.wgsl"),
    include_str!("../shader/wear.wgsl"),
    include_str!("../shader/room.wgsl"),
    include_str!("../shader/lamplight.wgsl"),
    include_str!("../shader/shade.wgsl"),
    include_str!("../shader/rain.wgsl"),
    include_str!("../shader/lens.wgsl"),
    include_str!("../shader/surfaces.wgsl"),
    include_str!("../shader/camera.wgsl"),
    include_str!("../shader/overlay_raster.wgsl"),
    include_str!("../shader/lidar_echo.wgsl"),
    include_str!("../shader/lidar.wgsl"),
    include_str!("../shader/develop.wgsl"),
);

/// Returns whether shaders can write into several buffers.
pub(crate) fn has_array(device: &Device) -> bool {
    device.features().contains(ARRAY_FEATURES)
        && device.limits().max_binding_array_elements_per_shader_stage as usize >= OUTPUTS_MAX
}

/// Returns the layout of the buffers that measurements are written to.
fn outputs_layout(device: &Device) -> BindGroupLayout {
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("outputs"),
        entries: &[BindGroupLayoutEntry {
            binding: 0,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty: BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: if has_array(device) { NonZeroU32::new(OUTPUTS_MAX as u32) } else { None },
        }],
    })
}

/// Compiled shaders.
#[derive(Debug)]
pub(crate) struct Kernels {
    layout: BindGroupLayout,
    pub(crate) outputs_layout: BindGroupLayout,
    pipeline_layout: PipelineLayout,
    module: ShaderModule,
    /// Renders the pixels of cameras, by [`CameraKernel`]; compiled at the first use.
    trace_cameras: [OnceLock<ComputePipeline>; 64],
    /// Draws debug shapes into the colours of all cameras.
    pub(crate) draw_overlay: ComputePipeline,
    /// Packs the tags of all cameras, four per word.
    pub(crate) pack_tags: ComputePipeline,
    /// Traces the beams of lidars without echoes.
    pub(crate) trace_lidars: ComputePipeline,
    /// Gather, expose and develop the films of cameras with effects; compiled at the first use.
    develop: OnceLock<[ComputePipeline; 3]>,
    /// Traces the beams of lidars with echoes; compiled at the first use.
    trace_echoes: OnceLock<ComputePipeline>,
}

impl Kernels {
    pub(crate) fn new(device: &Device) -> Kernels {
        let entries: Vec<BindGroupLayoutEntry> = (0..BINDINGS as u32)
            .map(|binding| BindGroupLayoutEntry {
                binding,
                visibility: ShaderStages::COMPUTE,
                ty: BindingType::Buffer {
                    ty: match binding {
                        0 | 11 | 12 => BufferBindingType::Uniform,
                        9 | 17 => BufferBindingType::Storage { read_only: false },
                        _ => BufferBindingType::Storage { read_only: true },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("rays"),
            entries: &entries,
        });
        let outputs_layout = outputs_layout(device);
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("rays"),
            bind_group_layouts: &[Some(&layout), Some(&outputs_layout)],
            immediate_size: 0,
        });
        let outputs = if has_array(device) { OUTPUTS } else { OUTPUT };
        let descriptor = ShaderModuleDescriptor {
            label: Some("rays"),
            source: ShaderSource::Wgsl([outputs, SHADER].concat().into()),
        };
        #[expect(unsafe_code, reason = "a check at every step of every ray costs a tenth")]
        // SAFETY: `bounds` checks everything that a shader indexes with before it is uploaded:
        // hierarchies end and are no deeper than the shaders' stack, their links stay within the
        // buffers that are uploaded with them, instances belong to the scene, and planes lie within
        // the buffers that they are written to. Material codes are clamped in the shaders.
        let module = unsafe {
            device.create_shader_module_trusted(descriptor, ShaderRuntimeChecks::unchecked())
        };
        let [draw_overlay, pack_tags, trace_lidars] = ["draw_overlay", "pack_tags", "trace_lidars"]
            .map(|entry_point| pipeline(device, &pipeline_layout, &module, entry_point, &[]));
        Kernels {
            layout,
            outputs_layout,
            pipeline_layout,
            module,
            trace_cameras: std::array::from_fn(|_| OnceLock::new()),
            draw_overlay,
            pack_tags,
            trace_lidars,
            develop: OnceLock::new(),
            trace_echoes: OnceLock::new(),
        }
    }

    /// Returns the kernel that traces lidars with echoes.
    pub(crate) fn trace_echoes(&self, device: &Device) -> &ComputePipeline {
        self.trace_echoes.get_or_init(|| {
            let Kernels { pipeline_layout, module, .. } = self;
            pipeline(device, pipeline_layout, module, "trace_lidars", &[("HAS_ECHOES", 1.0)])
        })
    }

    /// Returns the kernel that renders cameras of this kind.
    pub(crate) fn trace_cameras(&self, device: &Device, kind: CameraKernel) -> &ComputePipeline {
        let CameraKernel { is_smooth, has_lens, has_effects, has_surfaces, has_lamps, has_rain } =
            kind;
        let constants = [
            ("SMOOTH", is_smooth),
            ("HAS_LENS", has_lens),
            ("HAS_EFFECTS", has_effects),
            ("HAS_SURFACES", has_surfaces),
            ("HAS_LAMPS", has_lamps),
            ("HAS_RAIN", has_rain),
        ];
        let number = constants.iter().fold(0, |sum, (_, has)| sum << 1 | usize::from(*has));
        self.trace_cameras[number].get_or_init(|| {
            let constants = constants.map(|(name, has)| (name, f64::from(u8::from(has))));
            let Kernels { pipeline_layout, module, .. } = self;
            pipeline(device, pipeline_layout, module, "trace_cameras", &constants)
        })
    }

    /// Returns the kernels that develop films, in their order.
    pub(crate) fn develop(&self, device: &Device) -> &[ComputePipeline; 3] {
        self.develop.get_or_init(|| {
            let Kernels { pipeline_layout, module, .. } = self;
            ["gather_films", "expose_films", "develop_films"]
                .map(|entry_point| pipeline(device, pipeline_layout, module, entry_point, &[]))
        })
    }

    pub(crate) fn bind(&self, device: &Device, buffers: [BufferBinding; BINDINGS]) -> BindGroup {
        let entries: Vec<BindGroupEntry> = buffers
            .into_iter()
            .enumerate()
            .map(|(binding, buffer)| BindGroupEntry {
                binding: binding as u32,
                resource: BindingResource::Buffer(buffer),
            })
            .collect();
        device.create_bind_group(&BindGroupDescriptor {
            label: Some("rays"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

/// Which cameras a kernel renders. What it does not need is left out, which leaves more registers for
/// the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CameraKernel {
    /// Those with several rays per pixel, or the others.
    pub(crate) is_smooth: bool,
    /// Those with a lens, or pinholes.
    pub(crate) has_lens: bool,
    /// Those with effects, or the others.
    pub(crate) has_effects: bool,
    /// Those that measure normals or optical flow, or the others.
    pub(crate) has_surfaces: bool,
    /// Whether any lamp shines.
    pub(crate) has_lamps: bool,
    /// Whether drops or spray are before any camera.
    pub(crate) has_rain: bool,
}

fn pipeline(
    device: &Device,
    layout: &PipelineLayout,
    module: &ShaderModule,
    entry_point: &str,
    constants: &[(&str, f64)],
) -> ComputePipeline {
    device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(layout),
        module,
        entry_point: Some(entry_point),
        compilation_options: PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use wgpu::naga::{
        Module,
        front::wgsl,
        valid::{Capabilities, ValidationFlags, Validator},
    };

    use super::{OUTPUT, OUTPUTS, SHADER};

    #[test]
    fn the_shaders_are_valid_without_a_device() {
        let arrays = Capabilities::STORAGE_BUFFER_BINDING_ARRAY
            | Capabilities::STORAGE_BUFFER_BINDING_ARRAY_NON_UNIFORM_INDEXING;
        for (outputs, capabilities) in [(OUTPUT, Capabilities::empty()), (OUTPUTS, arrays)] {
            let shader = [outputs, SHADER].concat();
            let module = wgsl::parse_str(&shader)
                .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&shader)));
            let mut validator = Validator::new(ValidationFlags::all(), capabilities);
            validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&shader)));
            check_entry_points(&module);
        }
    }

    fn check_entry_points(module: &Module) {
        let names: Vec<_> = module.entry_points.iter().map(|entry| &*entry.name).collect();
        let expected = [
            "trace_cameras",
            "pack_tags",
            "draw_overlay",
            "trace_lidars",
            "gather_films",
            "expose_films",
            "develop_films",
        ];
        assert_eq!(names, expected);
    }
}
