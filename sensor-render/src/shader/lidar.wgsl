// Lidars: one thread per beam, all lidars in one dispatch. Twin of cpu/lidar.rs.

// Whether lidars with echoes are traced, or those without.
override HAS_ECHOES: bool = false;

fn lidar_of(group: u32) -> u32 {
    var low = 0u;
    var high = frame.roots.w - 1u;
    while (low < high) {
        let middle = (low + high + 1u) / 2u;
        if (lidars[middle].first_group <= group) {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    return low;
}

fn write_point(points: u32, labels: u32, beam: u32, point: vec4f, label: vec2u) {
    if (points != NONE) {
        let at = points + beam * 4u;
        put(0u, at, bitcast<u32>(point.x));
        put(0u, at + 1u, bitcast<u32>(point.y));
        put(0u, at + 2u, bitcast<u32>(point.z));
        put(0u, at + 3u, bitcast<u32>(point.w));
    }
    if (labels != NONE) {
        let at = labels + beam * 2u;
        put(0u, at, label.x);
        put(0u, at + 1u, label.y);
    }
}

// Traces all rays of a beam and writes its returns.
fn trace_echoes(index: u32, beam: u32, azimuth: vec2f, elevation: vec2f, origin: vec3f, axes: mat3x3f) {
    let in_sensor = sub_ray(azimuth, elevation, 0u, 0.0);
    var returns = array<Echo, 2>(NO_ECHO, NO_ECHO);
    if (azimuth.x != 0.0 || azimuth.y != 0.0) {
        var count = 0u;
        for (var ray = 0u; ray < lidars[index].rays; ray++) {
            let direction = axes * sub_ray(azimuth, elevation, ray, lidars[index].ring);
            let hit = closest(Ray(origin, direction), lidars[index].origin.w, false);
            if (hit.triangle != NONE) {
                let cosine = abs(dot(normal_of(hit, direction), direction));
                let towards = reflected(cosine, material_of(hit));
                insert_met(Met(hit.t, towards.x * towards.y, cosine, id_of(hit), tag_of(hit)), count);
                count++;
            }
        }
        returns = echoes_of(index, beam, Ray(origin, axes * in_sensor), count);
    }
    let start = mixed(lidars[index].seed ^ beam);
    let strongest = received(index, returns[0], mixed(start + 2u), mixed(start + 3u));
    let last = received(index, returns[1], mixed(start + 4u), mixed(start + 5u));
    write_point(
        lidars[index].points, lidars[index].labels, beam, vec4f(in_sensor * strongest.x, strongest.y),
        vec2u(returns[0].id, returns[0].tag),
    );
    write_point(
        lidars[index].last_points, lidars[index].last_labels, beam, vec4f(in_sensor * last.x, last.y),
        vec2u(returns[1].id, returns[1].tag),
    );
}

@compute @workgroup_size(64)
fn trace_lidars(@builtin(workgroup_id) group_at: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let group = group_number(group_at);
    if (group >= frame.groups.y) {
        return;
    }
    let index = lidar_of(group);
    let channels = lidars[index].channels;
    let beam = (group - lidars[index].first_group) * 64u + thread.x;
    if (beam >= channels * lidars[index].columns || (lidars[index].rays > 0u) != HAS_ECHOES) {
        return;
    }
    let azimuth = circles[lidars[index].azimuths + beam / lidars[index].span];
    let elevation = circles[lidars[index].elevations + beam % lidars[index].elevation_count];
    var origin = lidars[index].origin.xyz;
    var axes = mat3x3f(
        lidars[index].x_axis.xyz, lidars[index].y_axis.xyz, lidars[index].z_axis.xyz,
    );
    if (lidars[index].places != NONE) {
        let at = lidars[index].places + beam / channels * 6u;
        let a = circles[at];
        let b = circles[at + 1u];
        let c = circles[at + 2u];
        let d = circles[at + 3u];
        let e = circles[at + 4u];
        let f = circles[at + 5u];
        origin = vec3f(a, b.x);
        axes = mat3x3f(vec3f(b.y, c), vec3f(d, e.x), vec3f(e.y, f));
    }
    if (HAS_ECHOES) {
        trace_echoes(index, beam, azimuth, elevation, origin, axes);
        return;
    }
    let in_sensor = vec3f(elevation.x * azimuth.x, elevation.x * azimuth.y, elevation.y);
    let direction = axes[0] * in_sensor.x + axes[1] * in_sensor.y + axes[2] * in_sensor.z;
    var hit = no_hit(0.0);
    if (azimuth.x != 0.0 || azimuth.y != 0.0) {
        hit = closest(Ray(origin, direction), lidars[index].origin.w, false);
    }
    var point = vec4f(0.0);
    var label = vec2u(0u);
    if (hit.triangle != NONE) {
        let returned = lidar_return_of(index, beam, hit, direction);
        if (returned.y > 0.0) {
            point = vec4f(in_sensor * returned.x, returned.y);
            label = vec2u(id_of(hit), tag_of(hit));
        }
    }
    write_point(lidars[index].points, lidars[index].labels, beam, point, label);
}
