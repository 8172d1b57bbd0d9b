// Sky, atmosphere and tone mapping. Twin of sky.rs.

fn gradient(z: f32) -> vec3f {
    let low = 1.0 - clamp(z, 0.0, 1.0);
    let square = low * low;
    let share = vec3f(square * square, square * low, square);
    return mix(frame.zenith.xyz, frame.horizon.xyz, share);
}

// See sky.rs.
const GLOW = 0.2;
const GLOW_PER = 5.0;

// Radiance of the sky with clouds and haze; if it is not mirrored, with the sun, and clouds have fine edges and are
// lit from the side.
fn sky_of(view: vec3f, is_mirrored: bool) -> vec3f {
    var color = gradient(view.z);
    let apart = 1.0 - dot(view, frame.sun.xyz);
    let wide = 1.0 + GLOW_PER * apart;
    let disc = select(smoothly(0.00011, 0.00006, apart), 0.0, is_mirrored);
    let glow = GLOW / (wide * wide) + disc * 24.0;
    color += frame.sun_color.xyz * glow * frame.sun_color.w;
    let height = max(view.z, 0.0);
    let cover = frame.zenith.w;
    if (cover > 0.0) {
        let scale = 1.1 / (height + 0.08);
        let at = view.xy * scale + vec2f(frame.air.w * 0.01, 0.0);
        var sum = cloud(at);
        // A cloud that gets thinner towards the sun shows its bright side.
        var slope = 0.0;
        if (SMOOTH && !is_mirrored) {
            sum += (noise_at(at.x * 11.3, at.y * 11.3, 9u) - 0.5) * 0.12;
            slope = sum - cloud(at + frame.sun.xy * 0.2);
        }
        let lit = clamp(0.75 + slope * 1.8, 0.3, 1.5);
        let begin = 0.76 - 0.76 * cover;
        let thick = smoothly(begin, begin + 0.2, sum);
        let fade = smoothly(0.0, 0.18, view.z);
        // A closed layer of clouds shows where it is thick.
        let relief = max(0.965 + (0.45 - sum) * (0.3 + 1.5 * cover * cover), 0.3);
        let white = (frame.horizon.xyz * 0.75 + frame.sun_color.xyz * (lit * 0.3)) * relief;
        color = mix(color, white, thick * fade * 0.9);
    }
    return mix(color, frame.haze.xyz, haze_share(500.0 / (1.0 + 9.0 * height)));
}

// Density of clouds at a place of their layer, from 0 to 1.
fn cloud(place: vec2f) -> f32 {
    var at = place;
    var sum = noise_at(at.x, at.y, 7u) * 0.55;
    at *= 2.3;
    sum += noise_at(at.x, at.y, 7u) * 0.3;
    at *= 2.1;
    return sum + noise_at(at.x, at.y, 7u) * 0.15;
}

// Share of radiance that the atmosphere replaces at a distance in metres.
fn haze_share(distance: f32) -> f32 {
    let x = max(distance - frame.haze.w, 0.0) * frame.air.x;
    return 1.0 - 1.0 / (1.0 + x * (1.0 + x * (0.5 + 0.2 * x)));
}

const MUTED = 0.08;

// Converts radiance to linear display light, from 0 to 1.
fn tone_map(radiance: vec3f) -> vec3f {
    let exposed = radiance * frame.air.z;
    let c = max(exposed, vec3f(0.0));
    // HABLE in tone_curve.rs.
    return min(c * (3.7591983 * c + 0.039666866) / (c * (3.52 * c + 0.8) + 0.18), vec3f(1.0));
}

// Moves values of a pixel towards their luma.
fn mute(values: vec3f, share: f32) -> vec3f {
    return mix(values, vec3f(dot(values, vec3f(0.2126, 0.7152, 0.0722))), share);
}

// Converts linear display light to bytes with muted colours.
fn encode(film: vec3f) -> u32 {
    let a = sqrt(film);
    let b = sqrt(a);
    let curve = 0.6620027 * a + 0.68412206 * b - 0.3235836 * sqrt(b) - 0.022541147 * film;
    let values = mute(clamp(curve, vec3f(0.0), vec3f(1.0)), MUTED);
    let bytes = vec3u(values * 255.0 + 0.5);
    return bytes.x | bytes.y << 8u | bytes.z << 16u | 0xff000000u;
}

// Environment that a mirror reflects along `r`: the sky above, dim buildings and ground below.
fn reflection(r: vec3f) -> vec3f {
    let houses = frame.horizon.xyz * 0.28 + frame.ground.xyz * 0.5;
    let city = mix(frame.ground.xyz, houses, smoothly(-0.25, 0.0, r.z));
    return mix(city, gradient(r.z), smoothly(0.02, 0.42, r.z));
}

// Environment that the flakes of a paint reflect about a direction with the vertical component `z`.
fn blurred_reflection(z: f32) -> vec3f {
    let low = 1.0 - clamp(z, 0.0, 1.0);
    let sky = mix(frame.zenith.xyz, frame.horizon.xyz, low * low);
    return mix(frame.ground.xyz, sky, smoothly(-0.4, 0.5, z));
}

// Ambient light of the sky and the ground on a surface whose normal has vertical component `z`.
fn ambient(z: f32) -> vec3f {
    let sky = frame.zenith.xyz * 0.3 + frame.horizon.xyz * 0.52;
    return mix(frame.ground.xyz, sky, 0.5 * z + 0.5);
}
