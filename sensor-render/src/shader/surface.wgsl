// The colour of what is seen: the twin of shade.rs.

const LIFT = 0.01;

fn color_of(ray: Ray, hit: Hit, pixel: f32) -> u32 {
    let stretch = length(ray.direction);
    let view = ray.direction * (1.0 / stretch);
    if (hit.triangle == NONE) {
        return develop(sky_of(view));
    }
    let at = ray.origin + ray.direction * hit.t;
    let surface = surface_of(view, hit, at, pixel * hit.t);
    return develop(mix(surface, frame.haze.xyz, veil(hit.t * stretch)));
}

fn surface_of(view: vec3f, hit: Hit, at: vec3f, pixel: f32) -> vec3f {
    let normal = normal_of(hit, view);
    let cosine = -dot(normal, view);
    let long = pixel / max(cosine, 0.06);
    var coat = coat_of(hit, at);
    roughen(&coat, long);
    if (coat.pattern != 0u) {
        draw(&coat, sqrt(pixel * long));
    }
    wet(&coat, at, normal);

    let facing = dot(normal, frame.sun.xyz);
    var open = facing > 0.0;
    if (open && frame.sun.w > 0.0) {
        open = closest(Ray(at + normal * LIFT, frame.sun.xyz), FAR_AWAY, true).triangle == NONE;
    }
    let direct = max(select(0.0, max(facing, 0.0), open), coat.wrap * 0.22);
    let scattered = coat.albedo * (frame.sun_color.xyz * direct + ambient(normal.z));

    let low = 1.0 - clamp(cosine, 0.0, 1.0);
    let fifth = low * low * (low * low) * low;
    let clear = 1.0 - coat.rough;
    let mirror =
        select(0.0, coat.shine + (1.0 - coat.shine) * fifth * clear * clear, coat.shine > 0.0);
    let r = view + normal * (cosine * 2.0);
    let seen_in_it = mix(mirrored(r), ambient(normal.z), coat.rough);
    let spread = coat.rough * coat.rough + 0.004;
    let lobe = spread / (1.0 - dot(r, frame.sun.xyz) + spread);
    let spot = select(0.0, min(lobe * lobe * 0.16 / spread, 16.0), open);
    return mix(scattered, seen_in_it + frame.sun_color.xyz * spot, mirror) + coat.glow;
}

// Rain darkens what it wets, and stands in puddles on level ground.
fn wet(coat: ptr<function, Coat>, at: vec3f, normal: vec3f) {
    let damp = frame.ground.w;
    let puddles = frame.air.y;
    let upward = max(normal.z, 0.0);
    (*coat).albedo *= 1.0 - 0.45 * (0.3 + 0.7 * upward) * damp;
    let film = upward * damp;
    (*coat).shine = max((*coat).shine, film * 0.05);
    (*coat).rough = mix((*coat).rough, 0.25, film);
    if (puddles > 0.0 && normal.z > 0.995) {
        let begin = 1.0 - 0.75 * puddles;
        let pool = smoothly(begin, begin + 0.08, noise_at(at.x * 0.3, at.y * 0.3, 11u));
        (*coat).albedo *= 1.0 - 0.5 * pool;
        (*coat).shine = mix((*coat).shine, 0.06, pool);
        (*coat).rough = mix((*coat).rough, 0.02, pool);
    }
}
