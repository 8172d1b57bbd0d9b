// Light of lamps on surfaces. Twin of lamplight.rs.

const STREET = 0u;
const LOW_BEAM = 1u;
const DIFFUSE = 3u;

// A corner and cells per metre; columns, rows and the offset of the lamps; four vectors for each cell of
// the grid; three for each lamp. See LampGrid in lamps.rs.
@group(0) @binding(15) var<storage, read> lamps: array<vec4u>;

struct Lamplight {
    // By all lamps but the strongest, without shadows.
    others: vec3f,
    strongest: vec3f,
    number: u32,
}

fn lamplight_of(
    surface: ptr<function, SurfaceMaterial>, at: vec3f, normal: vec3f, view: vec3f, mirror: f32,
) -> Lamplight {
    var light = Lamplight(vec3f(0.0), vec3f(0.0), NONE);
    let place = bitcast<vec4f>(lamps[0]);
    let size = lamps[1].xy;
    let cell = floor((at.xy - place.xy) * place.z);
    if (any(cell < vec2f(0.0)) || any(cell >= vec2f(size))) {
        return light;
    }
    let first = 2u + (u32(cell.y) * size.x + u32(cell.x)) * 4u;
    var best = 0.0;
    for (var entry = 0u; entry < 16u; entry++) {
        let number = lamps[first + entry / 4u][entry % 4u];
        if (number == NONE) {
            break;
        }
        let radiance = lamp_radiance(number, surface, at, normal, view, mirror);
        let strength = radiance.x + radiance.y + radiance.z;
        if (strength > best) {
            light.others += light.strongest;
            light.strongest = radiance;
            light.number = number;
            best = strength;
        } else {
            light.others += radiance;
        }
    }
    return light;
}

// Radiance that one lamp causes towards the camera.
fn lamp_radiance(
    number: u32, surface: ptr<function, SurfaceMaterial>, at: vec3f, normal: vec3f, view: vec3f, mirror: f32,
) -> vec3f {
    let row = lamps[1].z + number * 3u;
    let to_lamp = bitcast<vec3f>(lamps[row].xyz) - at;
    let kind = lamps[row].w;
    let axis = bitcast<vec4f>(lamps[row + 1u]);
    let square = max(dot(to_lamp, to_lamp), 0.01);
    let direction = to_lamp * (1.0 / sqrt(square));
    let facing = dot(normal, direction);
    let wrap = (*surface).wrap * 0.22;
    if (max(facing, wrap) <= 0.0 || square >= axis.w * axis.w) {
        return vec3f(0.0);
    }
    let incident = max(facing, 0.0);
    let reach2 = axis.w * axis.w;
    let near = 1.0 - square * square / (reach2 * reach2);
    let irradiance = near * near * lamp_profile(kind, axis.xyz, direction) / square;
    let between = direction - view;
    let half_way = between * (1.0 / sqrt(dot(between, between)));
    // Trowbridge and Reitz's distribution of normals, with the visibility of Kelemen 2001.
    let rough = (*surface).roughness;
    let a = max(rough * rough, 0.02);
    let a2 = a * a;
    let along = max(dot(normal, half_way), 0.0);
    let below = along * (along * (a2 - 1.0)) + 1.0;
    let grazing = max(dot(direction, half_way), 0.1);
    let low = 1.0 - grazing;
    let fifth = low * low * (low * low) * low;
    let specular = (*surface).specular;
    let clear = 1.0 - rough;
    let fresnel = select(0.0, specular + (1.0 - specular) * fifth * clear * clear, specular > 0.0);
    let spot = min(a2 * fresnel / (below * below * grazing * grazing * 4.0) * incident, 12.0);
    let diffuse = max(facing, wrap) * (1.0 - mirror);
    return bitcast<vec3f>(lamps[row + 2u].xyz) * ((*surface).albedo * diffuse + spot) * irradiance;
}

// Radiant intensity over that along the axis; `direction` leads to the lamp.
fn lamp_profile(kind: u32, axis: vec3f, direction: vec3f) -> f32 {
    let along = -dot(direction, axis);
    if (kind == STREET) {
        return smoothly(0.15, 0.5, along) * 1.2 / (along * along + 0.2);
    }
    if (kind == DIFFUSE) {
        return max(along, 0.0);
    }
    if (along <= 0.02) {
        return 0.0;
    }
    let up = (-direction.z - along * axis.z) / along;
    let square = 1.0 / (along * along) - 1.0;
    let aside = max(square - up * up, 0.0);
    let off = up + 0.03;
    let beam = 1.0 / (aside * 9.0 + 1.0) / (off * off * 25.0 + 1.0);
    return beam * select(1.0, smoothly(0.03, -0.02, up), kind == LOW_BEAM);
}

// Whether the light of a lamp reaches a point.
fn is_reached(number: u32, point: vec3f) -> bool {
    let position = bitcast<vec3f>(lamps[lamps[1].z + number * 3u].xyz);
    return closest(Ray(position, point - position), 0.999, true).triangle == NONE;
}
