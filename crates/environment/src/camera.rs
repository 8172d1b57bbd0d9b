//! The camera of ego vehicles: the renderer's scene and its CPU tracer, in the calling thread.

use std::{f32::consts::FRAC_PI_2, sync::Arc};

use bytemuck::Zeroable;
use glam::{Quat, Vec3};
use protocol::{Block, Name, Plane, Pose, SensorSpec, Weather, layout, output, sensor};
use sensor_render::{BundleJob, CpuTracer, RenderError, Scene, World, pose_planes};

use crate::simulation::Simulation;

/// A pinhole camera without distortion; pixels are square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Pixels across, 8 to 2048.
    pub width_px: u32,
    /// Pixels down, 8 to 2048.
    pub height_px: u32,
    /// Horizontal field of view. Radians, 0.1 to 3.
    pub fov_rad: f32,
    /// `vehicle_from_camera`: x forward, y left, z up.
    pub mount: Pose,
    /// What a pixel shows.
    pub output: CameraOutput,
}

impl Default for Camera {
    /// Returns a camera above the windscreen that looks straight ahead.
    fn default() -> Camera {
        Camera {
            width_px: 84,
            height_px: 84,
            fov_rad: FRAC_PI_2,
            mount: Pose::new(Vec3::new(1.5, 0.0, 2.0), Quat::IDENTITY),
            output: CameraOutput::Color,
        }
    }
}

/// What a pixel of a camera shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CameraOutput {
    /// Three bytes: red, green, blue; sRGB.
    #[default]
    Color,
    /// One byte: the semantic tag (`mesh::Tag`).
    Tags,
    /// Four bytes, an `f32` in the byte order of the machine: metres along the optical axis, 1000
    /// where nothing is hit.
    Depth,
}

impl CameraOutput {
    /// Returns the bytes of a pixel.
    pub fn pixel_bytes(self) -> usize {
        match self {
            CameraOutput::Color => 3,
            CameraOutput::Tags => 1,
            CameraOutput::Depth => 4,
        }
    }

    fn code(self) -> u32 {
        match self {
            CameraOutput::Color => output::COLOR,
            CameraOutput::Tags => output::TAG,
            CameraOutput::Depth => output::DEPTH,
        }
    }
}

/// A camera that renders the frames of a simulation.
#[derive(Debug)]
pub struct CameraView {
    scene: Arc<Scene>,
    world: World,
    tracer: CpuTracer,
    sensor: SensorSpec,
    planes: Vec<Plane>,
    /// Memory for the table of planes and the image; kept for the next frame.
    payload: Vec<Block>,
}

impl CameraView {
    /// Creates a camera in a scene.
    pub fn new(scene: Arc<Scene>, camera: &Camera) -> CameraView {
        let sensor = SensorSpec {
            name: Name::new("camera"),
            kind: sensor::CAMERA,
            outputs: camera.output.code(),
            parent_from_sensor: camera.mount,
            width: camera.width_px,
            height: camera.height_px,
            fov_rad: camera.fov_rad,
            ..SensorSpec::default()
        };
        let (planes, byte_len) = layout(&[sensor]);
        CameraView {
            scene,
            world: World::new(),
            tracer: CpuTracer::in_calling_thread(),
            sensor,
            planes,
            payload: vec![Block::zeroed(); byte_len.div_ceil(size_of::<Block>() as u64) as usize],
        }
    }

    /// Takes in the newest frame of a simulation, in the weather that worlds begin with.
    pub fn place(&mut self, simulation: &Simulation) {
        let sim = simulation.sim();
        self.world.place(
            &self.scene,
            simulation.stamp(),
            sim.settings().delta_nanos,
            &Weather::default(),
            sim.states(),
            |actor| {
                let [red, green, blue, _] = actor.color.to_le_bytes();
                [red, green, blue]
            },
        );
    }

    /// Renders the frame that was placed last from a vehicle at `world_from_vehicle`, row by row from
    /// the upper left.
    ///
    /// # Errors
    /// [`RenderError::Trace`] if the camera or the pose cannot be rendered.
    pub fn render(
        &mut self,
        world_from_vehicle: &Pose,
        out: &mut Vec<u8>,
    ) -> Result<(), RenderError> {
        let CameraView { scene, world, tracer, sensor, planes, payload } = self;
        let sensors = std::slice::from_ref(sensor);
        pose_planes(planes, sensors, world_from_vehicle);
        let payload: &mut [u8] = bytemuck::cast_slice_mut(payload);
        let parent = Default::default();
        let job = BundleJob { parent, sensors, planes, out: payload };
        tracer.measure(scene, world, &mut [job])?;
        let image = &payload[planes[0].offset as usize..][..planes[0].byte_len as usize];
        out.clear();
        if sensor.outputs == output::COLOR {
            // The fourth byte is always 255.
            out.extend(
                image.as_chunks().0.iter().flat_map(|[red, green, blue, _]| [red, green, blue]),
            );
        } else {
            out.extend_from_slice(image);
        }
        Ok(())
    }
}
