// Shading: colours of surfaces and sky. Twin of shade.rs.

const LIFT = 0.01;

// Roughness below which, and share of mirrored light above which, a reflection is traced.
const ROUGHNESS_MAX = 0.3;
const MIRROR_MIN = 0.05;

// See shade.rs.
const SOFT_FROM = 0.08;
const FILM = 0.4;
const SOFT_PER = 4.0;
const SOFT_MAX = 0.7;
const THROUGH_LEAF = vec3f(0.62, 0.70, 0.30);
const COAT_MIN = 0.03;
const COAT_PER_ALBEDO = 0.1;
const PIGMENT = 0.3;
const FLAKES = 7.5;
const FLAKES_SKY = 1.25;
const FLAKES_SPREAD = 0.13;
const SOLID = vec2f(0.32, 0.48);
const SPOT_LEAST = 0.0008;
const SPOT_MAX = 300.0;
const PANE = 0.5;
const PANES_MAX = 4u;
const CABIN = 0.14;
const CABIN_M = vec2f(0.06, 0.3);

const RIPPLES_PER_M = 14.0;

// See light.rs.
const OCCLUSION_REACH_M = 2.0;
const OCCLUSION_DARK_M = 0.5;
const OCCLUSION_FADE_M = vec2f(25.0, 40.0);

// Which cameras a pipeline renders: those with several rays per pixel, which trace reflections too, or
// the others.
override SMOOTH: bool = false;
// Whether any lamp shines.
override HAS_LAMPS: bool = true;

// Radiance towards the camera, divided by what rays to the sun, the sky and a lamp decide about.
struct Radiance {
    base: vec3f,
    // Diffuse light of the sky, if nothing near keeps it away.
    sky: vec3f,
    // By the sun, if it is not in shadow.
    sun: vec3f,
    // By the strongest lamp, if it is not in shadow, and its number.
    lamp: vec3f,
    lamp_number: u32,
}

fn radiance_of(ray: Ray, hit: Hit, pixel: f32) -> Radiance {
    let stretch = length(ray.direction);
    let view = ray.direction * (1.0 / stretch);
    if (hit.triangle == NONE) {
        return Radiance(sky_of(view, false), vec3f(0.0), vec3f(0.0), vec3f(0.0), NONE);
    }
    let at = ray.origin + ray.direction * hit.t;
    var radiance = surface_of(view, hit, at, pixel * hit.t);
    let haze = haze_share(hit.t * stretch);
    radiance.base = mix(radiance.base, frame.haze.xyz, haze);
    radiance.sky *= 1.0 - haze;
    radiance.sun *= 1.0 - haze;
    radiance.lamp *= 1.0 - haze;
    return radiance;
}

// Returns a radiance with the sun and the strongest lamp where they are not in shadow.
fn with_shadows(radiance: Radiance, ray: Ray, hit: Hit, of_pixel: vec4f, of_sky: vec3f) -> vec3f {
    if (hit.triangle == NONE) {
        return radiance.base;
    }
    let normal = normal_of(hit, ray.direction);
    var origin = ray.origin + ray.direction * hit.t + normal * LIFT;
    let facing = dot(normal, frame.sun.xyz);
    var open = facing > 0.0;
    var open_sky = 1.0;
    if (SMOOTH) {
        // Colours of leaves already have the darkness of their crown.
        if (!is_foliage(hit)) {
            open_sky = sky_share(of_sky, origin, normal, hit.t);
        } else if (facing < 0.0) {
            // Leaves are lit from behind, too.
            origin -= normal * (2.0 * LIFT);
            open = true;
        }
    }
    var color = radiance.base + radiance.sky * open_sky;
    if (open && frame.sun.w > 0.0) {
        let to_sun = frame.sun.xyz + frame.sun_radius.xyz * of_pixel.z
            + cross(frame.sun.xyz, frame.sun_radius.xyz) * of_pixel.w;
        open = closest(Ray(origin, to_sun), FAR_AWAY, true).triangle == NONE;
    }
    color += select(vec3f(0.0), radiance.sun, open);
    if (HAS_LAMPS && radiance.lamp_number != NONE && is_reached(radiance.lamp_number, origin)) {
        color += radiance.lamp;
    }
    return color;
}

// Returns the share of the light from a direction of the sky that reaches a point; 1 where it faces
// another direction or is far from the camera. Twin of occlusion.rs.
fn sky_share(of_sky: vec3f, origin: vec3f, normal: vec3f, t: f32) -> f32 {
    if (dot(normal, of_sky) <= 0.05 || t >= OCCLUSION_FADE_M.y) {
        return 1.0;
    }
    let near = closest(Ray(origin, of_sky), OCCLUSION_REACH_M, false).t - OCCLUSION_DARK_M;
    let open = max(near * (1.0 / (OCCLUSION_REACH_M - OCCLUSION_DARK_M)), 0.0);
    return mix(open, 1.0, smoothly(OCCLUSION_FADE_M.x, OCCLUSION_FADE_M.y, t));
}

fn surface_of(view: vec3f, hit: Hit, at: vec3f, pixel: f32) -> Radiance {
    let flat_normal = normal_of(hit, view);
    let normal = smooth_normal_of(hit, view, flat_normal);
    let cosine = -dot(normal, view);
    let long = pixel / max(cosine, 0.06);
    var surface = surface_material_of(hit, at);
    apply_grain(&surface, long);
    if (surface.pattern != 0u) {
        lay_bricks(&surface, sqrt(pixel * long));
        if (SMOOTH) {
            apply_wear(&surface, sqrt(pixel * long));
        }
        draw(&surface, sqrt(pixel * long));
        if (SMOOTH) {
            furnish(&surface, view, flat_normal);
        }
    }
    apply_wetness(&surface, at, normal, long);

    let low = 1.0 - clamp(cosine, 0.0, 1.0);
    let fifth = low * low * (low * low) * low;
    let clear = 1.0 - surface.roughness;
    let mirror =
        select(0.0, surface.specular + (1.0 - surface.specular) * fifth * clear * clear, surface.specular > 0.0);
    let r = view + normal * (cosine * 2.0);

    let facing = dot(normal, frame.sun.xyz);
    let around = surface.wrap * 0.22;
    let sky_light = ambient(normal.z);
    let shaded = surface.albedo * frame.sun_color.xyz * around;
    var mirrored = reflection(r);
    var behind = vec3f(0.0);
    let is_paint = material_of(hit) == CAR_PAINT;
    if (SMOOTH) {
        let coat = min(surface.albedo.y * COAT_PER_ALBEDO + COAT_MIN, MIRROR_MIN);
        let least = select(MIRROR_MIN, coat, is_paint);
        let has_mirror = surface.roughness < ROUGHNESS_MAX && mirror * clear > least;
        // The reflection, then what is behind a pane, in one loop: each call of `closest` is a copy of it.
        var step = select(1u, 0u, has_mirror);
        let end = select(1u, 1u + PANES_MAX, is_pane(hit));
        var begin = LIFT;
        var share = PANE;
        while (step < end) {
            let is_mirror = step == 0u;
            var ray = Ray(at + view * begin, view);
            if (is_mirror) {
                ray = Ray(at + flat_normal * LIFT, rippled(at, normal, r, long));
            }
            let seen = closest(ray, FAR_AWAY, false);
            let passes = !is_mirror && seen.triangle != NONE && step < PANES_MAX && is_pane(seen);
            if (passes) {
                begin += seen.t + LIFT;
                share *= PANE;
            } else {
                let color = glimpse(ray, seen, begin - LIFT + seen.t, select(id_of(hit), NONE, is_mirror));
                // No step where reflections are no longer traced.
                let soft = max(
                    clamp((surface.roughness - SOFT_FROM) * SOFT_PER, 0.0, SOFT_MAX)
                        * (1.0 - FILM * max(normal.z, 0.0)),
                    clamp((surface.roughness - (ROUGHNESS_MAX - 0.1)) * 10.0, 0.0, 1.0),
                );
                mirrored = select(mirrored, mix(color, mirrored, soft), is_mirror);
                behind = select(color * share, behind, is_mirror);
                step = select(end, step, is_mirror);
            }
            step++;
        }
    }
    let reflected = mix(mirrored, sky_light, surface.roughness);
    // What a rough surface reflects comes from all of the sky, as its diffuse light does.
    let is_rough = surface.roughness >= ROUGHNESS_MAX;
    let base = shaded * (1.0 - mirror) + reflected * select(mirror, 0.0, is_rough)
        + surface.emission + behind * (1.0 - mirror);
    var sky = surface.albedo * sky_light * (1.0 - mirror) + reflected * select(0.0, mirror, is_rough);

    var direct = surface.albedo * (max(facing, around) - around);
    if (SMOOTH && is_foliage(hit)) {
        direct += surface.albedo * THROUGH_LEAF * max(-facing, 0.0);
    }
    if (SMOOTH && is_paint) {
        let brightest = max(surface.albedo.x, max(surface.albedo.y, surface.albedo.z));
        let metal = smoothly(SOLID.y, SOLID.x, brightest);
        let pigment = mix(1.0, PIGMENT, metal);
        let lobe = FLAKES_SPREAD / (1.0 - dot(r, frame.sun.xyz) + FLAKES_SPREAD);
        let flakes = lobe * lobe * clamp(facing, 0.0, 1.0) * (FLAKES * metal);
        direct = direct * pigment + surface.albedo * flakes;
        sky = sky * pigment
            + surface.albedo * blurred_reflection(r.z) * (metal * FLAKES_SKY * (1.0 - mirror));
    }
    let spread = surface.roughness * surface.roughness + SPOT_LEAST;
    let lobe = spread / (1.0 - dot(r, frame.sun.xyz) + spread);
    let spot = min(lobe * lobe * 0.5 / spread, SPOT_MAX) * frame.sun_color.w;
    let sun = mix(direct, vec3f(spot), mirror) * frame.sun_color.xyz;

    if (!HAS_LAMPS) {
        return Radiance(base, sky, sun, vec3f(0.0), NONE);
    }
    let lamps = lamplight_of(&surface, at, normal, view, mirror);
    return Radiance(base + lamps.others, sky, sun, lamps.strongest, lamps.number);
}

fn is_foliage(hit: Hit) -> bool {
    let material = material_of(hit);
    return material == LEAVES || material == NEEDLES;
}

fn is_pane(hit: Hit) -> bool {
    return material_of(hit) == GLASS && tag_of(hit) != BUILDING;
}

// Radiance of a surface in the distance: its diffuse light, without shadows and patterns, and its emission;
// of the sky where there is none. A surface with the id `around` lies within a vehicle, `depth` metres behind a
// pane.
fn glimpse(ray: Ray, hit: Hit, depth: f32, around: u32) -> vec3f {
    if (hit.triangle == NONE) {
        return sky_of(ray.direction, true);
    }
    let surface = surface_material_of(hit, ray.origin + ray.direction * hit.t);
    let normal = normal_of(hit, ray.direction);
    let facing = max(dot(normal, frame.sun.xyz), 0.0) * 0.7;
    let arriving = frame.sun_color.xyz * facing + ambient(normal.z);
    let shade = mix(1.0, CABIN, smoothly(CABIN_M.x, CABIN_M.y, depth));
    let inside = select(1.0, shade, id_of(hit) == around);
    let color = surface.albedo * arriving * inside + surface.emission;
    return mix(color, frame.haze.xyz, haze_share(hit.t));
}

// Direction that is turned by the rings of rain drops on level water, where a pixel can resolve the rings.
fn rippled(at: vec3f, normal: vec3f, r: vec3f, pixel: f32) -> vec3f {
    let rain = frame.sun_radius.w;
    if (rain <= 0.0 || normal.z <= 0.995) {
        return r;
    }
    let place = at.xy * RIPPLES_PER_M + frame.air.w * 9.0;
    let strength = clamp(1.5 - pixel * RIPPLES_PER_M, 0.0, 1.0) * 0.16 * rain;
    let wave = vec2f(noise_at(place.x, place.y, 17u), noise_at(place.x, place.y, 18u)) - 0.5;
    return normalize(r + vec3f(wave * strength, 0.0));
}

// Normal between those of the corners of a triangle of an actor, towards the camera, unless the camera
// looked at its back; `flat_normal` is that of the triangle.
fn smooth_normal_of(hit: Hit, view: vec3f, flat_normal: vec3f) -> vec3f {
    if (hit.instance == NONE || hit.triangle < frame.town.x) {
        return flat_normal;
    }
    let words = corner_normals[hit.triangle - frame.town.x];
    var sum = unpacked(words.x);
    // A leaf has one normal.
    if (words.w == 0u) {
        sum = sum * (1.0 - hit.u - hit.v) + unpacked(words.y) * hit.u + unpacked(words.z) * hit.v;
    }
    let rows = instances[hit.instance].actor_from_world;
    var normal = normalize(sum.x * rows[0].xyz + sum.y * rows[1].xyz + sum.z * rows[2].xyz);
    normal = select(normal, -normal, dot(normal, flat_normal) < 0.0);
    return select(normal, flat_normal, dot(normal, view) >= 0.0);
}

// Unit vector of an octahedral form. Twin of `unpacked` in smooth.rs.
fn unpacked(word: u32) -> vec3f {
    let p = unpack2x16snorm(word);
    let z = 1.0 - abs(p.x) - abs(p.y);
    let fold = max(-z, 0.0);
    let x = p.x - select(fold, -fold, p.x < 0.0);
    let y = p.y - select(fold, -fold, p.y < 0.0);
    return normalize(vec3f(x, y, z));
}

// Applies rain: wet surfaces are darker, sealed ones also glossier, and sealed level ground has puddles. A
// pixel is `long` metres long on the surface.
fn apply_wetness(surface: ptr<function, SurfaceMaterial>, at: vec3f, normal: vec3f, long: f32) {
    let damp = frame.ground.w;
    let puddles = frame.air.y;
    let upward = max(normal.z, 0.0);
    (*surface).albedo *= 1.0 - 0.45 * (0.3 + 0.7 * upward) * damp;
    // Grass, leaves and soil hold no film of water.
    let sealed = (*surface).specular > 0.0;
    let film = select(0.0, upward * damp, sealed);
    (*surface).specular = max((*surface).specular, film * 0.05);
    (*surface).roughness = mix((*surface).roughness, 0.25, film);
    if (puddles > 0.0 && normal.z > 0.995 && sealed) {
        // Large hollows with uneven edges, across the lattices of roads.
        let p = vec2f(at.x * 0.8 + at.y * 0.6, at.y * 0.8 - at.x * 0.6);
        // Where a pixel resolves the finest ones; else their mean.
        let near = clamp(1.5 - long * 3.1, 0.0, 1.0);
        let low = noise_at(p.x * 0.19, p.y * 0.19, 11u) * 0.72
            + noise_at(p.x * 0.83, p.y * 0.83, 12u) * 0.2 + 0.04
            + (noise_at(p.x * 3.1, p.y * 3.1, 13u) - 0.5) * near * 0.05;
        // The hollows change by about a third per metre, and an edge is as wide as a pixel at least.
        let middle = 0.925 - 0.42 * puddles;
        let half = 0.035 + 0.17 * long;
        let pool = smoothly(middle - half, middle + half, low);
        (*surface).albedo *= 1.0 - 0.45 * pool;
        (*surface).specular = max((*surface).specular, pool * 0.02);
        (*surface).roughness = mix((*surface).roughness, 0.01, pool);
    }
}
