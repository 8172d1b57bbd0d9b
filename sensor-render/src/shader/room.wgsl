// Rooms behind the panes of buildings. Twin of room.rs.

const ROOM_ALBEDO_MAX = 0.09;

fn furnish(surface: ptr<function, SurfaceMaterial>, view: vec3f, facing: vec3f) {
    if (((*surface).pattern & ROOM) == 0u) {
        return;
    }
    let seed = (*surface).seed;
    let wall = (*surface).wall;
    let a = (*surface).along - wall.x;
    let z = (*surface).height - wall.z;
    if ((*surface).albedo.x >= ROOM_ALBEDO_MAX) {
        let folds = noise_at((*surface).along * 13.0, (*surface).height * 0.4, seed) * 0.7 + 0.6;
        (*surface).albedo *= folds;
        (*surface).emission *= folds;
        return;
    }

    // The box, seen from its open front.
    let by_wall = share_of(seed * 0x9e3779b1u);
    let by_depth = share_of(seed * 0x85ebca6bu);
    let by_hue = share_of(seed * 0xc2b2ae35u);
    let by_thing = share_of(seed * 0x27d4eb2fu);
    let level = select(-0.85, -0.05, wall.w > 2.2);
    let head = wall.w + 0.25;
    let beside = by_wall * 1.1 + 0.25;
    let deep = by_depth * 2.6 + 2.4;
    let across = dot(view, vec3f(-facing.y, facing.x, 0.0));
    let into = max(-dot(view, facing), 0.02);
    let to_right = across > 0.0;
    let to_head = view.z > 0.0;
    let side = max(abs(across), 1e-4);
    let rise = max(abs(view.z), 1e-4);
    let by_side = (select(-beside, wall.y + beside, to_right) - a) / select(-side, side, to_right);
    let by_level = (select(level, head, to_head) - z) / select(-rise, rise, to_head);
    let by_back = deep / into;
    let t = min(min(by_side, by_level), by_back);
    let x = across * t + a;
    let y = view.z * t + z;
    let far = into * t;
    let is_back = by_side >= by_back && by_level >= by_back;
    let is_level = by_side >= by_level && !is_back;

    var albedo = mix(vec3f(0.42, 0.40, 0.36), vec3f(0.48, 0.34, 0.22), by_thing) * (by_hue * 0.5 + 0.65);
    if (is_level) {
        albedo = select(mix(vec3f(0.17, 0.11, 0.07), vec3f(0.16, 0.16, 0.17), by_wall), vec3f(0.6), to_head);
    }
    // A cupboard and a picture at the back.
    let place = by_thing * wall.y;
    if (is_back && abs(x - place) < 0.55 && y - level < by_depth * 1.2 + 0.7) {
        albedo = mix(vec3f(0.14, 0.07, 0.035), vec3f(0.3, 0.3, 0.28), by_wall);
    }
    if (is_back && abs(x - place - 1.0) < 0.4 && abs(y - level - 1.65) < 0.3) {
        albedo = mix(vec3f(0.1, 0.2, 0.24), vec3f(0.4, 0.2, 0.08), by_hue);
    }

    // Light through the window, and that of a lamp below the ceiling.
    let day = 0.27 / (far * far * 0.35 + 1.0);
    let to = vec3f(x - wall.y * 0.5, y - head + 0.45, far - deep * 0.5);
    let lamp = 2.4 / (dot(to, to) + 0.9) + 0.5;
    let edge = smoothly(0.0, 0.35, deep - far) * 0.3 + 0.7;
    // A pane hides its room from an eye beside it.
    let low = 1.0 - into;
    let clear = 1.0 - low * low * (low * low);
    (*surface).emission = albedo * (ambient(0.2) * day + (*surface).emission * lamp) * (edge * clear);
}
