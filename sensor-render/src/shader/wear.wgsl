// Age of surfaces: stains, cracks and repairs of roads, worn markings, dry grass, weathered walls. Twin of
// wear.rs.

const ROAD = 32u;
const MARKING = 64u;
const GRASS = 128u;
const WORN_PAINT = 0.1;

fn apply_wear(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let pattern = (*surface).pattern;
    if ((pattern & ROAD) != 0u) {
        wear_road(surface, pixel);
    }
    if ((pattern & MARKING) != 0u) {
        wear_marking(surface, pixel);
    }
    if ((pattern & GRASS) != 0u) {
        dry_grass(surface);
    }
    if ((pattern & 1u) != 0u) {
        weather_wall(surface);
    }
}

// Coverage of a pixel by a line whose middle is `apart` metres away.
fn line_of(apart: f32, width: f32, pixel: f32) -> f32 {
    return cover_of(width * 0.5 - apart, pixel) * clamp(width / pixel, 0.0, 1.0);
}

fn wear_road(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let x = (*surface).along;
    let y = (*surface).up;
    let stain = noise_at(x * 0.23, y * 0.23, 21u) * 0.6 + noise_at(x * 0.9, y * 0.9, 22u) * 0.4;
    var wave = 1.0 + (stain - 0.5) * 0.36;
    if (pixel < 0.12) {
        let age = smoothly(0.5, 0.62, noise_at(x * 0.07, y * 0.07, 26u));
        let right = x + (noise_at(x * 1.7, y * 1.7, 23u) - 0.5) * 0.9;
        let ahead = y + (noise_at(x * 1.7, y * 1.7, 24u) - 0.5) * 0.9;
        let crack = noise_at(right * 0.45, ahead * 0.45, 25u) - 0.5;
        wave *= 1.0 - 0.5 * line_of(abs(crack) * (1.0 / 0.6), 0.02, pixel) * age;
    }
    (*surface).albedo *= wave;

    let cell = vec2f(9.0, 7.0);
    let cells = vec2f(x, y) * (1.0 / cell);
    let at = floor(cells);
    let word = hash_of(cell_of(at.x), cell_of(at.y), 29u);
    let kind = share_of(word * 0x9e3779b1u);
    let is_patched = kind < 0.2;
    let is_covered = kind > 0.9;
    if (!is_patched && !is_covered) {
        return;
    }
    let place = vec2f(share_of(word * 0x85ebca6bu), share_of(word * 0xc2b2ae35u));
    let apart = (cells - at - (0.35 + 0.3 * place)) * cell;
    if (is_patched) {
        let size = share_of(word * 0x27d4eb2fu);
        let half = vec2f(0.5 + 1.3 * size, 0.35 + 0.6 * place.x);
        let edges = half - abs(apart);
        let inside = min(edges.x, edges.y);
        let patched = 1.0 + cover_of(inside, pixel) * (place.y * 0.5 - 0.32);
        (*surface).albedo *= patched * (1.0 - 0.35 * line_of(abs(inside), 0.05, pixel));
        return;
    }
    let radius = length(apart);
    let rim = line_of(abs(radius - 0.33), 0.03, pixel);
    let waves = apart * 12.5;
    let crests = abs(waves - floor(waves) - 0.5);
    let relief = smoothly(0.1, 0.02, pixel);
    let iron = 0.085 * (1.0 + (crests.x + crests.y - 0.5) * relief * 0.7);
    let disc = cover_of(0.33 - radius, pixel);
    (*surface).albedo = mix((*surface).albedo, iron * vec3f(1.0, 0.96, 0.9), disc);
    (*surface).specular = mix((*surface).specular, 0.12, disc);
    (*surface).roughness = mix((*surface).roughness, 0.4, disc);
    (*surface).albedo *= 1.0 - 0.6 * rim;
}

fn wear_marking(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let x = (*surface).along;
    let y = (*surface).up;
    let spots = noise_at(x * 2.1, y * 2.1, 27u) * 0.5 + noise_at(x * 14.0, y * 14.0, 28u) * 0.5;
    let bare = mix(smoothly(0.52, 0.78, spots) * 0.65, 0.12, smoothly(0.05, 0.2, pixel));
    (*surface).albedo = mix((*surface).albedo, vec3f(WORN_PAINT), bare);
}

fn dry_grass(surface: ptr<function, SurfaceMaterial>) {
    let x = (*surface).along;
    let y = (*surface).up;
    let wide = noise_at(x * 0.045, y * 0.045, 31u) * 0.6 + noise_at(x * 0.31, y * 0.31, 32u) * 0.4;
    let dry = smoothly(0.42, 0.78, wide) * 0.75;
    let wave = 1.0 + (noise_at(x * 1.9, y * 1.9, 33u) - 0.5) * 0.5;
    (*surface).albedo *= mix(vec3f(1.0), vec3f(1.9, 1.35, 1.25), dry) * wave;
}

fn weather_wall(surface: ptr<function, SurfaceMaterial>) {
    let streaks = noise_at((*surface).along * 1.6, (*surface).height * 0.13, 34u);
    let splash = smoothly(1.3, 0.0, (*surface).height - (*surface).wall.z) * 0.3;
    (*surface).albedo *= (1.0 - smoothly(0.45, 0.9, streaks) * 0.22) * (1.0 - splash);
}
