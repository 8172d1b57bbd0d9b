// Age of surfaces: stains, cracks and repairs of roads, worn markings, dirty pavements and kerbs, dry grass,
// weathered walls, bark. Twin of wear.rs.

const ROAD = 32u;
const MARKING = 64u;
const GRASS = 128u;
const SLABS = 8u;
const KERB = 2048u;
const BRICKS = 4u;
const WALL = 16384u;
const FURROWED = 32768u;
const WORN_PAINT = 0.1;
const UNTRACKED = 1.07;
const BASE_M = 0.6;
const GRIME = vec3f(0.32, 0.32, 0.27);

fn apply_wear(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let pattern = (*surface).pattern;
    if ((pattern & ROAD) != 0u) {
        wear_road(surface, pixel);
    }
    if ((pattern & MARKING) != 0u) {
        wear_marking(surface, pixel);
    }
    if ((pattern & GRASS) != 0u) {
        dry_grass(surface, pixel);
    }
    if ((pattern & (SLABS | KERB)) != 0u) {
        soil(surface, pixel);
    }
    if ((pattern & WALL) != 0u) {
        weather_wall(surface, pixel);
    }
    if ((pattern & FURROWED) != 0u) {
        furrow_bark(surface, pixel);
    }
}

// Grain whose spots are `finest_m` metres wide and, where a pixel is wider, as wide as a pixel.
fn speckle(x: f32, y: f32, pixel: f32, finest_m: f32) -> f32 {
    let wide = max(pixel * (1.0 / finest_m), 1.0);
    let octave = bitcast<u32>(wide) & 0xff800000u;
    let low = bitcast<f32>(octave);
    let per_m = (1.0 / finest_m) / low;
    let fine = noise_at(x * per_m, y * per_m, octave >> 23u);
    let coarse = noise_at(x * per_m * 0.5, y * per_m * 0.5, (octave >> 23u) + 1u);
    return (mix(fine, coarse, wide / low - 1.0) - 0.5) / sqrt(wide);
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
    // Aggregate, across the lattices of the others.
    wave *= 1.0 + 1.1 * speckle(x * 0.8 + y * 0.6, y * 0.8 - x * 0.6, pixel, 0.006);
    if (pixel < 0.12) {
        let age = smoothly(0.5, 0.62, noise_at(x * 0.07, y * 0.07, 26u));
        let right = x + (noise_at(x * 1.7, y * 1.7, 23u) - 0.5) * 0.9;
        let ahead = y + (noise_at(x * 1.7, y * 1.7, 24u) - 0.5) * 0.9;
        let crack = noise_at(right * 0.45, ahead * 0.45, 25u) - 0.5;
        wave *= 1.0 - 0.5 * line_of(abs(crack) * (1.0 / 0.6), 0.02, pixel) * age;
    }
    (*surface).albedo *= wave;
    if (((*surface).pattern & LANE) != 0u) {
        drive(surface);
    }

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

// Darkens a lane by rubber in the tracks of wheels and by oil between them; dust and dirt lie at its edges.
fn drive(surface: ptr<function, SurfaceMaterial>) {
    let x = (*surface).along;
    let y = (*surface).up;
    let wall = (*surface).wall;
    let from_middle = x * wall.x + y * wall.y - wall.z - wall.w * 0.5;
    let off = abs(from_middle);
    let sway = (noise_at(x * 0.06, y * 0.06, 35u) - 0.5) * 0.5;
    let track = smoothly(0.40, 0.08, abs(off + sway - 0.82));
    let drips = noise_at(x * 0.35, y * 0.35, 36u) * 0.6 + noise_at(x * 2.6, y * 2.6, 37u) * 0.4;
    let oil = smoothly(0.52, 0.0, off) * (smoothly(0.3, 0.75, drips) * 0.65 + 0.35);
    let side = smoothly(0.75, 0.05, wall.w * 0.5 - off);
    let clumps = noise_at(x * 0.8, y * 0.8, 38u);
    let dirt = smoothly(0.52, 0.8, clumps);
    let waits = f32(((*surface).pattern >> 12u) & 3u) * (1.0 / 3.0);
    let spots = smoothly(0.5, 0.72, noise_at(y * 1.9, x * 1.9, 44u));
    let pool = smoothly(0.9, 0.1, off) * waits * (spots * 0.7 + 0.3);
    // Tyres that lock leave marks, some of them on one side only.
    let locked = noise_at((y * wall.x - x * wall.y) * 0.13, wall.z + from_middle * 0.9, 57u);
    let skid = smoothly(0.13, 0.06, abs(off + sway - 0.8)) * smoothly(0.52, 0.62, locked);
    let dark = track * 0.26 + oil * 0.42 + pool * 0.4 + skid * min(waits, 0.5) * 0.7
        + side * dirt * 0.3;
    // Where no wheels roll, the binder is worn less and bleached.
    let bleached = UNTRACKED + 0.4 * side * (1.0 - dirt) * clumps;
    (*surface).albedo *= max(1.0 - dark, 0.2) * bleached;
    (*surface).roughness -= track * 0.08;
}

fn wear_marking(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let x = (*surface).along;
    let y = (*surface).up;
    let spots = noise_at(x * 2.1, y * 2.1, 27u) * 0.5 + noise_at(x * 14.0, y * 14.0, 28u) * 0.5;
    let bare = mix(smoothly(0.52, 0.78, spots) * 0.65, 0.12, smoothly(0.05, 0.2, pixel));
    (*surface).albedo = mix((*surface).albedo, vec3f(WORN_PAINT), bare);
}

// Soils pavements and kerbs by stains, and kerbs by dirt along their feet.
fn soil(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let u = (*surface).along * 0.8 + (*surface).up * 0.6;
    let v = (*surface).up * 0.8 - (*surface).along * 0.6;
    let wide = noise_at(u * 0.37, v * 0.37, 42u);
    let spots = noise_at(u * 2.3, v * 2.3, 43u);
    let dark = smoothly(0.55, 0.9, spots) * wide * 0.36 + (0.5 - wide) * 0.34;
    var foot = smoothly(0.10, 0.0, (*surface).height - (*surface).wall.z) * (spots * 0.6 + 0.25);
    foot = select(0.0, foot, ((*surface).pattern & KERB) != 0u);
    (*surface).albedo *= (1.0 - dark) * (1.0 - foot) * (1.0 + 0.5 * speckle(u, v, pixel, 0.005));
}

fn dry_grass(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let x = (*surface).along;
    let y = (*surface).up;
    let wide = noise_at(x * 0.045, y * 0.045, 31u) * 0.6 + noise_at(x * 0.31, y * 0.31, 32u) * 0.4;
    let dry = smoothly(0.42, 0.78, wide) * 0.75;
    // Across the lattices of the others, so that no rows show.
    let u = x * 0.8 + y * 0.6;
    let v = y * 0.8 - x * 0.6;
    let tufts = noise_at(u * 1.9, v * 1.9, 33u);
    // Blades and their shadows are longer than wide, and bend from tuft to tuft.
    let blades = speckle(u + tufts * 0.35, v * 0.45, pixel, 0.012);
    let shade = 1.0 + (tufts - 0.5) * 0.5 + blades * 1.9;
    let clover = smoothly(0.56, 0.74, tufts) * (1.0 - dry);
    let lush = mix(vec3f(1.0), vec3f(0.72, 0.92, 0.8), clover);
    (*surface).albedo *= mix(lush, vec3f(1.9, 1.35, 1.25), dry) * max(shade, 0.12);
}

fn weather_wall(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let x = (*surface).along;
    let y = (*surface).height;
    let above = y - (*surface).wall.z;
    let below = (*surface).wall.w - above;
    // Some buildings were painted lately.
    let age = share_of((*surface).seed * 0x9e3779b1u) * 0.8 + 0.5;
    let fine = noise_at(x * 2.9, y * 0.11, 34u);
    let wide = noise_at(x * 0.55, y * 0.06, 45u);
    let runs = smoothly(0.4, 0.74, mix(fine, wide, 0.35));
    let streaks = runs * (smoothly(5.0, 0.2, below) * 0.36 + 0.2);
    let spots = noise_at(x * 2.9, y * 2.9, 47u);
    let reach = noise_at(x * 0.6, y * 0.6, 46u) * 1.7 + 0.5;
    let splashes = smoothly(reach, 0.0, above) * (spots * 0.45 + 0.4);
    let grime = clamp(1.0 - (1.0 - streaks * age) * (1.0 - splashes * age), 0.0, 1.0);
    let places = noise_at(x * 0.21, y * 0.21, 40u) * 0.5 + noise_at(x * 1.3, y * 1.3, 41u) * 0.3
        + spots * 0.2;
    var wave = 1.0 + (places - 0.5) * age * 0.44;
    // Half of the buildings have a darker base course.
    let has_base = share_of((*surface).seed * 0x85ebca6bu) > 0.5;
    wave *= 1.0 - 0.24 * select(0.0, cover_of(BASE_M - above, pixel), has_base);
    if (((*surface).pattern & BRICKS) == 0u) {
        // Storeys were rendered one after the other.
        let storey = floor(above * (1.0 / 3.1) - 0.26);
        let lift = share_of(hash_of(cell_of(storey), 0u, (*surface).seed)) - 0.5;
        wave *= plaster(surface, age, pixel) + lift * 0.1;
    }
    (*surface).albedo *= mix(vec3f(1.0), GRIME, grime) * wave;
}

// Brightness of plaster by its repairs and cracks.
fn plaster(surface: ptr<function, SurfaceMaterial>, age: f32, pixel: f32) -> f32 {
    let x = (*surface).along;
    let y = (*surface).height;
    let cell = vec2f(4.1, 2.9);
    let cells = vec2f(x, y) * (1.0 / cell);
    let at = floor(cells);
    let word = hash_of(cell_of(at.x), cell_of(at.y), (*surface).seed);
    let place = vec2f(share_of(word * 0x85ebca6bu), share_of(word * 0xc2b2ae35u));
    let apart = abs(cells - at - (0.3 + 0.4 * place)) * cell;
    let size = share_of(word * 0x27d4eb2fu);
    // Trowels leave uneven edges.
    let uneven = (noise_at(x * 3.7, y * 3.7, 48u) - 0.5) * 0.22;
    let inside = min(0.35 + 0.7 * size - apart.x, 0.3 + 0.4 * place.x - apart.y);
    let is_repaired = share_of(word * 0x9e3779b1u) < 0.1;
    let repair = select(0.0, cover_of(inside + uneven, pixel), is_repaired);
    let wave = 1.0 + repair * (place.y * 0.26 - 0.15);
    if (pixel >= 0.03) {
        return wave;
    }
    let old = smoothly(0.5, 0.66, noise_at(x * 0.13, y * 0.13, 49u)) * age;
    let right = x + (noise_at(x * 1.9, y * 1.9, 50u) - 0.5) * 0.7;
    let over = y + (noise_at(x * 1.9, y * 1.9, 51u) - 0.5) * 0.7;
    let crack = noise_at(right * 0.5, over * 0.5, 52u) - 0.5;
    return wave * (1.0 - 0.5 * line_of(abs(crack) * (1.0 / 0.7), 0.007, pixel) * old);
}

const RIDGES_PER_M = vec2f(34.0, 3.0);
const FIBRES_PER_M = vec2f(85.0, 9.0);
const FURROW = 0.55;
const FURROWS = 0.208;
const ALGAE = vec3f(0.105, 0.12, 0.07);

// Draws furrows between the ridges of bark, and algae in places.
fn furrow_bark(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let x = (*surface).along;
    let y = (*surface).up;
    let seen = clamp(1.5 - pixel * RIDGES_PER_M.x, 0.0, 1.0);
    var furrow = FURROWS;
    var wave = 1.0;
    if (seen > 0.0) {
        // Ridges part and meet again.
        let around = x + (noise_at(x * 5.0, y * 5.0, 54u) - 0.5) * 0.05;
        let ridge = noise_at(around * RIDGES_PER_M.x, y * (RIDGES_PER_M.y / BARK_LENGTH), 55u);
        furrow = mix(FURROWS, smoothly(0.13, 0.0, abs(ridge - 0.5)), seen);
        let fibre = noise_at(around * FIBRES_PER_M.x, y * (FIBRES_PER_M.y / BARK_LENGTH), 56u) - 0.5;
        wave = 1.0 + fibre * clamp(1.5 - pixel * FIBRES_PER_M.x, 0.0, 1.0) * 0.8;
    }
    wave *= (1.0 + furrow * (FURROW - 1.0)) * (1.0 / (1.0 - (1.0 - FURROW) * FURROWS));
    let algae = smoothly(0.48, 0.8, noise_at(x * 1.6, y * 1.6, 53u)) * 0.45;
    (*surface).albedo = mix((*surface).albedo * wave, ALGAE, algae);
}
