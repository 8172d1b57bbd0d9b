// Shading parameters of a triangle. Twin of surface_material.rs.

// Three vectors per material: see MATERIALS in surface_material.rs.
@group(0) @binding(12) var<uniform> materials: array<vec4f, 120>;

const GLASS = 18u;
const BUILDING = 3u; // Tags.
const VEGETATION = 9u;
const CAR_PAINT = 19u;
const SIGN = 28u;
const LAMP_WHITE = 22u;
const LAMP_RED = 23u;
const LAMP_AMBER = 24u;
const INDICATOR_LEFT = 33u;
const INDICATOR_RIGHT = 34u;
const LAMP_REVERSE = 35u;
const LAMP_FOG = 36u;
const LAMP_INTERIOR = 37u;
const BEACON = 38u;
const LAMP_HIGH = 39u;
const SIGNAL_RED = 25u;
const SIGNAL_YELLOW = 26u;
const SIGNAL_GREEN = 27u;
const BARK = 14u;
const LEAVES = 15u;
const NEEDLES = 16u;

const PAINTS = array<u32, 8>(
    0x2a2a8cu, 0x6e4628u, 0x3c5a2du, 0x28282au, 0x969696u, 0x1e82b4u, 0x50286eu, 0xb4bebeu);

// Bits of `pattern`: see surface_material.rs.
const ROOM = 256u;
const LANE = 512u;

const LANE_M = vec2f(2.2, 5.5);
const KERB_M = 0.19;

// See surface_material.rs.
const PAINT = vec2f(0.01, 0.63);
const BARK_LENGTH = 0.35;
const LENS = 1u;
const LENS_SHARE = 0.012;
const SIGN_SHARE = 0.03;
const BEACON_GAIN = 24.0;
const DUST = vec3f(0.135, 0.122, 0.104);
const DIRT = 0.35;
const DIRT_M = vec2f(0.2, 0.95);

struct SurfaceMaterial {
    albedo: vec3f,
    specular: f32,
    emission: vec3f,
    roughness: f32,
    wrap: f32,
    pattern: u32,
    grain: vec4f,
    wall: vec4f,
    seed: u32,
    // Position along the surface and up the surface, and height above z = 0. Metres.
    along: f32,
    up: f32,
    height: f32,
}

const IS_SIGNAL = 0x80000000u;
const IS_PARKED = 0x40000000u;

fn shows(lights: u32, phase: u32) -> f32 {
    return select(0.0, 1.0, (lights & IS_SIGNAL) != 0u && ((lights >> 16u) & 3u) == phase);
}

fn shines(lights: u32, bits: u32) -> f32 {
    return select(0.0, 1.0, (lights & IS_SIGNAL) == 0u && (lights & bits) != 0u);
}

// Converts from sRGB to linear, with a polynomial approximation of the curve.
fn linear_of(c: vec3f) -> vec3f {
    return c * (c * (c * 0.30530601 + 0.6821711) + 0.012522878);
}

// Radiance of a lamp of an actor. Bits are those of `lamp` in the protocol crate.
fn actor_emission(code: u32, lights: u32, albedo: vec3f) -> vec3f {
    let dark = select(frame.horizon.w, 0.0, (lights & IS_PARKED) != 0u);
    let amber = vec3f(3.6, 0.8, 0.03);
    switch (code) {
        case LAMP_WHITE: {
            let low = shines(lights, 6u);
            let weak = shines(lights, 1u) * 0.4;
            return vec3f(24.0, 22.8, 20.4) * max(max(dark, low), weak);
        }
        case LAMP_HIGH: { return vec3f(33.0, 31.8, 29.4) * shines(lights, 4u); }
        case LAMP_RED: {
            let tail = 0.3 * max(dark, shines(lights, 7u));
            return vec3f(3.2, 0.12, 0.06) * max(shines(lights, 8u), tail);
        }
        case LAMP_REVERSE: { return vec3f(4.5, 4.4, 4.2) * shines(lights, 64u); }
        case LAMP_FOG: {
            let is_rear = albedo.x > albedo.y * 2.0;
            return select(vec3f(5.0, 4.8, 4.0), vec3f(4.8, 0.18, 0.09), is_rear) * shines(lights, 128u);
        }
        case LAMP_INTERIOR: { return vec3f(4.0, 3.7, 3.0) * shines(lights, 256u); }
        case INDICATOR_LEFT: { return amber * shines(lights, 32u); }
        case INDICATOR_RIGHT: { return amber * shines(lights, 16u); }
        case LAMP_AMBER: { return amber * 0.5; }
        case BEACON: {
            return albedo * BEACON_GAIN * shines(lights, select(512u, 1024u, albedo.z > albedo.x));
        }
        case SIGNAL_RED: { return vec3f(4.0, 0.12, 0.06) * shows(lights, 0u); }
        case SIGNAL_YELLOW: { return vec3f(3.6, 0.97, 0.03) * shows(lights, 1u); }
        case SIGNAL_GREEN: { return vec3f(0.1, 3.0, 0.15) * shows(lights, 2u); }
        default: { return vec3f(0.0); }
    }
}

// The first entry holds the number of street lights in x; the others are in ascending order of
// their numbers.
@group(0) @binding(14) var<storage, read> street_lights: array<vec4u>;

// Radiance of a street light.
fn street_light_emission(number: u32) -> vec3f {
    let own = vec3f(27.0, 22.5, 15.0);
    let dark = frame.horizon.w;
    var low = 1u;
    var high = street_lights[0].x + 1u;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (street_lights[middle].x < number) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if (low > street_lights[0].x || street_lights[low].x != number) {
        return own * dark;
    }
    let lamp = street_lights[low];
    var emission = own;
    if (lamp.z != 0u) {
        emission = linear_of(unpack4x8unorm(lamp.z).xyz) * 27.0;
    }
    let on = select(select(dark, 1.0, lamp.y == 1u), 0.0, lamp.y == 0u);
    return emission * (on * bitcast<f32>(lamp.w));
}

// Radiance of a room behind a pane of a building.
fn room_emission(seed: u32, tint: u32) -> vec3f {
    let chance = f32(mixed(seed ^ tint) & 255u) * (1.0 / 255.0);
    let bright = 0.3 + 0.7 * (f32(mixed(seed ^ (tint << 16u)) & 255u) * (1.0 / 255.0));
    let white = f32(mixed(seed ^ (tint << 8u)) & 255u) * (1.0 / 255.0);
    let color = mix(vec3f(0.5, 0.3, 0.12), vec3f(0.4, 0.37, 0.31), white * white);
    return color * (select(0.0, bright, chance > 0.66) * frame.horizon.w);
}

fn surface_material_of(hit: Hit, at: vec3f) -> SurfaceMaterial {
    let row1 = triangles[hit.triangle * 3u + 1u];
    let row2 = triangles[hit.triangle * 3u + 2u];
    let code = min(material_of(hit), 39u);
    let color = materials[code * 3u];
    let parameters = materials[code * 3u + 1u];
    let is_actor = hit.instance != NONE;
    var owner = bitcast<u32>(row1.w);
    if (is_actor) {
        owner = instances[hit.instance].id;
    }
    let seed = mixed(owner);
    let pale = (f32(seed & 255u) * (1.0 / 255.0) - 0.5) * parameters.w;
    let warm = (f32((seed >> 8u) & 255u) * (1.0 / 255.0) - 0.5) * parameters.w;
    let variation = vec3f(1.0 + pale + warm * 0.4, 1.0 + pale, 1.0 + pale - warm * 0.6);
    let foliage = code == LEAVES || code == NEEDLES;
    var albedo = color.xyz * variation;
    if (code == CAR_PAINT) {
        var paints = PAINTS;
        var paint = paints[(seed >> 16u) & 7u];
        if (is_actor) {
            paint = instances[hit.instance].color;
        }
        albedo = linear_of(unpack4x8unorm(paint).xyz) * PAINT.y + PAINT.x;
    }
    let tint = bitcast<u32>(triangles[hit.triangle * 3u].w) >> 16u;
    if (tint != 0u) {
        albedo = linear_of(vec3f(
            f32(tint >> 11u) * (1.0 / 31.0),
            f32((tint >> 5u) & 63u) * (1.0 / 63.0),
            f32(tint & 31u) * (1.0 / 31.0),
        ));
        if (foliage) {
            albedo *= variation;
        }
    }
    let normal = cross(row1.xyz, row2.xyz);
    // A worn marking lies on the ground.
    var pattern = u32(parameters.z);
    if (tint != 0u) {
        // Façades in a colour of their own have windows of triangles.
        pattern &= ~3u;
    }
    var along = vec3f(1.0, 0.0, 0.0);
    var up = vec3f(0.0, 1.0, 0.0);
    let flat_ = normal.x * normal.x + normal.y * normal.y;
    if (foliage || code == BARK) {
        let n = abs(normal);
        if (n.x >= max(n.y, n.z)) {
            along = vec3f(0.0, 1.0, 0.0);
            up = vec3f(0.0, 0.0, 1.0);
        } else if (n.y >= n.z) {
            up = vec3f(0.0, 0.0, 1.0);
        }
        if (code == BARK) {
            up *= BARK_LENGTH;
        }
    } else if (flat_ > 0.24 * normal.z * normal.z) {
        pattern &= ~64u;
        along = vec3f(-normal.y, normal.x, 0.0) * (1.0 / sqrt(flat_));
        up = cross(normal, along) * (1.0 / sqrt(flat_ + normal.z * normal.z));
    }
    var surface = SurfaceMaterial(
        albedo, color.w, vec3f(0.0), parameters.x, parameters.y, pattern, materials[code * 3u + 2u],
        walls[bitcast<u32>(row2.w)], seed, dot(at, along), dot(at, up), at.z,
    );
    if (is_actor) {
        let tag = bitcast<u32>(triangles[hit.triangle * 3u].w) & 255u;
        surface.pattern &= select(0u, FURROWED, tag == VEGETATION);
        if (code != BARK) {
            surface.grain = vec4f(0.0);
        }
        let is_lens = code == GLASS && tint == LENS;
        surface.emission = actor_emission(
            select(code, LAMP_WHITE, is_lens), instances[hit.instance].lights, albedo)
            * select(1.0, LENS_SHARE, is_lens)
            * select(1.0, SIGN_SHARE, code == LAMP_WHITE && tint != 0u);
        if (code == CAR_PAINT) {
            let road = instances[hit.instance].actor_from_world[2];
            let dirt = DIRT * (f32(seed >> 24u) * (0.55 / 255.0) + 0.45);
            let height = dot(road.xyz, at) + road.w;
            surface.albedo = mix(albedo, DUST, smoothly(DIRT_M.y, DIRT_M.x, height) * dirt);
        }
        if (code == SIGN && tint == PLATE_TINT) {
            let rows = instances[hit.instance].actor_from_world;
            let origin = vec3f(rows[0].w, rows[1].w, rows[2].w);
            let right = rows[0].xyz * along.x + rows[1].xyz * along.y + rows[2].xyz * along.z;
            let above = rows[0].xyz * up.x + rows[1].xyz * up.y + rows[2].xyz * up.z;
            surface.albedo = color.xyz;
            surface.pattern = PLATE;
            surface.wall = pane_of(hit.triangle, along) - vec4f(dot(along, origin), 0.0, dot(up, origin), 0.0);
            surface.along = dot(at, right);
            surface.up = dot(at, above);
        }
    } else if (code == LAMP_WHITE) {
        surface.emission = street_light_emission(owner);
    } else if (code == GLASS && (bitcast<u32>(triangles[hit.triangle * 3u].w) & 255u) == BUILDING
        && tint != 0u) {
        surface.emission = room_emission(seed, tint);
        if (abs(normal.z) * 100.0 < sqrt(flat_)) {
            surface.pattern |= ROOM;
            surface.wall = pane_of(hit.triangle, along);
            surface.seed = mixed(seed ^ tint);
        }
    } else if ((pattern & KERB) != 0u) {
        let stone = pane_of(hit.triangle, along);
        let has_foot = up.z > 0.9 && stone.w < KERB_M;
        surface.wall = select(vec4f(0.0, 0.0, -1e4, 0.0), stone, has_foot);
    } else if ((pattern & 32u) != 0u && tint != 0u) {
        let lane = lane_of(hit.triangle);
        if (lane.w > LANE_M.x && lane.w < LANE_M.y) {
            // The blue of a lane's tint is its red, increased where vehicles wait.
            let oil = min(max(tint & 31u, tint >> 11u) - (tint >> 11u), 3u);
            surface.albedo.z = surface.albedo.x;
            surface.pattern |= LANE | (oil << 12u);
            surface.wall = lane;
        }
    }
    return surface;
}

// Extent of a triangle that is half of an upright pane.
fn pane_of(triangle: u32, along: vec3f) -> vec4f {
    let corner = triangles[triangle * 3u].xyz;
    let edge1 = triangles[triangle * 3u + 1u].xyz;
    let edge2 = triangles[triangle * 3u + 2u].xyz;
    let a = dot(edge1, along);
    let b = dot(edge2, along);
    let left = min(min(a, b), 0.0);
    let low = min(min(edge1.z, edge2.z), 0.0);
    return vec4f(
        dot(corner, along) + left, max(max(a, b), 0.0) - left, corner.z + low,
        max(max(edge1.z, edge2.z), 0.0) - low,
    );
}

// Lane of a triangle whose first edge lies along an edge of the lane.
fn lane_of(triangle: u32) -> vec4f {
    let corner = triangles[triangle * 3u].xyz;
    let edge1 = triangles[triangle * 3u + 1u].xyz;
    let edge2 = triangles[triangle * 3u + 2u].xyz;
    let long = sqrt(max(edge1.x * edge1.x + edge1.y * edge1.y, 1e-6));
    let across = vec2f(edge1.y, -edge1.x) * (1.0 / long);
    let width = dot(edge2.xy, across);
    return vec4f(across, dot(corner.xy, across) + min(width, 0.0), abs(width));
}

// Adds grain to the albedo where a pixel, `pixel` metres wide on the surface, can resolve it.
fn apply_grain(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let grain = (*surface).grain;
    var wave = 1.0;
    for (var octave = 0u; octave < 2u; octave++) {
        let per_m = select(grain.y, grain.w, octave == 1u);
        let strength =
            select(grain.x, grain.z, octave == 1u) * clamp(1.5 - pixel * per_m, 0.0, 1.0);
        if (strength > 0.0) {
            let spot = noise_at((*surface).along * per_m, (*surface).up * per_m, 3u);
            wave += (spot - 0.5) * (strength * 2.0);
        }
    }
    (*surface).albedo *= max(wave, 0.05);
}
