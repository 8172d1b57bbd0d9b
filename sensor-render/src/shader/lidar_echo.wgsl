// Echoes of pulses with a width, of fog, of rain and of spray. Twin of lidar_echo.rs and lidar_spray.rs.

const SUB_RAYS = 7u;
const ECHO_M = 0.75;
const BLIND_M = 1.0;
const TAG_OTHER = 22u;
const CLUMP_REFLECTIVITY = 0.08355;
const HALVINGS = 21u;

// What one ray of a beam met.
struct Met {
    t: f32,
    reflectivity: f32,
    cosine: f32,
    id: u32,
    tag: u32,
}

struct Echo {
    distance: f32,
    // Received power; 0: none.
    power: f32,
    reflectivity: f32,
    cosine: f32,
    id: u32,
    tag: u32,
}

// The echoes of one pulse that count.
struct BestEchoes {
    strongest: Echo,
    second: Echo,
    last: Echo,
}

// What a beam met, in ascending order of distance; in front of everything else, since variables of a
// function would be zeroed at every call.
var<private> met: array<Met, 7>;

const NO_ECHO = Echo(0.0, 0.0, 0.0, 0.0, 0u, 0u);

fn sub_ray(azimuth: vec2f, elevation: vec2f, ray: u32, ring: f32) -> vec3f {
    let axis = vec3f(elevation.x * azimuth.x, elevation.x * azimuth.y, elevation.y);
    if (ray == 0u) {
        return axis;
    }
    var across = array<vec2f, 6>(
        vec2f(1.0, 0.0), vec2f(0.5, 0.8660254), vec2f(-0.5, 0.8660254),
        vec2f(-1.0, 0.0), vec2f(-0.5, -0.8660254), vec2f(0.5, -0.8660254),
    );
    let at = across[ray - 1u];
    let left = vec3f(-azimuth.y, azimuth.x, 0.0);
    let up = vec3f(-elevation.y * azimuth.x, -elevation.y * azimuth.y, elevation.x);
    let direction = axis + (left * at.x + up * at.y) * ring;
    return direction * (1.0 / sqrt(dot(direction, direction)));
}

// Inserts what a ray met into the first `count` of them.
fn insert_met(one: Met, count: u32) {
    var at = count;
    loop {
        if (at == 0u) {
            break;
        }
        if (met[at - 1u].t <= one.t) {
            break;
        }
        met[at] = met[at - 1u];
        at--;
    }
    met[at] = one;
}

fn consider(echo: Echo, least_power: f32, best: ptr<function, BestEchoes>) {
    if (echo.power < least_power) {
        return;
    }
    if (echo.power > (*best).strongest.power) {
        (*best).second = (*best).strongest;
        (*best).strongest = echo;
    } else if (echo.power > (*best).second.power) {
        (*best).second = echo;
    }
    if (echo.distance > (*best).last.distance) {
        (*best).last = echo;
    }
}

// Optical depth of spray along a beam.
fn depth_in_spray(index: u32, axis: Ray, distance: f32) -> f32 {
    var sum = 0.0;
    for (var number = 0u; number < lidars[index].puff_count; number++) {
        sum += optical_depth(lidars[index].puffs[number], axis, distance);
    }
    return sum;
}

// Distance of the first clump of spray nearer than `nearest`; 0: there is none.
fn first_clump(index: u32, axis: Ray, nearest: f32, start: u32) -> f32 {
    var first = 0.0;
    var end = nearest;
    for (var number = 0u; number < lidars[index].puff_count; number++) {
        let puff = lidars[index].puffs[number];
        let depth = -log((f32(mixed(start + 9u + number) >> 8u) + 0.5) * (1.0 / 16777216.0));
        if (optical_depth(puff, axis, end) <= depth) {
            continue;
        }
        var low = 0.0;
        var high = end;
        for (var halving = 0u; halving < HALVINGS; halving++) {
            let middle = 0.5 * (low + high);
            if (optical_depth(puff, axis, middle) <= depth) {
                low = middle;
            } else {
                high = middle;
            }
        }
        end = high;
        first = high;
    }
    return first;
}

// Echo of the surfaces met from `first` to before `end`.
fn echo_of_surface(index: u32, axis: Ray, first: u32, end: u32) -> Echo {
    var sum = 0.0;
    var moment = 0.0;
    var brightest = met[first];
    for (var at = first; at < end; at++) {
        let one = met[at];
        sum += one.reflectivity;
        moment += one.reflectivity * one.t;
        if (one.reflectivity > brightest.reflectivity) {
            brightest = one;
        }
    }
    var distance = met[first].t;
    if (end - first > 1u && sum != 0.0) {
        distance = moment / sum;
    }
    let in_spray = depth_in_spray(index, axis, distance);
    let through = exp(-2.0 * (lidars[index].extinction * distance + in_spray));
    let reflectivity = sum * (1.0 / f32(lidars[index].rays)) * through;
    return Echo(
        distance, reflectivity / (distance * distance), reflectivity, brightest.cosine,
        brightest.id, brightest.tag,
    );
}

fn echo_of_air(distance: f32, power: f32) -> Echo {
    return Echo(distance, power, power * distance * distance, 1.0, 0u, TAG_OTHER);
}

// Strongest echo and the last one of a beam, or the second strongest if the last is the strongest.
fn echoes_of(index: u32, beam: u32, axis: Ray, count: u32) -> array<Echo, 2> {
    let start = mixed(lidars[index].seed ^ beam);
    if (f32(mixed(start + 1u) >> 8u) * (1.0 / 16777216.0) < lidars[index].z_axis.w) {
        return array<Echo, 2>(NO_ECHO, NO_ECHO);
    }
    let least_power = lidars[index].least_power;
    var best = BestEchoes(NO_ECHO, NO_ECHO, NO_ECHO);
    var first = 0u;
    for (var end = 1u; end <= count; end++) {
        var ends = end == count;
        if (!ends) {
            ends = met[end].t - met[end - 1u].t > ECHO_M;
        }
        if (ends) {
            consider(echo_of_surface(index, axis, first, end), least_power, &best);
            first = end;
        }
    }
    var nearest = lidars[index].origin.w;
    if (count > 0u) {
        nearest = met[0].t;
    }
    if (lidars[index].fog_power > 0.0 && lidars[index].fog_m < nearest) {
        consider(echo_of_air(lidars[index].fog_m, lidars[index].fog_power), least_power, &best);
    }
    if (lidars[index].rain > 0.0) {
        let uniform_number = (f32(mixed(start + 6u) >> 8u) + 0.5) * (1.0 / 16777216.0);
        let power = pow(lidars[index].rain / -log(uniform_number), 4.0 / 3.0);
        let random = normal_number(mixed(start + 7u), mixed(start + 8u));
        let root = 1.0 - 1.0 / 22.5 + random * (1.0 / (3.0 * 1.5811388));
        let gamma = 2.5 * root * root * root;
        let distance = sqrt(gamma / (lidars[index].drop_scale * sqrt(power)));
        if (distance >= BLIND_M && distance < nearest) {
            consider(echo_of_air(distance, power), least_power, &best);
        }
    }
    let clump = first_clump(index, axis, nearest, start);
    if (clump >= BLIND_M) {
        let through = exp(-2.0 * lidars[index].extinction * clump);
        consider(echo_of_air(clump, CLUMP_REFLECTIVITY * through / (clump * clump)), least_power, &best);
    }
    if (best.last.distance == best.strongest.distance) {
        best.last = best.second;
    }
    return array<Echo, 2>(best.strongest, best.last);
}

// Distance and fourth number of the point of an echo, from two random words; 0: there is none.
fn received(index: u32, echo: Echo, b: u32, c: u32) -> vec2f {
    if (echo.power <= 0.0) {
        return vec2f(0.0);
    }
    let attenuation = lidars[index].x_axis.w;
    var intensity = echo.cosine;
    if (attenuation >= 0.0) {
        intensity = echo.reflectivity * exp(-attenuation * echo.distance);
    }
    let distance = echo.distance + normal_number(b, c) * lidars[index].y_axis.w;
    return vec2f(distance, clamp(intensity, 1e-6, 1.0));
}
