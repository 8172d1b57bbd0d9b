// Shading: colours of surfaces and sky. Twin of shade.rs.

const LIFT = 0.01;

fn color_of(ray: Ray, hit: Hit, pixel: f32) -> u32 {
    let stretch = length(ray.direction);
    let view = ray.direction * (1.0 / stretch);
    if (hit.triangle == NONE) {
        return tone_map(sky_of(view));
    }
    let at = ray.origin + ray.direction * hit.t;
    let surface = surface_of(view, hit, at, pixel * hit.t);
    return tone_map(mix(surface, frame.haze.xyz, haze_share(hit.t * stretch)));
}

fn surface_of(view: vec3f, hit: Hit, at: vec3f, pixel: f32) -> vec3f {
    let normal = normal_of(hit, view);
    let cosine = -dot(normal, view);
    let long = pixel / max(cosine, 0.06);
    var surface = surface_material_of(hit, at);
    apply_grain(&surface, long);
    if (surface.pattern != 0u) {
        draw(&surface, sqrt(pixel * long));
    }
    apply_wetness(&surface, at, normal);

    let facing = dot(normal, frame.sun.xyz);
    var open = facing > 0.0;
    if (open && frame.sun.w > 0.0) {
        open = closest(Ray(at + normal * LIFT, frame.sun.xyz), FAR_AWAY, true).triangle == NONE;
    }
    let direct = max(select(0.0, max(facing, 0.0), open), surface.wrap * 0.22);
    let scattered = surface.albedo * (frame.sun_color.xyz * direct + ambient(normal.z));

    let low = 1.0 - clamp(cosine, 0.0, 1.0);
    let fifth = low * low * (low * low) * low;
    let clear = 1.0 - surface.roughness;
    let mirror =
        select(0.0, surface.specular + (1.0 - surface.specular) * fifth * clear * clear, surface.specular > 0.0);
    let r = view + normal * (cosine * 2.0);
    let reflected = mix(reflection(r), ambient(normal.z), surface.roughness);
    let spread = surface.roughness * surface.roughness + 0.004;
    let lobe = spread / (1.0 - dot(r, frame.sun.xyz) + spread);
    let spot = select(0.0, min(lobe * lobe * 0.16 / spread, 16.0), open);
    return mix(scattered, reflected + frame.sun_color.xyz * spot, mirror) + surface.emission;
}

// Applies rain: wet surfaces are darker and glossier, and level ground has puddles.
fn apply_wetness(surface: ptr<function, SurfaceMaterial>, at: vec3f, normal: vec3f) {
    let damp = frame.ground.w;
    let puddles = frame.air.y;
    let upward = max(normal.z, 0.0);
    (*surface).albedo *= 1.0 - 0.45 * (0.3 + 0.7 * upward) * damp;
    let film = upward * damp;
    (*surface).specular = max((*surface).specular, film * 0.05);
    (*surface).roughness = mix((*surface).roughness, 0.25, film);
    if (puddles > 0.0 && normal.z > 0.995) {
        let begin = 1.0 - 0.75 * puddles;
        let pool = smoothly(begin, begin + 0.08, noise_at(at.x * 0.3, at.y * 0.3, 11u));
        (*surface).albedo *= 1.0 - 0.5 * pool;
        (*surface).specular = mix((*surface).specular, 0.06, pool);
        (*surface).roughness = mix((*surface).roughness, 0.02, pool);
    }
}
