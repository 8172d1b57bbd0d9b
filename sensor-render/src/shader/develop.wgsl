// Develops the films of cameras with effects. Twin of cpu/develop.rs; film.rs says what each number is.

// See film.rs and tone_curve.rs.
const COARSER = 4u;
const OUTER_RADIUS = 5.0;
const OUTER_SHARE = 0.4;
const BINS = 96u;
const BINS_PER_STOP = 4.0;
const BIN_FIRST = -16.0;
const METER_LOW = 0.1;
const METER_HIGH = 0.9;
const PARTS = 256.0;
const CURVE = 577u;
const CURVE_STEP_BITS = 18u;
const CURVE_FIRST_BITS = 0x39800000u;

// Threads of a workgroup that exposes a film.
const EXPOSERS = 256u;

struct Development {
    exposure: f32,
    exposure_min: f32,
    exposure_max: f32,
    key: f32,
    center: vec2f,
    pixel: vec2f,
    vignette: f32,
    chromatic_aberration: f32,
    bloom: f32,
    bloom_radius: f32,
    shot: f32,
    read: f32,
    seed: u32,
    side: u32,
    grid: vec2u,
    coarse: vec2u,
    balance: array<vec4f, 3>,
    curve: array<f32, CURVE>,
    muted: f32,
    reserved: array<f32, 2>,
    to_before: array<vec4f, 4>,
    blur: array<f32, 16>,
    thin_lens: array<vec4f, 2>,
    has_shutter: u32,
    has_roots: u32,
    reserved2: vec2u,
    roots: array<u32, 16>,
}

// Films: the pixels of each, then the exposure, the cells of both levels, and room to blur them.
@group(0) @binding(17) var<storage, read_write> films: array<vec4f>;
// Of each camera; those of cameras without effects are not read.
@group(0) @binding(18) var<storage, read> developments: array<Development>;

// Offset of the exposure in `films`; cells follow.
fn behind_pixels(index: u32) -> u32 {
    return cameras[index].film + cameras[index].width * cameras[index].height;
}

// One thread per cell: the mean of its pixels.
@compute @workgroup_size(64)
fn gather_films(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let index = group.y;
    let number = group.x * 64u + thread.x;
    if (cameras[index].film == NONE) {
        return;
    }
    let grid = developments[cameras[index].development].grid;
    if (number >= grid.x * grid.y) {
        return;
    }
    let side = developments[cameras[index].development].side;
    let size = vec2u(cameras[index].width, cameras[index].height);
    let low = vec2u(number % grid.x, number / grid.x) * side;
    let high = min(low + side, size);
    var sum = vec3f(0.0);
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            sum += films[cameras[index].film + y * size.x + x].xyz;
        }
    }
    let count = (high.x - low.x) * (high.y - low.y);
    films[behind_pixels(index) + 1u + number] = vec4f(sum / f32(count), 0.0);
}

var<workgroup> bins: array<atomic<u32>, BINS>;

// One workgroup per film: reads the meter and blurs the cells.
@compute @workgroup_size(EXPOSERS)
fn expose_films(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let index = group.y;
    if (cameras[index].film == NONE) {
        return;
    }
    let how = cameras[index].development;
    let header = behind_pixels(index);
    let grid = developments[how].grid;
    let coarse = developments[how].coarse;
    let fine_cells = header + 1u;
    let coarse_cells = fine_cells + grid.x * grid.y;
    let room = coarse_cells + coarse.x * coarse.y;

    for (var number = thread.x; number < grid.x * grid.y; number += EXPOSERS) {
        meter(films[fine_cells + number].xyz);
    }
    if (developments[how].bloom > 0.0) {
        for (var number = thread.x; number < coarse.x * coarse.y; number += EXPOSERS) {
            let low = vec2u(number % coarse.x, number / coarse.x) * COARSER;
            let high = min(low + COARSER, grid);
            var sum = vec3f(0.0);
            for (var y = low.y; y < high.y; y++) {
                for (var x = low.x; x < high.x; x++) {
                    sum += films[fine_cells + y * grid.x + x].xyz;
                }
            }
            let count = (high.x - low.x) * (high.y - low.y);
            films[coarse_cells + number] = vec4f(sum / f32(count), 0.0);
        }
    }
    workgroupBarrier();
    storageBarrier();
    if (thread.x == 0u) {
        var exposure = developments[how].exposure;
        if (exposure <= 0.0) {
            exposure = clamp(
                developments[how].key / metered(), developments[how].exposure_min,
                developments[how].exposure_max);
        }
        films[header] = vec4f(exposure);
    }
    if (developments[how].bloom <= 0.0) {
        return;
    }
    let inner = developments[how].bloom_radius;
    let outer = inner * (OUTER_RADIUS / f32(COARSER));
    blur(thread.x, fine_cells, room, grid, vec2i(1, 0), inner);
    blur(thread.x, coarse_cells, room + grid.x * grid.y, coarse, vec2i(1, 0), outer);
    workgroupBarrier();
    storageBarrier();
    blur(thread.x, room, fine_cells, grid, vec2i(0, 1), inner);
    blur(thread.x, room + grid.x * grid.y, coarse_cells, coarse, vec2i(0, 1), outer);
}

// Counts a cell, divided between two bins.
fn meter(cell: vec3f) {
    let luminance = dot(cell, vec3f(0.2126, 0.7152, 0.0722));
    if (luminance > 0.0) {
        let place = clamp((log2(luminance) - BIN_FIRST) * BINS_PER_STOP, 0.0, f32(BINS) - 1.001);
        let bin = u32(place);
        let upper = u32((place - f32(bin)) * PARTS);
        atomicAdd(&bins[bin], u32(PARTS) - upper);
        atomicAdd(&bins[bin + 1u], upper);
    }
}

// Mean of the meter, without the darkest and the brightest cells.
fn metered() -> f32 {
    var total = 0u;
    for (var bin = 0u; bin < BINS; bin++) {
        total += atomicLoad(&bins[bin]);
    }
    let low = f32(total) * METER_LOW;
    let high = f32(total) * METER_HIGH;
    var passed = 0.0;
    var sum = 0.0;
    var weight = 0.0;
    for (var bin = 0u; bin < BINS; bin++) {
        let next = passed + f32(atomicLoad(&bins[bin]));
        let counted = max(min(next, high) - max(passed, low), 0.0);
        sum += counted * (BIN_FIRST + f32(bin) * (1.0 / BINS_PER_STOP));
        weight += counted;
        passed = next;
    }
    return exp2(select(BIN_FIRST, sum / weight, weight > 0.0));
}

// Blurs a grid in one direction by the threads of a workgroup.
fn blur(thread: u32, cells: u32, target_: u32, grid: vec2u, along: vec2i, deviation: f32) {
    let reach = i32(ceil(3.0 * deviation));
    let edge = vec2i(grid) - 1;
    for (var number = thread; number < grid.x * grid.y; number += EXPOSERS) {
        let at = vec2i(vec2u(number % grid.x, number / grid.x));
        var sum = vec3f(0.0);
        var whole = 0.0;
        for (var away = -reach; away <= reach; away++) {
            let from_here = f32(away);
            let weight = exp(-0.5 * from_here * from_here / (deviation * deviation));
            let place = vec2u(clamp(at + along * away, vec2i(0), edge));
            sum += films[cells + place.y * grid.x + place.x].xyz * weight;
            whole += weight;
        }
        films[target_ + number] = vec4f(sum / whole, 0.0);
    }
}

// Radiance at a place in elements of a grid from the centre of the first one.
fn between(first: u32, size: vec2u, place: vec2f) -> vec3f {
    let at = clamp(place, vec2f(0.0), vec2f(size - 1u));
    let low = vec2u(at);
    let high = min(low + 1u, size - 1u);
    let part = at - vec2f(low);
    let above =
        mix(films[first + low.y * size.x + low.x].xyz, films[first + low.y * size.x + high.x].xyz, part.x);
    let below = mix(
        films[first + high.y * size.x + low.x].xyz, films[first + high.y * size.x + high.x].xyz, part.x);
    return mix(above, below, part.y);
}

// One thread per pixel, in the layout of `trace_cameras`.
@compute @workgroup_size(64)
fn develop_films(@builtin(workgroup_id) group_at: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let group = group_number(group_at);
    let index = camera_of(group);
    choose_output(cameras[index].payload);
    workgroupBarrier();
    if (group >= frame.groups.x) {
        return;
    }
    let film = cameras[index].film;
    let size = vec2u(cameras[index].width, cameras[index].height);
    let at = pixel_of(index, group, thread.x);
    if (film == NONE || at.x >= size.x || at.y >= size.y) {
        return;
    }
    let how = cameras[index].development;
    let header = behind_pixels(index);
    let center = developments[how].center;
    let from_center = vec2f(at) - center;
    var light = films[film + at.y * size.x + at.x].xyz;
    if (developments[how].chromatic_aberration != 0.0) {
        let scale = 1.0 + developments[how].chromatic_aberration;
        light.x = between(film, size, center + from_center * (1.0 / scale)).x;
        light.z = between(film, size, center + from_center * scale).z;
    }
    if (developments[how].bloom > 0.0) {
        let grid = developments[how].grid;
        let place = (vec2f(at) + 0.5) / f32(developments[how].side);
        let inner = between(header + 1u, grid, place - 0.5);
        let outer = between(
            header + 1u + grid.x * grid.y, developments[how].coarse, place / f32(COARSER) - 0.5);
        light = mix(light, mix(inner, outer, OUTER_SHARE), developments[how].bloom);
    }
    let tangent = from_center * developments[how].pixel;
    let stretch = 1.0 + tangent.x * tangent.x + tangent.y * tangent.y;
    let natural = 1.0 / (stretch * stretch);
    var exposed = light * (films[header].x * (1.0 + (natural - 1.0) * developments[how].vignette));
    if (developments[how].shot > 0.0) {
        let seed = developments[how].seed;
        let random =
            vec3f(pixel_noise(at, seed, 0u), pixel_noise(at, seed, 1u), pixel_noise(at, seed, 2u));
        exposed += sqrt(exposed * developments[how].shot + developments[how].read) * random;
    }
    let values = vec3f(
        tone_of(how, dot(developments[how].balance[0].xyz, exposed)),
        tone_of(how, dot(developments[how].balance[1].xyz, exposed)),
        tone_of(how, dot(developments[how].balance[2].xyz, exposed)));
    let bytes = vec3u(mute(values, developments[how].muted) + 0.5);
    let color = bytes.x | bytes.y << 8u | bytes.z << 16u | 0xff000000u;
    put_chosen(cameras[index].color + at.y * size.x + at.x, color);
}

// Random number with mean 0 and variance 1.
fn pixel_noise(at: vec2u, seed: u32, channel: u32) -> f32 {
    let first = hash_of(at.x, at.y, seed + 2u * channel * 0x68bc21ebu);
    let second = hash_of(at.x, at.y, seed + (2u * channel + 1u) * 0x68bc21ebu);
    let sum = (first & 0xffffu) + (first >> 16u) + (second & 0xffffu) + (second >> 16u);
    return (f32(sum) - 2.0 * 65535.0) * (1.7320508 / 65536.0);
}

// Value of a pixel by the tone curve, from 0 to 255.
fn tone_of(how: u32, light: f32) -> f32 {
    let last = CURVE_FIRST_BITS + ((CURVE - 1u) << CURVE_STEP_BITS) - 1u;
    let bits =
        min(bitcast<u32>(max(light, bitcast<f32>(CURVE_FIRST_BITS))), last) - CURVE_FIRST_BITS;
    let entry = bits >> CURVE_STEP_BITS;
    let part = f32(bits & ((1u << CURVE_STEP_BITS) - 1u)) / f32(1u << CURVE_STEP_BITS);
    return mix(developments[how].curve[entry], developments[how].curve[entry + 1u], part);
}
