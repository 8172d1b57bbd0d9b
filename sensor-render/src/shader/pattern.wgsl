// Regular patterns: windows, bricks, slabs, tiles, number plates. Twin of pattern.rs.

const FLOOR_M = 3.1;
const BAY_M = 3.64;

fn cover_of(inside: f32, pixel: f32) -> f32 {
    return clamp(inside / pixel + 0.5, 0.0, 1.0);
}

fn draw(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    let pattern = (*surface).pattern;
    let along = (*surface).along;
    let up = (*surface).up;
    if ((pattern & 8u) != 0u) {
        lines(surface, vec2f(along, up), vec2f(0.6, 0.6), 0.012, 0.08, -0.35, pixel);
    }
    if ((pattern & 16u) != 0u) {
        lines(surface, vec2f(along, up), vec2f(0.3, 0.36), 0.03, 0.2, -0.35, pixel);
    }
    if ((pattern & 1u) != 0u) {
        panes(surface, vec2f(BAY_M, FLOOR_M), vec2f(0.62, 0.78), 1.75, pixel);
    }
    if ((pattern & 2u) != 0u) {
        panes(surface, vec2f(1.7, 1.55), vec2f(0.5, 0.735), 0.775, pixel);
    }
    if ((pattern & PLATE) != 0u) {
        draw_plate(surface, pixel);
    }
}

const BRICK_M = vec2f(0.25, 0.075);
const JOINT_M = 0.011;
const JOINTS = 0.18;
const MORTAR = vec3f(0.25, 0.235, 0.21);
const BURNT = vec3f(0.52, 0.54, 0.64);
const PALE = vec3f(1.22, 1.3, 1.3);

fn lay_bricks(surface: ptr<function, SurfaceMaterial>, pixel: f32) {
    if (((*surface).pattern & 4u) == 0u) {
        return;
    }
    let y = (*surface).up * (1.0 / BRICK_M.y);
    let row = floor(y);
    let x = (*surface).along * (1.0 / BRICK_M.x) + (row * 0.5 - floor(row * 0.5));
    let column = floor(x);
    let edges = (0.5 - abs(vec2f(x - column, y - row) - 0.5)) * BRICK_M;
    let seen = clamp(1.6 - pixel * (1.6 / BRICK_M.y), 0.0, 1.0);
    let in_joint = 1.0 - cover_of(min(edges.x, edges.y) - JOINT_M * 0.5, pixel);
    let joint = mix(JOINTS, in_joint, seen);
    let word = hash_of(cell_of(column), cell_of(row), (*surface).seed);
    let kind = share_of(word * 0x9e3779b1u);
    let tone = 1.0 + (share_of(word) - 0.5) * (seen * 0.36);
    let burnt = smoothly(0.82, 0.92, kind) * seen;
    let pale = smoothly(0.18, 0.06, kind) * seen;
    let hue = mix(vec3f(1.0), BURNT, burnt) * mix(vec3f(1.0), PALE, pale);
    (*surface).albedo = mix((*surface).albedo * hue * tone, MORTAR, joint);
}

fn lines(
    surface: ptr<function, SurfaceMaterial>, at: vec2f, size: vec2f, joint: f32, vary: f32, bright: f32,
    pixel: f32,
) {
    let cells = at * (1.0 / size);
    let cell = floor(cells);
    let edges = (0.5 - abs(cells - cell - 0.5)) * size;
    let in_joint = 1.0 - cover_of(min(edges.x, edges.y) - joint * 0.5, pixel);
    let tone = share_of(hash_of(cell_of(cell.x), cell_of(cell.y), (*surface).seed)) - 0.5;
    let sharp = clamp(1.6 - pixel * (1.6 / min(size.x, size.y)), 0.0, 1.0);
    (*surface).albedo *= 1.0 + (tone * 2.0 * vary + in_joint * bright) * sharp;
}

fn panes(surface: ptr<function, SurfaceMaterial>, cell_size: vec2f, half: vec2f, middle: f32, pixel: f32) {
    let wall = (*surface).wall;
    let columns = max(floor(wall.y * (1.0 / cell_size.x)), 1.0);
    let pitch = wall.y / columns;
    let x = ((*surface).along - wall.x) / max(pitch, 0.01);
    let y = ((*surface).height - wall.z) * (1.0 / cell_size.y);
    let column = floor(x);
    let row = floor(y);
    let across = abs((x - column - 0.5) * pitch);
    let upward = abs((y - row) * cell_size.y - middle);
    let fits = wall.w - (row + 1.0) * cell_size.y >= -0.6 && row >= 0.0
        && pitch >= half.x * 2.0 + 0.1;
    if (!fits) {
        return;
    }
    let half_across = max(half.x, select(half.x, pitch * 0.5 - 0.08, pitch <= 2.0));
    let inside = min(half_across - across, half.y - upward);
    let even = half_across * (4.0 * half.y / cell_size.y) / max(pitch, 0.01);
    let blurred = smoothly(0.8, 2.6, pixel);
    let edge = mix(cover_of(inside, pixel), even, blurred);
    let pane = mix(cover_of(inside - 0.07, pixel), even * 0.85, blurred);
    let word = hash_of(cell_of(column), cell_of(row), (*surface).seed);
    let tone = share_of(word);
    let lit = share_of(word * 0x9e3779b1u);
    let cloth = mix(smoothly(0.55, 0.95, tone), 0.2, blurred);
    let glass = mix(vec3f(0.02, 0.026, 0.03), vec3f(0.25, 0.235, 0.21), cloth);
    let white = mix(vec3f(0.5), (*surface).albedo, 0.3);
    (*surface).albedo = mix(mix((*surface).albedo, white, edge), glass, pane);
    (*surface).specular = mix((*surface).specular, 0.09, pane);
    (*surface).roughness = mix((*surface).roughness, 0.04, pane);
    let lamp = mix(smoothly(0.62, 0.66, lit), 0.36, blurred) * pane * frame.horizon.w
        * (0.3 + 0.7 * tone);
    (*surface).emission += vec3f(1.5, 1.0, 0.5) * lamp;
}
