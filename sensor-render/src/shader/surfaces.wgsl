// Normals and optical flow of surfaces at the centres of pixels. Twin of cpu/geometry.rs.

// Minimum depth at which a point is projected. Metres.
const NEAR_M = 1e-3;

fn write_surface(index: u32, pixel: u32, normal: vec3f, flow: vec2f) {
    let normals = cameras[index].normal;
    if (normals != NONE) {
        for (var axis = 0u; axis < 3u; axis++) {
            put(0u, normals + pixel * 3u + axis, bitcast<u32>(normal[axis]));
        }
    }
    let flows = cameras[index].flow;
    if (flows != NONE) {
        put(0u, flows + pixel * 2u, bitcast<u32>(flow.x));
        put(0u, flows + pixel * 2u + 1u, bitcast<u32>(flow.y));
    }
}

// Normal in sensor space, facing the camera; 0 for the sky.
fn sensor_normal(index: u32, ray: Ray, hit: Hit) -> vec3f {
    if (hit.triangle == NONE) {
        return vec3f(0.0);
    }
    let normal = normal_of(hit, ray.direction);
    let pixel = cameras[index].pixel;
    let left = -dot(normal, cameras[index].right.xyz) / pixel.x;
    let up = -dot(normal, cameras[index].down.xyz) / pixel.y;
    return vec3f(dot(normal, cameras[index].forward.xyz), left, up);
}

// Motion in the image since the previous frame. Pixels.
fn flow_of(index: u32, ray: Ray, hit: Hit) -> vec2f {
    let view = cameras[index].view_before;
    var has_moved = views_before[view].origin.w != 0.0;
    let is_hit = hit.triangle != NONE;
    var point = cameras[index].origin.xyz + ray.direction * hit.t;
    if (is_hit && hit.instance != NONE && frame.town.y != 0u) {
        let of_motion = frame.town.y + hit.instance;
        if (instances[of_motion].id != 0u) {
            let rows = instances[of_motion].actor_from_world;
            let now = vec4f(point, 1.0);
            point = vec3f(dot(rows[0], now), dot(rows[1], now), dot(rows[2], now));
            has_moved = true;
        }
    }
    if (!has_moved) {
        return vec2f(0.0);
    }
    // The sky is at infinity: only its direction changes.
    let to = select(ray.direction, point - views_before[view].origin.xyz, is_hit);
    let forward = cameras[index].forward.xyz;
    let now = projected(index, forward, cameras[index].right.xyz, cameras[index].down.xyz, ray.direction, 0.0);
    let before = projected(index, views_before[view].forward.xyz, views_before[view].right.xyz,
        views_before[view].down.xyz, to, NEAR_M);
    return select(vec2f(0.0), now.xy - before.xy, now.z * before.z > 0.0);
}

// Column and row in pixels from the principal point of a vector from the camera; z: whether the camera shows
// it.
fn projected(index: u32, forward: vec3f, right: vec3f, down: vec3f, to: vec3f, near: f32) -> vec3f {
    let depth = dot(to, forward);
    let plane = vec2f(dot(to, right), dot(to, down));
    if (HAS_LENS) {
        return lens_pixel(index, vec3f(plane * cameras[index].focal, depth), near);
    }
    let pixel = cameras[index].pixel;
    return vec3f(plane / (pixel * pixel * depth), select(0.0, 1.0, depth >= near));
}

// Column and row in pixels from the principal point of a point in optical space; z: whether the lens shows it.
fn lens_pixel(index: u32, optical: vec3f, near: f32) -> vec3f {
    let focal = cameras[index].focal;
    let most = cameras[index].radius_max;
    if (cameras[index].lens != FISHEYE) {
        let p = optical.xy / optical.z;
        let is_shown = optical.z > 0.0 && optical.z >= near && dot(p, p) <= most * most;
        return vec3f(distort(index, p).at * focal, select(0.0, 1.0, is_shown));
    }
    let from_axis = length(optical.xy);
    let distance = length(optical);
    // One step of Newton's method: devices round the function itself too coarsely.
    var angle = atan2(from_axis, optical.z);
    let half = half_sine_cosine(angle);
    let sine = 2.0 * half.x * half.y;
    let cosine = 1.0 - 2.0 * half.x * half.x;
    angle -= (sine * optical.z - cosine * from_axis) / max(distance, 1e-12);
    let k = cameras[index].coefficients;
    let square = angle * angle;
    let radius = angle * (1.0 + square * (k.x + square * (k.y + square * (k.z + square * k.w))));
    let is_shown = angle <= most && distance >= near;
    let scale = select(0.0, radius / from_axis, from_axis > 0.0);
    return vec3f(optical.xy * scale * focal, select(0.0, 1.0, is_shown));
}
