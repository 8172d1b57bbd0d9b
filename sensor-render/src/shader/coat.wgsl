// What a triangle is painted with: the twin of coat.rs.

// Three words of 16 bytes for each material: see MATERIALS in coat.rs.
@group(0) @binding(12) var<uniform> materials: array<vec4f, 99>;

const CAR_PAINT = 19u;
const LAMP_WHITE = 22u;
const LAMP_RED = 23u;
const SIGNAL_RED = 25u;
const SIGNAL_YELLOW = 26u;
const SIGNAL_GREEN = 27u;
const LEAVES = 15u;
const NEEDLES = 16u;

const PAINTS = array<u32, 8>(
    0x2a2a8cu, 0x6e4628u, 0x3c5a2du, 0x28282au, 0x969696u, 0x1e82b4u, 0x50286eu, 0xb4bebeu);

struct Coat {
    albedo: vec3f,
    shine: f32,
    glow: vec3f,
    rough: f32,
    wrap: f32,
    pattern: u32,
    grain: vec4f,
    wall: vec4f,
    seed: u32,
    // Metres along the surface and up it, and over the ground.
    along: f32,
    up: f32,
    height: f32,
}

fn shows(lights: u32, phase: u32) -> f32 {
    return select(0.0, 1.0, (lights & 2u) != 0u && (lights >> 8u) == phase);
}

fn glow_of_actor(code: u32, lights: u32) -> vec3f {
    let dark = frame.horizon.w;
    switch (code) {
        case LAMP_WHITE: { return vec3f(8.0, 7.6, 6.8) * dark; }
        case LAMP_RED: {
            return vec3f(3.2, 0.12, 0.06) * select(0.3 * dark, 1.0, (lights & 1u) != 0u);
        }
        case SIGNAL_RED: { return vec3f(4.0, 0.12, 0.06) * shows(lights, 0u); }
        case SIGNAL_YELLOW: { return vec3f(3.6, 1.9, 0.08) * shows(lights, 1u); }
        case SIGNAL_GREEN: { return vec3f(0.1, 3.0, 1.5) * shows(lights, 2u); }
        default: { return vec3f(0.0); }
    }
}

fn coat_of(hit: Hit, at: vec3f) -> Coat {
    let row1 = triangles[hit.triangle * 3u + 1u];
    let row2 = triangles[hit.triangle * 3u + 2u];
    let code = min(material_of(hit), 32u);
    let color = materials[code * 3u];
    let stuff = materials[code * 3u + 1u];
    let is_actor = hit.instance != NONE;
    var owner = bitcast<u32>(row1.w);
    if (is_actor) {
        owner = instances[hit.instance].id;
    }
    let seed = mixed(owner);
    let pale = (f32(seed & 255u) * (1.0 / 255.0) - 0.5) * stuff.w;
    let warm = (f32((seed >> 8u) & 255u) * (1.0 / 255.0) - 0.5) * stuff.w;
    var albedo = color.xyz * vec3f(1.0 + pale + warm * 0.4, 1.0 + pale, 1.0 + pale - warm * 0.6);
    if (code == CAR_PAINT) {
        var paints = PAINTS;
        var paint = paints[(seed >> 16u) & 7u];
        if (is_actor) {
            paint = instances[hit.instance].color;
        }
        let c = unpack4x8unorm(paint).xyz;
        albedo = c * (c * (c * 0.30530601 + 0.6821711) + 0.012522878);
    }
    let normal = cross(row1.xyz, row2.xyz);
    var along = vec3f(1.0, 0.0, 0.0);
    var up = vec3f(0.0, 1.0, 0.0);
    let flat_ = normal.x * normal.x + normal.y * normal.y;
    if (code == LEAVES || code == NEEDLES) {
        let n = abs(normal);
        if (n.x >= max(n.y, n.z)) {
            along = vec3f(0.0, 1.0, 0.0);
            up = vec3f(0.0, 0.0, 1.0);
        } else if (n.y >= n.z) {
            up = vec3f(0.0, 0.0, 1.0);
        }
    } else if (flat_ > 0.24 * normal.z * normal.z) {
        along = vec3f(-normal.y, normal.x, 0.0) * (1.0 / sqrt(flat_));
        up = cross(normal, along) * (1.0 / sqrt(flat_ + normal.z * normal.z));
    }
    var coat = Coat(
        albedo, color.w, vec3f(0.0), stuff.x, stuff.y, u32(stuff.z), materials[code * 3u + 2u],
        walls[bitcast<u32>(row2.w)], seed, dot(at, along), dot(at, up), at.z,
    );
    if (is_actor) {
        coat.pattern = 0u;
        coat.grain = vec4f(0.0);
        coat.glow = glow_of_actor(code, instances[hit.instance].lights);
    } else if (code == LAMP_WHITE) {
        coat.glow = vec3f(9.0, 7.5, 5.0) * frame.horizon.w;
    }
    return coat;
}

// Makes the albedo grainy where a pixel, `pixel` metres wide on the surface, can show it.
fn roughen(coat: ptr<function, Coat>, pixel: f32) {
    let grain = (*coat).grain;
    var wave = 1.0;
    for (var octave = 0u; octave < 2u; octave++) {
        let per_m = select(grain.y, grain.w, octave == 1u);
        let strength =
            select(grain.x, grain.z, octave == 1u) * clamp(1.5 - pixel * per_m, 0.0, 1.0);
        if (strength > 0.0) {
            let spot = noise_at((*coat).along * per_m, (*coat).up * per_m, 3u);
            wave += (spot - 0.5) * (strength * 2.0);
        }
    }
    (*coat).albedo *= max(wave, 0.05);
}
