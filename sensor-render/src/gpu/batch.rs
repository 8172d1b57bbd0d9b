use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec3};
use protocol::{SensorSpec, lens_model, output, sensor};

use super::top_levels;
use crate::film::{CELLS, Development};
use crate::lidar::Lidar;
use crate::lidar_air::Air;
use crate::lidar_echo::Echoes;
use crate::lidar_spray::Spray;
use crate::light::Light;
use crate::overlay::{TEXT_NEAR_M, Text};
use crate::rain::Rainfall;
use crate::rain::{PUFFS_MAX, Puff};
use crate::rays::{Camera, Sensor};
use crate::scene::Scene;
use crate::{error::TraceError, job::BundleJob, outputs, world::World};

/// In place of the offset of a plane: the sensor does not have it.
pub(crate) const NONE: u32 = u32::MAX;

/// Camera as the shaders read it. Twin of `Camera` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GpuCamera {
    pub(crate) origin: [f32; 4],
    pub(crate) forward: [f32; 4],
    pub(crate) right: [f32; 4],
    pub(crate) down: [f32; 4],
    pub(crate) center: [f32; 2],
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) first_group: u32,
    /// Number of the buffer that its planes are written to; 0: the device's own.
    pub(crate) payload: u32,
    pub(crate) color: u32,
    pub(crate) depth: u32,
    pub(crate) instance: u32,
    pub(crate) tag: u32,
    pub(crate) first_tag: u32,
    pub(crate) first_packing_group: u32,
    pub(crate) first_sample: u32,
    pub(crate) samples: u32,
    pub(crate) lens: u32,
    pub(crate) coefficient5: f32,
    pub(crate) coefficients: [f32; 4],
    pub(crate) pixel: [f32; 2],
    pub(crate) focal: [f32; 2],
    pub(crate) radius_max: f32,
    pub(crate) image_radius_max: f32,
    pub(crate) film: u32,
    pub(crate) development: u32,
    pub(crate) normal: u32,
    pub(crate) flow: u32,
    /// Number in [`Batch::rainfalls`]; [`NONE`]: nothing falls before the camera.
    pub(crate) rainfall: u32,
    /// Number in [`Batch::views_before`]; [`NONE`] without normals and optical flow.
    pub(crate) view_before: u32,
}

const _: () = assert!(size_of::<GpuCamera>() == 192);

/// View of a camera in the previous frame. Twin of `ViewBefore` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewBefore {
    /// w: 1 if the camera has moved since.
    origin: [f32; 4],
    forward: [f32; 4],
    right: [f32; 4],
    down: [f32; 4],
}

/// Number of kinds of cameras, each with a kernel of its own.
pub(crate) const CAMERA_KINDS: usize = 16;

impl GpuCamera {
    /// Returns the kind: 1 for several rays per pixel, plus 2 for a lens, 4 for effects, and 8 for normals or
    /// optical flow.
    fn kind(&self) -> usize {
        let is_smooth = self.color != NONE && self.samples > 1;
        let has_lens = self.lens != lens_model::PINHOLE;
        let has_effects = self.development != NONE;
        let has = [is_smooth, has_lens, has_effects, self.has_surfaces()];
        has.iter().enumerate().map(|(bit, has)| usize::from(*has) << bit).sum()
    }

    /// Returns whether the camera measures normals or optical flow.
    pub(crate) fn has_surfaces(&self) -> bool {
        self.normal != NONE || self.flow != NONE
    }
}

/// Lidar as the shaders read it. Twin of `Lidar` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GpuLidar {
    pub(crate) origin: [f32; 4],
    pub(crate) x_axis: [f32; 4],
    pub(crate) y_axis: [f32; 4],
    pub(crate) z_axis: [f32; 4],
    pub(crate) columns: u32,
    pub(crate) channels: u32,
    pub(crate) azimuths: u32,
    pub(crate) elevations: u32,
    pub(crate) first_group: u32,
    pub(crate) points: u32,
    pub(crate) labels: u32,
    pub(crate) seed: u32,
    pub(crate) last_points: u32,
    pub(crate) last_labels: u32,
    /// Beams that share an azimuth, and the number of elevations: beam b has azimuth b / span and
    /// elevation b mod count.
    pub(crate) span: u32,
    pub(crate) elevation_count: u32,
    /// First of the places of the columns in the circles, six pairs each; [`NONE`]: all are the same.
    pub(crate) places: u32,
    /// Rays per beam; 0: a beam has no echoes but that of the first surface.
    pub(crate) rays: u32,
    pub(crate) ring: f32,
    pub(crate) extinction_per_m: f32,
    pub(crate) fog_m: f32,
    pub(crate) fog_power: f32,
    pub(crate) rain: f32,
    pub(crate) drop_scale: f32,
    pub(crate) least_power: f32,
    pub(crate) puff_count: u32,
    pub(crate) reserved: [u32; 2],
    pub(crate) puffs: [Puff; PUFFS_MAX],
}

const _: () = assert!(size_of::<GpuLidar>() == 416);

/// Payload that shaders write into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// Number of its buffer in the shaders.
    pub(crate) number: u32,
    pub(crate) byte_len: u64,
}

/// Consecutive sensors of one bundle: a range of its payload, and the place of that range in the
/// output of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    /// Index of the job.
    pub(crate) job: usize,
    /// First byte in the payload; a multiple of 64.
    pub(crate) begin: u64,
    /// End of the range in the payload, exclusive.
    pub(crate) end: u64,
    /// First byte in the output of the device; a multiple of 64.
    pub(crate) base: u64,
}

/// Sensors of one submission.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batch {
    pub(crate) cameras: Vec<GpuCamera>,
    pub(crate) lidars: Vec<GpuLidar>,
    /// Cosines and sines of the azimuths and elevations of all lidars, and the places of their columns.
    pub(crate) circles: Vec<[f32; 2]>,
    /// Positions of the texts of the overlay in the image of each camera: column and row in pixels from the
    /// centre of pixel (0, 0), and the depth; negative where the camera does not show it.
    pub(crate) text_places: Vec<[f32; 4]>,
    pub(crate) windows: Vec<Window>,
    /// Bytes in the device's own buffer.
    pub(crate) byte_len: u64,
    /// Number of unpacked tags, one word each.
    pub(crate) tag_len: u32,
    /// Vectors of all films.
    pub(crate) film_len: u64,
    /// Effects of the cameras that have some, in their order.
    pub(crate) developments: Vec<Development>,
    /// Rain and spray of the cameras before which some falls.
    pub(crate) rainfalls: Vec<Rainfall>,
    /// Views in the previous frame of the cameras that measure normals or optical flow.
    pub(crate) views_before: Vec<ViewBefore>,
    /// Numbers of workgroups of the camera, lidar and packing passes.
    pub(crate) groups: [u32; 3],
}

/// Checks the jobs, writes their tables of planes, and distributes their sensors to batches with at
/// most `bytes_max` bytes each in the device's own buffer. Shaders write the cameras of a job with a target
/// into that. The first batch uses the memory of `spare`.
///
/// # Errors
/// [`TraceError`] if a job is invalid or one sensor exceeds `bytes_max`.
pub(crate) fn batches(
    scene: &Scene,
    world: &World,
    jobs: &mut [BundleJob],
    targets: &[Option<Target>],
    bytes_max: u64,
    spare: Batch,
) -> Result<Vec<Batch>, TraceError> {
    let mut batches = vec![spare.emptied()];
    let light = world.light();
    for (job_index, (job, &target)) in jobs.iter_mut().zip(targets).enumerate() {
        let planes = outputs::check(job)?;
        outputs::write_table(world, job.sensors, planes, job.out);
        for of_sensor in planes.chunk_by(|a, b| a.sensor == b.sensor) {
            let (first, last) = (&of_sensor[0], &of_sensor[of_sensor.len() - 1]);
            let (begin, end) = (first.offset, last.offset + last.byte_len);
            let spec = &job.sensors[first.sensor as usize];
            let target = target.filter(|target| {
                is_written_directly(spec) && end.next_multiple_of(64) <= target.byte_len
            });
            let payload = target.map_or(0, |target| target.number);
            // In the device's own buffer.
            let byte_len = if payload == 0 { (end - begin).next_multiple_of(64) } else { 0 };
            let unpacked = match of_sensor.iter().find(|plane| plane.output == output::TAG) {
                Some(plane) => plane.byte_len * 4,
                None => 0,
            };
            let longest = byte_len.max(unpacked).max(film_bytes(spec));
            if longest > bytes_max {
                let sensor = spec.name;
                return Err(TraceError::TooLarge { sensor, byte_len: longest, bytes_max });
            }
            let pose = &first.world_from_sensor;
            let sensor = outputs::ray_generator(scene, world, job.parent, spec, pose)?;
            let mut batch = batches.last_mut().unwrap_or_else(|| unreachable!("never empty"));
            if batch.byte_len + byte_len > bytes_max
                || u64::from(batch.tag_len) * 4 + unpacked > bytes_max
                || batch.film_len * 16 + film_bytes(spec) > bytes_max
            {
                batches.push(Batch::default());
                batch = batches.last_mut().unwrap_or_else(|| unreachable!("just pushed"));
            }
            let base = if payload == 0 { batch.byte_len } else { begin };
            let plane = |output: u32| {
                let plane = of_sensor.iter().find(|plane| plane.output == output);
                plane.map_or(NONE, |plane| ((base + plane.offset - begin) / 4) as u32)
            };
            match sensor {
                Sensor::Camera(camera) => {
                    batch.add_text_places(&camera, &world.overlay.texts);
                    batch.add_camera(world, &camera, &light, payload, plane);
                }
                Sensor::Lidar(lidar) => batch.add_lidar(&lidar, plane),
            }
            if payload == 0 {
                batch.extend(Window { job: job_index, begin, end, base });
                batch.byte_len = base + byte_len;
            }
        }
    }
    batches.retain(|batch| batch.groups != [0; 3]);
    Ok(batches)
}

impl Batch {
    /// Returns an empty batch with the memory for cameras of this one.
    fn emptied(self) -> Batch {
        let Batch { mut cameras, mut windows, .. } = self;
        cameras.clear();
        windows.clear();
        Batch { cameras, windows, ..Batch::default() }
    }

    fn add_text_places(&mut self, camera: &Camera, texts: &[Text]) {
        let place = |text: &Text| {
            let to = Vec3::from(text.at) - camera.origin;
            let place = camera.project(&camera.view(), to, TEXT_NEAR_M);
            place.map_or([0.0, 0.0, -1.0, 0.0], |([x, y], depth)| [x, y, depth, 0.0])
        };
        self.text_places.extend(texts.iter().map(place));
    }

    fn add_camera(
        &mut self,
        world: &World,
        camera: &Camera,
        light: &Light,
        payload: u32,
        plane: impl Fn(u32) -> u32,
    ) {
        let pixels = camera.width * camera.height;
        let tag = plane(output::TAG);
        let color = plane(output::COLOR);
        let [film, development] = self.add_film(world, camera, light, color != NONE);
        let [normal, flow] = [output::NORMAL, output::FLOW].map(&plane);
        let rainfall = number_of(&mut self.rainfalls, camera.rain.as_deref().copied());
        let view = (normal != NONE || flow != NONE).then(|| view_before(camera));
        let view_before = number_of(&mut self.views_before, view);
        self.cameras.push(GpuCamera {
            origin: extended(camera.origin, camera.pixel),
            forward: extended(camera.forward, 0.0),
            right: extended(camera.right, 0.0),
            down: extended(camera.down, 0.0),
            center: camera.center,
            width: camera.width,
            height: camera.height,
            first_group: self.groups[0],
            payload,
            color,
            depth: plane(output::DEPTH),
            instance: plane(output::INSTANCE),
            tag,
            first_tag: self.tag_len,
            first_packing_group: self.groups[2],
            first_sample: camera.quality.first_sample(),
            samples: camera.quality.samples().len() as u32,
            film,
            development,
            pixel: [camera.pixel, camera.pixel_down],
            normal,
            flow,
            rainfall,
            view_before,
            ..lens_of(camera)
        });
        self.groups[0] += group_count([camera.width, camera.height]);
        if tag != NONE {
            self.tag_len += pixels;
            self.groups[2] += (pixels.div_ceil(64) * 16).div_ceil(64);
        }
    }

    /// Adds the effects of a camera. Returns the offset of its film, [`NONE`] without a colour image, and the
    /// number of its development, [`NONE`] without effects.
    fn add_film(
        &mut self,
        world: &World,
        camera: &Camera,
        light: &Light,
        has_color: bool,
    ) -> [u32; 2] {
        let Some(mut development) = Development::new(camera, light, world.delta_nanos) else {
            return [NONE; 2];
        };
        if let Some(roots) = top_levels::roots(world, camera) {
            (development.has_roots, development.roots) = (1, roots);
        }
        let film = if has_color { self.film_len as u32 } else { NONE };
        if has_color {
            self.film_len += development.film_len(camera);
        }
        self.developments.push(development);
        [film, self.developments.len() as u32 - 1]
    }

    /// Returns the largest number of cells of a film; `None` if there is no film.
    pub(crate) fn cells_max(&self) -> Option<u32> {
        self.developments.iter().map(|how| how.cells()[0] as u32).max()
    }

    fn add_lidar(&mut self, lidar: &Lidar, plane: impl Fn(u32) -> u32) {
        let azimuths = self.circles.len() as u32;
        self.circles.extend_from_slice(&lidar.azimuths);
        let elevations = self.circles.len() as u32;
        self.circles.extend_from_slice(&lidar.elevations);
        let places = if lidar.places.is_empty() { NONE } else { self.circles.len() as u32 };
        for place in &lidar.places {
            let Mat3 { x_axis, y_axis, z_axis } = place.axes;
            let numbers = [place.origin, x_axis, y_axis, z_axis].map(|vector| vector.to_array());
            self.circles.extend_from_slice(bytemuck::cast_slice(numbers.as_flattened()));
        }
        let receiver = &lidar.receiver;
        let (rays, ring, air, spray) = match &lidar.echoes {
            Some(Echoes { rays, ring, air, spray }) => (*rays, *ring, *air, *spray),
            None => (0, 0.0, Air::default(), Spray::default()),
        };
        self.lidars.push(GpuLidar {
            origin: extended(lidar.origin, receiver.range_m),
            x_axis: extended(lidar.axes.x_axis, receiver.attenuation_per_m),
            y_axis: extended(lidar.axes.y_axis, receiver.noise_m),
            z_axis: extended(lidar.axes.z_axis, receiver.dropoff),
            columns: lidar.columns,
            channels: lidar.channels,
            azimuths,
            elevations,
            first_group: self.groups[1],
            points: plane(output::POINTS),
            labels: plane(output::LABELS),
            seed: receiver.seed,
            last_points: plane(output::LAST_POINTS),
            last_labels: plane(output::LAST_LABELS),
            span: if lidar.is_grid { lidar.channels } else { 1 },
            elevation_count: lidar.elevations.len() as u32,
            places,
            rays,
            ring,
            extinction_per_m: air.extinction_per_m,
            fog_m: air.fog_m,
            fog_power: air.fog_power,
            rain: air.rain,
            drop_scale: air.drop_scale,
            least_power: air.least_power,
            puff_count: spray.count,
            reserved: [0; 2],
            puffs: spray.puffs,
        });
        self.groups[1] += (lidar.columns * lidar.channels).div_ceil(64);
    }

    /// Returns of which kinds there are cameras.
    pub(crate) fn camera_kinds(&self) -> [bool; CAMERA_KINDS] {
        let mut kinds = [false; CAMERA_KINDS];
        for camera in &self.cameras {
            kinds[camera.kind()] = true;
        }
        kinds
    }

    /// Returns whether drops or spray are before a camera.
    pub(crate) fn has_rain(&self) -> bool {
        !self.rainfalls.is_empty()
    }

    /// Returns whether a camera measures optical flow.
    pub(crate) fn has_flow(&self) -> bool {
        self.cameras.iter().any(|camera| camera.flow != NONE)
    }

    /// Returns whether there is a lidar with echoes, or one without.
    pub(crate) fn has_lidars(&self, has_echoes: bool) -> bool {
        self.lidars.iter().any(|lidar| (lidar.rays > 0) == has_echoes)
    }

    /// Returns a hash of what is written to the device's own buffer, and where.
    pub(crate) fn layout_hash(&self) -> u64 {
        let mut hash = self.byte_len | 1 << 63;
        let mut mix = |word: u64| hash = mesh::fold_word(hash, word) | 1 << 63;
        for camera in self.cameras.iter().filter(|camera| camera.payload == 0) {
            let GpuCamera { color, depth, instance, tag, normal, flow, width, height, .. } =
                *camera;
            for word in [color, depth, instance, tag, normal, flow, width, height] {
                mix(word.into());
            }
        }
        for lidar in &self.lidars {
            let GpuLidar { points, labels, last_points, last_labels, .. } = *lidar;
            let planes = [points, labels, last_points, last_labels];
            for word in planes.into_iter().chain([lidar.columns, lidar.channels]) {
                mix(word.into());
            }
        }
        hash
    }

    /// Adds a window, or extends the last one if the new one continues it.
    fn extend(&mut self, window: Window) {
        if let Some(last) = self.windows.last_mut() {
            let gap = last.end.next_multiple_of(64);
            if last.job == window.job
                && gap == window.begin
                && last.base + (gap - last.begin) == window.base
            {
                last.end = window.end;
                return;
            }
        }
        self.windows.push(window);
    }
}

/// Returns whether shaders write a sensor into its payload. Each word of points, normals and flow would cross the
/// bus alone, since those of neighbouring rays lie apart: that takes up to ten times a copy.
fn is_written_directly(spec: &SensorSpec) -> bool {
    spec.kind == sensor::CAMERA && spec.outputs & (output::NORMAL | output::FLOW) == 0
}

/// Returns the number of workgroups of an image. Twin of `pixel_of` in camera.wgsl.
fn group_count(size: [u32; 2]) -> u32 {
    let [columns, rows] = size.map(|side| (side + 3) / 8);
    let below = if rows * 8 < size[1] { size[0].div_ceil(16) } else { 0 };
    let right = if columns * 8 < size[0] { (rows * 8).div_ceil(16) } else { 0 };
    columns * rows + below + right
}

/// Returns an upper bound of the bytes of the film of a sensor.
fn film_bytes(spec: &SensorSpec) -> u64 {
    if spec.kind != sensor::CAMERA || spec.effects.is_none() {
        return 0;
    }
    // The second grid has fewer cells than the first, and there is room for each twice.
    let cells = u64::from(CELLS) * u64::from(CELLS) * 4;
    (u64::from(spec.width) * u64::from(spec.height) + cells) * 16
}

/// Returns a camera with the lens of another one, and nothing else.
fn lens_of(camera: &Camera) -> GpuCamera {
    let Some(lens) = &camera.lens else { return GpuCamera::zeroed() };
    let [coefficients @ .., coefficient5] = lens.coefficients;
    GpuCamera {
        lens: if lens.is_fisheye { lens_model::FISHEYE } else { lens_model::BROWN_CONRADY },
        coefficient5,
        coefficients,
        focal: lens.focal,
        radius_max: lens.radius_max,
        image_radius_max: lens.image_radius_max,
        ..GpuCamera::zeroed()
    }
}

/// Appends an element, if there is one, and returns its number.
fn number_of<T>(elements: &mut Vec<T>, element: Option<T>) -> u32 {
    let Some(element) = element else { return NONE };
    elements.push(element);
    elements.len() as u32 - 1
}

fn view_before(camera: &Camera) -> ViewBefore {
    let before = camera.before.unwrap_or_else(|| camera.view());
    ViewBefore {
        origin: extended(before.origin, f32::from(u8::from(camera.before.is_some()))),
        forward: extended(before.forward, 0.0),
        right: extended(before.right, 0.0),
        down: extended(before.down, 0.0),
    }
}

fn extended(v: Vec3, w: f32) -> [f32; 4] {
    [v.x, v.y, v.z, w]
}
