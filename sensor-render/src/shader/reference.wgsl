// Intersection of one ray at a time. Twin of reference.rs.

const EDGE_SLACK = 1e-6;
const T_MIN = 1e-3;
const FAR_AWAY = 3e38;

struct Ray {
    origin: vec3f,
    direction: vec3f,
}

struct Hit {
    t: f32,
    triangle: u32,
    instance: u32,
    u: f32,
    v: f32,
}

fn no_hit(t: f32) -> Hit {
    return Hit(t, NONE, NONE, 0.0, 0.0);
}

fn inverse_of(direction: vec3f) -> vec3f {
    let tiny = select(vec3f(1e-12), vec3f(-1e-12), direction < vec3f(0.0));
    return 1.0 / select(direction, tiny, abs(direction) < vec3f(1e-12));
}

// Returns the ray parameters at which the ray enters and leaves the box, between 0 and t_max; it meets the box
// if the first is at most the second. `offset` is -origin * inverse, which makes one operation of a difference and
// a product. The numbers are compared as integers, of which devices compare three at once: that is the order of
// floats unless both are negative, and a box with a negative end is missed in any order.
fn enter(low: vec3f, high: vec3f, offset: vec3f, inverse: vec3f, t_max: f32) -> vec2i {
    let a = bitcast<vec3i>(fma(low, inverse, offset));
    let b = bitcast<vec3i>(fma(high, inverse, offset));
    let first = min(a, b);
    let last = max(a, b);
    return vec2i(
        max(max(max(first.x, first.y), first.z), 0),
        min(min(min(last.x, last.y), last.z), bitcast<i32>(t_max)));
}

fn meet(index: u32, ray: Ray, instance: u32, hit: ptr<function, Hit>) {
    let corner = triangles[index * 3u].xyz;
    let edge1 = triangles[index * 3u + 1u].xyz;
    let edge2 = triangles[index * 3u + 2u].xyz;
    let across = cross(ray.direction, edge2);
    let inverse = 1.0 / dot(edge1, across);
    let from_corner = ray.origin - corner;
    let u = dot(from_corner, across) * inverse;
    let along = cross(from_corner, edge1);
    let v = dot(ray.direction, along) * inverse;
    let t = dot(edge2, along) * inverse;
    let inside = u >= -EDGE_SLACK && v >= -EDGE_SLACK && u + v <= 1.0 + EDGE_SLACK;
    if (inside && t > T_MIN && t < (*hit).t) {
        *hit = Hit(t, index, instance, u, v);
    }
}

// Links to visit: those of the top level, and above them those of the bottom level that is being
// traversed. One stack serves both, outside of all functions, since a variable of a function would
// be zeroed at every call. Its length is DEPTH_MAX + TOP_DEPTH_MAX of bvh.rs.
var<private> stack: array<u32, 51>;

// Traverses a bottom-level hierarchy with the stack from `floor` on; with `any`, stops at the first
// triangle that is hit.
fn traverse_blas(
    root: u32, ray: Ray, instance: u32, any: bool, floor: u32, hit: ptr<function, Hit>
) {
    let inverse = inverse_of(ray.direction);
    let offset = -ray.origin * inverse;
    var height = floor;
    var link = root;
    loop {
        if ((link & LEAF) != 0u) {
            let first = link & 0x3ffffffu;
            let end = first + ((link >> 26u) & 31u);
            for (var index = first; index < end; index++) {
                meet(index, ray, instance, hit);
            }
            if (any && (*hit).triangle != NONE) {
                return;
            }
        } else {
            let a = nodes[link * 4u];
            let b = nodes[link * 4u + 1u];
            let c = nodes[link * 4u + 2u];
            let d = nodes[link * 4u + 3u];
            let range0 = enter(a.xyz, b.xyz, offset, inverse, (*hit).t);
            let range1 = enter(c.xyz, d.xyz, offset, inverse, (*hit).t);
            let meets0 = range0.x <= range0.y;
            let meets1 = range1.x <= range1.y;
            let child0 = bitcast<u32>(a.w);
            let child1 = bitcast<u32>(b.w);
            if (meets0 && meets1) {
                let straight = range0.x <= range1.x;
                stack[height] = select(child0, child1, straight);
                height++;
                link = select(child1, child0, straight);
                continue;
            }
            if (meets0) {
                link = child0;
                continue;
            }
            if (meets1) {
                link = child1;
                continue;
            }
        }
        if (height == floor) {
            return;
        }
        height--;
        link = stack[height];
    }
}

fn to_instance_space(ray: Ray, index: u32) -> Ray {
    let rows = instances[index].actor_from_world;
    let origin = vec4f(ray.origin, 1.0);
    let direction = vec4f(ray.direction, 0.0);
    return Ray(
        vec3f(dot(rows[0], origin), dot(rows[1], origin), dot(rows[2], origin)),
        vec3f(dot(rows[0], direction), dot(rows[1], direction), dot(rows[2], direction)),
    );
}

// Returns the first intersection of a ray before t_max; with `any`, an arbitrary one.
fn closest(ray: Ray, t_max: f32, any: bool) -> Hit {
    var hit = no_hit(t_max);
    traverse_blas(frame.roots.x, ray, NONE, any, 0u, &hit);
    if (any && hit.triangle != NONE) {
        return hit;
    }
    let inverse = inverse_of(ray.direction);
    let offset = -ray.origin * inverse;
    var height = 0u;
    var link = select(frame.roots.y, top_root, HAS_EFFECTS);
    loop {
        if ((link & LEAF) != 0u) {
            let first = link & 0x3ffffffu;
            let end = first + ((link >> 26u) & 31u);
            for (var index = first; index < end; index++) {
                let seen = to_instance_space(ray, index);
                traverse_blas(instances[index].root, seen, index, any, height, &hit);
                if (any && hit.triangle != NONE) {
                    return hit;
                }
            }
        } else {
            let a = top_nodes[link * 4u];
            let b = top_nodes[link * 4u + 1u];
            let c = top_nodes[link * 4u + 2u];
            let d = top_nodes[link * 4u + 3u];
            let range0 = enter(a.xyz, b.xyz, offset, inverse, hit.t);
            let range1 = enter(c.xyz, d.xyz, offset, inverse, hit.t);
            let meets0 = range0.x <= range0.y;
            let meets1 = range1.x <= range1.y;
            let child0 = bitcast<u32>(a.w);
            let child1 = bitcast<u32>(b.w);
            if (meets0 && meets1) {
                let straight = range0.x <= range1.x;
                stack[height] = select(child0, child1, straight);
                height++;
                link = select(child1, child0, straight);
                continue;
            }
            if (meets0) {
                link = child0;
                continue;
            }
            if (meets1) {
                link = child1;
                continue;
            }
        }
        if (height == 0u) {
            return hit;
        }
        height--;
        link = stack[height];
    }
    return hit;
}

// Tag of the surface that was hit.
fn tag_of(hit: Hit) -> u32 {
    return bitcast<u32>(triangles[hit.triangle * 3u].w) & 255u;
}

fn material_of(hit: Hit) -> u32 {
    return (bitcast<u32>(triangles[hit.triangle * 3u].w) >> 8u) & 255u;
}

// Instance id of the surface that was hit.
fn id_of(hit: Hit) -> u32 {
    if (hit.instance != NONE) {
        return instances[hit.instance].id;
    }
    return 0x80000000u | bitcast<u32>(triangles[hit.triangle * 3u + 1u].w);
}

// Normal in world space, facing the origin of the ray.
fn normal_of(hit: Hit, direction: vec3f) -> vec3f {
    let edge1 = triangles[hit.triangle * 3u + 1u].xyz;
    let edge2 = triangles[hit.triangle * 3u + 2u].xyz;
    var normal = cross(edge1, edge2);
    if (hit.instance != NONE) {
        let rows = instances[hit.instance].actor_from_world;
        normal = normal.x * rows[0].xyz + normal.y * rows[1].xyz + normal.z * rows[2].xyz;
    }
    normal *= inverseSqrt(max(dot(normal, normal), 1e-30));
    return select(normal, -normal, dot(normal, direction) > 0.0);
}
