// Baked light. `Face` contains the place of a triangle's light in `baked`.

const ON_MAP = 1u;
const ON_CUBE = 2u;
const ON_PART = 3u;

// Light on a surface with a normal. `first` is the number of the cube's first side.
fn cube_light(first: u32, normal: vec3f) -> vec4f {
    let side = select(vec3u(0u), vec3u(1u), normal < vec3f(0.0));
    let squared = normal * normal;
    return squared.x * baked[first + side.x]
        + squared.y * baked[first + 2u + side.y]
        + squared.z * baked[first + 4u + side.z];
}

fn map_light(face: Face, point_m: vec3f) -> vec4f {
    let point = vec4f(point_m, 1.0);
    let size = vec2f(face.light.zw);
    let place = clamp(vec2f(dot(face.light_u, point), dot(face.light_v, point)), vec2f(0.0), size - 1.0);
    let low = min(floor(place), size - 2.0);
    let share = place - low;
    let first = face.light.y + u32(low.y) * face.light.z + u32(low.x);
    let below = first + face.light.z;
    return mix(mix(baked[first], baked[first + 1u], share.x), mix(baked[below], baked[below + 1u], share.x), share.y);
}

fn baked_light(part_number: u32, face: Face, point_m: vec3f, normal: vec3f) -> vec4f {
    switch face.light.x {
        case ON_MAP: {
            return map_light(face, point_m);
        }
        case ON_CUBE: {
            return cube_light(face.light.y, normal);
        }
        default: {
            return cube_light(6u * part_number, normal);
        }
    }
}

// Like `sunlit`, for a wide lamp in the sun's direction.
fn lamplit(point_m: vec3f, normal: vec3f) -> f32 {
    let place = on_sun_map(point_m + normal * view.extra.x);
    let share = on_map_share(place);
    if share <= 0.0 {
        return 1.0;
    }
    let sums = blocked(place, 0);
    if sums.x <= 0.0 {
        return 1.0;
    }
    let ratio = sums.y / (sums.x * HALF_SHADOW_M);
    return 1.0 - sums.x / (1.0 + ratio * ratio) * share;
}

// Linear colour of a surface in baked light, with the shadows of objects.
fn lit_by_baked(light: vec4f, base: vec3f, point_m: vec3f, normal: vec3f, eye_direction: vec3f) -> vec3f {
    let facing_sun = max(dot(normal, view.to_sun.xyz), 0.0);
    var open = 1.0;
    if facing_sun > 0.0 {
        open = lamplit(point_m, normal);
    }
    let shadow = light.w * (1.0 - open) * min(facing_sun / SURE_SLOPE, 1.0);
    let half_way = normalize(eye_direction + view.to_sun.xyz);
    let highlight = HIGHLIGHT * pow(max(dot(normal, half_way), 0.0), 40.0) * facing_sun * open * light.w;
    return (base * light.xyz * (1.0 - shadow) + highlight) * baked_tint();
}

// Factor of baked light.
fn baked_tint() -> vec3f {
    return view.sun.xyz / USUAL_SUN;
}
