// Draws debug shapes into the colours of cameras. Twin of overlay_raster.rs. Runs only if there are
// shapes.

const ROWS_PER_DOT = 240u;
const BLACK = 0xff000000u;
const ADVANCE = 6;
const GLYPH_SIZE = vec2i(5, 7);

// Largest minimum radius in pixels; then 96 glyphs of two words, nodes, capsules, texts, and the places of
// the texts in each image: see `GpuResources::upload_overlay`.
@group(0) @binding(13) var<storage, read> overlay: array<vec4u>;
const FIRST_GLYPH = 1u;
const FIRST_OVERLAY_NODE = 49u;

struct Fragment {
    t: f32,
    color: u32,
}

fn nearer(fragment: Fragment, t: f32, color: u32) -> Fragment {
    if (t < fragment.t || (t == fragment.t && color < fragment.color)) {
        return Fragment(t, color);
    }
    return fragment;
}

fn meet_capsule(index: u32, ray: Ray, pixel: f32, fragment: Fragment) -> Fragment {
    let place = frame.overlay.y + index * 3u;
    let first = bitcast<vec4f>(overlay[place]);
    let second = bitcast<vec4f>(overlay[place + 1u]);
    let along = second.xyz - first.xyz;
    let from_begin = ray.origin - first.xyz;
    let a = dot(ray.direction, ray.direction);
    let b = dot(ray.direction, along);
    let c = dot(along, along);
    let d = dot(ray.direction, from_begin);
    let e = dot(along, from_begin);
    let apart = a * c - b * b;
    var share = 0.0;
    if (apart > 1e-6 * a * c) {
        share = clamp((a * e - b * d) / apart, 0.0, 1.0);
    }
    let t = (b * share - d) / a;
    let gap = from_begin + ray.direction * t - along * share;
    let reach = max(first.w, second.w * pixel * t);
    let room = reach * reach - dot(gap, gap);
    if (t > T_MIN && room >= 0.0) {
        return nearer(fragment, max(t - sqrt(room / a), T_MIN), overlay[place + 2u].x);
    }
    return fragment;
}

// Returns whether the ray enters a box after widening it by the largest minimum radius of its
// capsules.
fn enter_widened(low: vec3f, high: vec3f, ray: Ray, inverse: vec3f, pixel: f32) -> bool {
    let half = length(high - low) * 0.5;
    let far = length((low + high) * 0.5 - ray.origin) + half;
    let more = bitcast<f32>(overlay[0].x) * pixel * far;
    let range = enter(low - more, high + more, -ray.origin * inverse, inverse, FAR_AWAY);
    return range.x <= range.y;
}

fn meet_capsules(ray: Ray, pixel: f32) -> Fragment {
    var fragment = Fragment(FAR_AWAY, NONE);
    let inverse = inverse_of(ray.direction);
    var height = 0u;
    var link = frame.overlay.x;
    loop {
        if ((link & LEAF) != 0u) {
            let first = link & 0x3ffffffu;
            let end = first + ((link >> 26u) & 31u);
            for (var index = first; index < end; index++) {
                fragment = meet_capsule(index, ray, pixel, fragment);
            }
        } else {
            let place = FIRST_OVERLAY_NODE + link * 4u;
            let a = overlay[place];
            let b = overlay[place + 1u];
            let c = bitcast<vec3f>(overlay[place + 2u].xyz);
            let d = bitcast<vec3f>(overlay[place + 3u].xyz);
            if (enter_widened(bitcast<vec3f>(a.xyz), bitcast<vec3f>(b.xyz), ray, inverse, pixel)) {
                stack[height] = a.w;
                height++;
            }
            if (enter_widened(c, d, ray, inverse, pixel)) {
                stack[height] = b.w;
                height++;
            }
        }
        if (height == 0u) {
            return fragment;
        }
        height--;
        link = stack[height];
    }
    return fragment;
}

fn is_dot(place: u32, column: i32, row: i32) -> bool {
    if (column < 0 || row < 0 || row >= GLYPH_SIZE.y) {
        return false;
    }
    let letter = u32(column / ADVANCE);
    let within = column % ADVANCE;
    if (letter >= overlay[place + 1u].x || within >= GLYPH_SIZE.x) {
        return false;
    }
    let word = overlay[place + 2u + letter / 16u][(letter / 4u) % 4u];
    let glyph = (word >> (8u * (letter % 4u))) & 255u;
    let words = overlay[FIRST_GLYPH + glyph / 2u];
    let bit = u32(row * GLYPH_SIZE.x + within);
    if (bit < 32u) {
        return ((words[(glyph % 2u) * 2u] >> bit) & 1u) != 0u;
    }
    return ((words[(glyph % 2u) * 2u + 1u] >> (bit - 32u)) & 1u) != 0u;
}

fn meet_text(text: u32, camera: u32, x: u32, y: u32, fragment: Fragment) -> Fragment {
    let place = frame.overlay.z + text * 10u;
    let count = overlay[place + 1u].x;
    let in_image =
        bitcast<vec3f>(overlay[frame.overlay.z + (10u + camera) * frame.overlay.w + text].xyz);
    let depth = in_image.z;
    if (depth < 0.0 || count == 0u) {
        return fragment;
    }
    let side = f32(max(cameras[camera].height / ROWS_PER_DOT, 1u));
    let middle = in_image.xy;
    let half = vec2f(f32(count * u32(ADVANCE) - 1u), f32(GLYPH_SIZE.y)) * side * 0.5;
    let at = vec2i(floor((vec2f(f32(x), f32(y)) - (middle - half)) / side));
    if (is_dot(place, at.x, at.y)) {
        return nearer(fragment, depth, overlay[place].w);
    }
    if (overlay[place + 1u].y != 0u && is_dot(place, at.x - 1, at.y - 1)) {
        return nearer(fragment, depth, BLACK);
    }
    return fragment;
}

// One thread per pixel, in the layout of `trace_cameras`; dispatched after it.
@compute @workgroup_size(64)
fn draw_overlay(@builtin(workgroup_id) group_at: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let group = group_number(group_at);
    if (group >= frame.groups.x) {
        return;
    }
    let index = camera_of(group);
    let width = cameras[index].width;
    let at = pixel_of(index, group, thread.x);
    if (at.x >= width || at.y >= cameras[index].height || cameras[index].color == NONE) {
        return;
    }
    let from_center = vec2f(at) - cameras[index].center;
    var direction = cameras[index].forward.xyz + cameras[index].right.xyz * from_center.x
        + cameras[index].down.xyz * from_center.y;
    if (cameras[index].lens != 0u) {
        let through = lens_direction(index, from_center);
        if (through.w == 0.0) {
            return;
        }
        direction = through.xyz;
    }
    let ray = Ray(cameras[index].origin.xyz, direction);
    var fragment = meet_capsules(ray, cameras[index].origin.w);
    for (var text = 0u; text < frame.overlay.w; text++) {
        fragment = meet_text(text, index, at.x, at.y, fragment);
    }
    // Nearer surfaces hide the shape.
    if (fragment.t < FAR_AWAY && closest(ray, fragment.t, true).triangle == NONE) {
        put(cameras[index].payload, cameras[index].color + at.y * width + at.x, fragment.color);
    }
}
