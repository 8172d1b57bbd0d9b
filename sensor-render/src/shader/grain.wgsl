// Noise and hashes for irregular patterns. Twin of grain.rs.

fn smoothly(low: f32, high: f32, x: f32) -> f32 {
    let t = clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

fn hash_of(x: u32, y: u32, seed: u32) -> u32 {
    var h = x * 0x9e3779b1u + y * 0x85ebca77u + seed;
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12u)) * 0x297a2d39u;
    return h ^ (h >> 15u);
}

// Converts a word to a number from 0 to 1.
fn share_of(word: u32) -> f32 {
    return f32(word >> 8u) * (1.0 / 16777216.0);
}

fn cell_of(x: f32) -> u32 {
    return bitcast<u32>(i32(x));
}

// Smooth noise from 0 to 1, with one lattice cell per unit square.
fn noise_at(x: f32, y: f32, seed: u32) -> f32 {
    let low = floor(vec2f(x, y));
    let part = vec2f(x, y) - low;
    let left = cell_of(low.x);
    let foot = cell_of(low.y);
    let ease = part * part * (3.0 - 2.0 * part);
    let below = mix(
        share_of(hash_of(left, foot, seed)), share_of(hash_of(left + 1u, foot, seed)), ease.x);
    let above = mix(
        share_of(hash_of(left, foot + 1u, seed)), share_of(hash_of(left + 1u, foot + 1u, seed)), ease.x);
    return mix(below, above, ease.y);
}
