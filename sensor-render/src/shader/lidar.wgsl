// Lidars: one thread per ray, all lidars in one dispatch. Twin of cpu/lidar.rs.

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

@compute @workgroup_size(64)
fn trace_lidars(@builtin(workgroup_id) group_at: vec3u, @builtin(local_invocation_id) thread: vec3u) {
    let group = group_number(group_at);
    if (group >= frame.groups.y) {
        return;
    }
    let index = lidar_of(group);
    let channels = lidars[index].channels;
    let beam = (group - lidars[index].first_group) * 64u + thread.x;
    if (beam >= channels * lidars[index].columns) {
        return;
    }
    let azimuth = circles[lidars[index].azimuths + beam / channels];
    let elevation = circles[lidars[index].elevations + beam % channels];
    let in_sensor = vec3f(elevation.x * azimuth.x, elevation.x * azimuth.y, elevation.y);
    let direction = lidars[index].x_axis.xyz * in_sensor.x + lidars[index].y_axis.xyz * in_sensor.y
        + lidars[index].z_axis.xyz * in_sensor.z;
    var hit = no_hit(0.0);
    if (azimuth.x != 0.0 || azimuth.y != 0.0) {
        hit = closest(Ray(lidars[index].origin.xyz, direction), lidars[index].origin.w, false);
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
    if (lidars[index].points != NONE) {
        let at = lidars[index].points + beam * 4u;
        bytes_out[at] = bitcast<u32>(point.x);
        bytes_out[at + 1u] = bitcast<u32>(point.y);
        bytes_out[at + 2u] = bitcast<u32>(point.z);
        bytes_out[at + 3u] = bitcast<u32>(point.w);
    }
    if (lidars[index].labels != NONE) {
        let at = lidars[index].labels + beam * 2u;
        bytes_out[at] = label.x;
        bytes_out[at + 1u] = label.y;
    }
}
