// The colour of what is seen: the twin of surface.rs.

fn color_of(ray: Ray, hit: Hit, pixel: f32) -> u32 {
    if (hit.triangle == NONE) {
        return 0xffdcdcdcu;
    }
    let light = abs(dot(normal_of(hit, ray.direction), vec3f(0.4, 0.3, 0.8)));
    let grey = u32(light * 200.0) + 30u;
    return grey | grey << 8u | grey << 16u | 0xff000000u;
}
