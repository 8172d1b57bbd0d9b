// Return of a laser pulse. Twin of lidar_return.rs.

// Reflectivity and its diffuse share, by material.
@group(0) @binding(11) var<uniform> reflectivities: array<vec4f, 40>;

fn mixed(word: u32) -> u32 {
    var x = word;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    x ^= x >> 16u;
    return x;
}

// Random number of mean 0 and standard deviation 1, from two random words.
fn normal_number(b: u32, c: u32) -> f32 {
    let sum = f32((b & 0xffffu) + (b >> 16u) + (c & 0xffffu) + (c >> 16u));
    return (sum * (1.0 / 65536.0) - 2.0) * 1.7320508;
}

// Reflectivity of a material, and its share towards a sensor.
fn reflected(cosine: f32, material: u32) -> vec2f {
    let surface = reflectivities[min(material, 39u)];
    return vec2f(surface.x, 1.0 - surface.y + surface.y * cosine);
}

// Distance in metres and intensity; an intensity of 0 means that the return is dropped.
fn lidar_return_of(index: u32, beam: u32, hit: Hit, direction: vec3f) -> vec2f {
    let start = mixed(lidars[index].seed ^ beam);
    let a = mixed(start + 1u);
    let b = mixed(start + 2u);
    let c = mixed(start + 3u);
    if (f32(a >> 8u) * (1.0 / 16777216.0) < lidars[index].z_axis.w) {
        return vec2f(0.0);
    }
    let noise = normal_number(b, c);
    let distance = hit.t + noise * lidars[index].y_axis.w;
    let cosine = abs(dot(normal_of(hit, direction), direction));
    if (lidars[index].x_axis.w < 0.0) {
        // Points report the cosine of incidence instead of an intensity.
        return vec2f(distance, clamp(cosine, 1e-6, 1.0));
    }
    let towards = reflected(cosine, material_of(hit));
    let intensity = towards.x * towards.y * exp(-lidars[index].x_axis.w * hit.t);
    return vec2f(distance, max(intensity, 1e-6));
}
