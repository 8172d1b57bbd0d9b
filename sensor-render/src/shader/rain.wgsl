// Falling drops and spray in front of a surface. Twin of rain.rs.

const DROPS_PER_CELL = 2u;
// See rain.rs.
const LAYERS_M = vec4f(0.8, 1.5, 2.9, 5.5);
const DIAMETERS_M = vec2f(0.001, 0.0035);
const FLATNESS = 0.8;

// Radiance along a ray of a camera with what drops and spray before `t` add and hide.
fn in_rain(camera: u32, radiance: vec3f, ray: Ray, distance: f32) -> vec3f {
    let index = cameras[camera].rainfall;
    var color = radiance;
    let t = min(distance, 1e4);
    for (var number = 0u; number < rainfalls[index].puff_count; number++) {
        let depth = optical_depth(rainfalls[index].puffs[number], ray, t);
        let growth = 1.0 + depth * (1.0 + depth * (0.5 + 0.2 * depth));
        let mist = ambient(0.4) + frame.sun_color.xyz * 0.06;
        color = mix(color, mist, 1.0 - 1.0 / growth);
    }
    if (rainfalls[index].chances.w > 0.0) {
        color = mix(color, ambient(0.5), streaks(camera, ray.direction, t));
    }
    return color;
}

// Optical depth of a puff before `t`.
fn optical_depth(puff: Puff, ray: Ray, t: f32) -> f32 {
    let origin = in_half_axes(puff, ray.origin - puff.center);
    let along = in_half_axes(puff, ray.direction);
    let stretch = length(along);
    let near = dot(origin, along) / stretch;
    let apart = max(dot(origin, origin) - near * near, 0.0) + 1.0;
    let sum = spray_primitive(near + t * stretch, apart) - spray_primitive(near, apart);
    return sum * puff.density_per_m * length(ray.direction) / (stretch * apart * apart * apart);
}

fn spray_primitive(x: f32, apart: f32) -> f32 {
    let u = x / sqrt(apart + x * x);
    let square = u * u;
    return u * (1.0 + square * (square * 0.2 - 2.0 / 3.0));
}

// Vector along the axes of a puff, in their units.
fn in_half_axes(puff: Puff, v: vec3f) -> vec3f {
    return vec3f(
        (v.x * puff.along.x + v.y * puff.along.y) * puff.per_length,
        (v.y * puff.along.x - v.x * puff.along.y) * puff.per_width,
        v.z * (puff.per_width / FLATNESS));
}

// Opacity of the streaks in front of what lies at `t`.
fn streaks(camera: u32, d: vec3f, t: f32) -> f32 {
    let index = cameras[camera].rainfall;
    let size = abs(d);
    let by_x = size.x >= size.y && size.x >= size.z;
    let by_y = !by_x && size.y >= size.z;
    // The dominant axis last.
    let turned = select(select(d, d.xzy, by_y), d.yzx, by_x);
    let way_of = rainfalls[index].streak;
    let ways = select(select(way_of, way_of.xzy, by_y), way_of.yzx, by_x);
    let axis = turned.z;
    let flip = select(-1.0, 1.0, axis >= 0.0);
    let place = turned.xy * (flip / axis);
    let per_cell = rainfalls[index].per_cell;
    let way = (ways.xy - place * (ways.z * flip)) * per_cell;
    let squared = max(dot(way, way), 1e-6);
    let long = sqrt(squared);
    let reach = min(abs(way), vec2f(1.0));
    let reached = t * abs(axis);
    var opacity = 0.0;
    var layers = LAYERS_M;
    for (var layer = 0u; layer < 4u; layer++) {
        let distance = layers[layer];
        let chance = rainfalls[index].chances[layer];
        let at = place * (distance * per_cell);
        let cell = floor(at);
        let inside = at - cell;
        let left = cell_of(cell.x);
        let low = cell_of(cell.y);
        let side = cameras[camera].origin.w * distance;
        if (distance >= reached) {
            continue;
        }
        for (var drop = 0u; drop < DROPS_PER_CELL; drop++) {
            let seed = rainfalls[index].drops_seed ^ ((layer * DROPS_PER_CELL + drop) * 0x9e3779b9u);
            let where_ = hash_of(left, low, seed);
            let other = hash_of(low, left, seed ^ 0x5bd1e995u);
            if (f32(other >> 16u) * (1.0 / 65536.0) >= chance) {
                continue;
            }
            let from_low = vec2f(f32(where_ & 0xffffu), f32(where_ >> 16u)) * (1.0 / 65536.0);
            let big = f32(other & 0xffffu) * (1.0 / 65536.0);
            let to = inside - (reach * 0.5 + (1.0 - reach) * from_low);
            let short = mix(rainfalls[index].shortest, 1.0, big);
            let along = dot(to, way) / (squared * short);
            let off = abs(to.x * way.y - to.y * way.x) / (long * per_cell);
            let diameter = DIAMETERS_M.x + big * big * (DIAMETERS_M.y - DIAMETERS_M.x);
            let covered = max(((diameter + side) * 0.5 - off) / side, 0.0);
            let end = clamp((0.5 - abs(along)) * 3.0, 0.0, 1.0);
            let part = diameter / (long * short / per_cell + diameter);
            opacity += min(covered, min(diameter / side, 1.0)) * end * part;
        }
    }
    return min(opacity, 1.0);
}
