use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, ComputePipeline,
    ComputePipelineDescriptor, Device, PipelineLayoutDescriptor, ShaderModuleDescriptor,
    ShaderRuntimeChecks, ShaderSource, ShaderStages,
};

/// The bindings of the shaders, in their order (scene.wgsl, echo.wgsl, coat.wgsl and draw.wgsl).
pub(crate) const BINDINGS: usize = 15;

const SHADER: &str = concat!(
    include_str!("../shader/scene.wgsl"),
    include_str!("../shader/reference.wgsl"),
    include_str!("../shader/echo.wgsl"),
    include_str!("../shader/grain.wgsl"),
    include_str!("../shader/sky.wgsl"),
    include_str!("../shader/coat.wgsl"),
    include_str!("../shader/pattern.wgsl"),
    include_str!("../shader/surface.wgsl"),
    include_str!("../shader/camera.wgsl"),
    include_str!("../shader/draw.wgsl"),
    include_str!("../shader/lidar.wgsl"),
);

/// The compiled shaders.
#[derive(Debug)]
pub(crate) struct Kernels {
    layout: BindGroupLayout,
    /// All cameras' pixels.
    pub(crate) see: ComputePipeline,
    /// What is drawn over the world, into all cameras' colours.
    pub(crate) draw_over: ComputePipeline,
    /// All cameras' tags, four a word.
    pub(crate) pack: ComputePipeline,
    /// All lidars' beams.
    pub(crate) sweep: ComputePipeline,
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
                        9 | 10 => BufferBindingType::Storage { read_only: false },
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
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("rays"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let descriptor = ShaderModuleDescriptor {
            label: Some("rays"),
            source: ShaderSource::Wgsl(SHADER.into()),
        };
        #[expect(unsafe_code, reason = "a check at every step of every ray costs a tenth")]
        // SAFETY: every index is of our own making: hierarchies are no deeper than the
        // shaders' stack is long, their links stay within what is uploaded with them, planes lie
        // within the output that `Resident` has grown for them, and every loop ends with its tree.
        let module = unsafe {
            device.create_shader_module_trusted(descriptor, ShaderRuntimeChecks::unchecked())
        };
        let pipeline = |entry_point: &str| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(entry_point),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let [see, draw_over, pack, sweep] = ["see", "draw_over", "pack", "sweep"].map(pipeline);
        Kernels { layout, see, draw_over, pack, sweep }
    }

    pub(crate) fn bind(&self, device: &Device, buffers: [&Buffer; BINDINGS]) -> BindGroup {
        let entries: Vec<BindGroupEntry> = buffers
            .iter()
            .enumerate()
            .map(|(binding, buffer)| BindGroupEntry {
                binding: binding as u32,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        device.create_bind_group(&BindGroupDescriptor {
            label: Some("rays"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}
