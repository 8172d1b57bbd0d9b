// Number plates with characters by actor. Twin of plate.rs.

const PLATE = 1024u;
const PLATE_TINT = 1u;
const INK = 0.02;
const PLATE_SIZE_M = vec2f(0.52, 0.11);
const HALF_LINE_M = 0.006;
const UNIT_M = 0.0115;
const PITCH_M = 0.072;
const SPACE_M = 0.012;

// The points of each character: see `GLYPHS` in plate.rs.
const GLYPHS = array<vec4u, 30>(
    vec4u(868647425u, 1057239852u, 1073741823u, 1073741823u),
    vec4u(1073491105u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(615726184u, 1073737984u, 1073741823u, 1073741823u),
    vec4u(615726184u, 206681755u, 1073512515u, 1073741823u),
    vec4u(1062276291u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(479071284u, 1059066060u, 1073741823u, 1073741823u),
    vec4u(144907500u, 458277057u, 1073741784u, 1073741823u),
    vec4u(1073487152u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(868648985u, 275101996u, 338702408u, 1073741787u),
    vec4u(741355592u, 427986035u, 1073741788u, 1073741823u),
    vec4u(76752896u, 1073738772u, 1073741823u, 1073741823u),
    vec4u(615726080u, 206681627u, 1073737731u, 1073741823u),
    vec4u(144907500u, 1073529025u, 1073741823u, 1073741823u),
    vec4u(213072896u, 1073737731u, 1073741823u, 1073741823u),
    vec4u(409832500u, 1073737984u, 1073741823u, 1073741823u),
    vec4u(409832500u, 1073741760u, 1073741823u, 1073741823u),
    vec4u(144907500u, 443596993u, 1073741823u, 1073741823u),
    vec4u(879856640u, 1073741764u, 1073741823u, 1073741823u),
    vec4u(134492980u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(433130496u, 1073741764u, 1073741823u, 1073741823u),
    vec4u(1073496112u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(80849920u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(1070615552u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(615726080u, 1073739291u, 1073741823u, 1073741823u),
    vec4u(615726080u, 1058121243u, 1073741823u, 1073741823u),
    vec4u(547560684u, 53561049u, 1073738241u, 1073741823u),
    vec4u(1057697072u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(202117680u, 1073741812u, 1073741823u, 1073741823u),
    vec4u(1073692848u, 1073741823u, 1073741823u, 1073741823u),
    vec4u(79801600u, 1073741823u, 1073741823u, 1073741823u),
);

fn glyph_at(seed: u32, place: u32) -> vec4u {
    let dice = mixed(seed ^ (place * 0x9e3779b1u)) >> 8u;
    var glyphs = GLYPHS;
    return glyphs[select(dice % 10u, 10u + dice % 20u, place < 2u)];
}

// Distance in metres from the middle of the nearest line of the characters.
fn plate_distance(seed: u32, at: vec2f) -> f32 {
    let x = at.x - PLATE_SIZE_M.x * 0.5;
    let is_letter = x < -PITCH_M;
    let space = select(SPACE_M, -SPACE_M, is_letter);
    let range = select(vec2f(2.0, 5.0), vec2f(0.0, 1.0), is_letter);
    let place = clamp(floor((x - space) * (1.0 / PITCH_M) + 3.0), range.x, range.y);
    let u = (x - space - (place - 2.5) * PITCH_M) * (1.0 / UNIT_M) + 2.0;
    let v = (at.y - PLATE_SIZE_M.y * 0.5) * (1.0 / UNIT_M) + 3.0;
    var glyph = glyph_at(seed, u32(place));
    var nearest = 1e30;
    var begin = vec2f(f32(glyph.x & 7u), f32((glyph.x >> 3u) & 7u));
    for (var point = 1u; point < 20u; point++) {
        let code = (glyph[point / 5u] >> (6u * (point % 5u))) & 63u;
        if (code == 63u) {
            break;
        }
        let end = vec2f(f32(code & 7u), f32(code >> 3u));
        let along = end - begin;
        let from_begin = vec2f(u, v) - begin;
        let t = clamp(dot(from_begin, along) / dot(along, along), 0.0, 1.0);
        let apart = from_begin - along * t;
        nearest = min(nearest, dot(apart, apart));
        begin = end;
    }
    return sqrt(nearest) * UNIT_M;
}

// Draws the characters and the edge of a plate.
fn draw_plate(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let wall = (*surface).wall;
    let share = vec2f((*surface).along - wall.x, (*surface).up - wall.z) / max(wall.yw, vec2f(0.01));
    let at = share * PLATE_SIZE_M;
    let apart = plate_distance((*surface).seed, at);
    let line = cover_of(HALF_LINE_M - apart, pixel) * clamp(HALF_LINE_M * 2.0 / pixel, 0.0, 1.0);
    let sides = min(at, PLATE_SIZE_M - at);
    let border = cover_of(0.004 - min(sides.x, sides.y), pixel) * clamp(0.004 / pixel, 0.0, 1.0);
    (*surface).albedo = mix((*surface).albedo, vec3f(INK), max(line, border * 0.7));
}
