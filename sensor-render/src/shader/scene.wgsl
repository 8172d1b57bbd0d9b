// Buffers: geometry, light, sensors and outputs.

const NONE = 0xffffffffu;
const LEAF = 0x80000000u;

struct FrameUniforms {
    sun: vec4f,
    sun_color: vec4f,
    zenith: vec4f,
    horizon: vec4f,
    ground: vec4f,
    haze: vec4f,
    air: vec4f,
    sun_radius: vec4f,
    // Root of the town's hierarchy, root of the top level, number of cameras, number of lidars.
    roots: vec4u,
    // Workgroups of the camera, lidar and packing passes, and workgroups in one row of a dispatch.
    groups: vec4u,
    // Debug shapes: root, first capsule, first text, number of texts; see overlay_raster.wgsl.
    overlay: vec4u,
    // Number of triangles of the town; number of the first of the motions of the instances among `instances`,
    // or 0.
    town: vec4u,
    // Rays of a pixel at each quality: see SAMPLES in quality.rs.
    samples: array<vec4f, 21>,
    // Their directions of the sky: see SKY_DIRECTIONS in quality.rs.
    sky_directions: array<vec4f, 21>,
}

struct Instance {
    actor_from_world: array<vec4f, 3>,
    root: u32,
    id: u32,
    color: u32,
    lights: u32,
    blas: u32,
    size_squared: f32,
    reserved0: u32,
    reserved1: u32,
}

struct Puff {
    // Middle, and extinction there per metre.
    center: vec3f,
    density_per_m: f32,
    // Level direction of the long half axis, 1 / its length, and 1 / the length of that across.
    along: vec2f,
    per_length: f32,
    per_width: f32,
}

struct Camera {
    // w: width of a pixel at depth 1.
    origin: vec4f,
    forward: vec4f,
    right: vec4f,
    down: vec4f,
    center: vec2f,
    width: u32,
    height: u32,
    first_group: u32,
    // Number of the buffer that its planes are written to.
    payload: u32,
    // Offsets of the planes in its words; NONE if the camera does not have the output.
    color: u32,
    depth: u32,
    instance: u32,
    tag: u32,
    // Offset of its tags in `tags`, and its first workgroup of the packing pass.
    first_tag: u32,
    first_packing_group: u32,
    // Its rays per pixel in `frame.samples`.
    first_sample: u32,
    samples: u32,
    // Lens model (lens_model in lens.rs of the protocol); 0: a pinhole, which has none of what follows.
    lens: u32,
    // Fifth coefficient of a lens.
    coefficient5: f32,
    coefficients: vec4f,
    // Sides of a pixel at depth 1, and the focal lengths in pixels.
    pixel: vec2f,
    focal: vec2f,
    // Largest undistorted radius, and the distorted one there.
    radius_max: f32,
    image_radius_max: f32,
    // Of a camera with effects: offset of its film in `films`, and its number in `developments`; NONE for others.
    film: u32,
    development: u32,
    // Offsets of further planes, as above.
    normal: u32,
    flow: u32,
    // Numbers in `rainfalls` and `views_before`; NONE without.
    rainfall: u32,
    view_before: u32,
}

// Rain and spray before a camera: see Rainfall in rain.rs.
struct Rainfall {
    streak: vec3f,
    per_cell: f32,
    chances: vec4f,
    drops_seed: u32,
    puff_count: u32,
    shortest: f32,
    reserved0: u32,
    puffs: array<Puff, 8>,
}

// View of a camera in the previous frame; w of the origin: 1 if the camera has moved since.
struct ViewBefore {
    origin: vec4f,
    forward: vec4f,
    right: vec4f,
    down: vec4f,
}

struct Lidar {
    // w: range in metres.
    origin: vec4f,
    // w: attenuation per metre; negative if points report the cosine of incidence.
    x_axis: vec4f,
    // w: standard deviation of the range.
    y_axis: vec4f,
    // w: share of dropped returns.
    z_axis: vec4f,
    columns: u32,
    channels: u32,
    // Offsets of its cosines and sines in `circles`.
    azimuths: u32,
    elevations: u32,
    first_group: u32,
    points: u32,
    labels: u32,
    seed: u32,
    last_points: u32,
    last_labels: u32,
    // Beam b has azimuth b / span and elevation b mod elevation_count.
    span: u32,
    elevation_count: u32,
    // Places of its columns in `circles`: origin and axes, six pairs each. NONE: all are that above.
    places: u32,
    // Rays per beam; 0: a beam has no echoes but that of the first surface. See lidar_echo.wgsl.
    rays: u32,
    ring: f32,
    extinction: f32,
    fog_m: f32,
    fog_power: f32,
    rain: f32,
    drop_scale: f32,
    least_power: f32,
    // Spray: see Spray in lidar_spray.rs.
    puff_count: u32,
    reserved0: u32,
    reserved1: u32,
    puffs: array<Puff, 8>,
}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
// Four vectors each: see Node in bvh.rs.
@group(0) @binding(1) var<storage, read> nodes: array<vec4f>;
// Three vectors each: see Triangle in triangle.rs.
@group(0) @binding(2) var<storage, read> triangles: array<vec4f>;
@group(0) @binding(3) var<storage, read> walls: array<vec4f>;
@group(0) @binding(4) var<storage, read> top_nodes: array<vec4f>;
@group(0) @binding(5) var<storage, read> instances: array<Instance>;
@group(0) @binding(6) var<storage, read> cameras: array<Camera>;
@group(0) @binding(7) var<storage, read> lidars: array<Lidar>;
@group(0) @binding(8) var<storage, read> circles: array<vec2f>;
@group(0) @binding(9) var<storage, read_write> tags: array<u32>;
@group(0) @binding(10) var<storage, read> views_before: array<ViewBefore>;
// Normals at the corners of the triangles after those of the town: see CornerNormals in smooth.rs.
@group(0) @binding(16) var<storage, read> corner_normals: array<vec4u>;
@group(0) @binding(19) var<storage, read> rainfalls: array<Rainfall>;

// Number of the workgroup, counted through all rows of the dispatch.
fn group_number(group: vec3u) -> u32 {
    return group.y * frame.groups.w + group.x;
}
