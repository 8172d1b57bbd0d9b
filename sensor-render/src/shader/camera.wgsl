// Cameras: one thread per pixel, all cameras in one dispatch. Twin of cpu/camera.rs.

const DEPTH_FAR_M = 1000.0;
const SKY = 11u;

// Which cameras a pipeline renders: those with a lens, or pinholes.
override HAS_LENS: bool = false;
// Those with effects, whose radiance goes to a film and whose rays may have origins of their own, or the others.
override HAS_EFFECTS: bool = false;

// Whether drops or spray are before any camera.
override HAS_RAIN: bool = false;
// Those that measure normals or optical flow, or the others.
override HAS_SURFACES: bool = false;

// Root of the top level that rays of such cameras are traced in.
var<private> top_root: u32;

// Returns the last camera whose first group is at most `group`.
fn camera_of(group: u32) -> u32 {
    var low = 0u;
    var high = frame.roots.z - 1u;
    // Where all cameras have one size, the share of the groups is that of the cameras: no search of loads that wait
    // for each other.
    let guess = min(group * frame.roots.z / frame.groups.x, high);
    if (cameras[guess].first_group <= group && (guess == high || group < cameras[guess + 1u].first_group)) {
        return guess;
    }
    while (low < high) {
        let middle = (low + high + 1u) / 2u;
        if (cameras[middle].first_group <= group) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    return low;
}

// Returns the pixel of a thread; it may lie outside of the image. A workgroup has 8 x 8 pixels, in a strip of at
// most four pixels along the lower edge 16 x 4, and in one along the right edge 4 x 16, so that few threads are idle.
// Twin of `group_count` in batch.rs.
fn pixel_of(index: u32, group: u32, thread: u32) -> vec2u {
    let size = vec2u(cameras[index].width, cameras[index].height);
    let tiles = (size + 3u) / 8u;
    let below = select(0u, (size.x + 15u) / 16u, tiles.y * 8u < size.y);
    var tile = group - cameras[index].first_group;
    if (tile < tiles.x * tiles.y) {
        return vec2u(tile % tiles.x, tile / tiles.x) * 8u + vec2u(thread % 8u, thread / 8u);
    }
    tile -= tiles.x * tiles.y;
    if (tile < below) {
        return vec2u(tile * 16u + thread % 16u, tiles.y * 8u + thread / 16u);
    }
    let at = vec2u(tiles.x * 8u + thread % 4u, (tile - below) * 16u + thread / 4u);
    return vec2u(at.x, select(size.y, at.y, at.y < tiles.y * 8u));
}

@compute @workgroup_size(64)
fn trace_cameras(@builtin(workgroup_id) group_at: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let group = group_number(group_at);
    if (group >= frame.groups.x) {
        return;
    }
    let index = camera_of(group);
    let width = cameras[index].width;
    let at = pixel_of(index, group, thread.x);
    if (at.x >= width || at.y >= cameras[index].height) {
        return;
    }
    let pixel = at.y * width + at.x;
    let from_center = vec2f(at) - cameras[index].center;
    let samples = cameras[index].samples;
    let has_color = cameras[index].color != NONE;
    let is_smooth = has_color && samples > 1u;
    if (is_smooth != SMOOTH || (cameras[index].lens != 0u) != HAS_LENS
        || (cameras[index].development != NONE) != HAS_EFFECTS
        || (cameras[index].normal != NONE || cameras[index].flow != NONE) != HAS_SURFACES) {
        return;
    }
    // A colour image of several rays per pixel has none through the centre; the other outputs have.
    let has_others = HAS_SURFACES || cameras[index].depth != NONE || cameras[index].tag != NONE
        || cameras[index].instance != NONE;
    var film = vec3f(0.0);
    // Rays of a pixel that hit the same triangle share its shading, among four in a row.
    var seen: array<vec2u, 4>;
    var shared_: array<Radiance, 4>;
    for (var step = select(0u, 1u, SMOOTH && !has_others); step < select(1u, samples + 1u, SMOOTH); step++) {
        let is_center = step == 0u;
        let number = select(cameras[index].first_sample + step - 1u, 0u, is_center);
        let sample = frame.samples[number];
        let place = from_center + sample.xy;
        let own = (step + 3u) % 4u;
        var direction = cameras[index].forward.xyz + cameras[index].right.xyz * place.x
            + cameras[index].down.xyz * place.y;
        if (HAS_LENS) {
            let through = lens_direction(index, place);
            direction = through.xyz;
            if (through.w == 0.0) {
                if (is_center) {
                    write_black(index, pixel);
                    if (HAS_SURFACES) {
                        write_surface(index, pixel, vec3f(0.0), vec2f(0.0));
                    }
                }
                // No ray has this name.
                seen[own] = vec2u(NONE, 0u);
                continue;
            }
        }
        var ray = Ray(cameras[index].origin.xyz, direction);
        if (HAS_EFFECTS) {
            top_root = frame.roots.y;
            if (!is_center && developments[cameras[index].development].has_roots != 0u) {
                top_root = developments[cameras[index].development].roots[step - 1u];
            }
            ray = bent_ray(index, ray, f32(at.y) + sample.y, select(step, 0u, is_center), sample.zw);
        }
        let hit = closest(ray, FAR_AWAY, false);
        if (is_center) {
            write_others(index, pixel, hit);
            if (HAS_SURFACES) {
                write_surface(index, pixel, sensor_normal(index, ray, hit), flow_of(index, ray, hit));
            }
            if (SMOOTH || !has_color) {
                continue;
            }
        }
        let name = vec2u(hit.triangle, hit.instance);
        var radiance: Radiance;
        var is_fresh = true;
        // Rays of other times have other numbers of instances.
        let is_alone = HAS_EFFECTS && developments[cameras[index].development].has_roots != 0u;
        for (var other = 0u; other < select(own, 0u, is_center); other++) {
            if (is_fresh && all(seen[other] == name) && !is_alone) {
                radiance = shared_[other];
                is_fresh = false;
            }
        }
        if (is_fresh) {
            radiance = radiance_of(ray, hit, cameras[index].origin.w);
        }
        seen[own] = name;
        shared_[own] = radiance;
        var color = with_shadows(radiance, ray, hit, sample, frame.sky_directions[number].xyz);
        if (HAS_RAIN && cameras[index].rainfall != NONE) {
            color = in_rain(index, color, ray, hit.t);
        }
        if (HAS_EFFECTS) {
            film += color;
        } else {
            film += tone_map(color);
        }
    }
    film *= 1.0 / f32(select(1u, samples, SMOOTH));
    if (HAS_EFFECTS && has_color) {
        films[cameras[index].film + pixel] = vec4f(film, 0.0);
    } else if (has_color) {
        put(cameras[index].payload, cameras[index].color + pixel, encode(film));
    }
}

// Ray with the pose of its row and its time, from a point on the disc of the lens. Ray number 0 is that
// through the centre of the pixel. Twin of `bend` in camera.rs.
fn bent_ray(index: u32, ray: Ray, row: f32, number: u32, on_lens: vec2f) -> Ray {
    let how = cameras[index].development;
    let right = cameras[index].right.xyz;
    let down = cameras[index].down.xyz;
    var bent = ray;
    let origin = developments[how].to_before[0];
    let forward = developments[how].to_before[1];
    if (developments[how].has_shutter != 0u) {
        var share = origin.w + row * forward.w;
        if (number > 0u) {
            share += developments[how].blur[number - 1u];
        }
        let ahead = dot(ray.direction, cameras[index].forward.xyz);
        let across = dot(ray.direction, right) / dot(right, right);
        let below = dot(ray.direction, down) / dot(down, down);
        bent.origin += origin.xyz * share;
        bent.direction += (forward.xyz * ahead + developments[how].to_before[2].xyz * across
            + developments[how].to_before[3].xyz * below) * share;
    }
    if (number == 0u) {
        return bent;
    }
    let lens = developments[how].thin_lens[0];
    let offset = lens.xyz * on_lens.x + developments[how].thin_lens[1].xyz * on_lens.y;
    bent.origin += offset;
    bent.direction -= offset * lens.w;
    return bent;
}

// Writes every output but the colour of a pixel that the lens does not show.
fn write_black(index: u32, pixel: u32) {
    write_pixel(index, pixel, DEPTH_FAR_M, 0u, 0u);
}

// Writes every output of a pixel but the colour.
fn write_others(index: u32, pixel: u32, hit: Hit) {
    var depth = DEPTH_FAR_M;
    var tag = SKY;
    var id = 0u;
    if (hit.triangle != NONE) {
        depth = min(hit.t, DEPTH_FAR_M);
        tag = tag_of(hit);
        id = id_of(hit);
    }
    write_pixel(index, pixel, depth, tag, id);
}

fn write_pixel(index: u32, pixel: u32, depth: f32, tag: u32, id: u32) {
    if (cameras[index].depth != NONE) {
        put(cameras[index].payload, cameras[index].depth + pixel, bitcast<u32>(depth));
    }
    if (cameras[index].tag != NONE) {
        tags[cameras[index].first_tag + pixel] = tag;
    }
    if (cameras[index].instance != NONE) {
        put(cameras[index].payload, cameras[index].instance + pixel, id);
    }
}

// Returns the last camera whose first packing group is at most `group`.
fn packed_camera_of(group: u32) -> u32 {
    var low = 0u;
    var high = frame.roots.z - 1u;
    while (low < high) {
        let middle = (low + high + 1u) / 2u;
        if (cameras[middle].first_packing_group <= group) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    return low;
}

// Packs four tags per word; fills each plane with zeros up to a multiple of 64 bytes.
@compute @workgroup_size(64)
fn pack_tags(@builtin(workgroup_id) group_at: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let group = group_number(group_at);
    let index = packed_camera_of(group);
    choose_output(cameras[index].payload);
    workgroupBarrier();
    if (group >= frame.groups.z) {
        return;
    }
    let word = (group - cameras[index].first_packing_group) * 64u + thread.x;
    let pixels = cameras[index].width * cameras[index].height;
    if (word >= (pixels + 63u) / 64u * 16u) {
        return;
    }
    var packed = 0u;
    for (var byte = 0u; byte < 4u; byte++) {
        let pixel = word * 4u + byte;
        if (pixel < pixels) {
            packed |= tags[cameras[index].first_tag + pixel] << (8u * byte);
        }
    }
    put_chosen(cameras[index].tag + word, packed);
}
